"""Basins: which attractor the ball comes to from each start of a two-dimensional slice through the states.

A fine map by time stepping, and a coarse one by MuJoCo on some of its points: runs of a campaign, so that a map goes on
where it stopped. What the two disagree about should lie at the boundaries of the basins, where the least error decides:
`Basins.differences` says how far away it is.
"""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self

import numpy as np
import numpy.typing as npt

from analytic import Settings
from analytic.settings import fitting_step
from analytic.simulation import start_state
from compare.runs.campaign import Campaign
from compare.runs.engines import MOREAU, MUJOCO
from compare.runs.sweep import Axis
from compare.runs.tasks import Task
from mjsim import ContactSettings
from model import Case, Contact, Flow, InputError, Parameters, State, Trajectory
from model.arrays import Array
from model.files import reading_json, write_text
from model.kinematics import VARIABLES
from model.parameters import check_names

FATES = ("hops", "RR", "SS", "off the floor", "undecided")
"""What may become of a ball. SR and NR are one: in SR the floor carries nothing (Prop. 3)."""
DURATION, LAST = 10.0, 3.0
"""How long a ball is followed, and the part at the end that counts, in 1/c."""
SAMPLES = 500
"""Samples of a run. One in ten of a hop is within the lowest fifth of its height: that all 150 at the end miss it has a
chance of 1e-7. The landing itself may be shorter than a step."""
HOP = 1e-4
"""Range of y/R from which a ball that comes down again and again hops: a hop known to last is six times as high."""
STEPS = 140
"""Steps of time stepping in sqrt(R/g)."""


@dataclass(frozen=True, eq=False)
class Basins:
    """Fates over a plane of starts."""

    parameters: Parameters
    start: tuple[float, ...]
    """State (8,) whose other variables all starts share."""
    across: str
    """Names of the two variables that vary."""
    up: str
    x: Array
    """Their values, shapes (n,) and (m,)."""
    y: Array
    fates: npt.NDArray[np.int64]
    """Indices of `FATES`, by time stepping, shape (m, n)."""
    coarse: int
    """MuJoCo has done every `coarse`-th point both ways; 0 for none."""
    mujoco: npt.NDArray[np.int64]
    """Its fates, shape (m / coarse, n / coarse) rounded up, and its time step in s."""
    timestep: float

    def share(self, fate: str) -> tuple[int, int]:
        """Points of the plane that come to a fate, by time stepping, and all of them."""
        return int(np.sum(self.fates == FATES.index(fate))), self.fates.size

    def differences(self) -> Array:
        """How far from a boundary each point is at which the two differ, in cells of the fine map; 1 is next to it."""
        from scipy.ndimage import distance_transform_cdt  # slow to import

        theory = self.fates[:: self.coarse, :: self.coarse]
        distance = np.zeros(self.fates.shape)
        for fate in range(len(FATES)):
            own = np.pad(self.fates == fate, 1, mode="edge")
            inside = distance_transform_cdt(own, metric="chessboard")[1:-1, 1:-1] if own.any() else 0
            distance = np.where(self.fates == fate, inside, distance)
        return np.asarray(distance[:: self.coarse, :: self.coarse][theory != self.mujoco])

    def save(self, path: Path) -> None:
        """Write it as JSON."""
        write_text(path, json.dumps(dataclasses.asdict(self), default=np.ndarray.tolist))

    @classmethod
    def load(cls, path: Path) -> Self:
        """Inverse of `save`; raises `StorageError` if the file can't be read, or is none of these."""
        with reading_json(path, "basins") as data:
            arrays: dict[str, Any] = {name: np.array(data.pop(name)) for name in ("x", "y", "fates", "mujoco")}
            p, start = Parameters.from_mapping(data.pop("parameters")), tuple(data.pop("start"))
            return cls(parameters=p, start=start, **data, **arrays)


def basins(
    campaign: Campaign,
    p: Parameters,
    start: Mapping[str, float],
    across: Axis,
    up: Axis,
    coarse: int = 0,
    timestep: float = 2.5e-4,
) -> Basins:
    """Fates of starts on a plane of two state variables, all others as in `start`, else zero.

    Raises `InputError` for an unknown variable, without drag (nothing settles), or where a ball can't start.
    """
    check_names((*start, across.name, up.name), VARIABLES, "state variable")
    if p.c == 0:
        raise InputError("c = 0 1/s: without drag a ball doesn't settle, and there are no basins")
    x, y = np.array(across.values), np.array(up.values)
    base = np.array(State(**start))
    states = np.tile(base, (len(y), len(x), 1))
    states[..., VARIABLES.index(across.name)], states[..., VARIABLES.index(up.name)] = x, y[:, None]
    few = states[::coarse, ::coarse] if coarse else states[:0, :0]
    step = fitting_step(STEPS, p, Flow.steady(p.omega_0), DURATION / p.c)
    fine = _tasks(states, MOREAU.name, p, Settings(method=MOREAU.name, timestep=step))
    tasks = [*fine, *_tasks(few, MUJOCO.name, p, ContactSettings.for_problem(p, timestep))]
    broken = {failure.task.key for failure in campaign.complete(tasks)}
    undecided = FATES.index("undecided")
    fates = np.array([undecided if task.key in broken else _fate(campaign.load(task.key)) for task in tasks])
    by_stepping, by_mujoco = fates[: len(fine)].reshape(states.shape[:2]), fates[len(fine) :].reshape(few.shape[:2])
    return Basins(p, tuple(base.tolist()), across.name, up.name, x, y, by_stepping, coarse, by_mujoco, timestep)


def _tasks(states: Array, engine: str, p: Parameters, settings: Settings | ContactSettings) -> Sequence[Task]:
    """A run from each state (m, n, 8); raises `InputError` where a ball can't start."""
    lasts = DURATION / p.c
    starts = [start_state(x, p, Settings()) for x in states.reshape(-1, len(VARIABLES))]
    return [
        Task(engine=engine, parameters=p, x0=x, t_end=lasts, settings=settings, sample_interval=lasts / SAMPLES)
        for x in starts
    ]


def _fate(run: Trajectory) -> int:
    """What the ball of a whole run comes to."""
    late, case = run.y[run.time > (1 - LAST / DURATION) * run.time[-1]], run.cases[-1]
    rise = np.ptp(late)
    if rise > HOP * run.header.parameters.R and late.min() < rise / 5:
        return FATES.index("hops")
    if case in (Case.RR, Case.SS):
        return FATES.index(case.name)
    return FATES.index("off the floor" if case is Case.SR or case.A is Contact.N else "undecided")
