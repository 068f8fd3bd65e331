"""A designed meter, shown: tables for the terminal, a page, plain data."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from rich import box
from rich.table import Table

from analytic import drag, flowmeter
from analytic.design import THRESHOLDS, Choice, Design, Sensitivity
from analytic.flowmeter import End
from compare import pages
from compare.pages import Rows

SYMBOLS = {"mu": "μ", "eta": "η", "rho_b": "ρ_b", "rho_f": "ρ_f", "nu_f": "ν_f"}
SYMBOLS |= {f"omega_0{k}": f"ω₀{sub}" for k, sub in enumerate("₁₂₃₄", 1)}
UNITS = {"r": "m", "R": "m", "rho_b": "kg/m³", "rho_f": "kg/m³", "nu_f": "m²/s", "gravity": "m/s²"}
_NONE = "–"


def sentences(made: Design) -> list[str]:
    """What the design comes to."""
    chosen, request = made.choice, made.request
    said = [f"Best: {made.material}, {_values(chosen.values)}.", _limit(made)]
    if chosen.margin < 1:
        said.insert(0, f"No meter within the bounds covers the flows up to {request.fastest:g} rad/s.")
    if chosen.limit.end is End.UNLOADING:
        said.append("As meant, every motion beyond it reads the flow, too, but for the ball's fall at unloading.")
    if chosen.margin:
        said.append(
            "The inertia of the fluid, which the model leaves out, would make the limit at worst about "
            f"{_number(made.with_inertia)} rad/s."
        )
    if math.isfinite(chosen.response):
        said.append(f"It follows small changes of the flow with a time constant of {_number(chosen.response)} s.")
    if request.slowest > 0:
        turn, ratio = 2 * math.pi / request.slowest, request.fastest / request.slowest
        said.append(f"At the slowest flow, 1/{_number(ratio)} of the fastest, a turn takes {_number(turn)} s.")
    return [*said, *_warning(made)]


def _limit(made: Design) -> str:
    chosen, fastest = made.choice, made.request.fastest
    if not chosen.margin:
        return f"It has no operating range: {chosen.worst.end.value}."
    covers = f"{_number(chosen.margin)} times the fastest flow, {fastest:g} rad/s"
    limit = f"at worst ω₀ = {_number(chosen.worst.omega_0)} rad/s, {covers} ({_number(chosen.limit.omega_0)} as meant)"
    return f"Rolling at both points is the ball's only lasting motion up to {limit}: there {chosen.worst.end.value}."


def _warning(made: Design) -> list[str]:
    """Whether the law of drag isn't meant for the slips of the characteristic curve."""
    p, curve = made.choice.p, made.curve
    Re = float(np.max(drag.reynolds(p.R * (curve.omega_0 - curve.band[0]), p)))
    if drag.covers(Re, p.drag):
        return []
    return [
        f"Warning: beyond the limit the ball may lag with Re up to {Re:.3g}, for which the law {p.drag!r} isn't meant. "
        "The limit doesn't depend on drag, what is read beyond it does."
    ]


def _materials(made: Design) -> Rows:
    """A column for the best meter of each material that can be used, the best of all first."""
    names, choices = zip(*sorted(made.choices.items(), key=lambda item: -item[1].margin), strict=True)
    numbers: dict[str, list[float]] = {_named(name): [c.values[name] for c in choices] for name in made.choice.values}
    numbers |= {
        "limit at worst (rad/s)": [c.worst.omega_0 for c in choices],
        "limit as meant (rad/s)": [c.limit.omega_0 for c in choices],
        "margin at worst": [c.margin for c in choices],
        "time constant (s)": [c.response for c in choices],
    }
    return [["", *names], *([name, *map(_number, row)] for name, row in numbers.items())]


def _thresholds(made: Design) -> Rows:
    """A row for each threshold: its value, and between which it lies within the tolerances."""
    rows = ([SYMBOLS[k], *map(_number, (getattr(made.thresholds, k), *made.spread[k]))] for k in THRESHOLDS)
    return [["threshold", "as meant (rad/s)", "lowest", "highest"], *rows]


def _sensitivities(made: Design) -> Rows:
    """A row for each value: by how many per cent a threshold, a column each, changes if the value does by one."""
    rows = [["% per %", *(SYMBOLS[key] for key in THRESHOLDS)]]
    for name in made.sensitivities[THRESHOLDS[0]]:
        rows.append([SYMBOLS.get(name, name), *(_sensitivity(made.sensitivities[key][name]) for key in THRESHOLDS)])
    return rows


def _titled(made: Design) -> list[tuple[str, Rows]]:
    return [
        ("The best of each material", _materials(made)),
        ("Thresholds", _thresholds(made)),
        ("Sensitivities", _sensitivities(made)),
    ]


def tables(made: Design) -> list[Table | str]:
    """All of it, for the terminal."""
    shown = [pages.table(title, rows, box=box.HEAVY_HEAD) for title, rows in _titled(made)]
    return [*shown, *(f"{name} can't be used: {why}" for name, why in made.refused.items()), *sentences(made)]


def described(made: Design) -> dict[str, Any]:
    """All of it as plain data; what doesn't exist is nan."""
    curve, request = made.curve, dataclasses.asdict(made.request)
    return {
        "request": request,
        "material": made.material,
        "meter": _choice(made.choice),
        "parameters": dataclasses.asdict(made.choice.p),
        "covers": made.choice.margin >= 1,
        "worst_limit_with_inertia": made.with_inertia,
        "reading_range": flowmeter.reading_range(made.choice.p),
        "unloading_limit": flowmeter.unloading_limit(made.choice.p),
        "materials": {name: _choice(c) for name, c in made.choices.items()},
        "refused": made.refused,
        "thresholds": {
            key: {"value": getattr(made.thresholds, key), "lowest": low, "highest": high}
            for key, (low, high) in made.spread.items()
        },
        "sensitivities": {
            key: {name: dataclasses.asdict(s) for name, s in own.items()} for key, own in made.sensitivities.items()
        },
        "characteristic": {
            "omega_0": curve.omega_0.tolist(),
            "omega_c": {"lowest": curve.meant[0].tolist(), "highest": curve.meant[1].tolist()},
            "within_tolerances": {"lowest": curve.band[0].tolist(), "highest": curve.band[1].tolist()},
        },
    }


def page(made: Design) -> str:
    """All of it as a page that needs nothing but itself."""
    from compare.figures import meter as figures  # here, because drawing takes a second to load
    from compare.report import pictures

    drawn = [(pictures.svg(draw(made)), caption) for draw, caption in figures.FIGURES]
    shown = {"sentences": sentences(made), "tables": _titled(made), "asked": _asked(made), "figures": drawn}
    return pages.render("compare.report", "meter.html", made=made, **shown)


def _asked(made: Design) -> dict[str, str]:
    """The request in words."""
    r, bounds = made.request, made.request.bounds[made.material]
    response = f", time constant up to {r.response:g} s" if math.isfinite(r.response) else ""
    spans = {n: f"{low:g} … {high:g}" if low < high else f"{low:g}" for n, (low, high) in bounds.items()}
    return {
        "fluid": _values(r.fluid),
        "flow": f"ω₀ = {r.slowest:g} … {r.fastest:g} rad/s{response}",
        "bounds": ", ".join(f"{_named(name)} {span}" for name, span in spans.items()),
        "tolerances": ", ".join(f"{SYMBOLS.get(n, n)} ± {100 * t:g} %" for n, t in r.tolerances.items()) or "none",
    }


def _choice(c: Choice) -> dict[str, Any]:
    limits = {
        name: {"omega_0": of.omega_0, "end": of.end.name} for name, of in (("limit", c.limit), ("worst", c.worst))
    }
    return {"values": c.values, **limits, "margin": c.margin, "response": c.response}


def _values(values: Mapping[str, Any]) -> str:
    shown = {n: x if isinstance(x, str) else f"{_number(x)} {UNITS.get(n, '')}".rstrip() for n, x in values.items()}
    return ", ".join(f"{SYMBOLS.get(name, name)} = {text}" for name, text in shown.items())


def _named(name: str) -> str:
    unit = UNITS.get(name)
    return SYMBOLS.get(name, name) + (f" ({unit})" if unit else "")


def _number(x: float) -> str:
    return f"{x:.4g}" if math.isfinite(x) else _NONE


def _sensitivity(s: Sensitivity) -> str:
    return f"{s.value:+.3f}".replace("+0.000", "0").replace("-0.000", "0") if math.isfinite(s.value) else _NONE
