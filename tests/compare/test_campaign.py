"""A campaign's results depend on nothing but its tasks, and nothing that is done is done again or lost."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from compare.campaign import Campaign, Progress
from compare.tasks import Task
from model import InputError, Parameters, SimulationError, StorageError, storage
from model.trajectory import Trajectory, columns

REST = (0.0,) * 8


def tasks(count: int = 9, t_end: float = 0.2) -> list[Task]:
    p = Parameters.named("reference")
    return [Task(engine="mujoco", parameters=p.replace(omega_0=5.0 + k), x0=REST, t_end=t_end) for k in range(count)]


def data(directory: Path) -> dict[str, dict[str, bytes]]:
    """All numbers of all runs of a directory."""
    runs = {path.name: storage.load(path) for path in directory.glob("*.h5")}
    return {n: {c: getattr(t, c).tobytes() for c in columns(Trajectory)} for n, t in runs.items()}


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> dict[str, dict[str, bytes]]:
    directory = tmp_path_factory.mktemp("undisturbed")
    with Campaign(directory, workers=0) as campaign:
        assert campaign.complete(tasks()) == []
    return data(directory)


@pytest.mark.parametrize(("workers", "batch"), [(0, 1), (1, 7), (2, 1), (2, 64)])
def test_workers_and_batches_change_no_bit(tmp_path: Path, undisturbed, workers: int, batch: int) -> None:
    with Campaign(tmp_path, workers, batch) as campaign:
        assert campaign.complete(reversed(tasks())) == []
    assert data(tmp_path) == undisturbed


def test_what_is_done_is_not_done_again(tmp_path: Path) -> None:
    seen: list[Progress] = []
    with Campaign(tmp_path, workers=0, report=seen.append) as campaign:
        campaign.complete(tasks(3))
        before = {path.name: path.stat().st_mtime_ns for path in tmp_path.iterdir()}
        campaign.complete(tasks(4))
    assert before.items() <= {path.name: path.stat().st_mtime_ns for path in tmp_path.iterdir()}.items()
    assert seen[-1] == Progress(4, 4, 0)


def test_every_input_is_part_of_the_identity() -> None:
    from mjsim import ContactSettings
    from model import Flow

    (task,) = tasks(1)
    p = task.parameters
    others = [
        Task(engine="event", parameters=p, x0=REST, t_end=0.2),
        Task(engine="mujoco", parameters=p.replace(mu=0.21), x0=REST, t_end=0.2),
        Task(engine="mujoco", parameters=p, x0=(*REST[:7], 1e-300), t_end=0.2),
        Task(engine="mujoco", parameters=p, x0=REST, t_end=0.3),
        Task(engine="mujoco", parameters=p, x0=REST, t_end=0.2, sample_interval=0.1),
        Task(engine="mujoco", parameters=p, x0=REST, t_end=0.2, settings=ContactSettings.at(5e-4)),
        Task(engine="mujoco", parameters=p, x0=REST, t_end=0.2, flow=Flow.ramp(1, 2, 1)),
    ]
    assert len({task.key, *(other.key for other in others)}) == 1 + len(others)
    same = Task(engine="mujoco", parameters=p, x0=REST, t_end=0.2, flow=Flow.steady(p.omega_0))
    assert same.key == task.key


def test_a_run_that_diverges_is_reported_and_the_rest_goes_on(tmp_path: Path) -> None:
    wild = Task(engine="mujoco", parameters=Parameters.named("reference"), x0=(0, 0, 1e9, 0, 0, 0), t_end=0.2)
    with Campaign(tmp_path, workers=0) as campaign:
        failures = campaign.complete([*tasks(2), wild])
        assert [failure.task for failure in failures] == [wild]
        assert "diverged" in failures[0].reason
        assert sorted(path.suffixes for path in tmp_path.iterdir()) == [[".failed", ".h5"], [".h5"], [".h5"]]
        with pytest.raises(SimulationError, match="diverged"):
            campaign.run([wild])
    with Campaign(tmp_path, workers=0) as again:  # it is not tried again, but told again
        assert [failure.task.key for failure in again.complete([wild])] == [wild.key]


def test_a_killed_worker_costs_its_runs_in_flight_only(tmp_path: Path, undisturbed) -> None:
    killed = []

    def kill_one(now: Progress) -> None:
        if not killed and now.done:
            processes = list(campaign._pool._processes)
            killed.append(processes[0])
            os.kill(processes[0], signal.SIGKILL)

    with Campaign(tmp_path, workers=2, batch=1, report=kill_one) as campaign:
        assert campaign.complete(tasks()) == []
    assert killed
    assert data(tmp_path) == undisturbed
    assert not list(tmp_path.glob(".*"))


PROGRAM = """
import sys
sys.path.insert(0, {here!r})
import test_campaign
from compare.campaign import Campaign
if __name__ == "__main__":
    with Campaign({directory!r}, workers=2, batch=1) as campaign:
        campaign.complete(test_campaign.tasks())
"""


def kill_until_done(directory: Path, kills: int, seed: int) -> None:
    """Start the campaign again and again, killing it after a random time, then let it finish."""
    program = PROGRAM.format(here=str(Path(__file__).parent), directory=str(directory))
    script = directory.parent / "program.py"
    script.write_text(program)
    rng = np.random.default_rng(seed)
    for _ in range(kills):
        process = subprocess.Popen([sys.executable, str(script)], start_new_session=True)
        time.sleep(rng.uniform(1.0, 6.0))
        os.killpg(process.pid, signal.SIGKILL)
        process.wait()
    subprocess.run([sys.executable, str(script)], check=True)


@pytest.mark.parametrize("kills", [2, pytest.param(50, marks=pytest.mark.slow)])
def test_kill_minus_nine_loses_nothing_that_was_done(tmp_path: Path, undisturbed, kills: int) -> None:
    directory = tmp_path / "runs"
    directory.mkdir()
    kill_until_done(directory, kills, seed=kills)
    assert data(directory) == undisturbed
    assert not list(directory.glob(".*"))


def test_bad_campaigns(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="workers = -1"):
        Campaign(tmp_path, workers=-1)
    with pytest.raises(InputError, match="batch = 0"):
        Campaign(tmp_path, batch=0)
    (tmp_path / "file").write_text("")
    with pytest.raises(StorageError, match="cannot write to"):
        Campaign(tmp_path / "file")
    with pytest.raises(InputError, match=r"no engine is called 'mujuco' \(did you mean 'mujoco'\?\)"):
        Task(engine="mujuco", parameters=Parameters.named("reference"), x0=REST, t_end=1)
