"""Claims about the equations of motion, case by case: (23)-(29), and the project's own away from the wall."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

import analytic
from compare.claims.claim import Bearing, Claim, Text
from compare.claims.judge import remembered
from compare.measure.record import state
from model import Case, Parameters
from model.arrays import Array
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
_COMPONENTS = ("Ax", "Ay", "Az", "Bx", "By", "Bz")
_COMBINED = ("Ax-By", "Ay+By", "Bx+By")
"""What is determined where both contacts roll, besides A_z and B_z."""
_RATES: dict[str, Callable[[Parameters], float]] = {
    "v_y": lambda p: p.g,
    "omega_c": lambda p: p.g / p.R,
    **{f"slip_{axis}": lambda p: p.g / p.r for axis in "xyz"},
    "v_h": lambda p: p.g,
}
"""The natural size of each rate."""


@remembered
def _rates(case: Case, x: tuple[float, ...], p: Parameters) -> Array:
    return analytic.vector_field(case, x, p)


@remembered
def _forces(case: Case, x: tuple[float, ...], p: Parameters) -> dict[str, float]:
    A, B = analytic.contact_forces(case, x, p)
    force = dict(zip(_COMPONENTS, np.concatenate([A, B]).tolist(), strict=True))
    combined = {"Ax-By": force["Ax"] - force["By"]} | {n: force[n[:2]] + force["By"] for n in ("Ay+By", "Bx+By")}
    return force | combined


def _rate(case: Case, name: str) -> Bearing:
    k = VARIABLES.index(name)
    return Bearing(
        "field",
        f"rate_{name}",
        lambda m: float(_rates(case, state(m), m.parameters)[k]),
        when=lambda m: m.conditions["case"] == case.name,
        scale=_RATES[name],
        by="analytic.vector_field",
    )


def _force(case: Case, name: str) -> Bearing:
    return Bearing(
        "field",
        f"moving_force_{name}",
        lambda m: _forces(case, state(m), m.parameters)[name],
        when=lambda m: m.conditions["case"] == case.name,
        scale=lambda p: p.m * p.g,
        by="analytic.contact_forces",
    )


def _claim(case: Case) -> Claim:
    own = case not in _SOURCES
    return Claim(
        id=f"motion-{case.name}",
        source=_SOURCES.get(case, "(20)"),
        statement=f"In case {case.name} the ball moves, its contacts press and rub, as the equations say.",
        bearings=(
            *(_rate(case, name) for name in _RATES if name in TRAITS[case].active),
            *(_force(case, name) for name in (*_COMPONENTS, *_COMBINED)),
        ),
        text=Text.CORRECTED if case in _CORRECTED else Text.PRINTED,
        reason=_OWN if own else _CORRECTED.get(case, ""),
    )


_OWN = "The paper has no equations away from the wall: (20), with a drag on radial motion, is this project's extension."
CLAIMS = tuple(_claim(case) for case in Case)
