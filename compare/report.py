"""The report: one self-contained page, made from stored results only."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Mapping
from functools import partial
from importlib import resources
from pathlib import Path
from typing import Any

from markdown_it import MarkdownIt
from matplotlib.figure import Figure

from compare import page, pictures, results
from compare.catalogue import CLAIMS
from compare.claims import Claim, Level, Outcome
from compare.figures.characteristic import STATIONARY
from compare.figures.claims import CAPTIONS, FIGURES_OF
from compare.figures.gallery import STORED
from compare.results import Summary
from model.errors import StorageError
from model.files import write_text

_SYMBOLS = {Outcome.CONFIRMED: "✓", Outcome.CORRECTED: "✓", Outcome.REFUTED: "✗", Outcome.FORMAL: "○"}
_NOT_RUN = "not run"
_OPTIONS = {Level.QUICK: " --quick", Level.DEFAULT: "", Level.FULL: " --full"}


def write(directory: Path) -> Path:
    """Make ``report.html`` in a results directory from what is stored there; return its path.

    Raises `model.StorageError` if there is no summary or the page can't be written.
    """
    path, drawn = directory / results.REPORT, directory / results.FIGURES
    summary = results.load(directory)
    try:
        drawn.mkdir(exist_ok=True)
    except OSError as error:
        raise StorageError(f"cannot write to {drawn}: {error.strerror}") from error
    write_text(path, render(summary, directory))
    return path


def render(summary: Summary, directory: Path) -> str:
    """The page as text; a figure or run file that is missing is shown as a gap, with the command that fills it."""
    option = _OPTIONS[Level[summary.level]]
    known = {claim.id: claim for claim in CLAIMS}
    claims = [_row(summary, directory, verdict, option) for verdict in summary.verdicts.values()]
    missing = [_not_run(claim, Level[summary.level]) for name, claim in known.items() if name not in summary.verdicts]
    order = list(known)
    claims = sorted(claims + missing, key=lambda row: order.index(row["id"]) if row["id"] in known else len(order))
    return page.render(
        "report.html",
        summary={"passed": sum(claim["passed"] for claim in claims), "total": len(summary.verdicts)},
        headline=_headline(claims),
        lead=_lead(summary),
        tiles=_tiles(claims),
        figures=_figures(summary, directory),
        claims=claims,
        outcomes=sorted({claim["outcome"] for claim in claims}),
        errata=errata(),
        number=_number,
        provenance=_provenance(summary),
    )


def errata() -> str:
    """The errata of the paper as HTML; links into the source tree, which a page by itself can't follow, are text."""
    text = (resources.files("compare") / "templates" / "errata.md").read_text("utf-8")
    made: str = MarkdownIt("commonmark", {"html": False}).enable("table").render(text)
    made = re.sub(r"<h1>.*?</h1>", "", made)  # the page has a heading for it
    made = re.sub(r"(</?h)2>", r"\g<1>3>", made)
    made = re.sub(r'<a href="(?!https?:)[^"]*">(.*?)</a>', r"\1", made)
    made = made.replace(
        "<table>", '<div class="scroll" tabindex="0" role="region" aria-label="Errata"><table class="prose">'
    )
    return made.replace("</table>", "</table></div>")


def _row(summary: Summary, directory: Path, verdict: Mapping[str, Any], option: str) -> dict[str, Any]:
    outcome, good = Outcome(verdict["outcome"]), verdict["passed"]
    mark = "fail" if not good else "pass" if outcome in (Outcome.CONFIRMED, Outcome.CORRECTED) else "other"
    repeat = f"dualball validate --claim {verdict['id']}{option} -o {directory}"
    lost = {check["run"] for check in verdict["checks"] if check["run"] and not (directory / check["run"]).is_file()}
    gaps = [f"{len(lost)} run files are missing" if len(lost) > 1 else "A run file is missing"] if lost else []
    figure = ""
    if verdict["checks"] and verdict["id"] in FIGURES_OF:
        try:
            figure = _picture(directory, verdict["id"], verdict, lambda: FIGURES_OF[verdict["id"]](summary, directory))
        except StorageError as error:
            gaps.append(f"The figure can't be drawn: {error}")
    return {
        **verdict,
        "mark": mark,
        "symbol": _SYMBOLS.get(outcome, "✗") if good else "✗",
        "figure": figure,
        "caption": CAPTIONS.get(verdict["id"], ""),
        "gaps": gaps,
        "lost": lost,
        "repeat": repeat,
    }


def _not_run(claim: Claim, level: Level) -> dict[str, Any]:
    """The row of a claim without a verdict: missing, or part of a deeper level than the one that was run."""
    deeper = claim.level > level
    outcome = f"at level {claim.level.name.lower()}" if deeper else _NOT_RUN
    gap = f"Part of the {claim.level.name.lower()} level, not of {level.name.lower()}" if deeper else "Not run yet"
    texts = {
        name: getattr(claim, name) for name in ("id", "source", "statement", "prediction", "measurement", "tolerance")
    }
    blank = {"reason": "", "error": "", "checks": [], "figure": "", "caption": "", "lost": set(), "passed": False}
    repeat = f"dualball validate --claim {claim.id}{_OPTIONS[max(level, claim.level)]}"
    return {
        **texts, **blank, "outcome": outcome, "mark": "none", "symbol": "…", "gaps": [gap], "repeat": repeat
    }  # fmt: skip


def _headline(claims: list[dict[str, Any]]) -> str:
    ran = [claim for claim in claims if claim["mark"] != "none"]
    failed = [claim["id"] for claim in ran if not claim["passed"]]
    if failed:
        return f"{len(failed)} of {len(ran)} claims did not come out as expected: {', '.join(failed)}"
    if not ran:
        return "Nothing has been checked yet"
    counts = Counter(claim["outcome"] for claim in ran)
    return "The paper and the engine agree: " + ", ".join(f"{n} {name}" for name, n in counts.most_common())


def _lead(summary: Summary) -> str:
    omega = [
        abs(check["error"] / check["predicted"])
        for claim in STATIONARY & set(summary.verdicts)
        for check in summary.verdicts[claim]["checks"]
        if check["quantity"] == "ω_c" and check["predicted"]
    ]
    if not omega:
        return "A ball rolls and slips round a cylinder; its closed-form theory is held against simulation."
    return (
        "A ball rolls and slips round a cylinder. Its angular velocity ω_c, predicted in closed form by Antali and "
        f"Stépán, was measured in {len(omega)} runs to stationary states; the largest relative deviation is "
        f"{max(omega):.1e}."
    )


def _tiles(claims: list[dict[str, Any]]) -> list[dict[str, str]]:
    checks = [check for claim in claims for check in claim["checks"] if check["judged"]]
    ran = [claim for claim in claims if claim["mark"] != "none"]
    rest = Counter(claim["outcome"] for claim in claims if claim["mark"] == "none")
    more = "".join(f", {n} more {outcome}" for outcome, n in rest.items())
    runs = {check["run"] for claim in claims for check in claim["checks"] if check["run"]}
    return [
        {"value": f"{sum(c['passed'] for c in claims)}/{len(ran)}", "label": f"claims as expected{more}"},
        {"value": f"{sum(c['passed'] for c in checks)}/{len(checks)}", "label": "numbers within tolerance"},
        {"value": str(len(runs)), "label": "simulations"},
    ]


def _figures(summary: Summary, directory: Path) -> list[dict[str, str]]:
    """The figures over all claims; a gap stands for one whose results are missing."""
    shown = []
    for name, stored in STORED.items():
        told = {"id": f"figure-{name}", "title": stored.title, "caption": stored.caption, "picture": "", "gap": ""}
        try:
            told["picture"] = _picture(directory, name, summary.verdicts, partial(stored.draw, summary))
        except StorageError as error:
            told["gap"] = str(error)
        shown.append(told)
    return shown


def _picture(directory: Path, name: str, shows: Any, draw: Callable[[], Figure]) -> str:
    """A picture drawn now or earlier; `shows` is what it is drawn from."""
    return pictures.kept(directory / results.FIGURES / f"{name}.svg", shows, draw)


def _number(value: float) -> str:
    """A number of a table: round-off is told by its size alone."""
    return f"{value:.9g}" if value == 0 or abs(value) >= 1e-4 else f"{value:.1e}"


def _provenance(summary: Summary) -> dict[str, str]:
    found = summary.provenance
    return {
        "made": found.get("created", ""),
        "level": summary.level.lower(),
        "versions": ", ".join(f"{name} {version}" for name, version in found.get("versions", {}).items()),
        "commit": found.get("commit", "") or "not from a checkout",
        "machine": found.get("machine", ""),
    }
