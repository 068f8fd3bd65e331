"""MuJoCo with a free body in the case's own MJCF; the module itself is MuJoCo as it comes.

`Bodies` with settings has the studies' for every contact: an elliptic cone, short time constants, soft normal rows and
friction rows a few thousand times as stiff, so that sliding contacts don't hover and rolling ones hardly creep.
"""

from __future__ import annotations

from typing import Any

import mujoco

from compare.bench.case import FACETS, Case
from compare.kit import engines
from model.arrays import Array

NAME = "mujoco-defaults"
KNOWN = "mujoco 4.0.0"
DECLARED = f"{FACETS} planes for a cylinder; a table that turns hangs on a hinge"


class Bodies:
    """MuJoCo as it comes, or in the studies' settings."""

    def __init__(self, tuned: bool = False) -> None:
        self._tuned = tuned

    def build(self, case: Case, timestep: float) -> None:
        """The scene at its start."""
        spec = mujoco.MjSpec.from_string(case.mjcf(timestep))
        if self._tuned:
            _tune(spec, case, timestep)
        self._case, self._model = case, spec.compile()
        self._data = mujoco.MjData(self._model)
        mujoco.mj_resetDataKeyframe(self._model, self._data, 0)

    def step(self, n: int) -> None:
        """Take n steps."""
        case, data = self._case, self._data
        if not case.forced:
            mujoco.mj_step(self._model, data, n)
            return
        force = data.body("body").xfrc_applied[:3]
        for _ in range(n):
            force[:] = case.force(data.time, data.qpos[-7:-4], data.qvel[-6:-3])
            mujoco.mj_step(self._model, data)

    def state(self) -> tuple[Array, Array, Array]:
        """Position, velocity and spin; MuJoCo counts the spin in the body's axes."""
        mujoco.mj_kinematics(self._model, self._data)
        axes = self._data.body("body").xmat.reshape(3, 3)
        return self._data.qpos[-7:-4], self._data.qvel[-6:-3], axes @ self._data.qvel[-3:]


def _tune(spec: Any, case: Case, timestep: float) -> None:
    """A pair of the studies' settings for each surface."""
    settings = engines.plain(timestep)
    spec.option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    spec.option.impratio, spec.option.tolerance = settings.impratio, settings.tolerance
    geoms = {geom.name: geom for geom in spec.geoms}
    for surface in case.surfaces:
        if surface.name not in geoms:
            raise NotImplementedError("a cylinder is only for the study's joints")
        pair = spec.add_pair(geomname1=surface.name, geomname2="body", condim=3, solref=settings.spring)
        pair.friction = (surface.friction, surface.friction, 0.0, 0.0, 0.0)
        pair.solreffriction = (settings.solreffriction, 1.0)
        pair.solimp = (settings.solimp, settings.solimp, 1e-4, 0.5, 2.0)


_as_it_comes = Bodies()
build, step, state = _as_it_comes.build, _as_it_comes.step, _as_it_comes.state
