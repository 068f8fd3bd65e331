"""What the inertia of the fluid would change: added mass, and the pressure gradient of the swirl.

The paper leaves both out, and so do the simulators. A ball that goes round with the fluid needs a centripetal force of
its own mass less that of the fluid it displaces, while its spin is turned as before: (1 - s) m takes the place of m,
j/(1 - s) that of j and g/(1 - s) that of g, with s the density ratio. docs/theory.md derives it, and says why it is an
estimate beside the model and no part of it.
"""

from __future__ import annotations

import math

from analytic.bifurcation import diagram as bifurcation
from model import Parameters

SHIFTED = ("omega_01", "omega_02")
"""Those that shift: at omega_03 the spin alone carries the weight, and the fold of SS has no closed form any more."""


def thresholds(p: Parameters) -> dict[str, float]:
    """`SHIFTED` with the fluid's inertia, rad s-1, nan for what doesn't exist."""
    rest = 1 - p.density_ratio
    curves = bifurcation.curves_without_drag(p.j / rest, p.mu, p.eta)
    return {name: float(curves[name]) * math.sqrt(p.g / rest / p.R) for name in SHIFTED}


def shifts(p: Parameters) -> dict[str, float]:
    """Relative changes of the thresholds, nan for what doesn't exist; and of c/(1 + 2j), the rate of RR in (23), which
    added mass makes c/(1 + 2j + s/2) whatever the law of drag.
    """
    before, after = bifurcation.thresholds(p), thresholds(p)
    changes = {name: after[name] / getattr(before, name) - 1 for name in SHIFTED if getattr(before, name) != 0}
    rolling = 1 + 2 * p.j
    return changes | {"rolling_rate": rolling / (rolling + p.density_ratio / 2) - 1}
