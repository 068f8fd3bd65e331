"""Theory fitted to a measured calibration curve: what the curve tells of friction and drag.

Below the kink at omega_01 the ball rolls, and its reading is in proportion to the flow, whatever
friction and drag are. The kink itself tells one combination of mu and eta (84). How the reading
goes on beyond it tells the rest, if the curve reaches that far."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from analytic.bifurcation import diagram as bifurcation
from analytic.stationary import slipping_branch
from model import InputError, Parameters
from model.arrays import Array

FITS = (("mu",), ("mu", "eta"), ("mu", "eta", "c"))
"""What is fitted; the rest is a set's. Drag is c times a function of the lag, whatever its law."""
TOLD, FEWEST, CHANCE = 1 / 3, 4, 1e-3
"""Relative standard uncertainty up to which a curve tells a parameter; readings that are needed on
each side of a kink; most that scatter about a straight line may look like it (F test)."""
_REACH = {"mu": (1e-3, 10.0), "eta": (1e-4, 1 - 1e-6), "c": (1e-2, 1e2)}
"""Where each is looked for: eta in units of j, c in those of the set's."""
_STARTS = {"mu": (0.05, 0.1, 0.2, 0.4, 0.8), "eta": (0.1, 0.3, 0.5, 0.7, 0.9), "c": (0.3, 1.0, 3.0)}
"""Values from which it is looked for, in the same units."""
_BRANCH = np.linspace(-20.0, 20.0, 2001)
"""Places on the branch of SS between which its reading is interpolated."""


@dataclass(frozen=True)
class Fit:
    """Theory as near to a measured curve as it comes, with some parameters fitted."""

    free: tuple[str, ...]
    p: Parameters
    factor: float
    """omega_0 divided by the flow as it was measured."""
    kink: float
    """omega_01 as such a flow."""
    u: dict[str, float]
    """Relative standard uncertainties of `free`, factor and kink; inf if the curve doesn't tell."""
    off: Array
    """Relative deviation of each reading from theory, (n,)."""

    @property
    def told(self) -> bool:
        """Whether the curve tells every parameter that was fitted."""
        return all(self.u[name] <= TOLD for name in self.free)


def fits(p: Parameters, flow: Array, read: Array) -> list[Fit]:
    """The fits `FITS` of a curve: readings omega_c > 0 (n,), rad s-1, at flows > 0 (n,) in
    proportion to omega_0; [] for a curve without a kink.

    Raises `InputError` for fewer than `FEWEST` readings on either side of it, for readings that
    are on no curve, and for a set of which theory's curve has no kink."""
    from scipy.stats import f  # here, because it takes a second to load

    bifurcation.check_branch(p)
    if len(flow) < 2 * FEWEST:
        raise InputError(f"too few readings: {len(flow)}, where {2 * FEWEST} are needed")
    found = list[Fit]()
    for free in FITS:
        found.append(_fit(p, free, flow, read, found[-1:]))
    straight, more = np.log(read / flow), len(FITS[-1])
    bent, left = np.log1p(found[-1].off) ** 2, len(flow) - more - 1
    rest = max(bent.sum(), len(flow) * np.finfo(float).eps ** 2)
    gained = (len(flow) * straight.var() - rest) / more
    if f.sf(gained / (rest / left), more, left) > CHANCE:
        if (scatter := straight.std()) > TOLD:
            said = f"follow no curve of theory, and scatter by {100 * scatter:.2g} %"
            raise InputError(f"the readings {said} about proportion to the flow")
        return []
    below = int(np.sum(flow < found[-1].kink))
    if min(below, len(flow) - below) < FEWEST:
        sides = f"{below} below the kink and {len(flow) - below} beyond"
        raise InputError(f"too few readings: {sides}, where {FEWEST} are needed on each side")
    return found


def deviations(p: Parameters, omega_0: Array, omega_c: Array) -> Array:
    """How far readings (n,) are from theory's curve, and flows beyond its ends; logarithms (2, n).

    Where the curve is steep the deviation along the flow counts, as the lesser one. Where two
    motions attract (Fig. 13) the reading may be of either: the nearer one counts."""
    t, unit, b = bifurcation.thresholds(p), np.sqrt(p.g / p.R), slipping_branch.branch(_BRANCH, p)
    fold = int(b.Omega_0.argmax()) + 1
    flows, reads = unit * b.Omega_0[:fold], unit * b.Omega_c[:fold]
    low, high = np.minimum(omega_0, flows[-1]), np.maximum(omega_0, t.omega_02)
    above = np.log(omega_c / np.where(low < t.omega_01, low, np.interp(low, flows, reads)))
    before = np.where(omega_c < t.omega_01, omega_c, np.interp(omega_c, reads, flows))
    lesser = np.where(np.abs(above) < np.abs(np.log(before / low)), above, np.log(before / low))
    off = np.array([(lesser, np.log(omega_c / omega_0)), np.log(omega_0 / np.array([low, high]))])
    nearer = np.sum(off**2, 0).argmin(0)
    return np.asarray(np.take_along_axis(off, nearer[None, None], 1)[:, 0])


def _fit(
    p: Parameters, free: Sequence[str], flow: Array, read: Array, before: Sequence[Fit]
) -> Fit:
    """The best fit, from the best of `_STARTS` and of what was fitted before; logarithms of the
    factor and of what is free are varied."""
    from scipy.optimize import least_squares  # here, because other commands shall not wait for it

    unit = {"mu": 1.0, "eta": p.j, "c": p.c}

    def of(place: Array) -> tuple[float, Parameters]:
        factor, *values = np.exp(place).tolist()
        return factor, p.replace(**dict(zip(free, values, strict=True)))

    def off(place: Array) -> Array:
        factor, q = of(place)
        return deviations(q, factor * flow, read).ravel()

    def log_kink(place: Array) -> float:
        factor, q = of(place)
        return float(np.log(bifurcation.thresholds(q).omega_01 / factor))

    slowest = np.log(read / flow)[np.argsort(flow)[:FEWEST]].mean()
    grid = itertools.product(*([unit[name] * x for x in _STARTS[name]] for name in free))
    starts = [np.array([slowest, *np.log(values)]) for values in grid]
    starts += [np.log([b.factor, *(getattr(b.p, name) for name in free)]) for b in before]
    best = min(starts, key=lambda place: float(np.sum(off(place) ** 2)))
    ends = [np.log([unit[name] * x for x in _REACH[name]]) for name in free]
    limits = np.array([(-np.inf, np.inf), *ends])
    found = least_squares(
        off, best, "3-point", (limits[:, 0], limits[:, 1]), ftol=1e-6, x_scale="jac", max_nfev=200
    )
    at, n = found.x, len(flow)
    _, sizes, ways = np.linalg.svd(np.asarray(found.jac)[:n], full_matrices=False)
    with np.errstate(divide="ignore", invalid="ignore"):
        root = ways.T / sizes * np.sqrt(2 * found.cost / (n - len(at)))  # of the covariance
        kink = [(log_kink(at + h) - log_kink(at - h)) / 2e-4 for h in 1e-4 * np.eye(len(at))]
        u = np.linalg.norm([*root, kink @ root], axis=1)
    said = dict(zip(["factor", *free, "kink"], np.nan_to_num(u, nan=np.inf).tolist(), strict=True))
    factor, q = of(at)
    return Fit(tuple(free), q, factor, float(np.exp(log_kink(at))), said, np.expm1(found.fun[:n]))
