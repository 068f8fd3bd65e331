"""All claims, gathered from the studies."""

from __future__ import annotations

from compare import (
    ablation,
    branches,
    confusion,
    decay,
    diagrams,
    frontier,
    hysteresis,
    laws,
    maps,
    slip,
    stationary,
    table_5,
)  # fmt: skip
from compare.claims import Claim

CLAIMS: tuple[Claim, ...] = (
    *stationary.CLAIMS,
    *decay.CLAIMS,
    *slip.CLAIMS,
    *table_5.CLAIMS,
    *branches.CLAIMS,
    *maps.CLAIMS,
    *diagrams.CLAIMS,
    *hysteresis.CLAIMS,
    *laws.CLAIMS,
    *confusion.CLAIMS,
    *ablation.CLAIMS,
    *frontier.CLAIMS,
)
"""Every claim there is, in the order of the paper."""
