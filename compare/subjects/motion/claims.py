"""Claims about the equations of motion, case by case: (23)-(29), and the project's own away from the wall."""

from __future__ import annotations

import analytic
from compare.claim import Bearing, Claim, Text, given
from compare.judge import theory
from compare.kit.record import state
from compare.settled import force
from compare.subjects.motion import cases
from model import Case
from model.cases import TRAITS
from model.kinematics import VARIABLES

_SOURCES = {
    Case.RR: "(23)",
    Case.RS: "(24)",
    Case.SR: "(25), (29)",
    Case.SS: "(26), (29)",
    Case.NR: "(27)",
    Case.NS: "(28), (29)",
}
_CORRECTED = {
    Case.SS: "The last row of (26) has the wrong sign before w̃_z A_z/(w̃_x jmr), and A_z and B_z of (29) are damaged.",
    Case.NS: "(28) divides by w̃_x where it should by w̃_y, and its last row has -(c v_y + g)/r for +(c v_y + g)/r.",
}
_OWN = "The paper has no equations away from the wall: (20), with a drag on radial motion, is this project's extension."
_FORCES = ("Ax", "Ay", "Az", "Bx", "By", "Bz", "Ax-By", "Ay+By", "Bx+By")
"""Where both contacts roll only A_z, B_z and the sums are determined, and measured."""


def _rate(case: Case, name: str) -> Bearing:
    return Bearing(
        "field",
        f"rate_{name}",
        lambda m: float(theory(analytic.vector_field, case, state(m), m.parameters)[VARIABLES.index(name)]),
        when=given(case=case.name),
        size=lambda m: m.parameters.g / {"v_y": 1.0, "v_h": 1.0, "omega_c": m.parameters.R}.get(name, m.parameters.r),
        by="analytic.vector_field",
    )


def _force(case: Case, name: str) -> Bearing:
    return Bearing(
        "field",
        f"moving_force_{name}",
        lambda m: force(name, *theory(analytic.contact_forces, case, state(m), m.parameters)),
        when=given(case=case.name),
        size=lambda m: m.parameters.m * m.parameters.g,
        by="analytic.contact_forces",
    )


CLAIMS = tuple(
    Claim(
        f"motion-{case.name}",
        _SOURCES.get(case, "(20)"),
        f"In case {case.name} the ball moves, its contacts press and rub, as the equations say.",
        (
            *(_rate(case, name) for name in TRAITS[case].active if name not in ("y", "h")),
            *(_force(case, name) for name in _FORCES),
        ),
        text=Text.CORRECTED if case in _CORRECTED else Text.PRINTED,
        reason=_CORRECTED.get(case, "" if case in _SOURCES else _OWN),
    )
    for case in Case
)
SECTIONS = {"Laws and cases": cases.CLAIMS, "Equations of motion": CLAIMS}
