"""The chain of a claim, from statement to verdict, each link with its line of the sources."""

import functools
import inspect
import sys
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from types import CodeType, FrameType
from typing import Any

from compare import plan
from compare.engines.study import ENGINES
from compare.figures.pages import Rows, by_heading, pairs, readable, table
from compare.method.quantities import quantity
from compare.method.record import Check, Measurement
from compare.plan import Level
from compare.report import wording
from compare.report.results import Summary
from compare.subjects.catalogue import PROTOCOLS
from compare.verification import judge
from compare.verification.claim import Claim, Criterion, Verdict

ROOT = Path(judge.__file__).parents[2]
"""Relative to which files are named."""
LISTED = 12
"""Most numbers of a criterion that are listed."""


@dataclass
class Link:
    """A step from the statement to the verdict."""

    what: str
    text: str
    place: str = ""
    """FILE:LINE, of the sources; a file of results."""
    numbers: Rows = ()
    """Measured beside predicted ones."""


def links(claim: Claim, verdict: Verdict | None, summary: Summary) -> list[Link]:
    """The chain of a claim, without numbers where there is no verdict."""
    text = f"{claim.id}: {claim.statement}"
    chain = [Link("statement", text, claim.place), Link("source", f"{claim.source}, {claim.text}")]
    for name in sorted(claim.protocols):
        chain += _measured(name, verdict, summary)
    for n, criterion in enumerate(claim.criteria):
        checks = [each for each in verdict.checks if each.criterion == n] if verdict else []
        chain += _judged(criterion, checks)
    if verdict is None:
        return [*chain, Link("verdict", f"none: 'dualball validate --claim {claim.id}' measures")]
    for said in verdict.engines:
        by = place(ENGINES[said.engine].configure)
        chain.append(Link(f"verdict by {said.engine}", wording.engine_sentence(said), by))
    text = f"{verdict.outcome}, expected: {claim.expected}"
    return [*chain, Link("verdict", text, place(judge.outcome))]


def _measured(name: str, verdict: Verdict | None, summary: Summary) -> list[Link]:
    """How a protocol measures, on which sets it is planned, and where its numbers are kept."""
    (protocol,) = (each for each in PROTOCOLS if each.name == name)
    about = inspect.getdoc(_unwrapped(protocol.measure)) or ""
    first = " ".join(about.split("\n\n")[0].split())
    chain = [Link("measured by", f"protocol {name}: {first}", place(protocol.measure))]
    entry = plan.PLAN[name]
    sets = f"{', '.join(entry.trial)} at the quick level, {entry.numbers} numbers of each or more; "
    sets += "all sets above"
    if entry.level > Level.QUICK:
        sets = f"from the {entry.level.name.lower()} level on"
    chain.append(Link("planned on", sets, _line(plan, f'"{name}":')))
    for engine, steps in summary.measurements.items():
        for divisor, files in steps.items():
            for file in (each for each in files if Path(each).stem == name):
                step = f"protocol's step / {divisor}" if divisor > 1 else "the protocol's step"
                chain.append(Link("kept", f"by {engine}, {step}", file))
    checks = verdict.checks if verdict else ()
    runs = {run for c in checks if c.measurement.protocol == name for run in c.measurement.runs}
    if runs:
        kept = sorted(run for run in runs if "/" in run)
        told = f", kept are {len(kept)}" if kept else ""
        chain.append(Link("runs", f"{len(runs)}{told}", kept[0] if kept else ""))
    return chain


def _judged(criterion: Criterion, checks: list[Check]) -> list[Link]:
    """A criterion: what is predicted by which function, and the numbers."""
    known = quantity(criterion.quantity)
    by = criterion.by or "prediction"
    text = f"{known.symbol} of {criterion.protocol} {criterion.relation} {by}"
    chain = [Link("criterion", text, place(criterion.predict))]
    for name, at in asked_of_theory(criterion, checks[0].measurement) if checks else ():
        chain.append(Link("predicted by", name, at))
    if checks:
        count, told = len(checks), sum(each.conclusive for each in checks)
        text = f"{count} number{'s' if count > 1 else ''}, {told} can tell"
        chain.append(Link("numbers", text, place(judge.check), numbers(checks)))
    else:
        chain.append(Link("numbers", "none"))
    return chain


def numbers(checks: list[Check]) -> Rows:
    """The worst numbers of a criterion: measured, predicted, and what they can tell."""
    return by_heading(
        [
            {
                "set": m.set,
                "ω₀ (rad/s)": f"{m.parameters.omega_0:.6g}",
                "measured": f"{wording.value(m, m.value)} {readable(m.unit)}".rstrip(),
                "± u": wording.size(m.uncertainty),
                "predicted": wording.value(m, check.predicted),
                "off/tolerance": f"{check.share:.2g}",
                "resolution": wording.size(check.resolution),
                "required": wording.size(check.required_resolution),
                "": wording.mark(check),
                "with": wording.conditions(m.at),
            }
            for check in wording.ranked(checks)[:LISTED]
            for m in [check.measurement]
        ]
    )


def asked_of_theory(criterion: Criterion, m: Measurement) -> list[tuple[str, str]]:
    """The functions of `analytic` that a prediction calls from outside of it, with their places."""
    found: dict[CodeType, str] = {}

    def is_theory(frame: FrameType | None) -> bool:
        return bool(frame and frame.f_globals.get("__name__", "").startswith("analytic"))

    def note(frame: FrameType, event: str, _: Any) -> None:
        code = frame.f_code
        public = not code.co_qualname.startswith(("_", "<"))
        if event == "call" and public and is_theory(frame) and not is_theory(frame.f_back):
            found[code] = f"{frame.f_globals['__name__']}.{code.co_qualname}"

    judge.forget()  # else what was computed before isn't computed again
    before = sys.getprofile()
    sys.setprofile(note)
    try:
        criterion.predict(m)
    except judge.UNKNOWN:
        pass
    finally:
        sys.setprofile(before)
    return [(name, _place(code)) for code, name in found.items()]


def place(function: Callable[..., Any]) -> str:
    """FILE:LINE of a function, also of one that is a part of another one."""
    return _place(_unwrapped(function).__code__)


def shown(chain: Iterable[Link]) -> list[Any]:
    parts: list[Any] = []
    for link in chain:
        parts.append(pairs({link.what: f"{link.text}\n{link.place}".rstrip()}))
        if link.numbers:
            parts.append(table("", link.numbers, no_wrap=True))
    return parts


def described(chain: Iterable[Link]) -> list[dict[str, Any]]:
    return [
        {"what": link.what, "text": link.text, "place": link.place}
        | ({"numbers": link.numbers} if link.numbers else {})
        for link in chain
    ]


def _unwrapped(function: Callable[..., Any]) -> Any:
    """The function that a partial one is made of."""
    while isinstance(function, functools.partial):
        function = function.func
    return inspect.unwrap(function)


def _place(code: CodeType) -> str:
    path = Path(code.co_filename)
    file = path.relative_to(ROOT) if path.is_relative_to(ROOT) else path
    return f"{file.as_posix()}:{code.co_firstlineno}"


def _line(module: Any, text: str) -> str:
    """FILE:LINE of the first line of a module with a text."""
    path = Path(module.__file__)
    lines = path.read_text("utf-8").splitlines()
    number = next(k for k, line in enumerate(lines, 1) if text in line)
    return f"{path.relative_to(ROOT).as_posix()}:{number}"
