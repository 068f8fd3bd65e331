"""``dualball simulate``, ``sweep``, ``collect``: a run, many over ranges of parameters, and one file of all of them."""

from __future__ import annotations

import argparse
import dataclasses
import json
import sys
import tempfile
from pathlib import Path

from compare.commands import options, running, signals
from compare.kit import collection, sweep
from compare.kit.tasks import failed_path, journal_path, store
from compare.view import motions
from mjsim import ContactSettings
from model import Flow, InputError, Parameters, storage
from model.files import reading_json, write_text

DURATION = 10.0
"""Of a run, s, unless asked otherwise."""


def run(args: argparse.Namespace) -> int:
    """Simulate one run, store it as far as it came, and describe it."""
    if args.view:
        return open_viewer(args)
    args.time = args.time or DURATION
    task = running.task(args, options.parameters(args), flow=running.flow(args))
    # The first signal ends the run with its samples, the second without.
    with tempfile.TemporaryDirectory() as scratch, signals.noted() as heard:
        path = args.output or Path(scratch) / "run.h5"
        failure = store(task, path, stop=lambda: bool(heard))
        about = motions.describe(failed_path(path) if failure else path)
        options.show(about, args.json, motions.table(about))
        if args.output and not failure and not args.json:
            print(f"written to {args.output}")
        if failure:
            kept = "nothing is kept without --output"
            if args.output:
                kept, journal = f"its samples so far are kept in {failed_path(path)}", journal_path(task, path)
                if journal.exists():
                    kept += f", and the same command goes on from what {journal} holds"
            print(f"dualball: the simulation {failure}; {kept}", file=sys.stderr)
        return 128 + heard[0] if heard else 1 if failure else 0


def open_viewer(args: argparse.Namespace) -> int:
    """Open MuJoCo's viewer and simulate in it."""
    from compare.view import viewer  # here, because nothing else needs it

    p = options.parameters(args)
    settings = running.settings(args, p)
    if not isinstance(settings, ContactSettings):
        raise InputError(f"--view shows MuJoCo, not {args.engine.name}")
    viewer.view(p, running.start(args), running.flow(args) or Flow.steady(p.omega_0), settings, args.speed or 1.0)
    return 0


def run_sweep(args: argparse.Namespace) -> int:
    """Carry out the runs that are not done yet and say which failed."""
    p, axes = options.parameters(args), sweep.Axis.several(args.vary)
    if args.direction != "held":
        if len(axes) != 1 or axes[0].name != "omega_0":
            why = f"direction = {args.direction!r} sweeps omega_0 within one run"
            raise InputError(f"{why}: vary omega_0 and nothing else")
        up = sorted(axes[0].points)
        omegas = {"up": up, "down": up[::-1], "both": up + up[-2::-1]}[args.direction]
        flow, lasts = Flow.staircase(omegas, args.time), args.time * len(omegas)
        tasks = [running.task(args, p.replace(omega_0=omegas[0]), flow=flow, t_end=lasts)]
    else:
        sets = sweep.grid(p, axes) if args.random is None else sweep.random(p, axes, args.random, args.seed)
        tasks = [running.task(args, each) for each in sets]  # each with settings that suit its set
    save = collection.save_means if args.means_only else storage.save_batch
    with running.campaign(args, "sweep", batch=args.batch, save=save) as work:
        _check_no_other_sweep(args, p)
        failures = work.complete(tasks)
    whole = len(tasks) - len(failures)
    if args.json:
        summary = {"directory": str(args.output), "runs": len(tasks), "whole": whole}
        options.show(summary | {"failures": [failure.described() for failure in failures]}, args.json)
    else:
        print(f"{whole} of {len(tasks)} runs are whole, in {args.output}; gather them with: ", end="")
        print(f"dualball collect {args.output}")
        for failure in failures:
            print(f"failed: {failure.task.key}: {failure.reason}", file=sys.stderr)
    return 1 if failures else 0


def _check_no_other_sweep(args: argparse.Namespace, p: Parameters) -> None:
    """Raise `InputError` if the directory holds another sweep, with which `collect` would mix this one."""
    names = ("vary", "random", "seed", "direction", "start", "time", "timestep", "rtol", "restitution",
             "sample_interval", "means_only")  # fmt: skip
    asked = {name: getattr(args, name) for name in names} | {"engine": args.engine.name} | dataclasses.asdict(p)
    if (path := args.output / "sweep.json").exists():
        with reading_json(path, "sweep") as held:
            held = asked | held  # one of an earlier version lacks some
            differ = [f"{name} = {held[name]}, not {value}" for name, value in asked.items() if held[name] != value]
        if differ:
            other = f"{args.output} holds another sweep ({'; '.join(differ)})"
            raise InputError(f"{other}: choose another directory with --output")
    write_text(path, json.dumps(asked))


def collect(args: argparse.Namespace) -> int:
    """Gather the runs of a directory into one file."""
    count = collection.collect(args.directory, args.output, args.workers)
    print(f"{count} run{'s' * (count != 1)} gathered into {args.output}")
    return 0
