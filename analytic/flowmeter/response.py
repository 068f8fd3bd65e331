"""How the reading follows a flow that changes: linear response, and ramps past the fold.

About a stationary motion x' = J x + b (omega_0 - p.omega_0), with J of `dynamics.jacobian` and b
the derivative of the vector field by omega_0. In RR this is (23) itself, exact for any amplitude: a
first-order lag of rate c/(1+2j). docs/theory.md derives all of it. Frequencies are in Hz."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.optimize import minimize_scalar

from analytic.mechanics import dynamics
from analytic.stationary import slipping_branch
from analytic.stationary import solutions as stationary
from model import Case, InputError, Parameters, State
from model.arrays import Array, Complex
from model.cases import TRAITS
from model.drag import STOKES

AIRY_ZERO = 2.338107410459767
"""-z at the first zero of Airy's function Ai(z)."""
_GRID = 20_000
_BRANCH_STEP = 1e-3
"""Step of differences along the branch at the fold: their errors are its square."""


def rolling_rate(p: Parameters) -> float:
    """Rate c/(1+2j), s-1, of omega_c after omega_0 in RR (23); `InputError` unless Stokes' law."""
    if p.drag != STOKES:
        raise InputError(
            f"drag = {p.drag!r}: omega_c follows the flow at one rate with Stokes' drag only"
        )
    return p.c / (1 + 2 * p.j)


def transfer(p: Parameters, case: Case, frequency: npt.ArrayLike) -> Complex:
    """Complex omega_c divided by omega_0 in small pulsations at frequencies in Hz, same shape.

    About the stable motion of the case; its modulus is the gain, its argument the phase lead
    (negative: a lag). Raises `InputError` if there is no such motion."""
    J, b, own = _linearised(p, case)
    s = 2j * np.pi * np.asarray(frequency)[..., None, None]
    found = np.linalg.solve(s * np.eye(len(b)) - J, b[:, None])
    return np.asarray(found[..., own, 0], dtype=np.complex128)


def step_response(p: Parameters, case: Case, t: npt.ArrayLike) -> Array:
    """Change of omega_c at t >= 0 (s) after a small jump of the flow, divided by it; same shape.

    About the stable motion of the case at p.omega_0, as in `transfer`."""
    J, b, own = _linearised(p, case)
    rates, modes = np.linalg.eig(J)
    shares = modes[own] * np.linalg.solve(modes, b.astype(complex))
    return np.asarray(np.real(np.expm1(np.asarray(t)[..., None] * rates) / rates @ shares))


def peak(p: Parameters, case: Case) -> tuple[float, float]:
    """Time in s and height of the top of the `step_response`, relative to its end.

    Without overshoot within eight times of the slowest decay inf, 1."""
    slowest = 1 / np.abs(np.linalg.eigvals(_linearised(p, case)[0]).real).min()
    t = np.linspace(0.0, 8 * slowest, _GRID)
    y = step_response(p, case, t) / (end := np.real(transfer(p, case, 0.0)))
    if (k := int(y.argmax())) == 0 or y[k] <= 1:
        return np.inf, 1.0
    beside = t[k - 1], t[min(k + 1, len(t) - 1)]
    top = minimize_scalar(
        lambda at: -float(step_response(p, case, at) / end), bounds=beside, options={"xatol": 1e-9}
    )
    return float(top.x), -float(top.fun)


def ramp_coefficient(p: Parameters) -> float:
    """K of the overshoot K rate^(2/3), rad s-1, of a slow ramp past the fold; rate in rad s-2.

    At the fold the slow coordinate obeys q' = a (omega_0 - omega_04) + b q^2, whose eigenvalue on
    the branch is 2 b q = -2 sqrt(-a b (omega_0 - omega_04)). On a ramp q is a ratio of Airy
    functions, and runs off at the zero of Ai: K = 2.338 (a b)^(-1/3). Raises `InputError` if there
    is no fold."""
    s = float(slipping_branch.fold(p))
    if np.isnan(s):
        raise InputError(f"there is no fold at eta = {p.eta:g}: the branch of SS doesn't turn back")
    places = s + _BRANCH_STEP * np.array([-1.0, 0.0, 1.0])
    flows, values = slipping_branch.states(places, p)[1], slipping_branch.eigenvalues_at(places, p)
    slow = np.take_along_axis(values, np.abs(values).argmin(axis=-1)[:, None], axis=-1)[:, 0].real
    slope = (slow[2] - slow[0]) / (2 * _BRANCH_STEP)
    curvature = (flows[0] - 2 * flows[1] + flows[2]) / _BRANCH_STEP**2
    return float(AIRY_ZERO * (-(slope**2) / (2 * curvature)) ** (-1 / 3))


def _linearised(p: Parameters, case: Case) -> tuple[Array, Array, int]:
    """J (d, d), b (d,) of x' = J x + b (omega_0 - mean) in a stable motion; the row of omega_c."""
    x = stationary.solution(p, case).x
    active = TRAITS[case].active
    rates = dynamics.rates(case, State(*x), p, p.omega_0 + 1j * dynamics.STEP)
    b = np.array([np.imag(getattr(rates, name)) for name in active]) / dynamics.STEP
    return dynamics.jacobian(case, x, p), b, active.index("omega_c")
