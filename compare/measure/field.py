"""The equations of motion themselves: accelerations and contact forces in all nine cases, at the engine's own states.

Balls start at random in the state space of every case, in natural units, and move freely for a few hundredths of a
second. Which case each is in, its own contacts say. In short windows during which the case does not change, polynomials
through the samples give the state, its rate of change and the contact forces in the middle of the window.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Mapping
from itertools import product

import numpy as np

from compare.measure.fits import value_and_slope
from compare.measure.lab import Lab, coarse_step, time_unit
from compare.measure.laws import PRESSES
from compare.measure.levels import Level
from compare.measure.quantities import quantity
from compare.measure.record import Measurement, Missing, Records, measurement, state_of
from compare.statistics import COVERAGE, Measured
from model import Case, Contact, Parameters, State, Trajectory
from model.arrays import Array
from model.cases import TRAITS
from model.kinematics import VARIABLES, slip_velocities

PROTOCOL = "field"
SEED = 53
STARTS = {Level.QUICK: 4, Level.DEFAULT: 4, Level.FULL: 12}
"""Random starts for every case and set."""
KEPT = {Level.QUICK: 4, Level.DEFAULT: 6, Level.FULL: 24}
"""Most states measured for every case and set."""
REFINED = 16
"""Steps in one of `coarse_step`; the second run of a start has twice as many. With shorter ones the studies' settings
come to the engine's least impedance, and contacts then answer no faster."""
CENTRES, HALF = (16, 40, 64), 8
"""Middles of the windows and half their width, in steps of the coarser run."""
APART = 4
"""Steps around a window in which the case doesn't change, either: in that time friction builds up or dies out."""
LAG = 3
"""Steps in which a contact follows its load: forces that build up from nothing are there after as many."""
COARSE = quantity("rate_v_y").resolves / COVERAGE
"""Largest uncertainty over the scale with which a state counts, all that a check may have: where a fast slip hardly
presses, contact comes and goes."""
LIMIT, DOUBT = 2 / 3, 1 / 3
"""Limit of a vanishing step beyond the finer run, and its uncertainty, in differences of two steps, one twice the
other: their error is between first order, for the direction of friction, and second, with limits of 1 and 1/3."""
DEGREES = (5, 3)
"""Of the polynomials through a window; the lower one shows what the degree changes."""
TURN = 0.5
"""Largest change of a slip in a window over the slip itself, and of what friction alone would make of it: where it is
about to vanish, or is held at a trace, friction turns too fast."""
COMPONENTS = ("Ax", "Ay", "Az", "Bx", "By", "Bz")
STATE, RATES, FORCES = slice(0, 8), slice(8, 16), slice(16, 22)
"""Parts of a sighting (22,), what is there in the middle of a window: the state, its rates of change in SI, and the
contact forces `COMPONENTS` in N."""


def slip_unit(p: Parameters) -> float:
    """The rate of slip in rad s-2 that a force as large as the weight makes at a contact."""
    return p.g / p.r * (1 + p.j) / p.j


def floor(p: Parameters) -> float:
    """Least uncertainty of a force over the weight, which halving the step may by chance not show.

    What lags behind by a time `LAG` is off by half its square, in units of `time_unit`, once the first order is gone.
    """
    return (LAG * coarse_step(p) / REFINED / time_unit(p)) ** 2 / 2


def measure(lab: Lab, sets: Mapping[str, Parameters], records: Records) -> Iterator[Measurement | Missing]:
    """Rates of change and contact forces, each with the state they belong to."""
    starts = [(name, *start) for name, p in sets.items() for start in _starts(p, STARTS[lab.level], name)]
    lasts = CENTRES[-1] + HALF + APART
    tasks = [lab.pair(p, x, lasts, coarse_step(p) / REFINED) for _, p, x in starts]
    runs = list(lab.groups(tasks))
    kept = Counter[tuple[str, Case]]()
    for centre in CENTRES:
        for (name, p, _), pair, (coarse, fine) in zip(starts, tasks, runs, strict=True):
            if not (sample := _seen(coarse, fine, centre)) or kept[name, sample[0]] == KEPT[lab.level]:
                continue
            case, seen = sample
            values = dict(_values(case, seen, p))
            kept[name, case] += bool(values)
            for what, value in values.items():
                at = state_of(seen[0, STATE])
                yield measurement(lab, PROTOCOL, name, p, what, value, pair, case=case.name, **at)
    for name, case in product(sets, Case):
        if not kept[name, case]:
            yield Missing(PROTOCOL, name, f"no random start moved smoothly in case {case.name} for {2 * HALF} steps")


def _starts(p: Parameters, count: int, name: str) -> Iterator[tuple[Parameters, Array]]:
    """Parameters with a flow, and a state, at random in natural units: lengths in R, times in sqrt(R/g)."""
    rng = np.random.default_rng([SEED, *name.encode()])
    unit = time_unit(p)
    for case in Case:
        for _ in range(count):
            x = random_state(case, p, rng)
            # Two contacts that both roll hold the ball against no more than a slight lag.
            omega_0 = State.of(x).omega_c * rng.uniform(0.8, 1.2) if case is Case.RR else rng.uniform(0.3, 2.5) / unit
            yield p.replace(omega_0=omega_0), x


def random_state(case: Case, p: Parameters, rng: np.random.Generator) -> Array:
    """A state (8,) that satisfies the constraints of a case.

    A ball that rolls goes round so slowly, or one that hangs on the wall so fast, that friction has something to
    spare; a ball that the wall alone keeps from turning spins backwards about its radial axis.
    """
    unit, speed = time_unit(p), math.sqrt(p.g * p.R)
    slips = rng.uniform(0.4, 1.0, 3) * rng.choice([-1, 1], 3) * speed / p.r
    omega_c = rng.uniform(0.4, 1.6) / unit
    if case.A is Contact.R and case.B is not Contact.N:
        omega_c = rng.uniform(0.2, 0.7) / unit * min(1.0, math.sqrt(p.mu), math.sqrt(p.mu / p.j))
    if case.B is Contact.R and case.A is not Contact.R:
        hangs = 1.0 if case.A is Contact.N else p.mu
        omega_c = rng.uniform(1.05, 1.3) / unit * max(1.0, math.sqrt(hangs / max(p.eta, 0.01)))
        slips[0] = -rng.uniform(0.6, 1.2) * p.R * omega_c / p.r
    values = {
        "y": rng.uniform(0.2, 0.6) * p.R,
        "v_y": rng.uniform(-0.2, 0.3) * speed,
        "omega_c": omega_c,
        **dict(zip(("slip_x", "slip_y", "slip_z"), slips, strict=True)),
        "h": rng.uniform(0.3, 0.5) * p.R,
        "v_h": rng.uniform(-0.2, 0.3) * speed,
    }
    x = np.array([values[name] if name in TRAITS[case].active else 0.0 for name in VARIABLES])
    return constrained(case, x, p)


def constrained(case: Case, x: Array, p: Parameters) -> Array:
    """The state (8,) with what the case holds at zero set to exactly that, of which a contact leaves some 1e-9."""
    held = [name in TRAITS[case].constraints for name in VARIABLES]
    x = np.where(held, 0.0, x)
    return State.of(x)._replace(slip_z=-State.of(x).v_h / p.r).stacked() if case is Case.RN else x


def _seen(coarse: Trajectory, fine: Trajectory, centre: int) -> tuple[Case, Array] | None:
    """A window's case, and sightings (3, 22): extrapolated to a vanishing step, that of the finer run, and that by
    polynomials less high.

    None if the case changes in or near the window, or a slip turns or hardly presses.
    """
    high, low = DEGREES
    one, two = _sight(coarse, centre, 1, high), _sight(fine, 2 * centre, 2, high)
    lower, case = _sight(fine, 2 * centre, 2, low), Case(int(coarse.case[centre]))
    if one is None or two is None or lower is None or fine.case[2 * centre] != case:
        return None
    best = two + (two - one) * LIMIT
    best[STATE] = constrained(case, best[STATE], fine.header.parameters)
    return case, np.stack([best, two, lower])


def _sight(run: Trajectory, centre: int, refined: int, degree: int) -> Array | None:
    """What happens in a window, None if the case changes in or near it or a slip turns."""
    near, half = (HALF + APART) * refined, HALF * refined
    window = slice(centre - half, centre + half + 1)
    if np.ptp(run.case[centre - near : centre + near + 1]) or turns_or_hovers(Case(int(run.case[centre])), run, window):
        return None
    time, at = run.time[window], float(run.time[centre])
    x, rates = value_and_slope(time, run.x[window], degree, at)
    # The forces of a sample act from then on for a step: they belong to the middle of it.
    later = (time[1] - time[0]) / 2
    force, _ = value_and_slope(time + later, np.concatenate([run.force_A, run.force_B], axis=1)[window], degree, at)
    return np.concatenate([x, rates, force])


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


def _values(case: Case, seen: Array, p: Parameters) -> Iterator[tuple[str, Measured]]:
    """Quantities with uncertainties: what the extrapolation, and another degree of the polynomials, change.

    The largest change over the scales of the rates, or of the forces, stands for all of them: that of one may vanish
    by accident. None where it is more than `COARSE`.
    """
    moving = [k for k, name in enumerate(VARIABLES) if name in TRAITS[case].active and name not in ("y", "h")]
    speed, spin, weight = math.sqrt(p.g * p.R), p.g / p.r, p.m * p.g
    scales = np.array([speed, p.g, p.g / p.R, spin, spin, spin, speed, p.g])
    forces = [_forces(case, row) for row in seen[:, FORCES]]
    rate_change, force_change = (
        max((abs(a - b) * DOUBT / LIMIT + abs(b - c) for a, b, c in np.transpose(rows).tolist()), default=0.0)
        for rows in ((seen[:, RATES] / scales)[:, moving], [[w / weight for w in each.values()] for each in forces])
    )
    rate_change, force_change = max(rate_change, floor(p) * (1 + p.j) / p.j), max(force_change, floor(p))
    if max(rate_change, force_change) > COARSE:
        return
    for k in moving:
        yield f"rate_{VARIABLES[k]}", Measured(float(seen[0, RATES][k]), rate_change * float(scales[k]))
    for name, force in forces[0].items():
        yield f"moving_force_{name}", Measured(force, force_change * weight)


def _forces(case: Case, forces: Array) -> dict[str, float]:
    """Of forces (6,) those that the motion determines, of the contacts that are closed."""
    named = dict(zip(COMPONENTS, forces.tolist(), strict=True))
    if case is Case.RR:  # the contacts share the load in ways that Newton's laws don't tell apart
        A_x, A_y, A_z, B_x, B_y, B_z = named.values()
        return {"Ax-By": A_x - B_y, "Ay+By": A_y + B_y, "Bx+By": B_x + B_y, "Az": A_z, "Bz": B_z}
    return {name: force for name, force in named.items() if getattr(case, name[0]) is not Contact.N}
