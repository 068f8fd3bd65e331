"""Measurements, motions and claims made up for tests."""

import math
from typing import Any, Unpack

import numpy as np
import numpy.typing as npt

import analytic
from compare.method.conditions import Conditions
from compare.method.record import Measurement, Records
from compare.verification.claim import Claim, Criterion, Verdict
from compare.verification.judge import forget, verdict
from model import Events, Flow, Header, Parameters, Trajectory
from model.trajectory import SAMPLE


def judged(claim: Claim, records: Records) -> Verdict:
    """The verdict on a claim, of which no prediction is known from before."""
    forget()
    return verdict(claim, records)


def measured(
    protocol: str,
    quantity: str,
    value: float,
    uncertainty: float = 0.0,
    p: Parameters | None = None,
    set: str = "reference",
    **at: Unpack[Conditions],
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
        at=at,
    )


def claim(name: str = "it", *criteria: Criterion, **others: Any) -> Claim:
    """A claim, that a ball in a stationary state goes round with the flow unless criteria are
    given."""
    own = criteria or (Criterion("settled", "omega_c", lambda m: m.parameters.omega_0),)
    given = {
        "section": "Stationary states",
        "source": "(1)",
        "statement": "So it is.",
        "criteria": own,
    }
    return Claim(id=name, **(given | others))


def motion(p: Parameters, time: npt.ArrayLike, **columns: npt.ArrayLike) -> Trajectory:
    """A motion of these columns in a steady flow; all others are zero."""
    block = np.zeros(len(np.asarray(time)), SAMPLE)
    for name, values in {"time": time, **columns}.items():
        block[name] = values
    return Trajectory.from_blocks(Header("made up", p, Flow.steady(p.omega_0)), [block], Events())


def thresholds(set: str, p: Parameters, *names: str, uncertainty: float = 1e-6) -> Records:
    """Flows at which rolling ends, those that there are, as if they had been measured before;
    uncertainty relative."""
    values = {name: getattr(analytic.thresholds(p), name) for name in names}
    return Records(
        tuple(
            measured("thresholds", name, w, uncertainty * w, p, set)
            for name, w in values.items()
            if math.isfinite(w)
        )
    )
