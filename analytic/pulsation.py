"""A ball that rolls at both points (RR) in a flow that pulsates: when it slips, and what it then reads on average.

The flow is omega_0 = p.omega_0 + amplitude sin(2 pi frequency t). While the ball rolls, omega_c pulsates about the mean
of the flow exactly, with any law of drag: no error of the mean. The friction that this takes grows with the lag
omega_c - omega_0, whose drag accelerates the ball (23); the loads grow with omega_c^2. docs/theory.md derives the rest.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
from scipy.optimize import brentq

from analytic import bifurcation, drag, slip_bounds, stationary
from analytic.simulation import simulate
from analytic.two_point_rolling import MARGINS
from model import Case, Flow, InputError, Parameters, SimulationError, State
from model.arrays import Array

PHASES = 720
"""Phases of a period at which slip is looked for, and once more in the cell of the least margin."""
HARMONICS, FINE = np.arange(1, 64, 2), np.arange(1, 512, 2)
"""Of the lag: odd ones, as a sine and every law of drag are; and so many that those left out are 10^-8 of it."""
NEWTON, SOLVED = 50, 1e-9
"""Most steps of Newton's method for it, and what may be left of its equation, over the flow's acceleration."""
PERIODS, ROUNDS, SETTLED = 3, 50, 1e-9
"""Length of the runs of `mean_error`, the most of them, and when the mean is settled."""


def swing(p: Parameters, amplitude: float, frequency: float, phase: npt.ArrayLike) -> tuple[Array, Array]:
    """omega_c and omega_0 in rad s-1 of RR that has pulsated for long, at phases of the flow in rad, same shape."""
    return _swing(p, amplitude, _lag(p, amplitude, frequency), np.asarray(phase, dtype=float))


def _swing(p: Parameters, amplitude: float, lag: npt.NDArray[np.complex128], phase: Array) -> tuple[Array, Array]:
    omega_0 = p.omega_0 + amplitude * np.sin(phase)
    return omega_0 + np.real(np.exp(1j * phase[..., None] * HARMONICS) @ lag), omega_0


def first_harmonic(p: Parameters, amplitude: float, frequency: float) -> complex:
    """That of omega_c in `swing` over that of omega_0; with Stokes' law `response.transfer` at any amplitude."""
    return complex(1 + 1j * _lag(p, amplitude, frequency, FINE)[0] / amplitude)


def _lag(
    p: Parameters, amplitude: float, frequency: float, harmonics: npt.NDArray[np.int64] = HARMONICS
) -> npt.NDArray[np.complex128]:
    """Complex amplitudes at some harmonics of D = omega_c - omega_0 in rad s-1, where (23) repeats itself.

    D' = -c(R |D|) D/(1+2j) - omega_0', at two phases of half a period for every harmonic. With Stokes' law the first
    step of Newton's method has nothing left to do. Raises ArithmeticError if it doesn't converge.
    """
    turn, inertia = 2 * math.pi * frequency, 1 + 2 * p.j
    phase = np.linspace(0.0, math.pi, 2 * len(harmonics), endpoint=False)
    waves, push = np.exp(1j * phase[:, None] * harmonics), amplitude * turn * np.cos(phase)
    amplitudes = waves.conj().T / len(harmonics)
    derivative = turn * np.real(waves * (1j * harmonics) @ amplitudes)
    rate = drag.coefficient(p.R * amplitude, p) / inertia
    lag = -amplitude * turn * np.real(np.exp(1j * phase) / (rate + 1j * turn))
    for _ in range(NEWTON):
        speed = p.R * np.abs(lag)
        left = derivative @ lag + drag.coefficient(speed, p) * lag / inertia + push
        if np.abs(left).max() <= SOLVED * amplitude * turn:
            return np.asarray(amplitudes @ lag, dtype=np.complex128)
        lag = lag - np.linalg.solve(derivative + drag.slope(speed, p) / inertia * np.eye(len(lag)), left)
    raise ArithmeticError(f"no periodic lag in a pulsation by {amplitude:g} rad s-1 at {frequency:g} Hz")


def slip_onset(p: Parameters, frequency: float, leave_rolling: str = "slip-stability") -> float:
    """The least amplitude in rad s-1 at which slip begins at some phase of the pulsation, frequency > 0 in Hz.

    By the margin of `Settings.leave_rolling` along `swing`. On rough floors and at high frequencies RR is "infeasible"
    at a larger amplitude only. 0 where the mean flow alone ends RR, inf without drag.
    """
    margin = MARGINS[leave_rolling]
    if p.c == 0:
        return math.inf

    def slack(amplitude: float) -> float:
        phases, lag = np.linspace(0.0, 2 * math.pi, PHASES + 1), _lag(p, amplitude, frequency)
        for _ in range(2):
            omega_c, omega_0 = _swing(p, amplitude, lag, phases)
            margins = margin(omega_c, p, omega_0)
            k, cell = int(margins.argmin()), phases[1] - phases[0]
            phases = np.linspace(phases[k] - cell, phases[k] + cell, PHASES + 1)
        return float(margins.min())

    low, high = 0.0, 1e-3 * math.sqrt(p.g / p.R)
    if slack(low) <= 0:
        return 0.0
    while slack(high) > 0:
        low, high = high, 1.25 * high
    return float(brentq(slack, low, high, rtol=1e-12))


def slow_onset(p: Parameters) -> float:
    """Low-frequency limit of `slip_onset`: the flow rises to omega_01 or omega_03, or falls to rest (67)."""
    t = bifurcation.thresholds(p)
    return max(0.0, min((t.omega_01 if p.eta < p.j else t.omega_03) - abs(p.omega_0), abs(p.omega_0)))


def fast_onset(p: Parameters) -> float:
    """The limit of `slip_onset` for high frequencies, at which omega_c stands still and the lag is that of the flow.

    The least of (66), of (73) if the wall can turn the spin at that lag, and of the lag at which both cones are full.
    """
    u, unit = p.R / p.g * p.omega_0**2, p.j / ((1 + 2 * p.j) * p.g)
    k, ju = (1 + p.j) * u, p.j * u
    wall, floor = (
        abs(bound(p, p.omega_0, 1).zero - p.omega_0) for bound in (slip_bounds.rr_to_rs, slip_bounds.rr_to_sr)
    )
    push = drag.coefficient(p.R * floor, p) * p.R * floor
    lags = [wall] if math.hypot(ju, unit * push) > p.eta * u else [wall, floor]
    # B_y = s m g with s^2 + z^2 = eta^2 (k - s)^2 and (ju - s)^2 + z^2 = mu^2 (1 - s)^2; z^2 drops out.
    both = [p.eta**2 - p.mu**2, 2 * (p.mu**2 - p.eta**2 * k - ju), (p.eta * k) ** 2 - p.mu**2 + ju**2]
    for s in np.roots(both):
        if np.isreal(s) and 0 <= s.real <= min(ju, p.eta * k / (1 + p.eta)):
            push = math.sqrt((p.eta * (k - s.real)) ** 2 - s.real**2) / unit
            lags.append(float(drag.speed_of(push, p)) / p.R)
    return min(lags)


def mean_error(p: Parameters, amplitude: float, frequency: float, settled: float = SETTLED) -> float:
    """Mean of omega_c over a period less p.omega_0, rad s-1, once the pulsation is periodic; frequency in Hz.

    0 below `slip_onset`; beyond it, from the event-driven simulation, by the azimuth that the ball runs through. Each
    run starts from where the one before points to (Aitken), until the mean changes by less than `settled`, relative to
    the flow. Raises `SimulationError` if it never does.
    """
    if amplitude <= slip_onset(p, frequency):
        return 0.0
    x, flow = State(omega_c=float(swing(p, amplitude, frequency, 0.0)[0])), Flow.sine(p.omega_0, amplitude, frequency)
    for _ in range(ROUNDS):
        run = simulate(p, x, PERIODS / frequency, flow, sample_interval=1 / frequency)
        before, last = (float(turn) * frequency for turn in np.diff(run.theta)[-2:])
        if abs(last - before) <= settled * abs(p.omega_0):
            return last - p.omega_0
        first, second = (float(step) for step in np.diff(run.omega_c)[-2:])
        ahead = second**2 / (first - second) if abs(second) < abs(first) else 0.0
        x = State(*run.x[-1].tolist())
        x = x._replace(omega_c=x.omega_c + ahead)
    raise SimulationError(f"a pulsation by {amplitude:g} rad s-1 at {frequency:g} Hz doesn't become periodic", run)


def slow_mean_error(p: Parameters, amplitude: float) -> float:
    """The limit of `mean_error` for low frequencies: the mean of the characteristic curve, in RR and SS, over a period.

    Raises `InputError` unless RR ends in SS and the flow stays between rest and the fold.
    """
    end = bifurcation.thresholds(p).omega_01
    top = p.omega_0 + amplitude
    if amplitude > p.omega_0 or p.omega_0 >= end:
        raise InputError(
            f"amplitude = {amplitude:g} rad s-1 about omega_0 = {p.omega_0:g} rad s-1 is out of range: "
            f"the mean flow must be below omega_01 = {end:g} rad s-1, and the flow must not turn back"
        )
    if top <= end:
        return 0.0
    first = math.asin((end - p.omega_0) / amplitude)
    nodes, weights = np.polynomial.legendre.leggauss(32)
    half = math.pi / 2 - first  # the flow is above the end of RR for phases pi/2 ± half
    flows = p.omega_0 + amplitude * np.cos(half * nodes)
    lags = [stationary.solution(p.replace(omega_0=w), Case.SS).state.omega_c - w for w in flows.tolist()]
    return float(half * (weights @ lags) / (2 * math.pi))
