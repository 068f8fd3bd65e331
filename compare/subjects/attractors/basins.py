"""Where the ball ends from a plane of states: finely by theory, coarsely by MuJoCo.

The two should differ only at the boundaries of basins, where the smallest error decides. What
MuJoCo has run is kept."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self

import numpy as np
import numpy.typing as npt

import analytic
from analytic import Settings
from analytic.simulation.settings import check_run, start_state
from compare.campaign.campaign import Campaign
from compare.campaign.sweep import Axis, check_size
from compare.campaign.tasks import Task
from compare.engines.study import MUJOCO
from compare.method.statistics import hops_on
from mjsim import RigidContacts
from model import Case, Contact, Flow, InputError, Parameters, State
from model.arrays import Array
from model.files import reading_json, write_text
from model.kinematics import VARIABLES
from model.parameters import check_names

ATTRACTORS = ("hops", "RR", "SS", "off the floor", "undecided")
"""Where a ball may end. SR and NR are one: in SR the floor carries nothing (Prop. 3)."""
UNDECIDED = ATTRACTORS.index("undecided")
INSTANTS = 500  # of a run, after the first


@dataclass(frozen=True, eq=False)
class Basins:
    """Attractors over a plane of starts."""

    parameters: Parameters
    start: tuple[float, ...]  # state (8,) whose other variables all starts share
    across: str  # names of the two variables that vary
    up: str
    x: Array  # their values, shapes (n,) and (m,)
    y: Array
    attractors: npt.NDArray[np.int64]
    """Indices of `ATTRACTORS`, by the event-driven simulation, shape (m, n)."""
    coarse: int  # MuJoCo has computed every `coarse`-th point along both axes; 0 for none
    # its attractors, shape (m / coarse, n / coarse) rounded up, and its time step in s
    mujoco: npt.NDArray[np.int64]
    timestep: float

    def share(self, attractor: str) -> tuple[int, int]:
        """How many points of the plane come to an attractor, by theory, and how many there are."""
        return int(np.sum(self.attractors == ATTRACTORS.index(attractor))), self.attractors.size

    def differences(self) -> Array:
        """Distances from a boundary, in fine cells, of points where MuJoCo differs; a run that came
        to nothing does not."""
        from scipy.ndimage import distance_transform_cdt  # slow to import

        distance = np.zeros(self.attractors.shape)
        for attractor in np.unique(self.attractors):
            own = np.pad(self.attractors == attractor, 1, mode="edge")
            # 0 outside its basin
            distance += distance_transform_cdt(own, metric="chessboard")[1:-1, 1:-1]
        coarse = np.s_[:: self.coarse, :: self.coarse]
        differs = (self.attractors[coarse] != self.mujoco) & (self.mujoco != UNDECIDED)
        return np.asarray(distance[coarse][differs])

    @property
    def undecided(self) -> int:
        """How many runs of MuJoCo came to nothing: to no attractor that is known, or to no end."""
        return int(np.sum(self.mujoco == UNDECIDED))

    def save(self, path: Path) -> None:
        """Write it as JSON."""
        write_text(path, json.dumps(dataclasses.asdict(self), default=np.ndarray.tolist))

    @classmethod
    def load(cls, path: str | Path) -> Self:
        """Inverse of `save`; raises `StorageError` for what can't be read."""
        with reading_json(Path(path), "basins") as data:
            arrays: dict[str, Any] = {
                name: np.array(data.pop(name)) for name in ("x", "y", "attractors", "mujoco")
            }
            p, start = Parameters.from_mapping(data.pop("parameters")), tuple(data.pop("start"))
            return cls(parameters=p, start=start, **data, **arrays)


def basins(
    campaign: Campaign,
    p: Parameters,
    start: Mapping[str, float],
    plane: tuple[Axis, Axis],
    coarse: int = 0,
    timestep: float = 2.5e-4,
) -> Basins:
    """Attractors after 10/c of starts on a plane of two state variables, across and up; all others
    as in `start`, or zero.

    Raises `InputError` for an unknown variable, no drag, an impossible or far too fast start, or
    a time step that doesn't resolve MuJoCo's."""
    across, up = plane
    check_names((*start, across.name, up.name), VARIABLES, "state variable")
    if across.name == up.name:
        raise InputError(f"across and up are both {up.name}: a plane needs two state variables")
    check_size(plane, "starts")
    if p.c == 0:
        raise InputError("c = 0 1/s: without drag a ball doesn't settle, and there are no basins")
    x, y, lasts = np.array(across.points), np.array(up.points), 10.0 / p.c
    base = np.array(State(**start))
    states = np.tile(base, (len(y), len(x), 1))
    states[..., VARIABLES.index(across.name)], states[..., VARIABLES.index(up.name)] = x, y[:, None]
    for x0 in states[[0, 0, -1, -1], [0, -1, 0, -1]]:  # at corners, before any is simulated
        check_run(p, Flow.steady(p.omega_0), lasts, State.one(x0), Settings())
    few = states[::coarse, ::coarse] if coarse else states[:0, :0]
    tasks = [
        Task(
            engine=MUJOCO.name, parameters=p, x0=start_state(x0, p, Settings()), t_end=lasts,
            settings=RigidContacts(timestep=timestep), sample_interval=lasts / INSTANTS,
        )
        for x0 in few.reshape(-1, len(VARIABLES))
    ]  # fmt: skip
    for task in tasks:  # one that is refused would count as different
        task.check()
    fine, other = [], []
    threads = max(1, campaign.workers) if isinstance(campaign.workers, int) else None
    for k, row in enumerate(states):
        if coarse:  # how long MuJoCo will take isn't known yet
            campaign.report(f"{campaign.doing}, by theory, then by MuJoCo", 0, 0, 0)
        else:
            campaign.report(f"{campaign.doing}, by theory", k * len(x), len(y) * len(x), 0)
        runs = analytic.simulate_many(
            p, row, lasts, sample_interval=lasts / INSTANTS, threads=threads
        )
        ends = zip(runs.x[..., 0], runs.case[:, -1], runs.failure, strict=True)
        fine.append(
            [UNDECIDED if failure else attractor(y, Case(last), p) for y, last, failure in ends]
        )
    broken = {failure.task.key for failure in campaign.complete(tasks)}
    for key in (task.key for task in tasks):
        run = None if key in broken else campaign.load(key)
        other.append(attractor(run.y, run.cases[-1], p) if run else UNDECIDED)
    maps = np.array(fine), coarse, np.array(other, dtype=int).reshape(few.shape[:2])
    return Basins(p, tuple(base.tolist()), across.name, up.name, x, y, *maps, timestep)


def attractor(y: Array, last: Case, p: Parameters) -> int:
    """What becomes of the ball in a run, by its heights and last case: an index of `ATTRACTORS`."""
    if hops_on(y[int(0.7 * len(y)) :], p.R):
        return ATTRACTORS.index("hops")
    if last in (Case.RR, Case.SS):
        return ATTRACTORS.index(last.name)
    off = last is Case.SR or last.A is Contact.N
    return ATTRACTORS.index("off the floor") if off else UNDECIDED
