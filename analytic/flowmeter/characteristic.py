"""The ball as a flowmeter (section 5.3): its characteristic omega_c(omega_0), and range."""

from dataclasses import dataclass
from enum import Enum

import numpy as np

from analytic.bifurcation import diagram as bifurcation
from analytic.stationary import slipping_branch
from analytic.stationary import solutions as stationary
from model import Case, InputError, Parameters
from model.errors import check_type


class End(Enum):
    """What ends the operating range."""

    SLIP = "it begins to slip at both points and lags"
    """At omega_01, for eta < j."""
    UNLOADING = (
        "the wall can carry it, and drops it with impacts when the flow falls below this again"
    )
    """At omega_02, for eta >= j: the black dot of Fig. 13."""
    SMOOTH = "a contact without friction never makes it roll"
    NO_DRAG = "without drag nothing makes it go round"


@dataclass(frozen=True)
class OperatingLimit:
    """Up to which flow the ball can do nothing but roll at both points, and why not beyond."""

    omega_0: float
    """rad s-1; 0 if there is always another motion that lasts."""
    end: End


def operating_limit(p: Parameters) -> OperatingLimit:
    """Largest omega_0 below which rolling at both points (RR) is all that lasts, and what ends it.

    Section 5.3. For eta < j it ends where RR ends in slipping, omega_01. For eta >= j RR itself
    goes on to omega_03, where the floor lets go, but it is alone up to omega_02 only: a flow beyond
    may leave the ball on the wall, which drops it with transients and impacts when the flow falls
    below omega_02 again (unloading)."""
    check_type("p", p, Parameters)
    if p.c == 0:
        return OperatingLimit(0.0, End.NO_DRAG)
    if p.mu == 0 or p.eta == 0:
        return OperatingLimit(0.0, End.SMOOTH)
    Omega = bifurcation.curves_without_drag(p.j, p.mu, p.eta)
    name, end = ("omega_01", End.SLIP) if p.eta < p.j else ("omega_02", End.UNLOADING)
    return OperatingLimit(float(Omega[name] * np.sqrt(p.g / p.R)), end)


def operating_range(p: Parameters) -> float:
    """The flow of `operating_limit`, rad s-1."""
    return operating_limit(p).omega_0


def reading_range(p: Parameters) -> float:
    """Largest omega_0, rad s-1, up to which the ball reads omega_c = omega_0 in every motion.

    omega_01 for eta < j. inf for eta >= j, where RR, SR and NR all go round with the fluid, and on
    a smooth floor, which can't hold the ball back. 0 without drag."""
    check_type("p", p, Parameters)
    if p.c == 0:
        return 0.0
    return bifurcation.thresholds(p).omega_01 if p.eta < p.j and p.mu > 0 else np.inf


def unloading_limit(p: Parameters) -> float:
    """omega_02 in rad s-1: a ball on the wall (NR) stays there above; below it sinks and lands.

    nan for a smooth wall, which carries no ball."""
    return bifurcation.thresholds(p).omega_02


def characteristic_slope(p: Parameters, case: Case | None = None) -> float:
    """d omega_c/d omega_0 along the attractors at p.omega_0: 1 but in SS, (38), (41), (89).

    Parameters
    ----------
    case : which attractor; needed from omega_02 to omega_04, where SS lags, SR and NR don't

    Raises `InputError` if there is no attractor (of that case), or if `case` is needed."""
    followed = stationary.stable_solutions(p) if case is None else [stationary.solution(p, case)]
    if p.c == 0 or not followed:
        raise InputError(
            f"no motion follows the flow at omega_0 = {p.omega_0:g} rad s-1 with c = {p.c:g} s-1"
        )
    slips = {bool(np.isfinite(s.alpha)) for s in followed}
    if len(slips) > 1:
        names = ", ".join(s.case.name for s in followed)
        raise InputError(
            f"the characteristic has several branches at omega_0 = {p.omega_0:g} rad s-1: choose "
            f"{names}"
        )
    if slips == {False}:
        return 1.0
    s = np.log(np.abs(np.tan(followed[0].alpha)))
    return float(slipping_branch.characteristic_slope(s, p))


def slope_jump(p: Parameters) -> float:
    """Jump of the characteristic's slope at omega_01, where slipping sets in: by -1, to zero.

    The first bit of slip turns the friction at the floor without changing the load: omega_c doesn't
    rise at first."""
    bifurcation.check_branch(p)
    return float(slipping_branch.characteristic_slope(-slipping_branch.END, p)) - 1.0


def mean_slope(p: Parameters) -> float:
    """Mean slope of the characteristic from omega_01 to omega_02, along SS: "very small" (5.3).

    1 for eta <= eta_cr, where the branch arrives at omega_02 without a lag. `InputError` unless 0 <
    eta < j, mu, c > 0."""
    bifurcation.check_branch(p)
    t = bifurcation.thresholds(p)
    if np.isnan(t.omega_04):
        return 1.0
    s = slipping_branch.points_at(p.replace(omega_0=t.omega_02))[0]
    omega_c = float(slipping_branch.branch(s, p).Omega_c) * np.sqrt(p.g / p.R)
    return float((omega_c - t.omega_01) / (t.omega_02 - t.omega_01))
