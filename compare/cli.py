"""The program ``dualball``: one command line for everything.

Exit codes: 0 done and as expected, 1 a verdict failed or a run broke down, 2 a mistake in what was asked,
130 interrupted.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from rich.console import Console

import analytic
import compare
from compare import (
    benchmark,
    campaign,
    collection,
    inspection,
    options,
    predict,
    progress,
    results,
    sweep,
    tables,
)
from compare.campaign import Campaign
from compare.claims import Level
from compare.executors import interrupts
from compare.tasks import Task, failed_path, journal_path, store
from mjsim import ContactSettings
from model import InputError, SimulationError, storage
from model.files import check_writable, write_text
from model.trajectory import current_versions


def main(argv: Sequence[str] | None = None) -> int:
    """Run the program with the given arguments, the process's own for None; return its exit code."""
    args = _parser().parse_args(argv)
    try:
        return int(args.run(args))
    except InputError as error:
        print(f"dualball: error: {error}", file=sys.stderr)
        return 2
    except SimulationError as error:
        print(f"dualball: {error}", file=sys.stderr)
        return 1
    except BrokenPipeError:  # the reader of our output has gone, as `| head` does
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except KeyboardInterrupt:
        print("dualball: interrupted; finished runs are kept, the same command goes on from there", file=sys.stderr)
        return 130


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="dualball",
        description="A physics engine on trial: the dual-point contact ball, in closed form and in MuJoCo.",
    )
    parser.add_argument("--version", action="version", version=f"dualball {current_versions()['dualball']}")
    commands = parser.add_subparsers(title="commands", metavar="COMMAND", required=True)

    command = _add(commands, "predict", _predict, "stationary solutions, thresholds and operating range, from theory")
    options.add_parameters(command)
    command.add_argument("--json", action="store_true", help="print JSON instead of tables")

    command = _add(commands, "simulate", _simulate, "one run with any engine, into an HDF5 file")
    options.add_engine(command)
    options.add_parameters(command)
    options.add_flow(command)
    options.add_start(command)
    command.add_argument("--time", type=options.number, default=10.0, metavar="s", help="duration (default 10)")
    command.add_argument(
        "--sample-interval", type=options.number, metavar="s", help="default: a thousandth of the duration"
    )
    command.add_argument("-o", "--output", type=Path, metavar="FILE", help="HDF5 file to write")
    command.add_argument("--json", action="store_true", help="print the last state as JSON")

    command = _add(commands, "validate", _validate, "hold simulation against theory, claim by claim; the main job")
    level = command.add_mutually_exclusive_group()
    level.add_argument("--quick", dest="level", action="store_const", const=Level.QUICK, default=Level.DEFAULT)
    level.add_argument("--full", dest="level", action="store_const", const=Level.FULL, help="everything")
    command.add_argument("--claim", action="append", metavar="ID", help="only this claim (may be repeated)")
    command.add_argument("--list", action="store_true", help="list the claims and stop")
    command.add_argument("-o", "--output", type=Path, default=Path("results"), metavar="DIR")
    options.add_workers(command)
    command.add_argument("--json", action="store_true", help="print the verdicts as JSON")
    command.add_argument("--quiet", action="store_true", help="no progress")

    command = _add(commands, "sweep", _sweep, "many runs over ranges of parameters, resumable")
    options.add_parameters(command)
    options.add_start(command)
    command.add_argument(
        "--vary", action="append", required=True, metavar="NAME=FROM:TO:COUNT",
        help="a range, or NAME=A,B,C; several make a grid",
    )  # fmt: skip
    command.add_argument("--random", type=int, metavar="N", help="N points that fill the ranges NAME=FROM:TO instead")
    command.add_argument("--seed", type=int, default=0)
    command.add_argument(
        "--direction", choices=sweep.DIRECTIONS, default="held",
        help="held: a run for each point; up, down, both: omega_0 in steps within one run (shows hysteresis)",
    )  # fmt: skip
    command.add_argument(
        "--hold", type=options.number, default=20.0, metavar="s", help="time at each step (default 20)"
    )
    options.add_engine(command)
    command.add_argument("--time", type=options.number, default=30.0, metavar="s", help="duration (default 30)")
    command.add_argument("-o", "--output", type=Path, default=Path("sweep"), metavar="DIR")
    options.add_workers(command)
    command.add_argument("--batch", type=int, default=campaign.BATCH, metavar="N", help="runs in one MuJoCo batch")
    command.add_argument("--json", action="store_true", help="print a summary as JSON")
    command.add_argument("--quiet", action="store_true", help="no progress")

    command = _add(commands, "collect", _collect, "gather the runs of a directory into one file for xarray")
    command.add_argument("directory", type=Path, metavar="DIR")
    command.add_argument("-o", "--output", type=Path, default=Path("sweep.h5"), metavar="FILE")

    command = _add(commands, "report", _report, "make report.html anew from stored results")
    command.add_argument("directory", type=Path, nargs="?", default=Path("results"), metavar="DIR")

    command = _add(
        commands, "figures", _figures, "draw the paper's figures, with measured points where there are results"
    )
    command.add_argument("-o", "--output", type=Path, default=Path("figures"), metavar="DIR")
    command.add_argument("--results", type=Path, default=Path("results"), metavar="DIR", help="stored results to draw")
    command.add_argument("--format", action="append", metavar="NAME", help="svg (default), pdf or png; may be repeated")

    command = _add(commands, "inspect", _inspect, "what a trajectory file holds")
    command.add_argument("file", type=Path, metavar="FILE")
    command.add_argument("--plot", type=Path, metavar="FILE", help="draw it (png, svg or pdf)")
    command.add_argument("--json", action="store_true", help="print JSON")

    command = _add(commands, "render", _render, "a picture or film of a run: the scene, contact forces, slip, case")
    command.add_argument("file", type=Path, metavar="FILE")
    command.add_argument("-o", "--output", type=Path, required=True, metavar="FILE", help="picture.png or film.gif")
    command.add_argument("--width", type=int, metavar="PIXELS", help="default 960 for a picture, 640 for a film")
    command.add_argument("--at", type=options.number, metavar="s", help="time of a picture (default: the end)")
    command.add_argument("--from", dest="start", type=options.number, default=0.0, metavar="s", help="start of a film")
    command.add_argument("--seconds", type=options.number, default=6.0, help="length of a film (default 6)")
    command.add_argument("--speed", type=options.number, default=0.25, help="1 is real time (default 0.25)")
    command.add_argument("--rate", type=int, default=20, help="frames a second (default 20)")

    command = _add(
        commands, "grade", _grade, "a score card for MuJoCo contact settings: yours, dualball's, MuJoCo's own"
    )
    options.add_native(command)
    command.add_argument("-o", "--output", type=Path, metavar="FILE", help="HTML page to write")
    command.add_argument("--json", action="store_true", help="print JSON")

    command = _add(commands, "view", _view, "the ball in MuJoCo's viewer, driven by the study's own loop")
    options.add_parameters(command)
    options.add_flow(command)
    options.add_start(command)
    command.add_argument("--timestep", type=options.number, metavar="s", help="time step")
    command.add_argument("--speed", type=options.number, default=1.0, help="1 is real time (default)")

    command = _add(commands, "benchmark", _benchmark, "cost of the loop round MuJoCo's step, as ratios within one run")
    command.add_argument("--json", action="store_true", help="print JSON")
    return parser


def _add(commands: Any, name: str, run: Any, summary: str) -> argparse.ArgumentParser:
    command: argparse.ArgumentParser = commands.add_parser(name, help=summary, description=summary)
    command.set_defaults(run=run)
    return command


def _predict(args: argparse.Namespace) -> int:
    prediction = predict.predict(options.parameters(args))
    if args.json:
        print(json.dumps(prediction.to_mapping(), indent=1))
    else:
        Console().print(*predict.tables(prediction), sep="\n")
    return 0


def _simulate(args: argparse.Namespace) -> int:
    p = options.parameters(args)
    task = Task(
        engine=args.engine, parameters=p, x0=tuple(options.start(args).tolist()), t_end=args.time,
        flow=options.flow(args), sample_interval=args.sample_interval, settings=_settings(args),
    )  # fmt: skip
    if args.output:
        check_writable(args.output)
    with tempfile.TemporaryDirectory() as scratch, interrupts() as interrupted:
        path = args.output or Path(scratch) / "run.h5"
        try:
            (failure,) = store([task], [path], stop=interrupted)
        except KeyboardInterrupt:  # the second Ctrl-C
            print("dualball: interrupted; no samples are kept", file=sys.stderr)
            return 130
        kept = failed_path(path) if failure else path
        _show(inspection.describe(kept), args.json)
        if args.output and not failure and not args.json:
            print(f"written to {args.output}")
        if failure:
            print(f"dualball: the simulation {failure}; {_what_is_kept(task, args.output)}", file=sys.stderr)
        return 130 if interrupted() else 1 if failure else 0


def _what_is_kept(task: Task, output: Path | None) -> str:
    """What is left of a run that broke down or was stopped."""
    if output is None:
        return "nothing is kept without --output"
    journal = journal_path(task, output)
    goes_on = f", and the same command goes on from what {journal} holds" if journal and journal.exists() else ""
    return f"its samples so far are kept in {failed_path(output)}{goes_on}"


def _show(told: dict[str, Any], as_json: bool) -> None:
    """Print what `inspection.describe` found."""
    if as_json:
        print(json.dumps(told, indent=1))
    else:
        Console().print(inspection.table(told))


def _settings(args: argparse.Namespace) -> ContactSettings | analytic.Settings:
    """Numerical settings of the engine that was chosen, from the options of `options.add_engine`."""
    if args.engine == "mujoco":
        for name in ("rtol", "restitution"):
            if getattr(args, name) is not None:
                raise InputError(f"--{name} is for the engines event and time-stepping, not for mujoco")
        return ContactSettings() if args.timestep is None else ContactSettings.at(args.timestep)
    if args.timestep is not None and args.engine == "event":
        raise InputError("--timestep is for the engines mujoco and time-stepping: event has a tolerance, --rtol")
    given = {"step": args.timestep, "rtol": args.rtol, "restitution": args.restitution}
    return analytic.Settings(method=args.engine, **{k: v for k, v in given.items() if v is not None})


def _validate(args: argparse.Namespace) -> int:
    if args.list:
        Console().print(tables.claims(compare.CLAIMS))
        return 0
    with progress.shown(quiet=args.quiet or args.json) as show:
        verdicts = compare.validate(
            args.output,
            level=args.level,
            claims=args.claim,
            workers=options.workers(args),
            limit=args.limit,
            progress=show,
        )
    if args.json:
        print(json.dumps([results.describe(verdict) for verdict in verdicts], indent=1))
    else:
        console = Console()
        for table in tables.verdicts(verdicts):
            console.print(table)
        console.print(f"report: {args.output / results.REPORT}")
    return 0 if all(verdict.passed for verdict in verdicts) else 1


def _sweep(args: argparse.Namespace) -> int:
    axes = [sweep.Axis.parse(text) for text in args.vary]
    p = options.parameters(args)
    template = Task(
        engine=args.engine,
        parameters=p,
        x0=tuple(options.start(args).tolist()),
        t_end=args.time,
        settings=_settings(args),
    )
    if args.direction != "held":
        tasks = [sweep.staircase(template, sweep.levels(axes, args.direction), args.hold)]
    elif args.random is not None:
        tasks = sweep.held(template, sweep.random(p, axes, args.random, args.seed))
    else:
        tasks = sweep.held(template, sweep.grid(p, axes))
    with (
        progress.shown(quiet=args.quiet or args.json) as show,
        Campaign(args.output, options.workers(args), args.batch, args.limit) as work,
    ):
        work.report = lambda now: show("sweep", now.done, now.total, now.failed)
        failures = work.complete(tasks)
    told = {
        "directory": str(args.output), "runs": len(tasks), "whole": len(tasks) - len(failures),
        "failures": campaign.listed(failures),
    }  # fmt: skip
    if args.json:
        print(json.dumps(told, indent=1))
    else:
        print(f"{told['whole']} of {len(tasks)} runs are whole, in {args.output}; gather them with: ", end="")
        print(f"dualball collect {args.output}")
        for failure in failures:
            print(f"failed: {failure.task.key}: {failure.reason}", file=sys.stderr)
    return 1 if failures else 0


def _collect(args: argparse.Namespace) -> int:
    count = collection.collect(args.directory, args.output)
    print(f"{count} runs gathered into {args.output}")
    return 0


def _benchmark(args: argparse.Namespace) -> int:
    figures = benchmark.run()
    if args.json:
        print(json.dumps(figures.to_mapping(), indent=1))
    else:
        Console().print(benchmark.table(figures))
    return 0


def _report(args: argparse.Namespace) -> int:
    from compare import report  # here, because drawing takes a second to load

    print(report.write(args.directory))
    return 0


def _figures(args: argparse.Namespace) -> int:
    from compare.figures import gallery  # here, because drawing takes a second to load

    for name, gap in gallery.write(args.output, args.results, tuple(args.format or ["svg"])):
        print(f"{args.output / name}: {gap or 'written'}")
    return 0


def _view(args: argparse.Namespace) -> int:
    from compare import viewer  # here, because nothing else needs it

    p = options.parameters(args)
    settings = (
        ContactSettings.for_problem(p) if args.timestep is None else ContactSettings.for_problem(p, args.timestep)
    )
    viewer.view(p, options.start(args), options.flow(args), settings, args.speed)
    return 0


def _render(args: argparse.Namespace) -> int:
    from compare import render  # here, because drawing takes a second to load

    film = {name: getattr(args, name) for name in ("start", "seconds", "speed", "rate")}
    print(render.write(storage.load(args.file), args.output, args.at, args.width, **film))
    return 0


def _grade(args: argparse.Namespace) -> int:
    from compare import grade  # here, because nothing else needs it

    if args.output:
        check_writable(args.output)
    yours = options.native(args)
    if yours.note:
        print(f"dualball: {yours.note}", file=sys.stderr)
    with progress.shown(quiet=args.json) as show:
        columns = grade.grade(yours, progress=lambda name, done, total: show(f"grade {name}", done, total, 0))
    if args.output:
        told = f"{options.describe_native(args)} {yours.note}".rstrip()
        write_text(args.output, grade.html(columns, told))
    if args.json:
        print(json.dumps([column.to_mapping() for column in columns], indent=1))
        return 0
    console = Console()
    console.print(grade.table(columns))
    for item in columns[0].advice:
        console.print(f"• {item}", markup=False, highlight=False)
    return 0


def _inspect(args: argparse.Namespace) -> int:
    if collection.is_collection(args.file):
        told = collection.describe(args.file)
        if args.json:
            print(json.dumps(told, indent=1))
        else:
            Console().print(collection.table(told))
        return 0
    if args.plot:
        from compare.figures import trajectory  # here, because drawing takes a second to load

        trajectory.plot(storage.load(args.file), args.plot)
    _show(inspection.describe(args.file), args.json)
    return 0


if __name__ == "__main__":
    sys.exit(main())
