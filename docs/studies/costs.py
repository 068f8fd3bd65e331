"""What runs of MuJoCo, campaigns and commands cost, as ratios in one run.

``python -m docs.studies.costs docs/records/speed.md`` writes the tables of that page, in some ten
minutes."""

from __future__ import annotations

import importlib.util
import itertools
import math
import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from mujoco.batch import Batch

import mjsim
from analytic import stable_solutions
from compare.kit.campaign import Campaign, Storing, run_batch
from compare.kit.engines import MUJOCO
from compare.kit.pages import Rows
from compare.kit.sweep import MOST
from compare.kit.tasks import Task, carry_out
from compare.kit.workers import Workers, dask, processes
from docs.studies.tables import write_all
from mjsim import scene
from mjsim.contact_settings import ContactSettings
from mjsim.engine import Run
from mjsim.recorder import COLUMNS
from mjsim.stepping import JointedBall
from model import Parameters, State, storage

REPEATS = 5
BATCH = 64
FINISHED = 10_000
PROGRAM = [sys.executable, "-m", "compare"]
STUDY = {
    "validate --quick": "validate --quick --quiet -o {0}",
    "judge": "judge {0}",
    "figures": "figures --results {0} -o {0}/figures",
}
"""The main job and its parts, by their names in the table; {0} is the directory of results."""
SLIPPING = Parameters.named("reference").replace(omega_0=25.0)
"""Slipping at both points: both contacts closed, and friction on its cone."""


def study() -> Rows:
    """A quick validation, and what is made of its measurements: processor time and memory."""
    rows = [["", "processor time", "by import mujoco", "memory"]]
    unit = min(_spent([sys.executable, "-c", "import mujoco"])[0] for _ in range(REPEATS))
    with tempfile.TemporaryDirectory() as directory:
        for name, words in STUDY.items():
            spent, held = _spent([*PROGRAM, *words.format(directory).split()])
            rows.append(
                [f"dualball {name}", f"{spent:.1f} s", f"{spent / unit:.0f}", f"{held:.0f} MB"]
            )
    return rows


def costs() -> Rows:
    """The loop over bare steps, alone and in a batch; threads; campaigns."""
    rows = [["", "bare mj_step", "whole loop", "ratio"]]
    for name, runs in (("one simulation", 1), (f"batch of {BATCH}", BATCH)):
        bare, whole, ratio = cost(runs)
        rows.append([name, f"{1e6 * bare:.2f} µs", f"{1e6 * whole:.2f} µs", f"{ratio:.2f}"])
    count = 4 * BATCH
    given = [task.parameters for task in _tasks(count)], [State()] * count, 2.0

    def on_threads(number: int) -> float:
        return seconds(partial(mjsim.simulate_many, *given, sample_interval=0.2, threads=number))

    two_threads, threads_limit = two_against_one(on_threads)
    two_over_one, machine = two_against_one(lambda number: _campaign(partial(processes, number)))
    return [
        *rows,
        [f"simulate_many of {count}: two threads against one", "", "", f"{two_threads:.2f}"],
        [
            "two processes of bare arithmetic at that time: the machine's limit",
            "",
            "",
            f"{threads_limit:.2f}",
        ],
        ["campaign: two processes against one", "", "", f"{two_over_one:.2f}"],
        ["the same of bare arithmetic: the machine's limit", "", "", f"{machine:.2f}"],
        ["campaign: two Dask workers against two processes", "", "", f"{by_dask():.2f}"],
        ["campaign: bookkeeping of a task", "", f"{1e3 * bookkeeping():.1f} ms", ""],
        [f"campaign: resuming {FINISHED} finished tasks", "", f"{resuming():.1f} s", ""],
    ]


def two_against_one(taken: Callable[[int], float]) -> tuple[float, float]:
    """Speed of two at work, of what one or two take in s, divided by that of one; and what the
    machine allows two processes; of the turn in which it allowed most, since other programs take
    their share."""
    loop = [sys.executable, "-c", "for _ in range(20_000_000): pass"]

    def loops(number: int) -> None:
        for each in [subprocess.Popen(loop) for _ in range(number)]:
            each.wait()

    def allowed() -> float:
        return 2 * seconds(partial(loops, 1)) / seconds(partial(loops, 2))

    taken(2)
    turns = []
    for _ in range(REPEATS):
        before, one, two = allowed(), taken(1), taken(2)
        turns.append((min(before, allowed()), one / two))
    limit, ratio = max(turns)
    return ratio, limit


def start_up() -> Rows:
    """Processor time until commands have answered, beside that of importing MuJoCo."""
    asked = {
        "import mujoco": [sys.executable, "-c", "import mujoco"],
        "import mjsim": [sys.executable, "-c", "import mjsim"],
        "dualball --version": [*PROGRAM, "--version"],
        "dualball --help": [*PROGRAM, "--help"],
        "dualball predict": [*PROGRAM, "predict"],
        "dualball cases": [*PROGRAM, "cases"],
    }
    took = {name: min(_spent(words)[0] for _ in range(REPEATS)) for name, words in asked.items()}
    first = took["import mujoco"]
    return [
        ["", "processor time", "by import mujoco"],
        *([name, f"{own:.2f} s", f"{own / first:.2f}"] for name, own in took.items()),
    ]


def growth() -> Rows:
    """What a run of 0.1 s takes in sweeps of more and more of them, of which only means are
    stored."""
    rows = [
        [
            "runs",
            "sweep: processor time",
            "memory",
            "on the disk",
            "collect: processor time",
            "memory",
        ]
    ]
    with tempfile.TemporaryDirectory() as directory:
        for count in (1000, 10_000, MOST):
            runs, table = Path(directory) / str(count), Path(directory) / f"{count}.h5"
            vary = (
                f"sweep --vary omega_0=5:45:{count} --time 0.1 --means-only --quiet --workers 0 "
                f"-o {runs}"
            )
            taken = [
                _spent([*PROGRAM, *words.split()])
                for words in (vary, f"collect {runs} -o {table} --workers 0")
            ]
            size = sum(file.stat().st_size for file in runs.iterdir())
            (sweep, held), (gather, kept) = taken
            costs = (
                f"{1e3 * sweep / count:.2f} ms a run",
                f"{held:.0f} MB",
                f"{size / count / 1e3:.2f} kB a run",
            )
            rows.append(
                [
                    f"{count:,}".replace(",", " "),
                    *costs,
                    f"{1e3 * gather / count:.2f} ms a run",
                    f"{kept:.0f} MB",
                ]
            )
    return rows


def _spent(words: list[str]) -> tuple[float, float]:
    """Processor time of a program and its workers, s, and its largest memory, MB."""
    process = subprocess.Popen(words, stdout=subprocess.DEVNULL)
    _, status, usage = os.wait4(process.pid, 0)
    if status:
        sys.exit(f"ends with {os.waitstatus_to_exitcode(status)}: {' '.join(words)}")
    return usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024


def cost(runs: int, steps: int = 2500) -> list[float]:
    """Processor time of a bare and of a whole step of one simulation, s, and their ratio: medians
    over `REPEATS`.

    There is a sample every 100 steps. Timings are taken in turn, each whole one between two bare
    ones: a machine that slows down does so for both. The bare steps are those of a settled run with
    its forces left as they are, and the ball held at its azimuth,
    where the wall stands, by an assignment a step."""
    settings, p = ContactSettings(), SLIPPING
    (state,) = stable_solutions(p)
    model, _ = scene.build(p, settings)
    settled = JointedBall(model, p, settings, State.one(state.x), 0.0)
    settled.advance(np.full(500, p.omega_0), np.empty((500, COLUMNS)))
    start = p, state.x, steps * settings.timestep, None, settings
    bare, whole = [_bare(settled, runs, steps)], []
    for _ in range(REPEATS):
        loops = itertools.chain(
            *(Run(*start, sample_interval=100 * settings.timestep) for _ in range(runs))
        )
        whole.append(seconds(partial(list, loops), time.process_time))
        bare.append(_bare(settled, runs, steps))
    ratios = [
        2 * w / (before + after) for w, before, after in zip(whole, bare, bare[1:], strict=False)
    ]
    each = steps * runs
    return [
        statistics.median(bare) / each,
        statistics.median(whole) / each,
        statistics.median(ratios),
    ]


def _bare(settled: JointedBall, runs: int, steps: int) -> float:
    """Time in s of the given steps with no more around them than a loop."""
    model, data = settled.model, settled.data
    if runs == 1:
        azimuth, step = data.qpos[:1], partial(mujoco.mj_step, model, data)
    else:
        batch = Batch(model, nsim=runs, nthread=1)
        for name in ("qpos", "qvel", "qfrc_applied", "mocap_quat", "qacc_warmstart"):
            batch.bind(name)[:] = getattr(data, name)
        azimuth, step = batch.bind("qpos")[:, 0], batch.step
    held = float(data.qpos[0])

    def loop() -> None:
        for _ in range(steps):
            step()
            azimuth[:] = held

    return seconds(loop, time.process_time)


def seconds(work: Callable[[], Any], clock: Callable[[], float] = time.perf_counter) -> float:
    """What some work takes, s."""
    start = clock()
    work()
    return clock() - start


def by_dask() -> float:
    """Speed of two Dask workers in a campaign divided by that of two processes, median; nan without
    Dask."""
    if not importlib.util.find_spec("distributed"):
        return math.nan
    from distributed import LocalCluster

    given: dict[str, Any] = {"n_workers": 2, "threads_per_worker": 1, "silence_logs": 50}
    cluster: Any = LocalCluster(host="127.0.0.1", dashboard_address=None, **given)  # type: ignore[no-untyped-call]
    with cluster:
        both = partial(processes, 2), partial(dask, cluster.scheduler_address)
        turns = [[_campaign(kind) for kind in both] for _ in range(REPEATS)]
    return statistics.median(two / other for two, other in turns)


def _campaign(kind: Callable[[], Workers]) -> float:
    """Time in s that a campaign of twice the tasks takes more: what workers take to begin and to
    end cancels."""

    def run(size: int) -> None:
        with (
            tempfile.TemporaryDirectory() as directory,
            Campaign(Path(directory), kind()) as campaign,
        ):
            campaign.complete(_tasks(4 * size * BATCH, 2.0))

    return seconds(partial(run, 2)) - seconds(partial(run, 1))


def _tasks(count: int, t_end: float = 0.01) -> list[Task]:
    """Runs from rest at different omega_0."""
    sets = [SLIPPING.replace(omega_0=15 + 10 * k / count) for k in range(count)]
    return [Task(engine=MUJOCO.name, parameters=p, x0=State(), t_end=t_end) for p in sets]


def bookkeeping() -> float:
    """Median over `REPEATS` of what a task of a campaign in this process takes beyond simulating
    and storing it, s."""
    spent, tasks = [], _tasks(BATCH)

    def campaign() -> None:
        with tempfile.TemporaryDirectory() as runs, Campaign(Path(runs), workers=0) as here:
            here.complete(tasks)

    with tempfile.TemporaryDirectory() as directory:
        alone = partial(run_batch, tasks, Storing(Path(directory), "alone"), math.inf)
        alone()  # imports
        for _ in range(REPEATS):
            spent.append(
                (-seconds(alone, time.process_time) + seconds(campaign, time.process_time)) / BATCH
            )
    return statistics.median(spent)


def resuming() -> float:
    """Time to find out that `FINISHED` tasks are done, s."""
    with tempfile.TemporaryDirectory() as directory:
        tasks = _tasks(FINISHED)
        run = carry_out(tasks[0])
        for k in range(0, FINISHED, BATCH):
            storage.save_batch(
                {task.key: run for task in tasks[k : k + BATCH]},
                Path(directory) / f"runs-{k:024x}.h5",
            )
        with Campaign(Path(directory), workers=0) as campaign:
            return seconds(partial(campaign.complete, tasks))


if __name__ == "__main__":
    tables = {"growth": growth, "costs": costs, "study": study, "start": start_up}
    sys.exit(
        write_all(
            tables,
            "Write the tables on the costs of runs, campaigns and commands.",
            "docs/records/speed.md",
        )
    )
