"""Samples, events and energy balance of a simulation, collected while it runs."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from analytic.mechanics import rigid_body
from analytic.mechanics.rigid_body import NOTHING, Forces
from model import Case, Events, Header, Parameters, State, Trajectory
from model.arrays import Array
from model.trajectory import samples

REPORT_EVERY = 1000
"""Steps after which a simulator notes how far it is, even if there is no sample to take."""


class Event(NamedTuple):
    """A change of case or an impact."""

    time: float
    from_case: Case
    to_case: Case
    impulse: Forces = NOTHING
    """Impulses (A_x, A_y, A_z, B_x, B_y, B_z) in N s."""


class Recorder:
    """Collects a run; what it holds at any moment makes a `Trajectory`."""

    def __init__(self, p: Parameters, times: Array, progress: Callable[[float], None] | None = None) -> None:
        """`times` are those to sample at, s, increasing."""
        self.p = p
        self.times = times
        self.events: list[Event] = []
        self.time = 0.0
        """How far the run has come, s."""
        self.taken = 0
        """Number of samples so far: ``times[taken]`` is the next one."""
        self._blocks: list[npt.NDArray[np.void]] = []
        self._progress = progress
        self._first, self._residual, self._scale = math.nan, 0.0, 0.0

    def add(self, time: Array, theta: Array, x: Array, forces: Array, case: npt.ArrayLike, work: Array) -> None:
        """Add samples.

        Shapes: time, theta (n,), states x (n, 8), forces (n, 6) in the order A_x … B_z, case (n,) or a single one;
        work is that of drag and contacts since the start (n,), J.
        """
        state = State(*x.T)
        block = samples(time, theta, state, self.p)
        block["force_A"], block["force_B"], block["case"] = forces[:, :3], forces[:, 3:], case
        self._blocks.append(block)
        self.taken += len(block)
        if not len(time):
            return
        energy = rigid_body.energy(state.y, rigid_body.velocities(state, self.p), self.p)
        if math.isnan(self._first):
            self._first = float(energy[0] - work[0])  # an impact may precede the first sample
        self._residual = max(self._residual, float(np.max(np.abs(energy - work - self._first))))
        self._scale = max(self._scale, float(np.max(np.abs(energy))), float(np.max(np.abs(work))))
        self.reached(float(time[-1]))

    def reached(self, time: float) -> None:
        """Note how far the run has come."""
        self.time = max(self.time, time)
        if self._progress:
            self._progress(self.time / float(self.times[-1]))

    def trajectory(self, header: Header) -> Trajectory:
        """The run so far; adds ``energy_residual`` and ``energy_scale`` in J to the settings of the header.

        The residual is the largest |change of energy - work of drag, friction and impacts| at a sample.
        """
        settings = {**header.settings, "energy_residual": self._residual, "energy_scale": self._scale}
        impulse = np.array([event.impulse for event in self.events], dtype=float).reshape(-1, 6)
        events = Events(
            time=np.array([event.time for event in self.events], dtype=float),
            from_case=np.array([event.from_case for event in self.events], dtype=np.int8),
            to_case=np.array([event.to_case for event in self.events], dtype=np.int8),
            impulse_A=impulse[:, :3],
            impulse_B=impulse[:, 3:],
        )
        return Trajectory.from_blocks(replace(header, settings=settings), self._blocks, events)
