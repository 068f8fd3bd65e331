"""Branches of stationary solutions in figures: spin on the wall, or omega_c, over the flow."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes

import analytic
from analytic.bifurcation import diagram as bifurcation
from analytic.stationary import slipping_branch
from compare.figures import style
from compare.figures.style import UNSTABLE, Place
from model import Case, InputError, Parameters, State
from model.arrays import Array

Drawn = Callable[[Array, Array], Array]
"""What is drawn, of slip_x and omega_c."""


def spin(p: Parameters, slip_x: Array, omega_c: Array) -> Array:
    """The spin about the wall's normal omega_x (91), rad s-1."""
    return np.asarray(bifurcation.wall_spin(State(omega_c=omega_c, slip_x=slip_x), p))


def spin_of(case: Case, omega_0: float, p: Parameters) -> float:
    """omega_x (91) of the stationary solution of a case at a flow, rad s-1, if formal."""
    p = p.replace(omega_0=float(omega_0))
    return float(bifurcation.wall_spin(analytic.solution(p, case, formal=True).state, p))


def round_with_fluid(p: Parameters, case: Case, begin: float, end: float) -> tuple[Array, Array]:
    """slip_x and omega_c (n,) of RR, SR, NR or NS, where omega_c = omega_0, over flows."""
    flows = np.linspace(begin, end, 200)
    rolls, alike = p.R / p.r * flows, Case.NR if case is Case.SR else case
    spun = rolls if case is Case.RR else np.array([spin_of(alike, flow, p) for flow in flows])
    return spun - rolls, flows


def stable_ends(p: Parameters) -> tuple[float, float]:
    """The flows, rad s-1, up to which RR is stable, and from which SR is; one for eta > j."""
    Omega, unit = bifurcation.curves_without_drag(p.j, p.mu, p.eta), math.sqrt(p.g / p.R)
    rolls, rides = ("omega_01", "omega_02") if p.eta < p.j else ("omega_03", "omega_03")
    return float(Omega[rolls] * unit), float(Omega[rides] * unit)


def check_thresholds(p: Parameters) -> None:
    """Raise `InputError` where a set lacks a threshold, as without friction or drag."""
    t = bifurcation.thresholds(p)
    if not math.isfinite(t.omega_02 + (t.omega_04 if p.eta < p.j else t.omega_03)):
        raise InputError(
            f"a set with mu = {p.mu:g}, eta = {p.eta:g} and c = {p.c:g} 1/s has not all thresholds"
        )


def slipping_curve(p: Parameters, count: int) -> tuple[State, Array, npt.NDArray[np.bool_]]:
    """`count` states of the branch of SS, their flows, rad s-1, and whether unstable."""
    s = np.linspace(-16.0, 16.0, count)
    x, omega_0 = slipping_branch.states(s, p)
    return State.of(x), omega_0, slipping_branch.eigenvalues_at(s, p).real.max(axis=-1) > 0


def slipping(
    axes: Axes,
    p: Parameters,
    quantity: Drawn,
    stable: Place | None = None,
    unstable: Place | None = None,
) -> None:
    """Draw the branch of SS, dashed where unstable; named where a place is given."""
    x, omega_0, grows = slipping_curve(p, 1601)
    values = quantity(x.slip_x, x.omega_c)
    for part, line, text, place in (
        (~grows, "-", "SS", stable),
        (grows, UNSTABLE, "SS, unstable", unstable),
    ):
        if part.any():
            style.curve(axes, Case.SS, omega_0, np.where(part, values, np.nan), (text, place), line)


def fold_state(p: Parameters, released: bool = False) -> State:
    """The state of SS at the fold."""
    return State.of(slipping_branch.states(slipping_branch.fold(p, released=released), p)[0])
