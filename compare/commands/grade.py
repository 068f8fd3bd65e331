"""``dualball grade``: a score card for a person's own contact settings."""

from __future__ import annotations

import argparse
import dataclasses
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from rich.text import Text

from compare.bench import native
from compare.bench.native import CHOICES, Native
from compare.bench.trials import SLIPPING
from compare.commands import options, running
from compare.kit import engines, progress
from mjsim import ContactSettings
from model import InputError
from model.files import check_writable, write_text

if TYPE_CHECKING:
    from compare.bench.league import Contestant

_NUMBERS = {"timestep": float, "impratio": float, "iterations": int, "tolerance": float, "noslip_iterations": int}
_PAIR: dict[str, tuple[Any, Any, str | None]] = {
    "solref": (2, ("TIMECONST", "DAMPRATIO"), None),
    "solreffriction": (2, ("TIMECONST", "DAMPRATIO"), None),
    "solimp": ("+", "D", "dmin dmax width midpoint power"),
    "margin": (None, "m", None),
}
"""Numbers of a contact: how many there are, their names, and more help."""


def add(commands: options.Commands) -> None:
    """Declare the command."""
    summary = "a score card for MuJoCo contact settings: yours, dualball's, MuJoCo's own; or for another engine"
    command = options.command(commands, "grade", run, summary)
    command.add_argument(
        "file", type=Path, nargs="?", metavar="FILE.xml", help="MJCF file with a ball and its contacts"
    )
    group = command.add_argument_group("settings", "as in MJCF; where not given, those of FILE.xml or MuJoCo's own")
    for name, kind in _NUMBERS.items():
        option, parse = f"--{name.replace('_', '-')}", options.number if kind is float else kind
        group.add_argument(option, type=parse, metavar="s" if name == "timestep" else "N")
    for name, known in CHOICES.items():
        group.add_argument(f"--{name}", metavar="NAME", help=", ".join(known))
    for name, (count, metavar, meaning) in _PAIR.items():
        group.add_argument(f"--{name}", type=options.number, nargs=count, metavar=metavar, help=meaning)
    running.add_engine_name(command)
    command.add_argument("-o", "--output", type=Path, metavar="FILE", help="HTML page to write")
    options.outputs(command)


def run(args: argparse.Namespace) -> int:
    """Grade the settings and show the card."""
    from compare.bench import grade  # here, because nothing else needs it

    if args.output:
        check_writable(args.output)
    if args.engine is engines.MUJOCO:
        yours, described = _of_mujoco(args)
        given: tuple[Native | None, list[Contestant]] = yours, [grade.OURS, grade.PLAIN, grade.FREE]
    else:
        others, described = _of_another(args)
        given = None, [*others, grade.OURS]
    with progress.shown(quiet=args.json) as show:
        columns = grade.grade(*given, show=show)
    if args.output:
        write_text(args.output, grade.html(columns, described))
    advice = (Text(f"• {item}") for item in columns[0].advice)
    options.show([column.to_mapping() for column in columns], args.json, grade.table(columns), *advice)
    return 0


def _of_mujoco(args: argparse.Namespace) -> tuple[Native, str]:
    """The settings that the options name, also in words."""
    base = native.read(args.file) if args.file else Native()
    if base.note:
        print(f"dualball: {base.note}", file=sys.stderr)
    own, pair = options.given(args, (*_NUMBERS, *CHOICES)), options.given(args, _PAIR)
    said = [f"{name} {value}" for name, value in own.items()]
    said += [f"{name} {' '.join(f'{v:g}' for v in np.atleast_1d(value))}" for name, value in pair.items()]
    source = f"Settings of {args.file}" if args.file else "MuJoCo's defaults"
    described = f"{source}, with {', '.join(said)}." if said else f"{source}."
    if len(values := pair.get("solimp", [])) > 5:
        raise InputError(f"solimp has {len(values)} numbers, but at most 5: dmin dmax width midpoint power")
    if "solimp" in pair:
        pair["solimp"] = [*values, *base.A.solimp[len(values) :]]
    pair = {name: tuple(v) if isinstance(v, list) else v for name, v in pair.items()}
    A, B = (dataclasses.replace(each, **pair) for each in (base.A, base.B))
    yours = dataclasses.replace(base, **own, A=A, B=B)
    return yours, f"{described} {yours.note}".rstrip()


def _of_another(args: argparse.Namespace) -> tuple[list[Contestant], str]:
    """Another engine in its best settings and as it comes, also in words."""
    from compare.bench.league import Contestant  # here, because nothing else needs it

    engine: engines.Engine = args.engine
    if engine.missing:
        raise InputError(engine.missing)
    if "timestep" not in engine.options:
        raise InputError(f"{engine.name} has no time step, and no settings to grade")
    if args.file or options.given(args, (*_NUMBERS, *CHOICES, *_PAIR)).keys() - {"timestep"}:
        raise InputError(f"a file and contact settings are MuJoCo's; of {engine.name} only --timestep can be given")
    step = options.given(args, ["timestep"]).get("timestep", ContactSettings.timestep)
    those = [engines.engine(name) for name in dict.fromkeys((engine.name, engine.as_it_comes)) if name]
    columns = [Contestant(each.name, each, step, each.configure({"timestep": step}, SLIPPING.p)) for each in those]
    return columns, f"{engine.name} in its best known settings and as it comes, step {1e3 * step:g} ms."
