"""``dualball predict``: what theory says of a set; ``parameters``: what a set is."""

import argparse
import dataclasses
import math
from collections.abc import Callable, Sequence
from typing import Any

from rich.table import Table
from rich.text import Text

import analytic
from analytic.bifurcation import diagram
from analytic.flowmeter import real_fluid
from analytic.mechanics import drag
from compare.commands import options
from compare.figures import pages
from compare.figures.pages import readable
from compare.figures.validity import model_warning, torque_left_out
from compare.method.quantities import QUANTITIES
from compare.report import meter
from model import Case, Parameters, table
from model.drag import LAWS, REYNOLDS, SCHILLER_NAUMANN
from model.kinematics import UNITS, VARIABLES
from model.trajectory import AXES


def show_parameters(args: argparse.Namespace) -> int:
    p, rows, cells = options.parameters(args), [], [["option", "value", "unit", "range", "meaning"]]
    for field in Parameters.quantities():
        about, value = field.metadata, getattr(p, field.name)
        option, unit = f"--{field.name.replace('_', '-')}", readable(about["unit"])
        allowed = str(about["allowed"]).replace("any", "")
        row = {"name": field.name, "option": option, "symbol": about["symbol"], "value": value}
        rows.append(row | {"unit": about["unit"], "range": allowed, "meaning": about["meaning"]})
        cells.append([option, f"{value:.6g}", unit, allowed, about["meaning"]])
    cells.append(["--drag", p.drag, "", "", f"law of drag: {', '.join(LAWS)}"])
    shown = pages.table("", cells, justify="left", box=None)
    others = [name for name in Parameters.names() if args.parameters or name != args.set]
    own = f"Values of {args.parameters or args.set}; other sets: {', '.join(others)}."
    toml = (
        "A file of your own for --parameters: TOML, a line NAME = value each, named as in the "
        "options (omega_0)."
    )
    data = {"parameters": rows, "drag": p.drag, "sets": Parameters.names()}
    options.show(data, args.json, shown, "", own, toml)
    return 0


def run(args: argparse.Namespace) -> int:
    data = described(p := options.parameters(args))
    if args.table:
        table.write(args.table, labelled(data))
    options.show(data, args.json, *tables(p, data))
    return 0


def described(p: Parameters) -> dict[str, Any]:
    """All that theory predicts of a set, as plain data; what doesn't exist is nan."""
    limit, solutions = analytic.operating_limit(p), []
    for s in analytic.stationary_solutions(p):
        Re = drag.reynolds_of(s.state, p)
        solution = {
            "case": s.case.name,
            "Re": Re,
            "drag_law_covers_Re": drag.covers(Re, p.drag) if p.nu_f else None,
            "x": s.state._asdict(),
            "units": dict(zip(VARIABLES, UNITS, strict=True)),
            "stability": s.stability.value,
        }
        names = "force_A", "force_B", "eigenvalues", "exists", "slip_stable", "family"
        solutions.append(solution | {name: getattr(s, name) for name in names})
    off = real_fluid.model_error(p)
    return {
        "parameters": p,
        "model_holds": off <= real_fluid.LIMIT if p.nu_f else None,
        "model_error": off,
        "fluid_torque": {
            "Stokes": real_fluid.rolling(p, False),
            "boundary layer": real_fluid.rolling(p),
        },
        "groups": {"kappa": p.kappa, "Omega_0": p.Omega_0},
        "thresholds": dataclasses.asdict(analytic.thresholds(p)),
        "operating_range": limit.omega_0,
        "operating_range_ends": {"by": limit.end.name, "because": limit.end.value},
        "reading_range": analytic.reading_range(p),
        "reading": reading(p),
        "fluid_inertia": diagram.inertia_shifts(p) if p.density_ratio else None,
        "solutions": solutions,
    }


def labelled(data: dict[str, Any]) -> dict[str, Sequence[Any]]:
    """The solutions of `described` as a table, a row each; all have its thresholds."""
    solutions, thresholds = data["solutions"], data["thresholds"]
    rows: dict[str, Sequence[Any]] = {"case": [s["case"] for s in solutions]}
    rows["omega_0 (rad/s)"] = [data["parameters"].omega_0] * len(solutions)
    for name, unit in zip(VARIABLES, UNITS, strict=True):
        rows[table.label(name, unit)] = [s["x"][name] for s in solutions]
    for force in ("force_A", "force_B"):
        for k, axis in enumerate(AXES):
            rows[f"{force}{axis} (N)"] = [s[force][k] for s in solutions]
    rows |= {name: [s[name] for s in solutions] for name in ("exists", "stability", "slip_stable")}
    for name, value in thresholds.items():
        rows[table.label(name, "rad s-1" if name in QUANTITIES else "1")] = [value] * len(solutions)
    return rows


def reading(p: Parameters) -> str:
    """In words what the ball's orbit says of the flow: its stable cases and lag."""
    attractors = analytic.stable_solutions(p)
    cases = list(dict.fromkeys(solution.case for solution in attractors))
    if not cases:
        return "no stationary motion attracts the ball"
    read, close = [s.state.omega_c for s in attractors], {"rel_tol": 1e-12, "abs_tol": 1e-300}
    if all(math.isclose(omega_c, p.omega_0, **close) for omega_c in read):
        return f"the ball goes round with the fluid ({' or '.join(case.name for case in cases)})"
    if len(cases) == 1 and cases[0] not in (Case.SR, Case.NR):
        lag = 1 - attractors[0].state.omega_c / p.omega_0
        return f"the ball slips ({cases[0].name}) and lags {100 * lag:.1f} % behind the fluid"
    return f"the reading depends on the past: {', '.join(c.name for c in cases)} all attract"


Digits = Callable[[float, int], str]
"""A number as text, with so many digits at most."""


def tables(p: Parameters, data: dict[str, Any]) -> list[Table | Text | str]:
    """What `described` says of p: the reading, thresholds, solutions and what to mind, for the
    terminal.

    Where the model is off for a real fluid that comes first, and the numbers have three digits."""

    def shown(value: float, most: int) -> str:
        return meter.rounded(value, data["model_error"], most)

    return [
        *(Text(doubt, "bold yellow") for doubt in model_warning(data["model_error"])),
        *_answer(p, data, shown),
        "",
        _thresholds(data, shown),
        _solutions(p, data, shown),
        *_remarks(p, data),
        "",
        *_set(p),
    ]


def _answer(p: Parameters, data: dict[str, Any], shown: Digits) -> list[Text]:
    because = data["operating_range_ends"]["because"]
    reach = f"It has no operating range: {because}."
    if limit := data["operating_range"]:
        reach = f"It rolls with the fluid up to ω₀ = {shown(limit, 5)} rad/s: there {because}."
        if math.isinf(data["reading_range"]):
            reach += " ω_c = ω₀ holds in every motion, however fast the flow."
    return [Text(f"At ω₀ = {p.omega_0:g} rad/s {data['reading']}.", "bold"), Text(reach, "bold")]


def _thresholds(data: dict[str, Any], shown: Digits) -> Table:
    rows = [["", "value", "what happens there"]]
    for name, value in data["thresholds"].items():
        symbol, unit = (QUANTITIES[name].symbol, " rad/s") if name in QUANTITIES else ("η_cr", "")
        said = "does not exist" if math.isnan(value) else f"{shown(value, 12)}{unit}"
        rows.append([symbol, said, meter.MEANING[name]])
    return pages.table("Thresholds", rows, justify="left")


def _solutions(p: Parameters, data: dict[str, Any], shown: Digits) -> Table:
    solutions = data["solutions"]
    rows = [["", *(s["case"] for s in solutions)]]
    for label, show in _ROWS.items():
        if label != "Re" or p.nu_f:
            rows.append([label, *(show(s, shown) for s in solutions)])
    made = pages.table("Stationary solutions", rows)
    attracting = {s.case.name for s in analytic.stable_solutions(p)}
    for column, s in zip(made.columns[1:], solutions, strict=True):
        column.style = "" if s["exists"] and s["case"] in attracting else "dim"
    return made


def _remarks(p: Parameters, data: dict[str, Any]) -> list[Text | str]:
    """What the numbers leave out or don't say."""
    remarks: list[Text | str] = [
        Text("Forces in RR are not determined: shown are those that need least friction.", "dim")
    ]
    remarks += filter(None, [torque_left_out(p)])
    if data["fluid_inertia"]:
        rate = "the rate at which rolling follows the flow"
        shifts = ", ".join(
            f"{QUANTITIES[name].symbol if name in QUANTITIES else rate} "
            f"by {float(f'{100 * shift:.2g}'):+g} %"
            for name, shift in data["fluid_inertia"].items()
            if math.isfinite(shift)
        )
        inertia = "Left out is the fluid's inertia (added mass, pressure gradient)"
        remarks += [f"{inertia}: it would shift {shifts}; not ω₀₃.", meter.AT_WALLS]
    outside = [
        f"{s['Re']:.3g} in {s['case']}"
        for s in data["solutions"]
        if s["exists"] and s["drag_law_covers_Re"] is False
    ]
    if outside:
        (low, high), (_, most) = REYNOLDS[p.drag], REYNOLDS[SCHILLER_NAUMANN]
        hint = f" (--drag {SCHILLER_NAUMANN}: up to {most:g})" if p.drag != SCHILLER_NAUMANN else ""
        law = f"the law {p.drag!r} is meant for {low:g} to {high:g}{hint}"
        remarks.append(Text(f"Warning: Re = {', '.join(outside)}, but {law}.", "yellow"))
    return remarks


def _set(p: Parameters) -> list[Table | Text]:
    given = [["", "", ""]]
    for field in p.quantities():
        meta, value = field.metadata, f"{getattr(p, field.name):.8g}"
        given.append([meta["symbol"], f"{value} {readable(meta['unit'])}", meta["meaning"]])
    look: dict[str, Any] = {"justify": "left", "show_header": False, "box": None}
    head = pages.table("Parameters", [*given, ["drag", p.drag, "law of drag"]], **look)
    return [head, Text(f"κ = c√(R/g) = {p.kappa:.6g}, Ω₀ = ω₀√(R/g) = {p.Omega_0:.6g}", "dim")]


def _complex(value: complex, largest: float, shown: Digits) -> str:
    """A complex number and its conjugate; a real part that is round-off is 0."""
    real = value.real if abs(value.real) > 1e-12 * largest else 0.0
    return shown(real, 4) + (f" ± {shown(abs(value.imag), 4)}i" if value.imag else "")


_STABILITY = {each.value: each.value.removesuffix(" stable") for each in analytic.Stability} | {
    analytic.Stability.ALGEBRAIC.value: "algebraically"
}
_ROWS: dict[str, Callable[[dict[str, Any], Digits], str]] = {
    "ω_c (rad/s)": lambda s, shown: shown(s["x"]["omega_c"], 8),
    "ω̃_x (rad/s)": lambda s, shown: shown(s["x"]["slip_x"], 8),
    "ω̃_y (rad/s)": lambda s, shown: shown(s["x"]["slip_y"], 8),
    "ω̃_z (rad/s)": lambda s, shown: shown(s["x"]["slip_z"], 8),
    "v_y (m/s)": lambda s, shown: shown(s["x"]["v_y"], 6),
    "A_y (N)": lambda s, shown: shown(s["force_A"][1], 6),
    "B_x (N)": lambda s, shown: shown(s["force_B"][0], 6),
    "forces admissible": lambda s, _: "yes" if s["exists"] else "no",
    "within the case": lambda s, _: _STABILITY[s["stability"]],
    "against slipping": lambda s, _: "stable" if s["slip_stable"] else "unstable",
    "rightmost eigenvalue (1/s)": lambda s, shown: _complex(
        s["eigenvalues"][0], max(map(abs, s["eigenvalues"])), shown
    ),
    "free": lambda s, _: ", ".join(s["family"]) or "-",
    "Re": lambda s, shown: shown(s["Re"], 4),
}
