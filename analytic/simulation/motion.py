"""Data of simulations: the ball in its flow, a moment, and the record of a run."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from analytic.mechanics import drag, rigid_body
from analytic.simulation import equations
from analytic.simulation.equations import Line, System
from analytic.simulation.settings import Settings
from model import Case, Events, Flow, Header, Parameters, State, Trajectory
from model.arrays import Array
from model.drag import STOKES
from model.trajectory import samples


class HybridState(NamedTuple):
    """A state with its time and azimuth, the directions of slip, and the work done so far."""

    time: float
    theta: float
    x: State
    alpha: float = math.nan
    """Direction of slip at A (8), rad, where it slips; at the very onset the state doesn't
    determine it."""
    beta: float = math.nan
    """Direction of slip at B (8), rad."""
    work: float = 0.0
    """Work of drag, friction and impacts so far, J."""


def line_of(flow: Flow, start: float) -> Line:
    """The linear piece of a flow, without its waves, that holds from the time `start`: a knot of
    the flow, or 0."""
    k = int(np.searchsorted(flow.start, start, side="right")) - 1
    if k < 0:
        return Line(float(start), float(flow.value[0]), 0.0)
    return Line(float(flow.start[k]), float(flow.value[k]), float(flow.slope[k]))


def of_ball(p: Parameters, flow: Flow, settings: Settings) -> System:
    """The constants of a ball's motion as plain numbers, with the flow at first; `in_case` sets the
    case."""
    m, r, R, j, mu, eta, g, c = map(float, (p.m, p.r, p.R, p.j, p.mu, p.eta, p.g, p.c))
    law, unit = drag.DragLaw(*map(float, drag.law(p))), math.sqrt(R / g)
    leaves = {"slip-stability": equations.STABILITY, "infeasible": equations.FEASIBILITY}[
        settings.leave_rolling
    ]
    waves = np.array(
        [(amplitude, 2 * math.pi * f, phase) for amplitude, f, phase in flow.waves.tolist()]
    ).reshape(-1, 3)
    return System(
        m,
        r,
        R,
        j,
        mu,
        eta,
        g,
        c,
        law,
        p.drag == STOKES,
        float(settings.rtol),
        float(settings.restitution),
        leaves,
        unit,
        R / (unit * r),
        waves,
        line_of(flow, 0.0),
        int(Case.NN),
        0.0,
        equations.NO_FALL,
    )


class Recorder:
    """Collects a run; what it holds at any moment makes a `Trajectory`."""

    def __init__(
        self, p: Parameters, times: Array, progress: Callable[[float], None] | None = None
    ) -> None:
        """`times` are those to sample at, s, increasing."""
        self.p = p
        self.times = times
        self.events: list[list[float]] = []
        """Of changes of case and impacts: time, codes of the cases before and after, impulses (A_x
        … B_z), N s."""
        self.time = 0.0
        """How far the run has come, s."""
        self._blocks: list[npt.NDArray[np.void]] = []
        self._progress = progress
        self._energy = {"energy_residual": 0.0, "energy_scale": 0.0}

    def add(
        self, time: Array, theta: Array, x: Array, forces: Array, case: npt.ArrayLike, work: Array
    ) -> None:
        """Add all samples, one at least.

        Shapes: time, theta (n,), states x (n, 8), forces (n, 6) in the order A_x … B_z, case (n,);
        work is that of drag and contacts since the start (n,), J.
        """
        state = State(*x.T)
        block = samples(time, theta, state, self.p)
        block["force_A"], block["force_B"], block["case"] = forces[:, :3], forces[:, 3:], case
        self._blocks.append(block)
        energy = rigid_body.energy(state.y, rigid_body.velocities(state, self.p), self.p)
        gained = energy - work
        # an impact may precede the first
        self._energy["energy_residual"] = float(np.abs(gained - gained[0]).max())
        self._energy["energy_scale"] = float(np.abs([energy, work]).max())

    def note(self, events: Array, time: float) -> None:
        """Note rows of `events`, and how far the run has come."""
        self.events += events.tolist()
        self.time = max(self.time, time)
        if self._progress:
            self._progress(self.time / float(self.times[-1]))

    def trajectory(self, header: Header) -> Trajectory:
        """The run so far; adds ``energy_residual`` and ``energy_scale`` in J to the settings of the
        header.

        The residual is the largest |change of energy - work of drag, friction and impacts| at a
        sample."""
        rows = np.array(self.events, dtype=float).reshape(-1, 9)
        events = Events(
            time=rows[:, 0],
            from_case=rows[:, 1].astype(np.int8),
            to_case=rows[:, 2].astype(np.int8),
            impulse_A=rows[:, 3:6],
            impulse_B=rows[:, 6:],
        )
        header = replace(header, settings={**header.settings, **self._energy})
        return Trajectory.from_blocks(header, self._blocks, events)
