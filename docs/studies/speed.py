"""Write the tables on speed: ``python -m docs.studies.speed docs/speed.md``."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any
from unittest import mock

import numpy as np
from scipy.integrate import solve_ivp

from analytic import simulate
from analytic.simulation import charts, integrator
from analytic.simulation.motion import Fluid, Moment
from analytic.stationary.solutions import solution
from compare.kit.pages import Rows
from docs.studies.tables import write_all
from model import Case, Flow, Parameters, State
from model.kinematics import SLIP_XYZ

REPEATS, BEST = 5, 1e-13
"""Runs of which the quickest counts, and the tolerance of the one that others are held against."""
TOLERANCES = [10.0**-k for k in range(6, 14)]
P = Parameters.named("reference")


@dataclass(frozen=True)
class Motion:
    """A run of theory; `case` where it stays in one, so that a solver with events can do it, too."""

    p: Parameters
    x: State
    t_end: float
    flow: Flow
    case: Case | None = None


_ON_THE_WALL = solution(P.replace(omega_0=45.0), Case.NR).state
MOTIONS = {
    "slipping at both points, 20 s": Motion(
        P, State(omega_c=13.0, slip_x=-3.0, slip_y=0.08, slip_z=8.7), 20.0, Flow.steady(25.0), Case.SS
    ),
    "rolling on the wall alone, 20 s": Motion(
        P, _ON_THE_WALL._replace(y=0.5, omega_c=44.5), 20.0, Flow.steady(45.0), Case.NR
    ),
    "rolling at both points, Schiller and Naumann's drag, 20 s": Motion(
        P.replace(drag="schiller-naumann", nu_f=1e-5), State(omega_c=4.0), 20.0, Flow.steady(6.0)
    ),
    "staircase of five flows, 30 s": Motion(P, State(omega_c=5.0), 30.0, Flow.staircase([10, 25, 40, 25, 10], 6.0)),
    "pulsation, 20 events in 20 s": Motion(P, State(omega_c=20.0), 20.0, Flow.sine(25.0, 8.0, 0.5)),
}  # fmt: skip


def seconds(work: Callable[[], Any]) -> float:
    """Processor time, s, of the quickest of some."""
    spent = []
    for _ in range(REPEATS):
        begin = time.process_time()
        work()
        spent.append(time.process_time() - begin)
    return min(spent)


def run(motion: Motion, rtol: float = 1e-9) -> Any:
    """By the study."""
    return simulate(motion.p, motion.x, motion.t_end, motion.flow, rtol=rtol)


def plainly(motion: Motion, rtol: float = 1e-9) -> Any:
    """By the study where numba isn't installed."""
    with mock.patch.object(integrator, "_solvers", return_value=None):
        return run(motion, rtol)


def by_scipy(motion: Motion, case: Case, rtol: float) -> Any:
    """By `solve_ivp` with LSODA, events and a thousand samples, the equations given as the study has them."""
    start = Moment(0.0, 0.0, motion.x, *(float(np.arctan2(a, b)) for a, b in _slips(motion.x)))
    chart = charts.chart(case, start, motion.p, Fluid.of(motion.flow, 0.0), 1e-9, "slip-stability")

    def guard(k: int) -> Callable[[float, Any], float]:
        def value(t: float, z: Any) -> float:
            return chart.guards(t, z)[k]

        value.terminal, value.direction = True, -1  # type: ignore[attr-defined]
        return value

    times, events = np.linspace(0, motion.t_end, 1001), [guard(k) for k in range(len(chart.ends))]
    atol = rtol / 1e3 * np.array(chart.scale)
    found: Any = solve_ivp(  # type: ignore[call-overload]
        chart.rates, (0, motion.t_end), chart.start, method="LSODA", t_eval=times, events=events, rtol=rtol, atol=atol
    )
    return chart.path(found.t, found.y)


def _slips(x: State) -> tuple[tuple[float, float], tuple[float, float]]:
    return (x.slip_x, x.slip_z), (x.slip_y, x.slip_z)


def deviation(x: Any, right: Any) -> float:
    """Largest deviation of states, each variable in units of its largest, slips of the largest of all three."""
    sizes = np.abs(right).max(axis=0) + 1e-300
    sizes[SLIP_XYZ] = sizes[SLIP_XYZ].max()
    return float(np.abs((x - right) / sizes).max())


def event_driven() -> Rows:
    """What event-driven simulation costs and how exact it is, and `solve_ivp` at no greater error."""
    rows = [["", "compiled, ms", "error", "plain Python, ms", "error", "solve_ivp with LSODA, ms", "error"]]
    for name, motion in MOTIONS.items():
        right, row = run(motion, BEST).x, [name]
        worst = 0.0
        for way in (run, plainly):
            error = deviation(way(motion).x, right)
            worst = max(worst, error)
            row += [f"{1e3 * seconds(lambda way=way, motion=motion: way(motion)):.2f}", f"{error:.0e}"]  # type: ignore[misc]
        found = ["–", "–"]
        for rtol in TOLERANCES:
            if (case := motion.case) is None:
                break
            error = deviation(by_scipy(motion, case, rtol).x, right)
            if error <= worst or rtol == TOLERANCES[-1]:
                spent = seconds(lambda rtol=rtol, motion=motion, case=case: by_scipy(motion, case, rtol))  # type: ignore[misc]
                found = [f"{1e3 * spent:.1f}", f"{error:.0e}"]
                break
        rows.append([*row, *found])
    return rows


TABLES: dict[str, Callable[[], Rows]] = {"event-driven": event_driven}


if __name__ == "__main__":
    sys.exit(write_all(TABLES, "Write the tables on speed.", "docs/speed.md"))
