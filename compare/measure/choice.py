"""Where a ball settles on floors so rough (mu > 1) that rolling and slipping are both consistent with the forces.

It starts at rest in a flow above omega_01. Rolling on for as long as forces allow would lead to a cycle of sticking and
slipping that never settles.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping

import numpy as np

from compare.measure.lab import Lab, Level
from compare.measure.record import Measurement, Missing, Records, measurement
from compare.measure.settling import Start, settle
from model import Parameters

NAME = "choice"
ROUGH = {
    "rough-floor-1": (1.7222, 0.0388, 0.482, 0.292, 0.1099, 2.635),
    "rough-floor-2": (1.2277, 0.1721, 0.611, 0.154, 0.1198, 2.099),
}
"""mu, eta, j, r/R, kappa, omega_0 sqrt(R/g). The second is left to the higher levels: its contacts hover for long."""


def measure(lab: Lab, sets: Mapping[str, Parameters], records: Records) -> Iterator[Measurement | Missing]:
    """Case and omega_c of the settled motion."""
    if "reference" not in sets:
        yield Missing(NAME, next(iter(sets), ""), "the choice is that of sets of its own with mu > 1")
        return
    starts = [
        Start(name, _parameters(sets["reference"], *values), "rest", np.zeros(8)) for name, values in ROUGH.items()
    ][: 1 if lab.level is Level.QUICK else None]
    for start, settled in zip(starts, settle(lab, starts), strict=True):
        if settled.failure:
            yield Missing(NAME, start.set, settled.failure)
            continue
        yield measurement(lab, NAME, start.set, start.p, "case", settled.case, [settled.task])
        yield measurement(lab, NAME, start.set, start.p, "omega_c", settled.values["omega_c"], [settled.task])


def _parameters(
    reference: Parameters, mu: float, eta: float, j: float, ratio: float, kappa: float, Omega_0: float
) -> Parameters:
    unit = math.sqrt(reference.g / reference.R)
    return reference.replace(mu=mu, eta=eta, j=j, r=ratio * reference.R, c=kappa * unit, omega_0=Omega_0 * unit)
