"""How disturbances of the stationary states die out (Propositions 1-6), held against the eigenvalues.

A state is pushed by a little along an eigenvector, to one side and to the other; half the difference of the two runs
has no even nonlinearity and no offset, and its exponents (Prony) are the eigenvalue. With MuJoCo the pairs are run at
two time steps; the finer one is taken, and what the step changes is its uncertainty.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

import analytic
from analytic.jacobian import jacobian
from compare.claims import Check, Claim, Lab, Level, Outcome
from compare.studies import COVERAGE, Bench, exponent, main, settled_case
from compare.tasks import Task
from mjsim import ContactSettings
from mjsim.measurement import Measured, window_mean
from model import Case, Parameters, Trajectory
from model.arrays import Array
from model.cases import TRAITS
from model.kinematics import VARIABLES

PUSH = 2e-4
"""Size of a disturbance in units of the state's own spin on floor and wall, omega_0 R/r."""
LASTS = 3.0
"""How much of a decay is looked at, in units of its time constant."""
RTOL = analytic.Settings().rtol
STEPS = {Level.QUICK: (4e-3, 2e-3), Level.DEFAULT: (2e-3, 1e-3), Level.FULL: (1e-3, 5e-4)}
"""Time steps of MuJoCo, and of Moreau-Jean's method, s."""
HEIGHT = {case: {"R": 0.0, "S": 0.0, "N": 1.0}[case.A.name] for case in Case} | {Case.NS: 1e3}
"""Height y at the start, in units of R: off the floor the ball must not meet it, least of all sinking."""
INTERVAL = 8e-3
"""Time between samples, s."""
DURATION = 4.0
"""One for all runs, so that they share a batch, s."""


@dataclass(frozen=True)
class Mode:
    """An eigenvalue of a stationary state, and the direction that belongs to it."""

    name: str
    """Parameter set."""
    p: Parameters
    x: Array
    """The state, shape (8,)."""
    case: Case
    exponent: complex
    """rad s-1"""
    v: Array
    """A disturbance that contains it alone, shape (8,)."""

    @property
    def order(self) -> int:
        """1 for a real eigenvalue, 2 for a pair."""
        return 2 if self.exponent.imag else 1

    @property
    def shown(self) -> list[int]:
        """The variables that move most."""
        moving = np.abs(self.v) / np.abs(self.v).max() > 0.05
        return np.flatnonzero(moving).tolist()


def modes(name: str, p: Parameters, case: Case, wanted: int) -> list[Mode]:
    """The `wanted` slowest modes of the stable stationary state of a case that move at all; pairs count once."""
    (solution,) = (s for s in analytic.stationary_solutions(p) if s.case is case and s.stable)
    active = [v for v in TRAITS[case].active if not (case is Case.NS and v == "y")]
    values, vectors = np.linalg.eig(jacobian(case, solution.x, p)[-len(active) :, -len(active) :])
    found = []
    for k in np.argsort(-values.real):
        if values[k].imag < 0 or abs(values[k]) < 1e-9 * np.abs(values).max():
            continue
        v = np.zeros(8)
        v[[VARIABLES.index(name) for name in active]] = vectors[:, k].real
        x = solution.x.copy()
        x[0] = HEIGHT[case] * p.R
        v *= PUSH * max(abs(p.omega_0), 1.0) * p.R / p.r / np.abs(v[2:6]).max()
        found.append(Mode(name, p, x, case, complex(values[k]), v))
    return found[:wanted]


def measured_exponent(mode: Mode, runs: Sequence[Trajectory]) -> tuple[complex, float]:
    """The exponent that pairs of runs show, coarsest step first, and its standard uncertainty, rad/s."""
    rate, size = -mode.exponent.real, abs(mode.exponent)
    last = min(DURATION, LASTS / max(rate, 1e-9 * size))
    found, scatter = [], 0.0
    for up, down in zip(runs[::2], runs[1::2], strict=True):
        window = slice(1, max(24, round(last / INTERVAL)))  # not the first sample, when forces build up
        d = (up.x - down.x)[window, mode.shown] / 2
        value, scatter = exponent(d, INTERVAL, mode.order, 1 / size)
        found.append(value)
    engine_error = abs(found[-1] - found[0]) if len(found) > 1 else RTOL / PUSH * size
    return found[-1], math.hypot(scatter, engine_error)


def measured(lab: Lab, mode: Mode, engine: str) -> tuple[Measured, Task]:
    """The rate at which a mode decays, 1/s, and one of the runs."""
    tasks = _tasks(mode, engine, lab.level)
    value, uncertainty = measured_exponent(mode, lab.run(tasks))
    return Measured(-value.real, uncertainty), tasks[-1]


def check(bench: Bench, mode: Mode, tasks: Sequence[Task], runs: Sequence[Trajectory]) -> list[Check]:
    """Hold the exponents of pairs of runs, coarsest step first, against the eigenvalue."""
    found, uncertainty = measured_exponent(mode, runs)
    cases = mode.case, settled_case(runs[-1])
    parts = [("decay rate", -mode.exponent.real, -found.real)]
    if mode.order == 2:
        parts.append(("frequency", abs(mode.exponent.imag), abs(found.imag)))
    return [
        bench.number(
            tasks[-1], f"{quantity} of {mode.case.name}", "1/s", f"λ = {mode.exponent:.4g}", predicted,
            Measured(value, uncertainty), cases,
        )
        for quantity, predicted, value in parts
    ]  # fmt: skip


def _tasks(mode: Mode, engine: str, level: Level) -> list[Task]:
    """Runs to either side, at every time step, coarsest first."""
    settings: list[ContactSettings | analytic.Settings | None] = [None]
    if engine == "mujoco":
        # One speed for all modes but those that sink, and one set of parameters, so that they share a batch.
        fastest = SINKING if mode.case is Case.NS else SLIDING
        settings = [ContactSettings.for_problem(REFERENCE, step, fastest) for step in STEPS[level]]
    elif engine == "time-stepping":
        settings = [analytic.Settings(method=engine, step=step) for step in STEPS[level]]
    return [
        Task(
            engine=engine, parameters=mode.p, x0=tuple((mode.x + side * mode.v).tolist()), t_end=DURATION,
            settings=chosen, sample_interval=INTERVAL,
        )
        for chosen in settings
        for side in (1, -1)
    ]  # fmt: skip


REFERENCE, ROUGH, STEEL = (Parameters.named(name) for name in ("reference", "high-wall-friction", "steel-in-water"))
DRAGGED = REFERENCE.replace(c=4.0)
"""Drag so strong that the ball sinks at 2 m/s only."""
SLIDING, SINKING = 1.5, 2.5
"""Slip speeds up to which contact is to be continuous, m/s; those of the states below are less."""


def _modes() -> list[Mode]:
    return [
        *modes("reference", REFERENCE, Case.RR, 1),
        *modes("steel-in-water", STEEL, Case.RR, 1),
        *modes("reference", REFERENCE.replace(omega_0=0.0), Case.RS, 1),
        *modes("reference", REFERENCE.replace(omega_0=20.0), Case.SS, 1),
        *modes("reference", REFERENCE.replace(omega_0=28.0), Case.SS, 2),
        *modes("high-wall-friction", ROUGH.replace(omega_0=20.0), Case.NR, 2),
        *modes("high-wall-friction", ROUGH.replace(omega_0=28.0), Case.NR, 2),
        *modes("reference, c = 4", DRAGGED.replace(omega_0=14.0), Case.NS, 3),
        *modes("reference, c = 4", DRAGGED.replace(omega_0=22.0), Case.NS, 3),
    ]


def _witnesses(case: Case, level: Level) -> list[str]:
    """Where the wall carries next to nothing (RS) MuJoCo's contact hovers; time stepping is slow."""
    found = ["event"] if case is Case.RS else ["mujoco", "event"]
    return [*found, "time-stepping"] if level > Level.QUICK and case in (Case.RR, Case.RS, Case.NR) else found


def _study(case: Case, lab: Lab) -> list[Check]:
    """Every mode of a case, with every engine; what other claims need of MuJoCo runs in the same batch."""
    if case is not Case.RS:
        lab.campaign.complete(
            task for mode in _modes() if mode.case is not Case.RS for task in _tasks(mode, "mujoco", lab.level)
        )
    found = []
    for mode in _modes():
        if mode.case is case:
            for engine in _witnesses(case, lab.level):
                tasks = _tasks(mode, engine, lab.level)
                found += check(Bench(lab, mode.name), mode, tasks, lab.run(tasks))
    return found


def _sinking(lab: Lab) -> list[Check]:
    """Speed of the sinking state, and its modes."""
    found = []
    for mode in _modes():
        if mode.case is Case.NS and mode.order == 2:
            for engine in _witnesses(mode.case, lab.level):
                tasks = _tasks(mode, engine, lab.level)
                *_, coarse, _, fine, _ = [None, None, *lab.run(tasks)]
                mean = window_mean(fine.time, fine.v_y)
                step = float(abs(mean.value - np.mean(coarse.v_y))) if coarse else RTOL * abs(mean.value)
                speed = Measured(mean.value, math.hypot(mean.uncertainty, step))
                found.append(
                    Bench(lab, mode.name).number(
                        tasks[-2], "v_y", "m/s", "sinking", float(mode.x[1]), speed, (mode.case, settled_case(fine))
                    )
                )
    return found + _study(Case.NS, lab)


def _spinning(lab: Lab) -> list[Check]:
    """A ball that spins on the spot keeps its spin, whatever it is; and a push of omega_c dies out."""
    bench, still = Bench(lab, "reference"), REFERENCE.replace(omega_0=0.0)
    found = []
    tasks = [
        Task(engine=engine, parameters=still, x0=(0, 0, 0, 0, spin, 0, gap, 0), t_end=2.0, settings=settings)
        # In contact with a wall that carries nothing, round-off makes MuJoCo's ball touch it now and then.
        for engine, gap, settings in (("event", 0.0, None), ("mujoco", 1e-6, ContactSettings.at(STEPS[lab.level][0])))
        for spin in (-20.0, 5.0, 60.0)
    ]
    for task, run in zip(tasks, lab.run(tasks), strict=True):
        spin = task.x0[4]
        mean = window_mean(run.time, run.slip_y)
        # Every step rounds the spin once.
        steps = task.settings.timestep if isinstance(task.settings, ContactSettings) else run.time[1]
        rounding = np.finfo(float).eps * abs(spin) * math.sqrt(task.t_end / steps)
        measured = Measured(mean.value, math.hypot(mean.uncertainty, rounding))
        condition = f"ω̃_y = {spin:g}" + (", 1 µm off the wall" if task.x0[6] else "")
        found.append(bench.number(task, "ω̃_y", "rad/s", condition, spin, measured))
    return found + _study(Case.RS, lab)


def _neutral(lab: Lab) -> list[Check]:
    """The height at which the ball goes round on the wall is free: it keeps the one it has."""
    p, found = ROUGH.replace(omega_0=25.0), []
    (state,) = (s for s in analytic.stationary_solutions(p) if s.case is Case.NR)
    tasks = []
    for engine, settings in (("event", None), ("mujoco", ContactSettings.at(STEPS[lab.level][0]))):
        for height in (0.5, 1.0, 4.0):
            x0 = (height * p.R, *state.x[1:].tolist())
            tasks.append(Task(engine=engine, parameters=p, x0=x0, t_end=4.0, settings=settings))
    for task, run in zip(tasks, lab.run(tasks), strict=True):
        half = slice(len(run.time) // 2, None)
        mean = window_mean(run.time[half], run.y[half])
        # What the first steps leave of the start is a height as good as any other.
        settled = abs(mean.value - task.x0[0]) if task.engine == "mujoco" else RTOL * task.x0[0]
        rounding = float(np.finfo(float).eps) * (p.R + p.r + task.x0[0]) * math.sqrt(len(run.time))
        drift = float(run.y[-1] - run.y[half][0])
        found.append(
            Bench(lab, "high-wall-friction").number(
                task, "drift of y", "m", f"y = {task.x0[0]:g} m", 0.0,
                Measured(drift, math.hypot(mean.uncertainty, settled, rounding)), (Case.NR, settled_case(run)),
            )
        )  # fmt: skip
    return found + _study(Case.NR, lab)


def _one_sided(lab: Lab) -> list[Check]:
    """In SR the ball leans on the floor on one side of the solution only: from there its slip decays, or grows."""
    found = []
    for omega_0 in (20.0, 25.0, 30.0):
        p = ROUGH.replace(omega_0=omega_0)
        (state,) = (s for s in analytic.stationary_solutions(p) if s.case is Case.SR)
        values, vectors = np.linalg.eig(jacobian(Case.SR, state.x, p))
        k = int(np.argmax(np.abs(values - (-p.c / (1 + p.j)))))  # the other one is close to the decay of omega_c
        v = vectors[:, k].real / np.abs(vectors[:, k]).max()
        ratios = []
        tasks = []
        for size in (2e-5, 1e-5):
            x = state.x.copy()
            # A_y falls with omega_c (R omega_c + r slip_x): leaning is where that is less.
            lean = 2 * p.R * state.x[2] * v[0] + p.r * (state.x[3] * v[0] + state.x[2] * v[1])
            x[[2, 3]] -= np.sign(lean) * size * p.omega_0 * p.R / p.r * v
            lasts = 2.0 / abs(values[k])
            tasks.append(
                Task(
                    engine="event",
                    parameters=p,
                    x0=tuple(x.tolist()),
                    t_end=lasts,
                    settings=analytic.Settings(rtol=1e-12),
                )
            )
        runs = lab.run(tasks)
        scatter = 0.0
        for run in runs:
            step = float(run.time[1])
            d = np.diff(run.x[:, [2, 3]], axis=0)
            value, scatter = exponent(d, step, 1, 1 / abs(values[k]))
            ratios.append(value.real)
        uncertainty = math.hypot(scatter, ratios[1] - ratios[0])
        found.append(
            Bench(lab, "high-wall-friction").number(
                tasks[-1], "decay rate of SR", "1/s", "leaning on the floor", -float(values[k].real),
                Measured(-ratios[1], uncertainty), (Case.SR, settled_case(runs[-1], 1.0)),
            )
        )  # fmt: skip
    return found


def _claim(
    id: str, source: str, statement: str, study: Callable[[Lab], list[Check]],
    expected: Outcome = Outcome.CONFIRMED, reason: str = "",
) -> Claim:  # fmt: skip
    return Claim(
        id=id, source=source, statement=statement,
        prediction="stationary solution and the eigenvalues of its exact Jacobian",
        measurement=(
            "half the difference of two runs, pushed to either side along an eigenvector by 2e-4 of the ball's spin; "
            "its exponent by Prony's method"
        ),
        tolerance=(
            f"{COVERAGE:g} standard uncertainties: what halving the time step changes (or the integrator's tolerance "
            "over the push), and how much the two halves of the record disagree"
        ),
        expected=expected, reason=reason, study=study,
    )  # fmt: skip


CLAIMS = (
    _claim(
        "prop-1-rate", "Prop. 1, (23)", "A disturbance of two-point rolling dies out at the rate c/(1+2j).",
        lambda lab: _study(Case.RR, lab),
    ),
    _claim(
        "prop-2", "Prop. 2, (33)",
        "In a fluid at rest the ball spins on the spot at any rate (a zero eigenvalue); ω_c dies out at c/(1+j).",
        _spinning,
    ),
    _claim(
        "prop-3-rate", "Prop. 3, (35)",
        "With the floor slipping and the wall rolling, the state is stable above ω₀₃ and unstable below.",
        _one_sided, Outcome.CORRECTED,
        "The floor carries nothing in this state: the eigenvalue shows only on the side where the ball leans on the "
        "floor, on the other it lifts off, and its height is then free. (35) needs ω₀ ≥ √(g/ηR) instead of ≤.",
    ),
    _claim(
        "prop-4-rate", "Prop. 4, section 5.2",
        "Disturbances of slipping at both points die out between ω₀₁ and ω₀₄, at the rates of the eigenvalues.",
        lambda lab: _study(Case.SS, lab),
    ),
    _claim(
        "prop-5-rate", "Prop. 5, (46)",
        "Carried by the wall alone, the ball keeps any height (a zero eigenvalue), and all else dies out.", _neutral,
    ),
    _claim(
        "prop-6", "Prop. 6, (49)",
        "Below ω₀₂ the ball off the floor sinks at (g − ηω₀²R)/c, with an undamped oscillation at ω₀.", _sinking,
        Outcome.CORRECTED, "One row of (49), ω_c = ω₀, is missing in print.",
    ),
)  # fmt: skip

if __name__ == "__main__":
    sys.exit(main(CLAIMS))
