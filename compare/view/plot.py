"""One run over time: orbit, slip, gaps and forces, on the case."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from compare.kit import style
from model import Trajectory


def draw(run: Trajectory) -> Figure:
    """omega_c, slip, gaps and forces over time; backgrounds in the colour of the case, named above."""
    t, p = run.time, run.header.parameters
    blue, green, orange, red, pink = "#0072B2", "#009E73", "#E69F00", "#D55E00", "#CC79A7"
    scale, unit = (1e3, "mm") if max(np.abs(run.y).max(), np.abs(run.h).max()) > 1e-5 else (1e6, "µm")
    friction_A, friction_B = np.hypot(*run.force_A[:, [0, 2]].T), np.hypot(*run.force_B[:, [1, 2]].T)
    slips = zip("xyz", (red, green, pink), ("-", "--", ":"), strict=True)
    curves = {
        "angular velocity (rad/s)": (
            ("fluid, $ω_0$", run.header.flow(t), "0.6", "--"),
            ("orbit, $ω_c$", run.omega_c, blue, "-"),
        ),
        "slip (rad/s)": tuple((style.symbol(f"slip_{k}"), getattr(run, f"slip_{k}"), *look) for k, *look in slips),
        f"gap ({unit})": (("floor, $y$", scale * run.y, blue, "-"), ("wall, $h$", scale * run.h, orange, "--")),
        "force (N)": (
            (style.symbol("force_Ay"), run.force_A[:, 1], blue, "-"),
            ("friction at A", friction_A, blue, ":"),
            (style.symbol("force_Bx"), run.force_B[:, 0], orange, "-"),
            ("friction at B", friction_B, orange, ":"),
        ),
    }
    figure, panels = style.panels(9, 8.6, 4, sharex=True, height_ratios=[3, 3, 2, 3])
    for axes, (label, lines) in zip(panels, curves.items(), strict=True):
        for name, values, colour, line in lines:
            axes.plot(t, values, color=colour, ls=line, label=name)
        style.ground(axes, run, (t[0], t[-1]), named=axes is panels[0])
        axes.set(ylabel=label, xlim=t[[0, -1]])
        axes.grid(alpha=0.3)
        style.legend(axes, ncols=4)
    panels[-1].set_xlabel("time (s)")
    figure.suptitle(f"{run.header.engine}: {style.named(p)}", fontsize=11)
    return figure
