"""Contact settings as MuJoCo itself has them, read from a person's MJCF file, for `dualball league --settings`.

`mjsim.ContactSettings` holds what the study needs and refuses what can't work. This is for settings of which nobody
knows yet whether they work.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from compare.adapters.mujoco_free import Bodies, pairs
from compare.adapters.scene import Scene
from compare.bench.settled import load
from model import InputError
from model.parameters import NOT_NEGATIVE, POSITIVE, Range, check_choice, check_number

_FEW = Range(0, 1e5, whole=True)
NUMBERS: dict[str, tuple[str, Range, str]] = {
    "timestep": ("s", POSITIVE, "time step"),
    "impratio": ("1", POSITIVE, "impedance of friction, divided by that of the normal force"),
    "iterations": ("1", _FEW, "most iterations of the solver"),
    "tolerance": ("1", NOT_NEGATIVE, "tolerance at which the solver stops"),
    "noslip_iterations": ("1", _FEW, "iterations that suppress slip"),
}
"""Options of the engine that are numbers: unit, range and meaning."""
CHOICES = {
    option: {name: int(getattr(kind, f"{prefix}_{name.upper()}")) for name in names.split()}
    for option, kind, prefix, names in (
        ("integrator", mujoco.mjtIntegrator, "mjINT", "Euler RK4 implicit implicitfast discrete"),
        ("cone", mujoco.mjtCone, "mjCONE", "pyramidal elliptic"),
        ("solver", mujoco.mjtSolver, "mjSOL", "PGS CG Newton"),
    )
}
"""Options of the engine that are chosen by name, and its numbers for the names."""
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


@dataclass(frozen=True, kw_only=True)
class Native:
    """Options of the engine and the two contacts, floor (A) and wall (B); the defaults are MuJoCo's.

    Raises `InputError` for what the engine itself could not run.
    """

    timestep: float = 0.002
    integrator: str = "Euler"
    cone: str = "pyramidal"
    solver: str = "Newton"
    impratio: float = 1.0
    iterations: int = 100
    tolerance: float = 1e-8
    noslip_iterations: int = 0
    A: Pair = Pair()
    B: Pair = Pair()
    note: str = ""
    """What the file that it was read from lacks, and what stands for it."""

    def __post_init__(self) -> None:
        for name, (unit, allowed, _) in NUMBERS.items():
            check_number(name, getattr(self, name), unit, allowed)
        for name, known in CHOICES.items():
            check_choice(name, getattr(self, name), list(known))

    def tune(self, spec: Any, scene: Scene, timestep: float) -> None:
        """Set a scene of free bodies: a wall as the wall, all else as the floor."""
        own = ((self.B if name == "wall" else self.A, pair) for name, pair in pairs(spec, scene))
        dataclasses.replace(self, timestep=timestep).set(spec, own)

    def set(self, spec: Any, contacts: Iterable[tuple[Pair, Any]]) -> None:
        """Set options, and the pairs of a scene each to one of ours."""
        for name in NUMBERS:
            setattr(spec.option, name, getattr(self, name))
        for name, known in CHOICES.items():
            setattr(spec.option, name, known[getattr(self, name)])
        for own, pair in contacts:
            for field in dataclasses.fields(Pair):
                setattr(pair, field.name, getattr(own, field.name))


def entry(path: Path) -> Bodies:
    """An engine for the league: MuJoCo with the settings of a file, at its own time step; errors as of `read`."""
    settings = read(path)
    made = Bodies(path.stem, settings.note, tune=settings.tune)
    made.TIMESTEPS = (settings.timestep,)
    return made


def read(path: Path) -> Native:
    """Settings of a ball's contacts in an MJCF file: its option, and the attributes of pairs or geoms.

    The ball is the sphere that can move (the one named "ball" if there are more). Its floor is the first thing it can
    touch that is below it, its wall the first one beside it. Where one is missing, the other stands for both, and the
    `note` says so.

    Raises
    ------
    StorageError
        If the file can't be read.
    InputError
        If it is no MJCF, or lacks a ball or anything for it to pair.
    """
    model, _ = load(path)
    moves = model.body_weldid[model.geom_bodyid] > 0
    spheres = np.flatnonzero(moves & (model.geom_type == mujoco.mjtGeom.mjGEOM_SPHERE)).tolist()
    named = [geom for geom in spheres if model.geom(geom).name == "ball"]
    if not spheres:
        raise InputError(f"{path}: there is no ball: it needs a geom of type sphere in a body with a joint")
    if len(spheres) > 1 and not named:
        raise InputError(f"{path}: there are {len(spheres)} spheres that move; name the one that counts 'ball'")
    floors, walls = _contacts(model, (named or spheres)[0])
    if not floors + walls:
        raise InputError(
            f"{path}: the ball has no contacts: it needs a <pair> with something, or a geom whose contype and "
            "conaffinity meet its own, and contacts switched on"
        )
    missing, other = ("floor", "wall") if walls else ("wall", "floor")
    note = f"{path}: there is no {missing} that the ball can touch; the contact with its {other} stands for both"
    note = "" if floors and walls else note
    same: dict[str, Any] = {name: getattr(model.opt, name) for name in NUMBERS}
    for name, known in CHOICES.items():
        same[name] = next(key for key, value in known.items() if value == getattr(model.opt, name))
    return Native(**same, A=(floors or walls)[0], B=(walls or floors)[0], note=note)


def _contacts(model: Any, ball: int) -> tuple[list[Pair], list[Pair]]:
    """The contacts that the engine makes of the ball with what is below it and with what is beside it.

    The ball is given a margin that reaches everything, so that the engine itself says what it can touch and how the
    parameters of both are combined.
    """
    model.geom_margin[ball] += _FAR
    model.pair_margin[:] += _FAR
    model.opt.o_margin += _FAR
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_MIDPHASE  # which knows of the margins in the file alone
    data = mujoco.MjData(model)
    mujoco.mj_fwdPosition(model, data)
    pairs: tuple[list[Pair], list[Pair]] = [], []
    for contact in data.contact:
        if ball in contact.geom:
            given = {name: tuple(getattr(contact, name).tolist()) for name in ("solref", "solreffriction", "solimp")}
            down = -contact.frame[2] if contact.geom[0] == ball else contact.frame[2]
            # The margin is taken apart to the digits that it had in the sum.
            pairs[int(down < _DOWN)].append(Pair(**given, margin=round(contact.includemargin - _FAR, 12)))
    return pairs
