"""``dualball forecast``: what the contacts of any MuJoCo model will do, and the one option to change."""

from __future__ import annotations

import argparse
import dataclasses
import sys
from pathlib import Path
from typing import Any

import mujoco
from rich.text import Text

from compare.bench import forecast
from compare.commands import options
from compare.kit import pages
from model.files import check_writable, write_text
from model.parameters import NOT_NEGATIVE, POSITIVE, check_number

LOOK: Any = {"no_wrap": True, "padding": (0, 1, 0, 0), "pad_edge": False}


def add(commands: options.Commands) -> None:
    """Declare the command."""
    command = options.command(commands, "forecast", foretold, "scene.xml --try")
    command.add_argument("file", type=Path, metavar="MODEL.xml", help="MJCF or URDF")
    command.add_argument("--keyframe", metavar="NAME", help="begin with this keyframe, by name or number")
    text = "longest time to wait until the model has settled; 0 takes the state as it stands"
    command.add_argument("--settle", type=options.number, metavar="s", default=10.0, help=text)
    text = "exit with 1 if a pair creeps faster, measured"
    command.add_argument("--max-creep", type=options.number, metavar="m/s", help=text)
    text = "exit with 1 if a pair sinks in deeper, measured"
    command.add_argument("--max-depth", type=options.number, metavar="m", help=text)
    command.add_argument("--try", dest="tries", action="store_true", help="make the advised change and measure again")
    command.add_argument("-o", "--output", type=Path, help="HTML page to write")
    options.outputs(command)


def foretold(args: argparse.Namespace) -> int:
    """Settle the model, print the forecast, and check the limits."""
    check_number("--settle", args.settle, "s", NOT_NEGATIVE)
    for name in ("max_creep", "max_depth"):
        if getattr(args, name) is not None:
            check_number(
                f"--{name.replace('_', '-')}", getattr(args, name), "m/s" if "creep" in name else "m", POSITIVE
            )
    if args.output:
        check_writable(args.output)
    good = {"creep": args.max_creep or forecast.CREEP, "depth": args.max_depth}
    heard = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(
        lambda _: None
    )  # or it writes a log where the user is; what it warns of is in the table
    try:
        model, data = forecast.load(args.file, args.keyframe)
        found = forecast.forecast(model, data, forecast.settle(model, data, args.settle), **good)
        after = None
        if args.tries and found.change:
            found, after = forecast.tried(model, data, found, args.settle, **good)
    except forecast.UnsettledError as error:
        print(f"dualball: {args.file}: {error}", file=sys.stderr)
        return 1
    finally:
        mujoco.set_mju_user_warning(heard)
    if args.output:
        write_text(args.output, forecast.html(found, after, str(args.file)))
    shown: list[Any] = [pages.table(forecast.title(found), forecast.rows(found), **LOOK)]
    shown += [Text(f"• {line}") for line in forecast.sentences(found)]
    if after:
        shown += [Text(""), pages.table("After the change", forecast.rows(after), **LOOK)]
    options.show({"before": dataclasses.asdict(found), "after": after and dataclasses.asdict(after)}, args.json, *shown)
    beyond = [
        f"{pair.name}: {name} {value:.3g} {unit}, more than {limit:g}"
        for pair in found.pairs
        for name, value, limit, unit in (
            ("creep", pair.creep_measured, args.max_creep, "m/s"),
            ("depth", pair.depth_measured, args.max_depth, "m"),
        )
        if limit and value > limit
    ]
    for line in beyond:
        print(f"dualball: {line}", file=sys.stderr)
    return int(bool(beyond))
