"""The picture that README opens with: ``python -m docs.studies.opening`` draws docs/opening.png.

Above the ball and what it touches; below how fast it goes round, by theory, by MuJoCo under
Coulomb's law and by MuJoCo as it comes: settled runs from rest."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Arc, Circle, Rectangle

import analytic
from compare.campaign.tasks import Task, carry_out
from compare.figures import style
from model import Case, Parameters, State

PICTURE = Path(__file__).parents[1] / "opening.png"
FLOWS = (4.0, 8.0, 12.0, 16.0, 20.0, 24.0, 28.0)
"""Angular velocities of the fluid, rad/s."""
FASTEST = 30.0
ENGINES = {"mujoco": "MuJoCo under Coulomb's law", "mujoco-defaults": "MuJoCo as it comes"}
DURATION = 30.0
"""Of a run, s; its last quarter counts."""


def main() -> None:
    """Measure and draw."""
    readings = {engine: [reading(engine, flow) for flow in FLOWS] for engine in ENGINES}
    draw(readings).savefig(PICTURE, dpi=200)


def reading(engine: str, flow: float) -> float:
    """The mean angular velocity of a settled ball, rad/s."""
    p = Parameters.named("reference").replace(omega_0=flow)
    run = carry_out(Task(engine=engine, parameters=p, x0=State(), t_end=DURATION))
    return float(np.mean(run.omega_c[run.time > 0.75 * DURATION]))


def draw(readings: Mapping[str, Sequence[float]]) -> Figure:
    """The ball in its vessel over its characteristic curve, with letters to be read on a phone."""
    with rc_context({"font.size": 12.5}):
        figure, (above, below) = style.panels(5.4, 4.5, 2, height_ratios=[1, 1.75])
        _sketch(above)
        _curve(below, Parameters.named("reference"))
        for (engine, values), mark in zip(readings.items(), "ox", strict=True):
            look = {"color": "black", "mfc": "white", "ms": 8}
            below.plot(FLOWS, values, mark, label=ENGINES[engine], **look)
        below.legend(loc="lower right", frameon=False, borderaxespad=0.1, labelspacing=0.3)
        return figure


def _curve(axes: Axes, p: Parameters) -> None:
    """The exact theory: rolling up to a limit, slipping beyond it."""
    limit = float(analytic.thresholds(p).omega_01)
    flows = np.linspace(limit, FASTEST, 100)[1:]
    sets = (p.replace(omega_0=w) for w in flows)
    slipping = [analytic.solution(each, Case.SS).state.omega_c for each in sets]
    axes.plot([0, limit], [0, limit], color=style.COLOURS[Case.RR], lw=2.5, label="exact theory")
    axes.plot(flows, slipping, color=style.COLOURS[Case.SS], lw=2.5)
    for x, case, what in (
        (0.4, Case.RR, "RR: rolls on\nfloor and wall"),
        (11.0, Case.SS, "SS: slips on both, lags behind"),
    ):
        axes.text(x, 17.7, what, color=style.COLOURS[case], va="top")
    axes.set(xlim=(0, FASTEST), xlabel="how fast the fluid turns (rad/s)")
    axes.set(ylim=(0, 18), yticks=(0, 5, 10, 15), ylabel="how fast the ball\ngoes round (rad/s)")
    axes.grid(alpha=0.25)


def _sketch(axes: Axes) -> None:
    """Half of the vessel from the side: axis, floor, wall, and the ball that touches both."""
    for corner, width, height in (((-0.2, -0.15), 4.35, 0.15), ((4.0, 0), 0.15, 2)):
        axes.add_patch(Rectangle(corner, width, height, fc="0.8", ec="none"))
    axes.add_patch(Rectangle((-0.2, 0), 4.2, 1.8, fc="#E3F0F7", ec="none", zorder=0))
    axes.add_patch(Circle((3.3, 0.7), 0.7, fc="#F5CC6B", ec="black"))
    axes.plot([0, 0], [-0.1, 2.0], color="0.4", lw=1, ls="-.")
    axes.add_patch(Arc((0, 1.4), 0.8, 0.26, theta1=120, theta2=400, color="#0072B2", lw=1.5))
    head = {"arrowstyle": "->", "color": "#0072B2"}
    axes.annotate("", (0.33, 1.49), xytext=(0.38, 1.31), arrowprops=head)
    axes.text(0.55, 1.1, "the fluid swirls\nand carries\nthe ball round", va="center")
    axes.plot([3.3, 4.0], [0, 0.7], "o", color="black", ms=6, zorder=4)
    axes.text(3.25, 0.1, "floor", ha="center", va="bottom")
    axes.text(3.93, 0.72, "wall", ha="right", va="center")
    axes.set(xlim=(-0.5, 4.2), ylim=(-0.2, 2.05), aspect="equal")
    axes.axis("off")


if __name__ == "__main__":
    main()
