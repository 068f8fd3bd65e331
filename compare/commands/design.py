"""``dualball design``: the best meter for a fluid and a range of flows, within bounds."""

import argparse
from collections.abc import Mapping, Sequence
from typing import Any

from analytic.flowmeter import design
from analytic.flowmeter.design import Interval, Request
from compare.commands import options
from model import InputError, Parameters, drag, parameters
from model.files import write_text
from model.parameters import NOT_NEGATIVE, POSITIVE, Range, check_names, check_number

Kinds = Mapping[str, tuple[str, Range]]
"""Numbers by name: unit and allowed range."""
_GIVEN: Kinds = {
    q.name: (q.metadata["unit"], q.metadata["allowed"]) for q in Parameters.quantities()
}
_BOUNDS: Kinds = {name: _GIVEN[name] for name in ("r", "R", "mu", "eta", "j")} | {
    "rho_b": ("kg m-3", POSITIVE)
}
_FLUID: Kinds = {
    "nu_f": ("m2 s-1", POSITIVE),
    "rho_f": ("kg m-3", POSITIVE),
    "gravity": ("m s-2", POSITIVE),
}
_FLOW: Kinds = {
    "slowest": ("rad s-1", NOT_NEGATIVE),
    "fastest": ("rad s-1", POSITIVE),
    "response": ("s", POSITIVE),
}
_TOLERANCES: Kinds = dict.fromkeys(design.INEXACT, ("1", Range(0.0, 1.0, below=True)))
_USUAL = {"gravity": 9.81, "j": (0.4, 0.4)}
"""What need not be given: the Earth, a uniform ball."""


def run(args: argparse.Namespace) -> int:
    """Design a flowmeter and show it; the exit code is 1 if no meter covers the flows."""
    from compare.report import meter  # here, because nothing else needs it

    asked = parameters.read_toml(args.file)
    try:
        made = design.design(request(asked), args.seed, args.tell)
    except InputError as error:
        raise InputError(f"{args.file}: {error}") from error
    if args.output:
        write_text(args.output, meter.page(made))
    options.show(meter.described(made), args.json, *meter.tables(made))
    return 0 if made.choice.margin >= 1 else 1


def request(asked: Mapping[str, Any]) -> Request:
    """The request for a meter that a TOML file makes; `InputError` names what is wrong."""
    check_names(asked, ["fluid", "flow", "bounds", "material", "tolerances"], "table")
    fluid = _table(asked, "fluid", _FLUID, ["nu_f", "rho_f"], texts=("drag", "C_D"))
    flow = _table(asked, "flow", _FLOW, ["slowest", "fastest"])
    if flow["slowest"] >= flow["fastest"]:
        raise InputError(
            f"flow.fastest = {flow['fastest']:g} rad s-1 is out of range: must be > flow.slowest = "
            f"{flow['slowest']:g}"
        )
    if "drag" in fluid:
        parameters.check_choice("fluid.drag", fluid["drag"], drag.LAWS)
    if fluid.get("drag") == drag.QUADRATIC and "response" in flow:
        raise InputError(
            "flow.response can't be asked for with the quadratic law: it has no time constant"
        )
    common = _table(asked, "bounds", {}, texts=tuple(_BOUNDS))
    materials = asked.get("material", [{"name": "ball"}])
    several = isinstance(materials, list) and all(isinstance(each, Mapping) for each in materials)
    if not (several and materials):
        raise InputError("material must be a list of tables, each under [[material]]")
    bounds: dict[str, dict[str, Interval]] = {}
    for each in materials:
        check_names(each, ["name", *_BOUNDS], "property of a material", ["name"])
        # a material's own bounds, and else those of all
        own = {"j": _USUAL["j"]} | {**common, **each}
        name = own.pop("name")
        if not isinstance(name, str) or name in bounds:
            raise InputError(f"material.name = {name!r} must be a text, and no other material's")
        check_names(own, [*_BOUNDS], f"bound of {name}:", _BOUNDS)
        bounds[name] = {
            key: _interval(f"{name}: {key}", own[key], *kind) for key, kind in _BOUNDS.items()
        }
    tolerances = _table(asked, "tolerances", _TOLERANCES)
    return Request(
        fluid={"gravity": _USUAL["gravity"]} | fluid, **flow, bounds=bounds, tolerances=tolerances
    )


def _interval(name: str, value: Any, unit: str, allowed: Range) -> Interval:
    """The interval that a number, or a list [lowest, highest], means, checked."""
    of = f" {unit}" * (unit != "1")
    ends = value if isinstance(value, list | tuple) else (value, value)
    if len(ends) != 2:
        raise InputError(
            f"{name} = {value!r} must be a number{of and ' in'}{of}, or the two between which "
            "it may be"
        )
    low, high = (check_number(name, end, unit, allowed) for end in ends)
    if low > high:
        raise InputError(
            f"{name} = [{low:g}, {high:g}]{of} excludes everything: the lower bound must come first"
        )
    return low, high


def _table(
    asked: Mapping[str, Any],
    name: str,
    kinds: Kinds,
    needed: Sequence[str] = (),
    texts: Sequence[str] = (),
) -> dict[str, Any]:
    """A table of the file with its numbers checked; `texts` are checked elsewhere."""
    table = asked.get(name, {})
    if not isinstance(table, Mapping):
        raise InputError(f"{name} = {table!r} must be a table, [{name}]")
    check_names(table, [*kinds, *texts], f"entry of [{name}]", needed)
    numbers = {
        key: check_number(f"{name}.{key}", x, *kinds[key])
        for key, x in table.items()
        if key in kinds
    }
    return {**table, **numbers}
