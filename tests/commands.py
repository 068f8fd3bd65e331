"""The commands as tests draw from them: their parsers, what they need, and how they refuse."""

import functools
import os
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from compare.commands import cli, options, parsers

ROOT = Path(__file__).parents[1]
COMMANDS = [name for group in parsers.GROUPS.values() for name in group]
NEEDED = {
    "basins": "--across y=0:1:2 --up h=0:0.01:2",
    "collect": "runs",
    "compare": "run.h5 run.h5",
    "design": "meter.toml",
    "forecast": "scene.xml",
    "inspect": "run.h5",
    "render": "run.h5 -o run.html",
    "sweep": "--vary eta=0.1,0.2 --time 0.01 --workers 0",
}
"""What a command can't do without."""
METER = """
fluid = {nu_f = 1e-6, rho_f = 1000}
flow = {slowest = 2, fastest = 40}
bounds = {r = [2e-3, 8e-3], R = [2e-2, 8e-2], mu = 0.1, eta = 0.1, rho_b = 7800}
"""
SCENE = """<mujoco><worldbody><geom type="plane" size="1 1 .1"/>
<body pos="0 0 .1"><freejoint/><geom type="box" size=".1 .1 .1"/></body></worldbody></mujoco>"""


def carried_out(capsys: pytest.CaptureFixture[str], *argv: object) -> tuple[int, str, str]:
    """The exit code of a command, given in a line or by its words, what it prints, and what it says
    of trouble."""
    capsys.readouterr()
    words = str(argv[0]).split() if len(argv) == 1 else map(str, argv)
    return cli.main([*words]), *capsys.readouterr()


def told(capsys: pytest.CaptureFixture[str], line: str) -> str:
    """What a command prints that does what it should, with single spaces."""
    code, out, err = carried_out(capsys, line)
    assert code == 0, err
    return " ".join(out.split())


def refused(capsys: pytest.CaptureFixture[str], *argv: object) -> str:
    """The one line in which a command refuses its arguments."""
    code, out, err = carried_out(capsys, *argv)
    assert (code, out, err.count("\n")) == (2, "", 1), err
    assert err.startswith("dualball: error: ")
    return err


def started(*words: object, **how: Any) -> subprocess.Popen[str]:
    """A command in a process of its own, which hears Ctrl-C even if a shell ran the tests in the
    background."""
    # NiceGUI looks for it
    env = {key: value for key, value in os.environ.items() if not key.startswith("PYTEST")}
    return subprocess.Popen(
        [sys.executable, "-m", "compare", *map(str, words)],
        env=env | {"PYTHONPATH": str(ROOT)},
        stdout=subprocess.PIPE,
        text=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
        **how,
    )


def python(*words: str, **environment: str) -> subprocess.CompletedProcess[str]:
    """A Python of its own, which must end well, with what it prints and says of trouble."""
    env = os.environ | {"PYTHONPATH": str(ROOT)} | environment
    done = subprocess.run([sys.executable, *words], env=env, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done


@functools.cache
def parser_of(command: str) -> options.Parser:
    return parsers.parser([command])._subparsers._group_actions[0].choices[command]
