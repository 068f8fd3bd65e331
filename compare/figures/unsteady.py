"""Unsteady flow: how the ball follows a pulsation and when it slips, jumps of the flow, ramps past the fold."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter

import analytic
from analytic import bifurcation, pulsation, response
from compare.figures import style
from compare.figures.bifurcation_diagrams import slipping
from compare.figures.drawing import Material, Motion
from compare.measure.record import Measurement
from compare.measure.unsteady import JUMP, caught_up
from model import Case, Flow, Parameters, Trajectory

SET = "reference"
REFERENCE = Parameters.named(SET)
DECADES = (0.04, 12.0)
"""Frequencies shown, Hz."""
POINTS = 22
"""Frequencies for which theory computes the onset of slip and the mean error."""
FLOWS = (18.0, 25.0, 35.0)
"""Flows about which the jumps of a slipping ball are shown, rad s-1."""
RATES = (0.05, 0.3, 1.0)
"""Rates of the ramps shown, rad s-2."""


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
        own = self.of("gain")
        return own[0].parameters if own else REFERENCE


def select(material: Material, figure: str) -> Measurements:
    """The measurements of a protocol; for the jumps their runs, too."""
    own = tuple(m for m in material.records.measurements if m.protocol == figure and m.set == SET)
    runs = [motion for m in own if m.quantity == "jump_height" for motion in material.motions(m)]
    return Measurements(own, tuple(runs[:2]))


def _at(name: str) -> Callable[[Measurement], float]:
    return lambda m: float(m.conditions[name])


@cache
def _theory(p: Parameters) -> tuple[list[float], list[float], list[float]]:
    """Frequencies, amplitudes at which slip begins, mean errors at half as much again."""
    f = np.geomspace(*DECADES, POINTS).tolist()
    onsets = [pulsation.slip_onset(p, each) for each in f]
    return f, onsets, [pulsation.mean_error(p, 1.5 * a, each, 1e-4) for each, a in zip(f, onsets, strict=True)]


def caption_pulsation(of: Measurements) -> str:
    """Of gain, phase, onset of slip and mean error."""
    p = of.mean
    return (
        f"A ball in a flow that pulsates about ω₀ = {p.omega_0:.4g} rad/s. Left: gain and phase lag of ω_c, where it "
        f"rolls at both points (RR) and, dashed, where it slips at both (SS, about {FLOWS[1]:g} rad/s). Right: the "
        "amplitude of the flow at which a rolling ball begins to slip, with its limits for slow and fast pulsations; "
        f"and the error of its mean reading when the amplitude is half as much again. {style.named(p)}."
        f"{style.marks(of.rows)}"
    )


def draw_pulsation(of: Measurements) -> Figure:
    """Gain, phase, onset, mean error over frequency."""
    p = of.mean
    figure = style.figure(9.0, 5.6)
    (gain, onset), (phase, error) = figure.subplots(2, 2, sharex=True)
    f = np.geomspace(*DECADES, 400)
    for q, case, line in ((p, Case.RR, "-"), (REFERENCE.replace(omega_0=FLOWS[1]), Case.SS, "--")):
        ratio = response.transfer(q, case, f)
        style.curve(gain, case, f, np.abs(ratio), line=line)
        style.curve(phase, case, f, -np.degrees(np.unwrap(np.angle(ratio))), line=line)
        style.name(gain, f[60], abs(ratio[60]), case.name, (0, -8), style.COLOURS[case])
    frequencies, onsets, errors = _theory(p)
    style.curve(onset, Case.RR, frequencies, onsets)
    for limit, text, at, shift in (
        (pulsation.slow_onset(p), "limit of slow pulsations", 1.0, 3),
        (pulsation.fast_onset(p), "limit of fast pulsations", 0.12, -3),
    ):
        onset.axhline(limit, **style.GUIDE)
        style.name(onset, at, limit, text, (0, shift))
    error.plot(frequencies, errors, ".-", color=style.COLOURS[Case.SS], lw=1.5, ms=5)
    error.axhline(0, **style.GUIDE)
    for axes, quantity, unit in (
        (gain, "gain", 1.0),
        (phase, "phase_lag", 180 / math.pi),
        (onset, "slip_amplitude", 1.0),
        (error, "mean_error", 1.0),
    ):
        style.points(axes, of.of(quantity), _at("f"), unit=unit)
    gain.set(xscale="log", yscale="log", ylabel="gain $|\\omega_c/\\omega_0|$")
    phase.set(ylabel="phase lag (°)", xlabel="frequency (Hz)")
    onset.set(yscale="log", ylabel="amplitude at which\nslip begins (rad/s)")
    onset.margins(y=0.12)
    error.set(ylabel="mean of $\\omega_c - \\omega_0$ (rad/s)", xlabel="frequency (Hz)")
    style.legend(gain, loc="lower left")
    return figure


def caption_unsteady(of: Measurements) -> str:
    """Of jumps and ramps."""
    measured = f" Dots: MuJoCo, half the difference of two jumps by {JUMP:.1%}, up and down." if of.runs else ""
    return (
        "Left: ω_c after a small jump of the flow, over its change in the end; a ball that rolls creeps to its new "
        f"reading, one that slips at both points rings.{measured} Middle: ramps past the fold, faster ones catch up "
        "with the flow later. Right: by how much a ramp passes ω₀₄ until the ball lags by half as much as at first, "
        f"dashed the law of slow ramps, 2.338 (ρ²/(ab))^(1/3). {style.named(REFERENCE)}."
        f"{style.marks(of.of('ramp_end'))}"
    )


def draw_unsteady(of: Measurements) -> Figure:
    """Step responses, ramps, overshoot over rate."""
    figure = style.figure(10.0, 3.6)
    jump, ramp, law = figure.subplots(1, 3)
    _jumps(jump, of)
    ends = of.of("ramp_end")
    p = ends[0].parameters if ends else REFERENCE.replace(omega_0=34.9)
    runs = {rate: _ramp(p, rate) for rate in RATES}
    _ramps(ramp, runs)
    _law(law, runs, ends)
    return figure


def _jumps(axes: Axes, of: Measurements) -> None:
    t = np.linspace(0.0, 4.0, 800)
    axes.plot(t, response.step_response(REFERENCE, Case.RR, t), color=style.COLOURS[Case.RR], lw=2, label="RR")
    measured = of.of("jump_height")
    flows = [*FLOWS[1:], measured[0].parameters.omega_0 if measured else FLOWS[0]]
    for omega_0, shade in zip(sorted(flows), (0.4, 0.7, 1.0), strict=True):
        p = REFERENCE.replace(omega_0=omega_0)
        y = response.step_response(p, Case.SS, t) / response.transfer(p, Case.SS, 0.0).real
        axes.plot(t, y, color=style.COLOURS[Case.SS], alpha=shade, lw=1.8, label=f"SS, {omega_0:.3g} rad/s")
    if len(of.runs) == 2:
        up, down = (motion.load() for motion in of.runs)
        y, shown = (up.omega_c - down.omega_c) / (up.omega_c - down.omega_c)[-1], up.time <= t[-1]
        axes.plot(up.time[shown][::5], y[shown][::5], "k.", ms=3.5, label="MuJoCo")
    axes.set(xlabel="time after the jump (s)", ylabel="change of $\\omega_c$, 1 in the end")
    style.legend(axes)


def _ramp(p: Parameters, rate: float) -> Trajectory:
    """Theory's motion from slipping to well past the fold."""
    span = 15.0
    flow, interval = Flow.ramp(p.omega_0, p.omega_0 + span, span / rate), span / rate / 5000
    return analytic.simulate(p, analytic.solution(p, Case.SS).x, span / rate, flow, sample_interval=interval)


def _ramps(axes: Axes, runs: Mapping[float, Trajectory]) -> None:
    end = bifurcation.thresholds(REFERENCE).omega_04
    slipping(axes, REFERENCE, lambda slip_x, omega_c: omega_c, unstable=(0.2, (-4, 6)))
    for (rate, run), shade in zip(runs.items(), (1.0, 0.65, 0.4), strict=True):
        flow, label = run.header.flow(run.time), f"rising by {rate:g} rad/s²"
        axes.plot(flow, run.omega_c, color="black", alpha=shade, lw=1.5, label=label)
    beyond = np.array([end - 6, end + 7])
    style.curve(axes, Case.NR, beyond, beyond, "NR", (0.9, (-5, 5)))
    axes.set(xlim=beyond, ylim=(15, 55), xlabel=style.OMEGA_0, ylabel=style.OMEGA_C)
    style.guides(axes, {"omega_04": end})
    style.legend(axes, loc="upper left")


def _law(axes: Axes, runs: Mapping[float, Trajectory], ends: list[Measurement]) -> None:
    end, K = bifurcation.thresholds(REFERENCE).omega_04, response.ramp_coefficient(REFERENCE)
    rates = np.array([*runs])
    axes.loglog(rates, K * rates ** (2 / 3), color="0.4", ls="--", label="slow ramps")
    passed = [caught_up(run) - end for run in runs.values()]
    axes.plot(rates, passed, color=style.COLOURS[Case.SS], lw=2, label="simulated")
    style.points(axes, ends, _at("rate"), lambda m: m.value - end)
    axes.set(xlabel="rate ρ of the ramp (rad/s²)", ylabel="flow beyond $\\omega_{04}$ (rad/s)", yticks=[0.5, 1, 2, 5])
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_formatter("{x:g}")
        axis.set_minor_formatter(NullFormatter())
    style.legend(axes, loc="upper left")
