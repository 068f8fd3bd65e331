"""What a simulation is asked for: settings, a start, and times to sample."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial

import numpy as np
import numpy.typing as npt

from analytic.mechanics import drag
from model import Flow, InputError, Parameters, State, time_scales
from model.arrays import Array
from model.kinematics import check_place
from model.parameters import NOT_NEGATIVE, POSITIVE, Range, check_choice, check_number
from model.trajectory import MOST_SAMPLES

LANDED = 1e-3
"""Speed relative to sqrt(g R) from which a landing counts: less is settling, or round-off."""
HUGE, MAX_RADIANS = 1e3, 1e5
"""Speed of a flow, in units of sqrt(g/R), beyond which at most so many radians are simulated."""


@dataclass(frozen=True, kw_only=True)
class Settings:
    """How to simulate.

    Raises `InputError` if a value is out of range."""

    method: str = "event"
    """``event``: case by case, locating every change. ``time-stepping``: Moreau-Jean, see there."""
    rtol: float = 1e-9
    """Relative tolerance of the integrator (event); the absolute one is a thousandth of it in
    natural units: lengths in R, times in sqrt(R/g), the ball's spin in that of a ball that rolls at
    sqrt(g R)."""
    timestep: float | None = None
    """Longest time step, s, at most half of `model.time_scales.shortest_time`; sqrt(R/g)/500, or
    that half if it is shorter, if None (time-stepping)."""
    restitution: float = 0.0
    """Newton's coefficient of restitution e of both contacts, 0 <= e <= 1. A ball that hops in the
    corner is slow (event): a series of hops on the floor takes about ln(rtol)/ln(e) impacts, of
    which each takes about a millisecond, and each hit of the wall, itself one of a series, starts
    another. At e = 0.9 there may be 1e4."""
    leave_rolling: str = "slip-stability"
    """When RR ends, whose forces are not determined (event). ``slip-stability``: as soon as a
    slight slip would last, Definitions 1-3 (docs/theory.md, section 7). ``infeasible``: when no
    forces within both Coulomb cones hold it. On the stationary orbit both are the same for mu <= 1;
    on rougher floors, and off it, the second is later."""
    initial_impact: bool = False
    """Let a ball that starts with a speed into a contact collide at once; else it is refused."""

    def __post_init__(self) -> None:
        check_choice("method", self.method, ("event", "time-stepping"))
        check_choice("leave_rolling", self.leave_rolling, ("slip-stability", "infeasible"))
        if not isinstance(self.initial_impact, bool):
            raise InputError(f"initial_impact = {self.initial_impact!r} must be true or false")
        check_number("rtol", self.rtol, "1", Range(100 * float(np.finfo(float).eps), 1e-2))
        check_number("restitution", self.restitution, "1", Range(0.0, 1.0))
        if self.timestep is not None:
            check_number("timestep", self.timestep, "s", POSITIVE)


def check_run(p: Parameters, flow: Flow, t_end: float, x0: State, settings: Settings) -> None:
    """Raise `InputError` for a run that can't begin, or is too long to be computed."""
    start_state(x0, p, settings)
    check_duration(p, flow, t_end, x0)
    if settings.timestep is not None:
        law = partial(drag.coefficient, p=p)
        time_scales.check_timestep(settings.timestep, p, flow, t_end, law, x0)


def check_duration(p: Parameters, flow: Flow, t_end: float, x0: State) -> None:
    """Raise `InputError` for an orbit or waves so fast that a run is too long to be computed.

    That is `MAX_RADIANS`, where they are more than `HUGE` times as fast as sqrt(g/R)."""
    most = max(HUGE * math.sqrt(p.g / p.R), MAX_RADIANS / t_end)
    for turn in time_scales.turns(p, flow, t_end, x0):
        if turn.rate > most:
            end = abs(turn.value) * most / turn.rate
            within = Range(high=end) if turn.value > 0 else Range(-end)
            meaning = f"for a run of {t_end:g} s it"
            check_number(turn.name, turn.value, turn.unit, within, meaning)


def start_state(x0: npt.ArrayLike, p: Parameters, settings: Settings) -> State:
    """The state at the start, or `InputError` if the ball can't be in it."""
    if settings.method == "event" and p.fluid_torque:
        raise InputError(
            f"fluid_torque = {p.fluid_torque:g} s-1: the event-driven simulation leaves the torque "
            "out; time stepping takes it"
        )
    x = State.one(x0)
    check_place(x, p)
    if not settings.initial_impact:
        for place, gap, name, speed in (("floor", x.y, "v_y", x.v_y), ("wall", x.h, "v_h", x.v_h)):
            if gap == 0:
                without = "without an impact (initial_impact of Settings) it"
                meaning = f"to begin on the {place} {without}"
                check_number(name, speed, "m s-1", NOT_NEGATIVE, meaning)
    return x


def sample_times(t_end: float, interval: float | None) -> Array:
    """Multiples of the interval, and t_end."""
    t_end = check_number("t_end", t_end, "s", POSITIVE)
    if interval is None:
        return np.linspace(0.0, t_end, 1001)
    meaning = f"for at most {MOST_SAMPLES:g} samples it"
    interval = check_number("sample_interval", interval, "s", Range(t_end / MOST_SAMPLES), meaning)
    count = math.ceil(t_end / interval * (1 - 4 * float(np.finfo(float).eps)))
    return np.append(np.arange(count) * interval, t_end)
