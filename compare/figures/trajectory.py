"""One run over time: orbit, slip, gaps and forces, on the case."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from compare.figures import style
from model import Trajectory


def draw(trajectory: Trajectory) -> Figure:
    """omega_c, slip, gaps and forces over time; grounds in the colour of the case, named above."""
    t, p = trajectory.time, trajectory.header.parameters
    friction_A, friction_B = np.hypot(*trajectory.force_A[:, [0, 2]].T), np.hypot(*trajectory.force_B[:, [1, 2]].T)
    blue, green, orange, pink = "#0072B2", "#009E73", "#E69F00", "#CC79A7"
    curves = {
        "orbit (rad/s)": (("ω₀", trajectory.header.flow(t), "0.6", "--"), ("ω_c", trajectory.omega_c, blue, "-")),
        "slip (rad/s)": (
            ("ω̃ₓ", trajectory.slip_x, "#D55E00", "-"),
            ("ω̃ᵧ", trajectory.slip_y, green, "-"),
            ("ω̃_z", trajectory.slip_z, pink, "-"),
        ),
        "gap (mm)": (("y (floor)", 1e3 * trajectory.y, blue, "-"), ("h (wall)", 1e3 * trajectory.h, orange, "--")),
        "force (N)": (
            ("A_y", trajectory.force_A[:, 1], blue, "-"),
            ("friction at A", friction_A, blue, ":"),
            ("B_x", trajectory.force_B[:, 0], orange, "-"),
            ("friction at B", friction_B, orange, ":"),
        ),
    }
    figure = style.figure(9, 8.6)
    panels = figure.subplots(4, sharex=True, height_ratios=[3, 3, 2, 3])
    for axes, (label, lines) in zip(panels, curves.items(), strict=True):
        for name, values, colour, line in lines:
            axes.plot(t, values, color=colour, ls=line, label=name)
        style.ground(axes, trajectory, (t[0], t[-1]), named=axes is panels[0])
        axes.set(ylabel=label, xlim=t[[0, -1]])
        axes.grid(alpha=0.3)
        style.legend(axes, ncols=4)
    panels[-1].set_xlabel("time (s)")
    set_ = f"μ = {p.mu:g}, η = {p.eta:g}, j = {p.j:g}, c = {p.c:g} 1/s"
    figure.suptitle(f"{trajectory.header.engine}: {set_}", fontsize=11)
    return figure
