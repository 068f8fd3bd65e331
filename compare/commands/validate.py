"""``dualball validate`` and ``dualball judge``: the verdicts."""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence

from rich.console import Console
from rich.table import Table
from rich.text import Text

from compare.catalogue import CLAIMS
from compare.claim import Outcome, Verdict
from compare.commands import options, running
from compare.kit import pages, progress
from compare.kit.levels import Level, sets
from compare.kit.pages import readable
from compare.report import results, wording

_STYLES = {"pass": "green", "fail": "bold red", "other": "yellow", "none": "dim"}


def run(args: argparse.Namespace) -> int:
    """Measure and judge claims, or list them; return the exit code."""
    from compare import validation  # here, because it loads everything there is

    console, chosen = options.terminal(quiet=args.json), options.own_set(args) or None
    if args.list:
        rows = [[claim.id, claim.source, claim.statement, str(claim.text)] for claim in CLAIMS]
        options.terminal().print(
            pages.table("", [["claim", "source", "statement", "text"], *rows], justify="left")
        )
        return 0
    with progress.reporter(quiet=args.quiet or args.json) as show:
        wanted = {
            "level": Level[args.level.upper()],
            "claims": args.claim,
            "sets": chosen,
            "limit": args.limit,
            "engine": args.engine,
        }
        wanted |= {"workers": running.workers(args), "progress": show}
        wanted |= {"announce": lambda verdict: console.print(line(verdict), soft_wrap=True)}
        verdicts = validation.validate(args.output, **wanted)
    return _finish(
        verdicts, {Outcome.NOT_RUN, Outcome.INCONCLUSIVE} if chosen else set(), args, console
    )


def judge(args: argparse.Namespace) -> int:
    """Judge the stored measurements of a validation again; return the exit code."""
    from compare import validation  # here, because it loads everything there is

    console = options.terminal(quiet=args.json)
    verdicts = validation.judge_stored(args.output, args.claim, args.workers)
    for verdict in verdicts:
        console.print(line(verdict), soft_wrap=True)
    known = sets(Level.FULL)
    own = any(
        check.measurement.set not in known for verdict in verdicts for check in verdict.checks
    )
    return _finish(
        verdicts,
        {Outcome.NOT_RUN, Outcome.INCONCLUSIVE} if own else {Outcome.NOT_RUN},
        args,
        console,
    )


def _finish(
    verdicts: Sequence[Verdict], spared: set[Outcome], args: argparse.Namespace, console: Console
) -> int:
    """Print what there is, and return the exit code: 0 if all came out as expected, or in a way
    that is spared.

    A set of one's own may be too rough for a claim, or hold no example of it; the study's must not
    be."""
    if args.json:
        print(json.dumps([results.described(verdict) for verdict in verdicts], indent=1))
    if args.verbose:
        console.print(*(checks(verdict) for verdict in verdicts if verdict.checks))
    console.print(summary(verdicts), soft_wrap=True)
    console.print(f"report: {args.output / results.REPORT}")
    return 0 if all(verdict.passed or verdict.outcome in spared for verdict in verdicts) else 1


def line(verdict: Verdict) -> Text:
    """A claim in one line: verdict, largest deviation, what error of theory would be noticed, or
    what went wrong."""
    kind, mark = wording.MARKS[Outcome.CONFIRMED if verdict.passed else verdict.outcome]
    expected = ", as expected" if verdict.passed and verdict.outcome is Outcome.REFUTED else ""
    shown = Text.assemble(
        (f"{mark} {verdict.outcome + expected:<13}", _STYLES[kind]), f" {verdict.claim.id:<18} "
    )
    parts = []
    if verdict.checks:
        found = [f"{heading.lower()} {text}" for heading, text in wording.findings(verdict).items()]
        count = len(verdict.checks)
        parts.append(Text("; ".join([f"{count:>4} number{'s' if count > 1 else ''}", *found])))
    elif verdict.error:
        parts.append(Text(verdict.error, "red"))
    elif verdict.outcome is Outcome.NOT_RUN and verdict.claim.level > Level.QUICK:
        parts.append(Text(f"measured from the {verdict.claim.level.name.lower()} level on", "dim"))
    elif verdict.missing:
        parts.append(Text(str(verdict.missing[0]), "dim"))
    for each in (said for said in verdict.engines[1:] if said.outcome is not Outcome.NOT_ASKED):
        kind, mark = wording.MARKS[each.outcome]
        parts.append(
            Text.assemble(
                f"{each.engine} ", (f"{mark} {wording.engine_outcome(each)}", _STYLES[kind])
            )
        )
    return shown.append(Text("; ").join(parts))


def summary(verdicts: Sequence[Verdict]) -> Text:
    """The outcome in a sentence, with counts of claims and numbers; and a line for each engine
    beside."""
    ran = [verdict for verdict in verdicts if verdict.outcome is not Outcome.NOT_RUN]
    counts = "; ".join(map(" ".join, wording.totals(ran)))
    shown = Text(
        f"{wording.headline(ran)}: {counts}. {wording.coarse_and_missing(ran)}".strip(), "bold"
    )
    for each in (each for each in wording.engines(ran) if each["asked"] != "0"):
        counts = f"{each['confirmed']} of {each['asked']} claims confirmed (to {each['to']}), "
        counts += f"{len(each['refuted'])} refuted, {each['open']} undecided"
        off = f"typical deviation {each['typical']}, worst {each['worst']}"
        shown.append(f"\n{each['engine']} ({each['title']}): {counts}; {off}", "not bold")
    return shown


def checks(verdict: Verdict) -> Table:
    """A table of every measured number of a claim beside its prediction."""
    rows = [
        [
            "set",
            "ω₀ (rad/s)",
            "quantity",
            "predicted",
            "measured",
            "deviation",
            "tolerance",
            "",
            "with",
        ]
    ]
    for check in verdict.checks:
        m = check.measurement
        numbers = wording.value(m, check.predicted), wording.value(m, m.value)
        sizes = wording.size(check.deviation, "+"), wording.size(check.tolerance)
        found = [
            f"{wording.SYMBOLS[m.quantity]} {readable(m.unit)}".rstrip(),
            *numbers,
            *sizes,
            wording.mark(check),
        ]
        rows.append(
            [m.set, f"{m.parameters.omega_0:.6g}", *found, wording.conditions(m.conditions)]
        )
    return pages.table(f"{verdict.claim.id}  {verdict.claim.statement}", rows, no_wrap=True)
