"""Command-line options of commands that carry out runs: flow, engine, workers, initial state."""

import argparse
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from compare.campaign import progress
from compare.campaign.campaign import Campaign
from compare.campaign.tasks import Task
from compare.campaign.workers import Workers, dask, processes
from compare.commands.options import given_options
from compare.engines import study
from compare.engines.study import AnySettings
from model import Flow, InputError, Parameters, State
from model.kinematics import UNITS, VARIABLES
from model.parameters import REACH, Range, check_names, check_number, parse_number


def flow(args: argparse.Namespace) -> Flow | None:
    """The flow that the options of `simulate` describe; None for a steady one."""
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
            raise InputError(
                "--sine needs a mean in rad/s, then each wave's amplitude in rad/s and frequency "
                "in Hz"
            )
        return Flow.sines(
            mean, zip(waves[::2], waves[1::2], [0.0] * (len(waves) // 2), strict=True)
        )
    return Flow.from_csv(args.flow, args.longest_interval) if args.flow else None


def settings(args: argparse.Namespace, p: Parameters) -> AnySettings:
    chosen: study.Engine = args.engine
    given = given_options(args, ("timestep", "rtol", "restitution"))
    for name in given:
        if name not in chosen.options:
            own = " and ".join(f"--{option}" for option in chosen.options)
            raise InputError(f"--{name} is not for {chosen.name}, which takes {own}")
    return chosen.configure(given, p)


def task(args: argparse.Namespace, p: Parameters, **more: Any) -> Task:
    chosen, asked = settings(args, p), getattr(args, "sample_interval", None)
    given = {"x0": start(args), "t_end": args.time, "settings": chosen, "sample_interval": asked}
    made = Task(engine=args.engine.name, parameters=p, **given | more)
    made.check()
    if asked:
        within = Range(high=made.t_end)
        check_number("sample_interval", asked, "s", within, "within this run it")
    return made


def workers(args: argparse.Namespace) -> Workers:
    return dask(args.scheduler) if args.scheduler else processes(args.workers)


@contextmanager
def campaign(args: argparse.Namespace, doing: str, **more: Any) -> Iterator[Campaign]:
    """A campaign in a directory of ``--output``, whose progress is shown."""
    with (
        progress.reporter(args.quiet, counted=True) as show,
        Campaign(
            args.output, workers(args), limit=args.limit, report=show, doing=doing, **more
        ) as made,
    ):
        yield made


def start(args: argparse.Namespace) -> State:
    units, values = dict(zip(VARIABLES, UNITS, strict=True)), {}
    for item in args.start:
        name, _, value = item.partition("=")
        check_names([name], VARIABLES, "state variable")
        if name in values:
            raise InputError(f"--start names {name} twice")
        values[name] = parse_number(name, value, units[name], REACH)
    return State(**values)
