"""Section 5.3, eta > j: a ball on the wall as the flow falls below omega_02 slips, sinks, lands, and rolls again."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from analytic.simulation import simulator
from compare.kit import style
from compare.kit.drawing import GapError, Material, Motion
from compare.kit.engines import EVENT
from model import Case, Contact, Parameters, Trajectory
from model.arrays import Array

SET = "high-wall-friction"
_P = Parameters.named(SET)


def select(material: Material) -> Motion:
    """A measured fall, if its run file is there, else that of the event-driven simulation."""
    for m in material.records.select("unloading", where=lambda m: m.set == SET):
        if m.conditions["start"] == "unloading" and (motions := material.motions(m)):
            return motions[-1]  # with the finest step
    # Flows held for no longer than 5 s each: longer ones are sampled less densely.
    return Motion("held", EVENT.name, _P, partial(simulator.unloading, _P, 5.0))


def caption(fall: Motion) -> str:
    """Of the fall."""
    return style.caption(
        fall.p,
        "The fall of a ball that the wall carries, once ω₀ has fallen below ω₀₂: it slips at the wall (NS), sinks, "
        "hits the floor, slips at both points (SS), at the floor (SR), and rolls (RR). Right: the impact, magnified in "
        "time and height: it stops the sinking at once; after it the gaps show how far the ball hops, if it does. "
        f"Background: the case, by name above; engine: {fall.engine}.",
    )


def draw(fall: Motion) -> Figure:
    """Height, velocities and slip around the fall, and 20 ms about the landing: the gaps as high as the ball hops."""
    run = fall.load()
    lands = next(
        (t for t, to in zip(run.events.time, run.events.to_case, strict=True) if Case(to).A is not Contact.N), None
    )
    if lands is None:
        raise GapError("the ball never landed")
    leaves = run.events.time[(run.events.from_case == Case.NR) & (run.events.time <= lands)]
    left = leaves[-1] if len(leaves) else run.time[0]
    figure, panels = style.panels(9, 6, 3, 2, sharex="col", width_ratios=[1.7, 1])
    whole, close = panels.T
    k, t = _column(whole, run, (left - 0.3, left + 1.7), left, 1.0, 1e3)
    whole[0].set_ylabel("gap (mm)")
    whole[1].plot(t, run.omega_c[k], color="black", label="$\\omega_c$")
    whole[1].plot(t, run.header.flow(run.time[k]), color="0.5", ls="--", label="$\\omega_0$")
    whole[1].set_ylabel("$\\omega_c$, $\\omega_0$ (rad/s)")
    whole[2].set_xlabel("$t$ after the end of NR (s)")
    for axes in whole:
        axes.axvline(lands - left, color="0.3", lw=0.8)
        style.legend(axes, frameon=False)
    k, t = _column(close, run, (lands - 0.02, lands + 0.02), lands, 1e3, 1e6)
    hops = run.y[k][run.v_y[k] > 0].max(initial=0.0)
    highest = 1e6 * max(float(run.h[k].max()), float(hops), 1e-7)
    close[0].set(ylim=(-0.4 * highest, 1.4 * highest), ylabel="gap (µm)")
    close[1].plot(t, run.v_y[k], color="black")
    close[1].set_ylabel("$v_y$ (m/s)")
    close[2].set_xlabel("$t$ after the landing (ms)")
    for axes in close:
        axes.axvline(0, color="0.3", lw=0.8)
    return figure


def _column(
    panels: Sequence[Axes], run: Trajectory, span: tuple[float, float], origin: float, unit: float, size: float
) -> tuple[npt.NDArray[np.intp], Array]:
    """Draw gaps, `size` to a metre, slip speeds where there is contact, and the cases, over a span of time in s.

    Return which samples are drawn, some 1500 evenly chosen, and their times in units of the axis, `unit` to a second.
    """
    k = np.flatnonzero((run.time > span[0]) & (run.time < span[1]))
    k = k[:: max(1, len(k) // 1500)]
    t = unit * (run.time[k] - origin)
    gaps, _, slip = panels
    gaps.plot(t, size * run.y[k], color="black", label="$y$ (floor)")
    gaps.plot(t, size * run.h[k], color="#B3261E", ls="--", label="$h$ (wall)")
    for point, value, line in (("A", run.slip_speed_A, "-"), ("B", run.slip_speed_B, "--")):
        touches = [case for case in Case if getattr(case, point) is not Contact.N]
        shown = np.where(np.isin(run.case[k], touches), value[k], np.nan)
        slip.plot(t, shown, color="black", ls=line, label=f"$|v_{point}|$")
    slip.set(ylabel="slip speed (m/s)", xlim=(unit * (span[0] - origin), unit * (span[1] - origin)))
    for axes in panels:
        style.ground(axes, run, span, unit, origin, named=axes is gaps)
    return k, t
