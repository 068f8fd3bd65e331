"""MuJoCo in the league on the study's joints, and with contacts as a person's MJCF file has them.

`mjsim.ContactSettings` holds what the study needs and refuses what can't work. `Native` is for
settings of which nobody knows yet whether they work (`dualball league --settings`)."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from compare.adapters.free import State
from compare.adapters.mujoco_free import Bodies, pairs, studied
from compare.adapters.scene import Scene
from compare.bench.settled import load
from compare.kit.engines import PLAIN
from compare.kit.tasks import Task, carry_out
from model import InputError
from model.kinematics import to_world
from model.parameters import ANY, NOT_NEGATIVE, POSITIVE, check_number

OPTIONS = {
    **dict.fromkeys(("timestep", "impratio"), POSITIVE),
    **dict.fromkeys(("tolerance", "iterations", "noslip_iterations"), NOT_NEGATIVE),
    **dict.fromkeys(("integrator", "cone", "solver"), ANY),
}
"""Options of the engine that decide on contacts, and their ranges."""
_DOWN = 0.7
"""Least share of down in the way from the ball to its floor."""
_FAR = 1024.0
"""A margin within which the ball touches everything that it can, m."""


@dataclass(frozen=True, kw_only=True)
class Pair:
    """What MuJoCo knows of one contact; the defaults are its own."""

    solref: tuple[float, float] = (0.02, 1.0)
    solreffriction: tuple[float, float] = (0.0, 0.0)
    """Zeros: as `solref`."""
    solimp: tuple[float, float, float, float, float] = (0.9, 0.95, 0.001, 0.5, 2.0)
    margin: float = 0.0


@dataclass(frozen=True)
class Native:
    """Options of the engine, by their names in `OPTIONS`, and the two contacts, floor (A) and wall
    (B)."""

    option: Mapping[str, float]
    A: Pair
    B: Pair
    note: str = ""
    """What the file that they were read from lacks, and what stands for it."""

    def tune(self, spec: Any, scene: Scene, timestep: float) -> None:
        """Give a scene of free bodies these settings: to a wall those of the wall, to all else
        those of the floor."""
        for name, value in {**self.option, "timestep": timestep}.items():
            setattr(spec.option, name, value)
        for surface, pair in pairs(spec, scene):
            for name, value in vars(self.B if surface == "wall" else self.A).items():
                setattr(pair, name, value)


def entry(path: Path) -> Bodies:
    """MuJoCo with the contact settings and time step of a file, as an engine of the league; errors
    as of `read`."""
    settings = read(path)
    made = Bodies(path.stem, settings.note, tune=settings.tune)
    made.TIMESTEPS = (settings.option["timestep"],)
    return made


def read(path: Path) -> Native:
    """Settings of a ball's contacts in an MJCF file: its option, and the attributes of pairs or
    geoms.

    The ball is the sphere that can move (the one named "ball" if there are more). Its floor is the
    first thing it can touch that is below it, its wall the first one beside it. Where one is
    missing, the other stands for both, and the `note` says so.

    Raises
    ------
    StorageError
        If the file can't be read.
    InputError
        If it is no MJCF, lacks a ball or anything for it to pair, or has an option that is
        out of range.
    """
    model, _ = load(path)
    moves = model.body_weldid[model.geom_bodyid] > 0
    spheres = np.flatnonzero(moves & (model.geom_type == mujoco.mjtGeom.mjGEOM_SPHERE)).tolist()
    named = [geom for geom in spheres if model.geom(geom).name == "ball"]
    if not spheres:
        raise InputError(
            f"{path}: there is no ball: it needs a geom of type sphere in a body with a joint"
        )
    if len(spheres) > 1 and not named:
        raise InputError(
            f"{path}: there are {len(spheres)} spheres that move; name the one that counts 'ball'"
        )
    floors, walls = _contacts(model, (named or spheres)[0])
    if not floors + walls:
        raise InputError(
            f"{path}: the ball has no contacts: it needs a <pair> with something, or a geom whose "
            "contype and conaffinity meet its own, and contacts switched on"
        )
    missing, other = ("floor", "wall") if walls else ("wall", "floor")
    note = (
        f"{path}: there is no {missing} that the ball can touch; the contact with its {other} "
        "stands for both"
    )
    option = {name: getattr(model.opt, name) for name in OPTIONS}
    for name, allowed in OPTIONS.items():
        check_number(f"{path}: {name}", option[name], "1", allowed)
    return Native(
        option, (floors or walls)[0], (walls or floors)[0], "" if floors and walls else note
    )


def _contacts(model: Any, ball: int) -> tuple[list[Pair], list[Pair]]:
    """The contacts that the engine makes of the ball with what is below it and with what is beside
    it.

    The ball is given a margin that reaches everything, so that the engine itself says what it can
    touch and how the parameters of both are combined."""
    model.geom_margin[ball] += _FAR
    model.pair_margin[:] += _FAR
    model.opt.o_margin += _FAR
    # which knows of the margins in the file alone
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_MIDPHASE
    data = mujoco.MjData(model)
    mujoco.mj_fwdPosition(model, data)
    pairs: tuple[list[Pair], list[Pair]] = [], []
    for contact in data.contact:
        if ball in contact.geom:
            given = {
                name: tuple(getattr(contact, name).tolist())
                for name in ("solref", "solreffriction", "solimp")
            }
            down = -contact.frame[2] if contact.geom[0] == ball else contact.frame[2]
            # The margin is taken apart to the digits that it had in the sum.
            pairs[int(down < _DOWN)].append(
                Pair(**given, margin=round(contact.includemargin - _FAR, 12))
            )
    return pairs


class PlainOnJoints(Bodies):
    """The engine `mujoco-plain` for cases with a `motion`, simulated at the first step."""

    def build(self, case: Any, timestep: float) -> None:
        self._task: Task | None = None
        if not case.motion:
            super().build(case, timestep)
            return
        (p, x0), t_end = case.motion, timestep * math.ceil(case.times[-1] / timestep - 1e-9)
        settings, self._begin, self._at = PLAIN.at(timestep, p), np.array(case.body.position), 0
        self._task = Task(
            engine=PLAIN.name,
            parameters=p,
            x0=x0,
            t_end=t_end,
            settings=settings,
            sample_interval=timestep,
        )

    def step(self, n: int) -> None:
        if not self._task:
            super().step(n)
            return
        if not self._at:
            run = carry_out(self._task)
            if run.header.failure:
                raise InputError(run.header.failure)
            self._states = np.stack(to_world(run.x, run.theta, self._task.parameters), axis=1)
            self._states[:, 0] += self._begin - self._states[0, 0]
        self._at += n

    def state(self) -> State:
        return tuple(self._states[self._at]) if self._task else super().state()


on_joints = PlainOnJoints(
    "mujoco-plain",
    "contacts soft enough for sliding let a ball that lands sink in and throw it back",
    tune=studied,
    declared="the ball in the vessel on joints: azimuth, radius, height, spin; elliptic cone, "
    "settings of the study",
)
