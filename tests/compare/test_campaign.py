"""A campaign's results depend on nothing but its tasks, and nothing that is done is done again or
lost.

A directory has one program at a time that fills it, and a run that is taken up again gives the bits
of a whole one."""

import contextlib
import functools
import json
import os
import re
import signal
import subprocess
import threading
import time
from concurrent.futures import Future, ThreadPoolExecutor, wait
from dataclasses import replace

import numpy as np
import pytest

from compare.campaign.campaign import FAILURES, Campaign, Failure, run_batch
from compare.campaign.lock import Lock
from compare.campaign.tasks import Task
from compare.campaign.workers import Workers, _without_signals, dask, first_done, processes
from compare.commands import cli
from compare.view import collection
from mjsim import RigidContacts
from model import Flow, InputError, Parameters, SimulationError, StorageError, storage
from model.trajectory import Trajectory, columns
from tests.commands import refused, started, told

REST = (0.0,) * 8
P = Parameters.named("reference")
WILD = Task(engine="mujoco", parameters=P, x0=(1e11, 0, 0, 0, 0, 0), t_end=0.2)
"""Diverges."""


def tasks(count=9, t_end=0.2):
    return [
        Task(engine="mujoco", parameters=P.replace(omega_0=5.0 + k), x0=REST, t_end=t_end)
        for k in range(count)
    ]


def numbers(runs):
    """All numbers of runs, by their parameters; a run that is stored twice, as by a worker that
    dies, is the same."""
    found = {}
    for run in runs:
        own = {c: getattr(run, c).tobytes() for c in columns(Trajectory)}
        assert found.setdefault(str(run.header.parameters), own) == own
    return found


def data(directory):
    """All numbers of all runs of a directory."""
    files = map(storage.load_runs, directory.glob("*.h5"))
    return numbers(run for runs in files for run in runs.values())


def written(directory):
    """When each file of runs was written."""
    return {path: path.stat().st_mtime_ns for path in directory.glob("*.h5")}


def completed(directory, workers=0, asked=None, **how):
    """What failed of tasks in a campaign, of those of `tasks` unless others are asked."""
    with Campaign(directory, workers, **how) as campaign:
        return campaign.complete(asked or tasks())


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory):
    directory = tmp_path_factory.mktemp("undisturbed")
    assert completed(directory) == []
    return data(directory)


def test_no_more_is_held_than_there_is_memory_for(tmp_path, monkeypatch):
    """Of runs of 201 samples each no file is read twice in a campaign, as long as there is room."""
    loaded, told, read = [], [], storage.load_runs
    monkeypatch.setattr(storage, "load_runs", lambda path: [loaded.append(path), read(path)][1])
    for room, times in ((2**19, [2, 2, 4, 4]), (500, [2, 4, 6, 8])):
        monkeypatch.setattr("compare.campaign.campaign.READ", room)
        seen = []
        for _ in range(2):
            where, report = tmp_path / str(room), lambda *now: told.append(now)
            with Campaign(where, 0, 2, report=report, doing="it") as campaign:
                for _ in range(2):
                    campaign.run(tasks(4))
                    seen.append(len(loaded))
        assert (seen, told[-1]) == (times, ("it", 4, 4, 0))
        loaded.clear()


def test_it_is_told_how_far_long_runs_are(tmp_path, monkeypatch, undisturbed):
    """Also where all of them would fit into one batch."""
    told = list[int]()
    monkeypatch.setattr("compare.campaign.campaign.MOST_STEPS", 2.5 * tasks()[0].steps)
    completed(tmp_path, report=lambda what, done, total, failed: told.append(done))
    assert told == [*range(0, len(tasks()), 2), len(tasks())]
    assert data(tmp_path) == undisturbed


def test_what_is_measured_is_reduced_to_what_is_drawn(tmp_path):
    with Campaign(tmp_path, workers=0, batch=2, label="first") as campaign:
        campaign.complete([*tasks(3), WILD])
        campaign.label = "first-and-more"
        campaign.complete(tasks(4))
        campaign.label = "first"
        campaign.keep([tasks(2)[1].key])
        campaign.reduce()
        kept = sorted(re.sub("-[0-9a-f]{24}", "-ID", each.name) for each in tmp_path.glob("*.h5"))
        assert kept == ["first-ID.failed.h5", "first-and-more-ID.h5", "first.h5"]
        campaign.reduce()  # again, as after a kill: what is kept stays
        assert list(storage.load_runs(tmp_path / "first.h5")) == [tasks(2)[1].key]
        assert campaign.complete(tasks(4)) == []
    assert len(data(tmp_path)) == 5


def test_passing_runs_are_stored_where_memory_is_short_or_they_took_long(
    tmp_path, undisturbed, monkeypatch
):
    """Runs of 201 samples each; the numbers are those of runs that were stored at once."""
    cases = ("held", 2**18, 1e9, 0), ("tight", 500, 1e9, 3), ("slow", 2**18, 0.0, 5)
    for where, room, short, files in cases:
        monkeypatch.setattr("compare.campaign.campaign.READ", room)
        monkeypatch.setattr("compare.campaign.campaign.SOON_DONE", short)
        with Campaign(tmp_path / where, workers=0, batch=2, passing=True) as campaign:
            runs = campaign.run(tasks())
            assert len(written(tmp_path / where)) == files
            assert numbers(runs) == undisturbed
            campaign.keep([tasks()[4].key])
            campaign.reduce()
            assert [path.name for path in written(tmp_path / where)] == ["runs.h5"]
            assert campaign.load(tasks()[4].key).header.parameters == tasks()[4].parameters


def test_what_memory_cannot_hold_goes_into_files_as_long_as_a_batch(tmp_path, monkeypatch):
    """Runs of 201 samples each, of which five are held and two make a batch; a file of all that
    were held would be read again for each of its runs."""
    monkeypatch.setattr("compare.campaign.campaign.READ", 1100)
    monkeypatch.setattr("compare.campaign.campaign.HELD", 450)
    asked = [replace(task, sample_interval=1e-3) for task in tasks(8)]
    with Campaign(tmp_path, workers=0, passing=True) as campaign:
        assert all(len(run.time) == 201 for run in campaign.run(asked))
        counts = [len(storage.load_runs(path)) for path in written(tmp_path)]
    assert len(counts) >= 3
    assert set(counts) == {2}


@pytest.mark.parametrize(
    "damage",
    [
        lambda whole: whole[:-100],
        lambda whole: whole[:4000] + bytes([whole[4000] ^ 1]) + whole[4001:],
    ],
)
def test_a_file_that_was_cut_or_edited_is_named_and_done_again(
    tmp_path, undisturbed, capsys, damage
):
    completed(tmp_path, batch=3)
    path = min(tmp_path.iterdir())
    path.write_bytes(damage(path.read_bytes()))
    untouched = {each: when for each, when in written(tmp_path).items() if each != path}
    assert completed(tmp_path, batch=3) == []
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith(f"dualball: cannot read {path}: it is ")
    assert line.endswith("; it is set aside, its runs are carried out again")
    assert data(tmp_path) == undisturbed
    assert untouched.items() <= written(tmp_path).items()


def test_runs_of_other_versions_are_left_alone(tmp_path, capsys, monkeypatch):
    with monkeypatch.context() as other:
        other.setattr("model.storage.current_versions", lambda: {"dualball": "9.9"})
        completed(tmp_path, asked=tasks(2))
    (tmp_path / "sweep.h5").write_bytes(b"somebody's own")
    before = {path: path.read_bytes() for path in tmp_path.iterdir()}
    with Campaign(tmp_path, workers=0) as campaign:
        campaign.label = "again"
        assert campaign.complete(tasks(2)) == []
    said = f"dualball: 1 files of runs of other versions are left alone in {tmp_path}\n"
    assert capsys.readouterr().err == said
    assert before.items() <= {path: path.read_bytes() for path in tmp_path.iterdir()}.items()
    assert len(before) + 1 == len(list(tmp_path.iterdir()))


def test_every_input_is_part_of_the_identity():
    given = {"engine": "mujoco", "parameters": P, "x0": REST, "t_end": 0.2}
    others = {
        "engine": "event",
        "parameters": P.replace(mu=0.21),
        "x0": (*REST[:7], 1e-300),
        "t_end": 0.3,
        "sample_interval": 0.1,
        "settings": RigidContacts(timestep=5e-4),
        "flow": Flow.ramp(1, 2, 1),
    }
    changed = [given, *(given | {name: other} for name, other in others.items())]
    assert len({Task(**each).key for each in changed}) == 1 + len(others)
    for x0 in (list(REST), np.zeros(8), np.zeros(6), [0] * 6):
        assert Task(**given | {"x0": x0}) == Task(**given)
    assert Task(**given, flow=Flow.steady(P.omega_0)).key == Task(**given).key


def test_a_run_that_diverges_is_reported_and_the_rest_goes_on(tmp_path):
    with Campaign(tmp_path, workers=0) as campaign:
        failures = campaign.complete([*tasks(2), WILD])
        assert [failure.task for failure in failures] == [WILD]
        assert "diverged" in failures[0].reason
        suffixes = sorted(path.suffixes for path in tmp_path.glob("*.h5"))
        assert suffixes == [[".failed", ".h5"], [".h5"]]
        (entry,) = json.loads((tmp_path / FAILURES).read_text())
        assert entry["key"] == WILD.key
        with pytest.raises(SimulationError, match="diverged"):
            campaign.run([WILD])
    with Campaign(tmp_path, workers=0) as again:  # it is not tried again, but told again
        assert [failure.task.key for failure in again.complete([WILD])] == [WILD.key]


def test_a_run_that_takes_too_long_is_reported(tmp_path):
    long = {"parameters": P, "x0": REST, "t_end": 6000.0}
    endless = Task(engine="mujoco", **long)
    slow = Task(engine="time-stepping", sample_interval=0.01, **long)
    failures = completed(tmp_path, limit=1, asked=[endless, *tasks(1, t_end=0.01), slow])
    assert [failure.task for failure in failures] == [endless, slow]
    assert {failure.reason for failure in failures} == {"it took longer than 1 s"}
    assert len(list(tmp_path.glob("*.h5"))) == 1


def deadly(tasks, *where):
    """Stands in for `run_batch`: the run at omega_0 = 7 takes its worker down with it."""
    if any(task.parameters.omega_0 == 7.0 for task in tasks):
        os.kill(os.getpid(), signal.SIGKILL)
    return run_batch(tasks, *where)


def test_a_task_that_kills_its_worker_is_found_and_the_rest_goes_on(
    tmp_path, undisturbed, monkeypatch
):
    """Workers, batches and the order of tasks change no bit."""
    monkeypatch.setattr("compare.campaign.campaign.run_batch", deadly)
    failures = completed(tmp_path, workers=2, batch=3, asked=reversed(tasks()))
    assert failures == [Failure(tasks()[2], "its worker died (killed, or out of memory)")]
    stored = data(tmp_path)
    assert len(stored) == 8
    assert stored.items() <= undisturbed.items()


def square(parent, number):
    if number == 3 and os.getpid() != parent:
        os.kill(os.getpid(), signal.SIGKILL)
    return number**2


@pytest.mark.parametrize("count", [0, 1, 2])
def test_what_a_killed_process_was_to_do_is_done_here(count):
    with processes(count) as work:
        squares = list(work.map(functools.partial(square, os.getpid()), range(8)))
        assert squares == [k**2 for k in range(8)]
        assert list(work.map(abs, [-1, -2])) == [1, 2]


def test_a_signal_that_another_thread_gets_wakes_who_waits_for_work():
    """And so does the end of work that nobody carries out any more."""
    futures = [Future[None](), Future[None]()]

    def work():
        time.sleep(0.2)
        signal.pthread_kill(threading.get_ident(), signal.SIGTERM)

    before = signal.signal(signal.SIGTERM, lambda number, frame: futures[1].cancel())
    late = threading.Timer(20, futures[0].set_result, [None])
    try:
        threading.Thread(target=work).start()
        late.start()
        assert first_done(futures) == futures[1:]
    finally:
        late.cancel()
        signal.signal(signal.SIGTERM, before)


def test_a_signal_that_another_thread_gets_waits_until_a_worker_has_started():
    heard, wait = [], threading.Event()
    (thread := threading.Thread(target=wait.wait)).start()
    before = signal.signal(signal.SIGTERM, lambda *_: heard.append(1))
    try:
        with _without_signals():
            signal.pthread_kill(thread.ident, signal.SIGTERM)
            time.sleep(0.05)
            assert not heard
        assert heard == [1]
    finally:
        signal.signal(signal.SIGTERM, before)
        wait.set()


@pytest.mark.filterwarnings("ignore")  # Dask's own, on shutting down
@pytest.mark.parametrize("dies", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_dask_workers_change_no_bit(dies, tmp_path, undisturbed):
    """Also if one of two, which are processes then, is killed as soon as a task is done."""
    distributed = pytest.importorskip("distributed")
    two, killed = {"n_workers": 2, "threads_per_worker": 1, "processes": dies}, []
    near = {"protocol": "tcp://", "host": "127.0.0.1", "dashboard_address": None}
    with distributed.LocalCluster(**two, **near) as cluster:

        def kill_one(doing, done, total, failed):
            if dies and done and not killed:
                killed.append(next(iter(cluster.workers.values())).pid)
                os.kill(killed[0], signal.SIGKILL)

        workers = dask(cluster.scheduler_address)
        with pytest.raises(ValueError, match="No clients found"):
            distributed.default_client()  # xarray would ask it for locks, also once it is gone
        assert completed(tmp_path, workers, batch=1, report=kill_one) == []
    assert bool(killed) is dies
    assert data(tmp_path) == undisturbed


class Orphaned(ThreadPoolExecutor):
    """As Dask's, whose futures are all cancelled once its scheduler is gone: here after the
    second."""

    asked = 0

    def submit(self, *call):  # type: ignore[override]
        self.asked += 1
        if self.asked <= 2:
            return super().submit(*call)
        gone = Future()
        gone.cancel()
        return gone


@pytest.mark.parametrize("slow", [False, True])
def test_a_scheduler_that_dies_is_said_and_what_is_whole_stays(
    slow, tmp_path, undisturbed, monkeypatch
):
    """Also where all that it did is there before it is missed."""
    if slow:
        monkeypatch.setattr("compare.campaign.workers.wait", lambda futures, *how: wait(futures))
    fleet = Workers(1, lambda: Orphaned(2), lambda executor, at_once: executor.shutdown(), ())
    gone = "the workers' scheduler is gone; finished runs are kept"
    with pytest.raises(StorageError, match=gone), Campaign(tmp_path, fleet, batch=1) as campaign:
        campaign.complete(tasks())
    assert len(data(tmp_path)) == 2
    assert completed(tmp_path) == []
    assert data(tmp_path) == undisturbed


def test_a_scheduler_that_does_not_answer(monkeypatch):
    pytest.importorskip("distributed")
    monkeypatch.setattr("compare.campaign.workers.SCHEDULER_TIMEOUT", 0.5)
    with pytest.raises(InputError, match=r"no Dask scheduler answers at tcp://127\.0\.0\.1:1"):
        dask("tcp://127.0.0.1:1")


def test_bad_campaigns(tmp_path):
    for bad, words in (({"workers": -1}, "workers = -1"), ({"batch": 0}, "batch = 0")):
        with pytest.raises(InputError, match=words):
            Campaign(tmp_path, **bad)
    (tmp_path / "file").write_text("")
    with pytest.raises(StorageError, match="cannot write to"):
        Campaign(tmp_path / "file")
    with pytest.raises(InputError, match=r"no engine is called 'mujuco' \(did you mean 'mujoco'"):
        Task(engine="mujuco", parameters=P, x0=REST, t_end=1)
    with pytest.raises(InputError, match=r"a state has 6 entries .* or 8"):
        Task(engine="mujoco", parameters=P, x0=(0.0, 1.0), t_end=1)


def test_a_sweep_that_is_interrupted_or_killed_loses_nothing_that_was_done(tmp_path):
    """Interrupted once a batch is whole, then killed, then left alone: each time it goes on from
    there."""
    # Runs of some tenths of a second: however late the signal comes, some of them are still to be
    # done.
    sweep = f"sweep --vary omega_0=5:10:16 --batch 2 --time 15 -o {tmp_path} --workers".split()
    kept = {}
    for by in (signal.SIGINT, signal.SIGKILL):
        process = started(*sweep, 1, stderr=subprocess.STDOUT)
        while len(written(tmp_path)) == len(kept):
            time.sleep(0.02)
        process.send_signal(by)
        # the pipe ends once the worker, which holds it, too, is gone
        said, _ = process.communicate(timeout=60)
        assert "Traceback" not in said
        assert kept.items() < written(tmp_path).items()
        kept = written(tmp_path)
        assert len(data(tmp_path)) == 2 * len(kept) < 16
        if by is signal.SIGINT:
            assert process.returncode == 128 + by
            assert "the same command goes on from there" in said
    assert cli.main([*sweep, "0"]) == 0
    assert len(data(tmp_path)) == 16
    assert kept.items() <= written(tmp_path).items()
    assert not list(tmp_path.glob(".*"))


def test_a_second_program_is_refused_until_the_first_is_dead(tmp_path, capsys):
    line = f"sweep --vary omega_0=5:10:4 --time 0.05 --quiet -o {tmp_path} --workers 0 --batch"
    first = Lock(tmp_path)
    in_use = rf"{tmp_path} is in use by process {os.getpid()} on \S+, since .* UTC: wait for it"
    assert re.search(in_use, refused(capsys, f"{line} 2"))
    assert [path.name for path in tmp_path.iterdir()] == [".lock"]
    first._file.close()  # as when a process is killed
    for batch in (2, 3):  # the second time there is nothing left to do
        told(capsys, f"{line} {batch}")
    assert collection.collect(tmp_path, tmp_path / "all.h5") == 4
    assert not list(tmp_path.glob(".*"))


def test_a_lock_of_a_machine_that_is_gone_or_of_a_failed_campaign_is_nobodys(tmp_path):
    for left in ("process 1 on elsewhere, since 2001-01-01 00:00 UTC", ""):
        (tmp_path / ".lock").write_text(left)
        with Campaign(tmp_path, workers=0):
            assert "process 1 on elsewhere" not in (tmp_path / ".lock").read_text()
        assert not list(tmp_path.iterdir())
    with pytest.raises(ZeroDivisionError), Campaign(tmp_path, workers=0):
        raise ZeroDivisionError
    Lock(tmp_path).release()


@pytest.mark.parametrize("rounds", [20, pytest.param(400, marks=pytest.mark.slow)])
def test_no_two_have_a_lock_at_once(tmp_path, rounds):
    """Threads, of which each opens the file by itself, as programs do: who has it writes a name,
    and finds that."""
    (tmp_path / "log").mkdir()
    held = tmp_path / "log" / "held"

    def take_and_let_go(name):
        left = rounds
        while left:
            with contextlib.suppress(StorageError):
                lock = Lock(tmp_path)
                held.write_text(name)
                time.sleep(1e-4)
                assert held.read_text() == name
                held.unlink()
                lock.release()
                left -= 1

    with ThreadPoolExecutor(3) as pool:
        assert list(pool.map(take_and_let_go, "abc")) == [None] * 3


def test_a_file_system_without_locks_is_said(tmp_path, monkeypatch, capsys):
    def none(*_):
        raise OSError(38, "Function not implemented")

    monkeypatch.setattr("compare.campaign.lock.fcntl.flock", none)
    Lock(tmp_path).release()
    said = f"dualball: {tmp_path} can't be locked (Function not implemented): start no second prog"
    assert capsys.readouterr().err.startswith(said)
    with pytest.raises(StorageError, match="cannot write to"):
        Lock(tmp_path / "absent")
