"""The equations of motion themselves: accelerations and contact forces in all nine cases, at the engine's own states.

Balls start at random states of every case and move freely for a few hundredths of a second. In short windows during
which the engine's contacts do not change, polynomials through the samples give the state, its rate of change and the
contact forces at the centre of the window.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Mapping
from itertools import product

import numpy as np

from compare.kit.lab import Lab, coarse_step, time_unit
from compare.kit.record import Measurement, Missing, Records, measurement, state_of, sure_enough
from compare.kit.settling import PRESSES
from compare.kit.short import (
    DOUBT,
    HALF_WINDOW,
    LIMIT,
    REFINED,
    WINDOW_DEGREES,
    constrained,
    lag_error,
    polynomials,
    random_state,
)
from compare.kit.statistics import Measured
from compare.kit.trials import Start
from model import Case, Contact, Parameters, State, Trajectory
from model.arrays import Array
from model.cases import TRAITS
from model.kinematics import VARIABLES, slip_velocities

PROTOCOL = "field"
SEED = 53
CENTRES = (16, 40, 64)
"""Centres of the windows, in steps of the coarser run."""
APART = 4
"""Steps before and after a window in which the case doesn't change, either, so that friction has built up."""
TURN = 0.5
"""Largest change of a slip in a window, and of that which friction alone would make, divided by the slip: where slip is
about to vanish, or is held at a trace, friction turns too fast."""
COMPONENTS = ("Ax", "Ay", "Az", "Bx", "By", "Bz")
STATE, RATES, FORCES = slice(0, 8), slice(8, 16), slice(16, 22)
"""Parts of what is read at the centre of a window (22,): state, rates of change in SI, and `COMPONENTS` in N."""


def measure(lab: Lab, sets: Mapping[str, Parameters], records: Records) -> Iterator[Measurement | Missing]:
    """Rates of change and contact forces, each with the state they belong to."""
    starts = []
    for name, p in sets.items():
        rng = np.random.default_rng([SEED, *name.encode()])
        for case, _ in product(Case, range(lab.effort("field.starts"))):
            x = random_state(case, p, rng)
            # Two contacts that both roll hold the ball against no more than a slight lag.
            rolls = case is Case.RR
            omega_0 = State.of(x).omega_c * rng.uniform(0.8, 1.2) if rolls else rng.uniform(0.3, 2.5) / time_unit(p)
            starts.append(Start(name, p.replace(omega_0=omega_0), case.name, x))
    steps = CENTRES[-1] + HALF_WINDOW + APART
    tasks = [lab.pair(start.p, start.x0, steps, coarse_step(start.p) / REFINED) for start in starts]
    runs = list(lab.groups(tasks))
    kept = Counter[tuple[str, Case]]()
    for centre in CENTRES:
        for start, pair, (coarse, fine) in zip(starts, tasks, runs, strict=True):
            case = Case(int(coarse.case[centre]))
            if kept[start.set, case] == lab.effort("field.kept"):
                continue
            window = _window(case, coarse, fine, centre)
            if window is None:
                continue
            values = _values(case, window, start.p)
            kept[start.set, case] += bool(values)
            for what, value in values.items():
                at = state_of(window[0, STATE])
                yield measurement(lab, PROTOCOL, start.set, start.p, what, value, pair, case=case.name, **at)
    for name, case in product(sets, Case):
        if not kept[name, case]:
            why = f"no random start moved smoothly in case {case.name} for {2 * HALF_WINDOW} steps"
            yield Missing(PROTOCOL, name, why)


def _window(case: Case, coarse: Trajectory, fine: Trajectory, centre: int) -> Array | None:
    """What is read at the centre of a window (3, 22): extrapolated to a vanishing step, by the finer run, and by that
    with the lower degree. None if another case is in or near the window, or a slip turns or hardly presses.
    """
    read = []
    for run, times in ((coarse, 1), (fine, 2)):
        near, half, middle = ((HALF_WINDOW + APART) * times, HALF_WINDOW * times, centre * times)
        window = slice(middle - half, middle + half + 1)
        if np.any(run.case[middle - near : middle + near + 1] != case) or turns_or_hovers(case, run, window):
            return None
        time, at = run.time[window], float(run.time[middle])
        # The forces of a sample act from then on for a step: they belong to the middle of it.
        acting = time + (time[1] - time[0]) / 2
        forces = polynomials(acting, np.concatenate([run.force_A, run.force_B], axis=1)[window], WINDOW_DEGREES, at)[0]
        read.append(np.concatenate([*polynomials(time, run.x[window], WINDOW_DEGREES, at), forces], axis=1))
    (one, _), (two, lower) = read
    best = two + (two - one) * LIMIT
    best[STATE] = constrained(case, best[STATE], fine.header.parameters)
    return np.stack([best, two, lower])


def turns_or_hovers(case: Case, run: Trajectory, window: slice) -> bool:
    """Whether a contact that slips hardly presses, or its velocity changes by more than `TURN` of it, or would by
    friction alone.
    """
    p, time = run.header.parameters, float(np.ptp(run.time[window]))
    loads = (p.mu, run.force_A[window, 1]), (p.eta, run.force_B[window, 0])
    for v, contact, (friction, load) in zip(slip_velocities(run.x[window], p), (case.A, case.B), loads, strict=True):
        change = max(float(np.linalg.norm(v[-1] - v[0])), friction * load.max() * (1 + p.j) / (p.j * p.m) * time)
        hovers = load.min() < PRESSES * p.m * p.g
        if contact is Contact.S and (hovers or change > TURN * np.linalg.norm(v, axis=1).min()):
            return True
    return False


def _values(case: Case, window: Array, p: Parameters) -> dict[str, Measured]:
    """Quantities with uncertainties, from what the extrapolation and the degree of the polynomials change.

    The largest relative change of the rates, or of the forces, stands for all of them: that of one may vanish by
    chance. Empty where it is more than a check may have.
    """
    moving = [k for k, name in enumerate(VARIABLES) if name in TRAITS[case].active and name not in ("y", "h")]
    speed, spin, weight = math.sqrt(p.g * p.R), p.g / p.r, p.m * p.g
    scales = np.array([speed, p.g, p.g / p.R, spin, spin, spin, speed, p.g])
    forces = [_forces(case, row) for row in window[:, FORCES]]
    rate_change, force_change = (
        max((abs(a - b) * DOUBT / LIMIT + abs(b - c) for a, b, c in np.transpose(rows).tolist()), default=0.0)
        for rows in ((window[:, RATES] / scales)[:, moving], [[w / weight for w in each.values()] for each in forces])
    )
    rate_change, force_change = max(rate_change, lag_error(p) * (1 + p.j) / p.j), max(force_change, lag_error(p))
    # Where the ball slips fast and hardly presses, contact comes and goes.
    if not sure_enough("rate_v_y", Measured(0.0, max(rate_change, force_change)), 1.0):
        return {}
    rates = {f"rate_{VARIABLES[k]}": Measured(window[0, RATES][k], rate_change * scales[k]) for k in moving}
    return rates | {f"moving_force_{name}": Measured(w, force_change * weight) for name, w in forces[0].items()}


def _forces(case: Case, forces: Array) -> dict[str, float]:
    """Of forces (6,) those that the motion determines, of the contacts that are closed."""
    named = dict(zip(COMPONENTS, forces.tolist(), strict=True))
    if case is Case.RR:  # the contacts share the load in ways that Newton's laws don't tell apart
        A_x, A_y, A_z, B_x, B_y, B_z = named.values()
        return {"Ax-By": A_x - B_y, "Ay+By": A_y + B_y, "Bx+By": B_x + B_y, "Az": A_z, "Bz": B_z}
    return {name: force for name, force in named.items() if getattr(case, name[0]) is not Contact.N}
