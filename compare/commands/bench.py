"""Contacts and engines: ``forecast`` for any MuJoCo model, ``grade`` for one's own settings, ``cases``, ``league``."""

from __future__ import annotations

import argparse
import dataclasses
import itertools
import json
import re
import sys
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from rich.text import Text

from compare.bench import exact, forecast, forecast_page, grade, league, native, settled
from compare.bench.case import VERSION
from compare.bench.native import CHOICES, NUMBERS, Native
from compare.commands import options, running
from compare.kit import engines, pages, progress
from mjsim import ContactSettings
from model import InputError
from model.files import check_ours, make_directory, write_text
from model.parameters import POSITIVE, check_names

LOOK: Any = {"no_wrap": True, "padding": (0, 1, 0, 0), "pad_edge": False}
LEAGUE_JSON, LEAGUE_PAGE = "league.json", "league.html"
_PAIR: dict[str, tuple[Any, Any, str]] = {
    "solref": (2, ("TIMECONST", "DAMPRATIO"), "spring and damper of a contact"),
    "solreffriction": (2, ("TIMECONST", "DAMPRATIO"), "the same of its friction"),
    "solimp": ("+", "D", "impedance: dmin dmax width midpoint power"),
    "margin": (None, "m", "distance from which on there is a contact"),
}
"""Numbers of a contact: how many there are, their names, and more help."""


def add(commands: options.Commands) -> None:
    """Declare the commands."""
    command = options.command(commands, "forecast", foretold, "scene.xml --try")
    command.add_argument("file", type=Path, metavar="MODEL.xml", help="MJCF or URDF")
    command.add_argument("--keyframe", metavar="NAME", help="begin with this keyframe, by name or number")
    driven = "controls: a number for each actuator, or NAME=NUMBER for some"
    command.add_argument("--ctrl", nargs="+", default=[], metavar="[NAME=]N", help=driven)
    longest = "longest time to wait until the model has settled; 0 takes the state as it stands"
    command.add_argument("--settle", type=options.moment, default=10.0, help=longest)
    for name, unit, how in (("creep", "m s-1", "creeps faster"), ("depth", "m", "sinks in deeper")):
        limit = options.Number(unit, POSITIVE)
        command.add_argument(f"--max-{name}", type=limit, help=f"exit with 1 if a pair {how}, measured")
    command.add_argument("--try", dest="tries", action="store_true", help="follow the advice and measure again")
    command.add_argument("-o", "--output", type=options.PAGE, help="HTML page to write")
    options.outputs(command)

    command = options.command(commands, "grade", graded, "mine.xml -o card.html")
    mine = "MJCF file with a ball and its contacts"
    command.add_argument("file", type=Path, nargs="?", metavar="FILE.xml", help=mine)
    group = command.add_argument_group("settings", "as in MJCF; where not given, those of FILE.xml or MuJoCo's own")
    for name, (unit, allowed, meaning) in NUMBERS.items():
        kind, metavar = options.Number(unit, allowed), "s" if unit == "s" else "N"
        group.add_argument(f"--{name.replace('_', '-')}", type=kind, metavar=metavar, help=meaning)
    for name, known in CHOICES.items():
        group.add_argument(f"--{name}", metavar="NAME", help=", ".join(known))
    for name, (count, metavar, meaning) in _PAIR.items():
        group.add_argument(f"--{name}", type=options.number, nargs=count, metavar=metavar, help=meaning)
    running.add_engine_name(command)
    command.add_argument("-o", "--output", type=options.PAGE, help="HTML page to write (default: none)")
    options.outputs(command)

    command = options.command(commands, "cases", listed, "-o cases")
    command.add_argument("name", nargs="?", metavar="NAME", help="show this case")
    files = "write JSON, HDF5, MJCF and the scoring rule (default: none)"
    command.add_argument("-o", "--output", type=options.results, metavar="DIR", help=files)
    options.outputs(command)

    command = options.command(commands, "league", ranked, "--quick")
    command.add_argument("--quick", action="store_true", help="one time step")
    named = f"only this one (repeatable), or a module of your own: {', '.join(league.ENTRIES)}"
    command.add_argument("--engine", action="append", metavar="NAME", help=named)
    running.add_processes(command)
    options.outputs(command, "results")


def listed(args: argparse.Namespace) -> int:
    """List the cases, show one, or write all."""
    own = {case.name: case for case in exact.cases()}
    check_names([args.name] if args.name else [], list(own), "case")
    if args.output:
        exact.write(args.output)
    chosen = own[args.name] if args.name else None
    data = chosen.to_mapping() if chosen else {"version": VERSION, "cases": [c.to_mapping() for c in own.values()]}
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
        rows = [["case", "contacts", "kind", "what happens"]]
        rows += [[c.name, str(len(c.contacts[0])), league.kind(c), c.about] for c in own.values()]
        shown = [pages.table(f"Exact contact cases, version {VERSION}", rows, justify="left")]
    options.show(data, args.json, *shown, *([f"written to {args.output}"] if args.output else []))
    return 0


def _fields(item: Any) -> str:
    """The fields of a dataclass in a line, SI units."""
    values = ((field.name, value) for field in dataclasses.fields(item) if (value := getattr(item, field.name)))
    return ", ".join(f"{name} {value if isinstance(value, str) else _numbers(value)}" for name, value in values)


def _numbers(values: Any) -> str:
    """A number, or several in brackets."""
    several = ", ".join(f"{value + 0.0:.6g}" for value in np.atleast_1d(values))
    return f"({several})" if np.ndim(values) else several


def graded(args: argparse.Namespace) -> int:
    """Grade the settings and show the card."""
    if args.engine is engines.MUJOCO:
        yours, described = _of_mujoco(args)
        others = grade.OTHERS
    else:
        yours, (others, described) = None, _of_another(args)
    with progress.shown(quiet=args.json) as show:
        columns = grade.grade(yours, others, show)
    if args.output:
        write_text(args.output, grade.html(columns, described))
    advice = (Text(f"• {item}") for item in columns[0].advice)
    data = [vars(own) | {"passed": own.passed, "cost": own.cost} for own in columns]
    options.show(data, args.json, grade.table(columns), *advice)
    return 0


def _of_mujoco(args: argparse.Namespace) -> tuple[Native, str]:
    """The settings that the options name, also in words."""
    base = native.read(args.file) if args.file else Native()
    if base.note:
        print(f"dualball: {base.note}", file=sys.stderr)
    own, pair = options.given(args, (*NUMBERS, *CHOICES)), options.given(args, _PAIR)
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


def _of_another(args: argparse.Namespace) -> tuple[dict[str, tuple[Any, float]], str]:
    """Another engine in its best settings and as it comes, also in words."""
    engine: engines.Engine = args.engine
    if engine.missing:
        raise InputError(engine.missing)
    if "timestep" not in engine.options:
        raise InputError(f"{engine.name} has no time step, and no settings to grade")
    if args.file or options.given(args, (*NUMBERS, *CHOICES, *_PAIR)).keys() - {"timestep"}:
        raise InputError(f"a file and contact settings are MuJoCo's; of {engine.name} only --timestep can be given")
    step = options.given(args, ["timestep"]).get("timestep", ContactSettings.timestep)
    names = [name for name in (engine.name, engine.as_it_comes, "mujoco") if name in league.ENTRIES]
    those = {name: (league.ENTRIES[name], step) for name in dict.fromkeys(names)}
    return those, f"{engine.name} in its best known settings and as it comes, step {1e3 * step:g} ms."


def ranked(args: argparse.Namespace) -> int:
    """Measure, show the table, write JSON and page."""
    from compare.report.pictures import address, svg  # here, because drawing takes a second to load

    chosen = {name: league.ENTRIES.get(name, name) for name in args.engine or league.ENTRIES}
    modules = {name for name in chosen if re.search(r"[.:]", name) or Path(f"{name}.py").exists()}
    check_names(chosen.keys() - modules, list(league.ENTRIES), "engine")
    make_directory(args.output)
    check_ours(args.output / LEAGUE_PAGE, beside=args.output / LEAGUE_JSON)
    with progress.shown(quiet=args.json or args.quiet) as show:
        found = league.measure(chosen, league.QUICK if args.quick else None, args.workers, show)
    if all(result.skipped for results in found.values() for result in results):
        raise InputError(f"there is nothing to compare: {'; '.join(r[0].skipped for r in found.values())}")
    data = league.to_mapping(found)
    write_text(args.output / LEAGUE_JSON, json.dumps(data, indent=1))
    summary, rows, columns = league.summary(found), league.rows(found), enumerate(league.tried(found).values(), 1)
    shown = {
        "summary": summary,
        "rows": rows,
        "failed": {(r.case, k) for k, results in columns for r in results if not (r.skipped or r.passed)},
        "about": league.about(found),
        "notes": list(league.notes(found)),
        "caption": league.CAPTION,
        "picture": address(svg(league.draw(found))),
    }
    write_text(args.output / LEAGUE_PAGE, pages.render("compare.bench", "league.html", **shown))
    for what, why in league.notes(found):
        if what.endswith("all cases"):
            print(f"dualball: {what.removesuffix(', all cases')} is left out: {why}", file=sys.stderr)
    head = [name.replace("-", "- ") for name in rows[0]]  # which may be broken there
    tables = {"League": summary, "Errors by case": [head, *rows[1:]]}
    drawn = (pages.table(title, own, no_wrap=True, padding=0) for title, own in tables.items())
    options.show(data, args.json, *drawn, league.CAPTION)
    if not args.json:
        print(f"page: {args.output / LEAGUE_PAGE}")
    return 0


def foretold(args: argparse.Namespace) -> int:
    """Settle the model, print the forecast, and check the limits."""
    good = {"creep": args.max_creep or forecast.CREEP, "depth": args.max_depth}
    heard = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(lambda _: None)  # it would write a log here; what it warns of is in the table
    try:
        model, data = settled.load(args.file, args.keyframe)
        settled.drive(model, data, args.ctrl)
        found = forecast.forecast(model, data, settled.settle(model, data, args.settle), **good)
        after = held = None
        if args.tries:
            found, after, held = forecast.tried(model, data, found, args.settle, **good)
    except settled.UnsettledError as error:
        print(f"dualball: {args.file}: {error}", file=sys.stderr)
        return 1
    finally:
        mujoco.set_mju_user_warning(heard)
    if args.output:
        write_text(args.output, forecast_page.html(found, after, held, str(args.file)))
    shown: list[Any] = [Text(f"• {line}") for line in forecast_page.sentences(found)]
    shown += [Text(f"\n{text}") for _, text in forecast_page.paste(found)]
    tables = forecast_page.tables(found) + forecast_page.again(found, after, held)
    shown += [Text(""), *(pages.table(title, rows, **LOOK) for title, rows in tables)]
    options.show({"before": found, "after": after, "held": held}, args.json, *shown)
    said = [f"{args.file}: {found.unsettled}"] if found.unsettled else []
    limits = ("creep", "m/s", args.max_creep), ("depth", "m", args.max_depth)
    for pair, (name, unit, limit) in itertools.product(found.pairs, limits):
        value = getattr(pair, f"{name}_measured")
        if limit and value > limit:
            said.append(f"{pair.name}: {name} {value:.3g} {unit}, more than {limit:g}")
    for line in said:
        print(f"dualball: {line}", file=sys.stderr)
    return int(bool(said))
