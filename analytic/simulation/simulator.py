"""Where simulations start: checks of the arguments, choice of the method, header of the result."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from analytic.simulation.records import Recorder
from analytic.simulation.settings import Settings
from model import Flow, Header, Parameters, SimulationError, State, Trajectory
from model.arrays import Array
from model.parameters import NOT_NEGATIVE, POSITIVE, Range, check_names, check_number

MAX_SAMPLES = 5e7


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
    sample_interval : time between samples, s; a thousandth of t_end if None. The end is always a sample.
    theta_0 : azimuth at the start, rad
    progress : called with the fraction done, from time to time
    changes : any field of `Settings` by name, in place of that in `settings`

    Returns
    -------
    Trajectory
        Its header has the largest error of the energy balance (``energy_residual`` in J, beside ``energy_scale``,
        the largest energy in play). A run that is interrupted (Ctrl-C) returns what it has; the header says so.

    Raises
    ------
    InputError
        If an argument is out of range, or the ball starts inside floor or wall, or with a speed into one it touches
        (unless ``initial_impact``).
    SimulationError
        If the run can't go on; it carries the samples so far.
    """
    check_names(changes, [field.name for field in dataclasses.fields(Settings)], "setting")
    settings = dataclasses.replace(settings or Settings(), **changes)
    if settings.method == "event":
        from analytic.simulation.hybrid import run  # here, because the integrators of scipy take half a second to load
    else:
        from analytic.simulation.time_stepping import run
    flow = Flow.steady(p.omega_0) if flow is None else flow
    x = start_state(x0, p, settings)
    times = sample_times(t_end, sample_interval)
    theta_0 = check_number("theta_0", theta_0, "rad")
    start, (first, second, *_) = {"x0": list(x), "theta_0": theta_0}, times.tolist()
    shown = dataclasses.asdict(settings) | start | {"t_end": float(times[-1]), "sample_interval": second - first}
    recorder = Recorder(p, times, progress)
    failure, cause = "", None
    try:
        run(x, theta_0, p, flow, settings, recorder)
    except KeyboardInterrupt:
        failure = f"interrupted at t = {recorder.time:g} s"
    except ArithmeticError as error:
        failure, cause = f"stopped at t = {recorder.time:g} s: {error}", error
    trajectory = recorder.trajectory(Header(settings.method, p, flow, shown, failure=failure))
    if cause:
        raise SimulationError(failure, trajectory) from cause
    return trajectory


def start_state(x0: npt.ArrayLike, p: Parameters, settings: Settings) -> State:
    """The state at the start, or `InputError` if the ball can't be in it."""
    x = State.one(x0)
    check_number("y", x.y, "m", NOT_NEGATIVE, "to be above the floor it")
    check_number("h", x.h, "m", Range(0.0, p.R, below=True), "to be between wall and axis it")
    if not settings.initial_impact:
        for place, gap, name, speed in (("floor", x.y, "v_y", x.v_y), ("wall", x.h, "v_h", x.v_h)):
            if gap == 0:
                meaning = f"touching the {place} and without initial_impact it"
                check_number(name, speed, "m s-1", NOT_NEGATIVE, meaning)
    return x


def sample_times(t_end: float, interval: float | None) -> Array:
    """Multiples of the interval, and t_end."""
    t_end = check_number("t_end", t_end, "s", POSITIVE)
    if interval is None:
        return np.linspace(0.0, t_end, 1001)
    meaning = f"for at most {MAX_SAMPLES:g} samples it"
    interval = check_number("sample_interval", interval, "s", Range(t_end / MAX_SAMPLES), meaning)
    count = math.ceil(t_end / interval * (1 - 4 * float(np.finfo(float).eps)))
    return np.append(np.arange(count) * interval, t_end)
