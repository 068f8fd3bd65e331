"""What is asked of a run at a held flow: how the ball starts, for how long, and what its contacts do at the end."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from compare.measure.lab import Lab, coarse_step
from compare.measure.settling import Settled, family, high
from compare.runs.tasks import Task
from compare.statistics import settled_case, tail
from model import Case, Contact, Parameters, State, Trajectory
from model.arrays import Array

From = Callable[[Parameters, float], Array]
"""The state from which a ball starts at a flow omega_0 in rad s-1."""
SLIPS = 3e-8
"""Slip speed over sqrt(g R) that counts as slip: far above what contacts are solved to, 1e-12, and reached within the
time of a run by a ball whose friction falls short by a millionth."""
STUCK = 1e-2
"""The same in units of `SLIPS` that counts as none: slip from the start of a run may have to die out before."""
FADES = 0.6
"""Slip that has fallen to this part of what it was in the second half of a run may yet die out: it is given longer."""
PRESSED = 1e-3
"""How much spin is taken off a lifted ball to press it to the floor, in parts of its spin on the wall."""


def rest(p: Parameters, omega: float) -> Array:
    """At rest on the floor at the wall."""
    return np.zeros(6)


def rolling(p: Parameters, omega: float) -> Array:
    """Rolling on both, with the fluid."""
    return np.array([0.0, 0.0, omega, 0.0, 0.0, 0.0])


def wall(p: Parameters, omega: float) -> Array:
    """Going round with the fluid, too high on the wall for landing."""
    return np.array([high(p), 0.0, omega, 0.0, 0.0, 0.0])


def rider(states: Sequence[Settled], height: float) -> From:
    """Riding the wall at a height, as continued in omega_0 from settled states."""
    omegas = np.array([state.start.p.omega_0 for state in states])
    spins = [state.values["slip_x"].value for state in states]
    fit = np.polynomial.Polynomial.fit(omegas, spins, len(omegas) - 1)
    return lambda p, omega: State(y=height, omega_c=omega, slip_x=float(fit(omega))).stacked()


def leaning(states: Sequence[Settled]) -> From:
    """The same on the floor, with a little less spin on the wall than carries its weight."""
    ride = rider(states, 0.0)

    def lean(p: Parameters, omega: float) -> Array:
        x = State.of(ride(p, omega))
        return x._replace(slip_x=x.slip_x - PRESSED * (x.slip_x + p.R / p.r * omega)).stacked()

    return lean


def lasting(p: Parameters, units: float) -> float:
    """A time in s of about `units` of 1/c: a power of two, so that sets share batches."""
    return float(2.0 ** round(math.log2(units / p.c)))


def held(lab: Lab, p: Parameters, omega: float, x0: Array, units: float, refine: int = 1) -> Task:
    """A run at a held flow for `units` of 1/c, with the coarse time step over `refine`."""
    return lab.task(p.replace(omega_0=float(omega)), x0, lasting(p, units), coarse_step(p) / refine)


def slip(speeds: Array, run: Trajectory, share: float = 0.1) -> float:
    """Largest of the slip speeds (n,) in the last part of a run, in units of `SLIPS` sqrt(g R)."""
    p = run.header.parameters
    return float(speeds[tail(run, share)].max() / (SLIPS * math.sqrt(p.g * p.R)))


def presses(run: Trajectory) -> bool:
    """Whether the floor carries something all the time in the end."""
    return bool(np.all(run.force_A[tail(run), 1] > 0))


def stays_rolling(run: Trajectory) -> bool | None:
    """Whether a ball that rolls on both neither slips on the floor nor leaves it; None while slip still dies out."""
    if not presses(run):
        return False
    middle = run.slip_speed_A[len(run.time) // 2 :]
    last, before = slip(run.slip_speed_A, run), slip(middle, run, share=1.0)
    if last >= 1:
        return False if last > FADES * before else None
    return True if last < STUCK else None


def rolls_again(run: Trajectory) -> bool:
    """Whether a ball pressed on the floor comes back to rolling on both."""
    return presses(run) and settled_case(run) is Case.RR


def falls(run: Trajectory) -> bool:
    """Whether the wall doesn't hold the ball in the end."""
    return family(settled_case(run)) is not Case.NR


def slides(run: Trajectory) -> bool:
    """Whether a ball that rides the wall begins to slip on it."""
    return slip(run.slip_speed_B, run) > 1


def keeps_on(run: Trajectory) -> bool:
    """Whether a ball on the floor is still there and changes its speed less and less."""
    return settled_case(run).A is not Contact.N and presses(run) and _slowing(run) <= 1


def settles(run: Trajectory) -> bool | None:
    """Whether a ball on the floor settles there, not only lingers; None where the run is too short to show it.

    On the way past a fold that it has missed its speed falls at most like 1/time^2, from the first window of
    `_slowing` to the second to 0.22; after that it rises.
    """
    if not keeps_on(run):
        return False
    return True if _slowing(run) < 0.2 else None


def _slowing(run: Trajectory) -> float:
    """Change of omega_c in the last tenth over that in the tenth before the middle; 0 for round-off."""
    middle, last = (abs(float(run.omega_c[k] - run.omega_c[k - 10])) for k in (-51, -1))
    return last / middle if last > 1e-11 * abs(float(run.omega_c[-1])) and middle > 0 else 0.0
