"""All claims, in the order of the report."""

from __future__ import annotations

from compare.claims import (
    attractors,
    bifurcations,
    cases,
    equations,
    flowmeter,
    formal,
    laws,
    lifting,
    slipping,
    stability,
    stationary,
    unloading,
    unsteady,
)
from compare.claims.claim import Claim

CLAIMS: tuple[Claim, ...] = (
    *stationary.CLAIMS,
    *stability.CLAIMS,
    *bifurcations.CLAIMS,
    *flowmeter.CLAIMS,
    *unloading.CLAIMS,
    *laws.CLAIMS,
    *slipping.CLAIMS,
    *lifting.CLAIMS,
    *cases.CLAIMS,
    *equations.CLAIMS,
    *formal.CLAIMS,
    *attractors.CLAIMS,
    *unsteady.CLAIMS,
)
"""Every claim there is."""
