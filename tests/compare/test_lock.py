"""A directory has one program at a time that fills it; an owner that is dead has lost it."""

import re
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from compare.commands import cli
from compare.kit import collection
from compare.kit.campaign import Campaign
from compare.kit.lock import Lock
from model import StorageError
from tests.commands import refused

HOLD = "import sys, time; from compare.kit.lock import Lock; lock = Lock(__import__('pathlib').Path(sys.argv[1]))"


def test_a_second_program_is_refused_until_the_first_is_dead(tmp_path, capsys):
    command = f"sweep --vary omega_0=5:10:4 --time 0.05 --quiet -o {tmp_path} --workers 0 --batch".split()
    program, here = f"{HOLD}; print(flush=True); time.sleep(600)", Path(__file__).parents[2]
    first = subprocess.Popen([sys.executable, "-c", program, str(tmp_path)], cwd=here, stdout=subprocess.PIPE)
    assert first.stdout
    first.stdout.readline()
    said = refused(capsys, *command, "2")
    assert re.search(rf"{tmp_path} is in use by process {first.pid} on \S+, since .* UTC: wait for it, or choose", said)
    assert [path.name for path in tmp_path.iterdir()] == [".lock"]
    first.send_signal(signal.SIGKILL)
    first.communicate()
    for batch in "23":  # the second time there is nothing left to do
        assert cli.main([*command, batch]) == 0
    assert collection.collect(tmp_path, tmp_path / "all.h5") == 4
    assert not list(tmp_path.glob(".*"))


def test_a_lock_of_a_machine_that_is_gone_is_nobodys(tmp_path):
    for left in ("process 1 on elsewhere, since 2001-01-01 00:00 UTC", ""):
        (tmp_path / ".lock").write_text(left)
        with Campaign(tmp_path, workers=0):
            assert "process 1 on elsewhere" not in (tmp_path / ".lock").read_text()
        assert not list(tmp_path.iterdir())


def test_a_failed_campaign_lets_go(tmp_path):
    with pytest.raises(ZeroDivisionError), Campaign(tmp_path, workers=0):
        raise ZeroDivisionError
    Lock(tmp_path).release()


@pytest.mark.parametrize("rounds", [20, pytest.param(400, marks=pytest.mark.slow)])
def test_no_two_have_it_at_once(tmp_path, rounds):
    """Programs that take it and let go again, as fast as they can: each writes its name and finds it unchanged."""
    program = f"""
{HOLD.partition("; lock")[0]}
from pathlib import Path
from model import StorageError
where, name, done = Path(sys.argv[1]), sys.argv[2], 0
(where / "log").mkdir(exist_ok=True)
while done < {rounds}:
    try:
        lock = Lock(where)
    except StorageError:
        continue
    held = where / "log" / "held"
    held.write_text(name)
    time.sleep(1e-4)
    assert held.read_text() == name
    held.unlink()
    lock.release()
    done += 1
"""
    here = Path(__file__).parents[2]
    several = [subprocess.Popen([sys.executable, "-c", program, str(tmp_path), str(k)], cwd=here) for k in range(3)]
    assert [each.wait(timeout=120) for each in several] == [0, 0, 0]


def test_a_file_system_without_locks_is_said(tmp_path, monkeypatch, capsys):
    def none(*_):
        raise OSError(38, "Function not implemented")

    monkeypatch.setattr("compare.kit.lock.fcntl.flock", none)
    Lock(tmp_path).release()
    said = f"dualball: {tmp_path} can't be locked (Function not implemented): start no second program there\n"
    assert capsys.readouterr().err == said
    with pytest.raises(StorageError, match="cannot write to"):
        Lock(tmp_path / "absent")
