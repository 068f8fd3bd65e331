"""The report: one self-contained page, from verdicts and the measurements behind them."""

from __future__ import annotations

import functools
import math
import operator
import re
from collections.abc import Mapping, Sequence
from importlib import resources
from pathlib import Path
from typing import Any

from markdown_it import MarkdownIt

from compare import pages
from compare.claims.claim import Outcome, Verdict
from compare.figures.drawing import Drawing, GapError, Material
from compare.figures.registry import FIGURES, figures_of
from compare.measure.levels import Level
from compare.measure.record import Records
from compare.report import pictures, results, wording
from compare.report.results import Summary
from compare.runs.workers import Spread
from model import storage
from model.errors import StorageError
from model.files import make_directory, write_text

ROWS = 40
"""Checks of a claim that are listed, the worst first; a longer page would open slowly."""
REASONS = 12
"""Reasons for what was not measured that are listed for a claim."""
Shown = dict[str, Any]
"""What the page shows of a figure."""
_OPTIONS = {Level.QUICK: " --quick", Level.DEFAULT: "", Level.FULL: " --full"}


def write(material: Material, verdicts: Sequence[Verdict], summary: Summary, spread: Spread = map) -> Path:
    """Write ``summary.json`` and ``report.html`` into the material's results directory; return the page's path.

    Figures are drawn by what `spread` makes of a `map`. Raises `model.StorageError` if it can't be written.
    """
    directory = material.directory
    results.save(summary, directory)
    make_directory(directory / results.FIGURES)
    path = directory / results.REPORT
    write_text(path, render(material, verdicts, summary, spread))
    return path


def render(material: Material, verdicts: Sequence[Verdict], summary: Summary, spread: Spread = map) -> str:
    """The page as text; what was not run is named in one line, a figure that can't be drawn is a gap."""
    directory, ran = material.directory, [verdict for verdict in verdicts if verdict.outcome is not Outcome.NOT_RUN]
    option = _OPTIONS[Level[summary.level]]
    judged, sections = {verdict.claim.id for verdict in ran}, dict.fromkeys(verdict.claim.section for verdict in ran)
    free = {name: each for name, each in FIGURES.items() if not judged & set(each.claims)}
    beside = {verdict.claim.id: figures_of(verdict.claim.id) for verdict in ran if verdict.checks}
    figures = _figures(material, functools.reduce(operator.or_, beside.values(), free), spread)
    rows = [
        _row(material, verdict, option, [figures[name] for name in beside.get(verdict.claim.id, ())]) for verdict in ran
    ]
    drawn = [figures[name] | {"background": each.background or bool(each.claims)} for name, each in free.items()]
    return pages.render(
        "compare.report",
        "report.html",
        title=f"{sum(verdict.passed for verdict in ran)} of {len(ran)} claims as expected",
        headline=wording.headline(ran),
        lead=_lead(ran),
        tiles=_tiles(ran, material.records),
        figures=[each for each in drawn if not each["background"] and not each["gap"]],
        background=[each for each in drawn if each["background"] and not each["gap"]],
        sections=[(name, [row for row in rows if row["claim"].section == name]) for name in sections],
        outcomes=sorted({verdict.outcome for verdict in ran}),
        wording=wording,
        run_of=lambda m: next((name for name in m.runs if storage.exists(directory / name)), ""),
        not_run=[verdict.claim for verdict in verdicts if verdict.outcome is Outcome.NOT_RUN],
        not_drawn=[f"{each['title']}: {each['gap']}" for each in drawn if each["gap"]],
        command=f"dualball validate --full -o {directory}",
        errata=errata(),
        provenance=_provenance(summary),
    )


@functools.cache
def errata() -> str:
    """The errata of the paper as HTML; links into the source tree, which a page by itself can't follow, are text."""
    text = (resources.files("compare.report") / "templates" / "errata.md").read_text("utf-8")
    made: str = MarkdownIt("commonmark", {"html": False}).enable("table").render(text)
    made = re.sub(r"<h1>.*?</h1>", "", made)  # the page has a heading for it
    made = re.sub(r"(</?h)2>", r"\g<1>3>", made)
    made = re.sub(r'<a href="(?!https?:)[^"]*">(.*?)</a>', r"\1", made)
    made = made.replace(
        "<table>", '<div class="scroll" tabindex="0" role="region" aria-label="Errata"><table class="prose">'
    )
    return made.replace("</table>", "</table></div>")


def _row(material: Material, verdict: Verdict, option: str, figures: Sequence[Shown]) -> dict[str, Any]:
    """What the page shows of a claim besides claim and verdict themselves."""
    claim = verdict.claim
    mark, symbol = wording.MARKS[verdict.outcome]
    missing = verdict.missing[:REASONS]
    more = len(verdict.missing) - len(missing)
    return {
        "claim": claim,
        "verdict": verdict,
        "mark": "other" if verdict.passed and mark == "fail" else mark,
        "symbol": symbol,
        "predicted": list(dict.fromkeys(bearing.by for bearing in claim.bearings if bearing.by)),
        "missing": [*missing, f"and {more} more, see {results.SUMMARY}"] if more else missing,
        "checks": wording.ranked(verdict.checks)[:ROWS],
        "figures": figures,
        "repeat": f"dualball validate --claim {claim.id}{option} -o {material.directory}",
    }


def _figures(material: Material, drawings: Mapping[str, Drawing], spread: Spread) -> dict[str, Shown]:
    """Every figure: a picture with its caption, or why there is none."""
    shown, new = {}, []
    for name, drawing in drawings.items():
        path = material.directory / results.FIGURES / f"{name}.svg"
        try:
            data = drawing.select(material)
        except GapError as error:
            shown[name] = _figure(path, drawing, gap=str(error))
        else:
            if kept := pictures.kept(path, drawing, data):
                shown[name] = _figure(path, drawing, *kept)
            else:
                new.append((path, drawing, data))
    new.reverse()  # the last ones take longest
    return shown | {path.stem: figure for (path, *_), figure in zip(new, spread(_drawn, new), strict=True)}


def _drawn(new: tuple[Path, Drawing, Any]) -> Shown:
    path, drawing, data = new
    try:
        return _figure(path, drawing, *pictures.drawn(path, drawing, data))
    except (GapError, StorageError) as error:
        return _figure(path, drawing, gap=str(error))


def _figure(path: Path, drawing: Drawing, picture: str = "", caption: str = "", gap: str = "") -> Shown:
    return {"id": f"figure-{path.stem}", "title": drawing.title, "picture": picture, "caption": caption, "gap": gap}


def _lead(ran: Sequence[Verdict]) -> str:
    what = "A ball rolls and slips round a cylinder. "
    stationary = [check for verdict in ran for check in verdict.checks if verdict.claim.section == "Stationary states"]
    turning = [check for check in stationary if check.measurement.quantity == "omega_c"]
    orbits = [check for check in turning if math.isfinite(check.predicted) and check.scale > 0]
    if not orbits:
        return what + "Its closed-form theory by Antali and Stépán is held against simulation."
    largest = max(abs(check.deviation / check.scale) for check in orbits)
    return what + (
        "Its angular velocity ω_c in stationary states, predicted in closed form by Antali and Stépán, was measured "
        f"{len(orbits)} times; the largest relative deviation is {largest:.1e}."
    )


def _tiles(ran: Sequence[Verdict], records: Records) -> list[dict[str, str]]:
    checks = [check for verdict in ran for check in verdict.checks]
    runs = {name for m in records.measurements for name in m.runs}
    sets = {m.set for m in records.measurements}
    return [
        {"value": f"{sum(verdict.passed for verdict in ran)}/{len(ran)}", "label": "claims as expected"},
        {"value": f"{sum(check.agrees for check in checks)}/{len(checks)}", "label": "numbers within tolerance"},
        {"value": f"{sum(check.conclusive for check in checks)}/{len(checks)}", "label": "fine enough to tell"},
        {"value": str(len(runs)), "label": f"simulations with {len(sets)} parameter sets"},
    ]


def _provenance(summary: Summary) -> Mapping[str, str]:
    known = summary.provenance
    return {
        "made": known.get("created", ""),
        "level": summary.level.lower(),
        "versions": ", ".join(f"{name} {version}" for name, version in known.get("versions", {}).items()),
        "commit": known.get("commit", "") or "not from a checkout",
        "machine": known.get("machine", ""),
        "measurements": ", ".join(summary.measurements) or "none",
    }
