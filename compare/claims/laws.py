"""What holds at every instant, Table 3 with (12)-(17), and the drag of the fluid, (10)."""

from __future__ import annotations

from analytic import stokes
from compare.claims.claim import Bearing, Claim, Text
from compare.measure.laws import FLUIDS
from compare.measure.record import Measurement

PROTOCOL = "laws"


def _none(m: Measurement) -> float:
    return 0.0


def coulomb(m: Measurement) -> float:
    """The friction coefficient of the contact: mu of the floor, eta of the wall."""
    return m.parameters.mu if m.conditions["contact"] == "A" else m.parameters.eta


def sinking(m: Measurement) -> float:
    """v_y in m/s by Stokes' drag, from the properties of fluid and ball."""
    return -stokes.sinking_speed(**{name: float(m.conditions[name]) for name in FLUIDS[m.set]})


CLAIMS = (
    Claim(
        id="table-3", source="Table 3, (12)-(17)",
        statement=(
            "A contact that rolls doesn't slip; contacts press and never pull; friction stays within mu or eta times "
            "the normal force, has that size where the contact slips, and opposes the slip."
        ),
        bearings=(
            Bearing(PROTOCOL, "law", _none, scale=lambda p: 1.0, by="(12), (13)"),
            Bearing(PROTOCOL, "law_in_motion", _none, scale=lambda p: 1.0, by="Table 3, (14)-(17)"),
            Bearing(PROTOCOL, "friction_ratio", coulomb, by="(14), (15)"),
        ),
    ),
    Claim(
        id="eq-10", source="(9), (10)",
        statement="A ball sinks freely at the speed at which Stokes' drag balances its weight less buoyancy.",
        bearings=(Bearing(PROTOCOL, "v_y", sinking, by="analytic.stokes.sinking_speed"),),
        text=Text.CORRECTED, reason="Table 1 gives the unit of m·c as kg m/s; it is kg/s.",
    ),
)  # fmt: skip
