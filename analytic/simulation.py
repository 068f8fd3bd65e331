"""The door to simulation: settings, checks, and the choice of the method."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from analytic import hybrid, time_stepping
from analytic.records import Recorder
from analytic.settings import Settings
from model import Flow, Header, InputError, Parameters, SimulationError, Trajectory
from model.arrays import Array
from model.errors import suggestion
from model.kinematics import full_state
from model.parameters import check_number

_METHODS = {"event": hybrid.run, "time-stepping": time_stepping.run}


def simulate(
    p: Parameters, x0: npt.ArrayLike, t_end: float, flow: Flow | None = None, settings: Settings | None = None, *,
    sample_interval: float | None = None, theta_0: float = 0.0, progress: Callable[[float], None] | None = None,
    **changes: Any,
) -> Trajectory:  # fmt: skip
    """Simulate the ball across all nine cases.

    Parameters
    ----------
    p : parameters; its omega_0 is used if there is no `flow`
    x0 : state at the start, 6 entries, or 8 with h and v_h (`model.kinematics.VARIABLES`); its case is found from it
    t_end : duration, s
    settings : `Settings` if None
    sample_interval : time between samples, s; a thousandth of t_end if None. The end is always a sample.
    theta_0 : azimuth at the start, rad
    progress : called with the fraction done, from time to time
    changes : any field of `Settings` by name, in place of that in `settings`

    Returns
    -------
    Trajectory
        Its header tells the largest error of the energy balance (``energy_residual`` in J, beside ``energy_scale``,
        the largest energy in play). A run that is interrupted (Ctrl-C) returns what it has; the header says so.

    Raises
    ------
    InputError
        If an argument is out of range, or the ball starts inside floor or wall, or with a speed into one it touches
        (unless ``initial_impact``).
    SimulationError
        If the run can't go on; it carries the samples so far.
    """
    settings = _settings(settings, changes)
    flow = Flow.steady(p.omega_0) if flow is None else flow
    x = _start(x0, p, settings)
    times = _sample_times(t_end, sample_interval)
    theta_0 = check_number("theta_0", theta_0, "rad")
    shown = dataclasses.asdict(settings) | {
        "x0": x.tolist(), "t_end": float(times[-1]), "sample_interval": float(times[1] - times[0]), "theta_0": theta_0,
    }  # fmt: skip
    recorder = Recorder(p, times, progress)
    failure, cause = "", None
    try:
        _METHODS[settings.method](x.tolist(), theta_0, p, flow, settings, recorder)
    except KeyboardInterrupt:
        failure = f"interrupted at t = {recorder.time:g} s"
    except ArithmeticError as error:
        failure, cause = f"stopped at t = {recorder.time:g} s: {error}", error
    trajectory = recorder.trajectory(Header(settings.method, p, flow, shown, failure=failure))
    if cause:
        raise SimulationError(failure, trajectory) from cause
    return trajectory


def _settings(settings: Settings | None, changes: dict[str, Any]) -> Settings:
    names = [field.name for field in dataclasses.fields(Settings)]
    for name in changes:
        if name not in names:
            raise InputError(f"unknown setting {name!r}{suggestion(name, names)}; known: {', '.join(names)}")
    return dataclasses.replace(settings or Settings(), **changes)


def _start(x0: npt.ArrayLike, p: Parameters, settings: Settings) -> Array:
    """The full state at the start, or `InputError` if the ball can't be in it."""
    x = full_state(np.asarray(x0, dtype=float))
    if x.ndim != 1:
        raise InputError(f"a simulation starts from one state, not from an array of shape {x.shape}")
    for gap, speed, place in (("y", "v_y", "floor"), ("h", "v_h", "wall")):
        value, rate = (float(x[k]) for k in ((0, 1) if gap == "y" else (6, 7)))
        if value < 0:
            raise InputError(f"{gap} = {value:g} m is out of range: the ball starts inside the {place}; must be >= 0")
        if value == 0 and rate < 0 and not settings.initial_impact:
            raise InputError(
                f"{speed} = {rate:g} m s-1 is out of range: the ball touches the {place} ({gap} = 0) and moves in; "
                "must be >= 0, or set initial_impact"
            )
    if x[6] >= p.R:
        raise InputError(f"h = {x[6]:g} m is out of range: must be < R = {p.R:g} m")
    return x


def _sample_times(t_end: float, interval: float | None) -> Array:
    """Multiples of the interval, and t_end."""
    if check_number("t_end", t_end, "s") <= 0:
        raise InputError(f"t_end = {t_end:g} s is out of range: a simulation must last > 0 s")
    if interval is None:
        return np.linspace(0.0, t_end, 1001)
    if check_number("sample_interval", interval, "s") <= 0:
        raise InputError(f"sample_interval = {interval:g} s is out of range: must be > 0")
    count = math.ceil(t_end / interval * (1 - 4 * float(np.finfo(float).eps)))
    if count > 50_000_000:
        raise InputError(f"sample_interval = {interval:g} s is out of range: it makes {count} samples; at most 5e7")
    return np.append(np.arange(count) * interval, t_end)
