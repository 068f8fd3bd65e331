"""What ends programs ends every command and every long call, with one line, and leave nothing that
is half written."""

import contextlib
import io
import os
import pty
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path
from unittest import mock

import pytest

import mjsim
from compare.campaign.stops import SIGNALS
from compare.commands import cli, signals, simulate
from model import Parameters
from tests.commands import COMMANDS, ROOT, carried_out, python, started

P = Parameters.named("reference")
LONG = {
    "validate": "--quick --set reference --claim prop-1",
    "figures": "--format svg --format png --format pdf",
    "simulate": "--omega-0 25 --time 2e4 -o new.h5",
    "inspect": "run.h5 --plot new.png",
    "compare": "run.h5 run.h5 --plot new.png",
    "sweep": "--vary eta=0.1:0.5:20 --time 1e3 --workers 2",
    "collect": "runs -o new.h5",
    "attractors": "--set hopping --random 1000",
    "basins": "--across omega_c=0:150:201 --up slip_x=-900:900:201 --workers 2",
    "design": "meter.toml -o new.html",
    "render": "run.h5 -o new.html",
    "explore": "--no-browser --port 8099",
    "forecast": "scene.xml --try",
    "cases": "-o cases",
    "league": "--engine mujoco-plain --engine mujoco-free --workers 2",
}
"""What takes each command long."""


def catches(process, number):
    """Whether it has a handler for a signal, or has ended."""
    try:
        status = Path(f"/proc/{process.pid}/status").read_text()
    except FileNotFoundError:
        return True
    caught = next(
        (line.split()[1] for line in status.splitlines() if line.startswith("SigCgt")), "f" * 16
    )
    return bool(int(caught, 16) >> (number - 1) & 1)


@pytest.fixture(params=SIGNALS)
def heard(request, monkeypatch):
    """A signal, also where a shell runs the tests in the background, and has SIGINT ignored; what
    it waits for it waits for half as long as usual."""
    monkeypatch.setattr(signals, "_SEND_AGAIN", signals._SEND_AGAIN / 2)
    monkeypatch.setattr(signals, "_WAITS", signals._WAITS // 2)
    before = signal.signal(request.param, signal.SIG_DFL)
    yield request.param
    signal.signal(request.param, before)


ALL = [
    (command, number, after)
    for command in COMMANDS
    for number in SIGNALS
    for after in (0.0, 0.4, 1.5, 4.0, 10.0)
]


@pytest.mark.parametrize(
    ("command", "number", "after"),
    [
        *(("attractors", signal.SIGINT, 3.0), ("basins", signal.SIGTERM, 3.0)),
        *((command, signal.SIGHUP, 3.0) for command in ("sweep", "explore")),
        # Python and packages are being loaded, each time a little further: no traceback of theirs.
        *((command, SIGNALS[k % len(SIGNALS)], 0.03 * k) for k, command in enumerate(COMMANDS)),
        *(pytest.param(*each, marks=pytest.mark.slow) for each in ALL),
    ],
)
def test_every_command_ends_at_any_moment(stocked, tmp_path, command, number, after):
    """To all that belongs to it, as a terminal and a cluster send it, so many seconds after it
    first can answer."""
    here = Path(shutil.copytree(stocked, tmp_path / "here"))
    before = set(here.rglob("*"))
    line = command, *LONG.get(command, "").split()
    process = started(*line, cwd=here, stderr=subprocess.PIPE, start_new_session=True)
    while not catches(process, signal.SIGTERM):
        time.sleep(0.001)
    time.sleep(after)
    running = process.poll() is None
    with contextlib.suppress(ProcessLookupError):
        os.killpg(process.pid, number)
    out, err = process.communicate(timeout=60)
    assert "Traceback" not in out + err, err
    assert "leaked" not in err
    if running and process.returncode not in (0, -number):  # it may just have been done
        assert process.returncode == 128 + number, err
        (said,) = (line for line in err.splitlines() if line.startswith("dualball"))
        assert "interrupted" in said or "was stopped at t =" in said
        # then it had just been done
        if out and command not in ("simulate", "validate", "figures", "judge", "explore"):
            assert out.rstrip() == started(*line, cwd=here).communicate()[0].rstrip()
    new = set(here.rglob("*")) - before
    assert not [
        path
        for path in new
        if path.suffix == ".part" or (path.is_dir() and not any(path.iterdir()))
    ]


@pytest.mark.parametrize("command", ["simulate", "sweep"])
def test_a_terminal_that_goes_ends_a_command_as_its_signal_says(command, stocked, tmp_path):
    here, (ours, theirs) = shutil.copytree(stocked, tmp_path / "here"), pty.openpty()
    words = ["setsid", "--ctty", "--wait", sys.executable, "-m", "compare", command]
    words += LONG[command].split()
    given = {"env": os.environ | {"PYTHONPATH": str(ROOT)}, "cwd": here}
    with subprocess.Popen(words, stdin=theirs, stdout=theirs, stderr=theirs, **given) as process:
        os.close(theirs)
        os.read(ours, 1)  # it has begun, and says so
        os.close(ours)
        assert process.wait(timeout=60) == 128 + signal.SIGHUP


def test_what_a_stopped_run_leaves_is_told_whatever_comes_next(
    capsys, monkeypatch, tmp_path, heard
):
    """Also where all that follows takes longer than a signal waits before it comes again."""

    def describe(path):
        time.sleep(1.5)
        os.kill(os.getpid(), heard)

    ended = simulate.store

    def store(task, path, stop, tell):
        os.kill(os.getpid(), heard)
        return ended(task, path, stop=stop, tell=tell)

    monkeypatch.setattr(simulate, "store", store)
    monkeypatch.setattr(simulate.motions, "describe", describe)
    new = tmp_path / "new.h5"
    mjsim.simulate(P, [0] * 6, t_end=0.01)  # is compiled
    code, _, err = carried_out(capsys, "simulate", "--time", 100, "-o", new)
    assert code == 128 + heard
    (kept,) = tmp_path.iterdir()
    assert f"kept in {kept}" in err


INTERRUPTED = """
import signal, time
import analytic, mjsim
from model import Flow, Parameters

signal.signal(signal.SIGINT, signal.default_int_handler)
p = Parameters.named("reference").replace(omega_0=25.0)
hopping, rest = Parameters.named("hopping"), [0] * 6
soft = mjsim.ContactSettings()
calls = {
    "event": lambda t: analytic.simulate(p, rest, t, Flow.sine(20, 5, 1)),
    "time-stepping": lambda t: analytic.simulate(p, rest, t, method="time-stepping"),
    "many": lambda t: analytic.simulate_many(p, [rest] * 4, t),
    "mjsim": lambda t: mjsim.simulate(p, rest, t),
    "mjsim soft": lambda t: mjsim.simulate(p, rest, t, settings=soft),
    "mjsim many": lambda t: mjsim.simulate_many([p] * 64, [rest] * 64, t, threads=2),
    "attractors": lambda t: analytic.attractors(hopping, 1 if t < 1 else 1000, lasting=t),
}
for name, call in calls.items():
    call(0.1)  # is compiled
    begun = []
    press = lambda *_: begun.append(time.process_time()) or signal.raise_signal(signal.SIGINT)
    signal.signal(signal.SIGALRM, press)
    signal.setitimer(signal.ITIMER_REAL, 0.4)
    try:
        call(1e5)
    except KeyboardInterrupt:
        print(name, time.process_time() - begun[0] < 3)
"""
"""Prints of each call whether it ended within 3 s of processor time."""


def test_ctrl_c_ends_every_long_call() -> None:
    """In a process of its own: one that answers while numba makes a result would crash it."""
    done = python("-c", INTERRUPTED)
    names = ("event", "time-stepping", "many", "mjsim", "mjsim soft", "mjsim many", "attractors")
    assert done.stdout.splitlines() == [f"{name} True" for name in names]
    assert "Traceback" not in done.stderr


def test_an_orphan_whose_standard_error_nobody_reads_ends_as_any_other(monkeypatch, heard):
    """Without an error of its own, after which it would wait for what its threads still do."""

    class Unread(io.StringIO):
        def write(self, text):
            raise BrokenPipeError

    monkeypatch.setattr(cli, "_run", mock.Mock(side_effect=signals.Interrupted(heard)))
    monkeypatch.setattr(sys, "stderr", Unread())
    assert cli.main([]) == 128 + heard


def test_a_signal_that_python_loses_comes_again(heard):
    """As in a callback of an object's end, whose errors go nowhere."""

    class Ends:
        def __del__(self):
            os.kill(os.getpid(), heard)
            time.sleep(1e-3)

    with pytest.raises(signals.Interrupted) as ended, signals.raised():
        time.sleep(60 if Ends() else 0)
    assert ended.value.code == 128 + heard


@pytest.mark.parametrize(("lasts", "then"), [("0.2", 60), ("60", 60), ("0", 0)])
def test_an_import_is_not_cut_short(heard, lasts, then, tmp_path, monkeypatch):
    """Unless it doesn't end; and what ends just after it doesn't leave the signal to whoever comes
    next."""
    text = (
        f"import os, time\nos.kill(os.getpid(), {int(heard)})\ntime.sleep({lasts})\nwhole = True\n"
    )
    (tmp_path / f"slow_{heard}.py").write_text(text)
    monkeypatch.syspath_prepend(tmp_path)

    def work():
        __import__(f"slow_{heard}")
        time.sleep(then)

    with pytest.raises(signals.Interrupted), signals.raised():
        work()
    assert hasattr(sys.modules.pop(f"slow_{heard}", None), "whole") is (lasts != "60")


def test_what_should_stop_by_itself_and_does_not_is_stopped(heard):
    """As a compiler that a run waits for, on a machine where nothing is compiled yet."""

    def work():
        os.kill(os.getpid(), heard)
        time.sleep(60)

    with pytest.raises(signals.Interrupted), signals.raised(), signals.noted() as noted:
        work()
    assert noted == [heard]
