"""Throughput of campaigns, and what they take beside simulating and storing."""

import dataclasses
import math
import os
import statistics
import tempfile
import time
from concurrent.futures import Executor, ProcessPoolExecutor
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from compare.kit.campaign import Campaign, run_batch
from compare.kit.engines import MUJOCO
from compare.kit.tasks import Task, carry_out
from compare.kit.workers import Workers, dask, processes
from model import Parameters, State, storage

BATCH = 64
REPEATS = 5
FINISHED = 10_000
COUNT = 20_000_000
SLIPPING = Parameters.named("reference").replace(omega_0=25.0)
"""Slipping at both points: both contacts closed, and friction on its cone."""


def rows() -> list[list[str]]:
    """What is measured of campaigns, as rows of the table of `tests.benchmarks`."""
    two_over_one, machine, dask_over_processes = _ratios()
    return [
        ["campaign: two processes against one", "", "", f"{two_over_one:.2f}"],
        ["the same of bare arithmetic: the machine's limit", "", "", f"{machine:.2f}"],
        ["campaign: two Dask workers against two processes", "", "", f"{dask_over_processes:.2f}"],
        ["campaign: bookkeeping of a task", "", f"{1e3 * _bookkeeping():.1f} ms", ""],
        [f"campaign: resuming {FINISHED} finished tasks", "", f"{_resuming():.1f} s", ""],
    ]


def _tasks(count: int, t_end: float) -> list[Task]:
    """Runs from rest at different omega_0."""
    sets = [SLIPPING.replace(omega_0=15 + 10 * k / count) for k in range(count)]
    return [Task(engine=MUJOCO.name, parameters=p, x0=State(), t_end=t_end) for p in sets]


def _ratios() -> tuple[float, float, float]:
    """Throughput of two processes divided by that of one, of campaigns and of bare arithmetic; of two Dask workers
    divided by that of two processes, apart, since a scheduler takes its share. Medians of neighbouring timings."""
    tasks = _tasks(4 * BATCH, 2.0)  # a few seconds, against which the last batch to end counts little
    kinds = processes(1), processes(2)
    times = [[*(_timed(kind, tasks) for kind in kinds), *map(_computing, kinds)] for _ in range(REPEATS)]
    two_over_one = statistics.median(one / two for one, two, _, _ in times)
    machine = statistics.median(alone / both for _, _, alone, both in times)
    with ExitStack() as stack:
        cluster = _dask(stack)
        ratios = [_timed(kinds[1], tasks) / _timed(cluster, tasks) for _ in range(REPEATS)] if cluster else [math.nan]
    return two_over_one, machine, statistics.median(ratios)


def _dask(stack: ExitStack) -> Workers | None:
    try:
        from distributed import LocalCluster
    except ImportError:
        return None
    quiet: dict[str, Any] = {"host": "127.0.0.1", "dashboard_address": None, "silence_logs": 50}
    cluster: Any = LocalCluster(n_workers=2, threads_per_worker=1, **quiet)  # type: ignore[no-untyped-call]
    stack.enter_context(cluster)
    kind = dask(cluster.scheduler_address)
    stack.callback(kind.stop, kind.start(), False)
    return kind


def _computing(kind: Workers) -> float:
    """Time of arithmetic in two parts, on workers that have started."""
    executor = kind.start()
    _wake(executor, kind.count)
    start = time.perf_counter()
    list(executor.map(_count, [COUNT, COUNT]))
    elapsed = time.perf_counter() - start
    kind.stop(executor, False)
    return elapsed


def _wake(executor: Executor, count: int) -> None:
    """Wait until all workers have started and imported what they need; the first could do any short task alone."""
    while len(set(executor.map(_number, range(4 * count)))) < count:
        pass


def _number(_: int) -> int:
    time.sleep(0.02)
    return os.getpid()


def _count(times: int) -> None:
    for _ in range(times):
        pass


def _timed(kind: Workers, tasks: list[Task]) -> float:
    """Time of a campaign whose workers have started and imported what they need."""
    with tempfile.TemporaryDirectory() as warm, tempfile.TemporaryDirectory() as directory:
        executor = kind.start()
        _wake(executor, kind.count)
        kept = dataclasses.replace(kind, start=lambda: executor, stop=lambda executor, at_once: None)
        with Campaign(Path(warm), kept, batch=1) as campaign:
            campaign.complete(_tasks(8, 0.01))
        start = time.perf_counter()
        with Campaign(Path(directory), kept) as campaign:
            campaign.complete(tasks)
        elapsed = time.perf_counter() - start
        if isinstance(executor, ProcessPoolExecutor):
            kind.stop(executor, False)
    return elapsed


def _bookkeeping() -> float:
    """Median over `REPEATS` of what a task of a campaign in this process takes beyond simulating and storing it."""
    spent = []
    with tempfile.TemporaryDirectory() as directory:
        run_batch(_tasks(BATCH, 0.01), Path(directory), "alone", math.inf)  # imports
        for _ in range(REPEATS):
            start = time.process_time()
            run_batch(_tasks(BATCH, 0.01), Path(directory), "alone", math.inf)
            middle = time.process_time()
            with tempfile.TemporaryDirectory() as runs, Campaign(Path(runs), workers=0) as campaign:
                campaign.complete(_tasks(BATCH, 0.01))
            spent.append((time.process_time() - 2 * middle + start) / BATCH)
    return statistics.median(spent)


def _resuming() -> float:
    """Time to find out that `FINISHED` tasks are done, s."""
    with tempfile.TemporaryDirectory() as directory:
        tasks = _tasks(FINISHED, 0.01)
        (run,) = carry_out(tasks[:1])
        for k in range(0, FINISHED, BATCH):
            storage.save_batch({task.key: run for task in tasks[k : k + BATCH]}, Path(directory) / f"runs-{k:024x}.h5")
        start = time.perf_counter()
        with Campaign(Path(directory), workers=0) as campaign:
            campaign.complete(tasks)
        return time.perf_counter() - start
