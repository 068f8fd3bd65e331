"""The figure of each claim: the paper's own with the measured points upon it, or else how far each number is off."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from compare import maps
from compare.catalogue import CLAIMS
from compare.figures import bifurcation_diagrams, mujoco, parameter_plane, style, transients
from compare.results import Summary
from model import Case, storage

Checks = Sequence[Mapping[str, Any]]
Draw = Callable[[Summary, Path], Figure]
"""Draws from the summary and, where need be, from run files of the results directory."""

WITNESSES = {
    "mujoco": ("o", "#0072B2"),
    "event": ("s", "#D55E00"),
    "time-stepping": ("^", "#009E73"),
    "theory": ("D", "0.3"),
}
"""Mark and colour of each witness."""


def deviations(claim: str, summary: Summary, directory: Path) -> Figure:
    """Deviation of every number of a claim in units of its standard uncertainty; the band is the tolerance."""
    judged = [check for check in _checks(summary, claim) if check["judged"]]
    checks = [check for check in judged if check["uncertainty"] > 0]
    counted = [check for check in judged if check["uncertainty"] == 0]
    figure = style.figure(7.0, 3.2)
    axes = figure.add_subplot()
    groups = list(dict.fromkeys(check["quantity"] for check in checks))
    for witness, (mark, colour) in WITNESSES.items():
        # Side by side within their quantity, in the order of the checks.
        points = [
            (group + 0.8 * ((k + 0.5) / len(alike) - 0.5), check["error"] / check["uncertainty"])
            for group, alike in enumerate([c for c in checks if c["quantity"] == quantity] for quantity in groups)
            for k, check in enumerate(alike)
            if check["witness"] == witness
        ]
        if points:
            x, y = zip(*points, strict=True)
            axes.plot(x, y, ls="none", marker=mark, color=colour, mfc="none", label=witness)
    tolerance = max((check["tolerance"] / check["uncertainty"] for check in checks), default=3.0)
    axes.axhspan(-tolerance, tolerance, color="0.93", zorder=0)
    axes.axhline(0, **style.GUIDE)
    axes.set_xticks(range(len(groups)), groups, fontsize=8, rotation=15 if len(groups) > 4 else 0)
    axes.set_ylabel("(measured − predicted)/uncertainty", fontsize=9)
    if checks:
        title = f"and {sum(c['passed'] for c in counted)} of {len(counted)} counts right" if counted else None
        figure.legend(loc="outside upper center", ncols=4, fontsize=8, frameon=False, title=title, title_fontsize=8)
    return figure


def plane(claim: str, summary: Summary, directory: Path) -> Figure:
    """Figs. 7 and 8 with the cases found at random points; a cross where they aren't those predicted."""
    draw = {"fig-7": parameter_plane.draw_figure_7, "fig-8": parameter_plane.draw_figure_8}[claim]
    figure = draw(maps.PLANE)
    axes = figure.axes[0]
    looks = {
        "NS RR": ("o", "#0072B2"), "NS SS": ("^", "#D55E00"), "NR": ("D", "#009E73"), "NR RR": ("s", "#E69F00"),
        "NR SS": ("P", "#CC79A7"),
    }  # fmt: skip
    seen = set()
    for check in _checks(summary, claim):
        eta, found = _place(check["condition"])
        mark, colour = looks.get(found, ("*", "black"))
        open_mark = check["witness"] == "mujoco"
        label = None if found in seen else found.replace(" ", ", ")
        seen.add(found)
        axes.plot(
            eta, check["omega_0"], ls="none", marker=mark, color=colour, ms=7 if open_mark else 3.5,
            mfc="none" if open_mark else colour, label=label,
        )  # fmt: skip
        if not check["passed"]:
            axes.plot(eta, check["omega_0"], "x", color="red", ms=10)
    axes.set_ylim(0, 1.1 * maps.OMEGA[1])
    legend = axes.get_legend()
    if legend:
        legend.remove()
    figure.legend(
        loc="outside lower center", ncols=5, fontsize=7.5, frameon=False, title_fontsize=7.5,
        title="SS*: unstable. Marks: where runs ended, open MuJoCo, filled event-driven, crossed if not as predicted",
    )  # fmt: skip
    return figure


def _place(condition: str) -> tuple[float, str]:
    """eta and the cases found, from the condition of a check of `compare.maps`."""
    match = re.fullmatch(r"μ = \S+, η = (\S+): (.*)", condition)
    if match is None:
        raise ValueError(f"not a point of a plane: {condition}")
    return float(match[1]), match[2]


def diagram(claim: str, summary: Summary, directory: Path) -> Figure:
    """Figs. 9-11 with the measured states."""
    figure = {
        "fig-9": bifurcation_diagrams.draw_figure_9,
        "fig-10": bifurcation_diagrams.draw_figure_10,
        "fig-11": bifurcation_diagrams.draw_figure_11,
    }[claim]()
    axes = figure.axes[0]
    for check in _checks(summary, claim):
        (mark, _), size = WITNESSES[check["witness"]], 7.5 if check["witness"] == "mujoco" else 3.5
        case = Case[check["condition"].split(",")[0]]
        axes.errorbar(
            check["omega_0"], check["measured"], yerr=check["tolerance"], marker=mark, color=style.COLOURS[case],
            ms=size, mfc="none", mec="black", ls="none", zorder=5,
        )  # fmt: skip
    return figure


def slip_perturbation(summary: Summary, directory: Path) -> Figure:
    """Figs. 4 and 5: one of the pushes that die out, and one of those that grow."""
    runs = {check["condition"]: check["run"] for check in _checks(summary, "fig-4-5") if check["witness"] == "event"}
    return transients.draw_slip_perturbation(*(storage.load(directory / str(run)) for run in runs.values()))


def loop(summary: Summary, directory: Path) -> Figure:
    """The loop of Fig. 13, left, as MuJoCo runs it."""
    return transients.draw_hysteresis(storage.load(_run(summary, directory, "fig-13-left", "mujoco")))


def unloading(summary: Summary, directory: Path) -> Figure:
    """The unloading of Fig. 13, right, event by event."""
    return transients.draw_unloading(storage.load(_run(summary, directory, "fig-13-right", "event")))


def formal(summary: Summary, directory: Path) -> Figure:
    """Fig. 12 by theory alone."""
    return bifurcation_diagrams.draw_figure_12()


def _checks(summary: Summary, claim: str) -> Checks:
    checks: Checks = summary.verdicts[claim]["checks"]
    return checks


def _run(summary: Summary, directory: Path, claim: str, witness: str) -> Path:
    """The run file of a witness that a claim's checks name."""
    return next(directory / str(check["run"]) for check in _checks(summary, claim) if check["witness"] == witness)


_OWN: dict[str, Draw] = {
    **{name: partial(plane, name) for name in ("fig-7", "fig-8")},
    **{name: partial(diagram, name) for name in ("fig-9", "fig-10", "fig-11")},
    "fig-4-5": slip_perturbation,
    "fig-12": formal,
    "fig-13-left": loop,
    "fig-13-right": unloading,
    **mujoco.FIGURES_OF,
}
_CAPTIONS = {
    **dict.fromkeys(
        ("fig-7", "fig-8"),
        "Theory: regions of the same stationary states, whose names they bear, and the surfaces between them. Marks: "
        "the states in which runs ended at random points.",
    ),
    **dict.fromkeys(
        ("fig-9", "fig-10", "fig-11"),
        "Lines: theory, dashed where unstable. Circles: MuJoCo, squares: event-driven; the tolerances are smaller.",
    ),
    "fig-4-5": "Above ω₀₂ a slip at the wall dies out (Fig. 4), below it grows and the ball stays in NS (Fig. 5); the "
    "event-driven simulation. Left: the slip over time. Right: its path in the plane orthogonal to NR, from the cross.",
    "fig-12": "Theory alone.",
    "fig-13-left": "MuJoCo's ball at the end of each held step, as ω₀ is raised and lowered.",
    "fig-13-right": "ω₀ falls below ω₀₂ while the ball rides the wall: the event-driven simulation. The ball slips, "
    "falls, hits the floor and ends in two-point rolling.",
    **mujoco.CAPTIONS,
}
_DEVIATIONS = "Every number's deviation from its prediction in units of its standard uncertainty. The band: tolerance."
CAPTIONS = {claim.id: _CAPTIONS.get(claim.id, _DEVIATIONS) for claim in CLAIMS}
"""What the figure of each claim shows."""
FIGURES_OF: dict[str, Draw] = {claim.id: _OWN.get(claim.id, partial(deviations, claim.id)) for claim in CLAIMS}
"""The figure of each claim, by its id: called with the summary and the results directory."""
