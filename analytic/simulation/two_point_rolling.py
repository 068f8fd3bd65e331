"""Motion in RR, with Stokes' drag in closed form, and the moment when it ends.

There (23) is linear, omega_c' = -k (omega_c - omega_0) with k = c/(1+2j), and omega_0 is a line and waves between the
breakpoints of the flow; `charts` has the other laws. What RR leaves open is its forces: where it ends is the choice
of `Settings.leave_rolling`.
"""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
from scipy.optimize import brentq

from analytic.mechanics import drag, rolling_forces
from analytic.simulation.motion import Fluid, Moment, Path
from model import Parameters, State
from model.arrays import Array, Real

_SCAN = 256
"""Points in a stretch of RR, or in each period of its waves, at which its end is looked for: margins that are negative
in between only are missed."""
MARGINS = {"slip-stability": rolling_forces.slip_margin, "infeasible": rolling_forces.margin}
"""How far RR is from where it is left, >= 0 while it lasts, by `Settings.leave_rolling`."""
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(16)


def omega_c(t: Real, at: Moment, p: Parameters, omega_0: Fluid) -> Real:
    """omega_c at times t of a stretch that starts at a moment, same shape: (23) solved for a line and waves."""
    k, tau = p.c / (1 + 2 * p.j), t - at.time
    a, b = omega_0.value + omega_0.slope * (at.time - omega_0.start), omega_0.slope
    start = at.x.omega_c - _forced(at.time, k, omega_0)
    # k tau^2 (1 - tau k/3 + …): the lag behind a ramp, without the cancellation of tau - (1 - exp(-k tau))/k.
    line = start - (a - start) * np.expm1(-k * tau) + b * k * tau**2 * drag.ramp_lag(k * tau)
    return line + _forced(t, k, omega_0)


def _forced(t: Real, k: float, omega_0: Fluid) -> Real:
    """The periodic part of omega_c: each wave times k/(k + i omega)."""
    swing = 0.0 * t
    for amplitude, omega, phase in omega_0.waves:
        swing = swing + amplitude * (k / (k + 1j * omega) * np.exp(1j * (omega * t + phase))).imag
    return swing


def path(t: Array, at: Moment, p: Parameters, omega_0: Fluid) -> Path:
    """States at increasing times t (n,) after `at`; azimuth and work of the drag by Gauss' quadrature, exact here."""
    k = p.c / (1 + 2 * p.j)
    span = float(t[-1]) - at.time
    quickest = max((omega for _, omega, _ in omega_0.waves), default=0.0)
    ends = np.union1d(np.append(t, at.time), np.linspace(at.time, t[-1], 2 + int((k + quickest) * span)))
    middle, half = (ends[1:] + ends[:-1]) / 2, np.diff(ends) / 2
    nodes = middle[:, None] + half[:, None] * _NODES
    w = omega_c(nodes, at, p, omega_0)
    power = -p.m * p.c * p.R**2 * w * (w - omega_0(nodes))
    theta, work = (np.append(0.0, np.cumsum(half * (f @ _WEIGHTS))) for f in (w, power))
    here = np.searchsorted(ends, t)
    x, none = State(omega_c=omega_c(t, at, p, omega_0)), np.full_like(t, np.nan)
    return Path(t, at.theta + theta[here], x.stacked(), none, none, at.work + work[here])


def end(at: Moment, until: float, p: Parameters, omega_0: Fluid, leave_rolling: str) -> float | None:
    """First time at which RR can't go on or is left, or None if it lasts until `until`."""
    margin = MARGINS[leave_rolling]

    def value(t: float) -> float:
        return float(margin(omega_c(t, at, p, omega_0), p, omega_0(t)))

    periods = sum((until - at.time) * omega / (2 * math.pi) for _, omega, _ in omega_0.waves)
    for start, stop in pairwise(np.linspace(at.time, until, 2 + int(periods))):
        times = np.linspace(start, stop, _SCAN)
        gone = margin(omega_c(times, at, p, omega_0), p, omega_0(times)) < 0
        if gone[0]:
            return float(start)
        if np.any(gone):
            first = int(np.argmax(gone))
            ends = times[first - 1], times[first]
            return float(brentq(value, *ends, xtol=4 * math.ulp(until), rtol=4 * math.ulp(1.0)))
    return None
