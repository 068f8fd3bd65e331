"""Motion in RR, in closed form, and the moment when it ends.

(23) is linear, omega_c' = -k (omega_c - omega_0) with k = c/(1+2j), and omega_0 is linear in time between the
breakpoints of the flow. What RR leaves open is its forces, so that its end is a matter of choice, see `Settings`.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import numpy.typing as npt
from scipy.optimize import brentq

from analytic import dynamics, flight, rolling_forces, slip_stability
from analytic.motion import Fluid, Moment, Path
from model import Case, Contact, Parameters
from model.arrays import Array
from model.cases import TRAITS

_SCAN = 256
"""Points at which a stretch of RR is looked at for its end: exits that close again in between are missed."""
_TOGETHER = 1e-6
"""Difference of the two friction utilisations up to which they count as equal."""
_ARROWS = [
    *((Case.SR, (sign, 0.0, 0.0)) for sign in (1.0, -1.0)), *((Case.RS, (0.0, sign, 0.0)) for sign in (1.0, -1.0)),
    (Case.SS, (0.0, 0.0, 1.0)),
]  # fmt: skip
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(16)


def omega_c(t: npt.ArrayLike, at: Moment, until: float, p: Parameters, omega_0: Fluid) -> Array:
    """omega_c at times t (n,) of a stretch that starts at a moment, while omega_0 is linear until `until`."""
    k, tau = p.c / (1 + 2 * p.j), np.asarray(t, dtype=float) - at.time
    a, b = _line(at.time, until, omega_0)
    start = at.x[2]
    # k tau^2 (1 - tau k/3 + …): the lag behind a ramp, without the cancellation of tau - (1 - exp(-k tau))/k.
    return np.asarray(start - (a - start) * np.expm1(-k * tau) + b * k * tau**2 * flight.second(k * tau))


def path(t: Array, at: Moment, until: float, p: Parameters, omega_0: Fluid) -> Path:
    """States at increasing times t (n,) after `at`; azimuth and work of the drag by Gauss' quadrature, exact here."""
    a, b = _line(at.time, until, omega_0)
    k = p.c / (1 + 2 * p.j)
    span = float(t[-1]) - at.time
    ends = np.union1d(np.append(t, at.time), np.linspace(at.time, t[-1], 2 + int(k * span)))
    middle, half = (ends[1:] + ends[:-1]) / 2, np.diff(ends) / 2
    nodes = middle[:, None] + half[:, None] * _NODES
    w = omega_c(nodes, at, until, p, omega_0)
    power = -p.m * p.c * p.R**2 * w * (w - a - b * (nodes - at.time))
    theta, work = (np.append(0.0, np.cumsum(half * (f @ _WEIGHTS))) for f in (w, power))
    here = np.searchsorted(ends, t)
    x = np.zeros((len(t), 8))
    x[:, 2] = omega_c(t, at, until, p, omega_0)
    none = np.full_like(t, np.nan)
    return Path(t, at.theta + theta[here], x, none, none, at.work + work[here])


def end(at: Moment, until: float, p: Parameters, omega_0: Fluid, criterion: str) -> float | None:
    """First time at which RR can't go on or is left, or None if it lasts until `until`."""
    margin = _MARGINS[criterion]

    def value(t: float) -> float:
        return margin(float(omega_c(t, at, until, p, omega_0)), p, omega_0(t))

    times = np.linspace(at.time, until, _SCAN)
    if criterion == "infeasible":
        fluid = np.array([omega_0(t) for t in times])
        values = rolling_forces.margin(omega_c(times, at, until, p, omega_0), p, fluid)
    else:
        values = np.array([value(t) for t in times])
    if not np.any(gone := values < 0):
        return None
    first = int(np.argmax(gone))
    if first == 0:
        return at.time
    return float(brentq(value, times[first - 1], times[first], xtol=4 * math.ulp(until), rtol=4 * math.ulp(1.0)))


def holds(omega_c: float, p: Parameters, omega_0: float, criterion: str) -> bool:
    """Whether the ball goes on rolling at both points."""
    return _MARGINS[criterion](omega_c, p, omega_0) >= 0


def onset(omega_c: float, p: Parameters, omega_0: float) -> tuple[float, float] | None:
    """Slip directions alpha, beta (8) if both contacts reach their friction together at the end of RR, else None.

    The friction there is continuous into SS and opposes the slip. Where one contact alone runs out of friction, the
    forces jump and this tells nothing.
    """
    best = rolling_forces.least_utilisation(omega_c, p, omega_0)
    if not np.isfinite(best.B_y) or not best.utilisation > 1 - _TOGETHER:
        return None
    A_x, A_y, A_z, B_x, B_y, B_z = dynamics.rolling_family(omega_c, p, omega_0, float(best.B_y))
    limit_A, limit_B = p.mu * A_y, p.eta * B_x
    if A_x * B_y >= 0 or limit_A <= 0 or limit_B <= 0:
        return None
    use_A, use_B = math.hypot(A_x, A_z) / limit_A, math.hypot(B_y, B_z) / limit_B
    return (math.atan2(A_z, -A_x), math.atan2(-B_z, B_y)) if abs(use_A - use_B) <= _TOGETHER else None


def leave(at: Moment, p: Parameters, omega_0: float) -> tuple[Case, Moment]:
    """The case that follows RR, and the moment with its slip directions.

    Where both contacts reach their friction together this is SS (`onset`); else the arrow of Fig. 6 along which slip
    grows fastest.
    """
    if directions := onset(at.x[2], p, omega_0):
        return Case.SS, replace(at, alpha=directions[0], beta=directions[1])
    case, (w_x, w_y, w_z), _ = _fastest_slip(at.x[2], p, omega_0)
    alpha = math.atan2(w_x, w_z) if case.A is Contact.S else math.nan
    beta = math.atan2(w_y, w_z) if case.B is Contact.S else math.nan
    return case, replace(at, alpha=alpha, beta=beta)


def _infeasible(omega_c: float, p: Parameters, omega_0: float) -> float:
    return float(rolling_forces.margin(omega_c, p, omega_0))


def _slip_growth(omega_c: float, p: Parameters, omega_0: float) -> float:
    """Minus the growth of the fastest slip, in units of g/r, but no more than the margin of the forces."""
    return min(-_fastest_slip(omega_c, p, omega_0)[2] * p.r / p.g, _infeasible(omega_c, p, omega_0))


def _fastest_slip(omega_c: float, p: Parameters, omega_0: float) -> tuple[Case, tuple[float, float, float], float]:
    """Case, direction (slip_x, slip_y, slip_z), growth (53): of a slip of A, of B, or of both along (0, 0) of (82)."""
    x, q = [0.0, 0.0, omega_c, 0.0, 0.0, 0.0], p.replace(omega_0=omega_0)
    found = []
    for case, n in _ARROWS:
        active = [v for v, name in zip(n, ("slip_x", "slip_y", "slip_z"), strict=True) if name in TRAITS[case].active]
        growth = float(slip_stability.gamma(Case.RR, case, x, active, q, slip_stability.Metric.ENERGY))
        found.append((case, n, growth))
    return max(found, key=lambda arrow: arrow[2])


_MARGINS: dict[str, Callable[[float, Parameters, float], float]] = {
    "infeasible": _infeasible, "slip-stability": _slip_growth,
}  # fmt: skip


def _line(start: float, until: float, omega_0: Fluid) -> tuple[float, float]:
    """omega_0 at the start, and its slope."""
    a = omega_0(start)
    return a, (omega_0(until) - a) / (until - start)
