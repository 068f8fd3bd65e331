"""Verdicts for the terminal: a line a claim, a summary, and every number for those who ask."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Sequence

from rich import box
from rich.markup import escape
from rich.table import Table
from rich.text import Text

from compare.claims.claim import Claim, Outcome, Verdict
from compare.claims.claim import Text as Kind
from compare.measure.quantities import quantity
from compare.report import wording

_STYLES = {"pass": "green", "fail": "bold red", "other": "yellow", "none": "dim"}


def line(verdict: Verdict) -> Text:
    """A claim in one line: verdict, worst deviation over tolerance, resolving power; what went wrong below it."""
    kind, mark = wording.MARKS[Outcome.CONFIRMED if verdict.passed else verdict.outcome]
    style = _STYLES[kind]
    shown = Text.assemble((f"{mark} {verdict.outcome:<13}", style), f"{verdict.claim.id:<18}")
    if verdict.checks:
        shown.append(f"{len(verdict.checks):>5} numbers, worst {_ratio(verdict.worst)} of its tolerance")
        power = [f"{quantity(name).symbol} {value:.0e}" for name, value in verdict.resolving_power.items()]
        shown.append("; notices " + ", ".join(power[:4]) + (" …" if len(power) > 4 else "") if power else "", "dim")
    if verdict.error:
        shown.append(f"  {verdict.error}", "red")
    if verdict.outcome is Outcome.NOT_RUN and verdict.missing:
        shown.append(f"  {verdict.missing[0]}", "dim")
    return shown


def summary(verdicts: Sequence[Verdict]) -> Text:
    """How many came out as expected, and how."""
    counts = Counter(verdict.outcome for verdict in verdicts)
    ran = [verdict for verdict in verdicts if verdict.outcome is not Outcome.NOT_RUN]
    numbers = sum(len(verdict.checks) for verdict in ran)
    corrected = sum(v.claim.text is Kind.CORRECTED and v.passed for v in ran)
    text = f"{sum(v.passed for v in ran)} of {len(ran)} claims came out as expected: "
    text += ", ".join(f"{n} {outcome}" for outcome, n in counts.items())
    return Text(f"{text}; {numbers} numbers; {corrected} hold once an erratum is corrected", "bold")


def checks(verdict: Verdict) -> Table:
    """Every number of one claim."""
    title = Text(f"{verdict.claim.id}  {verdict.claim.statement}", "bold")
    table = Table(title=title, title_justify="left", box=None, padding=(0, 1, 0, 0), header_style="dim")
    for column in ("set", "ω₀", "", "predicted", "measured", "deviation", "tolerance", ""):
        table.add_column(column, justify="left" if column == "set" else "right", no_wrap=True)
    for check in verdict.checks:
        m = check.measurement
        mark = Text("pass", "green") if check.agrees and check.conclusive else Text("coarse", "yellow")
        predicted = "none" if math.isnan(check.predicted) else f"{check.predicted:.9g}"
        numbers = predicted, f"{m.value:.9g}", f"{check.deviation:+.1e}", f"{check.tolerance:.1e}"
        mark = mark if check.agrees else Text("FAIL", "bold red")
        table.add_row(m.set, f"{m.parameters.omega_0:.6g}", quantity(m.quantity).symbol, *numbers, mark)
    return table


def claims(known: Iterable[Claim]) -> Table:
    """The claims there are."""
    table = Table(box=box.SIMPLE_HEAD)
    for column in ("claim", "source", "statement", "text"):
        table.add_column(column)
    for claim in known:
        table.add_row(claim.id, claim.source, escape(claim.statement), claim.text)
    return table


def _ratio(value: float) -> str:
    return "beyond all" if math.isinf(value) else f"{value:.2g}"
