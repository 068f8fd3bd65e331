"""All claims, in the order of the report."""

from __future__ import annotations

from dataclasses import replace

from compare.claims import (
    attractors,
    bifurcations,
    cases,
    equations,
    flowmeter,
    formal,
    slipping,
    stability,
    stationary,
    unloading,
    unsteady,
)
from compare.claims.claim import Claim

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
