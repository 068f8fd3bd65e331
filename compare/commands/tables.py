"""Verdicts for the terminal: a line a claim, a summary, and every number for those who ask."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from rich.table import Table
from rich.text import Text

from compare.claim import Claim, Outcome, Verdict
from compare.kit import pages
from compare.report import wording

_STYLES = {"pass": "green", "fail": "bold red", "other": "yellow", "none": "dim"}


def line(verdict: Verdict) -> Text:
    """A claim in one line: verdict, largest deviation, what error of theory would be noticed, or what went wrong."""
    kind, mark = wording.MARKS[Outcome.CONFIRMED if verdict.passed else verdict.outcome]
    shown = Text.assemble((f"{mark} {verdict.outcome:<13}", _STYLES[kind]), f"{verdict.claim.id:<18}")
    if verdict.checks:
        found = [f"{heading.lower()} {text}" for heading, text in wording.findings(verdict).items()]
        count = len(verdict.checks)
        shown.append("; ".join([f"{count:>5} number{'s' if count > 1 else ''}", *found]))
    if verdict.error:
        shown.append(f"  {verdict.error}", "red")
    if verdict.outcome is Outcome.NOT_RUN and verdict.missing:
        shown.append(f"  {verdict.missing[0]}", "dim")
    return shown


def summary(verdicts: Sequence[Verdict]) -> Text:
    """How many claims and numbers came out how."""
    ran = [verdict for verdict in verdicts if verdict.outcome is not Outcome.NOT_RUN]
    return Text("; ".join([wording.headline(ran), *map(" ".join, wording.totals(ran))]), "bold")


def checks(verdict: Verdict) -> Table:
    """Every number of one claim."""
    rows = [["set", "ω₀ (rad/s)", "quantity", "predicted", "measured", "deviation", "tolerance", ""]]
    for check in verdict.checks:
        m = check.measurement
        numbers = wording.value(m, check.predicted), wording.value(m, m.value)
        sizes = wording.size(check.deviation, "+"), wording.size(check.tolerance)
        mark = ("pass" if check.conclusive else "coarse") if check.agrees else "FAIL"
        rows.append([m.set, f"{m.parameters.omega_0:.6g}", wording.SYMBOLS[m.quantity], *numbers, *sizes, mark])
    return pages.table(f"{verdict.claim.id}  {verdict.claim.statement}", rows, no_wrap=True)


def claims(known: Iterable[Claim]) -> Table:
    """The claims there are."""
    rows = [[claim.id, claim.source, claim.statement, str(claim.text)] for claim in known]
    return pages.table("", [["claim", "source", "statement", "text"], *rows], justify="left")
