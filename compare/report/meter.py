"""A designed meter, shown: tables for the terminal, a page, plain data."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from rich.table import Table

from analytic.flowmeter import characteristic as flowmeter
from analytic.flowmeter import real_fluid
from analytic.flowmeter.characteristic import End
from analytic.flowmeter.design import THRESHOLDS, Choice, Design
from analytic.mechanics import drag
from compare.figures import pages
from compare.figures.validity import model_warning, torque_left_out
from compare.method.quantities import QUANTITIES

SYMBOLS = {"mu": "μ", "eta": "η", "rho_b": "ρ_b", "rho_f": "ρ_f", "nu_f": "ν_f"}
SYMBOLS |= {key: QUANTITIES[key].symbol for key in THRESHOLDS}
UNITS = {"r": "m", "R": "m", "rho_b": "kg/m³", "rho_f": "kg/m³", "nu_f": "m²/s", "gravity": "m/s²"}
MEANING = {
    "omega_01": "two-point rolling becomes two-point slipping",
    "omega_02": "the wall begins to carry the ball",
    "omega_03": "the floor lets go of the rolling ball",
    "omega_04": "two-point slipping ends in a fold",
    "eta_cr": "least wall friction for which there is a fold",
}
"""What happens at a threshold."""
AT_WALLS = (
    "Left out is what walls add to drag: in slow flow a wall that the ball touches makes c about "
    f"{real_fluid.AT_A_WALL:.2g} times as large, and η_cr {real_fluid.AT_A_WALL**2:.2g} times."
)


def rounded(value: float, off: float = 0.0, most: int = 4) -> str:
    """A number as text: at most `most` digits, beyond the third none that `off` makes doubtful.

    With fewer than three what differs by half would look alike."""
    if not math.isfinite(value):
        return "–"
    if abs(value) < 1e-15:  # round-off
        return "0"
    digits = most
    if off:
        size, error = (math.floor(math.log10(x)) for x in (abs(value), abs(value) * off))
        digits = min(most, max(3, size - error + 1))
    return f"{float(f'{value:.{digits}g}'):.{max(most, 6)}g}"


def sentences(made: Design) -> list[str]:
    chosen, request, curve, off, said = made.choice, made.request, made.curve, made.model_error, []
    if chosen.margin < 1:
        said.append(f"No meter within the bounds covers the flows up to {request.fastest:g} rad/s.")
    said.append(f"Best: {made.material}, {_values_as_text(chosen.values)}.")
    if chosen.margin:
        said.append(
            "Rolling at both points is the ball's only lasting motion up to at worst ω₀ = "
            f"{rounded(chosen.worst.omega_0, off)} rad/s, {rounded(chosen.margin, off)} times the "
            f"fastest flow, {request.fastest:g} rad/s ({rounded(chosen.limit.omega_0, off)} "
            f"nominally): there {chosen.worst.end.value}."
        )
    else:
        said.append(f"It has no operating range: {chosen.worst.end.value}.")
    if chosen.limit.end is End.UNLOADING:
        said.append(
            "Nominally, every motion beyond it reads the flow, too, but for the ball's fall at "
            "unloading."
        )
    if chosen.margin:
        said.append(
            "The inertia of the fluid, which the model leaves out, would make the limit at worst "
            f"about {rounded(made.with_inertia, off)} rad/s."
        )
    if math.isfinite(chosen.response):
        said.append(
            f"It follows small changes of the flow with a time constant of "
            f"{rounded(chosen.response, off)} s."
        )
    if request.slowest > 0:
        turn, ratio = 2 * math.pi / request.slowest, request.fastest / request.slowest
        said.append(
            f"At the slowest flow, 1/{rounded(ratio)} of the fastest, a turn takes {rounded(turn)} "
            f"s."
        )
    said += [torque_left_out(chosen.p.replace(omega_0=request.fastest)), AT_WALLS]
    p = chosen.p
    Re = float(np.max(drag.reynolds(p.R * (curve.omega_0 - curve.band[0]), p)))
    if not drag.covers(Re, p.drag):
        said.append(
            f"Warning: beyond the limit the ball may lag with Re up to {Re:.3g}, for which the law "
            f"{p.drag!r} isn't "
            "meant. The limit doesn't depend on drag, what is read beyond it does."
        )
    return said


def rows(made: Design) -> dict[str, pages.Rows]:
    """Tables of a design: the best meter of each material, thresholds, sensitivities."""
    off = made.model_error
    best = dict(sorted(made.choices.items(), key=lambda item: -item[1].margin))
    numbers = {
        "limit at worst (rad/s)": [c.worst.omega_0 for c in best.values()],
        "nominal limit (rad/s)": [c.limit.omega_0 for c in best.values()],
        "margin at worst": [c.margin for c in best.values()],
        "time constant (s)": [c.response for c in best.values()],
    }
    limits = {name: [rounded(x, off) for x in row] for name, row in numbers.items()}
    values = {
        _symbol_and_unit(name): [rounded(c.values[name]) for c in best.values()]
        for name in made.choice.values
    }
    sensitivities = [["% per %", *(SYMBOLS[key] for key in THRESHOLDS)]]
    for name in made.sensitivities[THRESHOLDS[0]]:
        slopes = [made.sensitivities[key][name].value for key in THRESHOLDS]
        # Differences of two widths leave 1e-4 of what should be zero.
        shown = ("0" if abs(value) < 5e-4 else rounded(value, off) for value in slopes)
        sensitivities.append([SYMBOLS.get(name, name), *shown])
    meters = [["", *best], *([name, *row] for name, row in (values | limits).items())]
    thresholds = [["threshold", "nominal (rad/s)", "lowest", "highest", "what happens there"]]
    for key in THRESHOLDS:
        spread = getattr(made.thresholds, key), *made.spread[key]
        thresholds.append([SYMBOLS[key], *(rounded(x, off) for x in spread), MEANING[key]])
    return {
        "The best of each material": meters,
        "Thresholds": thresholds,
        "Sensitivities": sensitivities,
    }


def tables(made: Design) -> list[Table | str]:
    shown = [pages.table(title, own) for title, own in rows(made).items()]
    refused = [f"{name} can't be used: {why}" for name, why in made.refused.items()]
    return [*model_warning(made.model_error), *shown, *refused, *sentences(made)]


def described(made: Design) -> dict[str, Any]:
    """A design as plain data; what doesn't exist is nan."""

    def meter_data(c: Choice) -> dict[str, Any]:
        limits = {"limit": c.limit, "worst": c.worst}
        ends = {name: {"omega_0": of.omega_0, "end": of.end.name} for name, of in limits.items()}
        return {"values": c.values, **ends, "margin": c.margin, "response": c.response}

    curve, p, ends = made.curve, made.choice.p, ("lowest", "highest")
    return {
        "request": made.request,
        "material": made.material,
        "meter": meter_data(made.choice),
        "parameters": p,
        "covers": made.choice.margin >= 1,
        "model_error": made.model_error,
        "model_holds": made.model_error <= real_fluid.LIMIT,
        "worst_limit_with_inertia": made.with_inertia,
        "reading_range": flowmeter.reading_range(p),
        "unloading_limit": flowmeter.unloading_limit(p),
        "materials": {name: meter_data(c) for name, c in made.choices.items()},
        "refused": made.refused,
        "thresholds": {
            key: {"value": getattr(made.thresholds, key), **dict(zip(ends, of, strict=True))}
            for key, of in made.spread.items()
        },
        "sensitivities": made.sensitivities,
        "characteristic": {
            "omega_0": curve.omega_0,
            "omega_c": dict(zip(ends, curve.meant, strict=True)),
            "within_tolerances": dict(zip(ends, curve.band, strict=True)),
        },
    }


def page(made: Design) -> str:
    """A design as a self-contained page, in HTML."""
    from compare.figures.pictures import embedded, svg  # here, because drawing is slow to load
    from compare.subjects.flowmeter.figures import OF_A_METER

    r, bounds = made.request, made.request.bounds[made.material]
    response = f", time constant up to {r.response:g} s" if math.isfinite(r.response) else ""
    spans = {
        n: f"{low:g} … {high:g}" if low < high else f"{low:g}" for n, (low, high) in bounds.items()
    }
    tolerances = (f"{SYMBOLS.get(n, n)} ± {100 * t:g} %" for n, t in r.tolerances.items())
    asked = {
        "fluid": _values_as_text(r.fluid),
        "flow": f"ω₀ = {r.slowest:g} … {r.fastest:g} rad/s{response}",
        "bounds": ", ".join(f"{_symbol_and_unit(name)} {span}" for name, span in spans.items()),
        "tolerances": ", ".join(tolerances) or "none",
    }
    drawn = (draw(made) for draw in OF_A_METER)
    figures, letters = embedded({caption: svg(figure) for figure, caption in drawn})
    return pages.render(
        "compare.report",
        "meter.html",
        made=made,
        doubts=model_warning(made.model_error),
        sentences=sentences(made),
        tables=rows(made).items(),
        asked=asked,
        figures=figures,
        letters=letters,
    )


def _values_as_text(values: Mapping[str, Any]) -> str:
    shown = {
        n: x if isinstance(x, str) else f"{rounded(x)} {UNITS.get(n, '')}".rstrip()
        for n, x in values.items()
    }
    return ", ".join(f"{SYMBOLS.get(name, name)} = {text}" for name, text in shown.items())


def _symbol_and_unit(name: str) -> str:
    return SYMBOLS.get(name, name) + (f" ({UNITS[name]})" if name in UNITS else "")
