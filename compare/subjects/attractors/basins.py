"""Where the ball ends from each start of a plane of states: on a fine grid by time stepping, on a coarse one by MuJoCo.

The two should differ only at the boundaries of basins, where the smallest error decides. A map goes on where it
stopped.
"""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self

import numpy as np
import numpy.typing as npt

from analytic import Settings
from analytic.simulation.settings import fitting_step, start_state
from compare.kit.campaign import Campaign
from compare.kit.engines import MOREAU, MUJOCO
from compare.kit.statistics import hops
from compare.kit.sweep import Axis
from compare.kit.tasks import Task
from mjsim import ContactSettings
from model import Case, Contact, Flow, InputError, Parameters, State
from model.arrays import Array
from model.files import reading_json, write_text
from model.kinematics import VARIABLES
from model.parameters import check_names

FATES = ("hops", "RR", "SS", "off the floor", "undecided")
"""Where a ball may end. SR and NR are one: in SR the floor carries nothing (Prop. 3)."""


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
    """MuJoCo has computed every `coarse`-th point along both axes; 0 for none."""
    mujoco: npt.NDArray[np.int64]
    """Its fates, shape (m / coarse, n / coarse) rounded up, and its time step in s."""
    timestep: float

    def share(self, fate: str) -> tuple[int, int]:
        """Points of the plane that come to a fate, by time stepping, and all of them."""
        return int(np.sum(self.fates == FATES.index(fate))), self.fates.size

    def differences(self) -> Array:
        """Distances from a boundary of the points at which the two differ, in cells of the fine map (1: next to it)."""
        from scipy.ndimage import distance_transform_cdt  # slow to import

        distance = np.zeros(self.fates.shape)
        for fate in np.unique(self.fates):
            own = np.pad(self.fates == fate, 1, mode="edge")
            distance += distance_transform_cdt(own, metric="chessboard")[1:-1, 1:-1]  # 0 outside its basin
        coarse = np.s_[:: self.coarse, :: self.coarse]
        return np.asarray(distance[coarse][self.fates[coarse] != self.mujoco])

    def save(self, path: Path) -> None:
        """Write it as JSON."""
        write_text(path, json.dumps(dataclasses.asdict(self), default=np.ndarray.tolist))

    @classmethod
    def load(cls, path: str | Path) -> Self:
        """Inverse of `save`; raises `StorageError` if the file can't be read, or is none of these."""
        with reading_json(Path(path), "basins") as data:
            arrays: dict[str, Any] = {name: np.array(data.pop(name)) for name in ("x", "y", "fates", "mujoco")}
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
    """Fates after 10/c of starts on a plane of two state variables, across and up; all others as in `start`, or zero.

    Raises `InputError` for an unknown variable, without drag (nothing settles), or where a ball can't start.
    """
    across, up = plane
    check_names((*start, across.name, up.name), VARIABLES, "state variable")
    if across.name == up.name:
        raise InputError(f"across and up are both {up.name}: a plane needs two state variables")
    if p.c == 0:
        raise InputError("c = 0 1/s: without drag a ball doesn't settle, and there are no basins")
    x, y, lasts = np.array(across.points), np.array(up.points), 10.0 / p.c
    base = np.array(State(**start))
    states = np.tile(base, (len(y), len(x), 1))
    states[..., VARIABLES.index(across.name)], states[..., VARIABLES.index(up.name)] = x, y[:, None]
    few = states[::coarse, ::coarse] if coarse else states[:0, :0]
    step = fitting_step(140, p, Flow.steady(p.omega_0), lasts)
    tasks = [
        Task(engine=engine, parameters=p, x0=x0, t_end=lasts, settings=settings, sample_interval=lasts / 500)
        for engine, settings, chosen in (
            (MOREAU.name, Settings(method=MOREAU.name, timestep=step), states),
            (MUJOCO.name, ContactSettings.for_problem(p, timestep), few),
        )
        for x0 in (start_state(x, p, Settings()) for x in chosen.reshape(-1, len(VARIABLES)))
    ]
    broken = {failure.task.key for failure in campaign.complete(tasks)}
    fates = []
    for task in tasks:
        fate = "undecided"
        if task.key not in broken:
            run = campaign.load(task.key)
            case = run.cases[-1]
            if hops(run, 0.3):
                fate = "hops"
            elif case in (Case.RR, Case.SS):
                fate = case.name
            elif case is Case.SR or case.A is Contact.N:
                fate = "off the floor"
        fates.append(FATES.index(fate))
    fine, other = np.split(np.array(fates), [len(y) * len(x)])
    maps = fine.reshape(states.shape[:2]), coarse, other.reshape(few.shape[:2])
    return Basins(p, tuple(base.tolist()), across.name, up.name, x, y, *maps, timestep)
