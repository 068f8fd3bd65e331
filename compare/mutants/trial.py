"""Trying the verdicts: which claims notice a wrong theory, and which a wrong engine?

``python -m compare.mutants DIR`` judges the stored measurements of a validation by every wrong theory; with
``--engines`` it also measures with every wrong engine. It exits with 1 if more of them go unnoticed than may.
"""

from __future__ import annotations

import functools
import signal
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import FrameType

from compare import pages, validation
from compare.claims.catalogue import CLAIMS
from compare.claims.claim import Claim, Outcome, Text, Verdict
from compare.claims.judge import forget, judge, verdict
from compare.measure import lab
from compare.measure.quantities import QUANTITIES
from compare.measure.record import Records
from compare.mutants import engines
from compare.mutants.engines import WRONG_ENGINES
from compare.mutants.exchange import believed
from compare.mutants.theories import THEORIES
from compare.report import results
from compare.runs.workers import processes

Outcomes = dict[str, Outcome]
PROVING = frozenset({"settled", "laws", "field", "impacts"})
"""Protocols that are carried out with wrong engines: what an engine does at rest, in motion, in contact and landing."""
PATIENCE = 40.0
"""Processor time that the predictions of a claim may take under a wrong theory, s; several times what they need."""
_PAGE = """\
# What the verdicts notice

Every verdict must be able to be lost. Here the theory is replaced by slightly wrong ones, one at a time,
and the stored measurements of the {level} level are judged again; then MuJoCo is replaced by
slightly wrong engines that measure anew. A fault is noticed if the verdict on a claim changes.
Written by `make mutants`.
{trials}
## Resolving power

The relative error of a theory that every measurement of a quantity would
notice, of all sets the largest; and the ceiling, beyond which a check is inconclusive.

{powers}
"""


@dataclass(frozen=True)
class Trial:
    """What became of the verdicts under one fault."""

    what: str
    noticed: Outcomes
    """Claims whose verdict is another than without the fault, and what it is."""

    @property
    def by(self) -> str:
        """Who noticed it."""
        named = (name if of is Outcome.REFUTED else f"{name} ({of})" for name, of in self.noticed.items())
        return ", ".join(named) or "**nobody**"


@dataclass(frozen=True)
class Judged:
    """What the measurements of a results directory notice."""

    name: str
    trials: Sequence[Trial]
    """Of all wrong theories."""
    power: Mapping[str, float]
    """By quantity the relative error of a theory that every check of it notices."""


def judged(directory: Path, workers: int = 2, whole: bool = True) -> Judged:
    """Every wrong theory judged on the measurements stored in a results directory, and their resolving power.

    By all claims; unless `whole`, by the quickest ones first and only until one notices it.
    """
    power: dict[str, float] = {}
    for each in judge(CLAIMS, _records(directory)):
        if each.claim.text is not Text.FORMAL and each.outcome is Outcome.CONFIRMED:
            for name, value in each.resolving_power.items():
                power[name] = max(power.get(name, 0.0), value)
    tried = _tried(functools.partial(_theory, directory, whole), len(THEORIES), workers)
    return Judged(results.load(directory).level.lower(), tried, power)


def wrong_engines(directory: Path, workers: int = 2) -> list[Trial]:
    """Every wrong engine, measured anew by the protocols of `PROVING`; runs are kept, each engine's apart."""
    return _tried(functools.partial(_engine, directory), len(WRONG_ENGINES), workers)


def _tried(one: Callable[[int], Trial], count: int, workers: int) -> list[Trial]:
    """The trials by number, each shown on standard error as soon as it is there."""
    tried = []
    with processes(workers).start() as pool:
        for trial in pool.map(one, range(count)):
            print(f"{trial.what}: {trial.by}", file=sys.stderr, flush=True)
            tried.append(trial)
    return tried


def page(level: Judged, measured: Sequence[Trial]) -> str:
    """The page that says which claim notices what, in Markdown."""
    tables = "".join(_table(*each) for each in (("theories", level.trials), ("engines", measured)) if each[1])
    rows = [["quantity", "ceiling", level.name]]
    for name, quantity in QUANTITIES.items():
        if quantity.resolves and name in level.power:
            rows.append([quantity.symbol, f"{quantity.resolves:.1g}", f"{level.power[name]:.1g}"])
    return _PAGE.format(level=level.name, trials=tables, powers=pages.markdown(rows))


def _table(what: str, trials: Sequence[Trial]) -> str:
    rows = pages.markdown([["fault", "noticed by"], *([each.what, each.by] for each in trials)])
    return f"\n## Wrong {what}: {sum(bool(each.noticed) for each in trials)} of {len(trials)} noticed\n\n{rows}\n"


@functools.cache
def _records(directory: Path) -> Records:
    return results.load(directory).records(directory)


@functools.cache
def _right(directory: Path) -> tuple[Outcomes, Sequence[Claim]]:
    """The outcomes of the right theory, and the claims, those that are judged quickest first."""
    outcomes, took = Outcomes(), dict[str, float]()
    for claim in CLAIMS:
        begun = time.process_time()
        outcomes[claim.id] = verdict(claim, _records(directory)).outcome
        took[claim.id] = time.process_time() - begun
    return outcomes, sorted(CLAIMS, key=lambda claim: took[claim.id])


def _theory(directory: Path, whole: bool, number: int) -> Trial:
    right, quickest_first = _right(directory)
    forget()
    noticed = Outcomes()
    with believed(THEORIES[number]):
        for claim in CLAIMS if whole else quickest_first:
            noticed |= _changed(right, [_patiently(claim, _records(directory))])
            if noticed and not whole:
                break
    return Trial(THEORIES[number].what, noticed)


def _patiently(claim: Claim, records: Records) -> Verdict:
    """The verdict; an error if it takes too long, as when a wrong theory never comes to the end of a motion."""
    signal.signal(signal.SIGVTALRM, _too_long)
    signal.setitimer(signal.ITIMER_VIRTUAL, PATIENCE)
    try:
        return verdict(claim, records)
    finally:
        signal.setitimer(signal.ITIMER_VIRTUAL, 0.0)


def _too_long(number: int, frame: FrameType | None) -> None:
    raise TimeoutError(f"the predictions took longer than {PATIENCE:g} s")


def _engine(directory: Path, number: int) -> Trial:
    engines.register()
    wrong, apart = WRONG_ENGINES[number], directory / "wrong-engines" / f"{number}"
    claims = [claim.id for claim in CLAIMS if claim.protocols and claim.protocols <= PROVING]
    verdicts = validation.validate(apart, level=lab.Level.QUICK, claims=claims, engine=wrong, workers=0, report=False)
    return Trial(wrong.name, _changed(_right(directory)[0], verdicts))


def _changed(right: Outcomes, verdicts: Sequence[Verdict]) -> Outcomes:
    return {each.claim.id: each.outcome for each in verdicts if each.outcome is not right[each.claim.id]}
