"""Section 5.3, eta > j: a ball on the wall as the flow falls below omega_02 slips, sinks, lands, and rolls again."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from analytic import scenarios
from compare.figures import style
from compare.figures.drawing import GapError, Material, Motion
from model import Case, Contact, Parameters, Trajectory
from model.arrays import Array

SET = "high-wall-friction"
_P = Parameters.named(SET)
_BEFORE, _AFTER = 0.3, 1.7
"""Time shown before and after the ball leaves NR, s."""
_CLOSE = 0.02
"""Time shown round the landing, s."""
_LOW = 1e-7
"""Least height of the frame of the magnified gaps, m."""
_SAMPLES = 1500
"""Samples drawn of a curve."""
_HOLD = 5.0
"""How long the simulation of theory holds each flow, s: shorter ones are sampled more densely."""


@dataclass(frozen=True)
class Fall:
    """The motion of one engine."""

    engine: str
    p: Parameters
    motion: Motion


def select(material: Material) -> Fall:
    """A measured fall, if its run file is there, else that of the event-driven simulation."""
    for m in material.records.select(
        "unloading", where=lambda m: m.set == SET and m.conditions["start"] == "unloading"
    ):
        for motion in material.motions(m)[-1:]:  # with the finest step
            return Fall(m.engine, m.parameters, motion)
    return Fall("event", _P, Motion(repr(_P), lambda: scenarios.unloading(_P, _HOLD)))


def caption(fall: Fall) -> str:
    """Of the fall."""
    return (
        "The fall of a ball that the wall carries, once ω₀ has fallen below ω₀₂: it slips at the wall (NS), sinks, "
        "hits the floor, slips at both points (SS), at the floor (SR), and rolls (RR). Right: the impact, magnified in "
        "time and height: it stops the sinking at once; after it the gaps show how far the ball hops, if it does. "
        f"Grounds: the case, by name above. {style.named(fall.p)}; engine: {fall.engine}."
    )


def draw(fall: Fall) -> Figure:
    """Height, velocities and slip around the fall, and the landing magnified."""
    run = fall.motion.load()
    left, lands = _fall(run)
    figure = style.figure(9, 6)
    panels = figure.subplots(3, 2, sharex="col", width_ratios=[1.7, 1])
    _whole(panels[:, 0], _Part(run, left - _BEFORE, left + _AFTER, left, 1.0))
    _landing(panels[:, 1], _Part(run, lands - _CLOSE, lands + _CLOSE, lands, 1e3))
    for row in panels:
        row[0].axvline(lands - left, color="0.3", lw=0.8)
        row[1].axvline(0, color="0.3", lw=0.8)
    return figure


def _fall(run: Trajectory) -> tuple[float, float]:
    """Times at which the ball leaves NR for the last time before it lands, and at which it lands, s."""
    changes = [(float(t), Case(case)) for t, case in zip(run.events.time, run.events.to_case, strict=True)]
    lands = next((t for t, case in changes if case.A is not Contact.N), None)
    if lands is None:
        raise GapError("the ball never landed")
    leaves = run.events.time[(run.events.from_case == Case.NR) & (run.events.time <= lands)]
    return float(leaves[-1] if len(leaves) else run.time[0]), lands


@dataclass(frozen=True, eq=False)
class _Part:
    """A stretch of a run, and how its time is counted."""

    run: Trajectory
    begin: float
    end: float
    origin: float
    unit: float
    """Units of the axis of time in a second."""

    def at(self, time: npt.ArrayLike) -> Array:
        """Places of times in s on the axis."""
        return self.unit * (np.asarray(time, dtype=float) - self.origin)

    @property
    def samples(self) -> npt.NDArray[np.intp]:
        """At most `_SAMPLES` of the samples, evenly chosen."""
        chosen = np.flatnonzero((self.run.time > self.begin) & (self.run.time < self.end))
        return chosen[:: max(1, len(chosen) // _SAMPLES)]


def _whole(column: Sequence[Axes], part: _Part) -> None:
    """Gaps, angular velocities and slip from before the fall to rolling."""
    height, speed, slip = column
    run, k = part.run, part.samples
    time = part.at(run.time[k])
    height.plot(time, 1e3 * run.y[k], color="black", label="$y$ (floor)")
    height.plot(time, 1e3 * run.h[k], color="#B3261E", ls="--", label="$h$ (wall)")
    height.set_ylabel("gap (mm)")
    speed.plot(time, run.omega_c[k], color="black", label="$\\omega_c$")
    speed.plot(time, run.header.flow(run.time[k]), color="0.5", ls="--", label="$\\omega_0$")
    speed.set_ylabel("$\\omega_c$, $\\omega_0$ (rad/s)")
    _slip(slip, part)
    slip.set_xlabel("$t$ after the end of NR (s)")
    for axes in column:
        axes.legend(frameon=False, fontsize=8.5)
        _cases(axes, part, named=axes is height)


def _landing(column: Sequence[Axes], part: _Part) -> None:
    """Gaps, vertical velocity and slip about the impact; the gaps as high as the ball hops after it."""
    height, speed, slip = column
    run, k = part.run, part.samples
    time = part.at(run.time[k])
    hops = run.y[k][run.v_y[k] > 0].max(initial=0.0)
    highest = 1e6 * max(float(run.h[k].max()), float(hops), _LOW)
    height.plot(time, 1e6 * run.y[k], color="black")
    height.plot(time, 1e6 * run.h[k], color="#B3261E", ls="--")
    height.set(ylim=(-0.4 * highest, 1.4 * highest), ylabel="gap (µm)")
    speed.plot(time, run.v_y[k], color="black")
    speed.set_ylabel("$v_y$ (m/s)")
    _slip(slip, part)
    slip.set_xlabel("$t$ after the landing (ms)")
    for axes in column:
        _cases(axes, part, named=axes is height)


def _slip(axes: Axes, part: _Part) -> None:
    """Slip speeds where there is contact."""
    run, k = part.run, part.samples
    for point, value, line in (("A", run.slip_speed_A, "-"), ("B", run.slip_speed_B, "--")):
        touches = [case for case in Case if getattr(case, point) is not Contact.N]
        shown = np.where(np.isin(run.case[k], touches), value[k], np.nan)
        axes.plot(part.at(run.time[k]), shown, color="black", ls=line, label=f"$|v_{point}|$")
    axes.set_ylabel("slip speed (m/s)")
    axes.set_xlim(*part.at([part.begin, part.end]).tolist())


def _cases(axes: Axes, part: _Part, named: bool) -> None:
    """Shade each stretch of time in the colour of its case."""
    run = part.run
    edges = [0, *(np.flatnonzero(np.diff(run.case)) + 1).tolist(), len(run.time) - 1]
    for first, last in pairwise(edges):
        low, high = max(run.time[first], part.begin), min(run.time[last], part.end)
        if low < high:
            case, ends = Case(run.case[first]), part.at([low, high])
            axes.axvspan(*ends, color=style.COLOURS[case], alpha=0.15, lw=0)
            if named and high - low > 0.04 * (part.end - part.begin):
                place = axes.get_xaxis_transform()
                axes.text(ends.mean(), 1.02, case.name, transform=place, ha="center", fontsize=8)
