"""No odd command line gives a traceback, loses or half writes anything, or doesn't end; lines come
from the parsers.

Beside bad values, an option at a time (`drawn`), whole lines (`lines`): several options, each with
a value that may be right, wrong, absurd, a file that is damaged, a directory, a link, an input of
the same line."""

import argparse
import contextlib
import gc
import io
import itertools
import os
import re
import resource
import shlex
import shutil
import signal
import stat
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
import pytest

from compare.bench import settled
from compare.commands import cli, options
from model import InputError
from tests.commands import COMMANDS, METER, NEEDED, ROOT, parser_of, refused, started

ODD = ["", *"x nan -inf 0 -1 1e300 1e-300 1,5 ½ 1_000 0x10 99999999999999999999".split()]
USUAL = "1 2 0.01 0.3".split()
AXES = (
    "eta=0.1:0.3:2 omega_0=10,20 eta=0.1:0.3 mu= =3 eta omega_0=nan:1:2 eta=1e300:2e300:2 "
    "y=0:0.01:2 omega_c=-5:5:2 slip_x=3:1:2 eta=0.2,0.2 mu=0.1:0.2:0 ω=1:2:3"
).split()
WORDS = ["", "ω ₀", *"x prop-1 mujoco event reference svg 1 a=1 -- - y=0.1 omega_c=1e9".split()]
READ = "run.h5 link.h5 hard.h5 öl_ω.h5 set.toml bom.toml flow.csv scene.xml meter.toml".split()
MINE = [*READ, *"mine.html mine.md mine.json mine.png mine.svg".split()]
"""Files of the user."""
ABSURD = (
    "cut.h5 empty.h5 folder.h5 loop.h5 dangling.h5 cut.toml cut.csv bytes.csv cut.xml pipe runs "
    ". .. / ~ a/b.h5"
).split()
NEW = (
    "new.h5 new.html new.md new.json new.png new.svg new.gif new new/deep no/new.h5 /dev/null "
    "/dev/full pipe"
).split()
CUT = {"cut.h5": "run.h5", "cut.toml": "set.toml", "cut.csv": "flow.csv", "cut.xml": "scene.xml"}


def furnish(here: Path, stocked: Path) -> None:
    """A directory of a user, with all that commands read, whole and damaged."""
    # Results would be judged for seconds.
    shutil.copytree(stocked, here, ignore=shutil.ignore_patterns("results"))
    shutil.copy(here / "run.h5", here / "öl_ω.h5")
    (here / "link.h5").symlink_to("run.h5")
    (here / "hard.h5").hardlink_to(here / "run.h5")
    (here / "bom.toml").write_bytes(b"\xef\xbb\xbf" + (here / "set.toml").read_bytes())
    for name in ("mine.html", "mine.md", "mine.json", "mine.png"):
        (here / name).write_text("mine")
    for cut, whole in CUT.items():
        content = (here / whole).read_bytes()
        (here / cut).write_bytes(content[: 2 * len(content) // 3])
    (here / "empty.h5").touch()
    (here / "bytes.csv").write_bytes(bytes(range(256)))
    (here / "folder.h5").mkdir()
    (here / "folder.h5" / "kept").touch()
    (here / "loop.h5").symlink_to("loop.h5")
    (here / "dangling.h5").symlink_to("nothing.h5")
    os.mkfifo(here / "pipe")


def values(action: argparse.Action) -> tuple[Sequence[str], Sequence[str]]:
    """What an option takes, and what else somebody may write."""
    if action.choices:
        return [*action.choices], ["x"]
    if isinstance(action.type, options.Number):
        return USUAL, ODD
    if isinstance(action.type, options.Output):
        right = [f"{name}{action.type.suffixes[0]}" for name in ("new", "mine")]
        return right, [*MINE, *ABSURD, *NEW]
    if action.type is options.results:
        return ["new"], [*MINE, *ABSURD, *NEW]
    if action.type is Path or action.metavar in ("FILE", "OTHER"):
        return READ, [*MINE, *ABSURD]
    return (AXES, AXES) if ":" in str(action.metavar) else (WORDS, WORDS)


def drawn(command: str) -> Iterator[list[str]]:
    """Lines of a command that are wrong: each option with a wrong type, sign or size, nothing, or
    what isn't there; and options that have no effect."""
    given, parser = [command, *NEEDED.get(command, "").split()], parser_of(command)
    yield [*given, "--nonsense"]
    for option, other, together in parser.rules:
        line = list(given)
        for name in [option] if together else [other, option]:
            action = parser._option_string_actions[name]
            right = "event" if action.dest == "engine" else values(action)[0][0]
            line += [name] if action.nargs == 0 else [name, right]
        yield line
    for action in (each for each in parser._actions if each.nargs != 0):
        of_file = action.type in (Path, options.results) or isinstance(action.type, options.Output)
        bad = [["scene.xml/absent.h5" if of_file else "no such thing"]]
        if isinstance(action.type, options.Number):
            numbers = ["x", "nan", "inf", "1" * 400]
            numbers += ["1e300", "1e-300"] * action.dest.startswith("parameter_")
            numbers += ["1e300"] * (action.dest in ("ramp", "staircase", "sine"))
            bad = [
                [text] * (action.nargs if isinstance(action.nargs, int) else 1) for text in numbers
            ]
        if action.dest == "start":
            bad += [[f"omega_c={text}"] for text in ("x", "nan", "1e300", "")]
        if isinstance(action.type, options.Output):  # a name that promises something else
            bad += [
                [name]
                for name in ("mine", "mine.py", *MINE)
                if Path(name).suffix not in action.type.suffixes
            ]
        if action.option_strings:
            yield from ([*given, action.option_strings[-1], *text] for text in [[], *bad])
        else:
            yield from ([command, *text] for text in bad)


def lines(command: str, rng: np.random.Generator) -> Iterator[list[str]]:
    """Odd lines of a command without end."""

    def value(action: argparse.Action) -> str:
        right, wrong = values(action)
        return str(rng.choice(right if rng.random() < 0.6 else wrong))

    actions = [each for each in parser_of(command)._actions if each.dest != "help"]
    optional = [each for each in actions if each.option_strings]
    places = [each for each in actions if not each.option_strings]
    while True:
        words = [command, *NEEDED.get(command, "").split()]
        if places and rng.random() < 0.5:
            words[1 : 1 + len(places)] = [value(each) for each in places]
        for k in rng.choice(
            len(optional), min(int(rng.integers(1, 4)), len(optional)), replace=False
        ):
            action = optional[k]
            several = {0: 0, None: 1, "+": int(rng.integers(1, 4))}
            count = several[action.nargs] if action.nargs in several else int(action.nargs or 1)
            words += [
                str(rng.choice(action.option_strings)),
                *(value(action) for _ in range(count)),
            ]
        yield words


def contents(here: Path) -> dict[str, tuple[int, ...]]:
    """What is there, by name; a file that is written anew is another one."""
    found = dict[str, tuple[int, ...]]()
    for folder, folders, files in os.walk(here):
        for name in (*folders, *files):
            path = os.path.join(folder, name)  # noqa: PTH118  # paths would take most of the time
            of = os.lstat(path)
            kept = () if stat.S_ISDIR(of.st_mode) else (of.st_ino, of.st_size, of.st_mtime_ns)
            found[os.path.relpath(path, here)] = of.st_mode, *kept
    return found


def outputs_of(words: list[str]) -> set[str]:
    """What a line asks to be written, and where commands write unless they are asked."""
    named = set[str]()
    for action in parser_of(words[0])._actions:
        if isinstance(action.type, options.Output) or action.type is options.results:
            named |= {str(action.default)} - {"None"}
            named |= {
                word
                for before, word in itertools.pairwise(words)
                if before in action.option_strings
            }
    named |= {
        str(Path(name).with_suffix(f".failed{suffix}"))
        for name in named
        if (suffix := Path(name).suffix) in (".h5", ".csv")
    }  # samples so far
    return {os.path.normpath(name) for name in named}


def carried_out(words: list[str], criteria: float) -> tuple[int, str, str]:
    """The exit code of a line, what it prints and says of trouble; Ctrl-C comes after so many
    seconds, if need be.

    Raises `TimeoutError` if it doesn't end then within 10 s of processor time."""
    pressed = list[float]()

    def press(number: int, frame: object) -> None:
        if pressed:
            raise TimeoutError
        pressed.append(time.process_time())
        signal.raise_signal(signal.SIGINT)

    out, err = io.StringIO(), io.StringIO()
    usual = signal.signal(signal.SIGALRM, press)
    signal.setitimer(signal.ITIMER_REAL, criteria, 60.0)
    try:
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            code = cli.main(words)
    except SystemExit as done:
        code = int(done.code or 0)
    except KeyboardInterrupt:  # just as it was done
        code = 130
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, usual)
    if pressed:
        if time.process_time() - pressed[0] > 10.0:
            raise TimeoutError
        # what it broke off may have left a file open: that is heard here, where it is ignored
        gc.collect()
    # warnings, and on a slow machine how far it was
    beside = re.compile(r"dualball: warning: |\d+ s: ")
    said = "".join(line for line in err.getvalue().splitlines(True) if not beside.match(line))
    return code, out.getvalue(), said


def problems(
    words: list[str], here: Path, codes: Sequence[int], criteria: float = 10.0
) -> list[str]:
    """All that is wrong with what a line does, which may end with one of these exit codes."""
    before, wrong = contents(here), list[str]()
    try:
        code, out, said = carried_out(words, criteria)
    except Exception as error:
        return [f"{type(error).__name__}: {error}"]
    if code not in codes:
        wrong.append(f"exit code {code}")
    if code == 2 and (
        out or said.count("\n") != 1 or not said.startswith("dualball: error: ") or "\ufffd" in said
    ):
        wrong.append(f"more than a line: {out!r} {said!r}")
    after, asked = contents(here), outputs_of(words)
    for name in (
        name for name in before.keys() | after.keys() if before.get(name) != after.get(name)
    ):
        belongs = any(name == own or name.startswith(f"{own}/") for own in asked)
        if code == 2 or not belongs or (name in before and name not in asked):
            was, is_now = (there.get(name, "nothing") for there in (before, after))
            wrong.append(f"{name}: {was} -> {is_now}, exit code {code}")
        elif name in before and sum(os.path.normpath(word) == name for word in words) > 1:
            wrong.append(f"{name} was read and is lost")
        elif name.endswith(".part") or (
            (here / name).is_dir() and not any((here / name).iterdir())
        ):
            wrong.append(f"{name} is left")
    return wrong


@pytest.fixture
def here(stocked: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The current directory, of a user."""
    made = tmp_path / "a user's Öl"
    furnish(made, stocked)
    monkeypatch.chdir(made)
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr("compare.view.explore.serve", lambda p, port, show: None)
    return made


@pytest.mark.parametrize("command", COMMANDS)
def test_bad_inputs_drawn_from_the_parsers_are_refused(command: str, here: Path) -> None:
    wrong = {shlex.join(words): problems(words, here, [2]) for words in drawn(command)}
    assert len(wrong) > 1
    assert not {line: of for line, of in wrong.items() if of}


# Ctrl-C between open() and with
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
@pytest.mark.parametrize("count", [3, pytest.param(100, marks=pytest.mark.slow)])
@pytest.mark.parametrize("command", COMMANDS)
def test_odd_lines(
    command: str, count: int, here: Path, stocked: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # `test_signals` ends what this one would measure.
    monkeypatch.setattr("compare.validation.validate", lambda *_, **__: [])
    whole, wrong = contents(here), dict[str, list[str]]()
    for words in itertools.islice(
        lines(command, np.random.default_rng(COMMANDS.index(command))), count
    ):
        wrong[shlex.join(words)] = problems(words, here, [0, 1, 2, 130], criteria=1.0)
        if contents(here) != whole:
            shutil.rmtree(here)
            furnish(here, stocked)
            os.chdir(here)
            whole = contents(here)
    assert not {line: of for line, of in wrong.items() if of}


USERS = {  # a slice of some 330 lines that were drawn by hand: what must be in the one line
    "predict --parameters ": "--parameters is empty",
    "simulate --start ": "--start is empty",
    " ": "an argument is empty",
    "simulate --flow /dev/zero": "cannot read /dev/zero: it has more than",
    "simulate --sine 10 5": "then each wave's amplitude in rad/s and frequency",
    "simulate --staircase -1 1 2": "-1",
    "simulate --mu 20%": "'20%' is not a number",
    "forecast cut.xml": "cut.xml is not valid XML, line 2",
    "forecast bytes.csv": "bytes.csv",
    "inspect run.h5/x": "run.h5/x",
    "inspect run.h5 --plot /proc/x.png": "cannot write /proc/x.png",
    "collect run.h5": "it is no directory",
    "sweep --vary omega_0=1:2:3 --scheduler nowhere": "nowhere",
    "basins --across omega_c=0:50:100000 --up y=0:0.01:100000": "1e+10 starts is out of range",
    "calibrate --slowest 5 --fastest 5": "--fastest 5 rad/s is out of range",
    "help nothing": "there is no command 'nothing'",
    "predict --parameters deep.toml": "deep.toml",
    "predict --nu-f -1e-6": "argument --nu-f: -1e-06 m²/s is out of range: it must be >= 0",
    "simulate --ramp 1 -2e0 -1E-3": "duration = -0.001 s is out of range",
    "simulate --start slip=3": "unknown state variable 'slip' (did you mean 'slip_z'?)",
    "simulate -o run.txt": "'run.txt' would hold HDF5 or CSV: its name must end in .h5",
    "simulate --engine event --timestep 0.1": "--timestep is not for event, which takes --rtol",
    "simulate --flow broken.toml": "line 1: no column is called time; there are 'm', '='",
    "simulate --omega-0 5 --ramp 1 2 3": "--omega-0 is for a steady flow, and can't",
    "sweep --vary omega_0=30:10:5": "omega_0 = 30:10 rad s-1 is in the wrong order",
    "sweep --vary omega0=10:30:5": "unknown parameter 'omega0' (did you mean 'omega_0'?)",
    "sweep --vary omega_0=10:30:2.5": "count of omega_0 = 2.5 points is out of range",
    "sweep --vary eta=1:2:400 --vary mu=1:2:400": "160000 runs is out of range",
    "sweep --vary eta=1:2:3 --vary eta=1:2:3": "eta is given 2 ranges: one is enough",
    "sweep --vary eta=0.1:0.2:3 --direction up": "vary omega_0 and nothing else",
    "sweep --vary eta=0.1,0.2,0.3 --random 4": "here eta needs a range: write eta=from:to",
    "judge absent": "No such file or directory; run 'dualball validate -o absent'",
    "validate --claim prop-1 -o broken.toml": "cannot write to broken.toml: it is a file",
    "attractors --follow omega_0=60": "omega_0=from:to",
    "basins --across y=0:1:2 --up y=0:1:3": "across and up are both y: a plane needs two",
    "basins --across y=0:1:2 --up h=0:0.01:2 --c 0": "there are no basins",
    "predict --μ 0.3": "there is no option '--μ' (did you mean '--mu'?)",
    "sweep --vary eta=0.1,0.2 --workers 1e5": "--workers: 100000 is out of range: it must be",
    "cases block-rests -o new": "-o writes all cases: 'block-rests' has no effect",
    "simulate --start omega_c=5 omega_c=6": "--start names omega_c twice",
    "sweep --vary eta=1:2:3 --eta=0.2": "--eta has no effect: eta is varied",
    "basins --across y=0:1:2 --up h=0:0.01:2 --start y=0.1": "--start y has no effect: y",
    "sweep --vary eta=1,2 -o all.h5": "'all.h5' would be a directory, but",
    "--print-completion dos": "takes one of bash",
    "predict --parameters folder.h5": "cannot read folder.h5: Is a directory",
    "predict --set wake --parameters set.toml": "--parameters: not allowed with argument --set",
    "predict --omega-0 1e-320": "the size of what isn't 0 must be >= 1e-20",
    "predict -- --omega-0 25": "there is no option '--'",
    "simulate --time 0.0005": "to hold a time step it must be >= 0.001",
    "simulate --time 1e6 --engine event --sample-interval 1e-3": "for at most 2e+06 samples",
    "simulate --time 1e4 --sample-interval 1e-3": "for at most 2e+06 samples it must be >= 0.005",
    "simulate --start v_h=1e9": "half of R/v_h, the shortest time of the problem",
    "simulate --start v_h=1e9 --engine time-stepping": "for at most 1e+09 steps it must be <=",
    "predict -omega_0 25": "there is no option '-omega-0': it is '--omega-0'",
    "simulate --sine 10 1 1e9 --time 0.1": "half of 1/(2 pi f), the shortest time",
    "simulate --staircase 1": "a flow needs at least one value of omega_0",
    "simulate --flow gap.csv --longest-interval 0.1": "line 3: a gap of 1 s from t = 0 s on",
    "forecast scene.xml --keyframe -1": "has no keyframe '-1'",
    "forecast self.xml": "self.xml: MuJoCo refuses it",
    "sweep --vary drag=stokes,quadratic": "unknown parameter 'drag'",
    "sweep --vary omega_0=1,,2": "omega_0 = '' must be a number in rad s-1",
    "league --engine ./mine.py -o new": "./mine.py can't be used: write it as Python imports it",
    "league --engine os.path -o new": "posixpath has no function build nor step nor state",
    "cases nothing": "sphere-slides-rolls",
    "simulate --start omega_c=5rad/s": "omega_c = '5rad/s' must be a number in rad s-1",
    "design three.toml": "ball: r = [1, 2, 3] must be a number in m, or the two between which",
    "simulate --engine mujoco-free --r 1e-6": "mujoco-free can't build the vessel: ",
    "forecast /dev/null": "cannot read /dev/null: it is not a file",
    "inspect pipe": "cannot read pipe: it is not a file",
    "cases -o pipe": "cannot write to pipe: File exists",
    "cases -o flow.csv/": "'flow.csv/' would be a directory, but its name is that of a file",
    "cases -o dangling.h5": "'dangling.h5' would be a directory",
    "basins --across omega_c=0:10:900 --up h=0:0.06:100": "h = 0.06 m is out of range",
    "predict --parameters a\nb\x1b[1m.toml": r"cannot read a\nb\x1b[1m.toml: No such file",
    "inspect run.h5 --claim prop-1": "cannot read run.h5/summary.json",
    "attractors --engine mujoco --timestep 1": "timestep = 1 s is out of range",
    "sweep --vary omega_0=1:400:3": "half of 1/(2 omega_0), the shortest time of the problem",
    "sweep --vary omega_0=1,2 --start y=-1": "y = -1 m is out of range: to be above the floor",
    "sweep --vary omega_0=1,2 --engine event --start v_h=-1": "v_h = -1 m s-1 is out of range",
    "basins --across y=0:0.001:2 --up h=0:0.01:2 --start omega_c=-1e9": "error: omega_c = "
    "-1e+09 rad s-1 is out of range: for a run of 10 s it must be >= -7003.57",
    "basins --across y=0:0.001:2 --up h=0:0.01:2 --start slip_z=1e9 --mujoco 1": "with slip_z = "
    "1e+09 rad s-1 it must be <= 5e-08 s",
    "attractors --random 1 --omega-0 1e9": "error: omega_0 = 1e+09 rad s-1 is out of range: for a",
    "sweep --vary omega_0=1,2 --time 1e-4": "error: time = 0.0001 s is out of range",
}
TABLES = {
    "broken.toml": b"m = ",
    "gap.csv": b"t,omega_0\n0,1\n1,2\n",
    "self.xml": b'<mujoco><include file="self.xml"/></mujoco>',
    "three.toml": METER.replace("[2e-3, 8e-3]", "[1, 2, 3]").encode(),
    "deep.toml": b"a" + b".a" * 5000 + b" = 1\n",
}


def test_what_users_may_write_is_one_line(here, monkeypatch, capsys):
    monkeypatch.setattr("model.table.LONGEST", 10**6)
    monkeypatch.setattr("compare.campaign.progress.SOON", 60.0)  # loading Dask may take 3 s
    for name, content in TABLES.items():
        (here / name).write_bytes(content)
    before = contents(here)
    said = {line: refused(capsys, *line.split(" ")) for line in USERS}
    assert not {line: told for line, told in said.items() if USERS[line] not in told}
    assert contents(here) == before


@pytest.mark.parametrize("line", ["predict", "calibrate --set reference", "parameters", "cases"])
def test_tables_lose_nothing_in_a_terminal_of_any_width(line, monkeypatch, capsys):
    def words(columns: str) -> set[str]:
        monkeypatch.setenv("COLUMNS", columns)
        assert cli.main(line.split()) == 0
        return set(capsys.readouterr().out.split())

    whole = {word for word in words("1000") if word.strip("─")}
    assert not [
        (columns, lost) for columns in "0 3 20 60 x -5".split() if (lost := whole - words(columns))
    ]


@pytest.mark.parametrize("line", ["predict --set {}", "cases {}", "{}", "compare {} --set air"])
def test_what_is_huge_is_not_repeated(line, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    Path("huge.csv").write_bytes(b"\0" * 100_000)
    said = refused(capsys, *line.format("huge.csv" if "air" in line else "x" * 10_000).split())
    assert len(said) < 1.1 * cli.MOST_SAID


def test_a_name_that_mujoco_cannot_read_is_refused(tmp_path):
    scene = tmp_path / os.fsdecode(b"\xff.xml")
    scene.write_text("<mujoco/>")
    with pytest.raises(InputError, match="no name but in UTF-8"):
        settled.load(scene)


@pytest.mark.parametrize(
    ("variable", "value", "says"),
    [
        ("NUMBA_NUM_THREADS", "0", "numba can't be loaded: Number of threads specified must be > "),
        ("NUMBA_DISABLE_JIT", "1", "Coulomb's law is compiled by numba, which NUMBA_DISABLE_JIT "),
    ],
)
def test_what_a_library_refuses_as_it_is_loaded_is_one_line(variable, value, says, monkeypatch):
    monkeypatch.setenv(variable, value)
    with started("simulate", stderr=subprocess.PIPE) as process:
        out, err = process.communicate()
    assert (process.returncode, out, err.count("\n")) == (2, "", 1)
    assert err.startswith(f"dualball: error: {says}")


def test_a_directory_that_was_deleted_is_one_line(tmp_path):
    gone = tmp_path / "gone"
    gone.mkdir()
    line = f"cd {gone} && rmdir {gone} && exec {sys.executable} -m compare predict -o x.csv"
    env = os.environ | {"PYTHONPATH": str(ROOT)}
    done = subprocess.run(["sh", "-c", line], env=env, capture_output=True, text=True)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.splitlines()[-1] == (
        "dualball: error: cannot write x.csv: No such file or directory"
    )
    assert "Traceback" not in done.stderr


def reading(command, file):
    """A command line that reads a file."""
    if "--parameters" in parser_of(command)._option_string_actions:
        return [command, *NEEDED.get(command, "").split(), "--parameters", file]
    return [command, file, *NEEDED[command].split()[1:]]


OUTPUTS = [
    (command, action.option_strings[-1], suffix)
    for command in COMMANDS
    for action in parser_of(command)._actions
    if isinstance(action.type, options.Output)
    for suffix in action.type.suffixes
]
"""Every command with each of its options that names a file to be written, and what that may end
in."""


@pytest.mark.parametrize(("command", "option", "suffix"), OUTPUTS)
def test_an_output_that_is_read_is_refused(command, option, suffix, tmp_path, capsys):
    """By its own name, by one that leads elsewhere, or by a link."""
    mine, soft, hard = (tmp_path / f"{name}{suffix}" for name in ("mine", "soft", "hard"))
    mine.write_text("mine")
    soft.symlink_to(mine)
    hard.hardlink_to(mine)
    for output in (mine, tmp_path / ".." / tmp_path.name / mine.name, soft, hard):
        assert "is read and would be lost" in refused(
            capsys, *reading(command, mine), option, output
        )
    assert {path.read_text() for path in (mine, soft, hard)} == {"mine"}
    assert soft.is_symlink()


@pytest.mark.parametrize(
    "words",
    [
        "simulate --engine event --time 0.1 -o new.h5",
        "collect runs --workers 0 -o new.h5",
        "inspect run.h5 --plot new.png",
        "inspect run.h5 --plot run.svg",
        "compare run.h5 run.h5 --plot new.svg",
        "attractors --set hopping --start omega_c=20 --time 0.1 -o new.md",
        "basins --across omega_c=1:2:2 --up y=0:0.01:2 --workers 0 --quiet --results new/map -o "
        "new.json",
        "cases -o new/cases",
        "sweep --vary eta=0.1,0.2 --time 0.01 --workers 0 --quiet -o new/runs",
    ],
)
def test_a_full_disk_leaves_nothing_behind(words, stocked, tmp_path, monkeypatch, capsys):
    """Nor does it touch what was there; a limit on the size of files plays the disk that is
    full."""
    monkeypatch.chdir(shutil.copytree(stocked, tmp_path / "here"))
    Path("run.svg").write_text("mine")
    before = {path: path.is_file() and path.read_bytes() for path in Path().rglob("*")}
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    some = 10_000 if "cases" in words else 20  # the first files of cases are whole then
    resource.setrlimit(resource.RLIMIT_FSIZE, (some, hard))
    try:
        assert "File too large" in refused(capsys, words)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert {path: path.is_file() and path.read_bytes() for path in Path().rglob("*")} == before


@pytest.mark.parametrize("there", [False, True])
@pytest.mark.parametrize(
    "words",
    [
        "sweep --vary eta=0.1,0.2 --workers 2 -o new",
        "validate --quick -o new",
        "figures --figure fig-9 -o new",
        "explore --no-browser --port 8931",
    ],
)
def test_too_few_handles_leave_nothing_behind(words, there, tmp_path):
    if there:
        (tmp_path / "new").mkdir()
    limit = f"ulimit -n 16; exec {sys.executable} -m compare {words}"
    env = os.environ | {"PYTHONPATH": str(ROOT)}
    given = {"cwd": tmp_path, "env": env, "capture_output": True, "text": True}
    done = subprocess.run(["sh", "-c", limit], **given)
    assert done.returncode == 2
    assert done.stderr.splitlines()[-1].startswith("dualball: error: ")
    assert "Traceback" not in done.stderr
    assert [*tmp_path.rglob("*")] == [tmp_path / "new"] * there


def test_runs_are_not_gathered_into_one_of_themselves(stocked, tmp_path, capsys):
    runs = shutil.copytree(stocked / "runs", tmp_path / "runs")
    one, link = min(runs.glob("*.h5")), tmp_path / "link.h5"
    before = one.read_bytes()
    link.symlink_to(one)
    for output in (one, link):
        assert "can't be the output, too" in refused(capsys, f"collect {runs} -o {output}")
    assert one.read_bytes() == before


@pytest.mark.parametrize(
    ("command", "name"),
    [
        ("cases", "README.md"),
        ("league --engine mujoco-plain --workers 1", "league.html"),
        ("validate", "report.html"),
    ],
)
def test_a_page_of_somebody_else_is_left_alone(command, name, tmp_path, capsys):
    (tmp_path / name).write_text("mine")
    assert f"{name} is not of this program" in refused(capsys, *command.split(), "-o", tmp_path)
    assert [path.read_text() for path in tmp_path.iterdir()] == ["mine"]
