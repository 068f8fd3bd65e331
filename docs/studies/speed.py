"""What theory, MuJoCo, campaigns and commands cost, as ratios in one run: ``python -m
docs.studies.speed docs/records/speed.md`` writes the tables of that page, in some ten minutes."""

import itertools
import os
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
from scipy.integrate import DOP853, LSODA

import mjsim
from analytic import Settings, simulate, simulate_many, solution, stable_solutions
from analytic.simulation.ensemble import random_starts
from compare.campaign.campaign import Campaign
from compare.campaign.tasks import Task
from compare.campaign.workers import processes
from compare.engines.study import MUJOCO
from compare.figures.pages import Rows
from docs.studies.tables import write_all
from docs.studies.ways import processor_time
from mjsim import scene
from mjsim.contact_settings import ContactSettings
from mjsim.engine import Run
from mjsim.recorder import COLUMNS
from mjsim.stepping import JointedBall
from model import Case, Flow, Parameters, State
from model.arrays import Array
from model.kinematics import SLIP_XYZ
from tests.by_scipy import runs_by_scipy

REPEATS, RUNS, BATCH = 5, 100, 64
BEST = 1e-13
"""The tolerance of the run that others are held against."""
RIVALS = LSODA, DOP853
"""Fast integrators of scipy."""
P = Parameters.named("reference")
SLIPPING = P.replace(omega_0=25.0)
"""Slipping at both points: both contacts closed, and friction on its cone."""
_KICKED = State(omega_c=13.0, slip_x=-3.0, slip_y=0.08, slip_z=8.7)
_RIDING = solution(P.replace(omega_0=45.0), Case.NR).state._replace(y=0.5, omega_c=44.5)
_STAIRS = Flow.staircase([10, 25, 40, 25, 10], 6.0)
MOTIONS: dict[str, tuple[State, float, Flow]] = {
    "slipping at both points, 20 s": (_KICKED, 20.0, Flow.steady(25.0)),
    "rolling on the wall alone, 20 s": (_RIDING, 20.0, Flow.steady(45.0)),
    "staircase of five flows, 30 s": (State(omega_c=5.0), 30.0, _STAIRS),
    "pulsation, 20 events in 20 s": (State(omega_c=20.0), 20.0, Flow.sine(25.0, 8.0, 0.5)),
}
"""Runs of theory: start, duration, flow."""


def seconds(work: Callable[[], Any]) -> float:
    """What some work takes, s."""
    start = time.perf_counter()
    work()
    return time.perf_counter() - start


def quickest(work: Callable[[], Any]) -> float:
    """Processor time, s, of the quickest of some."""
    return min(processor_time(work) for _ in range(REPEATS))


def event_driven() -> Rows:
    """What event-driven runs cost and how exact they are, compiled and by integrators of scipy."""
    rows = [["", "the study, ms", "error", "by scipy", "ms", "error", "times as long"]]
    for name, (start, lasts, flow) in MOTIONS.items():
        run = partial(simulate, P, start, lasts, flow)
        right = run(rtol=BEST).x
        ours, error = quickest(run), deviation(run().x, right)
        study = [f"{1e3 * ours:.2f}", f"{error:.1e}"]
        for rival in RIVALS:
            with runs_by_scipy(rival):
                theirs, other = quickest(run), deviation(run().x, right)
            costs = f"{1e3 * theirs:.0f}", f"{other:.1e}", f"{theirs / ours:.0f}"
            rows.append([name, *study, rival.__name__, *costs])
            name, study = "", ["", ""]
    return rows


def deviation(x: Array, right: Array) -> float:
    """Largest deviation of states, each variable in units of its largest, slips of the largest of
    all three."""
    sizes = np.abs(right).max(axis=0) + 1e-300
    sizes[SLIP_XYZ] = sizes[SLIP_XYZ].max()
    return float(np.abs((x - right) / sizes).max())


def many() -> Rows:
    """Random runs of theory one by one and at once, and by both methods."""
    starts = random_starts(P, RUNS)

    def apart() -> None:
        for x in starts:
            simulate(P, x, 5.0, sample_interval=1.0)

    def at_once(method: str) -> None:
        settings = Settings(method=method)
        simulate_many(P, starts, 5.0, settings=settings, sample_interval=1.0, threads=1)

    ways: dict[str, Callable[[], None]] = {
        "simulate, one after the other": apart,
        "simulate_many, one thread": partial(at_once, "event"),
        "simulate_many, one thread, time stepping": partial(at_once, "time-stepping"),
    }
    took = ([name, f"{1e3 * quickest(way) / RUNS:.2f}"] for name, way in ways.items())
    return [[f"{RUNS} random runs of 5 s", "a run, ms"], *took]


def costs() -> Rows:
    """The loop over bare steps, alone and in a batch; two threads and processes; campaigns."""
    rows = [["", "bare mj_step", "whole loop", "ratio"]]
    for name, runs in (("one simulation", 1), (f"batch of {BATCH}", BATCH)):
        bare, whole, ratio = cost(runs)
        rows.append([name, f"{1e6 * bare:.2f} µs", f"{1e6 * whole:.2f} µs", f"{ratio:.2f}"])
    count = 4 * BATCH
    given = [task.parameters for task in _tasks(count)], [State()] * count, 2.0

    def on_threads(number: int) -> float:
        return seconds(partial(mjsim.simulate_many, *given, sample_interval=0.2, threads=number))

    for name, taken in {
        f"simulate_many of {count}: two threads against one": on_threads,
        "campaign: two processes against one": _campaign,
    }.items():
        ratio, limit = two_against_one(taken)
        rows.append([name, "", "", f"{ratio:.2f}"])
        rows.append(["the same of bare arithmetic: the machine's limit", "", "", f"{limit:.2f}"])
    return rows


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
    asked = {f"import {name}": ["-c", f"import {name}"] for name in ("mujoco", "mjsim")}
    for words in ("--version", "--help", "predict", "cases"):
        asked[f"dualball {words}"] = ["-m", "compare", words]
    took = {name: min(_spent(words)[0] for _ in range(REPEATS)) for name, words in asked.items()}
    rows = [["", "processor time", "by import mujoco"]]
    for name, own in took.items():
        rows.append([name, f"{own:.2f} s", f"{own / took['import mujoco']:.2f}"])
    return rows


def growth() -> Rows:
    """What a run of 0.1 s takes in sweeps of more and more of them, of which only means are
    stored."""
    head = ["runs", "sweep: ms a run", "memory, MB", "kB a run"]
    rows = [[*head, "collect: ms a run", "memory, MB"]]
    for count in (1000, 10_000):
        with tempfile.TemporaryDirectory() as directory:
            runs = Path(directory) / "runs"
            sweep = f"sweep --vary omega_0=5:45:{count} --time 0.1 --means-only -o {runs}"
            collect = f"collect {runs} -o {runs}.h5"
            (swept, held), (gathered, kept) = (
                _spent(["-m", "compare", *line.split(), "--workers", "0"])
                for line in (sweep, collect)
            )
            size = sum(file.stat().st_size for file in runs.iterdir())
        cells = 1e3 * swept / count, held, size / 1e3 / count, 1e3 * gathered / count, kept
        rows.append([str(count), *(f"{x:.3g}" for x in cells)])
    return rows


def _spent(words: list[str]) -> tuple[float, float]:
    """Processor time of a Python and its workers, s, and its largest memory, MB."""
    process = subprocess.Popen(
        [sys.executable, *words], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
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
    settled = JointedBall(model, p, settings)
    settled.start(State.one(state.x), 0.0)
    settled.advance(np.full(500, p.omega_0), np.empty((500, COLUMNS)))
    start = p, state.x, steps * settings.timestep, None, settings
    bare, whole = [_bare(settled, runs, steps)], []
    for _ in range(REPEATS):
        runs_of_it = [Run(*start, sample_interval=100 * settings.timestep) for _ in range(runs)]
        whole.append(processor_time(partial(list, itertools.chain(*runs_of_it))))
        bare.append(_bare(settled, runs, steps))
    ratios = 2 * np.array(whole) / (np.array(bare[:-1]) + bare[1:])
    each = steps * runs
    return [float(np.median(bare)) / each, float(np.median(whole)) / each, float(np.median(ratios))]


def _bare(settled: JointedBall, runs: int, steps: int) -> float:
    """Time in s of the given steps with no more around them than a loop."""
    model, data = settled.model, settled.data
    data.qpos[0] = 0.0
    if runs == 1:
        azimuth, step = data.qpos[:1], partial(mujoco.mj_step, model, data)
    else:
        batch = Batch(model, nsim=runs, nthread=1)
        for name in ("qpos", "qvel", "qfrc_applied", "qacc_warmstart"):
            batch.bind(name)[:] = getattr(data, name)
        azimuth, step = batch.bind("qpos")[:, 0], batch.step

    def loop() -> None:
        for _ in range(steps):
            step()
            azimuth[:] = 0.0

    return processor_time(loop)


def _campaign(number: int) -> float:
    """Time in s that a campaign of twice the tasks takes more: what processes take to begin and to
    end cancels."""

    def run(size: int) -> None:
        with (
            tempfile.TemporaryDirectory() as directory,
            Campaign(Path(directory), processes(number)) as campaign,
        ):
            campaign.complete(_tasks(4 * size * BATCH, 2.0))

    return seconds(partial(run, 2)) - seconds(partial(run, 1))


def _tasks(count: int, t_end: float = 0.01) -> list[Task]:
    """Runs from rest at different omega_0."""
    sets = [SLIPPING.replace(omega_0=15 + 10 * k / count) for k in range(count)]
    return [Task(engine=MUJOCO.name, parameters=p, x0=State(), t_end=t_end) for p in sets]


TABLES = {
    "event-driven": event_driven,
    "many": many,
    "growth": growth,
    "costs": costs,
    "start": start_up,
}


if __name__ == "__main__":
    sys.exit(write_all(TABLES, "Write the tables on what it costs.", "docs/records/speed.md"))
