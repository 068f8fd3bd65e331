"""MuJoCo with a free body in the case's own MJCF; the module itself is MuJoCo as it comes."""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator
from typing import Any

import mujoco

import mjsim
from compare.bench.adapters.free import CORNERS
from compare.bench.case import FACETS, Case
from model.arrays import Array

NAME = "mujoco-defaults"
NOTE = CORNERS
DECLARED = f"{FACETS} planes for a cylinder; a table that turns hangs on a hinge"


class Bodies:
    """MuJoCo as it comes, or with a function that sets options and contacts of a case's scene for a time step.

    With `coulomb` its contacts obey Coulomb's law (`mjsim.Coulomb`).
    """

    def __init__(self, tune: Callable[[Any, Case, float], None] | None = None, coulomb: bool = False) -> None:
        self._tune, self._coulomb = tune, coulomb

    def build(self, case: Case, timestep: float) -> None:
        """The scene at its start."""
        spec = mujoco.MjSpec.from_string(case.mjcf(timestep))
        if self._tune:
            self._tune(spec, case, timestep)
        self._case, self._model = case, spec.compile()
        self._data = mujoco.MjData(self._model)
        mujoco.mj_resetDataKeyframe(self._model, self._data, 0)
        plain = functools.partial(mujoco.mj_step, self._model)
        self._advance = mjsim.Coulomb(self._model).step if self._coulomb else plain

    def step(self, n: int) -> None:
        """Take n steps."""
        case, data = self._case, self._data
        if not case.forced:
            self._advance(data, n)
            return
        force = data.body("body").xfrc_applied[:3]
        for _ in range(n):
            force[:] = case.force(data.time, data.qpos[-7:-4], data.qvel[-6:-3])
            self._advance(data)

    def state(self) -> tuple[Array, Array, Array]:
        """Position, velocity and spin; MuJoCo counts the spin in the body's axes."""
        mujoco.mj_kinematics(self._model, self._data)
        axes = self._data.body("body").xmat.reshape(3, 3)
        return self._data.qpos[-7:-4], self._data.qvel[-6:-3], axes @ self._data.qvel[-3:]


def pairs(spec: Any, case: Case) -> Iterator[tuple[str, Any]]:
    """A pair of each surface with the body, made with the friction of the surface, and that surface's name."""
    for surface in case.surfaces:
        for geom in list(spec.geoms):
            if geom.name.rstrip("0123456789") == surface.name:
                pair = spec.add_pair(geomname1=geom.name, geomname2="body", condim=3)
                pair.friction = (surface.friction, surface.friction, 0.0, 0.0, 0.0)
                yield surface.name, pair


def studied(spec: Any, case: Case, timestep: float) -> None:
    """An elliptic cone, stiff friction rows; normal rows soft and slow enough for blocks on four points to be stable.

    b_f h is a tenth, so that contacts don't hover at 2 m/s; impratio 1e4 leaves a creep of some micrometres a second.
    """
    spec.option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    spec.option.impratio, spec.option.tolerance = 1e4, 1e-12
    for _, pair in pairs(spec, case):
        pair.solref, pair.solreffriction = (6 * timestep, 1.0), (100 * timestep, 1.0)
        pair.solimp = (0.2, 0.2, 1e-4, 0.5, 2.0)


_as_it_comes = Bodies()
build, step, state = _as_it_comes.build, _as_it_comes.step, _as_it_comes.state
