"""Characteristic curves of the flowmeter, with all settled states that were measured."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

import analytic
from compare.figures import style
from compare.figures.drawing import GapError, Material
from compare.figures.flow_curve import Curve, fold_curve, plain_curve, top
from compare.measure.record import Measurement
from compare.runs.engines import NEWCOMER
from model import Parameters

SETS = ("reference", "high-wall-friction")
_LEAST = 1e-16
"""Smaller deviations are drawn here."""
_SETTLED = frozenset({"settled", "newcomer", "hysteresis"})
"""Protocols whose omega_c is that of a settled state."""


def select(material: Material) -> tuple[Curve, ...]:
    """The settled states of every engine with the two sets of the paper's kind, without balls that only sink (NS)."""
    settled = [
        m
        for m in material.select("omega_c", case=None)
        if m.protocol in _SETTLED and m.parameters.omega_0 > 0 and m.conditions["case"] != "NS"
    ]
    curves = tuple(Curve(Parameters.named(name), tuple(m for m in settled if m.set == name)) for name in SETS)
    if not any(curve.states for curve in curves):
        raise GapError("no settled states were measured with its parameter sets")
    return curves


def caption(curves: tuple[Curve, ...]) -> str:
    """Of the characteristic curves."""
    sets = "; ".join(f"{'left' if k == 0 else 'right'}: {style.named(curve.p)}" for k, curve in enumerate(curves))
    count = sum(len(curve.states) for curve in curves)
    poor = any(m.engine == NEWCOMER.name for curve in curves for m in curve.states)
    crosses = ", crosses: MuJoCo's own contact parameters from rest" if poor else ""
    return (
        f"Angular velocity ω_c of the ball's orbit over that of the fluid, ω₀; {sets}. Lines: closed-form theory, "
        f"dashed where unstable; SR and NR lie on one line. Marks: {count} settled states, from rest, going round "
        f"with the fluid, and high up on the wall{crosses}. Bars of three standard uncertainties are smaller than most "
        "marks. Below: relative deviation from the nearest attracting solution; what is below 1e-16 is drawn there."
    )


def draw(curves: tuple[Curve, ...]) -> Figure:
    """Two columns, one a parameter set: the curve above, deviations below."""
    figure = style.figure(10, 6)
    panels = figure.subplots(2, len(curves), sharex="col", squeeze=False, height_ratios=[3, 1.2])
    for (above, below), curve in zip(panels.T, curves, strict=True):
        p = curve.p
        fastest = max([m.parameters.omega_0 for m in curve.states], default=top(p)) * 1.04
        (fold_curve if p.eta < p.j else plain_curve)(above, p, fastest)
        above.set_title(f"η = {p.eta:g} {'<' if p.eta < p.j else '>'} j = {p.j:g}", fontsize=11)
        for engine in dict.fromkeys(m.engine for m in curve.states):
            off = [(m.parameters.omega_0, max(_deviation(m), _LEAST)) for m in curve.states if m.engine == engine]
            below.plot(*zip(*off, strict=True), ls="none", ms=5, **style.mark_of(engine))
        style.points(above, curve.states)
        above.set(ylim=(0, 1.05 * max([fastest, *(m.value for m in curve.states)])), ylabel=style.OMEGA_C)
        style.legend(above, loc="upper left", frameon=False)
        style.dimensionless_x(above, p)
        below.set(xlabel=style.OMEGA_0, ylabel="$|\\Delta\\omega_c| / \\omega_c$", yscale="log", ylim=(_LEAST / 10, 10))
        for axes in (above, below):
            axes.grid(alpha=0.25)
    return figure


def _deviation(m: Measurement) -> float:
    near = [float(abs(m.value / s.state.omega_c - 1)) for s in analytic.stable_solutions(m.parameters)]
    return min(near, default=np.nan)
