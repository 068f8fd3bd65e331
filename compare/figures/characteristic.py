"""Characteristic curves of the flowmeter (Fig. 13): theory as lines, measured stationary states as points."""

from __future__ import annotations

import functools

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import analytic
from compare import stationary
from compare.figures import style
from compare.results import Summary
from model import Case, Parameters

CAPTION = (
    "Characteristic curves (Fig. 13 of the paper): orbital angular velocity of the ball over that of the fluid. Lines: "
    "closed-form theory, dashed where unstable. Points: simulated stationary states, with error bars of three standard "
    "uncertainties (smaller than the marks). Below: relative deviation of each point."
)
STATIONARY = frozenset(claim.id for claim in stationary.CLAIMS)
"""Claims on stationary states alone: in others ω_c may still be on its way."""
_SHOWN = (Case.RR, Case.SR, Case.SS, Case.NR)
"""Cases whose stationary states a flowmeter may be in."""
_TOP = 45.0
"""Fastest fluid shown, rad s-1."""


def draw(summary: Summary, sets: tuple[str, ...] = ("reference", "high-wall-friction")) -> Figure:
    """Two columns, one a parameter set: the curve above, deviations below."""
    figure = style.figure(10, 6)
    axes = figure.subplots(2, len(sets), sharex="col", squeeze=False, height_ratios=[3, 1])
    for (curve, deviation), name in zip(axes.T, sets, strict=True):
        p = Parameters.named(name)
        _theory(curve, p)
        _points(curve, deviation, summary, name)
        relation = "<" if p.eta < p.j else ">"
        curve.set_title(f"{name}: η = {p.eta:g} {relation} j = {p.j:g}", fontsize=11)
        curve.set_ylabel(style.OMEGA_C)
        curve.legend(fontsize=8, frameon=False, loc="upper left")
        deviation.set_xlabel(style.OMEGA_0)
        deviation.set_ylabel("$|\\Delta\\omega_c| / \\omega_c$")
        deviation.set_yscale("log")
        deviation.set_ylim(1e-17, 1e-5)
        deviation.grid(alpha=0.3)
        curve.grid(alpha=0.3)
    return figure


def _theory(axes: Axes, p: Parameters) -> None:
    """The branches of stationary solutions over omega_0."""
    for (case, stable, _), points in _branches(p).items():
        x, y = np.transpose(points)
        label = f"{case.name}{'' if stable else ', unstable'}"
        line = (0, (1, 1.5)) if case is Case.NR else style.STABLE if stable else style.UNSTABLE  # NR lies upon SR
        axes.plot(x, y, color=style.COLOURS[case], lw=1.8, ls=line, label=label, zorder=2 if case is Case.NR else 1)
    thresholds = analytic.thresholds(p)
    for k in range(1, 5):
        value = getattr(thresholds, f"omega_0{k}")
        if np.isfinite(value) and value < _TOP:
            axes.axvline(value, color="0.6", lw=0.8, ls=":")
            axes.annotate(
                f"ω₀{'₁₂₃₄'[k - 1]}", (value, 0.02), xycoords=("data", "axes fraction"), fontsize=8, color="0.35"
            )


@functools.cache
def _branches(p: Parameters) -> dict[tuple[Case, bool, int], list[tuple[float, float]]]:
    """Points (omega_0, omega_c) of each branch, by case, stability, and number among several of a case."""
    limits = [v for k in range(1, 5) if np.isfinite(v := getattr(analytic.thresholds(p), f"omega_0{k}")) and v < _TOP]
    # Branches begin and end at thresholds, the fold with a vertical tangent.
    near = [limit * (1 + side * 10.0**-k) for limit in limits for side in (-1, 1) for k in (2, 3, 4, 6)]
    branches: dict[tuple[Case, bool, int], list[tuple[float, float]]] = {}
    for omega_0 in np.sort([*np.linspace(0.5, _TOP, 50), *near]):
        seen: dict[Case, int] = {}
        for solution in analytic.stationary_solutions(p.replace(omega_0=float(omega_0))):
            if solution.case not in _SHOWN or not solution.exists:
                continue
            index = seen[solution.case] = seen.get(solution.case, -1) + 1
            key = (solution.case, solution.stable, index)
            branches.setdefault(key, []).append((float(omega_0), float(solution.x[2])))
    return branches


def _points(curve: Axes, deviation: Axes, summary: Summary, name: str) -> None:
    for case in _SHOWN:
        checks = [
            check
            for claim in sorted(STATIONARY & set(summary.verdicts))
            for check in summary.verdicts[claim]["checks"]
            if check["quantity"] == "ω_c" and check["parameters"] == name and check["case_found"] == case.name
        ]
        if not checks:
            continue
        x, y, u = (np.array([check[key] for check in checks]) for key in ("omega_0", "measured", "uncertainty"))
        relative = np.array([abs(check["error"] / check["predicted"]) for check in checks])
        curve.errorbar(
            x, y, yerr=3 * u, label=f"{case.name}, MuJoCo", capsize=2, zorder=2,
            color=style.COLOURS[case], marker=style.MARKERS[case], ls="none", ms=6, mfc="none",
        )  # fmt: skip
        deviation.plot(
            x, np.maximum(relative, 1e-16), color=style.COLOURS[case], marker=style.MARKERS[case], ls="none", mfc="none"
        )
