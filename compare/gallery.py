"""The figures of the report; those of the league and of a designed meter belong to their pages.

To add one, write a module with what it selects, how that is drawn, its caption; add a record to those of its subject.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from compare.bench import figures as settings
from compare.kit import drawing
from compare.kit.drawing import Drawing, GapError, Material
from compare.subjects.attractors import figures as periodic
from compare.subjects.flowmeter.figures import characteristic, unloading
from compare.subjects.slipping import figures as slipping
from compare.subjects.stationary import figures as deviations
from compare.subjects.thresholds.figures import bifurcation_diagrams, parameter_plane
from compare.subjects.unsteady import figures as unsteady
from model import InputError, StorageError
from model.files import make_directory, write_text

Figures = dict[str, Drawing]
"""Figures by their file names."""
FORMATS = ("svg", "pdf", "png")
CAPTIONS = "captions.txt"


def _of(title: str, module: Any, name: str, *claims: str) -> Drawing:
    """One of several figures of a module; it stands beside the claim of its own name if no others are named."""
    return Drawing(title, partial(module.select, figure=name), module.draw, module.caption, claims or (name,))


STATIONARY: Figures = {
    "characteristic": Drawing(
        "Characteristic curves", characteristic.select, characteristic.draw, characteristic.caption
    ),
    "fig-7": _of("Fig. 7: regions over wall friction and flow", parameter_plane, "fig-7"),
    "fig-8": _of("Fig. 8: regions over equal friction and flow", parameter_plane, "fig-8"),
    "fig-9": _of("Fig. 9: off the floor", bifurcation_diagrams, "fig-9"),
    "fig-10": _of("Fig. 10: on the floor, η < j", bifurcation_diagrams, "fig-10"),
    "fig-11": _of("Fig. 11: on the floor, η > j", bifurcation_diagrams, "fig-11"),
    "fig-12": _of("Fig. 12: on the floor, η > j, (12) released", bifurcation_diagrams, "fig-12"),
    "fig-13-left": characteristic.figure_13("fig-13-left", "Fig. 13, left: hysteresis, η < j"),
    "fig-13-right": characteristic.figure_13("fig-13-right", "Fig. 13, right: η > j"),
}
SLIPPING: Figures = {
    "fig-4": _of("Fig. 4: a slip that dies out", slipping, "fig-4", "slip-NR-NS"),
    "fig-5": _of("Fig. 5: a slip that grows", slipping, "fig-5", "slip-NR-NS"),
}
UNSTEADY: Figures = {
    "unloading": Drawing(
        "Section 5.3: the fall at unloading", unloading.select, unloading.draw, unloading.caption, ("fig-13-right",)
    ),
    "pulsation": Drawing(
        "Unsteady flow: pulsation",
        partial(unsteady.select, figure="pulsation"),
        unsteady.draw_pulsation,
        unsteady.caption_pulsation,
        ("pulsation-lag", "pulsation-slip", "pulsation-mean"),
    ),
    "unsteady": Drawing(
        "Unsteady flow: jumps and ramps",
        partial(unsteady.select, figure="unsteady"),
        unsteady.draw_unsteady,
        unsteady.caption_unsteady,
        ("jump-slipping", "ramp-fold"),
    ),
}
ATTRACTORS: Figures = {
    "hopping-orbit": Drawing(
        "Beyond the paper: a ball that hops for ever",
        periodic.select,
        periodic.draw_orbit,
        periodic.caption_orbit,
        ("hopping",),
    ),
    "hopping-branch": Drawing(
        "Beyond the paper: Figs. 9, 10 and 13 with hopping",
        periodic.select,
        periodic.draw_branch,
        periodic.caption_branch,
        ("hopping-birth",),
    ),
    "hopping-walls": Drawing(
        "Beyond the paper: hops along rougher walls",
        periodic.select_walls,
        periodic.draw_walls,
        periodic.caption_walls,
        ("hopping-death",),
    ),
}
BENCH: Figures = {
    "ladder": Drawing(
        "From a newcomer's settings to the study's",
        settings.select_ladder,
        settings.draw_ladder,
        settings.caption_ladder,
    ),
    "frontier": Drawing("Error and cost", settings.select_frontier, settings.draw_frontier, settings.caption_frontier),
}
FIGURES: Figures = STATIONARY | BENCH | SLIPPING | UNSTEADY | ATTRACTORS
"""Every figure, in the order of the report."""


def figures_of(claim: str) -> Figures:
    """The figures that stand beside a claim; unless one bears its name, also the deviations of its numbers."""
    own = {name: each for name, each in FIGURES.items() if claim in each.claims}
    return own if claim in own else own | {f"claim-{claim}": deviations.of(claim)}


def write(output: Path, material: Material, formats: Sequence[str] = ("svg",)) -> Iterator[tuple[str, str]]:
    """Write all figures to a directory, and their captions; yield the name of each, and why it wasn't drawn if so.

    Raises `InputError` for an unknown format, `StorageError` if a file can't be written.
    """
    for suffix in formats:
        if suffix not in FORMATS:
            raise InputError(f"no figure can be written as {suffix!r}; there are {', '.join(FORMATS)}")
    make_directory(output)
    captions = []
    for name, each in FIGURES.items():
        try:
            data = each.select(material)
            figure = each.draw(data)
        except (GapError, StorageError) as gap:
            yield name, f"not drawn: {gap}"
            continue
        for suffix in formats:
            drawing.save(figure, output / f"{name}.{suffix}")
        captions.append(f"{name}\n{each.title}. {each.caption(data)}\n")
        yield name, ""
    write_text(output / CAPTIONS, "\n".join(captions))
