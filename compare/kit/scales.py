"""Natural sizes of measured quantities, by which the judge divides errors."""

from __future__ import annotations

from compare.kit.settling import ERROR_GROUPS, scale
from compare.kit.short import slip_unit
from model import Parameters
from model.kinematics import VARIABLES, state_units

_SETTLED = frozenset(name for group in ERROR_GROUPS for name in group)
_RATIOS = frozenset({"slope", "steepest", "filippov_share", "response", "law_in_motion"})
"""Ratios, angles, and deviations that are divided by their scales already."""


def natural_size(quantity: str, p: Parameters) -> float | None:
    """Natural size of a quantity by its name; None where that is the predicted value itself."""
    kind, _, of = quantity.partition("_")
    if (settled := quantity.removeprefix("edge_")) in _SETTLED:
        return scale(settled, p)
    if kind in ("end", "after"):
        return float(state_units(p)[VARIABLES.index(of)])
    if kind == "rate":
        return p.g / {"v_y": 1.0, "v_h": 1.0, "omega_c": p.R}.get(of, p.r)
    if kind == "moving":
        return p.m * p.g
    if quantity == "gamma":
        return slip_unit(p)
    return 1.0 if quantity in _RATIOS else None
