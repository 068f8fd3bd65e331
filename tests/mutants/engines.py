"""Wrong engines: MuJoCo with one hidden fault."""

import math
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from dataclasses import replace
from functools import partial
from typing import Any
from unittest import mock

import mujoco

import mjsim
from compare.engines.study import MUJOCO, Engine
from mjsim import ContactSettings, RigidContacts, scene, stepping
from mjsim.contact_settings import ContactModel
from model import Parameters

LEAST = 1e-5
"""The engine's least friction coefficient."""
CROOKED = 0.01
"""Angle of a wall that isn't tangent, rad."""
Stretch = Callable[[], AbstractContextManager[Any]]


class _Disguised(mjsim.Run):
    """A run with a fault that lasts as long as it is stepped, and headers that say nothing of
    it."""

    fault: Stretch = staticmethod(nullcontext)

    def __iter__(self) -> Any:
        with self.fault(), mock.patch.dict(stepping.BALLS, clear=True):
            yield from super().__iter__()


def wrong_engine(
    name: str,
    ball: Callable[[Parameters], Parameters] = lambda p: p,
    fault: Stretch = nullcontext,
    other: Callable[[RigidContacts], ContactModel] = lambda settings: settings,
) -> Engine:
    """MuJoCo with one fault: it moves another ball than it says, under a fault that lasts as long
    as a run, or with other settings."""

    def stream(
        p: Parameters, x0: Any, t_end: float, flow: Any, settings: RigidContacts, **more: Any
    ) -> mjsim.Run:
        with fault():
            run = _Disguised(ball(p), x0, t_end, flow, other(settings), **more)
        run.fault = fault
        run.header = replace(run.header, parameters=p)
        return run

    return replace(MUJOCO, name=name, stream=stream)


def _altered(change: Callable[[Any], None]) -> AbstractContextManager[Any]:
    """The scene is built with another model."""
    built = scene.build

    def altered(p: Parameters, settings: ContactModel) -> Any:
        model, mjcf = built(p, settings)
        change(model)
        return model, mjcf

    return mock.patch.object(scene, "build", altered)


def _patched(name: str, value: float) -> AbstractContextManager[Any]:
    """An attribute of the settings has another value."""
    return mock.patch.object(RigidContacts, name, value)


def _smooth(model: Any) -> None:
    """The floor carries the ball, but the contact with it has no friction."""
    model.pair_friction[0] = LEAST


def _turn(model: Any) -> None:
    """The plane of the wall is turned about the vertical by `CROOKED`, so that it drives the ball
    round."""
    wall, upright = model.geom("wall"), (math.cos(CROOKED / 2), 0.0, 0.0, math.sin(CROOKED / 2))
    mujoco.mju_mulQuat(wall.quat, upright, wall.quat.copy())


WRONG_ENGINES: tuple[Engine, ...] = (
    wrong_engine("floor friction 1 % high", lambda p: p.replace(mu=1.01 * p.mu)),
    wrong_engine("wall friction 1 % low", lambda p: p.replace(eta=0.99 * p.eta)),
    wrong_engine("inertia 1 % high", lambda p: p.replace(j=1.01 * p.j)),
    wrong_engine("drag 1 % high", lambda p: p.replace(c=1.01 * p.c)),
    wrong_engine("the friction of the floor is missing", fault=partial(_altered, _smooth)),
    wrong_engine("the plane of the wall turned by 0.01 rad", fault=partial(_altered, _turn)),
    wrong_engine("contacts that yield", other=lambda own: ContactSettings.at(own.timestep)),
    wrong_engine(
        "forces taken at the beginning of a step", fault=partial(_patched, "midpoint", 0.0)
    ),
)
