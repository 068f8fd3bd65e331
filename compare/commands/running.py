"""Command-line options of commands that carry out runs: flow, engine, workers, initial state."""

from __future__ import annotations

import argparse
import math
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from compare.commands.options import count_or_none, given, number, seconds
from compare.kit import engines, progress
from compare.kit.campaign import Campaign
from compare.kit.engines import AnySettings
from compare.kit.tasks import Task
from compare.kit.workers import Workers, dask, processes
from model import Flow, InputError, Parameters, State
from model.kinematics import UNITS, VARIABLES
from model.parameters import REACH, Range, check_names, check_number, parse_number


def add_flow(parser: argparse.ArgumentParser) -> None:
    """Options that let omega_0 change in time."""
    group = parser.add_argument_group("flow", "omega_0 over time, in rad/s and s; steady if none is given")
    choice = group.add_mutually_exclusive_group()
    ramp = "rises or falls evenly within so many seconds, and stays"
    choice.add_argument("--ramp", nargs=3, type=number, metavar=("FROM", "TO", "SECONDS"), help=ramp)
    held, wave = "levels, each held HOLD s", "a mean with waves on it, frequencies in Hz"
    choice.add_argument("--staircase", nargs="+", type=number, metavar=("HOLD", "LEVEL"), help=held)
    choice.add_argument("--sine", nargs="+", type=number, metavar=("MEAN", "AMPLITUDE FREQUENCY"), help=wave)
    choice.add_argument("--flow", type=Path, help="measured, as CSV: time, omega_0 on each line")
    longest = "longest time between lines of --flow (default: ten times the usual one)"
    group.add_argument("--longest-interval", type=seconds, help=longest)


def flow(args: argparse.Namespace) -> Flow | None:
    """The flow that the options of `add_flow` describe; None for a steady one."""
    if args.longest_interval is not None and not args.flow:
        raise InputError("--longest-interval is for --flow")
    chosen = [name for name in ("ramp", "staircase", "sine", "flow") if getattr(args, name)]
    if chosen and args.parameter_omega_0 is not None:
        raise InputError(f"--omega-0 is for a steady flow, and can't be given beside --{chosen[0]}")
    if args.ramp:
        return Flow.ramp(*args.ramp)
    if args.staircase:
        return Flow.staircase(args.staircase[1:], args.staircase[0])
    if args.sine:
        mean, *waves = args.sine
        if not waves or len(waves) % 2:
            raise InputError("--sine needs a mean in rad/s, then each wave's amplitude in rad/s and frequency in Hz")
        return Flow.sines(mean, zip(waves[::2], waves[1::2], [0.0] * (len(waves) // 2), strict=True))
    return Flow.from_csv(args.flow, args.longest_interval) if args.flow else None


def add_engine(parser: argparse.ArgumentParser) -> None:
    """Options that choose an engine and its accuracy."""
    group = parser.add_argument_group("engine")
    add_engine_name(group)
    group.add_argument("--timestep", type=seconds, help="time step (default: the engine's; event has none)")
    group.add_argument("--rtol", type=number, help="relative tolerance of event (default 1e-9)")
    restitution = "coefficient of restitution of event and time-stepping (default 0)"
    group.add_argument("--restitution", type=number, help=restitution)


def add_engine_name(
    parser: argparse._ActionsContainer,
    default: engines.Engine | None = engines.MUJOCO,
    usual: str = "analytic is event; default mujoco",
) -> None:
    """The option that chooses an engine; `usual` says what is if none is named."""

    def engine(name: str) -> engines.Engine:
        try:
            return engines.engine(name)
        except InputError as error:
            raise argparse.ArgumentTypeError(str(error)) from error

    known = (
        "mujoco has corrections between its steps, mujoco-plain none, mujoco-defaults is MuJoCo as it comes; others: "
        f"{', '.join(list(engines.ENGINES)[3:])} ({usual})"
    )
    parser.add_argument("--engine", type=engine, default=default, metavar="NAME", help=known)


def settings(args: argparse.Namespace, p: Parameters) -> AnySettings:
    """Settings of the engine that the options of `add_engine` choose, for a ball."""
    chosen: engines.Engine = args.engine
    return chosen.configured(given(args, ("timestep", "rtol", "restitution")), p)


def task(args: argparse.Namespace, p: Parameters, **more: Any) -> Task:
    """The run of a ball that the options of `add_engine`, `add_start`, `add_samples` and ``--time`` describe."""
    chosen = settings(args, p)
    step = getattr(chosen, "timestep", None) or 0.0
    check_number("time", args.time or step, "s", Range(step), "to hold a time step it")
    given = {"x0": start(args), "t_end": args.time, "settings": chosen} | more
    if interval := getattr(args, "sample_interval", None):
        within = Range(step, given["t_end"])
        given["sample_interval"] = check_number("sample_interval", interval, "s", within, "within this run it")
    return Task(engine=args.engine.name, parameters=p, **given)


def add_workers(parser: argparse.ArgumentParser) -> None:
    """Options that say where runs are carried out, of commands that go on where they were stopped."""
    parser.set_defaults(resumes=True)
    group = parser.add_argument_group("workers")
    choice = group.add_mutually_exclusive_group()
    add_processes(choice)
    choice.add_argument("--scheduler", metavar="ADDRESS", help="a Dask scheduler, as tcp://host:8786")
    longest = "longest real time a run may take (default: no limit)"
    group.add_argument("--limit", type=seconds, default=math.inf, help=longest)


def add_processes(options: Any) -> None:
    """The option that says how many processes of this machine take part, for a parser or a group of one."""
    here, all_of_them = "processes of this machine; 0: this one", os.cpu_count() or 1
    options.add_argument("--workers", type=count_or_none, default=all_of_them, help=here)


def workers(args: argparse.Namespace) -> Workers:
    """What the options of `add_workers` name."""
    return dask(args.scheduler) if args.scheduler else processes(args.workers)


@contextmanager
def campaign(args: argparse.Namespace, doing: str, directory: str = "", **more: Any) -> Iterator[Campaign]:
    """A campaign in a directory of ``--output`` by the workers that are named, whose progress is shown."""
    with (
        progress.shown(args.quiet or args.json, counted=True) as show,
        Campaign(args.output / directory, workers(args), limit=args.limit, report=show, doing=doing, **more) as made,
    ):
        yield made


def add_samples(parser: argparse.ArgumentParser) -> None:
    """The option that says how often a run is sampled."""
    between = "time between samples (default: duration/1000)"
    parser.add_argument("--sample-interval", type=seconds, help=between)


def add_start(parser: argparse.ArgumentParser) -> None:
    """Option for the initial state."""
    units = ", ".join(f"{name} in {unit}" for name, unit in zip(VARIABLES, UNITS, strict=True))
    meaning = f"initial state: {units}; zero (at rest against the wall) where not named"
    parser.add_argument("--start", nargs="+", default=[], metavar="NAME=VALUE", help=meaning)


def start(args: argparse.Namespace) -> State:
    """The initial state of `add_start`."""
    units, values = dict(zip(VARIABLES, UNITS, strict=True)), {}
    for item in args.start:
        name, _, value = item.partition("=")
        check_names([name], VARIABLES, "state variable")
        values[name] = parse_number(name, value, units[name], REACH)
    return State(**values)
