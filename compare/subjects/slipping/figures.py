"""Figs. 4 and 5: a ball on the wall is pushed into a slight slip, which dies out or grows."""

import math
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from analytic.bifurcation.diagram import thresholds
from analytic.simulation import simulator
from compare.figures import style
from compare.figures.branches import check_thresholds
from compare.figures.drawing import Diagram, diagram
from model import Case

BETA = 0.9  # direction (54) of the push, rad: across that of decay, so that the path bends
PUSHED = 1.0  # size of the push, rad s-1
MOTIONS = {"fig-4": (1.38, 3.4), "fig-5": (0.88, 0.17)}
"""Flows in units of omega_02, and times in units of sqrt(R/g): in Fig. 4 slip ends."""


def draw(of: Diagram) -> tuple[Figure, str]:
    """A figure of the slip at the wall over time, and of its path (55); and its caption.

    The motion is that of the event-driven simulation from the formal stationary state of NR."""
    check_thresholds(of.p)
    flow, lasts = MOTIONS[of.figure]
    p = of.p.replace(omega_0=flow * thresholds(of.p).omega_02)
    run = simulator.slip_perturbation(p, PUSHED, BETA, t_end=lasts * math.sqrt(p.R / p.g))
    if stops := len(run.events) > 0 and run.cases[-1] is Case.NR:  # a short one has samples enough
        run = simulator.slip_perturbation(p, PUSHED, BETA, t_end=1.6 * float(run.events.time[-1]))
    figure, (time, plane) = style.panels(8.4, 3.3, 1, 2)
    end = float(run.events.time[-1]) if stops else float(run.time[-1])
    t = 1e3 * run.time
    for name, line in (("y", "--"), ("z", "-")):
        slip = getattr(run, f"slip_{name}")
        time.plot(t, slip, color=style.COLOURS[Case.NS], ls=line, label=f"$\\tilde\\omega_{name}$")
    if stops:
        time.axvline(1e3 * end, **style.GUIDE)
        above: dict[str, Any] = {"ha": "center", "transform": time.get_xaxis_transform()}
        for place, case in ((0.3, Case.NS), (1.3, Case.NR)):
            time.text(1e3 * place * end, 0.93, case.name, **above)
    time.set(xlabel="$t$ (ms)", ylabel="slip at the wall (rad/s)")
    time.legend(frameon=False)
    w_y, w_z = run.slip_y, run.slip_z
    plane.plot(w_z, w_y, color="black", lw=1.4)
    plane.plot([w_z[0], 0], [w_y[0], 0], **style.GUIDE)
    halfway = int(np.searchsorted(np.hypot(np.diff(w_z), np.diff(w_y)).cumsum(), 0.5 * PUSHED))
    tail, head = zip(w_z[halfway : halfway + 2], w_y[halfway : halfway + 2], strict=True)
    arrow = {"arrowstyle": "-|>", "color": "black", "mutation_scale": 14}
    plane.annotate("", head, tail, arrowprops=arrow)
    plane.plot(w_z[0], w_y[0], "kx", ms=7, mew=1.8)
    style.mark(plane, 0.0, 0.0, "NR", (6, -6))
    plane.set(xlabel="$\\tilde\\omega_z$ (rad/s)", ylabel="$\\tilde\\omega_y$ (rad/s)")
    plane.margins(0.12)
    for axes in (time, plane):
        axes.axhline(0, **style.GUIDE)
    plane.axvline(0, **style.GUIDE)
    dies = "above ω₀₂: the slip dies out within finite time, and the ball rolls on the wall again"
    grows = "below ω₀₂: the slip grows, and the ball keeps slipping (NS)"
    return figure, (
        f"The stationary orbit on the wall (NR), pushed by a slip of {PUSHED:g} rad/s in the "
        f"direction β = {BETA:g}, {dies if stops else grows}. Left: the slip over time. Right: its "
        "path in the plane orthogonal to NR, from the cross; dotted: the straight line. "
        f"Event-driven simulation; {style.named(p)}, Ω₀ = {p.Omega_0:.3g}."
    )


FIGURES = {
    name: diagram(name, title, "high-wall-friction", draw, ("slip-NR-NS",))
    for name, title in (
        ("fig-4", "Fig. 4: a slip that dies out"),
        ("fig-5", "Fig. 5: a slip that grows"),
    )
}
