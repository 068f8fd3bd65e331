"""The picture that README opens with: ``python -m docs.studies.opening`` draws docs/opening.png.

Left the ball and what it touches; right how fast it goes round, by theory, by MuJoCo under
Coulomb's law and by MuJoCo as it comes: settled runs from rest, made by the command line."""

from __future__ import annotations

import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Arc, Circle, Rectangle

import analytic
from compare.kit import style
from model import Case, Parameters, storage

PICTURE = Path(__file__).parents[1] / "opening.png"
FLOWS = (4.0, 8.0, 12.0, 16.0, 20.0, 24.0, 28.0)
"""Angular velocities of the fluid, rad/s."""
FASTEST = 30.0
ENGINES = {"mujoco": "MuJoCo under Coulomb's law", "mujoco-defaults": "MuJoCo as it comes"}
DURATION = 30.0
"""Of a run, s; its last quarter counts."""


def main() -> None:
    """Measure and draw."""
    draw({engine: [reading(engine, flow) for flow in FLOWS] for engine in ENGINES}).savefig(
        PICTURE, dpi=110
    )


def reading(engine: str, flow: float) -> float:
    """The mean angular velocity of a settled ball, rad/s."""
    with tempfile.TemporaryDirectory() as place:
        run = Path(place) / "run.h5"
        asked = ["--engine", engine, "--omega-0", str(flow), "--time", str(DURATION)]
        command = [sys.executable, "-m", "compare", "simulate", *asked, "-o", str(run)]
        subprocess.run(command, check=True, capture_output=True)
        kept = storage.load(run)
    return float(np.mean(kept.omega_c[kept.time > 0.75 * DURATION]))


def draw(readings: Mapping[str, Sequence[float]]) -> Figure:
    """The ball in its vessel beside its characteristic curve."""
    figure = style.figure(10, 4.2)
    left, right = figure.subplots(1, 2, width_ratios=[1, 1.6])
    _sketch(left)
    _curve(right, Parameters.named("reference"))
    for (engine, values), mark in zip(readings.items(), "ox", strict=True):
        right.plot(FLOWS, values, mark, color="black", mfc="white", ms=7, label=ENGINES[engine])
    right.legend(loc="lower right", frameon=False)
    return figure


def _curve(axes: Axes, p: Parameters) -> None:
    """The exact theory: rolling up to a limit, slipping beyond it."""
    limit = float(analytic.thresholds(p).omega_01)
    flows = np.linspace(limit, FASTEST, 100)[1:]
    slipping = [
        float(analytic.solution(p.replace(omega_0=w), Case.SS).state.omega_c) for w in flows
    ]
    axes.plot([0, limit], [0, limit], color=style.COLOURS[Case.RR], lw=2.5, label="exact theory")
    axes.plot(flows, slipping, color=style.COLOURS[Case.SS], lw=2.5)
    for x, case, what in (
        (1.0, Case.RR, "RR: rolls on floor and wall,\nas fast as the fluid"),
        (15.0, Case.SS, "SS: slips on both,\nlags behind the fluid"),
    ):
        axes.text(x, 15, what, color=style.COLOURS[case])
    axes.set(
        xlim=(0, FASTEST),
        ylim=(0, 19),
        xlabel="angular velocity of the fluid (rad/s)",
        ylabel="angular velocity of the ball's orbit (rad/s)",
    )
    axes.grid(alpha=0.25)


def _sketch(axes: Axes) -> None:
    """Half of the vessel from the side: axis, floor, wall, and the ball that touches both."""
    for corner, width, height in (((-0.2, -0.15), 3.35, 0.15), ((3.0, 0), 0.15, 2.6)):
        axes.add_patch(Rectangle(corner, width, height, fc="0.8", ec="none"))
    axes.add_patch(Rectangle((-0.2, 0), 3.2, 2.35, fc="#E3F0F7", ec="none", zorder=0))
    axes.add_patch(Circle((2.3, 0.7), 0.7, fc="#F5CC6B", ec="black"))
    axes.plot([0, 0], [-0.1, 2.6], color="0.4", lw=1, ls="-.")
    axes.add_patch(Arc((0, 2.1), 1.0, 0.3, theta1=120, theta2=400, color="#0072B2", lw=1.5))
    axes.annotate(
        "", (0.42, 2.2), xytext=(0.47, 2.02), arrowprops={"arrowstyle": "->", "color": "#0072B2"}
    )
    axes.text(0.65, 2.05, "the fluid swirls\nand carries the ball round", va="center")
    axes.plot([2.3, 3.0], [0, 0.7], "o", color="black", ms=6, zorder=4)
    axes.text(2.25, 0.14, "floor", ha="center", va="bottom", fontsize=9)
    axes.text(2.92, 0.7, "wall", ha="right", va="center", fontsize=9)
    axes.set(xlim=(-0.6, 3.2), ylim=(-0.2, 2.7), aspect="equal")
    axes.axis("off")


if __name__ == "__main__":
    main()
