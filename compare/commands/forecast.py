"""``dualball forecast``: what the contacts of any MuJoCo model will do, and the one option to change."""

from __future__ import annotations

import argparse
import dataclasses
import itertools
import sys
from pathlib import Path
from typing import Any

import mujoco
from rich.text import Text

from compare.bench import forecast
from compare.commands import options
from compare.kit import pages
from model.files import write_text
from model.parameters import POSITIVE

LOOK: Any = {"no_wrap": True, "padding": (0, 1, 0, 0), "pad_edge": False}


def add(commands: options.Commands) -> None:
    """Declare the command."""
    command = options.command(commands, "forecast", foretold, "scene.xml --try")
    command.add_argument("file", type=Path, metavar="MODEL.xml", help="MJCF or URDF")
    command.add_argument("--keyframe", metavar="NAME", help="begin with this keyframe, by name or number")
    longest = "longest time to wait until the model has settled; 0 takes the state as it stands"
    command.add_argument("--settle", type=options.moment, default=10.0, help=longest)
    for name, unit, how in (("creep", "m s-1", "creeps faster"), ("depth", "m", "sinks in deeper")):
        limit = options.Number(unit, POSITIVE)
        command.add_argument(f"--max-{name}", type=limit, help=f"exit with 1 if a pair {how}, measured")
    command.add_argument("--try", dest="tries", action="store_true", help="make the advised change and measure again")
    command.add_argument("-o", "--output", type=options.written, help="HTML page to write")
    options.outputs(command)


def foretold(args: argparse.Namespace) -> int:
    """Settle the model, print the forecast, and check the limits."""
    good = {"creep": args.max_creep or forecast.CREEP, "depth": args.max_depth}
    heard = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(lambda _: None)  # it would write a log here; what it warns of is in the table
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
    shown: list[Any] = [pages.table(title, rows, **LOOK) for title, rows in forecast.tables(found)]
    shown += [Text(f"• {line}") for line in forecast.sentences(found)]
    if after:
        shown += [Text(""), pages.table(*forecast.changed(found, after), **LOOK)]
    options.show({"before": dataclasses.asdict(found), "after": after and dataclasses.asdict(after)}, args.json, *shown)
    limits = ("creep", "m/s", args.max_creep), ("depth", "m", args.max_depth)
    code = 0
    for pair, (name, unit, limit) in itertools.product(found.pairs, limits):
        value = getattr(pair, f"{name}_measured")
        if limit and value > limit:
            print(f"dualball: {pair.name}: {name} {value:.3g} {unit}, more than {limit:g}", file=sys.stderr)
            code = 1
    return code
