"""``dualball grade``: a score card for a person's own contact settings; and ``dualball league``: all engines."""

from __future__ import annotations

import argparse
import dataclasses
import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
from rich.text import Text

from compare.bench import grade, league, native
from compare.bench.league import Contestant
from compare.bench.native import CHOICES, Native
from compare.bench.trials import SLIPPING
from compare.commands import options, running
from compare.kit import engines, pages, progress
from compare.kit.engines import ENGINES
from mjsim import ContactSettings
from model import InputError
from model.files import check_writable, write_text
from model.parameters import NOT_NEGATIVE, POSITIVE, Range, check_names

JSON, PAGE, RUNS = "league.json", "league.html", "league"
_FEW = options.Number(allowed=Range(0, 1e5, whole=True))
_NUMBERS: dict[str, tuple[options.Number, str]] = {
    "timestep": (options.seconds, "time step"),
    "impratio": (options.Number(allowed=POSITIVE), "impedance of friction, divided by that of the normal force"),
    "iterations": (_FEW, "most iterations of the solver"),
    "tolerance": (options.Number(allowed=NOT_NEGATIVE), "at which the solver stops"),
    "noslip_iterations": (_FEW, "iterations that suppress slip"),
}
_PAIR: dict[str, tuple[Any, Any, str]] = {
    "solref": (2, ("TIMECONST", "DAMPRATIO"), "spring and damper of a contact"),
    "solreffriction": (2, ("TIMECONST", "DAMPRATIO"), "the same of its friction"),
    "solimp": ("+", "D", "impedance: dmin dmax width midpoint power"),
    "margin": (None, "m", "distance from which on there is a contact"),
}
"""Numbers of a contact: how many there are, their names, and more help."""


def add(commands: options.Commands) -> None:
    """Declare the commands."""
    summary = "a score card for MuJoCo contact settings: yours, dualball's, MuJoCo's own; or for another engine"
    command = options.command(commands, "grade", graded, summary, "mine.xml -o card.html")
    command.add_argument(
        "file", type=Path, nargs="?", metavar="FILE.xml", help="MJCF file with a ball and its contacts"
    )
    group = command.add_argument_group("settings", "as in MJCF; where not given, those of FILE.xml or MuJoCo's own")
    for name, (parse, meaning) in _NUMBERS.items():
        metavar = "s" if name == "timestep" else "N"
        group.add_argument(f"--{name.replace('_', '-')}", type=parse, metavar=metavar, help=meaning)
    for name, known in CHOICES.items():
        group.add_argument(f"--{name}", metavar="NAME", help=", ".join(known))
    for name, (count, metavar, meaning) in _PAIR.items():
        group.add_argument(f"--{name}", type=options.number, nargs=count, metavar=metavar, help=meaning)
    running.add_engine_name(command)
    command.add_argument("-o", "--output", type=Path, metavar="FILE", help="HTML page to write (default: none)")
    options.outputs(command)

    summary = "all engines that are installed on the same tasks, against theory"
    command = options.command(commands, "league", ranked, summary, "--quick")
    command.add_argument("--quick", action="store_true", help="one time step and fewer tasks: within a minute")
    command.add_argument(
        "--engine", action="append", metavar="NAME", help=f"only this one (repeatable): {', '.join(ENGINES)}"
    )
    running.add_workers(command)
    options.outputs(command, "results")


def graded(args: argparse.Namespace) -> int:
    """Grade the settings and show the card."""
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


def ranked(args: argparse.Namespace) -> int:
    """Measure what isn't there yet, show the table, write JSON and page."""
    from compare.bench import figures  # here, because drawing takes a second to load
    from compare.report.pictures import address, svg

    check_names(args.engine or (), list(ENGINES), "engine")
    those = league.contestants(args.engine, league.QUICK if args.quick else league.STEPS)
    missing = {each.name: each.engine.missing for each in those if each.engine.missing}
    if all(each.name in missing for each in those):
        raise InputError(f"there is nothing to compare: {'; '.join(missing.values())}")
    with running.campaign(args, "league", RUNS) as campaign:
        for name, why in missing.items():
            print(f"dualball: {name} is left out: {why}", file=sys.stderr)
        entries = league.measure(campaign, those, args.quick)
    data = league.to_mapping(those, entries)
    write_text(args.output / JSON, json.dumps(data, indent=1))
    failures = [
        (f"{entry.name}, {1e3 * (entry.step or 0):g} ms, {name}", reason)
        for entry in entries
        for name, reason in entry.failures.items()
    ]
    picture = address(svg(figures.draw_league(entries)))
    shown = {"rows": league.rows(entries), "settings": league.settings_table(data), "caption": league.CAPTION}
    page = pages.render("compare.report", "league.html", **shown, failures=failures, picture=picture)
    write_text(args.output / PAGE, page)
    options.show(data, args.json, *league.tables(entries), league.CAPTION)
    if not args.json:
        print(f"page: {args.output / PAGE}")
    return 0
