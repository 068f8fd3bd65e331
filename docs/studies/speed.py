"""What theory costs: ``python -m docs.studies.speed docs/records/speed.md`` writes the tables of
that page, in ten minutes."""

from __future__ import annotations

import resource
import statistics
import sys
import time
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any
from unittest import mock

import numpy as np
from scipy.integrate import solve_ivp

from analytic import Settings, simulate, simulate_many
from analytic.simulation import equations, hybrid
from analytic.simulation.ensemble import random_starts
from analytic.simulation.equations import FINER
from analytic.simulation.integrator import Pace
from analytic.simulation.solvers import DONE, FIRED, STUCK, Stretch
from analytic.stationary.solutions import solution
from compare.kit.engines import engine
from compare.kit.pages import Rows
from compare.kit.tasks import Task, carry_out
from docs.studies.costs import REPEATS, two_against_one
from docs.studies.costs import seconds as clocked
from docs.studies.tables import write_all
from model import Case, Flow, Parameters, SimulationError, State, Trajectory
from model.arrays import Array
from model.kinematics import SLIP_XYZ, TURNING

LEAST, BEST = 0.3, 1e-13
"""Seconds that the runs of which the quickest counts take at least, and the tolerance of the run
that others are held against."""
RUNS = 100
"""Random runs at once."""
TOLERANCES = [10.0**-k for k in range(6, 14)]
METHODS = "LSODA", "Radau"
P = Parameters.named("reference")


@dataclass(frozen=True)
class Motion:
    """A run of theory."""

    p: Parameters
    x: State
    t_end: float
    flow: Flow


_ON_THE_WALL = solution(P.replace(omega_0=45.0), Case.NR).state
MOTIONS = {
    "slipping at both points, 20 s": Motion(
        P, State(omega_c=13.0, slip_x=-3.0, slip_y=0.08, slip_z=8.7), 20.0, Flow.steady(25.0)
    ),
    "rolling on the wall alone, 20 s": Motion(
        P, _ON_THE_WALL._replace(y=0.5, omega_c=44.5), 20.0, Flow.steady(45.0)
    ),
    "rolling at both points, Schiller and Naumann's drag, 20 s": Motion(
        P.replace(drag="schiller-naumann", nu_f=1e-5), State(omega_c=4.0), 20.0, Flow.steady(6.0)
    ),
    "staircase of five flows, 30 s": Motion(
        P, State(omega_c=5.0), 30.0, Flow.staircase([10, 25, 40, 25, 10], 6.0)
    ),
    "pulsation, 20 events in 20 s": Motion(P, State(omega_c=20.0), 20.0, Flow.sine(25.0, 8.0, 0.5)),
}


def seconds(work: Callable[[], Any], repeats: int = REPEATS) -> float:
    """Processor time, s, of the quickest of some."""
    spent = list[float]()
    while len(spent) < repeats or sum(spent) < LEAST:
        begin = time.process_time()
        work()
        spent.append(time.process_time() - begin)
    return min(spent)


def run(motion: Motion, rtol: float = 1e-9) -> Any:
    """By the study."""
    return simulate(motion.p, motion.x, motion.t_end, motion.flow, rtol=rtol)


def _solved(
    method: str, of: Stretch, pace: Pace, taken: int, most: int
) -> tuple[int, Pace, int, int]:
    """In the place of `integrator.stretch`: scipy's `solve_ivp`, to which what ends a case is an
    event.

    The time of the solver runs from zero, since a direction of slip settles very soon.
    """
    k, until, z, scale, times, samples, arm, _ = of
    start, span = pace[0], until - pace[0]
    due = times[taken : np.searchsorted(times, until, side="right")] - start

    def rates(t: float, z: Any) -> list[float]:
        out = [0.0] * len(z)
        equations.rates(start + t, z, k, out)
        return out

    def falling(guard: int) -> Callable[[float, Any], float]:
        def value(t: float, z: Any) -> float:
            out = [0.0] * len(arm)
            equations.guards(start + t, z, k, out)
            return out[guard]

        value.terminal, value.direction = True, -1  # type: ignore[attr-defined]
        return value

    found: Any = solve_ivp(  # type: ignore[call-overload]
        rates,
        (0.0, span),
        z,
        method=method,
        t_eval=np.union1d(due, [span]).clip(0.0, span),
        events=[falling(guard) for guard in range(len(arm))],
        first_step=pace[2] or None,
        rtol=k.rtol,
        atol=k.rtol / FINER * scale,
    )
    fired = [guard for guard, times in enumerate(found.t_events) if len(times)]
    end = float(found.t_events[fired[0]][0]) if fired else span
    if fired or len(found.y):
        z[:] = found.y_events[fired[0]][0] if fired else found.y[:, -1]
    count = int(np.searchsorted(due, end, side="right"))
    if count and found.status >= 0:
        samples[taken : taken + count] = found.y.T[:count]
    why = STUCK if found.status < 0 else FIRED if fired else DONE
    return why, (start + end, 0.0, 0.0, False, 0), fired[0] if fired else -1, taken + count


def by_scipy(motion: Motion, method: str, rtol: float) -> Any:
    """By a solver of `solve_ivp` and its events, the equations and what follows an event as the
    study has them."""
    with _by_solver(method), warnings.catch_warnings():
        warnings.simplefilter("ignore")  # it fails with one line more
        return run(motion, rtol)


def _by_solver(method: str) -> Any:
    """A context in which runs are made in plain Python, by a solver of `solve_ivp`."""
    plain: Any = hybrid.run_through_flow
    return mock.patch.multiple(
        hybrid, run_through_flow=plain.py_func, stretch=partial(_solved, method)
    )


def deviation(x: Any, right: Any) -> float:
    """Largest deviation of states, each variable in units of its largest, slips of the largest of
    all three."""
    sizes = np.abs(right).max(axis=0) + 1e-300
    sizes[SLIP_XYZ] = sizes[SLIP_XYZ].max()
    return float(np.abs((x - right) / sizes).max())


def event_driven() -> Rows:
    """What event-driven simulation costs and how exact it is, and `solve_ivp` at no greater
    error."""
    rows = [["", "the study, ms", "error"]]
    rows[0] += [
        cell
        for method in METHODS
        for cell in (f"solve_ivp with {method}, ms", "divided by the study's", "error")
    ]
    for name, motion in MOTIONS.items():
        right = run(motion, BEST).x
        error, spent = deviation(run(motion).x, right), seconds(partial(run, motion))
        row = [name, f"{1e3 * spent:.2f}", f"{error:.1e}"]
        for method in METHODS:
            row += _no_worse(motion, method, error, right, spent)
        rows.append(row)
    return rows


def _no_worse(
    motion: Motion, method: str, worst: float, right: Array, compiled: float
) -> list[str]:
    """Time, that divided by a compiled run's, and error of `solve_ivp` at the first of the
    tolerances that errs by no more than `worst`."""
    for rtol in TOLERANCES:
        try:
            error = deviation(by_scipy(motion, method, rtol).x, right)
        except SimulationError:
            return ["fails", "–", "–"]
        if error <= worst or rtol == TOLERANCES[-1]:
            spent = seconds(lambda rtol=rtol: by_scipy(motion, method, rtol), 2)  # type: ignore[misc]
            return [f"{1e3 * spent:.1f}", f"{spent / compiled:.1f}", f"{error:.1e}"]
    raise AssertionError


def states() -> Rows:
    """The same without the forces and samples that are made of states by the same code: what
    `solve_ivp` gives alone.

    By LSODA, of the motions that it gets through, at the tolerance at which it errs by no more than
    compiled runs."""
    rows = [["", "the study, ms", "solve_ivp with LSODA, ms", "divided by the study's"]]
    for name, motion in list(MOTIONS.items())[:3]:
        right = run(motion, BEST).x

        def compiled(rtol: float = 1e-9, of: Motion = motion) -> Array:
            x: Array = simulate_many(
                of.p, of.x, of.t_end, of.flow, Settings(rtol=rtol), threads=1
            ).x[0]
            return x

        def by_lsoda(rtol: float, own: Callable[[float], Array] = compiled) -> Array:
            with _by_solver("LSODA"):
                return own(rtol)

        worst = deviation(compiled(), right)
        rtol = next(
            each
            for each in TOLERANCES
            if deviation(by_lsoda(each), right) <= worst or each == TOLERANCES[-1]
        )
        ours, theirs = seconds(compiled), seconds(partial(by_lsoda, rtol))
        rows.append([name, f"{1e3 * ours:.2f}", f"{1e3 * theirs:.1f}", f"{theirs / ours:.1f}"])
    return rows


STEPPED, ALLOWED = [0.02 / n for n in (2, 4, 5, 8, 10, 20, 40)], 5e-3
"""Time steps, s, parts of the time between samples, and the error up to which one of them will
do."""


def stepped() -> Rows:
    """What the longest time step that errs by no more than `ALLOWED` costs, of the study's
    Moreau-Jean and of Siconos.

    Siconos runs in a process of its own, which is told the fluid's force and asked for the state at
    every step."""
    motion, siconos = MOTIONS["slipping at both points, 20 s"], engine("siconos")
    given = motion.p, motion.x, motion.t_end, motion.flow
    turning = np.isin(np.arange(8), np.arange(8)[TURNING])  # gaps and their rates are round-off
    right = run(motion, BEST).x * turning

    def longest(name: str, work: Callable[[float], Any]) -> list[str]:
        for step in STEPPED:
            begin = time.process_time(), resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
            x = work(step).x
            ours, own = (
                time.process_time() - begin[0],
                resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - begin[1],
            )
            if len(x) == len(right) and (error := deviation(x * turning, right)) <= ALLOWED:
                return [
                    name,
                    f"{1e3 * step:.3g}",
                    f"{error:.1e}",
                    f"{1e3 * (ours + own):.0f}",
                    f"{1e3 * own:.0f}",
                ]
        return [name, "none", "–", "–", "–"]

    if siconos.missing:
        sys.exit(siconos.missing)
    step_by_step = partial(simulate, *given, method="time-stepping")

    def take(step: float) -> Trajectory:
        way: dict[str, Any] = {
            "settings": siconos.at(step, motion.p),
            "sample_interval": motion.t_end / 1000,
        }
        task = Task(
            engine=siconos.name,
            parameters=motion.p,
            x0=motion.x,
            t_end=motion.t_end,
            flow=motion.flow,
            **way,
        )
        return carry_out(task)

    step_by_step(timestep=STEPPED[0])  # which compiles it
    error, spent = deviation(run(motion).x * turning, right), seconds(lambda: run(motion))
    return [
        ["", "time step, ms", "error", "processor time, ms", "of which its own process"],
        ["event-driven", "–", f"{error:.1e}", f"{1e3 * spent:.1f}", "–"],
        longest("Moreau-Jean", lambda step: step_by_step(timestep=step)),
        longest("Siconos", take),
    ]


def many() -> Rows:
    """Random runs by `simulate_many` against `simulate`, and threads, of the turn in which the
    machine allowed most."""
    starts = random_starts(P, RUNS)

    def apart() -> None:
        for x in starts:
            simulate(P, x, 5.0, sample_interval=1.0)

    def at_once(threads: int = 1, method: str = "event") -> None:
        simulate_many(
            P, starts, 5.0, settings=Settings(method=method), sample_interval=1.0, threads=threads
        )

    each = {name: 1e3 * seconds(way) / RUNS for name, way in (
        ("simulate, one after the other", apart),
        ("simulate_many, one thread", at_once),
        ("simulate_many, one thread, time stepping", lambda: at_once(method="time-stepping")),
    )}  # fmt: skip
    _, whole, *_ = each.values()
    inside, carry_out = list[float](), hybrid.run_through_flow

    def timed(*given: Any) -> Any:
        begin = time.thread_time()
        done = carry_out(*given)
        inside.append(1e3 * (time.thread_time() - begin))
        return done

    with mock.patch.object(hybrid, "run_through_flow", timed):
        spent = 1e3 * seconds(at_once, 1) / RUNS
    share = statistics.fmean(inside) / spent
    ratio, limit = two_against_one(lambda number: clocked(partial(at_once, number)))
    return [
        [f"{RUNS} random runs of 5 s", "a run, ms", "divided by one thread's"],
        *([name, f"{took:.2f}", f"{took / whole:.1f}"] for name, took in each.items()),
        ["share of that in compiled calls, for which other threads don't wait", "", f"{share:.2f}"],
        ["speed of two threads divided by that of one", "", f"{ratio:.2f}"],
        ["two processes of bare arithmetic at that time: the machine's limit", "", f"{limit:.2f}"],
    ]


if __name__ == "__main__":
    tables = {"event-driven": event_driven, "states": states, "siconos": stepped, "many": many}
    sys.exit(write_all(tables, "Write the tables on the speed of theory.", "docs/records/speed.md"))
