"""``dualball search`` and ``dualball basins``: where the ball hops for ever, over parameters and over starts."""

from __future__ import annotations

import argparse
import dataclasses
from pathlib import Path

from rich.markdown import Markdown

from analytic.simulation.ensemble import interval
from compare.commands import options, running
from compare.kit import progress
from compare.kit.sweep import Axis
from compare.subjects.attractors import search
from compare.subjects.attractors.search import BOX, FATES, Search, Searched
from model.files import write_text
from model.kinematics import UNITS, VARIABLES
from model.parameters import POSITIVE, Range, check_number


def add(commands: options.Commands) -> None:
    """Declare the commands."""
    command = options.command(commands, "search", run, "where in parameter space the ball hops for ever, resumable")
    command.add_argument("--sets", type=int, default=500, metavar="N", help="parameter sets (default 500)")
    command.add_argument("--starts", type=int, default=5, metavar="N", help="random starts of each (default 5)")
    command.add_argument("--seed", type=int, default=0)
    options.add_axes(command, "--range", f"part of the box; {', '.join(BOX)}", "NAME=FROM:TO")
    running.add_workers(command)
    command.add_argument("--kept", type=Path, nargs="+", metavar="FILE", help="show what --save wrote instead")
    command.add_argument("--save", type=Path, metavar="FILE", help="write the sets with hopping as JSON")
    command.add_argument("--page", type=Path, metavar="FILE", help="write the table as Markdown")
    options.outputs(command, "search", "print the sets with hopping as JSON")

    command = options.command(
        commands, "basins", plane, "what becomes of the ball from each start of a plane of states, resumable"
    )
    options.add_parameters(command)
    running.add_start(command)
    for name, example in (("across", "omega_c=0:150:61"), ("up", "slip_x=-900:900:61")):
        command.add_argument(f"--{name}", required=True, metavar="NAME=FROM:TO:COUNT", help=f"as {example}")
    command.add_argument(
        "--mujoco", type=int, default=0, metavar="N", help="MuJoCo, too, on every N-th point both ways"
    )
    command.add_argument("--timestep", type=options.number, default=2.5e-4, metavar="s", help="that of MuJoCo")
    running.add_workers(command)
    command.add_argument("--save", type=Path, metavar="FILE", help="write the map as JSON")
    options.outputs(command, "basins", "print the shares as JSON")


def run(args: argparse.Namespace) -> int:
    """Search what hasn't been searched yet, and show the table."""
    if args.kept:
        searches = [Searched.load(path) for path in args.kept]
    else:
        count, starts = (
            int(check_number(name, getattr(args, name), name, Range(1, whole=True))) for name in ("sets", "starts")
        )
        axes = [Axis.parse(text, dict.fromkeys(BOX, "1"), "group", POSITIVE) for text in args.range]
        asked = Search(BOX | {axis.name: axis.ends for axis in axes}, starts, args.seed)
        with progress.shown(args.quiet or args.json) as show:
            searches = [search.run(args.output, asked, count, running.workers(args), show)]
    if args.save:
        searches[0].save(args.save)
    if args.page:
        write_text(args.page, search.page(*searches))
    options.show([dataclasses.asdict(each) for each in searches], args.json, Markdown(search.page(*searches)))
    return 0


def plane(args: argparse.Namespace) -> int:
    """Map the basins and show their shares."""
    p = options.parameters(args)
    coarse = int(check_number("mujoco", args.mujoco, "points", Range(0, whole=True)))
    units = dict(zip(VARIABLES, UNITS, strict=True))
    across, up = (Axis.parse(text, units, "state variable") for text in (args.across, args.up))
    with running.campaign(args, "basins") as campaign:
        mapped = search.basins(campaign, p, running.start(args)._asdict(), across, up, coarse, args.timestep)
    if args.save:
        mapped.save(args.save)
    shares = {fate: mapped.share(fate) for fate in FATES if mapped.share(fate)[0]}
    differ = mapped.differences().tolist() if coarse else []
    said = []
    for fate, (hits, of) in shares.items():
        low, high = interval(hits, of)
        said.append(f"{fate:>14}: {100 * hits / of:5.1f} % of {of} starts ({100 * low:.1f} to {100 * high:.1f} %)")
    where = f"MuJoCo differs at {len(differ)} of {mapped.mujoco.size} starts, so many cells from a boundary: {differ}"
    data = {"shares": shares, "mujoco": mapped.mujoco.size, "differences": differ}
    options.show(data, args.json, *said, *([where] if coarse else []))
    return 0
