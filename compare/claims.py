"""Statements of the paper that can be checked, and the verdicts on them.

A claim says what is stated, where, how theory predicts it, how simulation measures it and where the tolerance comes
from. Its study runs what it needs in a `Lab` and answers with checks: numbers held against numbers.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from enum import IntEnum, StrEnum

from compare.campaign import Campaign
from compare.tasks import Task
from model import InputError, SimulationError, StorageError, Trajectory
from model.errors import suggestion


class Level(IntEnum):
    """How much is run."""

    QUICK = 0
    DEFAULT = 1
    FULL = 2


class Outcome(StrEnum):
    """What became of a claim."""

    CONFIRMED = "confirmed"
    CORRECTED = "corrected"
    """True once a listed erratum is corrected."""
    REFUTED = "refuted"
    FORMAL = "formal only"
    """Outside the physical model."""
    NOT_REPRODUCED = "not reproduced"


@dataclass(frozen=True, kw_only=True)
class Check:
    """One measured number beside its prediction, under stated conditions."""

    quantity: str
    """Symbol, as a person reads it."""
    unit: str
    witness: str
    """Engine that measured it."""
    parameters: str
    """Name of the parameter set."""
    omega_0: float
    condition: str
    """Start, direction or other circumstance."""
    predicted: float
    measured: float
    uncertainty: float
    """Standard uncertainty of the measured value, same unit."""
    tolerance: float
    """Largest deviation that still agrees, same unit."""
    case_predicted: str = ""
    case_found: str = ""
    run: str = ""
    """File of the run, relative to the results directory."""
    judged: bool = True
    """False for a number that is only shown, for comparison: nothing is claimed of it."""

    @property
    def error(self) -> float:
        """Measured less predicted."""
        return self.measured - self.predicted

    @property
    def relative_error(self) -> float:
        """Error over the prediction; nan where that is zero."""
        return self.error / abs(self.predicted) if self.predicted else math.nan

    @property
    def passed(self) -> bool:
        """Within the tolerance, in the predicted case, or not judged."""
        return not self.judged or (abs(self.error) <= self.tolerance and self.case_found == self.case_predicted)


@dataclass(frozen=True)
class Lab:
    """Where studies run what they need: runs are carried out once and found again afterwards."""

    campaign: Campaign
    level: Level

    def run(self, tasks: Sequence[Task]) -> list[Trajectory]:
        """The trajectories of the tasks, in order."""
        return self.campaign.run(tasks)

    def file(self, task: Task) -> str:
        """Name of the task's run file as the report links it."""
        path = self.campaign.path(task)
        return f"{path.parent.name}/{path.name}"


@dataclass(frozen=True, kw_only=True)
class Claim:
    """One checkable statement of the paper."""

    id: str
    source: str
    """Proposition, equation, figure or table."""
    statement: str
    prediction: str
    measurement: str
    tolerance: str
    """Where the tolerance comes from."""
    expected: Outcome = Outcome.CONFIRMED
    """The verdict when every check passes."""
    reason: str = ""
    """Why, where `expected` isn't CONFIRMED."""
    level: Level = Level.QUICK
    """The least level of which it is a part."""
    study: Callable[[Lab], list[Check]] = field(repr=False)


@dataclass(frozen=True, kw_only=True)
class Verdict:
    """What was found about a claim."""

    claim: Claim
    outcome: Outcome
    checks: tuple[Check, ...]
    error: str = ""
    """Why there are no checks, or not all."""
    seconds: float = 0.0

    @property
    def passed(self) -> bool:
        """Whether the outcome is the one to be expected."""
        return self.outcome is self.claim.expected


def judge(claim: Claim, lab: Lab) -> Verdict:
    """Run a claim's study and pronounce the verdict: every check must pass, and there must be one that is judged."""
    start = time.perf_counter()
    try:
        checks, error = tuple(claim.study(lab)), ""
    except (SimulationError, StorageError) as caught:
        checks, error = (), str(caught)
    holds = any(check.judged for check in checks) and all(check.passed for check in checks)
    outcome = claim.expected if holds else Outcome.NOT_REPRODUCED
    return Verdict(claim=claim, outcome=outcome, checks=checks, error=error, seconds=time.perf_counter() - start)


def select(claims: Iterable[Claim], ids: Sequence[str] | None) -> list[Claim]:
    """The claims of the given ids, all for None; `InputError` with a suggestion for an unknown id."""
    known = {claim.id: claim for claim in claims}
    for name in ids or ():
        if name not in known:
            raise InputError(f"no claim is called {name!r}{suggestion(name, known)}; list them with --list")
    return [known[name] for name in (ids or known)]
