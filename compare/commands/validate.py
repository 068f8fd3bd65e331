"""``dualball validate`` and ``dualball judge``: the verdicts."""

import argparse
import json
import math
import textwrap
from collections.abc import Sequence
from pathlib import Path

from rich.console import Console
from rich.table import Table
from rich.text import Text

from compare.campaign import progress
from compare.commands import options, running
from compare.figures import pages
from compare.plan import Level, sets
from compare.report import results, wording
from compare.subjects.catalogue import CLAIMS
from compare.verification.claim import Outcome, Verdict

WIDTH, SAYS = 100, 32
"""Columns of a claim's line, and of what it says, in short."""
_STYLES = {"pass": "green", "fail": "bold red", "other": "yellow", "none": "dim"}


def run(args: argparse.Namespace) -> int:
    from compare import validation  # here, because it loads everything there is

    console, chosen = options.terminal(quiet=args.json), options.own_set(args) or None
    if args.list:
        rows = [[claim.id, claim.source, claim.statement, str(claim.text)] for claim in CLAIMS]
        head_row = ["claim", "source", "statement", "text"]
        options.show(None, False, pages.table("", [head_row, *rows], justify="left"))
        return 0
    titles = iter([head()])

    def announce(verdict: Verdict) -> None:
        for title in titles:  # above the first one, since there may be none
            console.print(title)
        console.print(line(verdict), soft_wrap=True)

    with progress.reporter(args.quiet, timed=True) as show:
        verdicts = validation.validate(
            args.output,
            level=Level[args.level.upper()],
            claims=args.claim,
            sets=chosen,
            limit=args.limit,
            engine=args.engine,
            workers=running.workers(args),
            progress=show,
            announce=announce,
        )
    spared = {Outcome.NOT_RUN, Outcome.INCONCLUSIVE} if chosen else set()
    return _finish(verdicts, spared, args, console)


def judge(args: argparse.Namespace) -> int:
    from compare import validation  # here, because it loads everything there is

    console = options.terminal(quiet=args.json)
    verdicts = validation.judge_stored(args.output, args.claim, args.workers, args.tell)
    console.print(head())
    for verdict in verdicts:
        console.print(line(verdict), soft_wrap=True)
    measured = {check.measurement.set for verdict in verdicts for check in verdict.checks}
    own = {Outcome.INCONCLUSIVE} if measured - {*sets(Level.FULL)} else set()
    return _finish(verdicts, {Outcome.NOT_RUN} | own, args, console)


def _finish(
    verdicts: Sequence[Verdict], spared: set[Outcome], args: argparse.Namespace, console: Console
) -> int:
    """Print what there is, and return the exit code: 0 if all came out as expected, or in a way
    that is spared.

    A set of one's own may be too rough for a claim, or hold no example of it; the study's must not
    be."""
    if args.json:
        print(json.dumps([results.described(verdict) for verdict in verdicts], indent=1))
    for verdict in verdicts if args.verbose else ():
        console.print(detail(verdict), soft_wrap=True)
        console.print(*([checks(verdict)] if verdict.checks else []))
    console.print(summary(verdicts, args.output / results.REPORT), soft_wrap=True)
    return 0 if all(verdict.passed or verdict.outcome in spared for verdict in verdicts) else 1


def head() -> Text:
    """What stands where in the lines of claims."""
    return Text(f"  {'verdict':<13}{'claim':<19}{'says':<{SAYS}}numbers share  beside it", "dim")


def line(verdict: Verdict) -> Text:
    """A claim in a line of at most `WIDTH` columns: verdict, id, what it says in short, how many
    numbers, the worst one's share of its tolerance, and what the engines beside say."""
    kind, mark = wording.MARKS[Outcome.CONFIRMED if verdict.passed else verdict.outcome]
    shown = Text(f"{mark} {verdict.outcome:<13}", _STYLES[kind])
    shown = Text.assemble(shown, f"{verdict.claim.id:<19}")
    if verdict.outcome is Outcome.NOT_RUN or verdict.error or not verdict.checks:
        return shown.append(_short(why_no_numbers(verdict), WIDTH - len(shown.plain)), "dim")
    said = _short(verdict.claim.statement, SAYS)
    shown.append(f"{said:<{SAYS}}{len(verdict.checks):>7} {_share(verdict):>5}  ")
    for each in verdict.engines[1:]:
        if each.outcome is not Outcome.NOT_ASKED:
            kind, mark = wording.MARKS[each.outcome]
            shown.append(f"{each.engine.removeprefix('mujoco-')} ")
            shown.append(f"{mark} ", _STYLES[kind])
    shown.rstrip()
    return shown


def _short(text: str, width: int) -> str:
    return textwrap.shorten(text, width, placeholder="…")


def _share(verdict: Verdict) -> str:
    worst = verdict.worst
    return "–" if not math.isfinite(worst) else f"{worst:.2f}" if worst < 100 else f"{worst:.1e}"


def why_no_numbers(verdict: Verdict) -> str:
    if verdict.error:
        return verdict.error
    if verdict.outcome is Outcome.NOT_RUN and verdict.claim.level > Level.QUICK:
        return f"measured from the {verdict.claim.level.name.lower()} level on"
    return str(verdict.missing[0]) if verdict.missing else "nothing was measured"


def detail(verdict: Verdict) -> Text:
    """All that a verdict says, above the table of its numbers."""
    found = [f"{heading.lower()} {text}" for heading, text in wording.findings(verdict).items()]
    lines = ["", f"{verdict.claim.id}: {verdict.claim.statement}"]
    lines.append("; ".join(found) or why_no_numbers(verdict))
    for each in verdict.engines[1:]:
        if each.outcome is not Outcome.NOT_ASKED:
            lines.append(f"{each.engine}: {wording.engine_sentence(each)}")
    return Text("\n".join(lines))


def summary(verdicts: Sequence[Verdict], report: Path) -> Text:
    """What it means, in three sentences: the engine on trial, those beside, where to look."""
    ran = [verdict for verdict in verdicts if verdict.outcome is not Outcome.NOT_RUN]
    counts = ", ".join(map(" ".join, wording.totals(ran)))
    shown = Text(f"{wording.headline(ran)}: {counts}.", "bold")
    beside = [
        f"{each['title']} confirms {each['confirmed']} of {each['asked']} claims and refutes "
        f"{len(each['refuted'])}"
        for each in wording.engines(ran)[1:]
        if each["asked"] != "0"
    ]
    said = f"\nBeside it {', '.join(beside)}: none of that counts in the exit code." * bool(beside)
    said += f"\nEvery number is in {report}, and printed by --verbose"
    if unsure := wording.coarse_and_missing(ran).rstrip("."):
        said += f"; {unsure}"
    return shown.append(f"{said}.", "not bold")


def checks(verdict: Verdict) -> Table:
    """A table of every measured number of a claim beside its prediction."""
    rows = [
        {
            "set": m.set,
            "ω₀ (rad/s)": f"{m.parameters.omega_0:.6g}",
            "quantity": wording.symbol_and_unit(m),
            "predicted": wording.value(m, check.predicted),
            "measured": wording.value(m, m.value),
            "deviation": wording.size(check.deviation, "+"),
            "tolerance": wording.size(check.tolerance),
            "": wording.mark(check),
            "with": wording.conditions(m.at),
        }
        for check in verdict.checks
        for m in [check.measurement]
    ]
    title = f"{verdict.claim.id}  {verdict.claim.statement}"
    return pages.table(title, pages.by_heading(rows), no_wrap=True)
