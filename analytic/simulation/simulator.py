"""Where simulations start: settings, checks of the arguments, choice of the method; and two motions of the paper."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
import numpy.typing as npt

from analytic.bifurcation import diagram as bifurcation
from analytic.mechanics import drag
from analytic.simulation.motion import Recorder
from analytic.stationary import solutions as stationary
from model import Case, Flow, Header, InputError, Parameters, SimulationError, State, Trajectory, time_scales
from model.arrays import Array
from model.parameters import NOT_NEGATIVE, POSITIVE, Range, check_choice, check_names, check_number

MAX_SAMPLES = 5e7


@dataclass(frozen=True, kw_only=True)
class Settings:
    """How to simulate.

    Raises `InputError` if a value is out of range.
    """

    method: str = "event"
    """``event``: integrate case by case and locate every change of case. ``time-stepping``: Moreau-Jean, see there."""
    rtol: float = 1e-9
    """Relative tolerance of the integrator (event); the absolute one is a thousandth of it in natural units: lengths in
    R, times in sqrt(R/g), the ball's spin in that of a ball that rolls at sqrt(g R)."""
    timestep: float | None = None
    """Longest time step, s, at most half of `model.time_scales.shortest_time`; `fitting_step` of 500 if None
    (time-stepping)."""
    restitution: float = 0.0
    """Newton's coefficient of restitution e of both contacts, 0 <= e <= 1. A ball that hops in the corner is slow
    (event): a series of hops on the floor takes about ln(rtol)/ln(e) impacts, of which each takes about a millisecond,
    and each hit of the wall, itself one of a series, starts another. At e = 0.9 there may be 1e4."""
    leave_rolling: str = "slip-stability"
    """When RR ends, whose forces are not determined (event). ``slip-stability``: as soon as a slight slip would last,
    Definitions 1-3 (docs/theory.md, section 7). ``infeasible``: when no forces within both Coulomb cones hold it. On
    the stationary orbit both are the same for mu <= 1; on rougher floors, and off it, the second is later."""
    initial_impact: bool = False
    """Let a ball that starts with a speed into a closed contact collide at once, instead of refusing it."""

    def __post_init__(self) -> None:
        check_choice("method", self.method, ("event", "time-stepping"))
        check_choice("leave_rolling", self.leave_rolling, ("slip-stability", "infeasible"))
        if not isinstance(self.initial_impact, bool):
            raise InputError(f"initial_impact = {self.initial_impact!r} must be true or false")
        check_number("rtol", self.rtol, "1", Range(100 * float(np.finfo(float).eps), 1e-2))
        check_number("restitution", self.restitution, "1", Range(0.0, 1.0))
        if self.timestep is not None:
            check_number("timestep", self.timestep, "s", POSITIVE)


def fitting_step(steps: float, p: Parameters, flow: Flow, t_end: float) -> float:
    """sqrt(R/g)/`steps`, or the longest step that the times of a run of t_end s allow if that is shorter; s."""
    shortest, _ = time_scales.shortest_time(p, flow, t_end, partial(drag.coefficient, p=p))
    return min(math.sqrt(p.R / p.g) / steps, shortest / 2)


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
    if settings.method == "event" and p.fluid_torque:
        raise InputError(
            f"fluid_torque = {p.fluid_torque:g} s-1: the event-driven simulation leaves the torque out; "
            "method = 'time-stepping' takes it"
        )
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


def slip_perturbation(p: Parameters, slip: float, beta: float, t_end: float) -> Trajectory:
    """The stationary orbit of NR, pushed into NS by a slip of `slip` rad/s along beta: Figs. 4 and 5.

    For omega_0 > sqrt(g/(eta R)) (61) slip dies out and the ball returns to NR (Fig. 4), else it grows (Fig. 5).
    """
    orbit = stationary.solution(p, Case.NR, formal=True).state
    clear = 1.0  # height in m: Figs. 4 and 5 leave the floor out
    x = orbit._replace(y=clear, slip_y=slip * math.sin(beta), slip_z=slip * math.cos(beta))
    return simulate(p, x, t_end, sample_interval=t_end / 10_000)


def unloading(p: Parameters, hold: float) -> Trajectory:
    """omega_0 lowered in steps through omega_02 with the ball riding the wall: the black dot of Fig. 13 (eta > j).

    NR is left for NS, the ball falls, hits the floor, and ends in RR: the transients and impacts of section 5.3.
    """
    limit = bifurcation.thresholds(p).omega_02
    levels = limit * np.array([1.2, 1.1, 1.02, 0.98])
    start = stationary.solution(p.replace(omega_0=float(levels[0])), Case.NR).state._replace(y=0.02)
    flow = Flow.staircase(levels.tolist(), hold)
    return simulate(p, start, hold * len(levels), flow, sample_interval=hold / 4000)
