"""Tables for the terminal."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

from rich import box
from rich.markup import escape
from rich.table import Table
from rich.text import Text

from compare.claims import Claim, Outcome, Verdict


def verdicts(found: Sequence[Verdict]) -> Iterator[Table]:
    """The numbers of each claim, then the verdicts."""
    for verdict in found:
        if verdict.checks:
            yield checks(verdict)
    table = Table(title="Verdicts", title_justify="left", title_style="bold", box=box.SIMPLE_HEAD)
    for column in ("claim", "source", "statement", "numbers", "verdict"):
        table.add_column(column, no_wrap=column in ("claim", "verdict"))
    for verdict in found:
        judged = [check.passed for check in verdict.checks if check.judged]
        table.add_row(
            verdict.claim.id, verdict.claim.source, escape(verdict.claim.statement),
            f"{sum(judged)}/{len(judged)}", _outcome(verdict),
        )  # fmt: skip
    yield table


def checks(verdict: Verdict) -> Table:
    """Predicted and measured numbers of one claim: those of the leading quantity, and any that failed."""
    judged = [check for check in verdict.checks if check.judged]
    leading = judged[0].quantity if judged else ""
    shown = [check for check in judged if check.quantity == leading or not check.passed]
    others = len(judged) - len(shown)
    table = Table(
        title=f"{verdict.claim.id}  {escape(verdict.claim.statement)}", title_justify="left", title_style="bold",
        box=None, padding=(0, 1, 0, 0), caption_justify="left", header_style="dim",
        caption=f"and {others} numbers of other quantities, all within tolerance, in the report" if others else None,
    )  # fmt: skip
    for column in ("ω₀", "condition", "case", "found", "", "predicted", "measured", "rel.err", "toler.", ""):
        table.add_column(column, justify="left" if column in ("condition", "case", "found") else "right", no_wrap=True)
    for check in shown:
        scale = abs(check.predicted) or 1.0
        table.add_row(
            f"{check.omega_0:g}", check.condition, check.case_predicted, check.case_found, check.quantity,
            f"{check.predicted:.8g}", f"{check.measured:.8g}", f"{check.error / scale:+.0e}",
            f"{check.tolerance / scale:.0e}",
            Text("pass", style="green") if check.passed else Text("FAIL", style="bold red"),
        )  # fmt: skip
    return table


def claims(known: Iterable[Claim]) -> Table:
    """The claims there are."""
    table = Table(box=box.SIMPLE_HEAD)
    for column in ("claim", "source", "statement", "expected"):
        table.add_column(column)
    for claim in known:
        table.add_row(claim.id, claim.source, escape(claim.statement), claim.expected)
    return table


def _outcome(verdict: Verdict) -> Text:
    if not verdict.passed:
        return Text(f"✗ {verdict.outcome}" + (f": {verdict.error}" if verdict.error else ""), style="bold red")
    good = verdict.outcome in (Outcome.CONFIRMED, Outcome.CORRECTED)
    return Text(f"{'✓' if good else '○'} {verdict.outcome}", style="green" if good else "yellow")
