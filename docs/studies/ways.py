"""Ways to step a MuJoCo scene that is to hold still, and what a scene costs and does while it is
stepped.

Needs MuJoCo, NumPy and `mujoco_coulomb` alone, so that it runs beside any package that brings
scenes."""

import functools
import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import mujoco
import numpy as np
import numpy.typing as npt

try:
    from mujoco_coulomb import Coulomb  # alone, beside packages that need MuJoCo 3
except ImportError:
    from mjsim import Coulomb

Array = npt.NDArray[np.float64]
ELLIPTIC = {"cone": mujoco.mjtCone.mjCONE_ELLIPTIC}
CREEP, SLIP = "creep, m/s", "slip in a shake, m"
SLIDES = 0.999
"""Share of the cone from which on a contact counts as sliding."""


def processor_time(work: Callable[[], object]) -> float:
    """What some work takes, s."""
    begin = time.process_time()
    work()
    return time.process_time() - begin


Stepper = Any
"""What steps data of a `model`: `step(data, nstep=1)`, or `step1(data)` and `step2(data)`, between
which a controller may act."""


class Plain:
    """MuJoCo alone."""

    def __init__(self, model: Any) -> None:
        self.model = model

    def step(self, data: Any, nstep: int = 1) -> None:
        mujoco.mj_step(self.model, data, nstep)

    def step1(self, data: Any) -> None:
        mujoco.mj_step1(self.model, data)

    def step2(self, data: Any) -> None:
        mujoco.mj_step2(self.model, data)


class PairPose(Plain):
    """The idea of MuJoCo's pull request 3349: bodies that stick have a relative pose; a spring
    takes them back to it.

    The pose of the second body in the axes of the first is noted when they first touch, and again
    when a contact of theirs slides. The spring has the stiffness of the normal row. Elliptic cones
    only."""

    def __init__(self, model: Any) -> None:
        super().__init__(model)
        self._poses: dict[tuple[int, int], tuple[Array, Array]] = {}

    def step(self, data: Any, nstep: int = 1) -> None:
        for _ in range(nstep):
            self.step1(data)
            self.step2(data)

    def step2(self, data: Any) -> None:
        contact = data.contact
        rubs = (contact.efc_address >= 0) & (contact.dim > 1) & (contact.geom >= 0).all(axis=1)
        used = np.flatnonzero(rubs)
        rows = contact.efc_address[used]
        pairs = [(one, other) for one, other in self.model.geom_bodyid[contact.geom[used]].tolist()]
        self._poses = {pair: self._poses.get(pair) or self._pose(data, *pair) for pair in pairs}
        for k, pair, row in zip(used, pairs, rows, strict=True):
            slip = contact.frame[k].reshape(3, 3)[1:] @ self._slip(data, pair, contact.pos[k])
            stiffness = data.efc_KBIP[row, 0] * data.efc_KBIP[row, 2]
            data.efc_aref[row + 1 : row + 3] -= stiffness * slip
        friction = contact.friction[used, :2]
        super().step2(data)
        if not len(used) or len(data.efc_force) <= rows[-1]:
            return
        along = np.hypot(*(data.efc_force[rows[:, None] + (1, 2)] / friction).T)
        for k in np.flatnonzero(along > SLIDES * data.efc_force[rows]):
            self._poses.pop(pairs[k], None)

    @staticmethod
    def _pose(data: Any, one: int, other: int) -> tuple[Array, Array]:
        """Place and axes of a body in the axes of another."""
        turn = data.xmat[one].reshape(3, 3).T
        return turn @ (data.xpos[other] - data.xpos[one]), turn @ data.xmat[other].reshape(3, 3)

    def _slip(self, data: Any, pair: tuple[int, int], point: Array) -> Array:
        """How far a point of the second body is from where the pose would have it, m."""
        (place, axes), (one, other) = self._poses[pair], pair
        own = data.xmat[other].reshape(3, 3).T @ (point - data.xpos[other])
        where: Array = point - data.xpos[one] - data.xmat[one].reshape(3, 3) @ (place + axes @ own)
        return where


@dataclass(frozen=True)
class Way:
    """Options of the model, and what steps it."""

    stepper: Callable[[Any], Stepper] = Plain
    options: dict[str, Any] = field(default_factory=dict)
    timed: bool = True

    def begin(self, model: Any) -> Stepper:
        """What steps a model, which gets the options."""
        for name, value in self.options.items():
            setattr(model.opt, name, value)
        return self.stepper(model)


WAYS = {
    "plain": Way(),
    "impratio 100": Way(options=ELLIPTIC | {"impratio": 100}),
    "noslip": Way(options={"noslip_iterations": 10}),
    "a pose a pair": Way(PairPose, ELLIPTIC, timed=False),
    "soft": Way(Coulomb),
    "rigid": Way(functools.partial(Coulomb, rigid=True)),
}
"""By the heads of their columns. A pose a pair is written in Python, so its cost says nothing."""


@dataclass(frozen=True)
class Found:
    """What a scene came to: its own figures by name, and what is measured in each.

    `step` is the processor time of a step in the mean, s; `contacts` how many there were at most;
    `depth` how far bodies sank in at most, m; `rise` by how much energy rose above its least so
    far, J, if nothing drives the scene; `wrong` what failed, and MuJoCo's warnings."""

    values: dict[str, float]
    step: float
    contacts: int
    depth: float
    rise: float | None
    wrong: list[str]


def worst(tried: Sequence[Found]) -> Found:
    """Of several starts of a scene the worst in each respect."""
    rises = [found.rise for found in tried if found.rise is not None]
    return Found(
        {name: max(found.values[name] for found in tried) for name in tried[0].values},
        max(found.step for found in tried),
        max(found.contacts for found in tried),
        max(found.depth for found in tried),
        max(rises, default=None),
        sorted({name for found in tried for name in found.wrong}),
    )


class Run:
    """Steps a model one way and keeps the account of which `Found` is the sum."""

    def __init__(self, way: Way, model: Any, data: Any = None, passive: bool = False) -> None:
        self._stepper, self._spent, self._steps = way.begin(model), 0.0, 0
        self.model, self.data, self.passive = model, data or mujoco.MjData(model), passive
        self._contacts, self._depth, self._least, self._rise = 0, 0.0, math.inf, 0.0

    def advance(self, seconds: float, between: Callable[[], None] | None = None) -> None:
        """Step for some seconds; `between` is called between the halves of each step."""
        for _ in range(round(seconds / self.model.opt.timestep)):
            self.step(between)

    def step(self, between: Callable[[], None] | None = None) -> None:
        """One step."""
        begin = time.process_time()
        if between is None:
            self._stepper.step(self.data)
        else:
            self._stepper.step1(self.data)
            self._spent -= processor_time(between)
            self._stepper.step2(self.data)
        self._spent += time.process_time() - begin
        self._steps += 1
        if self.data.ncon:
            self._contacts = max(self._contacts, int(self.data.ncon))
            self._depth = max(self._depth, float(-self.data.contact.dist.min()))
        if self.passive:
            mujoco.mj_energyPos(self.model, self.data)
            mujoco.mj_energyVel(self.model, self.data)
            energy = float(self.data.energy.sum())
            self._least = min(self._least, energy)
            self._rise = max(self._rise, energy - self._least)

    def creep(self, *bodies: str, of: str | None = None, seconds: float = 1.0) -> float:
        """Mean speed at which bodies leave their places in the axes of another, of the fastest,
        m/s."""
        before = self.places(*bodies, of=of)
        self.advance(seconds)
        return float(np.abs(self.places(*bodies, of=of) - before).max()) / seconds

    def places(self, *bodies: str, of: str | None = None) -> Array:
        """Where bodies, or all, are in the axes of another, m."""
        data = self.data
        mujoco.mj_kinematics(self.model, data)
        chosen = [self.model.body(name).id for name in bodies] or slice(1, None)
        base = 0 if of is None else self.model.body(of).id
        found: Array = (data.xpos[chosen] - data.xpos[base]) @ data.xmat[base].reshape(3, 3)
        return found

    def found(self, values: dict[str, float], wrong: dict[str, bool] | None = None) -> Found:
        """What there is to say: figures by name and unit, and what may have gone wrong by name."""
        warned = [
            mujoco.mjtWarning(k).name for k, each in enumerate(self.data.warning) if each.number
        ]
        return Found(
            {name: float(value) for name, value in values.items()},
            self._spent / max(self._steps, 1),
            self._contacts,
            self._depth,
            self._rise if self.passive else None,
            [name for name, true in (wrong or {}).items() if true] + warned,
        )
