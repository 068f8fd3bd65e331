"""Whole motions from given starts to their ends: flight, a contact that opens, slip on smooth walls
and rough floors.

Each start is carried out with two time steps; what the step changes is the uncertainty of the finer
run.

* *Thrown*: the ball flies past the axis of the vessel without touching anything, long enough for
  drag to show; by the quadratic law with another drag coefficient, too.
* *Pulled off*: beside the wall, with a slip on the floor that drives it away from there; its wall
  contact carries nothing, or almost nothing, and opens.
* *Slips*, *rolls*, *sinks*: at one contact, at both, or off the wall, for a while, through whatever
  cases follow.
* *Rolls while the flow rises, falls*: at both points, in a flow that is steady at first.
* *Smooth wall*: the ball goes round with the fluid, rolls on the floor and spins against a wall
  without friction, in faster and faster flows. Does the floor hold it?
* *Rough floor*, mu > 1: the ball rolls at both points but for a slight slip, in faster and faster
  flows. It may jam between floor and wall, or the slip may last.

`torque` is apart: a ball whose spin a real fluid brakes settles.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping

import numpy as np

from compare.kit.record import Condition, Measurement, Missing, Records, state_of
from compare.kit.runner import Runner, coarse_step
from compare.kit.scales import time_unit
from compare.kit.settling import PRESSES, settled_readings
from compare.kit.statistics import estimate, uniform
from compare.kit.step_pairs import Start, StepPair, carry_out, lag_error
from model import Flow, Parameters, State
from model.drag import QUADRATIC
from model.kinematics import VARIABLES, state_units

STARTS: dict[str, tuple[float, float, tuple[float, ...]]] = {
    "thrown": (0.4, 3.0, (60.0, 1.0, 0.5, 0.6, -0.8, 0.4, 0.6, 0.1)),
    "thrown up": (1.2, 2.0, (60.0, 5.0, -0.6, 0.3, 0.5, -0.9, 0.5, -0.05)),
    "pulled off, at rest": (0.3, 0.4, (0.0, 0.0, 0.0, 0.0, 0.0, -1.5, 0.0, 0.0)),
    "pulled off, going round": (0.3, 0.4, (0.0, 0.0, 0.15, 0.2, 0.3, -1.5, 0.0, 0.0)),
    "slips at the floor": (1.2, 0.5, (0.0, 0.0, 1.3, -0.9, 0.0, 0.0, 0.0, 0.0)),
    "slips at the wall": (0.6, 0.5, (0.0, 0.0, 0.4, 0.0, 1.5, 0.0, 0.0, 0.0)),
    "slips at both": (1.5, 0.5, (0.0, 0.0, 1.2, 0.8, 0.6, 1.0, 0.0, 0.0)),
    "slips off the wall": (0.8, 0.5, (0.0, 0.0, 0.4, 1.2, 0.3, 0.7, 0.5, -0.1)),
    "rolls off the wall": (1.5, 1.0, (0.0, 0.0, 0.3, 0.0, 0.2, 0.2, 0.5, -0.2)),
    "sinks along the wall": (1.0, 1.0, (5.0, -0.3, 0.7, 0.5, 0.6, 0.8, 0.0, 0.0)),
}
"""omega_0, how long, and the state, each in units of R, sqrt(R/g), and for slip sqrt(g R)/r."""


def late_ramp(p: Parameters, rate: float, time: float) -> Flow:
    """A flow that is steady for half of a time in s, and then changes at a rate in rad/s^2."""
    return Flow.ramp(p.omega_0, p.omega_0 + rate * time / 2, time / 2, time / 2)


def torque(
    runner: Runner, sets: Mapping[str, Parameters], records: Records
) -> Iterator[Measurement | Missing]:
    """Case and omega_c to which a ball settles from rest whose spin the fluid brakes, as
    `Parameters.fluid_torque`."""
    starts = []
    for name, p in sets.items():
        q = p.replace(mu=1.0, eta=1.0, fluid_torque=0.5 * p.c, omega_0=0.6 / time_unit(p))
        starts.append(Start(name, q, "rest", np.zeros(8)))
    yield from settled_readings(runner, "torque", starts)


def measure(
    runner: Runner, sets: Mapping[str, Parameters], records: Records
) -> Iterator[Measurement | Missing]:
    """Where each start ends: its state, or on a smooth wall and a rough floor its case and
    orbit."""
    for run in carry_out(
        runner, "runs", [pair for name, p in sets.items() for pair in _pairs(name, p)]
    ):
        if isinstance(run, Missing):
            yield run
            continue
        p, how, coarse, fine = run.pair.p, run.pair.name, run.coarse, run.fine
        time = float(fine.time[-1])
        if coarse.case[-1] != fine.case[-1]:
            yield Missing(
                "runs",
                run.pair.set,
                f"{how}: with half the time step the ball ends in another case",
                run.pair.rows,
            )
        elif how == "rough floor" and fine.force_A[:, 1].mean() < PRESSES * p.m * p.g:
            yield Missing(
                "runs",
                run.pair.set,
                f"{how}: the contact force is so small that the ball may hover",
                run.pair.rows,
            )
        else:
            if apart := how in ("smooth wall", "rough floor"):
                yield run.row(runner, "case", float(fine.case[-1]), time=time)
            # The change of one variable may vanish by chance: the largest, in natural units, is
            # used for all.
            units, ends = state_units(p), (coarse.x[-1], fine.x[-1])
            change = float(np.abs((ends[1] - ends[0]) / units).max())
            if apart:  # where it may vanish in all, but for what forces do that lag behind
                change = max(change, lag_error(p))
            for variable, value, size in zip(
                VARIABLES, ends[1].tolist(), units.tolist(), strict=True
            ):
                if variable == "omega_c" or not apart:
                    row = estimate(value, size, time_step=uniform(change))
                    yield run.row(runner, f"end_{variable}", row, time=time)


def _pairs(name: str, p: Parameters) -> Iterator[StepPair]:
    """Step pairs of a set from all starts."""
    unit = time_unit(p)

    def pair(
        how: str, p: Parameters, x: State, lasts: float, rows: int = 1, rate: float | None = None
    ) -> StepPair:
        count = round(lasts * unit / coarse_step(p))
        t_end, at = count * coarse_step(p), dict[str, Condition](start=how, **state_of(x.stacked()))
        flow = None
        if rate is not None:
            flow, at = late_ramp(p, rate, t_end), at | {"rate": rate}
        return StepPair(
            name, p, how, x.stacked(), t_end, (8, 16), count, flow=flow, conditions=at, rows=rows
        )

    for how, (flow, lasts, x) in STARTS.items():
        start, q = State(*(np.array(x) * state_units(p))), p.replace(omega_0=flow / unit)
        yield pair(how, q, start, lasts, rows=len(VARIABLES))
        if how == "thrown" and p.drag == QUADRATIC:
            blunter = q.replace(C_D=1.1)  # that of a disk
            yield pair("thrown, blunter", blunter, start, lasts, rows=len(VARIABLES))
    for how, rate in ("rolls while the flow rises", 0.2), ("rolls while the flow falls", -0.2):
        q = p.replace(omega_0=0.5 / unit)
        yield pair(how, q, State(omega_c=q.omega_0), 2.0, len(VARIABLES), rate / unit**2)
    for flow in (0.5, 0.7, 0.9, 1.1, 1.3):
        going = State(omega_c=flow / unit, slip_y=math.sqrt(p.g * p.R) / p.r)
        yield pair("smooth wall", p.replace(omega_0=flow / unit, eta=0.0), going, 1.0, rows=2)
    for flow in (1.5, 1.7, 1.8, 2.0, 2.2):
        spin = flow / unit * p.R / p.r
        slight = State(omega_c=flow / unit, slip_x=-5e-4 * spin, slip_z=5e-3 * spin)
        yield pair("rough floor", p.replace(omega_0=flow / unit, mu=1.7), slight, 1.0, rows=2)
