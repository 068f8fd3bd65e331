"""Figs. 4 and 5: a ball carried by the wall is pushed into a slight slip, which dies out or grows."""

from __future__ import annotations

import math
from functools import partial

import numpy as np
from matplotlib.figure import Figure

from analytic.bifurcation.diagram import thresholds
from analytic.simulation import simulator
from compare.branches import check_thresholds
from compare.kit import style
from compare.kit.drawing import Drawing, Evidence, Motion
from compare.kit.engines import EVENT
from model import Case, Parameters, Trajectory

BETA = 0.9
"""Direction (54) of the push, rad: across the direction in which slip dies out or grows, so that the path bends."""
PUSHED = 1.0
"""Size of the push, rad s-1."""
FLOW_OF = {"fig-4": 1.38, "fig-5": 0.88}
"""Flows above and below omega_02, in units of it."""
SET = Parameters.named("high-wall-friction")
_LASTS = 0.17
"""Time that Fig. 5 shows, in units of sqrt(R/g)."""


def of_set(p: Parameters, figure: str) -> Motion:
    """The motion of the event-driven simulation, which starts in the formal stationary state of NR."""
    check_thresholds(p)
    p = p.replace(omega_0=FLOW_OF[figure] * thresholds(p).omega_02)
    lasts = _LASTS * math.sqrt(p.R / p.g) * (20 if figure == "fig-4" else 1)  # till slip has ended
    return Motion(f"{PUSHED}, {BETA}", EVENT.name, p, partial(_pushed, p, lasts))


def _pushed(p: Parameters, lasts: float) -> Trajectory:
    """The motion after a push out of NR; where slip ends soon, a short one with samples enough."""
    run = simulator.slip_perturbation(p, PUSHED, BETA, t_end=lasts)
    if len(run.events) and run.cases[-1] is Case.NR:
        return simulator.slip_perturbation(p, PUSHED, BETA, t_end=1.6 * float(run.events.time[-1]))
    return run


def select(_: Evidence, figure: str) -> Motion:
    """The motion of the set of the paper's kind, whatever was measured."""
    return of_set(SET, figure)


def draw(push: Motion) -> tuple[Figure, str]:
    """A figure of the slip at the wall over time, and of its path in the orthogonal plane (55); and its caption."""
    run = push.load()
    figure = style.figure(8.4, 3.3)
    time, plane = figure.subplots(1, 2)
    stops = len(run.events) > 0 and run.cases[-1] is Case.NR
    end = float(run.events.time[-1]) if stops else float(run.time[-1])
    shown = run.time <= (1.6 * end if stops else end)
    t = 1e3 * run.time[shown]
    for name, line in (("y", "--"), ("z", "-")):
        slip = getattr(run, f"slip_{name}")[shown]
        time.plot(t, slip, color=style.COLOURS[Case.NS], ls=line, label=f"$\\tilde\\omega_{name}$")
    if stops:
        time.axvline(1e3 * end, **style.GUIDE)
        for place, case in ((0.3, Case.NS), (1.3, Case.NR)):
            time.text(1e3 * place * end, 0.93, case.name, ha="center", transform=time.get_xaxis_transform())
    time.set(xlabel="$t$ (ms)", ylabel="slip at the wall (rad/s)")
    time.legend(frameon=False)
    w_y, w_z = run.slip_y[shown], run.slip_z[shown]
    plane.plot(w_z, w_y, color="black", lw=1.4)
    plane.plot([w_z[0], 0], [w_y[0], 0], **style.GUIDE)
    halfway = int(np.searchsorted(np.hypot(np.diff(w_z), np.diff(w_y)).cumsum(), 0.5 * PUSHED))
    tail, head = zip(w_z[halfway : halfway + 2], w_y[halfway : halfway + 2], strict=True)
    plane.annotate("", head, tail, arrowprops={"arrowstyle": "-|>", "color": "black", "mutation_scale": 14})
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
        f"The stationary orbit on the wall (NR), pushed by a slip of {PUSHED:g} rad/s in the direction β = {BETA:g}, "
        f"{dies if stops else grows}. Left: the slip over time. Right: its path in the plane orthogonal to NR, from "
        "the cross; dotted: the straight line. Event-driven simulation; "
        f"{style.named(push.p)}, Ω₀ = {push.p.Omega_0:.3g}."
    )


FIGURES = {
    name: Drawing(title, partial(select, figure=name), draw, ("slip-NR-NS",), partial(of_set, figure=name))
    for name, title in (("fig-4", "Fig. 4: a slip that dies out"), ("fig-5", "Fig. 5: a slip that grows"))
}
