"""All claims, in the order of the report."""

from __future__ import annotations

from dataclasses import replace

from compare.claim import Claim
from compare.subjects.attractors import claims as attractors
from compare.subjects.flowmeter import claims as flowmeter
from compare.subjects.flowmeter import unloading
from compare.subjects.motion import cases
from compare.subjects.motion import claims as equations
from compare.subjects.slipping import claims as slipping
from compare.subjects.stability import claims as stability
from compare.subjects.stationary import claims as stationary
from compare.subjects.thresholds import claims as bifurcations
from compare.subjects.thresholds import formal
from compare.subjects.unsteady import claims as unsteady

SECTIONS: dict[str, tuple[Claim, ...]] = {
    "Stationary states": stationary.CLAIMS,
    "Bifurcations": (*stationary.DIAGRAMS, *bifurcations.CLAIMS),
    "Stability": stability.CLAIMS,
    "Flowmeter": (*flowmeter.CLAIMS, *unloading.CLAIMS),
    "Laws and cases": cases.CLAIMS,
    "Slipping": slipping.CLAIMS,
    "Equations of motion": equations.CLAIMS,
    "Formal": formal.CLAIMS,
    "Beyond the paper": attractors.CLAIMS,
    "Unsteady flow": unsteady.CLAIMS,
}
CLAIMS = tuple(replace(claim, section=section) for section, claims in SECTIONS.items() for claim in claims)
"""Every claim there is."""
