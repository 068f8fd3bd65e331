"""``dualball simulate``, ``sweep``, ``collect``: a run, many, and one file of all of them."""

import argparse
import dataclasses
import json
import sys
import tempfile
from contextlib import nullcontext, suppress
from pathlib import Path

from compare.campaign import progress, sweep
from compare.campaign.tasks import Task, failed_path, store
from compare.commands import options, running, signals
from compare.view import collection, motions, steady
from model import Flow, InputError, Parameters, storage, table
from model.files import reading_json, write_text

DURATION = 10.0
"""Of a run, s, unless asked otherwise."""
WRITING = 2.0
"""Time steps that a run takes while a line of a table is written, about."""
_TOLD_APART = (
    *("vary", "random", "seed", "direction", "start", "time", "timestep", "rtol"),
    *("restitution", "sample_interval", "means_only"),
)
"""Options by which sweeps differ, beside engine and parameters."""


def run(args: argparse.Namespace) -> int:
    """Simulate one run, store it as far as it came, and describe it."""
    p, flow = options.parameters(args), running.flow(args)
    if args.flow and flow and not args.time and flow.start[-1] > DURATION:
        options.warn(
            f"{args.flow} lasts {flow.start[-1]:.10g} s, of which the first {DURATION:g} s are "
            "run: --time says how long"
        )
    args.time = args.time or DURATION
    if args.flow and flow and flow.start[0] >= args.time:
        raise InputError(
            f"{args.flow} begins at t = {flow.start[0]:.10g} s, but the run, from 0 on, ends at "
            f"{args.time:g} s: shift its times, or give a longer --time"
        )
    task = running.task(args, p, flow=flow)
    _warn_of_model([task])
    with tempfile.TemporaryDirectory() as scratch:
        as_table = options.is_table(args.output)
        path = Path(scratch) / "run.h5" if as_table or not args.output else args.output
        share = task.steps / (task.steps + WRITING * task.samples * as_table)  # of the run
        # The first signal ends the run with its samples, the second without.
        with signals.noted() as heard:
            tell = progress.part(args.tell, 0, share)
            failure = store(task, path, stop=lambda: bool(heard), tell=tell)
        path = failed_path(path) if failure else path
        kept = failed_path(args.output) if args.output and failure else args.output
        if as_table:
            columns = motions.labelled(storage.load(path))
            table.write(kept, columns, progress.part(args.tell, share, 1))
        # what ended the run may have been that nobody reads any more
        with suppress(OSError) if heard else nullcontext():
            if failure:  # now, since a signal may come before all else is said
                where = f"its samples so far are kept in {kept}"
                where = where if args.output else "nothing is kept without --output"
                print(f"dualball: the simulation {failure}; {where}", file=sys.stderr)
            about = motions.describe(path)
            options.show(about, args.json, motions.table(about))
            if args.output and not failure and not args.json:
                print(f"written to {args.output}")
        return 128 + heard[0] if heard else 1 if failure else 0


def run_sweep(args: argparse.Namespace) -> int:
    p = options.parameters(args)
    tasks = _sweep_tasks(args, p)
    save = collection.save_means if args.means_only else storage.save_batch
    with running.campaign(args, "sweep", batch=args.batch, save=save) as work:
        _refuse_another_sweep(args, p)
        _warn_of_model([tasks[0], tasks[-1]])
        longest, slowest = steady.enough([each.parameters for each in tasks])
        if args.time < longest:
            options.warn(
                f"{args.time:g} s may be too short to settle: the slowest of these balls has a "
                f"time constant of {slowest:.3g} s, and --time {longest:g} brings it to within "
                f"{100 * steady.DRIFT:g} %"
            )
        failures = work.complete(tasks)
    whole = len(tasks) - len(failures)
    if args.json:
        summary = {"directory": str(args.output), "runs": len(tasks), "whole": whole}
        failed = [failure.described() for failure in failures]
        options.show(summary | {"failures": failed}, args.json)
    else:
        done = f"{whole} of {len(tasks)} runs are whole, in {args.output}"
        print(f"{done}; gather them with: dualball collect {args.output}")
        for failure in failures:
            print(f"failed: {failure.task.key}: {failure.reason}", file=sys.stderr)
    return 1 if failures else 0


def _warn_of_model(tasks: list[Task]) -> None:
    """As `options.warn_of_model`, of runs that leave the fluid's torque out."""
    sets = (each.parameters for each in tasks)
    options.warn_of_model(*(p for p in sets if not p.fluid_torque))


def _sweep_tasks(args: argparse.Namespace, p: Parameters) -> list[Task]:
    """The runs of a sweep: one for each point, or a single one through all flows."""
    axes = sweep.Axis.several(args.vary)
    if args.direction == "held":
        sets = (
            sweep.grid(p, axes)
            if args.random is None
            else sweep.random(p, axes, args.random, args.seed)
        )
        return [running.task(args, each) for each in sets]  # each with settings that suit its set
    if len(axes) != 1 or axes[0].name != "omega_0":
        why = f"direction = {args.direction!r} sweeps omega_0 within one run"
        raise InputError(f"{why}: vary omega_0 and nothing else")
    up = sorted(axes[0].points)
    omegas = {"up": up, "down": up[::-1], "both": up + up[-2::-1]}[args.direction]
    flow, lasts = Flow.staircase(omegas, args.time), args.time * len(omegas)
    return [running.task(args, p.replace(omega_0=omegas[0]), flow=flow, t_end=lasts)]


def _refuse_another_sweep(args: argparse.Namespace, p: Parameters) -> None:
    """Note in the directory which sweep it holds; `InputError` if that is another one, with which
    `collect` would mix this."""
    asked = {name: getattr(args, name) for name in _TOLD_APART}
    asked |= {"engine": args.engine.name} | dataclasses.asdict(p)
    if (path := args.output / "sweep.json").exists():
        with reading_json(path, "sweep") as held:
            differ = [
                f"{name} = {held[name]}, not {value}"
                for name, value in asked.items()
                if held[name] != value
            ]
        if differ:
            other = f"{args.output} holds another sweep ({'; '.join(differ)})"
            raise InputError(f"{other}: choose another directory with --output")
    write_text(path, json.dumps(asked))


def collect(args: argparse.Namespace) -> int:
    with tempfile.TemporaryDirectory() as scratch:
        path = Path(scratch) / "runs.h5" if options.is_table(args.output) else args.output
        count = collection.collect(args.directory, path, args.workers, args.tell)
        of = collection.read(path)
        if path != args.output:
            table.write(args.output, collection.labelled(of))
    print(f"{count} run{'s' * (count != 1)} gathered into {args.output}")
    if said := collection.unsettled(collection.describe(of)):
        options.warn(said)
    return 0
