"""Basins: which attractor the ball comes to from each start of a two-dimensional slice through the states.

A fine map by time stepping, and a coarse one by MuJoCo on some of its points. What the two disagree about should lie
at the boundaries of the basins, where the least error decides: `Basins.differences` says how far away it is.
"""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self

import numpy as np
import numpy.typing as npt

import mjsim
from analytic import Settings, simulate_many
from mjsim import ContactSettings
from model import Case, Contact, InputError, Parameters, StorageError, Trajectory
from model.arrays import Array
from model.files import write_text
from model.kinematics import VARIABLES
from model.parameters import check_names

FATES = ("hops", "RR", "SS", "off the floor", "undecided")
"""What may become of a ball. SR and NR are one: in SR the floor carries nothing (Prop. 3)."""
DURATION, QUIET = 60.0, 6.0
"""How long time stepping follows a ball, and without a landing, in 1/c."""
MUJOCO_DURATION, LAST = 10.0, 3.0
"""How long MuJoCo follows it, and the part at the end that counts, in 1/c."""
SAMPLES = 4000
"""Samples of that: of a hop, one is within a tenth of its height. The landing itself may be shorter than a step."""
HOP = 1e-4
"""Range of y/R from which a ball that lands again and again hops: a hop known to last is six times as high."""
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
        data = {f.name: getattr(self, f.name) for f in dataclasses.fields(self)} | {
            "parameters": dataclasses.asdict(self.parameters)
        }
        write_text(path, json.dumps({k: v.tolist() if isinstance(v, np.ndarray) else v for k, v in data.items()}))

    @classmethod
    def load(cls, path: Path) -> Self:
        """Inverse of `save`; raises `StorageError` if the file can't be read, or is none of these."""
        try:
            data: dict[str, Any] = json.loads(path.read_text("utf-8"))
            arrays: dict[str, Any] = {name: np.array(data.pop(name)) for name in ("x", "y", "fates", "mujoco")}
            p = Parameters.from_mapping(data.pop("parameters"))
            return cls(parameters=p, start=tuple(data.pop("start")), **data, **arrays)
        except OSError as error:
            raise StorageError(f"cannot read {path}: {error.strerror}") from error
        except (ValueError, KeyError, TypeError) as error:
            raise StorageError(f"{path} holds no basins: {error}") from error


def basins(
    p: Parameters, start: Mapping[str, float], across: tuple[str, float, float, int], up: tuple[str, float, float, int],
    coarse: int = 0, timestep: float = 2.5e-4,
) -> Basins:  # fmt: skip
    """Fates of starts on a plane: two axes (variable, from, to, points), all other variables as in `start`, else zero.

    Raises `InputError` for an unknown variable, without drag (nothing settles), or where a ball can't start.
    """
    check_names((*start, across[0], up[0]), VARIABLES, "state variable")
    if p.c == 0:
        raise InputError("c = 0 1/s: without drag a ball doesn't settle, and there are no basins")
    x, y = np.linspace(*across[1:]), np.linspace(*up[1:])
    base = np.array([start.get(name, 0.0) for name in VARIABLES])
    states = np.tile(base, (len(y), len(x), 1))
    states[..., VARIABLES.index(across[0])], states[..., VARIABLES.index(up[0])] = x, y[:, None]
    fates = by_stepping(p, states.reshape(-1, 8)).reshape(states.shape[:2])
    few = states[::coarse, ::coarse] if coarse else states[:0, :0]
    mujoco = by_mujoco(p, few.reshape(-1, 8), timestep) if coarse else np.empty(0, np.int64)
    return Basins(
        p, tuple(base.tolist()), across[0], up[0], x, y, fates, coarse, mujoco.reshape(few.shape[:2]), timestep
    )


def by_stepping(p: Parameters, x0s: Array) -> npt.NDArray[np.int64]:
    """Fates (n,) of starts (n, 8) by time stepping."""
    runs = simulate_many(
        p, x0s, DURATION / p.c, settings=Settings(method="time-stepping", step=math.sqrt(p.R / p.g) / STEPS),
        sample_interval=1 / p.c, quiet=QUIET / p.c,
    )  # fmt: skip
    last = slice(-int(LAST), None)
    rise = runs.high[:, last, 0].max(axis=1) - runs.low[:, last, 0].min(axis=1)
    lands = np.max(runs.landings[:, last], axis=1) > 0
    return np.array([
        FATES.index("undecided") if failure else _fate(bool(landed and r > HOP * p.R), Case(case))
        for failure, landed, r, case in zip(runs.failure, lands, rise, runs.case[:, -1], strict=True)
    ])  # fmt: skip


def by_mujoco(p: Parameters, x0s: Array, timestep: float) -> npt.NDArray[np.int64]:
    """Fates (n,) of starts (n, 8) by MuJoCo."""
    settings = ContactSettings.for_problem(p, timestep)
    runs = mjsim.simulate_many(
        [p] * len(x0s), list(x0s), MUJOCO_DURATION / p.c, settings=settings,
        sample_interval=MUJOCO_DURATION / p.c / SAMPLES,
    )  # fmt: skip
    return np.array([_of_trajectory(run, p) for run in runs])


def _of_trajectory(run: Trajectory, p: Parameters) -> int:
    if not run.complete:
        return FATES.index("undecided")
    late = run.y[run.time > (MUJOCO_DURATION - LAST) / p.c]
    return _fate(bool(np.ptp(late) > HOP * p.R and late.min() < np.ptp(late) / 10), run.cases[-1])


def _fate(hops: bool, case: Case) -> int:
    """What a ball comes to that is in a case at the end."""
    if hops:
        return FATES.index("hops")
    if case in (Case.RR, Case.SS):
        return FATES.index(case.name)
    return FATES.index("off the floor" if case is Case.SR or case.A is Contact.N else "undecided")
