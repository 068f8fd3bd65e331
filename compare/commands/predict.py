"""What theory says about one set of parameters, for `dualball predict`."""

from __future__ import annotations

import argparse
import dataclasses
import json
import math
from collections.abc import Callable, Sequence
from typing import Any

from rich.console import Console
from rich.table import Table

import analytic
from analytic import StationarySolution, drag, fluid_inertia
from compare.commands import options
from compare.statistics import plain
from model import Case, Parameters
from model.drag import REYNOLDS, SCHILLER_NAUMANN
from model.kinematics import UNITS, VARIABLES


def add(commands: options.Commands) -> None:
    """Declare the command."""
    what = "stationary solutions, thresholds and operating range, from theory"
    command = options.command(commands, "predict", run, what)
    options.add_parameters(command)
    options.outputs(command, shown="print JSON instead of tables")


def run(args: argparse.Namespace) -> int:
    """Predict and show."""
    p = options.parameters(args)
    if args.json:
        print(json.dumps(plain(described(p)), indent=1))
    else:
        Console().print(*tables(p), sep="\n")
    return 0


def reading(p: Parameters, attractors: Sequence[StationarySolution]) -> str:
    """What a flowmeter would show, in a sentence."""
    cases = [solution.case for solution in attractors]
    if not cases:
        return "no stationary motion attracts the ball"
    if all(math.isclose(s.state.omega_c, p.omega_0, rel_tol=1e-12, abs_tol=1e-300) for s in attractors):
        return f"the ball goes round with the fluid ({' or '.join(dict.fromkeys(c.name for c in cases))})"
    if len(set(cases) - {Case.SR, Case.NR}) == len(set(cases)) == 1:
        lag = 1 - attractors[0].state.omega_c / p.omega_0
        return f"the ball slips ({cases[0].name}) and lags {lag:.1%} behind the fluid"
    return f"ambiguous: {', '.join(c.name for c in cases)} all attract, the reading depends on the history"


def described(p: Parameters) -> dict[str, Any]:
    """Everything as plain data; what doesn't exist is nan."""
    limit = analytic.operating_limit(p)
    return {
        "parameters": dataclasses.asdict(p),
        "groups": {"kappa": p.kappa, "Omega_0": p.Omega_0},
        "thresholds": dataclasses.asdict(analytic.thresholds(p)),
        "operating_range": limit.omega_0,
        "operating_range_ends": {"by": limit.end.name, "because": limit.end.value},
        "reading_range": analytic.reading_range(p),
        "reading": reading(p, analytic.stable_solutions(p)),
        "fluid_inertia": fluid_inertia.shifts(p) if p.density_ratio else None,
        "solutions": [_solution(solution, p) for solution in analytic.stationary_solutions(p)],
    }


def _solution(s: StationarySolution, p: Parameters) -> dict[str, Any]:
    Re = drag.reynolds_of(s.state, p)
    return {
        "case": s.case.name,
        "Re": Re,
        "drag_law_covers_Re": drag.covers(Re, p.drag) if p.nu_f else None,
        "x": dict(zip(VARIABLES, map(float, s.x), strict=True)),
        "units": dict(zip(VARIABLES, UNITS, strict=True)),
        "force_A": s.force_A.tolist(),
        "force_B": s.force_B.tolist(),
        "eigenvalues": [[float(v.real), float(v.imag)] for v in s.eigenvalues],
        "exists": bool(s.exists),
        "stability": s.stability.value,
        "slip_stable": bool(s.slip_stable),
        "family": list(s.family),
    }


def tables(p: Parameters) -> list[Table | str]:
    """Thresholds, solutions and the reading, for the terminal."""
    look: dict[str, Any] = {"title_justify": "left", "title_style": "bold"}
    head = Table(title="Parameters", show_header=False, box=None, **look)
    for field in p.quantities():
        meta = field.metadata
        unit = "" if meta["unit"] == "1" else meta["unit"]
        head.add_row(meta["symbol"], f"{getattr(p, field.name):.8g} {unit}", f"[dim]{meta['meaning']}")
    head.add_row("drag", p.drag, "[dim]law of drag")
    thresholds, limits = analytic.thresholds(p), Table("", title="Thresholds", **look)
    limits.add_column("value", justify="right")
    limits.add_column("what happens there")
    for name, meaning in _MEANING.items():
        value, unit = getattr(thresholds, name), " rad/s" if name.startswith("omega") else ""
        limits.add_row(_SYMBOLS[name], "does not exist" if math.isnan(value) else f"{value:.12g}{unit}", meaning)
    solutions, attractors = analytic.stationary_solutions(p), analytic.stable_solutions(p)
    attracting, shown = {s.case for s in attractors}, Table("", title="Stationary solutions", **look)
    for s in solutions:
        shown.add_column(s.case.name, justify="right", style="" if s.exists and s.case in attracting else "dim")
    for label, show in _ROWS.items():
        shown.add_row(label, *map(show, solutions))
    if p.nu_f:
        shown.add_row("Re", *(f"{drag.reynolds_of(s.state, p):.4g}" for s in solutions))
    groups = f"[dim]κ = c√(R/g) = {p.kappa:.6g}, Ω₀ = ω₀√(R/g) = {p.Omega_0:.6g}"
    meter = f"Flowmeter at ω₀ = {p.omega_0:g} rad/s: {reading(p, attractors)}; {reach(p)}."
    return [head, groups, limits, shown, meter, *_inertia(p), *_warnings(solutions, p)]


def _inertia(p: Parameters) -> list[str]:
    """What the fluid's inertia would change, if its density is known."""
    if not p.density_ratio:
        return []
    by = fluid_inertia.shifts(p)
    names = {name: _SYMBOLS.get(name, "the rate at which rolling follows the flow") for name in by}
    shifts = ", ".join(f"{names[name]} by {100 * shift:+.2g} %" for name, shift in by.items() if math.isfinite(shift))
    return [f"Left out is the fluid's inertia (added mass, pressure gradient): it would shift {shifts}; not ω₀₃."]


def _warnings(solutions: Sequence[StationarySolution], p: Parameters) -> list[str]:
    """Admissible solutions with a Reynolds number for which the law of drag isn't meant."""
    numbers = {s.case.name: drag.reynolds_of(s.state, p) for s in solutions if s.exists and p.nu_f}
    outside = {case: Re for case, Re in numbers.items() if not drag.covers(Re, p.drag)}
    if not outside:
        return []
    (low, high), (_, most) = REYNOLDS[p.drag], REYNOLDS[SCHILLER_NAUMANN]
    seen = ", ".join(f"{Re:.3g} in {case}" for case, Re in outside.items())
    hint = f" (--drag {SCHILLER_NAUMANN}: up to {most:g})" if p.drag != SCHILLER_NAUMANN else ""
    return [f"[yellow]Warning: Re = {seen}, but the law {p.drag!r} is meant for {low:g} to {high:g}{hint}."]


def reach(p: Parameters) -> str:
    """How far the flowmeter can be used, and why not beyond."""
    limit, reads = analytic.operating_limit(p), analytic.reading_range(p)
    if limit.omega_0 == 0:
        return f"it has no operating range: {limit.end.value}"
    text = f"rolling is its only lasting motion up to ω₀ = {limit.omega_0:.8g} rad/s: there {limit.end.value}"
    return text + "; ω_c = ω₀ holds in every motion, however fast the flow" * math.isinf(reads)


_SYMBOLS = {"omega_01": "ω₀₁", "omega_02": "ω₀₂", "omega_03": "ω₀₃", "omega_04": "ω₀₄", "eta_cr": "η_cr"}
_MEANING = {
    "omega_01": "two-point rolling becomes two-point slipping (P3)",
    "omega_02": "the wall begins to carry the ball (P2; NF2 where η < j)",
    "omega_03": "the floor lets go of the rolling ball (NT1)",
    "omega_04": "two-point slipping ends in a fold (F)",
    "eta_cr": "least wall friction for which there is a fold",
}


_ROWS: dict[str, Callable[[StationarySolution], str]] = {
    "ω_c (rad/s)": lambda s: f"{s.state.omega_c:.8g}",
    "ω̃_x (rad/s)": lambda s: f"{s.state.slip_x:.8g}",
    "ω̃_y (rad/s)": lambda s: f"{s.state.slip_y:.8g}",
    "ω̃_z (rad/s)": lambda s: f"{s.state.slip_z:.8g}",
    "v_y (m/s)": lambda s: f"{s.state.v_y:.6g}",
    "A_y (N)": lambda s: f"{s.force_A[1]:.6g}",
    "B_x (N)": lambda s: f"{s.force_B[0]:.6g}",
    "forces admissible": lambda s: "yes" if s.exists else "no",
    "within the case": lambda s: s.stability.value.removesuffix(" stable"),
    "against slipping": lambda s: "stable" if s.slip_stable else "unstable",
    "rightmost eigenvalue (1/s)": lambda s: (
        f"{s.eigenvalues[0]:.4g}" if s.eigenvalues[0].imag else f"{s.eigenvalues[0].real:.4g}"
    ),
    "free": lambda s: ", ".join(s.family) or "-",
}
