"""One simulation, by the method that its settings name; and two motions of the paper."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from types import ModuleType
from typing import Any

import numpy as np
import numpy.typing as npt

from analytic.bifurcation import diagram as bifurcation
from analytic.simulation.motion import Recorder
from analytic.simulation.settings import Settings, check_duration, sample_times, start_state
from analytic.stationary import solutions as stationary
from model import Case, Flow, Header, Parameters, SimulationError, Trajectory
from model.errors import check_type
from model.parameters import check_names, check_number


def simulate(
    p: Parameters,
    x0: npt.ArrayLike,
    t_end: float,
    flow: Flow | None = None,
    settings: Settings | None = None,
    *,
    sample_interval: float | None = None,
    theta_0: float = 0.0,
    progress: Callable[[float], None] | None = None,
    **changes: Any,
) -> Trajectory:
    """Simulate the ball across all nine cases.

    Parameters
    ----------
    p : parameters; its omega_0 is used if there is no `flow`
    x0 : state at the start, a `State` or 6 or 8 numbers in its order; its case follows from it
    t_end : duration, s
    settings : `Settings` if None
    sample_interval : time between samples, s; a thousandth of t_end if None. The end is always a
        sample.
    theta_0 : azimuth at the start, rad
    progress : called with the fraction done, from time to time; ends the run where it raises
        `InterruptedError`
    changes : any field of `Settings` by name, in place of that in `settings`

    Returns
    -------
    Trajectory
        Its header has the largest error of the energy balance (``energy_residual`` in J,
        beside ``energy_scale``, the largest energy in play).

    Raises
    ------
    InputError
        If an argument is of another type or out of range, or the ball starts inside floor or
        wall, or with a speed into one it touches (unless ``initial_impact``).
    SimulationError
        If the run can't go on, or `progress` ends it; it carries the samples so far."""
    check_type("p", p, Parameters)
    check_type("flow", flow, Flow | None)
    check_type("settings", settings, Settings | None)
    check_names(changes, [field.name for field in dataclasses.fields(Settings)], "setting")
    settings = dataclasses.replace(settings or Settings(), **changes)
    flow = Flow.steady(p.omega_0) if flow is None else flow
    x = start_state(x0, p, settings)
    times = sample_times(t_end, sample_interval)
    check_duration(p, flow, float(times[-1]), x)
    theta_0 = check_number("theta_0", theta_0, "rad")
    ends = {"t_end": float(times[-1]), "sample_interval": float(times[1] - times[0])}
    shown = dataclasses.asdict(settings) | {"x0": list(x), "theta_0": theta_0} | ends
    recorder, by = Recorder.whole(times, progress), simulator(settings)
    header = Header(settings.method, p, flow, shown)
    try:
        by.carry_out(x, theta_0, p, flow, settings, recorder)
    except (ArithmeticError, InterruptedError) as error:
        failure = f"stopped at t = {recorder.rows.reached[0]:g} s: {error}"
        header = dataclasses.replace(header, failure=failure)
        raise SimulationError(failure, recorder.trajectory(header, by.sample_forces)) from error
    return recorder.trajectory(header, by.sample_forces)


def simulator(settings: Settings) -> ModuleType:
    """The module of the method, with `carry_out` and `sample_forces`."""
    # here, because the integrators of scipy take half a second to load, and numba a while
    if settings.method == "event":
        from analytic.simulation import hybrid

        return hybrid
    from analytic.simulation import time_stepping

    return time_stepping


def slip_perturbation(p: Parameters, slip: float, beta: float, t_end: float) -> Trajectory:
    """The stationary NR, pushed into NS by a slip of `slip` rad/s along beta: Figs. 4 and 5.

    For omega_0 > sqrt(g/(eta R)) (61) slip dies out and the ball returns to NR (Fig. 4), else it
    grows (Fig. 5)."""
    orbit = stationary.solution(p, Case.NR, formal=True).state
    clear = 1.0  # height in m: Figs. 4 and 5 leave the floor out
    x = orbit._replace(y=clear, slip_y=slip * math.sin(beta), slip_z=slip * math.cos(beta))
    return simulate(p, x, t_end, sample_interval=t_end / 10_000)


def unloading(p: Parameters, hold: float) -> Trajectory:
    """omega_0 lowered in steps through omega_02 in NR: the black dot of Fig. 13 (eta > j).

    NR is left for NS, the ball hits the floor, and ends in RR: the transients of section 5.3."""
    limit = bifurcation.thresholds(p).omega_02
    levels = limit * np.array([1.2, 1.1, 1.02, 0.98])
    start = stationary.solution(p.replace(omega_0=float(levels[0])), Case.NR).state._replace(y=0.02)
    flow = Flow.staircase(levels.tolist(), hold)
    return simulate(p, start, hold * len(levels), flow, sample_interval=hold / 4000)
