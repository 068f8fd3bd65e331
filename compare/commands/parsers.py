"""All commands: what runs each, what it is for, its options. Nothing here takes long to load, for
help waits for it."""

import argparse
import textwrap
from collections.abc import Callable, Sequence
from inspect import cleandoc
from pathlib import Path
from typing import NamedTuple, NoReturn

from compare.commands import options
from compare.commands.options import DATA, MAP, MARKDOWN, PAGE, TABLE, Number, Parser
from model import InputError, Parameters, drag
from model.errors import suggestion
from model.parameters import POSITIVE, Range


class Command(NamedTuple):
    """A command of the program."""

    declare: Callable[[Parser], None]
    """Adds its options; the docstring says what it is for."""
    run: str
    """Module of `compare.commands` and function, loaded when it is run."""
    example: str
    """What may follow its name."""

    @property
    def about(self) -> tuple[str, str]:
        """What the command is for, in words that follow its name in help, and what else its own
        help says."""
        text, _, more = cleandoc(self.declare.__doc__ or "").partition("\n\n")
        return text[:1].lower() + text[1:].rstrip("."), more


GROUPS: dict[str, dict[str, Command]] = {}
"""The commands, as help groups them."""


def command(group: str, run: str, example: str) -> Callable[[Callable[[Parser], None]], None]:
    """A decorator that makes a command of the function that declares its options, and has its
    name."""

    def register(declare: Callable[[Parser], None]) -> None:
        GROUPS.setdefault(group, {})[declare.__name__] = Command(declare, run, example)

    return register


@command("study", "validate.run", "--quick")
def validate(parser: Parser) -> None:
    """Hold simulation against theory, claim by claim; the main job.

    The exit code is 1 if a verdict on the engine on trial isn't the expected one. What the
    engines beside it refute is told, and changes nothing."""
    parser.set_defaults(level="default")
    level = parser.add_mutually_exclusive_group()
    for name, time in (("quick", "two to four minutes"), ("full", "an hour or more")):
        takes = f"{time} (default: in between)"
        level.add_argument(f"--{name}", dest="level", action="store_const", const=name, help=takes)
    options.add_own_set(parser)
    options.add_engine_name(parser, None, "only this one is asked; default: the first three")
    parser.add_argument("--list", action="store_true", help="list the claims and stop")
    options.add_workers(parser)
    options.add_directory(parser, "results")
    options.add_verdicts(parser)
    parser.excludes("--list", "--claim", "--engine", "--json", "--parameters", "--set", "--verbose")


@command("study", "validate.judge", "results --claim prop-1")
def judge(parser: Parser) -> None:
    """Judge the stored measurements of a validation again and write report.html anew."""
    of = "directory of a validation"
    parser.add_argument(
        "output", type=Path, nargs="?", default=Path("results"), metavar="DIR", help=of
    )
    options.add_processes(parser)
    options.add_verdicts(parser)


@command("study", "look.figures", "--format pdf")
def figures(parser: Parser) -> None:
    """Draw the paper's figures, with measured points where there are results."""
    where = "directory to write to"
    parser.add_argument(
        "-o", "--output", type=options.results, default=Path("figures"), metavar="DIR", help=where
    )
    stored = "directory of a validation (default results, if it is there)"
    parser.add_argument("--results", type=Path, metavar="DIR", help=stored)
    options.add_own_set(parser)
    one, formats = "only this one, as fig-9", "svg (default), pdf or png"
    for name, what in (("--figure", one), ("--format", formats)):
        parser.add_argument(name, action="append", metavar="NAME", help=f"{what}; may be repeated")
    # it shows what was measured, they what theory says of a set
    parser.excludes("--results", "--parameters", "--set")


@command("the ball", "predict.show_parameters", "--set steel-in-water")
def parameters(parser: Parser) -> None:
    """The parameters of the ball that commands take, their units and ranges; the sets."""
    options.add_parameters(parser)
    options.add_json(parser)


@command("the ball", "predict.run", "--set steel-in-water --omega-0 20")
def predict(parser: Parser) -> None:
    """Stationary solutions, thresholds and operating range, from theory."""
    options.add_parameters(parser)
    written = "write the solutions, a line each, with the thresholds (default: don't)"
    parser.add_argument("-o", "--output", type=TABLE, dest="table", help=written)
    options.add_json(parser, "print JSON instead of tables")


@command("the ball", "simulate.run", "--omega-0 25 -o run.h5")
def simulate(parser: Parser) -> None:
    """One run with any engine, into a file."""
    options.add_engine(parser)
    options.add_parameters(parser)
    group = parser.add_argument_group(
        "flow", "omega_0 over time, in rad/s and s; steady if none is given"
    )
    choice, number = group.add_mutually_exclusive_group(), options.number
    ramp = "rises or falls evenly within so many seconds, and stays"
    held, wave = "levels, each held HOLD s", "a mean with waves on it, frequencies in Hz"
    for name, count, words, what in (
        ("--ramp", 3, ("FROM", "TO", "SECONDS"), ramp),
        ("--staircase", "+", ("HOLD", "LEVEL"), held),
        ("--sine", "+", ("MEAN", "AMPLITUDE FREQUENCY"), wave),
    ):
        choice.add_argument(name, nargs=count, type=number, metavar=words, help=what)
    choice.add_argument("--flow", type=Path, help="measured, as CSV: time, omega_0 on each line")
    longest = "longest time between lines of --flow (default: ten times the usual one)"
    group.add_argument("--longest-interval", type=options.seconds, help=longest)
    options.add_start(parser)
    parser.add_argument("--time", type=options.seconds, help="duration (default 10)")
    options.add_samples(parser)
    written = "file to write: HDF5, or the samples as CSV"
    parser.add_argument("-o", "--output", type=DATA, help=f"{written} (default: none)")
    options.add_json(parser, "print the description as JSON")
    parser.needs("--longest-interval", "--flow")


@command("the ball", "look.inspect", "run.h5 --plot run.png")
def inspect(parser: Parser) -> None:
    """What a trajectory file holds; or how a claim comes to its verdict."""
    what = "a run, or a collection of 'dualball collect'"
    of_claim = "of a claim the directory of a validation (default: results)"
    parser.add_argument("file", type=Path, nargs="?", help=f"{what}; {of_claim}")
    links = "statement, measurement, numbers, verdict, each with file and line"
    parser.add_argument("--claim", metavar="ID", help=f"the chain of a claim: {links}")
    options.add_plot(parser, "the run, or what the runs of a collection read")
    written = "write samples, or the runs of a collection, as a table (default: don't)"
    parser.add_argument("--table", type=TABLE, help=written)
    options.add_json(parser)
    parser.excludes("--claim", "--plot", "--table")


@command("the ball", "look.compare", "mine.csv theory.h5 --plot difference.png")
def compare(parser: Parser) -> None:
    """Two motions side by side; or a meter's measured calibration curve beside theory.

    A curve is a table of omega_0 in rad/s or Q in m3/s, and omega_c in rad/s. Theory is fitted to
    it with friction and drag free, as far as the curve tells them."""
    what = "a run, or time and some of its quantities from CSV or any HDF5 file; or a curve"
    parser.add_argument("a", metavar="FILE", help=what)
    other = "what a motion is compared with, the same"
    parser.add_argument("b", metavar="OTHER", nargs="?", help=other)
    options.add_own_set(parser, "the meter of a curve")
    options.add_plot(parser, "both")
    options.add_json(parser)


@command("the ball", "simulate.run_sweep", "--vary omega_0=10:30:21")
def sweep(parser: Parser) -> None:
    """Many runs over ranges of parameters, resumable."""
    options.add_parameters(parser)
    options.add_start(parser)
    options.add_axes(parser, "--vary", "a range, or NAME=A,B,C; several make a grid", required=True)
    filling = "N points that fill the ranges NAME=FROM:TO instead"
    parser.add_argument("--random", type=options.count, help=filling)
    seed = "seed of the points of --random"
    parser.add_argument("--seed", type=options.seed, default=0, help=seed)
    ways = "held", "up", "down", "both"
    meaning = "held: a run for each point; else one run, omega_0 in steps"
    parser.add_argument("--direction", choices=ways, default="held", help=meaning)
    options.add_engine(parser)
    lasts = "duration of a run that is held, and else of each step"
    parser.add_argument("--time", type=options.seconds, default=30.0, help=lasts)
    options.add_samples(parser)
    means = "store what each run settles to, for collect, and not its samples"
    parser.add_argument("--means-only", action="store_true", help=means)
    options.add_workers(parser)
    parser.add_argument(
        "--batch", type=options.count, default=64, help="most runs that a process takes at once"
    )
    options.add_directory(parser, "sweep")
    options.add_json(parser, "print a summary as JSON")
    parser.needs("--seed", "--random")
    parser.excludes("--random", "--direction")


@command("the ball", "simulate.collect", "sweep -o sweep.h5")
def collect(parser: Parser) -> None:
    """Gather the runs of a directory into one file for xarray.

    Of each run the file holds the parameters, the mean over the last quarter and how sure that is,
    the last case, and why it failed, if it did; no samples. The parameters that vary are its
    dimensions if the runs make a grid, else it has the dimension run."""
    of = "directory of a sweep, or any with files of runs in it"
    parser.add_argument("directory", type=Path, metavar="DIR", help=of)
    parser.add_argument(
        "-o", "--output", type=DATA, default=Path("sweep.h5"), help="file to write: HDF5 or CSV"
    )
    options.add_processes(parser)


@command("the ball", "attractors.run", "--set hopping --random 10")
def attractors(parser: Parser) -> None:
    """What balls come to from many starts: stationary, periodic, chaotic motions."""
    options.add_parameters(parser)
    options.add_engine(parser, "event")
    options.add_start(parser)
    unless = "N random starts, unless one is given by --start"
    parser.add_argument("--random", type=options.count, default=20, help=unless)
    parser.add_argument("--seed", type=options.seed, default=0, help="seed of the random starts")
    parser.add_argument(
        "--time", type=options.seconds, help="how long to follow a run at most (default 60/c)"
    )
    options.add_axes(parser, "--vary", "a range, or NAME=A,B,C; several: grid")
    follow = "follow each periodic motion in a parameter, to where it is born and ends"
    options.add_axes(parser, "--follow", follow, "NAME=FROM:TO")
    tables = "write the tables as Markdown, too (default: don't)"
    parser.add_argument("-o", "--output", type=MARKDOWN, dest="page", help=tables)
    options.add_json(parser)
    parser.excludes("--start", "--random", "--seed")


_PLANE = "--across omega_c=0:150:21 --up slip_x=-900:900:21"


@command("the ball", "attractors.run_basins", f"--set hopping {_PLANE}")
def basins(parser: Parser) -> None:
    """What becomes of the ball from each start of a plane of states; what MuJoCo has run is
    kept."""
    options.add_parameters(parser)
    options.add_start(parser)
    for name in ("across", "up"):
        text = f"a state variable {name} the plane, and its range"
        parser.add_argument(f"--{name}", required=True, metavar="NAME=FROM:TO:COUNT", help=text)
    points = "every N-th point along both axes by MuJoCo, too; 0: none"
    every = Number(allowed=Range(0, 1e6, whole=True))
    parser.add_argument("--mujoco", type=every, default=0, help=points)
    step = "time step of MuJoCo"
    parser.add_argument("--timestep", type=options.seconds, default=2.5e-4, help=step)
    options.add_workers(parser)
    drawn = "write the map: drawn as png, svg or pdf, or its data as json (default: don't)"
    parser.add_argument("-o", "--output", type=MAP, dest="map", help=drawn)
    options.add_directory(parser, "basins", "--results")
    options.add_json(parser, "print the shares as JSON")
    parser.needs("--timestep", "--mujoco")


@command("the ball", "design.run", "meter.toml -o meter.html")
def design(parser: Parser) -> None:
    """The best meter for a fluid and a range of flows, within bounds.

    Best is the one whose operating range reaches farthest beyond the fastest flow, at the worst
    corner of the tolerances. The exit code is 1 if it ends below that flow: then no meter within
    the bounds covers the flows."""
    tables = (
        "TOML, SI units. [fluid] nu_f, rho_f (drag, C_D, gravity). [flow] slowest, fastest, rad/s "
        "(response, s). [bounds] r, R, rho_b, mu, eta (j), each a number or [lowest, highest]; or "
        "several [[material]] with a name and bounds of their own. [tolerances] of mu, eta, r, R, "
        "relative. What is in round brackets may be left out"
    )
    parser.add_argument("file", type=Path, metavar="FILE.toml", help=tables)
    parser.add_argument("-o", "--output", type=PAGE, help="HTML page to write (default: none)")
    random = "seed of the random numbers of the search"
    parser.add_argument("--seed", type=options.seed, default=0, help=random)
    options.add_json(parser, "print JSON instead of tables")


@command("the ball", "calibrate.run", "--parameters mine.toml --swirl 5e4 --plot curve.png")
def calibrate(parser: Parser) -> None:
    """The calibration curve of a meter: range, K-factor, hysteresis, as table and figure.

    Theory's reading while the flow rises from rest and while it falls. The flow is the angular
    velocity of the swirling fluid, omega_0 in rad/s, or with --swirl the volume flow."""
    options.add_parameters(parser)
    known = "the swirler's constant, omega_0 divided by the volume flow; flows are in m3/s then"
    parser.add_argument("--swirl", type=Number("rad m-3", Range(1e-9, 1e12)), help=known)
    ends = (("slowest", "above 0"), ("fastest", "a quarter beyond the last threshold"))
    for end, usual in ends:
        flow = Number("rad s-1 or m3 s-1", Range(1e-12, 1e12))
        parser.add_argument(f"--{end}", type=flow, help=f"{end} flow (default: {usual})")
    points = Number(allowed=Range(2, 1000, whole=True))
    parser.add_argument("--count", type=points, default=60, help="flows between them")
    written = "write the curve (default: don't)"
    parser.add_argument("-o", "--output", type=TABLE, dest="table", help=written)
    options.add_plot(parser, "the curve")
    options.add_json(parser)


@command("the ball", "look.render", "run.h5 -o run.html --at 1 --time 10")
def render(parser: Parser) -> None:
    """A run as a page: the motion in 3-D, contact forces, slip, case."""
    parser.add_argument("file", type=Path, help="a run")
    parser.add_argument("-o", "--output", type=PAGE, required=True, help="HTML page to write")
    at = "time of the run at which the page begins (default: 0)"
    parser.add_argument("--at", type=options.moment, help=at)
    parser.add_argument("--time", type=options.seconds, help="duration, at most (default: 60)")
    parser.add_argument("--speed", type=options.speed, help="default: 0.25; 1 is real time")
    rates = Number(allowed=Range(1, 1000, whole=True))
    parser.add_argument("--rate", type=rates, help="frames a second (default: 60)")


@command("the ball", "look.explore", "--set hopping --port 8081")
def explore(parser: Parser) -> None:
    """A page on this machine to play with: theory as sliders move, the motion in 3-D."""
    options.add_parameters(parser)
    port = Number(allowed=Range(1024, 65535, whole=True))
    parser.add_argument("--port", type=port, default=8080, help="port of 127.0.0.1")
    parser.add_argument("--no-browser", action="store_true", help="open none")


@command("contacts and engines", "bench.run_forecast", "scene.xml --try")
def forecast(parser: Parser) -> None:
    """What the contacts of a MuJoCo model will do: depth, creep, hovering, largest step."""
    parser.add_argument("file", type=Path, metavar="MODEL.xml", help="MJCF or URDF")
    begin = "begin with this keyframe, by name or number"
    parser.add_argument("--keyframe", metavar="NAME", type=str.strip, help=begin)
    driven = "controls: a number for each actuator, or NAME=NUMBER for some"
    parser.add_argument("--ctrl", nargs="+", default=[], metavar="[NAME=]N", help=driven)
    longest = "longest time to wait until the model has settled; 0 takes the state as it stands"
    parser.add_argument("--settle", type=options.moment, default=10.0, help=longest)
    for name, unit, how in (("creep", "m s-1", "creeps faster"), ("depth", "m", "sinks in deeper")):
        limit, more = Number(unit, POSITIVE), f"exit with 1 if a pair {how}, measured"
        parser.add_argument(f"--max-{name}", type=limit, help=more)
    again = "follow the advice and measure again"
    parser.add_argument("--try", dest="tries", action="store_true", help=again)
    parser.add_argument("-o", "--output", type=PAGE, help="HTML page to write")
    options.add_json(parser)


@command("contacts and engines", "bench.run_cases", "-o cases")
def cases(parser: Parser) -> None:
    """The exact contact cases: listed, shown, or as files for engines in any language."""
    parser.add_argument("name", nargs="?", metavar="NAME", help="show this case")
    files = "write JSON, HDF5, MJCF and the scoring rule (default: none)"
    parser.add_argument("-o", "--output", type=options.results, metavar="DIR", help=files)
    options.add_json(parser)


@command("contacts and engines", "bench.run_league", "--quick")
def league(parser: Parser) -> None:
    """All installed engines on the exact cases, as they come and in the best settings known."""
    parser.add_argument("--quick", action="store_true", help="one time step of 2 ms")
    named = (
        "only this one (repeatable), or a module of your own: siconos, mujoco-free, mujoco-plain, "
        f"mujoco-defaults, NAME or NAME-defaults of {options.FOREIGN}, mujoco-warp, newton-xpbd; "
        "newton-kamino, newton-semiimplicit-defaults, newton-vbd-defaults"
    )
    parser.add_argument("--engine", action="append", metavar="NAME", help=named)
    options.add_processes(parser)
    options.add_directory(parser, "results")
    options.add_json(parser)


COMMANDS = {name: each for group in GROUPS.values() for name, each in group.items()}


def declare(commands: options.Commands, name: str) -> None:
    of = COMMANDS[name]
    told = f"dualball {name} {of.example}"
    said = ". ".join(filter(None, of.about))
    texts = {"help": f"as in: {told}", "description": said, "epilog": f"Example: {told}"}
    parser: Parser = commands.add_parser(name, **texts, formatter_class=options.Help)
    parser.set_defaults(run=of.run)
    of.declare(parser)


def parser(words: Sequence[str]) -> Parser:
    """The parser of the command that was asked for, or of their names."""
    parser = Parser(
        prog="dualball",
        usage="dualball [-h] [--version] COMMAND ...",
        description="A physics engine on trial: the dual-point contact ball, in closed form and in "
        "MuJoCo.",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    commands = parser.add_subparsers(
        metavar="COMMAND", required=True, prog="dualball", help=argparse.SUPPRESS
    )
    if words[0] == "--print-completion":
        _complete(parser, commands, words[1:])
    if words[0] in COMMANDS:
        declare(commands, words[0])
        return parser
    if not words[0].startswith("-"):
        meant = suggestion(words[0], COMMANDS)
        raise InputError(f"there is no command {words[0]!r}{meant}; see 'dualball --help'")
    if words[0] not in ("-h", "--help", "--version"):
        meant = suggestion(words[0], ["--help", "--version"])
        raise InputError(f"there is no option {words[0]!r}{meant}")
    listed = []
    for title, group in GROUPS.items():
        listed.append(f"\n{title.capitalize()}:")
        for name, command in group.items():
            commands.add_parser(name)
            about = textwrap.wrap(command.about[0], 86)
            listed.append(f"  {name:<12}" + f"\n{'':14}".join(about))
    parser.add_argument("--version", action="store_true", help="show the version")
    words_of = "print what bash, zsh, fish or tcsh complete words by"
    parser.add_argument("--print-completion", metavar="SHELL", help=words_of)
    parser.epilog = "\n".join([*listed, "\n'dualball COMMAND --help' says more."]).lstrip("\n")
    return parser


def _complete(parser: Parser, commands: options.Commands, shell: Sequence[str]) -> NoReturn:
    """Print the completions of commands, options and files that a shell asks for, and end."""
    try:
        import shtab  # here, because it is optional
    except ImportError as error:
        raise InputError("--print-completion needs shtab: pip install shtab") from error
    if tuple(shell) not in {(each,) for each in shtab.SUPPORTED_SHELLS}:
        raise InputError(f"--print-completion takes one of {', '.join(shtab.SUPPORTED_SHELLS)}")
    for name in COMMANDS:
        declare(commands, name)
    _name_values(commands)
    commands.help = "a command"  # what has no help isn't completed
    print(shtab.complete(parser, shell[0]))
    raise SystemExit(0)


def _name_values(commands: options.Commands) -> None:
    """Let shells complete sets, laws, engines, claims, cases and figures by their names."""
    from compare.bench import exact, league  # here, because nothing else waits for them
    from compare.engines import study
    from compare.report import gallery
    from compare.subjects import catalogue

    known = {
        "--set": Parameters.names(),
        "--drag": drag.LAWS,
        "--engine": study.ENGINES,
        "--claim": [claim.id for claim in catalogue.CLAIMS],
        "--figure": gallery.FIGURES,
        "--format": gallery.FORMATS,
    }
    for name, parser in commands.choices.items():
        own = known | ({"--engine": league.ENTRIES} if name == "league" else {})
        own |= {"name": [case.name for case in exact.cases()]} if name == "cases" else {}
        for action in parser._actions:
            for option in (*action.option_strings, action.dest):
                action.choices = list(own[option]) if option in own else action.choices
