"""A ball that rolls at both points (RR) in a pulsating flow: when it slips, and its mean reading.

The flow is omega_0 = p.omega_0 + amplitude sin(2 pi frequency t). While the ball rolls, omega_c
pulsates about the mean of the flow exactly, with any law of drag: no error of the mean. The
friction that this takes grows with the lag omega_c - omega_0, whose drag accelerates the ball (23);
the loads grow with omega_c^2. docs/theory.md derives the rest."""

from __future__ import annotations

import functools
import math

import numpy as np
import numpy.typing as npt
from scipy.optimize import brentq

from analytic.bifurcation import diagram as bifurcation
from analytic.mechanics import drag, rolling_forces
from analytic.simulation.settings import Settings
from analytic.simulation.simulator import simulate
from analytic.slipping import slip_bounds
from model import Case, Flow, Parameters, SimulationError, State
from model.arrays import Array, Complex
from model.drag import STOKES
from model.kinematics import TURNING

PHASES, CLOSER = 360, 32
"""Phases of a period at which slip is looked for, and in each of two refinements."""
HARMONICS, FINE = 32, 128
"""Odd harmonics of the lag that are computed (drag is an odd function); those left out are some
1e-6 of it, or `LEFT_OUT`."""
LEFT_OUT = 1e-7
LAG_STEPS, SOLVED = 50, 1e-9
"""Most steps of Newton's method, and the largest residual relative to the flow's acceleration."""
ROUNDS, DEPTH, SETTLED, PERIODIC_RTOL = 100, 3, 1e-6, 1e-6
"""Of `mean_error`: most periods simulated, depth of Anderson's extrapolation, tolerance of the
change in a period relative to the flow, and the integrator's rtol. The mean is then known to some
1e-6 of the flow."""


def swing(
    p: Parameters, amplitude: float, frequency: float, phase: npt.ArrayLike
) -> tuple[Array, Array]:
    """omega_c and omega_0 of RR in a pulsation, rad s-1, at phases of the flow, rad, same shape."""
    lag = lag_harmonics(p, amplitude, frequency)
    return _swing(p, amplitude, lag, np.asarray(phase, dtype=float))


def _swing(p: Parameters, amplitude: float, lag: Complex, phase: Array) -> tuple[Array, Array]:
    """As `swing`, from the harmonics of the lag."""
    omega_0 = p.omega_0 + amplitude * np.sin(phase)
    waves = np.exp(1j * phase[..., None] * np.arange(1, 2 * len(lag), 2))
    return omega_0 + (waves * lag).sum(axis=-1).real, omega_0


def first_harmonic(p: Parameters, amplitude: float, frequency: float) -> complex:
    """First harmonic of `swing` divided by that of omega_0; by Stokes' law `response.transfer`."""
    return complex(1 + 1j * lag_harmonics(p, amplitude, frequency, FINE)[0] / amplitude)


def lag_harmonics(
    p: Parameters, amplitude: float, frequency: float, harmonics: int = HARMONICS
) -> Complex:
    """Complex first odd harmonics of the lag D = omega_c - omega_0 in a periodic RR (23), rad s-1.

    D' = -c(R |D|) D/(1+2j) - omega_0', at two phases of half a period for every harmonic. With
    Stokes' law there is one, and the first step of Newton's method has nothing left to do. Raises
    ArithmeticError if it doesn't converge."""
    turn, inertia = 2 * math.pi * frequency, 1 + 2 * p.j
    phase, amplitudes, derivative = _collocation(1 if p.drag == STOKES else harmonics)
    push = amplitude * turn * np.cos(phase)
    rate = drag.coefficient(p.R * amplitude, p) / inertia
    lag = -amplitude * turn * np.real(np.exp(1j * phase) / (rate + 1j * turn))
    for _ in range(LAG_STEPS):
        speed = p.R * np.abs(lag)
        left = turn * (derivative @ lag) + drag.coefficient(speed, p) * lag / inertia + push
        if np.abs(left).max() <= SOLVED * amplitude * turn:
            return np.asarray(amplitudes @ lag, dtype=np.complex128)
        jacobian = turn * derivative + np.diag(drag.slope(speed, p) / inertia)
        lag = lag - np.linalg.solve(jacobian, left)
    raise ArithmeticError(
        f"no periodic lag in a pulsation by {amplitude:g} rad s-1 at {frequency:g} Hz"
    )


@functools.cache
def _collocation(harmonics: int) -> tuple[Array, Complex, Array]:
    """Phases of half a period; matrices from values there to amplitudes and to derivatives."""
    odd = np.arange(1, 2 * harmonics, 2)
    phase = np.linspace(0.0, math.pi, 2 * harmonics, endpoint=False)
    waves = np.exp(1j * phase[:, None] * odd)
    amplitudes = waves.conj().T / harmonics
    return phase, amplitudes, np.real(waves * (1j * odd) @ amplitudes)


_MARGINS = {"slip-stability": rolling_forces.slip_margin, "infeasible": rolling_forces.margin}
"""How far RR is from where it is left, >= 0 while it lasts, by `Settings.leave_rolling`."""


def slip_onset(p: Parameters, frequency: float, leave_rolling: str = "slip-stability") -> float:
    """Least amplitude, rad s-1, at which slip begins at some phase; frequency > 0 in Hz.

    By the margin of `Settings.leave_rolling` along `swing`; on rough floors and at high frequencies
    "infeasible" gives a larger amplitude. 0 where the mean flow alone ends RR, inf without drag."""
    margin = _MARGINS[leave_rolling]
    if p.c == 0:
        return math.inf

    def least_margin(amplitude: float) -> float:
        lag, at, cells = lag_harmonics(p, amplitude, frequency), 0.0, math.pi
        for count in (PHASES, CLOSER, CLOSER):
            phases = at + np.linspace(-cells, cells, count + 1)
            omega_c, omega_0 = _swing(p, amplitude, lag, phases)
            margins = margin(omega_c, p, omega_0)
            at, cells = float(phases[margins.argmin()]), 2 * cells / count
        return float(margins.min())

    low, high = 0.0, 1e-3 * math.sqrt(p.g / p.R)
    if least_margin(low) <= 0:
        return 0.0
    while least_margin(high) > 0:
        low, high = high, 1.5 * high
    return float(brentq(least_margin, low, high, rtol=1e-12))


def slow_onset(p: Parameters) -> float:
    """`slip_onset` at low frequency: the flow rises to omega_01 or omega_03, or falls to 0 (67)."""
    t, flow = bifurcation.thresholds(p), abs(p.omega_0)
    end = t.omega_01 if p.eta < p.j else t.omega_03
    return max(0.0, min(end - flow, flow))


def fast_onset(p: Parameters) -> float:
    """`slip_onset` at high frequency, where omega_c stands still and the lag is the flow's.

    The least of (66), of (73) if the wall can turn the spin at that lag, and of the lag at which
    both cones are full."""
    u, unit = p.R / p.g * p.omega_0**2, p.j / ((1 + 2 * p.j) * p.g)
    k, ju = (1 + p.j) * u, p.j * u
    wall, floor = (
        abs(bound(p, p.omega_0, 1).zero - p.omega_0)
        for bound in (slip_bounds.rr_to_rs, slip_bounds.rr_to_sr)
    )
    push = drag.coefficient(p.R * floor, p) * p.R * floor
    lags = [wall] if math.hypot(ju, unit * push) > p.eta * u else [wall, floor]
    # B_y = s m g, s^2 + z^2 = eta^2 (k - s)^2 and (ju - s)^2 + z^2 = mu^2 (1 - s)^2 without z^2.
    linear, constant = 2 * (p.mu**2 - p.eta**2 * k - ju), (p.eta * k) ** 2 - p.mu**2 + ju**2
    for s in np.roots([p.eta**2 - p.mu**2, linear, constant]):
        if np.isreal(s) and 0 <= s.real <= min(ju, p.eta * k / (1 + p.eta)):
            push = math.sqrt((p.eta * (k - s.real)) ** 2 - s.real**2) / unit
            lags.append(float(drag.speed_of(push, p)) / p.R)
    return min(lags)


def mean_error(
    p: Parameters,
    amplitude: float,
    frequency: float,
    settled: float = SETTLED,
    leave_rolling: str = "slip-stability",
) -> float:
    """Mean of omega_c less p.omega_0, rad s-1, once the motion is periodic; frequency in Hz.

    0 if the ball rolls on; else from the gain of azimuth in the event-driven simulation. Each
    period starts from an extrapolation of the last few (Anderson's method), until the motion
    repeats itself to `settled` times the flow. `leave_rolling` as in `Settings`. Raises
    `SimulationError` if it never does."""
    settings = Settings(rtol=PERIODIC_RTOL, leave_rolling=leave_rolling)
    flow = Flow.sine(p.omega_0, amplitude, frequency)
    x = State(omega_c=swing(p, amplitude, frequency, 0.0)[0]).stacked()
    starts, ends = np.empty((0, 4)), np.empty((0, 4))
    for _ in range(ROUNDS):
        run = simulate(p, x, 1 / frequency, flow, settings, sample_interval=1 / frequency)
        if not len(starts) and not len(run.events.time) and run.case[0] == Case.RR:
            return 0.0
        starts = np.vstack([starts[-DEPTH:], x[TURNING]])
        ends = np.vstack([ends[-DEPTH:], run.x[-1, TURNING]])
        change = ends - starts
        if np.abs(change[-1]).max() <= settled * abs(p.omega_0):
            return float(run.theta[-1]) * frequency - p.omega_0
        x, shares = run.x[-1].copy(), np.linalg.lstsq(np.diff(change, axis=0).T, change[-1])[0]
        x[TURNING] -= np.diff(ends, axis=0).T @ shares
    raise SimulationError(
        f"a pulsation by {amplitude:g} rad s-1 at {frequency:g} Hz doesn't become periodic", run
    )
