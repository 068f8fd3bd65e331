"""Transients of the paper that need a simulation: Figs. 4 and 5, and the hysteresis and unloading of section 5.3.

Each function draws stored trajectories; `analytic.scenarios` makes them.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import analytic
from compare.figures import style
from model import Case, Trajectory


def draw_slip_perturbation(*runs: Trajectory) -> Figure:
    """Figs. 4 and 5, a row a run: slip at the wall over time, and its path in the orthogonal plane (55)."""
    figure = style.figure(9, 3.4 * len(runs))
    for run, (time, plane) in zip(runs, figure.subplots(len(runs), 2, squeeze=False), strict=True):
        time.plot(run.time, run.slip_y, color=style.COLOURS[Case.NS], ls="--", label="$\\tilde\\omega_y$")
        time.plot(run.time, run.slip_z, color=style.COLOURS[Case.NR], label="$\\tilde\\omega_z$")
        time.set_xlabel("$t$ (s)")
        time.set_ylabel("slip (rad/s)")
        time.legend(frameon=False)
        plane.plot(run.slip_z, run.slip_y, color="black", lw=1.2)
        plane.plot(run.slip_z[0], run.slip_y[0], "kx")
        plane.plot(0, 0, **style.POINT)
        plane.set_xlabel("$\\tilde\\omega_z$ (rad/s)")
        plane.set_ylabel("$\\tilde\\omega_y$ (rad/s)")
        returned = len(run.events) and run.cases[-1] is Case.NR
        if returned:
            time.set_xlim(0, 3 * float(run.events.time[-1]))
            time.locator_params(axis="x", nbins=5)
        for axes in (time, plane):
            axes.axhline(0, **style.GUIDE)
        told = "the ball rolls again" if returned else "the ball slips on"
        time.set_title(f"$\\omega_0$ = {run.header.flow(0.0):.4g} rad/s: {told}", fontsize=10, loc="left")
    return figure


def draw_hysteresis(run: Trajectory) -> Figure:
    """omega_c at the end of each held level, on the way up and on the way down, and the thresholds."""
    figure = style.figure(6.5, 4.2)
    axes = figure.subplots()
    flow, p = run.header.flow, run.header.parameters
    ends = np.searchsorted(run.time, np.append(flow.start[1:], run.time[-1]), side="right") - 1
    levels, measured = flow.value[: len(ends)], run.omega_c[ends]
    top = int(np.argmax(levels))
    for part, marker, label in ((slice(0, top + 1), "^", "raising"), (slice(top, None), "v", "lowering")):
        axes.plot(levels[part], measured[part], color="0.6", lw=0.8, zorder=1)
        for case in (Case.RR, Case.SS, Case.SR, Case.NR, Case.NS):
            here = run.case[ends[part]] == case
            axes.plot(
                levels[part][here], measured[part][here], ls="none", marker=marker, ms=6, color=style.COLOURS[case],
                label=f"{label}, {case.name}" if here.any() else None,
            )  # fmt: skip
    _thresholds(axes, run)
    axes.set_xlabel(style.OMEGA_0)
    axes.set_ylabel(style.OMEGA_C)
    axes.legend(fontsize=8, frameon=False)
    style.dimensionless_y(axes, p, "$\\omega_c\\sqrt{R/g}$")
    return figure


def draw_unloading(run: Trajectory, before: float = 0.3, after: float = 1.7) -> Figure:
    """The seconds around the moment at which the ball leaves NR: height, velocities and cases."""
    left = float(run.events.time[run.events.from_case == Case.NR][0])
    part = (run.time > left - before) & (run.time < left + after)
    time = run.time[part] - left
    figure = style.figure(7, 6)
    height, speed, slip = figure.subplots(3, 1, sharex=True)
    height.plot(time, 1e3 * run.y[part], color="black")
    height.set_ylabel("$y$ (mm)")
    speed.plot(time, run.omega_c[part], color="black", label="$\\omega_c$")
    speed.plot(time, run.header.flow(run.time[part]), **style.GUIDE, label="$\\omega_0$")
    speed.set_ylabel("(rad/s)")
    speed.legend(frameon=False)
    for point, gap, value, case in (
        ("A", run.gap_A, run.slip_speed_A, Case.SR), ("B", run.gap_B, run.slip_speed_B, Case.NS)
    ):  # fmt: skip
        slip.plot(time, np.where(gap == 0, value, np.nan)[part], color=style.COLOURS[case], label=point)
    slip.set_ylabel("slip speed (m/s)")
    slip.set_xlabel("$t$ after the end of NR (s)")
    slip.legend(frameon=False)
    for axes in (height, speed, slip):
        _cases(axes, run, left, float(time[0]), float(time[-1]))
    return figure


def _cases(axes: Axes, run: Trajectory, origin: float, start: float, end: float) -> None:
    """Shade each stretch of time in the colour of its case."""
    changes = np.flatnonzero(np.diff(run.case)) + 1
    edges = np.concatenate([[0], changes, [len(run.time) - 1]])
    for first, last in pairwise(edges.tolist()):
        low, high = max(run.time[first] - origin, start), min(run.time[last] - origin, end)
        if low < high:
            axes.axvspan(low, high, color=style.COLOURS[Case(run.case[first])], alpha=0.12, lw=0)
            if axes.get_subplotspec().is_first_row():  # type: ignore[union-attr]
                axes.text((low + high) / 2, 1.02, Case(run.case[first]).name, transform=axes.get_xaxis_transform(),
                          ha="center", fontsize=8)  # fmt: skip


def _thresholds(axes: Axes, run: Trajectory) -> None:
    p = run.header.parameters
    limits = analytic.thresholds(p)
    for name, label in style.THRESHOLD_LABELS.items():
        value = getattr(limits, name)
        # omega_03 ends rolling for eta > j only.
        if np.isfinite(value) and value <= run.header.flow.value.max() and not (name == "omega_03" and p.eta < p.j):
            axes.axvline(value, **style.GUIDE)
            axes.annotate(
                label, (value, 0), xycoords=("data", "axes fraction"), xytext=(2, 3), textcoords="offset points",
                fontsize=9,
            )  # fmt: skip
