"""Shows what is stored: ``figures``, ``inspect``, ``compare``, ``render``; and ``explore``, what theory says."""

from __future__ import annotations

import argparse
from pathlib import Path

from compare.commands import options
from compare.kit import collection, drawing
from compare.view import inspection
from model import InputError, storage
from model.parameters import NOT_NEGATIVE, Range


def add(commands: options.Commands) -> None:
    """Declare the commands."""
    stored = "directory of a validation"
    command = options.command(commands, "figures", figures, "--format pdf")
    command.add_argument(
        "-o", "--output", type=options.results, default=Path("figures"), metavar="DIR", help="directory to write to"
    )
    command.add_argument("--results", type=Path, metavar="DIR", help=f"{stored} (default results, if it is there)")
    options.add_own_set(command)
    command.add_argument("--format", action="append", metavar="NAME", help="svg (default), pdf or png; may be repeated")

    command = options.command(commands, "inspect", inspect, "run.h5 --plot run.png")
    command.add_argument("file", type=Path, help="a run, or a collection of 'dualball collect'")
    command.add_argument("--plot", type=options.FIGURE, help="draw the run: png, svg or pdf (default: don't)")
    options.outputs(command)

    command = options.command(commands, "compare", compare, "mine.csv theory.h5 --plot difference.png")
    what = "a run, or time and some of its quantities from CSV or any HDF5 file"
    command.add_argument("a", metavar="FILE", help=what)
    command.add_argument("b", metavar="OTHER", help="what it is compared with, the same")
    command.add_argument("--plot", type=options.FIGURE, help="draw both: png, svg or pdf (default: don't)")
    options.outputs(command)

    command = options.command(commands, "render", render, "run.h5 -o film.gif --at 1 --time 10")
    command.add_argument("file", type=Path, help="a run")
    command.add_argument("-o", "--output", type=options.FILM, required=True, help="picture.png, film.gif, or page.html")
    for option, kind, usual, meaning in (
        ("width", options.Number(allowed=Range(160, 1920, whole=True)), None, "pixels (default: 960, of a film 640)"),
        ("at", options.moment, None, "time of the run: of a picture (default: the end), where a film or page begins"),
        ("time", options.seconds, None, "duration of a film, at most (default: 6, of a page 60)"),
        ("speed", options.speed, 0.25, "speed of a film or page; 1 is real time"),
        (
            "rate",
            options.Number(allowed=Range(1, 1000, whole=True)),
            None,
            "frames a second (default: 20, of a page 60)",
        ),
    ):
        command.add_argument(f"--{option}", type=kind, default=usual, help=meaning)
    radii, names = options.Number("radii", NOT_NEGATIVE), ("FORCE", "SLIP")
    lengths = "lengths of the arrows of a force m g and of the fastest slip (default 3 3)"
    command.add_argument("--arrows", nargs=2, type=radii, default=(3.0, 3.0), metavar=names, help=lengths)

    command = options.command(commands, "explore", explore, "--set hopping --port 8081")
    options.add_parameters(command)
    port = options.Number(allowed=Range(1024, 65535, whole=True))
    command.add_argument("--port", type=port, default=8080, help="port of 127.0.0.1")
    command.add_argument("--no-browser", action="store_true", help="open none")


def figures(args: argparse.Namespace) -> int:
    """Draw every figure; one whose results are missing is named."""
    from compare import gallery as registry
    from compare import validation  # here, because drawing takes a second to load

    if args.results and not args.results.is_dir():
        raise InputError(f"cannot read {args.results}: there is no such directory")
    if own := list(options.own_set(args).values()):
        if args.results:
            raise InputError(
                "--results shows what was measured, --set and --parameters what theory alone says of a set"
            )
        chosen = registry.of_set(*own)
    else:
        chosen = registry.of_results(validation.stored_material(args.results or Path("results")))
    for name, gap in registry.write(args.output, chosen, args.format or ["svg"]):
        print(f"{args.output / name}: {gap or 'written'}")
    return 0


def inspect(args: argparse.Namespace) -> int:
    """Describe a run or a collection."""
    if gathered := collection.describe(args.file):
        if args.plot:
            raise InputError(f"{args.file} is a collection: only a run can be drawn")
        options.show(gathered, args.json, collection.table(gathered))
        return 0
    if args.plot:
        from compare.view import motions  # here, because drawing takes a second to load

        drawing.save(motions.draw(storage.load(args.file)), args.plot)
    about = inspection.describe(args.file)
    options.show(about, args.json, inspection.table(about))
    return 0


def compare(args: argparse.Namespace) -> int:
    """Lay two motions side by side."""
    from compare import testing
    from compare.view import motions  # here, because drawing takes a second to load

    a, b = testing.read(args.a), testing.read(args.b)
    about = motions.describe(a, b)
    if args.plot:
        drawing.save(motions.draw_both(a, b), args.plot)
    options.show(about, args.json, *motions.tables(about))
    return 0


def render(args: argparse.Namespace) -> int:
    """Draw a picture, a film, or a page to look round in."""
    from compare.view import render  # here, because drawing takes a second to load

    asked = {name: getattr(args, name) for name in ("at", "time", "width", "speed", "rate")}
    force, slip = args.arrows
    print(render.write(storage.load(args.file), args.output, **asked, force_arrow=force, slip_arrow=slip))
    return 0


def explore(args: argparse.Namespace) -> int:
    """Serve the page to play with."""
    from compare.view import explore as served  # here, because nothing else needs it

    served.serve(options.parameters(args), args.port, not args.no_browser)
    return 0
