"""``dualball predict``: what theory says about one set of parameters."""

from __future__ import annotations

import argparse
import dataclasses
import json
import math
from collections.abc import Callable
from typing import Any

from rich.console import Console
from rich.table import Table

import analytic
from analytic import StationarySolution
from analytic.bifurcation import diagram as bifurcation
from analytic.mechanics import drag
from compare.commands import options
from compare.kit.pages import readable
from compare.kit.quantities import QUANTITIES
from compare.kit.statistics import plain
from model import Case, Parameters
from model.drag import REYNOLDS, SCHILLER_NAUMANN
from model.kinematics import UNITS, VARIABLES


def add(commands: options.Commands) -> None:
    """Declare the command."""
    what = "stationary solutions, thresholds and operating range, from theory"
    command = options.command(commands, "predict", run, what, "--set steel-in-water --omega-0 20")
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


def described(p: Parameters) -> dict[str, Any]:
    """Everything as plain data; what doesn't exist is nan."""
    limit, solutions = analytic.operating_limit(p), []
    for s in analytic.stationary_solutions(p):
        Re = drag.reynolds_of(s.state, p)
        solutions.append(
            {
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
        )
    return {
        "parameters": dataclasses.asdict(p),
        "groups": {"kappa": p.kappa, "Omega_0": p.Omega_0},
        "thresholds": dataclasses.asdict(analytic.thresholds(p)),
        "operating_range": limit.omega_0,
        "operating_range_ends": {"by": limit.end.name, "because": limit.end.value},
        "reading_range": analytic.reading_range(p),
        "reading": reading(p),
        "fluid_inertia": bifurcation.inertia_shifts(p) if p.density_ratio else None,
        "solutions": solutions,
    }


def reading(p: Parameters) -> str:
    """What a flowmeter would show, in words."""
    attractors = analytic.stable_solutions(p)
    cases = list(dict.fromkeys(solution.case for solution in attractors))
    if not cases:
        return "no stationary motion attracts the ball"
    if all(math.isclose(s.state.omega_c, p.omega_0, rel_tol=1e-12, abs_tol=1e-300) for s in attractors):
        return f"the ball goes round with the fluid ({' or '.join(case.name for case in cases)})"
    if len(cases) == 1 and cases[0] not in (Case.SR, Case.NR):
        lag = 1 - attractors[0].state.omega_c / p.omega_0
        return f"the ball slips ({cases[0].name}) and lags {lag:.1%} behind the fluid"
    return f"ambiguous: {', '.join(c.name for c in cases)} all attract, the reading depends on the history"


def tables(p: Parameters) -> list[Table | str]:
    """Thresholds, solutions, the reading and what to mind, for the terminal."""
    look: dict[str, Any] = {"title_justify": "left", "title_style": "bold"}
    head = Table(title="Parameters", show_header=False, box=None, **look)
    for field in p.quantities():
        meta, value = field.metadata, f"{getattr(p, field.name):.8g}"
        head.add_row(meta["symbol"], f"{value} {readable(meta['unit'])}", f"[dim]{meta['meaning']}")
    head.add_row("drag", p.drag, "[dim]law of drag")
    groups = f"[dim]κ = c√(R/g) = {p.kappa:.6g}, Ω₀ = ω₀√(R/g) = {p.Omega_0:.6g}"

    limits = Table("", title="Thresholds", **look)
    limits.add_column("value", justify="right")
    limits.add_column("what happens there")
    for name, value in dataclasses.asdict(analytic.thresholds(p)).items():
        symbol, unit = (QUANTITIES[name].symbol, " rad/s") if name in QUANTITIES else ("η_cr", "")
        limits.add_row(symbol, "does not exist" if math.isnan(value) else f"{value:.12g}{unit}", _MEANING[name])

    solutions, attracting = analytic.stationary_solutions(p), {s.case for s in analytic.stable_solutions(p)}
    shown = Table("", title="Stationary solutions", **look)
    for s in solutions:
        shown.add_column(s.case.name, justify="right", style="" if s.exists and s.case in attracting else "dim")
    for label, show in _ROWS.items():
        shown.add_row(label, *map(show, solutions))
    numbers = {s.case.name: drag.reynolds_of(s.state, p) for s in solutions} if p.nu_f else {}
    if numbers:
        shown.add_row("Re", *(f"{Re:.4g}" for Re in numbers.values()))

    limit = analytic.operating_limit(p)
    reach = f"it has no operating range: {limit.end.value}"
    if limit.omega_0:
        reach = f"rolling is its only lasting motion up to ω₀ = {limit.omega_0:.8g} rad/s: there {limit.end.value}"
        if math.isinf(analytic.reading_range(p)):
            reach += "; ω_c = ω₀ holds in every motion, however fast the flow"
    remarks = [f"Flowmeter at ω₀ = {p.omega_0:g} rad/s: {reading(p)}; {reach}."]
    if p.density_ratio:
        shifts = ", ".join(
            f"{QUANTITIES[name].symbol if name in QUANTITIES else 'the rate at which rolling follows the flow'} "
            f"by {100 * shift:+.2g} %"
            for name, shift in bifurcation.inertia_shifts(p).items()
            if math.isfinite(shift)
        )
        remarks.append(
            f"Left out is the fluid's inertia (added mass, pressure gradient): it would shift {shifts}; not ω₀₃."
        )
    existing = {s.case.name for s in solutions if s.exists}
    outside = {case: Re for case, Re in numbers.items() if case in existing and not drag.covers(Re, p.drag)}
    if outside:
        (low, high), (_, most) = REYNOLDS[p.drag], REYNOLDS[SCHILLER_NAUMANN]
        seen = ", ".join(f"{Re:.3g} in {case}" for case, Re in outside.items())
        hint = f" (--drag {SCHILLER_NAUMANN}: up to {most:g})" if p.drag != SCHILLER_NAUMANN else ""
        remarks.append(
            f"[yellow]Warning: Re = {seen}, but the law {p.drag!r} is meant for {low:g} to {high:g}{hint}.[/]"
        )
    return [head, groups, limits, shown, *remarks]


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
        f"{s.eigenvalues[0].real:.4g}" + (f" ± {abs(s.eigenvalues[0].imag):.4g}i" if s.eigenvalues[0].imag else "")
    ),
    "free": lambda s: ", ".join(s.family) or "-",
}
