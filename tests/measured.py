"""Measurements made up for tests, and wrong theories that they are judged by."""

from collections.abc import Sequence

import analytic
from compare.claim import Claim, Outcome
from compare.judge import judge
from compare.kit.levels import Level
from compare.kit.record import Condition, Measurement, Records
from model import Parameters
from tests.mutants.exchange import believed
from tests.mutants.theories import THEORIES


def measured(
    protocol: str,
    quantity: str,
    value: float,
    uncertainty: float = 0.0,
    p: Parameters | None = None,
    set: str = "reference",
    **conditions: Condition,
) -> Measurement:
    """A measurement by MuJoCo, on the reference unless parameters are given."""
    return Measurement(
        protocol=protocol,
        quantity=quantity,
        value=value,
        uncertainty=uncertainty,
        engine="mujoco",
        set=set,
        parameters=p or Parameters.named("reference"),
        conditions=conditions,
    )


def thresholds(set: str, p: Parameters, *names: str) -> Records:
    """Flows at which rolling ends, as if they had been measured before."""
    known = analytic.thresholds(p)
    values = {name: getattr(known, name) for name in names}
    return Records(tuple(measured("thresholds", name, w, 1e-6 * w, p, set) for name, w in values.items()))


def unnoticed(claims: Sequence[Claim], records: Records, *functions: str) -> list[str]:
    """What is wrong with theories that no claim refutes, of those with a fault in one of these functions.

    A function is named as far as is needed to tell it from others, as in "dynamics._rs".
    """
    missed = []
    for function in functions:
        named = [each for each in THEORIES if f"{each.module}.{each.function}".endswith(f".{function}")]
        wrong_theories = [each for each in named if each.level is Level.QUICK]
        assert wrong_theories, function
        for wrong in wrong_theories:
            with believed(wrong):
                outcomes = {verdict.outcome for verdict in judge(claims, records)}
            assert Outcome.ERROR not in outcomes, wrong.what
            if Outcome.REFUTED not in outcomes:
                missed.append(wrong.what)
    return missed
