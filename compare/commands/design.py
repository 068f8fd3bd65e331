"""``dualball design``: the best meter for a fluid and a range of flows, within bounds."""

from __future__ import annotations

import argparse
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from rich.console import Console

from analytic import design
from analytic.design import Interval, Request
from compare.commands import options
from compare.statistics import plain
from model import InputError, Parameters, drag, parameters
from model.files import check_writable, write_text
from model.parameters import NOT_NEGATIVE, POSITIVE, Range, check_names, check_number, refuse_missing

Kind = tuple[str, Range]
"""Unit and allowed range of a number."""
_GIVEN: dict[str, Kind] = {q.name: (q.metadata["unit"], q.metadata["allowed"]) for q in Parameters.quantities()}
_BOUNDS = {name: _GIVEN[name] for name in ("r", "R", "mu", "eta", "j")} | {"rho_b": ("kg m-3", POSITIVE)}
_FLUID = {"nu_f": ("m2 s-1", POSITIVE), "rho_f": ("kg m-3", POSITIVE), "gravity": ("m s-2", POSITIVE)}
_FLOW = {"slowest": ("rad s-1", NOT_NEGATIVE), "fastest": ("rad s-1", POSITIVE), "response": ("s", POSITIVE)}
_TOLERANCES = dict.fromkeys(design.INEXACT, ("1", Range(0.0, 1.0, below=True)))
_USUAL = {"gravity": 9.81, "j": (0.4, 0.4)}
"""What need not be given: the Earth, a uniform ball."""


def add(commands: options.Commands) -> None:
    """Declare the command."""
    command = options.command(commands, "design", run, "the best meter for a fluid and a range of flows, within bounds")
    command.add_argument("file", type=Path, metavar="FILE.toml", help="fluid, flow, bounds, materials, tolerances")
    command.add_argument("-o", "--output", type=Path, metavar="FILE", help="HTML page to write")
    command.add_argument("--seed", type=int, default=0, metavar="N", help="of the search (default 0)")
    options.outputs(command, shown="print JSON instead of tables")


def run(args: argparse.Namespace) -> int:
    """Design and show; 1 if no meter covers the flows."""
    from compare.report import meter  # here, because nothing else needs it

    check_number("seed", args.seed, "1", NOT_NEGATIVE)
    if args.output:
        check_writable(args.output)
    asked = parameters.read_toml(args.file)
    try:
        made = design.design(request(asked), args.seed)
    except InputError as error:
        raise InputError(f"{args.file}: {error}") from error
    if args.output:
        write_text(args.output, meter.page(made))
    if args.json:
        print(json.dumps(plain(meter.described(made)), indent=1))
    else:
        Console(markup=False).print(*meter.tables(made), sep="\n")
    return 0 if made.choice.margin >= 1 else 1


def request(asked: Mapping[str, Any]) -> Request:
    """What a file asks for; `InputError` names table, field, value, unit and range of what is wrong."""
    check_names(asked, ["fluid", "flow", "bounds", "material", "tolerances"], "table")
    fluid = _table(asked, "fluid", [*_FLUID, "drag", "C_D"], ["nu_f", "rho_f"])
    flow = _numbers("flow", _table(asked, "flow", [*_FLOW], ["slowest", "fastest"]), _FLOW)
    if flow["slowest"] >= flow["fastest"]:
        raise InputError(
            f"flow.fastest = {flow['fastest']:g} rad s-1 is out of range: must be > flow.slowest = {flow['slowest']:g}"
        )
    law = {name: fluid[name] for name in ("drag", "C_D") if name in fluid}
    numbers = {name: value for name, value in fluid.items() if name not in law}
    if "drag" in law:
        parameters.check_choice("fluid.drag", law["drag"], drag.LAWS)
    if law.get("drag") == drag.QUADRATIC and "response" in flow:
        raise InputError("flow.response can't be asked for with the quadratic law: it has no time constant")
    return Request(
        fluid={"gravity": _USUAL["gravity"]} | _numbers("fluid", numbers, _FLUID) | law,
        **flow,
        bounds=_bounds(asked),
        tolerances=_numbers("tolerances", _table(asked, "tolerances", [*_TOLERANCES]), _TOLERANCES),
    )


def _bounds(asked: Mapping[str, Any]) -> dict[str, dict[str, Interval]]:
    """The bounds of each material: its own, and else those of all."""
    common = _table(asked, "bounds", [*_BOUNDS])
    materials = asked.get("material", [{"name": "ball"}])
    if not (isinstance(materials, list) and materials and all(isinstance(each, Mapping) for each in materials)):
        raise InputError("material must be a list of tables, each under [[material]]")
    bounds = {}
    for each in materials:
        check_names(each, ["name", *_BOUNDS], "property of a material")
        refuse_missing(each, ["name"], "property of a material")
        own = {"j": _USUAL["j"]} | {**common, **each}
        name = own.pop("name")
        if not isinstance(name, str) or name in bounds:
            raise InputError(f"material.name = {name!r} must be a text, and no other material's")
        refuse_missing(own, [*_BOUNDS], f"bound of {name}:")
        bounds[name] = {key: _interval(f"{name}: {key}", own[key], *kind) for key, kind in _BOUNDS.items()}
    return bounds


def _interval(name: str, value: Any, unit: str, allowed: Range) -> Interval:
    """A number, or [lowest, highest]."""
    ends = value if isinstance(value, list | tuple) else (value, value)
    if len(ends) != 2:
        raise InputError(f"{name} = {value!r} must be a number in {unit}, or the two between which it may be")
    low, high = (check_number(name, end, unit, allowed) for end in ends)
    if low > high:
        raise InputError(f"{name} = [{low:g}, {high:g}] {unit} excludes everything: the lower bound must come first")
    return low, high


def _table(asked: Mapping[str, Any], name: str, known: list[str], needed: list[str] | None = None) -> Mapping[str, Any]:
    """A table of the file, which may be missing if nothing in it is needed."""
    table = asked.get(name, {})
    if not isinstance(table, Mapping):
        raise InputError(f"{name} = {table!r} must be a table, [{name}]")
    check_names(table, known, f"entry of [{name}]")
    refuse_missing(table, needed or [], f"entry of [{name}]")
    return table


def _numbers(table: str, given: Mapping[str, Any], kinds: Mapping[str, Kind]) -> dict[str, float]:
    return {name: check_number(f"{table}.{name}", value, *kinds[name]) for name, value in given.items()}
