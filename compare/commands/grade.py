"""``dualball grade``: a score card for a person's own contact settings."""

from __future__ import annotations

import argparse
import dataclasses
import json
import sys
from collections.abc import Sequence
from pathlib import Path

from rich.console import Console

from compare.commands import options, running
from compare.runs import engines, progress
from compare.runs.engines import Engine
from compare.scorecard import native
from compare.scorecard.contenders import NEWCOMER, OURS, PLAIN, Contender, Contestant
from compare.scorecard.native import Native
from compare.scorecard.trials import SLIPPING
from mjsim import ContactSettings
from model import InputError
from model.files import check_writable, write_text


def add(commands: options.Commands) -> None:
    """Declare the command."""
    command = options.command(
        commands,
        "grade",
        run,
        "a score card for MuJoCo contact settings: yours, dualball's, MuJoCo's own; or for another engine",
    )
    add_settings(command)
    running.add_engine_name(command)
    command.add_argument("-o", "--output", type=Path, metavar="FILE", help="HTML page to write")
    command.add_argument("--json", action="store_true", help="print JSON")


def run(args: argparse.Namespace) -> int:
    """Grade the settings and show the card."""
    from compare.scorecard import card, grade  # here, because nothing else needs it

    if args.output:
        check_writable(args.output)
    yours, others, described = _graded(args)
    with progress.shown(quiet=args.json) as show:
        columns = grade.grade(yours, others, show)
    if args.output:
        write_text(args.output, card.html(columns, described))
    if args.json:
        print(json.dumps([column.to_mapping() for column in columns], indent=1))
        return 0
    console = Console()
    console.print(card.table(columns))
    for item in columns[0].advice:
        console.print(f"• {item}", markup=False, highlight=False)
    return 0


def _graded(args: argparse.Namespace) -> tuple[Native | None, Sequence[Contender | Contestant], str]:
    """MuJoCo's settings that the options name, whom they are compared with, and what they are in words."""
    engine: Engine = args.engine
    if engine is engines.MUJOCO:
        yours = settings(args)
        if yours.note:
            print(f"dualball: {yours.note}", file=sys.stderr)
        return yours, (OURS, PLAIN, NEWCOMER), f"{describe(args)} {yours.note}".rstrip()
    if engine.missing:
        raise InputError(engine.missing)
    if "timestep" not in engine.options:
        raise InputError(f"{engine.name} has no time step, and no settings to grade")
    given = options.given(args, ("timestep",))
    if args.file or len(options.given(args, (*_NATIVE, *_CONTACT))) > len(given):
        raise InputError(f"a file and contact settings are MuJoCo's; of {engine.name} only --timestep can be given")
    step = given.get("timestep", ContactSettings.timestep)
    names = dict.fromkeys(name for name in (engine.name, engine.as_it_comes) if name)
    others = [
        Contestant(each.name, each, step, each.configure({"timestep": step}, SLIPPING.p))
        for each in map(engines.engine, names)
    ]
    return None, (*others, OURS), f"{engine.name} in its best known settings and as it comes, step {1e3 * step:g} ms."


def add_settings(parser: argparse.ArgumentParser) -> None:
    """Options that name settings of MuJoCo's contacts: a file, changes to it, or both."""
    parser.add_argument("file", type=Path, nargs="?", metavar="FILE.xml", help="MJCF file with a ball and its contacts")
    group = parser.add_argument_group("settings", "as in MJCF; where not given, those of FILE.xml or MuJoCo's own")
    group.add_argument("--timestep", type=options.number, metavar="s")
    group.add_argument("--integrator", metavar="NAME", help=", ".join(native.CHOICES["integrator"]))
    group.add_argument("--cone", metavar="NAME", help=", ".join(native.CHOICES["cone"]))
    group.add_argument("--solver", metavar="NAME", help=", ".join(native.CHOICES["solver"]))
    group.add_argument("--impratio", type=options.number)
    group.add_argument("--iterations", type=int)
    group.add_argument("--tolerance", type=options.number)
    group.add_argument("--noslip-iterations", type=int)
    group.add_argument("--solref", type=options.number, nargs=2, metavar=("TIMECONST", "DAMPRATIO"))
    group.add_argument("--solreffriction", type=options.number, nargs=2, metavar=("TIMECONST", "DAMPRATIO"))
    group.add_argument("--solimp", type=options.number, nargs="+", metavar="D", help="dmin dmax width midpoint power")
    group.add_argument("--margin", type=options.number, metavar="m")


def settings(args: argparse.Namespace) -> Native:
    """The settings that the options of `add_settings` name."""
    base = native.read(args.file) if args.file else Native()
    contacts = options.given(args, _CONTACT)
    if "solimp" in contacts:
        values = contacts["solimp"]
        if not 1 <= len(values) <= 5:
            raise InputError(f"solimp has {len(values)} numbers, but at most 5: dmin dmax width midpoint power")
        contacts["solimp"] = [*values, *base.A.solimp[len(values) :]]
    contacts = {name: tuple(v) if isinstance(v, list) else v for name, v in contacts.items()}
    return dataclasses.replace(base, **options.given(args, _NATIVE)).with_contacts(**contacts)


def describe(args: argparse.Namespace) -> str:
    """The same in words."""
    given = [
        f"{name} {' '.join(f'{v:g}' for v in value) if isinstance(value, list) else value}"
        for name, value in options.given(args, (*_NATIVE, *_CONTACT)).items()
    ]
    source = f"Settings of {args.file}" if args.file else "MuJoCo's defaults"
    return f"{source}, with {', '.join(given)}." if given else f"{source}."


_NATIVE = ("timestep", "integrator", "cone", "solver", "impratio", "iterations", "tolerance", "noslip_iterations")
_CONTACT = ("solref", "solreffriction", "solimp", "margin")
