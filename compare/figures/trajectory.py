"""One run over time: orbit, slip, gaps, forces and the case."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from compare.figures import style
from model import Trajectory


def draw(trajectory: Trajectory) -> Figure:
    """omega_c, slip, gaps and forces over time, with the case as a band."""
    t, p = trajectory.time, trajectory.header.parameters
    figure = style.figure(9, 9)
    orbit, slip, gap, force, band = figure.subplots(5, sharex=True, height_ratios=[3, 3, 2, 3, 0.6])
    orbit.plot(t, trajectory.header.flow(t), color="0.6", ls="--", label="ω₀")
    orbit.plot(t, trajectory.omega_c, color="#0072B2", label="ω_c")
    orbit.set_ylabel("orbit (rad/s)")
    colours = {"ω̃ₓ": "#D55E00", "ω̃ᵧ": "#009E73", "ω̃_z": "#CC79A7"}
    for values, (symbol, colour) in zip(trajectory.x[:, 3:6].T, colours.items(), strict=True):
        slip.plot(t, values, label=symbol, color=colour)
    slip.set_ylabel("slip (rad/s)")
    gap.plot(t, 1e3 * trajectory.y, color="#0072B2", label="y (floor)")
    gap.plot(t, 1e3 * trajectory.h, color="#E69F00", ls="--", label="h (wall)")
    gap.set_ylabel("gap (mm)")
    force.plot(t, trajectory.force_A[:, 1], color="#0072B2", label="A_y")
    force.plot(t, np.hypot(*trajectory.force_A[:, [0, 2]].T), color="#0072B2", ls=":", label="friction at A")
    force.plot(t, trajectory.force_B[:, 0], color="#E69F00", label="B_x")
    force.plot(t, np.hypot(*trajectory.force_B[:, [1, 2]].T), color="#E69F00", ls=":", label="friction at B")
    force.set_ylabel("force (N)")
    for case, start, end in trajectory.phases():
        band.axvspan(start, end, color=style.COLOURS[case], lw=0)
        if t[-1] > 0 and end - start > 0.04 * t[-1]:
            band.text((start + end) / 2, 0.5, case.name, ha="center", va="center", fontsize=8, color="white")
    band.set_yticks([])
    band.set_ylabel("case", rotation=0, ha="right", va="center")
    band.set_xlabel("time (s)")
    for axes in (orbit, slip, gap, force):
        axes.legend(fontsize=8, ncols=4, frameon=False)
        axes.grid(alpha=0.3)
    set_ = f"μ = {p.mu:g}, η = {p.eta:g}, j = {p.j:g}, c = {p.c:g} 1/s"
    figure.suptitle(f"{trajectory.header.engine}: {set_}", fontsize=11)
    return figure
