"""The report: one self-contained page, from verdicts and the measurements behind them."""

import base64
import functools
import json
import math
import re
import zlib
from collections.abc import Mapping, Sequence
from importlib import resources
from pathlib import Path
from typing import Any

from markdown_it import MarkdownIt

from compare.campaign.workers import Spread
from compare.figures import pages
from compare.figures.drawing import Evidence, Figures
from compare.method.record import Check, Measurement, Records
from compare.plan import Level
from compare.report import deviations, results, wording
from compare.report.gallery import FIGURES, figures_of, pictures
from compare.report.results import Summary
from compare.verification.claim import Outcome, Verdict
from model import storage
from model.files import write_text

ROWS = 12
"""Checks of a claim that are listed, the worst first; the page searches them all."""
REASONS = 12
"""Reasons for what was not measured that are listed for a claim."""
_OPTIONS = {Level.QUICK: " --quick", Level.DEFAULT: "", Level.FULL: " --full"}


def write(
    evidence: Evidence, verdicts: Sequence[Verdict], summary: Summary, spread: Spread = map
) -> Path:
    """Write ``summary.json`` and ``report.html`` into the directory; return the page's path.

    What was not run is named in one line. Figures are drawn by `spread`, a `map`. Raises
    `model.StorageError` if it can't be written."""
    directory = evidence.directory
    results.save(summary, directory)
    ran = [verdict for verdict in verdicts if verdict.outcome is not Outcome.NOT_RUN]
    free = {name: each for name, each in FIGURES.items() if not each.claims}
    beside = {verdict.claim.id: figures_of(verdict.claim.id) for verdict in ran if verdict.checks}
    drawings = dict(free)
    for own in beside.values():
        drawings |= own
    figures, letters = pictures(evidence, drawings, spread)
    first = "characteristic"  # a meter's reading by theory and every engine: what all is about
    apart = [figures[name] for name in sorted(free, key=lambda name: name != first)]
    measured = evidence.records.measurements
    runs, sets = {name for m in measured for name in m.runs}, {m.set for m in measured}
    name = directory.resolve().name
    page = pages.render(
        "compare.report",
        "report.html",
        letters=letters,
        title=f"{len(ran)} claims: {', '.join(map(' '.join, wording.by_kind(ran)))}",
        headline=wording.headline(ran),
        missing=wording.coarse_and_missing(ran),
        lead=f"A ball rolls and slips round inside a cylinder. {_opening_sentence(ran)}",
        exceptions=[verdict for verdict in ran if verdict.outcome is not Outcome.CONFIRMED],
        engines=wording.engines(ran),
        deviations=deviations.distribution(ran),
        answers=wording.answers(ran),
        tiles=[
            *wording.totals(ran),
            (str(len(runs)), f"simulations with {len(sets)} parameter sets"),
        ],
        figures=[figure for figure in apart if not figure["gap"]],
        sections=_sections(ran, beside, figures, f"{_OPTIONS[Level[summary.level]]} -o {name}"),
        outcomes=sorted({verdict.outcome for verdict in ran}),
        beside=sorted(
            {f"{each.engine}: {each.outcome}" for verdict in ran for each in verdict.engines[1:]}
        ),
        wording=wording,
        run_of=lambda m: next((name for name in m.runs if storage.exists(directory / name)), ""),
        numbers=packed(columns(evidence.records, {v.claim.id: v.checks for v in ran})),
        not_run=[verdict.claim for verdict in verdicts if verdict.outcome is Outcome.NOT_RUN],
        not_drawn=[f"{figure['title']}: {figure['gap']}" for figure in apart if figure["gap"]],
        command=f"dualball validate --full -o {name}",
        errata=errata(),
        provenance=_provenance(summary),
    )
    write_text(path := directory / results.REPORT, page)
    return path


def _sections(
    ran: Sequence[Verdict],
    beside: Mapping[str, Figures],
    figures: Mapping[str, dict[str, str]],
    repeat: str,
) -> dict[str, list[dict[str, Any]]]:
    """The rows of claims by sections, with their figures: one of several claims stands beside the
    first. `repeat` is the end of the command that measures a claim again."""
    shown: dict[str, str] = {}
    sections: dict[str, list[dict[str, Any]]] = {}
    for verdict in ran:
        claim, own = verdict.claim, beside.get(verdict.claim.id, {})
        row = _row(verdict) | {
            "figures": [figures[name] for name in own if name not in shown],
            "elsewhere": [(figures[name], shown[name]) for name in own if name in shown],
            "repeat": f"dualball validate --claim {claim.id}{repeat}",
        }
        shown = dict.fromkeys(own, claim.id) | shown
        sections.setdefault(claim.section, []).append(row)
    return sections


def _provenance(summary: Summary) -> dict[str, str]:
    known = summary.provenance
    versions = known.get("versions", {})
    files = sum(len(names) for steps in summary.measurements.values() for names in steps.values())
    return {
        "made": known.get("created", ""),
        "level": summary.level.lower(),
        "versions": ", ".join(f"{name} {version}" for name, version in versions.items()),
        "commit": known.get("commit", "") or "not from a checkout",
        "machine": known.get("machine", ""),
        "measurements": f"{files} files, listed in {results.SUMMARY}",
    }


def _row(verdict: Verdict) -> dict[str, Any]:
    """A claim's verdict with marks, missing numbers and worst checks, for the page's template."""
    mark, symbol = wording.MARKS[verdict.outcome]
    more = len(verdict.missing) - REASONS
    unseen = [f"and {more} more, see {results.SUMMARY}"] if more > 0 else []
    return {
        "claim": verdict.claim,
        "verdict": verdict,
        "mark": "other" if verdict.passed and mark == "fail" else mark,
        "symbol": symbol,
        "predicted": list(dict.fromkeys(each.by for each in verdict.claim.criteria if each.by)),
        "missing": [*map(str, verdict.missing[:REASONS]), *unseen],
        "checks": wording.ranked(verdict.checks)[:ROWS],
    }


def _opening_sentence(ran: Sequence[Verdict]) -> str:
    """How far the orbit of stationary states is from theory, in a sentence."""
    off = [
        abs(check.deviation / check.scale)
        for verdict in ran
        if verdict.claim.section == "Stationary states"
        for check in verdict.checks
        if check.measurement.quantity == "omega_c"
        if math.isfinite(check.predicted) and check.scale > 0
    ]
    if not off:
        return "Its closed-form theory by Antali and Stépán is held against simulation."
    return (
        "Antali and Stépán predict its angular velocity ω_c in closed form. In stationary states "
        f"it was measured {len(off)} times, and is off by {wording.percent(max(off))} at most."
    )


@functools.cache
def errata() -> str:
    """The errata of the paper as HTML; links into the source tree are text."""
    text = (resources.files("compare.report") / "templates" / "errata.md").read_text("utf-8")
    made: str = MarkdownIt("commonmark", {"html": False}).enable("table").render(text)
    made = re.sub(r"<h1>.*?</h1>", "", made)  # the page has a heading for it
    made = re.sub(r"(</?h)2>", r"\g<1>3>", made)
    made = re.sub(r'<a href="(?!https?:)[^"]*">(.*?)</a>', r"\1", made)
    region = '<div class="scroll" tabindex="0" role="region" aria-label="Errata">'
    made = made.replace("<table>", f'{region}<table class="prose">')
    return made.replace("</table>", "</table></div>")


def columns(records: Records, checks: Mapping[str, Sequence[Check]]) -> dict[str, list[Any]]:
    """Columns of the page's searchable table: each check, and each unjudged measurement."""

    # the same for a copy that another process has judged
    def identity(m: Measurement) -> tuple[Any, ...]:
        conditions = tuple(sorted(m.at.items()))
        return m.protocol, m.quantity, m.engine, m.set, m.parameters.omega_0, m.value, conditions

    def rounded(m: Measurement, value: float) -> float | str:
        """With two digits of its uncertainty, nine in all at most; cases by their names."""
        if not math.isfinite(value) or m.quantity in ("case", "cases"):
            return wording.value(m, value)
        digits = 1 - math.floor(math.log10(m.uncertainty)) if m.uncertainty else 15
        return float(f"{round(value, digits):.9g}") + 0.0  # no negative zero

    judged = [(claim, check.measurement, check) for claim, own in checks.items() for check in own]
    known = {identity(m) for _, m, _ in judged}
    rows = [*judged, *(("", m, None) for m in records.measurements if identity(m) not in known)]
    return {
        "set": [m.set for _, m, _ in rows],
        "omega_0": [float(f"{m.parameters.omega_0:.6g}") for _, m, _ in rows],
        "quantity": [wording.symbol_and_unit(m) for _, m, _ in rows],
        "conditions": [wording.conditions(m.at) for _, m, _ in rows],
        "engine": [m.engine for _, m, _ in rows],
        "measured": [rounded(m, m.value) for _, m, _ in rows],
        "uncertainty": [float(f"{m.uncertainty:.2g}") for _, m, _ in rows],
        "relation": [c.relation.replace("=", "") if c else "" for *_, c in rows],
        "predicted": [rounded(m, c.predicted) if c else "" for _, m, c in rows],
        "deviation": [
            float(f"{c.deviation:.2g}") if c and math.isfinite(c.deviation) else ""
            for *_, c in rows
        ],
        "tolerance": [float(f"{c.tolerance:.2g}") if c else "" for *_, c in rows],
        "claim": [claim for claim, *_ in rows],
        "mark": [wording.mark(c) if c else "" for *_, c in rows],
    }


def packed(of: Mapping[str, Sequence[Any]]) -> str:
    """Columns and their texts typeset, as JSON, deflated, in base64: a tenth as long."""
    shown = {
        text: pages.typeset(text) for text in dict.fromkeys([*of["quantity"], *of["conditions"]])
    }
    text = json.dumps({**of, "typeset": shown}, ensure_ascii=False, separators=(",", ":"))
    return base64.b64encode(zlib.compress(text.encode(), 9)).decode()
