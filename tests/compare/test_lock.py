"""A directory has one program at a time that fills it; an owner that is dead has lost it."""

import functools
import os
import re
import time
from concurrent.futures import ThreadPoolExecutor

import pytest

from compare.kit import collection
from compare.kit.campaign import Campaign
from compare.kit.lock import Lock
from model import StorageError
from tests.commands import refused, told


def test_a_second_program_is_refused_until_the_first_is_dead(tmp_path, capsys):
    line, first = f"sweep --vary omega_0=5:10:4 --time 0.05 --quiet -o {tmp_path} --workers 0 --batch", Lock(tmp_path)
    said = refused(capsys, f"{line} 2")
    assert re.search(
        rf"{tmp_path} is in use by process {os.getpid()} on \S+, since .* UTC: wait for it, or choose", said
    )
    assert [path.name for path in tmp_path.iterdir()] == [".lock"]
    first._file.close()  # as when a process is killed
    for batch in (2, 3):  # the second time there is nothing left to do
        told(capsys, f"{line} {batch}")
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


def take_and_let_go(where, rounds, name):
    """As fast as it can: who has the lock writes its name, and finds it unchanged."""
    held = where / "log" / "held"
    while rounds:
        try:
            lock = Lock(where)
        except StorageError:
            continue
        held.write_text(name)
        time.sleep(1e-4)
        assert held.read_text() == name
        held.unlink()
        lock.release()
        rounds -= 1


@pytest.mark.parametrize("rounds", [20, pytest.param(400, marks=pytest.mark.slow)])
def test_no_two_have_it_at_once(tmp_path, rounds):
    """Threads, of which each opens the file by itself, as programs do."""
    (tmp_path / "log").mkdir()
    with ThreadPoolExecutor(3) as pool:
        assert list(pool.map(functools.partial(take_and_let_go, tmp_path, rounds), "abc")) == [None] * 3


def test_a_file_system_without_locks_is_said(tmp_path, monkeypatch, capsys):
    def none(*_):
        raise OSError(38, "Function not implemented")

    monkeypatch.setattr("compare.kit.lock.fcntl.flock", none)
    Lock(tmp_path).release()
    said = f"dualball: {tmp_path} can't be locked (Function not implemented): start no second program there\n"
    assert capsys.readouterr().err == said
    with pytest.raises(StorageError, match="cannot write to"):
        Lock(tmp_path / "absent")
