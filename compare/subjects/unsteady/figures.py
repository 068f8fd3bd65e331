"""Unsteady flow: pulsation and when the ball slips, jumps of the flow, ramps past the fold."""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import cache, partial
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter

import analytic
from analytic.bifurcation import diagram as bifurcation
from analytic.flowmeter import pulsation, response
from compare.figures import style
from compare.figures.branches import check_thresholds, slipping, stable_ends
from compare.figures.drawing import Diagram, Evidence, GapError, diagram, only_where
from compare.method.record import Measurement
from compare.subjects.unsteady.measure import RAMP, ROLLS_AT, caught_up, odd_part
from model import Case, Flow, Parameters
from model.arrays import Array

_LASTS = 4.0, 56.0
"""Times shown after a jump: in units of 1/c, and of sqrt(R/g), whichever is shorter."""
FREQUENCIES = 22  # frequencies for which theory computes the onset of slip and the mean error
SHARES = 0.2, 0.4, RAMP[0]
"""Flows of the jumps shown of a ball that slips, as parts of the way to where that ends."""


def _ends_of_slipping(p: Parameters) -> tuple[float, float]:
    """The flows between which balls slip at both points, rad s-1; nan without such."""
    t = bifurcation.thresholds(p)
    return t.omega_01, t.omega_02 if math.isnan(t.omega_04) else t.omega_04


def _slipping(p: Parameters, share: float) -> Parameters:
    """A set with a flow between those ends: a share of the way from the first."""
    low, high = _ends_of_slipping(p)
    return p.replace(omega_0=low + share * (high - low))


def _rolling(of: Diagram) -> Parameters:
    """The set of a figure with the mean flow of its pulsations."""
    usual = of.p.replace(omega_0=ROLLS_AT * stable_ends(of.p)[0])
    return next((m.parameters for m in of.states if m.quantity == "gain"), usual)


@cache
def _theory(p: Parameters) -> tuple[list[float], list[float], list[float]]:
    """Frequencies, amplitudes at which slip begins, mean errors at half as much again."""
    fastest = 0.86 * math.sqrt(p.g / p.R)
    f = np.geomspace(max(0.04 * p.c, fastest / 3e3), fastest, FREQUENCIES).tolist()
    onsets = [pulsation.slip_onset(p, each) for each in f]
    beyond = zip(f, onsets, strict=True)
    return f, onsets, [pulsation.mean_error(p, 1.5 * onset, each) for each, onset in beyond]


def draw_pulsation(of: Diagram) -> tuple[Figure, str]:
    """A figure of pulsations: gain, phase, onset of slip, mean error; and its caption."""
    if not 0 < stable_ends(of.p)[0] < math.inf:
        raise GapError("there is no flow at which two-point rolling ends")
    p = _rolling(of)
    figure, ((gain, onset), (phase, error)) = style.panels(9.0, 5.6, 2, 2, sharex=True)
    frequencies, onsets, errors = _theory(p)
    f = np.geomspace(frequencies[0], frequencies[-1], 400)
    cases = {Case.RR: p} | ({Case.SS: _slipping(of.p, SHARES[1])} if p.eta < p.j else {})
    for case, q in cases.items():
        ratio = response.transfer(q, case, f)
        style.curve(gain, case, f, np.abs(ratio))
        style.curve(phase, case, f, -np.degrees(np.unwrap(np.angle(ratio))))
        k = 330 if case is Case.RR else 60
        style.beside(gain, f[k], abs(ratio[k]), case.name, (0, -8), style.COLOURS[case])
    style.curve(onset, Case.RR, frequencies, onsets)
    slow, fast = pulsation.slow_onset(p), pulsation.fast_onset(p)
    for limit, way, at, shift in (slow, "slow", f[225], 3), (fast, "fast", f[75], -3):
        onset.axhline(limit, **style.GUIDE)
        style.beside(onset, at, limit, f"limit of {way} pulsations", (0, shift))
    error.plot(frequencies, errors, ".-", color=style.COLOURS[Case.SS], lw=1.5, ms=5)
    error.axhline(0, **style.GUIDE)
    panels = {"gain": gain, "phase_lag": phase, "slip_amplitude": onset, "mean_error": error}
    for quantity, axes in panels.items():
        unit = 180 / math.pi if axes is phase else 1.0
        measured = [m for m in of.states if m.quantity == quantity]
        style.points(axes, measured, lambda m: m.at["f"], unit=unit)
    gain.set(xscale="log", yscale="log", ylabel="gain, amplitude of $\\omega_c$ / of $\\omega_0$")
    phase.set(ylabel="phase lag (°)", xlabel="frequency (Hz)")
    onset.set(yscale="log", ylabel="amplitude at which\nslip begins (rad/s)")
    onset.margins(y=0.12)
    error.set(ylabel="mean of $\\omega_c - \\omega_0$ (rad/s)", xlabel="frequency (Hz)")
    style.legend(gain, loc="lower left")
    both = ""
    if Case.SS in cases:
        both = f", and where it slips at both (SS, ω₀ = {cases[Case.SS].omega_0:.3g} rad/s)"
    return figure, style.caption(
        p,
        f"A ball in a flow that pulsates about ω₀ = {p.omega_0:.4g} rad/s. Left: gain and phase "
        f"lag of ω_c, where it rolls at both points (RR){both}. Right: the amplitude of the flow "
        "at which a rolling ball begins to slip, with its limits for slow and fast pulsations. "
        "Beside it: the error of its mean reading at 1.5 times that amplitude (dots: computed).",
        states=of.states,
    )


def draw_unsteady(of: Diagram) -> tuple[Figure, str]:
    """A figure of step responses, ramps, and their overshoot over the rate; and its caption."""
    only_where(of.p, folds=True)
    check_thresholds(of.p)
    figure, (jump, ramp, law) = style.panels(10.0, 3.6, 1, 3)
    _draw_jumps(jump, of)
    measured = [m for m in of.states if m.quantity == "ramp_end"]
    p = measured[0].parameters if measured else _slipping(of.p, SHARES[-1])
    low, fold = _ends_of_slipping(of.p)
    rates = np.array([0.002, 0.01, 0.04]) * p.c * (fold - low)
    passed = _draw_ramps(ramp, of.p, p, rates)
    slow = response.ramp_coefficient(of.p) * rates ** (2 / 3)
    law.loglog(rates, slow, color="0.4", ls="--", label="slow ramps")
    law.plot(rates, passed, color=style.COLOURS[Case.SS], lw=2, label="simulated")
    style.points(law, measured, lambda m: m.at["rate"], lambda m: m.value - fold)
    law.set(xlabel="rate ρ of the ramp (rad/s²)", ylabel="flow beyond $\\omega_{04}$ (rad/s)")
    for axis in (law.xaxis, law.yaxis):
        axis.set_major_locator(LogLocator(subs=(1, 2, 5)))
        axis.set_major_formatter("{x:g}")
        axis.set_minor_formatter(NullFormatter())
    for axes in (ramp, law):
        style.legend(axes, loc="upper left")
    dots = ""
    if of.motions:
        dots = " Dots: mujoco, half the difference of two small jumps, up and down."
    return figure, style.caption(
        of.p,
        "Left: ω_c after a small jump of the flow, divided by its final change. A ball that rolls "
        f"approaches its new reading slowly, one that slips at both points swings.{dots} Middle: "
        "ramps of the flow past the fold ω₀₄. The faster the ramp, the later the ball catches up; "
        "dashed: SS where it is unstable. Right: by how much the flow has passed ω₀₄ when the "
        "ball's lag has halved; dashed: the law of slow ramps, 2.338 (ρ²/(ab))^(1/3).",
        states=measured,
    )


def _draw_jumps(axes: Axes, of: Diagram) -> None:
    """Draw how omega_c changes after a small jump of the flow, rolling and slipping."""
    t = np.linspace(0.0, min(_LASTS[0] / of.p.c, _LASTS[1] * math.sqrt(of.p.R / of.p.g)), 800)
    rolls = response.step_response(_rolling(of), Case.RR, t)
    axes.plot(t, rolls, color=style.COLOURS[Case.RR], lw=2, label="RR")
    slips: dict[str, Any] = {"color": style.COLOURS[Case.SS], "lw": 1.8}
    flows = [_slipping(of.p, share) for share in SHARES]
    flows[0] = next((m.parameters for m in of.states if m.quantity == "jump_height"), flows[0])
    for p, shade in zip(flows, (0.4, 0.7, 1.0), strict=True):
        y = response.step_response(p, Case.SS, t) / response.transfer(p, Case.SS, 0.0).real
        axes.plot(t, y, **slips, alpha=shade, label=f"SS, {p.omega_0:.3g} rad/s")
    if of.motions:
        up, down = (motion.load() for motion in of.motions[-2:])  # with the finer step
        shown = np.flatnonzero(up.time <= t[-1])[::5]
        axes.plot(up.time[shown], odd_part(up, down)[shown], "k.", ms=3.5, label="mujoco")
    axes.set(xlabel="time after the jump (s)", ylabel="change of $\\omega_c$ / final change")
    style.legend(axes)


def _draw_ramps(axes: Axes, whole: Parameters, p: Parameters, rates: Array) -> list[float]:
    """Draw ramps from the flow of p at rates (n,), rad s-2, over the branch of SS of the set; how
    far beyond the fold each has halved the lag, rad s-1."""
    slipping(axes, whole, lambda slip_x, omega_c: omega_c)
    start, last = analytic.solution(p, Case.SS), _slipping(whole, RAMP[1]).omega_0
    (_, fold), passed = _ends_of_slipping(whole), []
    for rate, shade in zip(rates.tolist(), (1.0, 0.65, 0.4), strict=True):
        lasts = (last - p.omega_0) / rate
        flow = Flow.ramp(p.omega_0, last, lasts)
        run = analytic.simulate(p, start.x, lasts, flow, sample_interval=lasts / 5000, rtol=1e-6)
        passed.append(caught_up(run) - fold)
        name = f"rising by {rate:.2g} rad/s²"
        axes.plot(flow(run.time), run.omega_c, "k", alpha=shade, lw=1.5, label=name)
    beyond = np.array([p.omega_0, last])
    style.curve(axes, Case.NR, beyond, beyond, ("NR", (0.9, (-5, 5))))
    axes.set(xlim=beyond, ylim=(0.7 * start.state.omega_c, 1.1 * last))
    axes.set(xlabel=style.OMEGA_0, ylabel=style.OMEGA_C)
    style.guides(axes, {"omega_04": fold})
    return passed


def _measured(protocol: str, evidence: Evidence) -> Iterator[Measurement]:
    """All measurements of a protocol, as a figure takes them."""
    return evidence.records.select(protocol)


_PULSATION = "pulsation-lag", "pulsation-slip", "pulsation-mean"
_JUMPS = "jump-slipping", "ramp-fold"
FIGURES = {
    name: diagram(name, title, "reference", draw, claims, partial(_measured, name))
    for name, title, draw, claims in (
        ("pulsation", "Unsteady flow: pulsation", draw_pulsation, _PULSATION),
        ("unsteady", "Unsteady flow: jumps and ramps", draw_unsteady, _JUMPS),
    )
}
