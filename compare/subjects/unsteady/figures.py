"""Unsteady flow: how the ball follows a pulsation and when it slips, jumps of the flow, ramps past the fold."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache, partial

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter

import analytic
from analytic.bifurcation import diagram as bifurcation
from analytic.flowmeter import pulsation, response
from compare.branches import slipping
from compare.kit import style
from compare.kit.drawing import Drawing, Evidence, Motion
from compare.kit.record import Measurement
from compare.subjects.unsteady.measure import caught_up, odd_part
from model import Case, Flow, Parameters

SET = "reference"
REFERENCE = Parameters.named(SET)
DECADES = (0.04, 12.0)
"""Frequencies shown, Hz."""
FREQUENCIES = 22
"""Frequencies for which theory computes the onset of slip and the mean error."""
FLOWS = (18.0, 25.0, 35.0)
"""Flows about which the jumps of a slipping ball are shown, rad s-1."""


@dataclass(frozen=True)
class Measurements:
    """What was measured on the set that is shown, and the runs after a jump of a ball that slips, up and down."""

    rows: tuple[Measurement, ...] = ()
    runs: tuple[Motion, ...] = ()

    def of(self, quantity: str) -> list[Measurement]:
        """Those of one quantity."""
        return [m for m in self.rows if m.quantity == quantity]

    @property
    def mean(self) -> Parameters:
        """The set, with the mean flow of the pulsations."""
        return next((m.parameters for m in self.of("gain")), REFERENCE)


def select(evidence: Evidence, figure: str) -> Measurements:
    """The measurements of a protocol; for the jumps their runs with the finer step, too."""
    own = tuple(m for m in evidence.records.measurements if m.protocol == figure and m.set == SET)
    runs = [motion for m in own if m.quantity == "jump_height" for motion in evidence.motions(m)[-2:]]
    return Measurements(own, tuple(runs[:2]))


@cache
def _theory(p: Parameters) -> tuple[list[float], list[float], list[float]]:
    """Frequencies, amplitudes at which slip begins, mean errors at half as much again."""
    f = np.geomspace(*DECADES, FREQUENCIES).tolist()
    onsets = [pulsation.slip_onset(p, each) for each in f]
    return f, onsets, [pulsation.mean_error(p, 1.5 * a, each, 1e-4) for each, a in zip(f, onsets, strict=True)]


def draw_pulsation(of: Measurements) -> tuple[Figure, str]:
    """Gain, phase, onset, mean error over frequency."""
    p = of.mean
    figure, ((gain, onset), (phase, error)) = style.panels(9.0, 5.6, 2, 2, sharex=True)
    f = np.geomspace(*DECADES, 400)
    for q, case in ((p, Case.RR), (REFERENCE.replace(omega_0=FLOWS[1]), Case.SS)):
        ratio = response.transfer(q, case, f)
        style.curve(gain, case, f, np.abs(ratio))
        style.curve(phase, case, f, -np.degrees(np.unwrap(np.angle(ratio))))
        style.name(gain, f[60], abs(ratio[60]), case.name, (0, -8), style.COLOURS[case])
    frequencies, onsets, errors = _theory(p)
    style.curve(onset, Case.RR, frequencies, onsets)
    for limit, way, at, shift in (pulsation.slow_onset(p), "slow", 1.0, 3), (pulsation.fast_onset(p), "fast", 0.12, -3):
        onset.axhline(limit, **style.GUIDE)
        style.name(onset, at, limit, f"limit of {way} pulsations", (0, shift))
    error.plot(frequencies, errors, ".-", color=style.COLOURS[Case.SS], lw=1.5, ms=5)
    error.axhline(0, **style.GUIDE)
    panels = {"gain": gain, "phase_lag": phase, "slip_amplitude": onset, "mean_error": error}
    for quantity, axes in panels.items():
        unit = 180 / math.pi if axes is phase else 1.0
        style.points(axes, of.of(quantity), lambda m: float(m.conditions["f"]), unit=unit)
    gain.set(xscale="log", yscale="log", ylabel="gain, amplitude of $\\omega_c$ / of $\\omega_0$")
    phase.set(ylabel="phase lag (°)", xlabel="frequency (Hz)")
    onset.set(yscale="log", ylabel="amplitude at which\nslip begins (rad/s)")
    onset.margins(y=0.12)
    error.set(ylabel="mean of $\\omega_c - \\omega_0$ (rad/s)", xlabel="frequency (Hz)")
    style.legend(gain, loc="lower left")
    return figure, style.caption(
        of.mean,
        f"A ball in a flow that pulsates about ω₀ = {of.mean.omega_0:.4g} rad/s. Left: gain and phase lag of ω_c, "
        f"where it rolls at both points (RR) and where it slips at both (SS, ω₀ = {FLOWS[1]:g} rad/s). "
        "Right: the amplitude of the flow at which a rolling ball begins to slip, with its limits for slow and fast "
        "pulsations; and the error of its mean reading when the amplitude is 1.5 times that (dots: computed).",
        states=of.rows,
    )


def draw_unsteady(of: Measurements) -> tuple[Figure, str]:
    """Step responses, ramps, overshoot over rate."""
    figure, (jump, ramp, law) = style.panels(10.0, 3.6, 1, 3)
    t = np.linspace(0.0, 4.0, 800)
    jump.plot(t, response.step_response(REFERENCE, Case.RR, t), color=style.COLOURS[Case.RR], lw=2, label="RR")
    slowest = next((m.parameters.omega_0 for m in of.of("jump_height")), FLOWS[0])
    for omega_0, shade in zip(sorted([slowest, *FLOWS[1:]]), (0.4, 0.7, 1.0), strict=True):
        p = REFERENCE.replace(omega_0=omega_0)
        y = response.step_response(p, Case.SS, t) / response.transfer(p, Case.SS, 0.0).real
        jump.plot(t, y, color=style.COLOURS[Case.SS], alpha=shade, lw=1.8, label=f"SS, {omega_0:.3g} rad/s")
    if len(of.runs) == 2:
        up, down = (motion.load() for motion in of.runs)
        shown = np.flatnonzero(up.time <= t[-1])[::5]
        jump.plot(up.time[shown], odd_part(up, down)[shown], "k.", ms=3.5, label="mujoco")
    jump.set(xlabel="time after the jump (s)", ylabel="change of $\\omega_c$ / final change")
    style.legend(jump)
    ends, fold = of.of("ramp_end"), bifurcation.thresholds(REFERENCE).omega_04
    p = ends[0].parameters if ends else REFERENCE.replace(omega_0=34.9)
    slipping(ramp, REFERENCE, lambda slip_x, omega_c: omega_c, unstable=(0.2, (-4, 6)))
    rates, passed, start = np.array([0.05, 0.3, 1.0]), [], analytic.solution(p, Case.SS).x
    for rate, shade in zip(rates.tolist(), (1.0, 0.65, 0.4), strict=True):
        lasts = 15.0 / rate
        flow = Flow.ramp(p.omega_0, p.omega_0 + 15.0, lasts)
        run = analytic.simulate(p, start, lasts, flow, sample_interval=lasts / 5000, rtol=1e-6)
        passed.append(caught_up(run) - fold)
        ramp.plot(flow(run.time), run.omega_c, "k", alpha=shade, lw=1.5, label=f"rising by {rate:g} rad/s²")
    beyond = np.array([fold - 6, fold + 7])
    style.curve(ramp, Case.NR, beyond, beyond, "NR", (0.9, (-5, 5)))
    ramp.set(xlim=beyond, ylim=(15, 55), xlabel=style.OMEGA_0, ylabel=style.OMEGA_C)
    style.guides(ramp, {"omega_04": fold})
    law.loglog(rates, response.ramp_coefficient(REFERENCE) * rates ** (2 / 3), color="0.4", ls="--", label="slow ramps")
    law.plot(rates, passed, color=style.COLOURS[Case.SS], lw=2, label="simulated")
    style.points(law, ends, lambda m: float(m.conditions["rate"]), lambda m: m.value - fold)
    law.set(xlabel="rate ρ of the ramp (rad/s²)", ylabel="flow beyond $\\omega_{04}$ (rad/s)", yticks=[0.5, 1, 2, 5])
    for axis in (law.xaxis, law.yaxis):
        axis.set_major_formatter("{x:g}")
        axis.set_minor_formatter(NullFormatter())
    for axes in (ramp, law):
        style.legend(axes, loc="upper left")
    measured = " Dots: mujoco, half the difference of two small jumps, up and down." if of.runs else ""
    return figure, style.caption(
        REFERENCE,
        "Left: ω_c after a small jump of the flow, divided by its final change; a ball that rolls approaches its "
        f"new reading slowly, one that slips at both points swings.{measured} Middle: ramps of the flow past the fold "
        "ω₀₄; the faster the ramp, the later the ball catches up. Right: by how much the flow has passed ω₀₄ when the "
        "ball's lag has halved; dashed: the law of slow ramps, 2.338 (ρ²/(ab))^(1/3).",
        states=of.of("ramp_end"),
    )


_PULSATION = ("pulsation-lag", "pulsation-slip", "pulsation-mean")
FIGURES = {
    name: Drawing(f"Unsteady flow: {title}", partial(select, figure=name), draw, claims)
    for name, title, draw, claims in (
        ("pulsation", "pulsation", draw_pulsation, _PULSATION),
        ("unsteady", "jumps and ramps", draw_unsteady, ("jump-slipping", "ramp-fold")),
    )
}
