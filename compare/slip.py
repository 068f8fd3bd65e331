"""Stability with respect to slipping (sections 3 and 4): the rolling ball is given a slight slip, and it dies or grows.

The initial growth rate of the slip is gamma of (53). It is read from the first milliseconds of runs in which the slip
starts at a finite size, taken to a vanishing one; where gamma passes through zero is the threshold. Every gamma here is
linear in the variable it is drawn over, omega_0 or its square, so that a straight line finds its zero.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

import analytic
from analytic import slip_stability, thresholds
from compare.claims import Check, Claim, Lab, Level, Outcome
from compare.studies import COVERAGE, Bench, main, settled_case, straight_line
from compare.tasks import Task
from mjsim import ContactSettings
from mjsim.measurement import Measured
from model import Case, Parameters, Trajectory
from model.arrays import Array

LASTS = 4e-3
"""How long the slip is looked at, s."""
SIZES = (16.0, 8.0)
"""Slips at the start, rad/s: so large that they don't end, or turn much, while they are looked at."""
SAMPLES = {Level.QUICK: (20, 40), Level.DEFAULT: (40, 80), Level.FULL: (80, 160)}
"""Time steps in that time."""
POINTS = {Level.QUICK: 3, Level.DEFAULT: 5, Level.FULL: 9}
"""Points of a straight line."""
FASTEST = 5.0
"""Slip speed up to which contact is to be continuous, m/s."""
SKIPPED = 4
"""Steps left out at the start, in which contact forces build up."""
WITNESSES = {level: ("mujoco",) if level is Level.QUICK else ("mujoco", "time-stepping", "event") for level in Level}
REFERENCE, ROUGH = Parameters.named("reference"), Parameters.named("high-wall-friction")
UNEQUAL = REFERENCE.replace(mu=0.3)
"""mu and eta are to be told apart."""
DRAGGED = ROUGH.replace(c=4.0)
OMEGA_RS, OMEGA_SR = 3.0, 15.0
"""omega_c of the balls that lag behind the fluid, rad/s."""


@dataclass(frozen=True)
class Push:
    """A rolling state, and the direction of slip in which it is pushed."""

    p: Parameters
    x: Array
    """Shape (8,)."""
    n: tuple[float, float, float]
    """Unit vector over slip_x, slip_y, slip_z."""
    sizes: tuple[float, float] = SIZES
    lasts: float = LASTS

    def tasks(self, engine: str, level: Level) -> list[Task]:
        """Every time step, coarsest first, with every size."""
        steps = [self.lasts / n for n in SAMPLES[level][engine == "event" :]]
        return [
            Task(
                engine=engine, parameters=self.p, x0=tuple((self.x + size * self._direction).tolist()),
                t_end=self.lasts, settings=_settings(engine, step), sample_interval=step,
            )
            for step in steps
            for size in self.sizes
        ]  # fmt: skip

    @property
    def _direction(self) -> Array:
        return np.array([0, 0, 0, *self.n, 0, 0], dtype=float)

    def growth(self, runs: Sequence[Trajectory]) -> Measured:
        """gamma in rad/s^2 from the runs of `tasks`: the initial rate of change of the slip, for a vanishing size."""
        limits = []
        for pair in zip(runs[::2], runs[1::2], strict=True):
            rates = np.array([[_initial_rate(run, self.n, degree) for degree in (2, 3)] for run in pair])
            limits.append(rates[1] + (rates[1] - rates[0]) * self.sizes[1] / (self.sizes[0] - self.sizes[1]))
        value, other = limits[-1]
        return Measured(float(value), math.hypot(value - other, float(limits[-1][0] - limits[0][0])))


def _initial_rate(run: Trajectory, n: Sequence[float], degree: int) -> float:
    slip = np.stack([run.slip_x, run.slip_y, run.slip_z], axis=-1) @ np.array(n)
    fit = np.polynomial.Polynomial.fit(run.time[SKIPPED:], slip[SKIPPED:], degree)
    return float(fit.deriv()(0.0))


def _settings(engine: str, step: float) -> ContactSettings | analytic.Settings | None:
    if engine == "mujoco":
        return ContactSettings.for_problem(REFERENCE, step, FASTEST)
    return analytic.Settings(method=engine, step=step) if engine == "time-stepping" else None


def measure(lab: Lab, pushes: Sequence[Push], engine: str) -> list[tuple[Task, Measured]]:
    """gamma of every push, with the task of its finest and smallest run."""
    tasks = [push.tasks(engine, lab.level) for push in pushes]
    runs = iter(lab.run([task for some in tasks for task in some]))
    return [(some[-1], push.growth([next(runs) for _ in some])) for push, some in zip(pushes, tasks, strict=True)]


def zero(
    lab: Lab, name: str, quantity: str, unit: str, pushes: Sequence[Push], over: Sequence[float],
    predicted: tuple[float, float], condition: str,
) -> list[Check]:  # fmt: skip
    """Hold the zero and the slope of gamma over a variable against their predictions, with every witness."""
    found = []
    for engine in WITNESSES[lab.level]:
        values = measure(lab, pushes, engine)
        task = values[-1][0]
        line = straight_line(over, [v.value for _, v in values], [_noise(v, task) for _, v in values])
        for what, of, value, measured in zip(
            (f"{quantity} at γ = 0", f"dγ/d({quantity})"), (unit, f"rad/s² per {unit}"), predicted, line, strict=True
        ):
            found.append(Bench(lab, name).number(task, what, of, condition, value, measured))
    return found


def _noise(value: Measured, task: Task) -> float:
    """The uncertainty of gamma, and the tolerance of the event-driven integrator over the time looked at."""
    own = analytic.Settings().rtol * SIZES[0] / LASTS if task.engine == "event" else 0.0
    return math.hypot(value.uncertainty, own)


def _rolling(p: Parameters, omega_c: float) -> Array:
    return np.array([0.0, 0.0, omega_c, 0, 0, 0, 0, 0])


def _nr_to_ns(lab: Lab) -> list[Check]:
    """Slip at the wall of a ball that it alone carries, in the direction beta = 0 in which it grows first."""
    t = thresholds(REFERENCE)
    pushes = []
    for omega_0 in np.linspace(0.9, 1.1, POINTS[lab.level]) * t.omega_02:
        p = REFERENCE.replace(omega_0=float(omega_0))
        (state,) = (s for s in analytic.stationary_solutions(p) if s.case is Case.NR)
        x = state.x.copy()
        x[0] = p.R
        pushes.append(Push(p, x, (0, 0, 1)))
    p = REFERENCE
    over = [push.p.omega_0**2 for push in pushes]
    slope = -(1 + p.j) / p.j * p.eta * p.R / p.r
    return zero(lab, "reference", "ω₀²", "rad²/s²", pushes, over, (t.omega_02**2, slope), "NR→NS, β = 0")


def _rr_to_rs(lab: Lab) -> list[Check]:
    """Slip at the wall of a ball that lags behind the fluid; the growing side is slip_y > 0."""
    p, w = UNEQUAL, OMEGA_RS
    lag = p.eta * (1 + p.j) * (1 + 2 * p.j) * w**2 / (p.j * p.c)
    over = [w + lag * f for f in np.linspace(0.6, 1.4, POINTS[lab.level]).tolist()]
    pushes = [Push(p.replace(omega_0=omega_0), _rolling(p, w), (0, 1, 0)) for omega_0 in over]
    slope = p.c * p.R / ((1 + p.j) * p.r)
    return zero(
        lab, "reference, μ = 0.3", "ω₀", "rad/s", pushes, over, (w + lag, slope), f"RR→RS, ω_c = {w:g}, ω̃_y > 0"
    )


def _rr_to_rs_stationary(lab: Lab) -> list[Check]:
    """With omega_c = omega_0 slip at the wall dies out on either side at every omega_0 but 0."""
    p, found = UNEQUAL, []
    for side in (1, -1):
        omegas = np.linspace(4.0, 10.0, POINTS[lab.level]).tolist()
        pushes = [Push(p.replace(omega_0=w), _rolling(p, w), (0, side, 0)) for w in omegas]
        slope = -p.eta * (1 + 2 * p.j) * p.R / (p.j * p.r)
        found += zero(
            lab, "reference, μ = 0.3", "ω₀²", "rad²/s²", pushes, [w**2 for w in omegas], (0.0, slope),
            f"RR→RS, ω̃_y {'>' if side > 0 else '<'} 0",
        )  # fmt: skip
    return found


def _rr_to_sr(lab: Lab) -> list[Check]:
    """Slip at the floor of a ball that lags behind the fluid; the growing side is slip_x < 0."""
    p, w = DRAGGED, OMEGA_SR
    lag = (1 + 2 * p.j) * p.mu * (p.g - p.j * p.R * w**2) / (p.j * p.R * p.c)
    over = [w + lag * f for f in np.linspace(0.7, 1.3, POINTS[lab.level]).tolist()]
    pushes = [Push(p.replace(omega_0=omega_0), _rolling(p, w), (-1, 0, 0)) for omega_0 in over]
    slope = p.c * p.R / ((1 + p.j) * p.r)
    name = "high-wall-friction, c = 4"
    return zero(lab, name, "ω₀", "rad/s", pushes, over, (w + lag, slope), f"RR→SR, ω_c = {w:g}, ω̃_x < 0")


def _rr_to_sr_stationary(lab: Lab) -> list[Check]:
    """With omega_c = omega_0 slip at the floor dies out, on either side, as long as the floor carries anything."""
    p, found = ROUGH, []
    t = thresholds(p)
    for side in (1, -1):
        omegas = (t.omega_03 * np.linspace(0.5, 0.8, POINTS[lab.level])).tolist()
        pushes = [Push(p.replace(omega_0=w), _rolling(p, w), (side, 0, 0)) for w in omegas]
        slope = (1 + 2 * p.j) * p.mu * p.R / ((1 + p.j) * p.r)
        found += zero(
            lab, "high-wall-friction", "ω₀²", "rad²/s²", pushes, [w**2 for w in omegas], (t.omega_03**2, slope),
            f"RR→SR, ω̃_x {'>' if side > 0 else '<'} 0",
        )  # fmt: skip
    return found


def _rr_to_ss(side: int, lab: Lab) -> list[Check]:
    """Slip at both points along (0, 0), side 1, or (pi, pi), side -1: there the wall's friction has the other sign."""
    p, eta = REFERENCE, side * REFERENCE.eta
    omegas = np.linspace(9.0, 15.0, POINTS[lab.level]).tolist()
    over = [w**2 for w in omegas]
    pushes = [Push(p.replace(omega_0=w), _rolling(p, w), (0, 0, side)) for w in omegas]
    square = p.g / p.R * side * p.mu * (1 + eta) / (p.mu * p.eta * (1 + p.j) + p.j - eta)
    first, last = (
        float(slip_stability.gamma(Case.RR, Case.SS, push.x, push.n, push.p)) for push in pushes[:: len(pushes) - 1]
    )
    slope = (last - first) / (over[-1] - over[0])
    where = "(0, 0)" if side > 0 else "(π, π)"
    return zero(lab, "reference", "ω₀²", "rad²/s²", pushes, over, (square, slope), f"RR→SS, (α, β) = {where}")


def returns(
    lab: Lab, name: str, p: Parameters, x: Array, directions: Array, case: Case, back: bool, lasts: float = 1.0,
) -> list[Check]:  # fmt: skip
    """Push a rolling state slightly in many directions; all must end in the given case, the state's own if `back`.

    The checks count, for every witness, those that do; one that is back has no slip left where it rolls.
    """
    rolling = slice(4, 6) if case in (Case.NR, Case.NS) else slice(3, 6)
    found = []
    for engine in ("event", "mujoco"):
        settings = ContactSettings.at(2e-3) if engine == "mujoco" else None
        tasks = [
            Task(
                engine=engine, parameters=p, x0=tuple((x + np.array([0, 0, 0, *(SLIGHT * n), 0, 0])).tolist()),
                t_end=lasts, settings=settings, sample_interval=lasts / 100,
            )
            for n in directions
        ]  # fmt: skip
        runs = lab.run(tasks)
        cases = [settled_case(run) for run in runs]
        left = [float(np.linalg.norm(run.x[-1, rolling])) for run in runs]
        where = f"{len(runs)} directions, {'back to' if back else 'gone to'} {case.name}"
        good = sum(c is case and not (back and slip > SLIGHT / 100) for c, slip in zip(cases, left, strict=True))
        found.append(Bench(lab, name).count(tasks[len(tasks) // 8], "runs", where, len(runs), good))
    return found


def _circle(count: int) -> Array:
    angle = np.arange(count) * 2 * np.pi / count
    return np.stack([np.zeros(count), np.sin(angle), np.cos(angle)], axis=-1)


def _sphere(count: int) -> Array:
    """Directions spread evenly over a sphere (Fibonacci's lattice)."""
    k = np.arange(count) + 0.5
    z, angle = 1 - 2 * k / count, np.pi * (1 + math.sqrt(5)) * k
    return np.stack([np.sqrt(1 - z**2) * np.cos(angle), np.sqrt(1 - z**2) * np.sin(angle), z], axis=-1)


def _figure_4_5(lab: Lab) -> list[Check]:
    """On either side of omega_02 a push of the ball on the wall."""
    found = []
    for factor in (1.02, 0.98):
        p = REFERENCE.replace(omega_0=factor * thresholds(REFERENCE).omega_02)
        (state,) = (s for s in analytic.stationary_solutions(p) if s.case is Case.NR)
        x = state.x.copy()
        x[0] = 4 * p.R
        back = factor > 1
        found += returns(lab, "reference", p, x, _circle(DIRECTIONS[lab.level]), Case.NR if back else Case.NS, back)
    return found


def _figure_rr(lab: Lab) -> list[Check]:
    """On either side of omega_01 a push of the ball that rolls at both points."""
    found = []
    for factor in (0.98, 1.02) if lab.level is Level.QUICK else (0.5, 0.98, 1.02):
        p = REFERENCE.replace(omega_0=factor * thresholds(REFERENCE).omega_01)
        back = factor < 1
        # The slip begins for good once omega_c, which it has slowed down, has recovered.
        lasts = 1.0 if back else 5.0
        directions, case = _sphere(DIRECTIONS[lab.level]), Case.RR if back else Case.SS
        found += returns(lab, "reference", p, _rolling(p, p.omega_0), directions, case, back, lasts)
    return found


def _extrema(lab: Lab) -> list[Check]:
    """A direction that is neither (0, 0) nor (pi, pi) has a larger gamma, which is even positive: and slip dies out."""
    p = REFERENCE.replace(omega_0=thresholds(REFERENCE).omega_01 * 0.4)
    x, n = _rolling(p, p.omega_0), np.array([0.04, 1.0, -0.025])
    n = n / np.linalg.norm(n)
    found = []
    for what, direction in (("(0.04, 1, -0.025)", n), ("(α, β) = (0, 0)", np.array([0, 0, 1.0]))):
        push = Push(p, x, tuple(direction.tolist()), sizes=(200.0, 100.0), lasts=1e-3)
        gamma = float(slip_stability.gamma(Case.RR, Case.SS, x, push.n, p))
        for engine in WITNESSES[lab.level]:
            ((task, measured),) = measure(lab, [push], engine)
            value = Measured(measured.value, _noise(measured, task))
            found.append(Bench(lab, "reference").number(task, "γ", "rad/s²", f"RR→SS, {what}", gamma, value))
    return found + returns(
        lab, "reference", p, x, np.concatenate([n[None], _sphere(DIRECTIONS[lab.level])]), Case.RR, True
    )


SLIGHT = 1.0
"""Slip at the start of the runs that are watched, rad/s."""
DIRECTIONS = {Level.QUICK: 6, Level.DEFAULT: 24, Level.FULL: 96}

_FORMAL = "closed-form γ of (53)"
_MEASURED = (
    "initial growth rate of a slip along the given direction, from the first 4 ms of runs at two time steps and two "
    "sizes of slip; its zero over ω₀ by a straight line"
)
_TOLERANCE = (
    f"{COVERAGE:g} standard uncertainties: what halving the time step and another degree of the fit change, or the "
    "scatter about the line where that is larger"
)
_WATCHED = "slight slips of 1 rad/s in directions all round, watched for seconds; every single run must come out right"
_COUNTED = "none: all runs must end in the predicted case"


def _claim(
    id: str, source: str, statement: str, study: Callable[[Lab], list[Check]],
    expected: Outcome = Outcome.CONFIRMED, reason: str = "", watched: bool = False,
) -> Claim:  # fmt: skip
    return Claim(
        id=id, source=source, statement=statement, prediction=_FORMAL, measurement=_WATCHED if watched else _MEASURED,
        tolerance=_COUNTED if watched else _TOLERANCE, expected=expected, reason=reason, study=study,
    )  # fmt: skip


CLAIMS = (
    _claim("eq-61", "(56)-(61)", "Rolling on the wall alone is stable with respect to slipping above ω₀₂.", _nr_to_ns),
    _claim(
        "fig-4-5", "Figs. 4 and 5",
        "Above ω₀₂ a slight slip at the wall dies out and the ball rolls on; below it remains slipping for good.",
        _figure_4_5, watched=True,
    ),
    _claim(
        "eq-66", "(66)", "A ball that lags behind the fluid begins to slip at the wall where (66) says.", _rr_to_rs,
        Outcome.CORRECTED, "(66) prints μ; it is the friction of the wall, η, that holds the wall's contact.",
    ),
    _claim(
        "eq-67", "(67)", "Going round with the fluid, the ball never begins to slip at the wall alone, but at ω₀ = 0.",
        _rr_to_rs_stationary,
    ),
    _claim("eq-73", "(73)", "A ball that lags behind the fluid begins to slip at the floor by (73).", _rr_to_sr),
    _claim(
        "eq-74", "(74)", "Going round with the fluid, the ball doesn't slip at the floor alone below ω₀₃.",
        _rr_to_sr_stationary,
    ),
    _claim(
        "eq-82", "(82)", "Slip at both points at once, with directions (0, 0), grows above ω₀₁ and dies out below.",
        lambda lab: _rr_to_ss(1, lab) + _figure_rr(lab),
    ),
    _claim(
        "eq-83", "(83)", "Slip at both points with directions (π, π) always dies out: (83) holds for all ω₀ if η < 1.",
        lambda lab: _rr_to_ss(-1, lab),
    ),
    _claim(
        "extrema", "after (80)", "Directions (0, 0) and (π, π) are the global extrema of γ.", _extrema, Outcome.REFUTED,
        "With the Euclidean normal (75) other directions have a larger γ. Here it is even positive where (82) calls "
        "the rolling stable; the slip dies out all the same, because it turns. Measured by the kinetic energy of the "
        "slip the statement holds, and (82) follows.",
    ),
)  # fmt: skip

if __name__ == "__main__":
    sys.exit(main(CLAIMS))
