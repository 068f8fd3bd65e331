"""The parameter sets that are measured: a few chosen by hand, and a design that fills a box evenly; and by whom.

Friction is greater on the floor in some, on the wall in others, and the wall's is below and above the inertia j; drag
is weak in some and strong in others. Two sets have another law of drag, at Reynolds numbers of hundreds. Each protocol
chooses omega_0 itself: that of a set is not used.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from compare.kit.levels import Level
from compare.kit.sweep import sobol
from model import Parameters
from model.drag import QUADRATIC, SCHILLER_NAUMANN, STOKES

COUNT = {Level.DEFAULT: 24, Level.FULL: 96}
SEED = 20161
LOW = {"mu": 0.05, "eta": 0.05, "j": 0.2, "r/R": 0.1, "kappa": 0.05, "R": 0.04, "g": 6.0, "m": 0.01}
HIGH = {"mu": 1.0, "eta": 1.0, "j": 0.66, "r/R": 0.4, "kappa": 0.4, "R": 0.08, "g": 10.0, "m": 0.05}
"""Ranges of the design; lengths in m, masses in kg, g in m s-2."""

_CHOSEN = {
    "rough-floor": {"m": 0.02, "r": 0.012, "R": 0.06, "j": 0.3, "mu": 0.45, "eta": 0.15, "g": 9.81, "c": 2.0},
    "rough-wall": {"m": 0.05, "r": 0.015, "R": 0.05, "j": 0.55, "mu": 0.15, "eta": 0.35, "g": 8.0, "c": 1.5},
    "thick-fluid": {"m": 0.03, "r": 0.008, "R": 0.04, "j": 0.45, "mu": 0.25, "eta": 0.1, "g": 9.0, "c": 5.0},
    "heavy-core": {"m": 0.01, "r": 0.02, "R": 0.07, "j": 0.25, "mu": 0.7, "eta": 0.5, "g": 9.5, "c": 2.5},
    "wake": {"m": 0.02, "r": 0.012, "R": 0.06, "j": 0.42, "mu": 0.5, "eta": 0.2, "g": 9.0, "c": 1.4, "nu_f": 8e-5},
    "blunt": {"m": 0.03, "r": 0.01, "R": 0.05, "j": 0.4, "mu": 0.5, "eta": 0.2, "g": 8.5, "c": 1.2, "nu_f": 4e-5},
    "rubber-wall": {"m": 0.04, "r": 0.01, "R": 0.055, "j": 0.35, "mu": 0.3, "eta": 0.8, "g": 7.0, "c": 3.0},
}
_DRAG = {"wake": SCHILLER_NAUMANN, "blunt": QUADRATIC}
"""The laws of those that have another than Stokes'."""


def sets(level: Level) -> dict[str, Parameters]:
    """The sets of a level by name."""
    named = {name: Parameters.named(name) for name in ("reference", "high-wall-friction")}
    chosen = {name: Parameters(**values, omega_0=1.0, drag=_DRAG.get(name, STOKES)) for name, values in _CHOSEN.items()}
    sets = named | chosen
    if level > Level.QUICK:  # a scrambled Sobol sequence fills the box evenly
        low, high = np.array(list(LOW.values())), np.array(list(HIGH.values()))
        unit = sobol(len(LOW), COUNT[level] - len(sets), SEED)
        for k, row in enumerate((low + unit * (high - low)).tolist(), start=1):
            values = dict(zip(LOW, row, strict=True))
            ratio, kappa = values.pop("r/R"), values.pop("kappa")
            c = kappa * math.sqrt(values["g"] / values["R"])
            sets[f"design-{k}"] = Parameters(**values, r=ratio * values["R"], c=c, omega_0=1.0)
    return sets


ONE_BALL = ("reference",)
"""For what one ball shows as well as many, or the paper draws for one."""
ENDS_OF_ROLLING = (*ONE_BALL, "high-wall-friction")
"""One ball that comes to slip on the floor, and one that the wall's friction lifts first."""
DRAG_LAWS = (*ONE_BALL, "wake", "blunt")
"""One for each law of drag."""
WITNESSED = (*ENDS_OF_ROLLING, "rough-floor", "wake")
"""Both ends of rolling, a floor rough enough for balls that slip and balls that ride the wall at one flow, a law of
drag."""
VARIED = (*ENDS_OF_ROLLING, "rough-floor", "thick-fluid", "wake", "blunt", "rubber-wall")
"""Each for a reason: the two above; a floor rough enough for balls that slip and balls that ride the wall at one flow;
drag so strong that nothing folds; two other laws of drag; friction of the wall above that of the floor and the inertia.
On them all wrong theories are noticed that are noticed on all nine sets chosen by hand."""
MOST_WITNESSED = 12
"""Sets, at most, that engines in the limit of no time step measure above the quick level."""


@dataclass(frozen=True)
class Assignment:
    """Which sets a protocol measures, by which engine."""

    quick: tuple[str, ...] = VARIED
    """By the engine on trial at the quick level; at the others all of them."""
    limit: tuple[str, ...] = ()
    """By engines in the limit of no time step at the quick level. At the others these measure `MOST_WITNESSED`, and
    `reference` where none is named here."""
    steps: tuple[int, int] = (3, 3)
    """With how many of their time steps, the coarsest first: at the quick level, and above."""
    as_it_comes: tuple[str, ...] = ()
    """By MuJoCo as it comes."""
    level: Level = Level.QUICK
    """The least level of which it is a part."""


# fmt: off
ASSIGNMENTS: dict[str, Assignment] = {
    # protocol                 on trial, quick  in the limit     steps   as it comes
    "settled":    Assignment(VARIED,          WITNESSED,       (4, 4), ONE_BALL),
    "mirrored":   Assignment(ONE_BALL,        ONE_BALL),
    "plane":      Assignment(ONE_BALL),
    "thresholds": Assignment(VARIED,          WITNESSED,       (3, 4)),
    "edge":       Assignment(("reference", "rough-floor")),
    "birth":      Assignment(VARIED),
    "rates":      Assignment((*DRAG_LAWS, "high-wall-friction", "thick-fluid"), ONE_BALL),
    "growth":     Assignment(VARIED,          WITNESSED),
    "steepest":   Assignment(VARIED,          WITNESSED),
    "lift":       Assignment(VARIED,          ENDS_OF_ROLLING, (4, 4)),
    "bounds":     Assignment(VARIED,          ONE_BALL),
    "laws":       Assignment(VARIED,          ONE_BALL),
    "field":      Assignment(VARIED,          WITNESSED),
    "motions":    Assignment(ONE_BALL,        ONE_BALL),
    "runs":       Assignment(DRAG_LAWS,       ONE_BALL),
    "torque":     Assignment(ONE_BALL,        ONE_BALL,        (4, 4)),
    "impacts":    Assignment(ENDS_OF_ROLLING, ONE_BALL),
    "hysteresis": Assignment(ONE_BALL,        ONE_BALL,        (4, 4)),
    "unloading":  Assignment(ENDS_OF_ROLLING),
    "slope":      Assignment(VARIED,          ONE_BALL),
    "pulsation":  Assignment(DRAG_LAWS,       ONE_BALL),
    "unsteady":   Assignment(DRAG_LAWS,       ONE_BALL),
    "recurrent":  Assignment(ONE_BALL),
    "stepped":    Assignment(ONE_BALL),
    "choice":     Assignment(ONE_BALL,        ONE_BALL,        (4, 4)),
    "followed":   Assignment(ONE_BALL,        level=Level.DEFAULT),
    "rebounding": Assignment(ONE_BALL,        level=Level.DEFAULT),
    "swing":      Assignment(ONE_BALL,        level=Level.DEFAULT),
    "calm":       Assignment(ONE_BALL,        level=Level.DEFAULT),
}
# fmt: on
"""Who measures what, by protocol. One that isn't listed has the default."""
