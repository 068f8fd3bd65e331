"""Command-line options that several commands share, and what they mean."""

from __future__ import annotations

import argparse
import dataclasses
import json
import math
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console

from compare.runs import engines
from compare.runs.engines import Settings
from compare.runs.workers import Workers, dask
from compare.scorecard import native as native_settings
from compare.scorecard.native import Native
from model import Flow, InputError, Parameters, StorageError
from model.errors import suggestion
from model.kinematics import UNITS, VARIABLES
from model.parameters import Range, check_number, parse_number

Parser = argparse.ArgumentParser
Commands = Any
"""What `argparse` calls the sub-parsers of a program."""


def command(commands: Commands, name: str, run: Callable[[argparse.Namespace], int], summary: str) -> Parser:
    """Declare a command."""
    declared: Parser = commands.add_parser(name, help=summary, description=summary)
    declared.set_defaults(run=run)
    return declared


def show(data: dict[str, Any], table: Callable[[dict[str, Any]], Any], as_json: bool) -> None:
    """Print data as JSON or as a table."""
    if as_json:
        print(json.dumps(data, indent=1))
    else:
        Console().print(table(data))


def add_parameters(parser: argparse.ArgumentParser) -> None:
    """Options that choose a parameter set and change some of its values."""
    group = parser.add_argument_group("parameters")
    source = group.add_mutually_exclusive_group()
    source.add_argument("--set", metavar="NAME", default="reference", help=f"one of {', '.join(Parameters.names())}")
    source.add_argument("--parameters", metavar="FILE", help="TOML file with all of them, or with a [fluid] table")
    for field in dataclasses.fields(Parameters):
        option, meaning = f"--{field.name.replace('_', '-')}", "{meaning} ({allowed})".format_map(field.metadata)
        dest, unit = f"parameter_{field.name}", field.metadata["unit"]
        group.add_argument(option, dest=dest, metavar=unit, type=number, help=meaning)


def parameters(args: argparse.Namespace) -> Parameters:
    """The parameters that the options of `add_parameters` name."""
    chosen = Parameters.load(args.parameters) if args.parameters else Parameters.named(args.set)
    given = {f.name: getattr(args, f"parameter_{f.name}") for f in dataclasses.fields(Parameters)}
    return chosen.replace(**{name: value for name, value in given.items() if value is not None})


def add_flow(parser: argparse.ArgumentParser) -> None:
    """Options that let omega_0 change in time."""
    group = parser.add_argument_group("flow", "omega_0 over time, in rad/s and s; steady if none is given")
    choice = group.add_mutually_exclusive_group()
    choice.add_argument("--ramp", nargs=3, type=number, metavar=("FROM", "TO", "SECONDS"))
    choice.add_argument("--staircase", nargs="+", type=number, metavar=("HOLD", "LEVEL"), help="each level held HOLD s")
    choice.add_argument("--flow", metavar="FILE", help="samples as text: time, omega_0 on each line")


def flow(args: argparse.Namespace) -> Flow | None:
    """The flow that the options of `add_flow` describe; None for a steady one."""
    if args.ramp:
        return Flow.ramp(*args.ramp)
    if args.staircase:
        return Flow.staircase(args.staircase[1:], args.staircase[0])
    if args.flow:
        return _read_flow(Path(args.flow))
    return None


def add_engine(parser: argparse.ArgumentParser) -> None:
    """Options that choose an engine and its accuracy."""
    group = parser.add_argument_group("engine")
    group.add_argument(
        "--engine",
        type=_engine,
        default=engines.MUJOCO,
        metavar="NAME",
        help=f"{', '.join(engines.ENGINES)}; analytic is event",
    )
    group.add_argument("--timestep", type=number, metavar="s", help="time step of mujoco and time-stepping")
    group.add_argument("--rtol", type=number, help="relative tolerance of event")
    group.add_argument("--restitution", type=number, help="coefficient of restitution of event and time-stepping")


def _engine(name: str) -> engines.Engine:
    try:
        return engines.engine(name)
    except InputError as error:
        raise argparse.ArgumentTypeError(str(error)) from error


def settings(args: argparse.Namespace) -> Settings:
    """Settings of the engine that the options of `add_engine` choose."""
    given = {name: getattr(args, name) for name in ("timestep", "rtol", "restitution")}
    chosen: engines.Engine = args.engine
    return chosen.configured({name: value for name, value in given.items() if value is not None})


def add_workers(parser: argparse.ArgumentParser) -> None:
    """Options that say where runs are carried out."""
    group = parser.add_argument_group("workers")
    choice = group.add_mutually_exclusive_group()
    choice.add_argument(
        "--workers", type=int, default=os.cpu_count() or 1, metavar="N", help="processes of this machine (0: this one)"
    )
    choice.add_argument("--scheduler", metavar="ADDRESS", help="a Dask scheduler, as tcp://host:8786")
    group.add_argument("--limit", type=number, default=math.inf, metavar="s", help="longest real time a run may take")


def workers(args: argparse.Namespace) -> int | Workers:
    """What the options of `add_workers` name."""
    check_number("workers", args.workers, "processes", Range(0, whole=True))
    return dask(args.scheduler) if args.scheduler else int(args.workers)


def add_start(parser: argparse.ArgumentParser) -> None:
    """Option for the initial state."""
    meaning = f"initial state, zero (at rest against the wall) where not named; names: {', '.join(VARIABLES)}"
    parser.add_argument("--start", nargs="*", default=[], metavar="NAME=VALUE", help=meaning)


def start(args: argparse.Namespace) -> np.ndarray:
    """The initial state, shape (8,), of `add_start`."""
    x = np.zeros(len(VARIABLES))
    for item in args.start:
        name, _, value = item.partition("=")
        if name not in VARIABLES:
            raise InputError(f"unknown state variable {name!r}{suggestion(name, VARIABLES)}")
        k = VARIABLES.index(name)
        x[k] = parse_number(name, value, UNITS[k])
    return x


def add_native(parser: argparse.ArgumentParser) -> None:
    """Options that name settings of MuJoCo's contacts: a file, changes to it, or both."""
    parser.add_argument("file", type=Path, nargs="?", metavar="FILE.xml", help="MJCF file with a ball and its contacts")
    group = parser.add_argument_group("settings", "as in MJCF; where not given, those of FILE.xml or MuJoCo's own")
    group.add_argument("--timestep", type=number, metavar="s")
    group.add_argument("--integrator", metavar="NAME", help=", ".join(native_settings.INTEGRATORS))
    group.add_argument("--cone", metavar="NAME", help=", ".join(native_settings.CONES))
    group.add_argument("--solver", metavar="NAME", help=", ".join(native_settings.SOLVERS))
    group.add_argument("--impratio", type=number)
    group.add_argument("--iterations", type=int)
    group.add_argument("--tolerance", type=number)
    group.add_argument("--noslip-iterations", type=int)
    group.add_argument("--solref", type=number, nargs=2, metavar=("TIMECONST", "DAMPRATIO"))
    group.add_argument("--solreffriction", type=number, nargs=2, metavar=("TIMECONST", "DAMPRATIO"))
    group.add_argument("--solimp", type=number, nargs="+", metavar="D", help="dmin dmax width midpoint power")
    group.add_argument("--margin", type=number, metavar="m")


def native(args: argparse.Namespace) -> Native:
    """The settings that the options of `add_native` name."""
    settings = native_settings.read(args.file) if args.file else Native()
    given = {name: getattr(args, name) for name in _NATIVE if getattr(args, name) is not None}
    contacts = {name: getattr(args, name) for name in _CONTACT if getattr(args, name) is not None}
    if "solimp" in contacts:
        values = contacts["solimp"]
        if not 1 <= len(values) <= 5:
            raise InputError(f"solimp has {len(values)} numbers, but at most 5: dmin dmax width midpoint power")
        contacts["solimp"] = [*values, *settings.A.solimp[len(values) :]]
    contacts = {name: tuple(v) if isinstance(v, list) else v for name, v in contacts.items()}
    return dataclasses.replace(settings, **given).with_contacts(**contacts)


def describe_native(args: argparse.Namespace) -> str:
    """The same in words."""
    given = [
        f"{name} {' '.join(f'{v:g}' for v in value) if isinstance(value, list) else value}"
        for name in (*_NATIVE, *_CONTACT)
        if (value := getattr(args, name)) is not None
    ]
    source = f"Settings of {args.file}" if args.file else "MuJoCo's defaults"
    return f"{source}, with {', '.join(given)}." if given else f"{source}."


_NATIVE = ("timestep", "integrator", "cone", "solver", "impratio", "iterations", "tolerance", "noslip_iterations")
_CONTACT = ("solref", "solreffriction", "solimp", "margin")


def number(text: str) -> float:
    """A number of the command line, for argparse."""
    try:
        return float(text)
    except ValueError as error:
        raise argparse.ArgumentTypeError(f"{text!r} is not a number") from error


def _read_flow(path: Path) -> Flow:
    try:
        table = np.loadtxt(path, delimiter="," if "," in path.read_text("utf-8") else None, ndmin=2)
    except OSError as error:
        raise StorageError(f"cannot read the flow from {path}: {error.strerror}") from error
    except ValueError as error:
        raise InputError(f"{path} is not a table of numbers, time and omega_0 on each line: {error}") from error
    if table.shape[1] != 2:
        raise InputError(f"{path} has {table.shape[1]} columns, but a flow has two, time and omega_0")
    return Flow.sampled(table[:, 0].tolist(), table[:, 1].tolist())
