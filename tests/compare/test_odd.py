"""No odd command line gives a traceback, loses or half writes anything, or doesn't end; lines come from the parsers.

Beside bad values (`drawn`) whole lines (`lines`): several options, each with a value that may be right, wrong, absurd,
a file that is damaged, a directory, a link, an input of the same line.
"""

import argparse
import contextlib
import gc
import hashlib
import io
import itertools
import os
import shlex
import shutil
import signal
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

import analytic
from compare.commands import cli, options
from model import Parameters, storage
from tests.commands import COMMANDS, METER, NEEDED, SCENE, parser_of, refused

NUMBERS = ("x", "nan", "inf", "-1", "0", "1e300", "1e-300", "1" * 400)


def drawn(command: str) -> Iterator[list[str]]:
    """Bad inputs by a command's own parser: of each option a wrong type, sign, size, nothing, or what isn't there; and
    options that have no effect."""
    yield ["--nonsense"]
    parser = parser_of(command)
    for option, other, together in parser.rules:
        both = (parser._option_string_actions[each] for each in ([option] if together else [other, option]))
        yield [word for each in both for word in (each.option_strings[-1], *right(each))]
    for action in parser._actions:
        if action.nargs == 0:
            continue
        option = action.option_strings[-1:]
        values = [[]] if option else []
        if isinstance(action.type, options.Number):
            bad = [text for text in NUMBERS if refuses(action.type, text)]
            bad += ["1e300", "1e-300"] if action.dest.startswith("parameter_") else []
            bad += ["1e300"] if action.dest in ("ramp", "staircase", "sine") else []
            values += [[text] * (action.nargs if isinstance(action.nargs, int) else 1) for text in bad]
        else:
            of_file = action.type in (Path, options.results) or isinstance(action.type, options.Output)
            values.append(["scene.xml/absent.h5" if of_file else "no such thing"])
        if action.dest == "start":
            values += [[f"omega_c={text}"] for text in ("x", "nan", "1e300", "")]
        yield from ([*option, *value] for value in values)


def right(action: argparse.Action) -> list[str]:
    """A value that an option takes, if it takes any."""
    values: list[str] = [*action.choices] if action.choices else []
    if isinstance(action.type, options.Number):
        values = ["1"]
    elif isinstance(action.type, options.Output):
        values = [f"new{action.type.suffixes[0]}"]
    return [] if action.nargs == 0 else [*values, "event" if action.dest == "engine" else "set.toml"][:1]


def refuses(parse: options.Number, text: str) -> bool:
    try:
        parse(text)
    except argparse.ArgumentTypeError:
        return True
    return False


@pytest.mark.parametrize("command", COMMANDS)
def test_bad_inputs_drawn_from_the_parsers(command, tmp_path, monkeypatch, capsys):
    """Each is refused in a line, within 10 s, and leaves no file; there are more than a thousand."""
    furnish(tmp_path)
    monkeypatch.chdir(tmp_path)
    before, given = sorted(Path().rglob("*")), NEEDED.get(command, "").split()

    def late(*_: object) -> None:
        pytest.fail(f"{words} took more than 10 s")

    signal.signal(signal.SIGALRM, late)
    count = 0
    for words in drawn(command):
        signal.alarm(10)
        try:
            refused(capsys, command, *(given if words[0].startswith("-") else []), *words)
        finally:
            signal.alarm(0)
        assert sorted(Path().rglob("*")) == before, words
        count += 1
    assert count > 1


ODD = ("x", "", "nan", "-inf", "0", "-1", "1e300", "1e-300", "1,5", "½", "1_000", "0x10", "99999999999999999999")
USUAL = ("1", "2", "0.01", "0.3")
AXES = ("eta=0.1:0.3:2", "omega_0=10,20", "eta=0.1:0.3", "mu=", "=3", "eta", "omega_0=nan:1:2", "eta=1e300:2e300:2",
        "y=0:0.01:2", "omega_c=-5:5:2", "slip_x=3:1:2", "eta=0.2,0.2", "mu=0.1:0.2:0", "ω=1:2:3")  # fmt: skip
WORDS = ("", "x", "ω ₀", "prop-1", "mujoco", "event", "reference", "svg", "1", "a=1", "--", "-", "y=0.1", "omega_c=1e9")
READ = ["run.h5", "link.h5", "hard.h5", "öl_ω.h5", "set.toml", "bom.toml", "flow.csv", "scene.xml", "meter.toml"]
MINE = [*READ, "mine.html", "mine.md", "mine.json", "mine.png", "mine.svg"]
"""Files of the user."""
ABSURD = ["cut.h5", "empty.h5", "folder.h5", "loop.h5", "dangling.h5", "cut.toml", "cut.csv", "bytes.csv", "cut.xml",
          "pipe", "runs", ".", "..", "/", "~", "a/b.h5"]  # fmt: skip
NEW = ["new.h5", "new.html", "new.md", "new.json", "new.png", "new.svg", "new.gif", "new", "new/deep", "no/new.h5",
       "/dev/null", "/dev/full", "pipe"]  # fmt: skip
CUT = {"cut.h5": "run.h5", "cut.toml": "set.toml", "cut.csv": "flow.csv", "cut.xml": "scene.xml"}


def furnish(here: Path) -> None:
    """A directory of a user, with all that commands read, whole and damaged."""
    run = analytic.simulate(Parameters.named("reference").replace(omega_0=25.0), [0] * 6, 0.2)
    (here / "runs").mkdir(parents=True)
    storage.save(run, here / "run.h5")
    for copy in ("runs/one.h5", "öl_ω.h5"):
        shutil.copy(here / "run.h5", here / copy)
    (here / "link.h5").symlink_to("run.h5")
    (here / "hard.h5").hardlink_to(here / "run.h5")
    Parameters.named("steel-in-water").save(here / "set.toml")
    (here / "bom.toml").write_bytes(b"\xef\xbb\xbf" + (here / "set.toml").read_bytes())
    (here / "flow.csv").write_text("time (s); omega_0 (rad/s)\n0; 10,5\n1; 20\n")
    (here / "scene.xml").write_text(SCENE)
    (here / "meter.toml").write_text(METER)
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


def lines(command: str, rng: np.random.Generator) -> Iterator[list[str]]:
    """Odd lines of a command without end."""

    def value(action: argparse.Action) -> str:
        right, wrong = WORDS, WORDS
        if action.choices:
            right, wrong = [*action.choices], ["x"]
        elif isinstance(action.type, options.Number):
            right, wrong = USUAL, ODD
        elif isinstance(action.type, options.Output):
            right, wrong = [f"{name}{action.type.suffixes[0]}" for name in ("new", "mine")], [*MINE, *ABSURD, *NEW]
        elif action.type is options.results:
            right, wrong = ["new"], [*MINE, *ABSURD, *NEW]
        elif action.type is Path or action.metavar in ("FILE", "OTHER"):
            right, wrong = READ, [*MINE, *ABSURD]
        elif ":" in str(action.metavar):
            right, wrong = AXES, AXES
        return str(rng.choice(right if rng.random() < 0.6 else wrong))

    actions = [each for each in parser_of(command)._actions if each.dest != "help"]
    optional = [each for each in actions if each.option_strings]
    places = [each for each in actions if not each.option_strings]
    while True:
        words = [command, *NEEDED.get(command, "").split()]
        if places and rng.random() < 0.5:
            words[1 : 1 + len(places)] = [value(each) for each in places]
        for k in rng.choice(len(optional), min(int(rng.integers(1, 4)), len(optional)), replace=False):
            action = optional[k]
            several = {0: 0, None: 1, "+": int(rng.integers(1, 4))}
            count = several[action.nargs] if action.nargs in several else int(action.nargs or 1)
            words += [str(rng.choice(action.option_strings)), *(value(action) for _ in range(count))]
        yield words


def contents(here: Path) -> dict[str, str]:
    """What is there, by name: digests of files, and what else there is."""

    def look(path: Path) -> str:
        if path.is_symlink():
            return f"link to {path.readlink()}"
        if path.is_file():
            return hashlib.sha256(path.read_bytes()).hexdigest()
        return "folder" if path.is_dir() else "else"

    return {str(path.relative_to(here)): look(path) for path in here.rglob("*")}


def outputs_of(words: list[str]) -> set[str]:
    """What a line asks to be written, and where commands write unless they are asked."""
    named = set[str]()
    for action in parser_of(words[0])._actions:
        if isinstance(action.type, options.Output) or action.type is options.results:
            named |= {str(action.default)} - {"None"}
            named |= {word for before, word in itertools.pairwise(words) if before in action.option_strings}
    named |= {str(Path(name).with_suffix(".failed.h5")) for name in named if name.endswith(".h5")}  # samples so far
    return {os.path.normpath(name) for name in named}


class Late(BaseException):
    """A line that doesn't end."""


def carried_out(words: list[str], patience: float) -> tuple[int, str, str]:
    """The exit code of a line and what it prints; Ctrl-C comes after so many seconds.

    Raises `Late` if it goes on for more than 3 s of processor time then, or for two minutes.
    """
    presses = list[float]()

    def press(number: int, frame: object) -> None:
        presses.append(time.process_time())
        if len(presses) > 1:
            raise Late
        signal.setitimer(signal.ITIMER_REAL, 120.0)
        os.kill(os.getpid(), signal.SIGINT)

    out, err = io.StringIO(), io.StringIO()
    usual = signal.signal(signal.SIGALRM, press)
    signal.setitimer(signal.ITIMER_REAL, patience)
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
    if presses and time.process_time() - presses[0] > 3.0:
        raise Late
    if presses:
        gc.collect()  # what it broke off may have left a file open: that is heard here, where it is ignored
    said = "".join(line for line in err.getvalue().splitlines(True) if not line.startswith("dualball: warning: "))
    return code, out.getvalue(), said


def tried(words: list[str], here: Path, patience: float) -> tuple[int, list[str]]:
    """The exit code of a line, and all that is wrong with what it did."""
    before, wrong = contents(here), list[str]()
    try:
        code, out, said = carried_out(words, patience)
    except BaseException as error:
        return -1, [f"{type(error).__name__}: {error}"]
    if code == 2 and (out or said.count("\n") != 1 or not said.startswith("dualball: error: ") or "\ufffd" in said):
        wrong.append(f"more than a line: {out!r} {said!r}")
    after, asked = contents(here), outputs_of(words)
    for name in before.keys() | after.keys():
        if before.get(name) == after.get(name):
            continue
        belongs = any(name == own or name.startswith(f"{own}/") for own in asked)
        replaced = name in before and name not in asked
        if code == 2 or not belongs or replaced:
            wrong.append(f"{name}: {before.get(name, 'nothing')} -> {after.get(name, 'nothing')}, exit code {code}")
        elif name in before and sum(os.path.normpath(word) == name for word in words) > 1:
            wrong.append(f"{name} was read and is lost")
        elif name.endswith(".part") or (after.get(name) == "folder" and not any(Path(here / name).iterdir())):
            wrong.append(f"{name} is left")
    return code, wrong


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")  # Ctrl-C between open() and with
@pytest.mark.parametrize("count", [8, pytest.param(100, marks=pytest.mark.slow)])
@pytest.mark.parametrize("command", COMMANDS)
def test_odd_lines(command: str, count: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    here = tmp_path / "a user's Öl"
    furnish(here)
    monkeypatch.chdir(here)
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr("compare.view.explore.serve", lambda p, port, show: None)
    monkeypatch.setattr("compare.validation.validate", lambda *_, **__: [])  # `test_signals` ends that
    whole, rng = contents(here), np.random.default_rng(COMMANDS.index(command))
    wrong = {}
    for _, words in zip(range(count), lines(command, rng), strict=False):
        if problems := tried(words, here, patience=1.0)[1]:
            wrong[shlex.join(words)] = problems
        if contents(here) != whole:
            shutil.rmtree(here)
            furnish(here)
            os.chdir(here)
    assert not wrong
