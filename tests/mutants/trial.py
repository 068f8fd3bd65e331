"""Trying the verdicts: which claims notice a wrong theory, and which a wrong engine?

``python -m tests.mutants DIR`` judges the stored measurements of a validation by every wrong
theory; with ``--engines`` it also measures with every wrong engine. It exits with 1 if more of them
go unnoticed than may."""

import sys
import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

from compare import validation
from compare.campaign.workers import LateError, at_most, processes
from compare.engines.study import ENGINES
from compare.plan import Level
from compare.report import results
from compare.subjects.catalogue import CLAIMS
from compare.verification.assessment import full_verdict
from compare.verification.claim import Claim, Outcome
from compare.verification.judge import forget, verdict
from tests.mutants.engines import WRONG_ENGINES
from tests.mutants.exchange import WrongTheory, believed, noting
from tests.mutants.theories import THEORIES

Outcomes = dict[str, Outcome]
PROVING = frozenset({"settled", "laws", "field", "impacts"})
"""Protocols that are carried out with wrong engines: what an engine does at rest, in motion, in
contact and landing."""
LONGEST, SLOWER = 20.0, 15.0
"""Processor time that the predictions of a claim may take under a wrong theory, s, and how many
times as long as under the right one, beside 2 s."""
KINDS = "by_numbers", "by_error", "by_hanging", "missed"
"""How a wrong theory may be noticed."""


@dataclass(frozen=True)
class Trial:
    """What became of the verdicts under one fault."""

    what: str
    noticed: Outcomes
    """Claims whose verdict is another than without the fault, and what it is."""
    hung: tuple[str, ...] = ()
    """Claims whose predictions were given up after `LONGEST`: they neither notice the fault nor
    miss it."""
    tried: bool = True
    """Whether anything is measured that could notice it."""

    @property
    def kind(self) -> str:
        """How it was noticed, one of `KINDS`."""
        if self.noticed:
            return "by_error" if set(self.noticed.values()) == {Outcome.ERROR} else "by_numbers"
        return "by_hanging" if self.hung else "missed"

    @property
    def by(self) -> str:
        """Who noticed it."""
        named = [
            name if of is Outcome.REFUTED else f"{name} ({of})" for name, of in self.noticed.items()
        ]
        named = named or ["nobody" if self.tried else "not measured"]
        return ", ".join([*named, *(f"{name} hangs" for name in self.hung)])


def judged(
    directory: Path, workers: int = 2, whole: bool = False, by: str = ""
) -> dict[str, list[Trial]]:
    """Every wrong theory judged on the measurements stored in a results directory, or on what an
    engine alone says; by the name of the level, and of that engine.

    By the claims that call its function, the quickest first and only until one notices it; if
    `whole`, by all of them."""
    level = results.load(directory).level.lower()
    with processes(workers) as work:
        right = list(work.map(partial(_right, directory, by), range(len(CLAIMS))))
        theory = partial(_theory, directory, by, whole, right)
        trials = _shown(work.map(theory, range(len(THEORIES))))
    return {f"{level}, by {by}" if by else level: trials}


def wrong_engines(directory: Path, workers: int = 2) -> list[Trial]:
    """Every wrong engine, measured anew by the protocols of `PROVING`; runs are kept, each engine's
    apart."""
    with processes(workers) as work:
        return _shown(work.map(partial(_engine, directory), range(len(WRONG_ENGINES))))


def _shown(trials: Iterable[Trial]) -> list[Trial]:
    """The trials, each shown on standard error as soon as it is there."""
    kept = []
    for trial in trials:
        print(f"{trial.what}: {trial.by}", file=sys.stderr, flush=True)
        kept.append(trial)
    return kept


@dataclass(frozen=True)
class Right:
    """What a claim comes to by the right theory."""

    outcome: Outcome
    took: float
    """Processor time, s."""
    calls: frozenset[str]
    """Functions of `THEORIES` that its predictions call: a fault in any other can't change the
    outcome."""


def _right(directory: Path, by: str, number: int) -> Right:
    """What a claim comes to by itself, with nothing that was computed for others."""
    functions, calls = {name_of(each): each for each in THEORIES}, set[str]()
    validation.stored(directory)  # reading isn't what a claim takes
    forget()
    with believed(*(replace(each, wrong=noting(name, calls)) for name, each in functions.items())):
        begun = time.process_time()
        outcome = _outcome(directory, by, CLAIMS[number])
    return Right(outcome, time.process_time() - begun, frozenset(calls))


def name_of(wrong: WrongTheory) -> str:
    """The function that is wrong."""
    return f"{wrong.module}.{wrong.function}"


def _outcome(directory: Path, by: str, claim: Claim) -> Outcome:
    """The verdict on a claim by an engine; by the engine on trial if it has no name."""
    if not by:
        (steps, *_) = validation.stored(directory).values()  # of the engine on trial
        return verdict(claim, steps[1]).outcome
    said = full_verdict(claim, validation.stored(directory)).engines
    return {each.engine: each.outcome for each in said}[by]


def _theory(directory: Path, by: str, whole: bool, right: Sequence[Right], number: int) -> Trial:
    wrong, noticed, hung = THEORIES[number], Outcomes(), list[str]()
    if wrong.level > Level[results.load(directory).level]:
        return Trial(wrong.what, noticed, tried=False)
    asked = [pair for pair in zip(CLAIMS, right, strict=True) if name_of(wrong) in pair[1].calls]
    forget()
    with believed(wrong):
        for claim, known in asked if whole else sorted(asked, key=lambda pair: pair[1].took):
            try:
                with at_most(min(LONGEST, 2.0 + SLOWER * known.took)):
                    outcome = _outcome(directory, by, claim)
                noticed |= {claim.id: outcome} if outcome is not known.outcome else {}
            except LateError:  # as when a wrong theory never comes to the end of a motion
                hung.append(claim.id)
            if noticed and not whole:
                break
    return Trial(wrong.what, noticed, tuple(hung))


def _engine(directory: Path, number: int) -> Trial:
    ENGINES.update({each.name: each for each in WRONG_ENGINES})  # tasks name them
    wrong, apart = WRONG_ENGINES[number], directory / "wrong-engines" / f"{number}"
    claims = [claim.id for claim in CLAIMS if claim.protocols and claim.protocols <= PROVING]
    verdicts = validation.validate(
        apart, level=Level.QUICK, claims=claims, engine=wrong, workers=0, report=False
    )
    other = {
        v.claim.id: v.outcome for v in verdicts if v.outcome is not _outcome(directory, "", v.claim)
    }
    return Trial(wrong.name, other)
