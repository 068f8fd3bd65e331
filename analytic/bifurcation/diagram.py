"""Bifurcations over omega_0: the thresholds omega_01 ... omega_04, eta_cr (section 5)."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntFlag

import numpy as np
import numpy.typing as npt

from analytic.stationary import slipping_branch
from model import InputError, Parameters, State
from model.arrays import Array, Real
from model.errors import check_type


@dataclass(frozen=True)
class Thresholds:
    """Flows omega_0 > 0 at which stationary solutions change, rad s-1, and eta_cr; nan if none."""

    omega_01: float
    """(84): RR ends in SS. nan for eta > j, where A_y would have to be negative. 0 for mu = 0."""
    omega_02: float
    """(85): the wall begins to carry the weight. nan for eta = 0: a smooth wall never does."""
    omega_03: float
    """(86): the gyroscopic moment carries the weight, and RR lifts off, if it lasts so long."""
    omega_04: float
    """(88): the fold of SS. nan unless eta_cr < eta < j, mu > 0 and c > 0."""
    eta_cr: float
    """(87): c^2 R/(4 g mu^2), but 0 for the quadratic law of drag.

    inf for mu = 0 (no fold at any eta), nan for mu = c = 0."""


def thresholds(p: Parameters) -> Thresholds:
    """Flows, rad s-1, at which stationary solutions change; nan for none. (84)-(88)

    p.omega_0 plays no part. The law of drag shifts omega_04 and eta_cr only."""
    check_type("p", p, Parameters)
    Omega = threshold_curves(p, p.mu, p.eta)
    unit = np.sqrt(p.g / p.R)
    eta_cr = float(Omega.pop("eta_cr"))
    return Thresholds(**{name: float(flow * unit) for name, flow in Omega.items()}, eta_cr=eta_cr)


def threshold_curves(
    p: Parameters, mu: npt.ArrayLike, eta: npt.ArrayLike, released: bool = False
) -> dict[str, Array]:
    """The fields of `Thresholds` over arrays mu and eta, with Omega = omega sqrt(R/g) (Figs. 7, 8).

    `released` drops (12), as Fig. 12 does: omega_01 and omega_04 are then continued beyond eta = j
    as far as the equations have solutions."""
    mu, eta = (np.asarray(a, dtype=float) for a in np.broadcast_arrays(mu, eta))
    fold = slipping_branch.fold(p, mu, eta, released)
    folds = np.isfinite(fold)
    Omega_04 = np.full(mu.shape, np.nan)
    Omega_04[folds] = slipping_branch.branch(fold[folds], p, mu[folds], eta[folds]).Omega_0
    return curves_without_drag(p.j, mu, eta, released) | {
        "omega_04": Omega_04,
        "eta_cr": np.broadcast_to(slipping_branch.eta_critical(mu, p), mu.shape),
    }


def curves_without_drag(
    j: float, mu: npt.ArrayLike, eta: npt.ArrayLike, released: bool = False
) -> dict[str, Array]:
    """omega_01 to omega_03, in which drag plays no part, as `threshold_curves` gives them."""
    mu, eta = (np.asarray(a, dtype=float) for a in np.broadcast_arrays(mu, eta))
    divisor = mu * eta * (1 + j) + j - eta
    real = (divisor > 0) & ((eta <= j) | released)
    Omega_01 = np.where(real, np.sqrt(mu * (1 + eta) / np.where(real, divisor, 1.0)), np.nan)
    return {
        "omega_01": np.asarray(Omega_01),
        "omega_02": np.where(eta > 0, 1 / np.sqrt(np.where(eta > 0, eta, 1.0)), np.nan),
        "omega_03": np.full(mu.shape, 1 / np.sqrt(j)),
    }


def number_of_folds(p: Parameters) -> int:
    """Folds along the branch of SS, counted: by Proposition 7 one for eta_cr < eta < j, else none.

    By the changes of sign of `slope`, which assumes nothing. `InputError` as `check_branch`."""
    check_branch(p)
    places = np.linspace(-slipping_branch.END, slipping_branch.END, 20_001)
    values = slipping_branch.slope(places, p)
    return int(np.sum(np.sign(values[1:]) != np.sign(values[:-1])))


def critical_drag(p: Parameters) -> float:
    """Drag c, s-1, at which p.eta is eta_cr (87), which rises like c^2: for less SS has a fold.

    inf for the quadratic law, under which there is always a fold. `InputError` unless 0 < eta < j,
    mu > 0 and p.c > 0; else p.c plays no part."""
    check_branch(p)
    eta_cr = float(slipping_branch.eta_critical(p.mu, p))
    return p.c * float(np.sqrt(p.eta / eta_cr)) if eta_cr else np.inf


def check_branch(p: Parameters) -> None:
    """`InputError` unless SS has a branch from RR to SR: 0 < eta < j, mu > 0 and c > 0."""
    check_type("p", p, Parameters)
    if not (0 < p.eta < p.j and p.mu > 0 and p.c > 0):
        raise InputError(
            f"eta = {p.eta:g} is out of range: SS has a branch from RR to SR for 0 < eta < j = "
            f"{p.j:g}, mu > 0, c > 0 only"
        )


@dataclass(frozen=True)
class DoublePoint:
    """A point of codimension 2 in the plane (eta, omega_0): a black dot of Figs. 7 and 8."""

    eta: float
    omega_0: float
    """rad s-1"""
    meets: tuple[str, ...]
    """The thresholds that meet there."""


def double_points(p: Parameters, equal: bool = False) -> list[DoublePoint]:
    """Where the curves of Fig. 7 meet, or with `equal` friction mu = eta those of Fig. 8.

    At eta_cr, for equal friction (kappa^2/4)^(1/3), where the fold is born; and at eta = j."""
    unit = np.sqrt(p.g / p.R)
    light = slipping_branch.light_drag(p)
    eta_cr = float(np.cbrt(light**2 / 4) if equal else slipping_branch.eta_critical(p.mu, p))
    folds = 0 < eta_cr < p.j
    points = []
    if folds:
        born = ("omega_02", "omega_04")
        points.append(DoublePoint(eta_cr, float(unit / np.sqrt(eta_cr)), born))
    if equal or p.mu > 0:
        meets = ("omega_01", "omega_02", "omega_03", *("omega_04",) * folds)
        points.append(DoublePoint(p.j, float(unit / np.sqrt(p.j)), meets))
    return points


class Exists(IntFlag):
    """Which stationary solutions exist: regions of Figs. 7, 8 (RS exists for omega_0 = 0 only)."""

    RR = 1
    SS = 2
    """The part of the branch that begins in RR."""
    SS_BEYOND_FOLD = 4
    """The unstable part, between the fold and SR."""
    SR = 8
    NR = 16
    NS = 32


def case_map(
    p: Parameters, mu: npt.ArrayLike, eta: npt.ArrayLike, omega_0: npt.ArrayLike
) -> npt.NDArray[np.uint8]:
    """Flags `Exists` over a plane of parameters, shape (number of eta, number of omega_0).

    Parameters
    ----------
    mu, eta : 1-D, of one length (Fig. 8) or mu a number (Fig. 7)
    omega_0 : 1-D, rad s-1, of either sign

    RR counts where no slip grows; for mu > 1 it may also jam beyond that, see `rolling_forces`."""
    Omega = np.abs(np.asarray(omega_0, dtype=float)) / np.sqrt(p.g / p.R)
    eta = np.asarray(eta, dtype=float)
    curves = {name: value[:, None] for name, value in threshold_curves(p, mu, eta).items()}
    mu = np.broadcast_to(np.asarray(mu, dtype=float), eta.shape)[:, None]
    eta = eta[:, None]
    one, two, four = (curves[f"omega_0{k}"] for k in (1, 2, 4))
    two = np.where(np.isnan(two), np.inf, two)
    end_of_rr = np.where(eta < p.j, one, curves["omega_03"])
    slips = (eta < p.j) & (mu > 0) & (p.c > 0)
    folds = np.isfinite(four)
    carried = two <= Omega
    where = {
        Exists.RR: end_of_rr >= Omega,
        Exists.SS: slips & (one < Omega) & (Omega < np.where(folds, four, two)),
        Exists.SS_BEYOND_FOLD: folds & (two < Omega) & (four > Omega),
        Exists.SR: carried,
        Exists.NR: carried,
        Exists.NS: ~carried & (p.c > 0),
    }
    return np.asarray(sum(np.uint8(flag) * there for flag, there in where.items()), np.uint8)


def wall_spin(state: State, p: Parameters) -> Real:
    """omega_x^0 = slip_x + omega_c R/r (91), rad s-1: the spin on the wall in Figs. 9-12."""
    return state.slip_x + p.R / p.r * state.omega_c


SHIFTED = ("omega_01", "omega_02")
"""Thresholds that the fluid's inertia shifts: at omega_03 the spin alone carries the weight, and
the fold of SS has no closed form any more."""


def thresholds_with_inertia(p: Parameters) -> dict[str, float]:
    """omega_01 and omega_02 with the added mass and the pressure gradient of the swirl, rad s-1;
    nan if there is none.

    The paper leaves both out, and so do the simulators. A ball that goes round with the fluid needs
    a centripetal force of its own mass less that of the fluid it displaces, while its spin is
    turned as before: (1 - s) m takes the place of m, j/(1 - s) that of j and g/(1 - s) that of g,
    with s the density ratio. docs/theory.md derives it, and says why it is an estimate beside the
    model and no part of it."""
    rest = 1 - p.density_ratio
    curves = curves_without_drag(p.j / rest, p.mu, p.eta)
    return {name: float(curves[name] * np.sqrt(p.g / rest / p.R)) for name in SHIFTED}


def inertia_shifts(p: Parameters) -> dict[str, float]:
    """Relative changes of the thresholds by the fluid's inertia, nan for what doesn't exist.

    And of c/(1 + 2j), the rate of RR in (23), which added mass makes c/(1 + 2j + s/2) whatever the
    law of drag."""
    before, after = vars(thresholds(p)), thresholds_with_inertia(p)
    changes = {name: after[name] / before[name] - 1 for name in SHIFTED if before[name] != 0}
    rolling = 1 + 2 * p.j
    return changes | {"rolling_rate": rolling / (rolling + p.density_ratio / 2) - 1}
