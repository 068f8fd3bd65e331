"""Periodic motions: orbits closed by Newton's method on the return map, and their stability.

The return map leads from a plane through a point of the orbit, across the motion there, back to it:
through every event and impact in between, by the event-driven simulation. The point lies within one
case, and its coordinates are the active variables of that case (Table 4) in natural units, so that
the map is smooth as long as the sequence of events stays the same; the azimuth plays no part.
Derivatives are central differences of the simulation, at a tolerance at which they keep six digits.
Floquet multipliers are the eigenvalues of the derivative of the return map: the factors by which
disturbances of the orbit change in a period."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from analytic.mechanics import dynamics
from analytic.simulation.settings import Settings
from analytic.simulation.simulator import simulate
from model import Case, Contact, InputError, Parameters, SimulationError, State, Trajectory
from model.arrays import Array, Complex
from model.cases import TRAITS
from model.kinematics import VARIABLES, state_units

RETURN_RTOL = 1e-12
"""Relative tolerance of the simulation under the return map."""
SHIFT = 3e-5
"""Half width of differences relative to the orbit: truncation and RETURN_RTOL leave 1e-6."""
CLOSED = 1e-10
"""Defect in natural units at which an orbit is closed."""
ITERATIONS = 8
"""Steps of Newton's method after which an orbit is given up."""
FAST = 10.0
"""Factor by which a step reduces the defect if a neighbour's derivatives are to be used again."""
RESTITUTION = "restitution"
"""What an orbit may be followed in beside parameters."""
ORBIT_SAMPLES = 4000
"""Samples of a period for means and extremes: a parabola's top is good to 1e-6 of its height."""

Changes = tuple[tuple[Case, Case], ...]
"""Changes of case in order, (before, after)."""


def landings(changes: Iterable[tuple[int, int]]) -> npt.NDArray[np.bool_]:
    """Which changes of case, given by the cases or their codes, are landings on the floor."""
    return np.array(
        [Case(before).A is Contact.N is not Case(after).A for before, after in changes], dtype=bool
    )


class NoOrbitError(ArithmeticError):
    """No closed orbit was found where it was looked for."""


@dataclass(frozen=True)
class Loop:
    """A state within a case and the section through it, on which one active variable has its value.

    The other active variables, in natural units, are the d - 1 coordinates of the section."""

    p: Parameters
    case: Case
    x: Array
    """State, shape (8,)."""
    period: float
    """About the time until the motion comes back to the section, s."""
    fixed: int
    """Index of the variable that has one value on the section."""
    extent: float
    """Of the motion in natural units: the largest range of a variable over a period."""
    restitution: float = 0.0
    """Of landings, as in `Settings`."""

    @classmethod
    def of(cls, p: Parameters, x: npt.ArrayLike, period: float, restitution: float = 0.0) -> Loop:
        """A good section of a motion through a state (6 or 8 entries), of about this period, s.

        Of a ball that hops the top of its highest hop, v_y = 0. On the floor, within the middle
        half of the longest stretch in one case other than RR, where the case's fastest variable is
        fastest, in natural units."""
        run = _simulated(p, x, 2 * period, ORBIT_SAMPLES, restitution)
        size, y = extent(run), run.y
        tops = 1 + np.flatnonzero((y[1:-1] > y[:-2]) & (y[1:-1] >= y[2:]))
        if len(tops):
            top = int(tops[np.argmax(y[tops])])
            x, v_y = State.of(run.x[top])._replace(v_y=0.0).stacked(), VARIABLES.index("v_y")
            return cls(p, run.cases[top], x, period, v_y, size, restitution)
        stretches = [each for each in run.phases() if each[0] is not Case.RR]
        if not stretches:
            raise NoOrbitError(f"the ball rolls at both points all the time (period {period:g} s)")
        case, start, end = max(stretches, key=lambda each: each[2] - each[1])
        inner = np.abs(run.time - (start + end) / 2) <= (end - start) / 4
        rates = [dynamics.rates(case, z, p, p.omega_0) for z in run.x[inner].tolist()]
        active = active_variables(case)
        fast = (np.abs(rates) / state_units(p))[:, active]
        at, fixed = np.unravel_index(np.argmax(fast), fast.shape)
        return cls(p, case, run.x[inner][at], period, active[int(fixed)], size, restitution)

    def value(self, name: str) -> float:
        """The value of a parameter, or of the coefficient of restitution, by its name."""
        return self.restitution if name == RESTITUTION else float(getattr(self.p, name))

    def with_value(self, name: str, value: float) -> Loop:
        """The loop with another value of a parameter, or of the coefficient of restitution."""
        if name == RESTITUTION:
            return replace(self, restitution=value)
        return replace(self, p=self.p.replace(**{name: value}))

    @property
    def free(self) -> list[int]:
        """Indices of the state variables that are coordinates of the section."""
        return [k for k in active_variables(self.case) if k != self.fixed]

    def coordinates(self, x: Array) -> Array:
        """Coordinates (..., d - 1), in natural units, of states (..., 8) or differences of them."""
        return np.asarray(x[..., self.free] / state_units(self.p)[self.free])

    def moved(self, by: Array, varied: str | None = None) -> Loop:
        """The loop moved by coordinates (d - 1,), and by the logarithm of what is `varied`, (d,).

        Raises `NoOrbitError` where that leads out of the range of the parameter."""
        x = self.x.copy()
        x[self.free] += by[: len(self.free)] * state_units(self.p)[self.free]
        if self.case is Case.RN:
            x = State.of(x)._replace(slip_z=-State.of(x).v_h / self.p.r).stacked()
        moved = replace(self, x=x)
        if not varied:
            return moved
        try:
            return moved.with_value(varied, self.value(varied) * math.exp(by[-1]))
        except InputError as error:
            raise NoOrbitError(str(error)) from error

    def back(self) -> Return:
        """Where the motion returns to the section; `NoOrbitError` if it doesn't come back.

        It is simulated for the period, and then followed to the section nearby, forwards or
        backwards, by the equations of the case."""

        from scipy.integrate import solve_ivp  # here, because it takes half a second to load

        def rates(t: float, z: Array) -> list[float]:
            return list(dynamics.rates(self.case, z.tolist(), self.p, self.p.omega_0))

        run = _simulated(self.p, self.x, self.period, 1, self.restitution)
        tolerance = RETURN_RTOL * state_units(self.p)
        if run.cases[-1] is not self.case:
            raise NoOrbitError(
                f"after {self.period:g} s the ball is in {run.cases[-1].name}, not in "
                f"{self.case.name}"
            )
        x, late = run.x[-1], 0.0
        for _ in range(ITERATIONS):
            short = (self.x - x)[self.fixed] / rates(0.0, x)[self.fixed]
            if abs(short) < 1e-15 * self.period:
                break
            late += short
            if not abs(late) < self.period / 4:
                raise NoOrbitError(f"after {self.period:g} s the ball is far from where it was")
            path = solve_ivp(rates, (0.0, short), x, "DOP853", rtol=RETURN_RTOL, atol=tolerance)
            x = np.asarray(path.y[:, -1])
        codes = zip(run.events.from_case, run.events.to_case, strict=True)
        changes = tuple((Case(before), Case(after)) for before, after in codes)
        turn = run.theta[-1] - run.theta[0] + late * (State.of(x).omega_c + run.omega_c[-1]) / 2
        return Return(x, float(self.period + late), changes, float(turn))

    def derivative(self) -> Array:
        """Derivative (d - 1, d - 1) of the return map."""
        return np.stack([self.slope(unit) for unit in np.eye(len(self.free))], axis=-1)

    def slope(self, along: Array, varied: str | None = None) -> Array:
        """Derivative (d - 1,) of the return map in a direction as in `moved`."""
        shift = SHIFT * self.extent
        high, low = (self.moved(sign * shift * along, varied).back().x for sign in (1, -1))
        return self.coordinates(high - low) / (2 * shift)


class Return(NamedTuple):
    """Where and when the motion of a loop returns to the section."""

    x: Array
    period: float
    changes: Changes
    turn: float
    """Gain of azimuth, rad."""


@dataclass(frozen=True)
class Orbit:
    """A periodic motion, closed to `CLOSED`."""

    loop: Loop
    """A state on it, and its period."""
    changes: Changes
    """The changes of case in a period."""
    turn: float
    """Gain of azimuth in a period, rad."""
    steps: int
    """Steps that Newton's method took."""
    derivative: Array
    """Derivative (d - 1, d - 1) of the return map."""

    @property
    def period(self) -> float:
        """Period, s."""
        return self.loop.period

    @property
    def p(self) -> Parameters:
        """The parameters of the ball on it."""
        return self.loop.p

    @cached_property
    def multipliers(self) -> Complex:
        """Floquet multipliers (d - 1,), d the dimension of the case, largest modulus first."""
        values = np.linalg.eigvals(self.derivative).astype(complex)
        return np.asarray(values[np.argsort(-np.abs(values), kind="stable")])

    @property
    def stable(self) -> bool:
        """Whether every small disturbance dies out."""
        return bool(np.all(np.abs(self.multipliers) < 1))

    @property
    def cases(self) -> tuple[Case, ...]:
        """The cases of a period, in order from that of `loop`."""
        return tuple(before for before, _ in self.changes) or (self.loop.case,)

    @cached_property
    def cycle(self) -> Trajectory:
        """The motion over one period, sampled in `ORBIT_SAMPLES` equal parts."""
        return _simulated(self.p, self.loop.x, self.period, ORBIT_SAMPLES, self.loop.restitution)

    @property
    def mean(self) -> Array:
        """Means of the state variables, shape (8,); that of omega_c from the gain of azimuth."""
        mean: Array = np.asarray(np.trapezoid(self.cycle.x, self.cycle.time, axis=0)) / self.period
        mean[VARIABLES.index("omega_c")] = self.turn / self.period
        return mean


def refine(p: Parameters, x: npt.ArrayLike, period: float, restitution: float = 0.0) -> Orbit:
    """The closed orbit near a state x (6 or 8 entries), of about this period, s, by Newton.

    `restitution` as in `Settings`. The guess may be off by some percent of the orbit.

    Raises `NoOrbitError` if Newton's method does not converge to `CLOSED` within `ITERATIONS`
    steps, or the ball doesn't come back from beside the orbit, for a derivative."""
    return closed_orbit(Loop.of(p, x, period, restitution))


def closed_orbit(loop: Loop, varied: str | None = None, neighbour: Array | None = None) -> Orbit:
    """The closed orbit near a loop, by Newton's method; a `varied` parameter is one more unknown.

    There is then one unknown more than equations: the place on a branch. Newton's step is the
    shortest one (Moore and Penrose), across the branch. The `defect_jacobian` of a neighbour, if
    given, does until the defect falls slowly."""
    loop, back, steps = close_loop(loop, varied, neighbour)
    return Orbit(loop, back.changes, back.turn, steps, loop.derivative())


def close_loop(loop: Loop, varied: str | None, neighbour: Array | None) -> tuple[Loop, Return, int]:
    """The closed loop near a loop, its return, and Newton's steps; arguments of `closed_orbit`."""
    before = math.inf
    for step in range(ITERATIONS + 1):
        back = loop.back()
        loop = replace(loop, period=back.period)
        defect = loop.coordinates(back.x - loop.x)
        size = float(np.abs(defect).max())
        if size <= CLOSED:
            return loop, back, step
        matrix = neighbour = None if size > before / FAST else neighbour
        before = size
        if matrix is None:
            matrix = defect_jacobian(loop, loop.derivative(), varied)
        loop = loop.moved(np.asarray(-np.linalg.lstsq(matrix, defect)[0], dtype=float), varied)
    raise NoOrbitError(
        f"after {ITERATIONS} steps an orbit of period {loop.period:g} s is open by {size:.1e} in "
        f"natural units"
    )


def defect_jacobian(loop: Loop, derivative: Array, varied: str | None) -> Array:
    """Derivative (d - 1, d - 1) of a loop's defect; one more column if a parameter is varied."""
    by_state = derivative - np.eye(len(derivative))
    if not varied:
        return by_state
    return np.column_stack([by_state, loop.slope(np.eye(len(loop.free) + 1)[-1], varied)])


def extent(run: Trajectory) -> float:
    """Largest range of a state variable in a run, in natural units."""
    return float((np.ptp(run.x, axis=0) / state_units(run.header.parameters)).max())


def _simulated(
    p: Parameters, x: npt.ArrayLike, duration: float, samples: int, restitution: float
) -> Trajectory:
    """The motion from a state; `NoOrbitError` if it breaks down or can't begin."""
    try:
        settings = Settings(rtol=RETURN_RTOL, restitution=restitution)
        return simulate(p, x, duration, None, settings, sample_interval=duration / samples)
    except (SimulationError, InputError) as error:
        raise NoOrbitError(f"no motion for {duration:g} s: {error}") from error


def active_variables(case: Case) -> list[int]:
    """Indices of the active variables of a case (Table 4) among those of the state."""
    return [VARIABLES.index(name) for name in TRAITS[case].active]
