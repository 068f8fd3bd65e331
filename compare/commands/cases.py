"""``dualball cases``: the exact contact cases, listed, shown, or as files."""

from __future__ import annotations

import argparse
import dataclasses
import json
from importlib import resources
from typing import Any

import numpy as np

from compare.commands import options
from compare.kit import pages
from model.parameters import check_names


def listed(args: argparse.Namespace) -> int:
    """List the cases, show one, or write all."""
    if not (args.name or args.json or args.output):  # as a file has them, since the cases are simulated
        known = json.loads((resources.files("compare.bench") / "templates" / "cases.json").read_text("utf-8"))
        options.show(None, False, _table(known["version"], known["cases"]))
        return 0
    from compare.bench import exact
    from compare.bench.case import VERSION

    own = {case.name: case for case in exact.cases()}
    check_names([args.name] if args.name else [], list(own), "case")
    if args.output:
        exact.write(args.output)
    chosen = own[args.name] if args.name else None
    if args.json:
        all_of_them = {"version": VERSION, "cases": [case.to_mapping() for case in own.values()]}
        options.show(chosen.to_mapping() if chosen else all_of_them, True)
        return 0
    if chosen:
        about = {
            "case": chosen.name,
            "about": chosen.about,
            "body": _fields(chosen.body),
            "under it": _fields(chosen.under) + f", between them {chosen.between:g}" if chosen.under else "",
            "surfaces": "\n".join(map(_fields, chosen.surfaces)),
            "joint": f"along {_numbers(chosen.joint)}, dry friction {chosen.dry:g} N" if chosen.joint else "",
            "force": f"m g = {chosen.body.mass * chosen.g:.6g} N down, pull {_numbers(chosen.pull)} N, growth "
            f"{_numbers(chosen.growth)} N/s, drag {chosen.drag:g} 1/s, flow {chosen.flow:g} rad/s, "
            f"spring {chosen.spring:g} N/m",
            "scales": f"{_numbers(chosen.scales)} of position (m), velocity (m/s), spin (rad/s); inf: not compared",
            "source": f"{chosen.source}; error below {chosen.bound:g}",
            "notices": "; ".join(f"{why}: {chosen.error(x):.2g}" for why, x in chosen.wrong.items()),
            "ends at": f"t = {chosen.times[-1]:g} s: position {_numbers(chosen.exact[-1, :3])} m, velocity "
            f"{_numbers(chosen.exact[-1, 3:6])} m/s, spin {_numbers(chosen.exact[-1, 6:9])} rad/s",
            "more": "all states, JSON, HDF5 and MJCF: dualball cases -o DIR",
        }
        shown: list[Any] = [pages.pairs({name: text for name, text in about.items() if text})]
    else:
        shown = [_table(VERSION, exact.listing())]
    options.show(None, False, *shown, *([f"written to {args.output}"] if args.output else []))
    return 0


def _table(version: int, rows: list[list[str]]) -> Any:
    head = ["case", "contacts", "kind", "what happens"]
    return pages.table(f"Exact contact cases, version {version}", [head, *rows], justify="left")


def _fields(item: Any) -> str:
    """The fields of a dataclass in a line, SI units."""
    values = ((field.name, value) for field in dataclasses.fields(item) if (value := getattr(item, field.name)))
    return ", ".join(f"{name} {value if isinstance(value, str) else _numbers(value)}" for name, value in values)


def _numbers(values: Any) -> str:
    """A number, or several in brackets."""
    several = ", ".join(f"{value + 0.0:.6g}" for value in np.atleast_1d(values))
    return f"({several})" if np.ndim(values) else several
