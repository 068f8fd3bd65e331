"""Contact settings as MuJoCo itself has them: given by option, or read from a person's MJCF file.

`mjsim.ContactSettings` holds what the study needs and refuses what can't work. This is for settings of which nobody
knows yet whether they work.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from mjsim import ContactSettings, scene
from model import InputError, Parameters, StorageError
from model.parameters import NOT_NEGATIVE, POSITIVE, check_choice, check_number

INTEGRATORS = ("Euler", "RK4", "implicit", "implicitfast", "discrete")
CONES = ("pyramidal", "elliptic")
SOLVERS = ("PGS", "CG", "Newton")
_NUMBERS = ("timestep", "impratio", "iterations", "tolerance", "noslip_iterations")
_CHOICES = {
    "integrator": (INTEGRATORS, "mjtIntegrator.mjINT_"),
    "cone": (CONES, "mjtCone.mjCONE_"),
    "solver": (SOLVERS, "mjtSolver.mjSOL_"),
}
"""Options of the engine by what is known of them and what their constants are called."""
_NOTE = "{}: there is no {} that the ball can touch; the contact with its {} stands for both"
_DOWN = 0.7
"""Least share of down in the way from the ball to its floor."""


@dataclass(frozen=True, kw_only=True)
class Touch:
    """What MuJoCo knows of one contact; the defaults are its own."""

    solref: tuple[float, float] = (0.02, 1.0)
    solreffriction: tuple[float, float] = (0.0, 0.0)
    """Zeros: as `solref`."""
    solimp: tuple[float, float, float, float, float] = (0.9, 0.95, 0.001, 0.5, 2.0)
    margin: float = 0.0
    gap: float = 0.0

    def impedance(self, depth: float) -> float:
        """d at a depth in m: from solimp[0] at none to solimp[1] at solimp[2] and beyond."""
        low, high, width, middle, power = self.solimp
        low, high = (min(max(d, 1e-4), 0.9999) for d in (low, high))
        x = min(abs(depth) / width, 1.0) if width > 0 else 1.0
        if x <= middle:
            y = x**power / middle ** (power - 1) if middle > 0 else 0.0
        else:
            y = 1 - (1 - x) ** power / (1 - middle) ** (power - 1)
        return low + y * (high - low)


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
    A: Touch = Touch()
    B: Touch = Touch()
    note: str = ""
    """What the file that it was read from lacks, and what stands for it."""

    def __post_init__(self) -> None:
        check_number("timestep", self.timestep, "s", POSITIVE)
        check_number("impratio", self.impratio, "1", POSITIVE)
        for name in ("iterations", "noslip_iterations", "tolerance"):
            check_number(name, getattr(self, name), "1", NOT_NEGATIVE)
        for name, (known, _) in _CHOICES.items():
            check_choice(name, getattr(self, name), known)

    def with_contacts(self, **changes: Any) -> Native:
        """A copy with the given fields of both contacts changed."""
        return dataclasses.replace(
            self, A=dataclasses.replace(self.A, **changes), B=dataclasses.replace(self.B, **changes)
        )

    def loop(self, **changes: Any) -> ContactSettings:
        """Settings of the study's loop round the engine, with all its corrections off."""
        return ContactSettings.at(self.timestep, memory=False, servo=0.0, order=1, cone=self.cone, **changes)

    def build(self, p: Parameters, loop: ContactSettings) -> Any:
        """The scene compiled to an `mujoco.MjModel` with these settings; `InputError` if MuJoCo refuses them."""
        spec = scene.spec(p, loop)
        option = spec.option
        for name in _NUMBERS:
            setattr(option, name, getattr(self, name))
        for name, (_, prefix) in _CHOICES.items():
            setattr(option, name, _value(prefix, getattr(self, name)))
        for pair in spec.pairs:
            touch = self.A if pair.name == "A" else self.B
            for field in dataclasses.fields(Touch):
                setattr(pair, field.name, getattr(touch, field.name))
        try:
            return spec.compile()
        except ValueError as error:
            raise InputError(f"MuJoCo refuses these settings: {' '.join(str(error).split())}") from error

    def theory(self, touch: Touch, load: float) -> ContactSettings:
        """Settings with one impedance that a contact amounts to under the normal force m `load` (m s-2).

        The impedance is that at the depth of rest; time constants follow from b = 2/(dmax tc) and
        k = d/(dmax tc dr)^2, and are those that the engine puts in the place of ones shorter than two steps.
        """
        depth = 0.0
        for _ in range(50):
            formal = self._formal(touch, touch.impedance(depth))
            depth = formal.margin(load)
        return formal

    def _formal(self, touch: Touch, d: float) -> ContactSettings:
        b, k = self._rates(touch.solref, touch.solimp[1], d)
        friction = touch.solreffriction if any(touch.solreffriction) else touch.solref
        b_f, _ = self._rates(friction, touch.solimp[1], d)
        tc = 2 / (d * b)
        impratio = min(max(self.impratio, 0.1), 1e7)
        bare = ContactSettings(timestep=1e-12, solimp=d, impratio=impratio, memory=False, servo=0.0, order=1)
        return dataclasses.replace(bare, solref=(tc, 1 / (tc * math.sqrt(d * k))), solreffriction=2 / (d * b_f))

    def _rates(self, solref: tuple[float, float], highest: float, d: float) -> tuple[float, float]:
        """Damping b (s-1) and stiffness k (s-2) of a row, as the chapter on computation gives them."""
        first, second = solref
        if first <= 0 or second <= 0:
            return -second / highest, -first * d / highest**2
        first = max(first, 2 * self.timestep)
        return 2 / (highest * first), d / (highest * first * second) ** 2

    def to_mapping(self) -> dict[str, Any]:
        """All values, JSON-able."""
        return dataclasses.asdict(self)


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
        If it is no MJCF, or lacks a ball or anything for it to touch.
    """
    if not path.is_file():
        raise StorageError(f"cannot read {path}: there is no such file")
    try:
        model = mujoco.MjModel.from_xml_path(str(path))
    except ValueError as error:
        raise InputError(f"{path} is not valid MJCF: {' '.join(str(error).split())}") from error
    ball = _ball(model, path)
    touches = _touches(model, ball)
    if not touches or model.opt.disableflags & mujoco.mjtDisableBit.mjDSBL_CONTACT:
        raise InputError(
            f"{path}: the ball has no contacts: it needs a <pair> with something, or a geom whose contype and "
            "conaffinity meet its own, and contacts switched on"
        )
    floor = {geom for geom in touches if _is_below(model, ball, geom)}
    floors = [touch for geom, touch in touches.items() if geom in floor]
    walls = [touch for geom, touch in touches.items() if geom not in floor]
    note = "" if floors and walls else _NOTE.format(path, *(("floor", "wall") if walls else ("wall", "floor")))
    opt = model.opt
    same: dict[str, Any] = {name: getattr(opt, name) for name in _NUMBERS}
    same |= {name: _name(known, kind, getattr(opt, name)) for name, (known, kind) in _CHOICES.items()}
    return Native(**same, A=(floors or walls)[0], B=(walls or floors)[0], note=note)


def _name(known: Sequence[str], prefix: str, value: int) -> str:
    return next(name for name in known if _value(prefix, name) == value)


def _value(prefix: str, name: str) -> int:
    """The engine's number of a choice: prefix "mjtCone.mjCONE_" and name "elliptic" are one of its constants."""
    kind, start = prefix.split(".")
    return int(getattr(getattr(mujoco, kind), start + name.upper()))


def _ball(model: Any, path: Path) -> int:
    """Number of the ball's geom."""
    spheres = [
        geom
        for geom in range(model.ngeom)
        if model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_SPHERE and model.body_weldid[model.geom_bodyid[geom]] > 0
    ]
    named = [geom for geom in spheres if model.geom(geom).name == "ball"]
    if not spheres:
        raise InputError(f"{path}: there is no ball: it needs a geom of type sphere in a body with a joint")
    if len(spheres) > 1 and not named:
        raise InputError(f"{path}: there are {len(spheres)} spheres that move; name the one to be graded 'ball'")
    return (named or spheres)[0]


def _touches(model: Any, ball: int) -> dict[int, Touch]:
    """How the ball touches each geom that it can: by explicit pairs, and for the others by the masks of the geoms."""
    touches = {}
    for pair in range(model.npair):
        geoms = {int(model.pair_geom1[pair]), int(model.pair_geom2[pair])}
        if ball in geoms:
            (other,) = geoms - {ball}
            touches[other] = Touch(
                solref=_numbers(model.pair_solref[pair]),
                solreffriction=_numbers(model.pair_solreffriction[pair]),
                solimp=_numbers(model.pair_solimp[pair]),
                margin=float(model.pair_margin[pair]),
                gap=float(model.pair_gap[pair]),
            )
    welded = model.body_weldid[model.geom_bodyid]
    for geom in range(model.ngeom):
        masks = (model.geom_contype, model.geom_conaffinity)
        meets = any(one[ball] & other[geom] for one, other in (masks, masks[::-1]))
        if geom not in touches and meets and welded[geom] != welded[ball]:
            touches[geom] = _mixed(model, ball, geom)
    if model.opt.enableflags & mujoco.mjtEnableBit.mjENBL_OVERRIDE:
        o = model.opt
        all_alike = Touch(solref=_numbers(o.o_solref), solimp=_numbers(o.o_solimp), margin=float(o.o_margin))
        return dict.fromkeys(touches, all_alike)
    return touches


def _is_below(model: Any, ball: int, geom: int) -> bool:
    """Whether the ball's own point nearest to a geom, or deepest in it, is rather at its bottom than at its side."""
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    ends = np.zeros(6)
    mujoco.mj_geomDistance(model, data, ball, geom, 1e6, ends)
    way = ends[:3] - data.geom_xpos[ball]
    return bool(way[2] < -_DOWN * np.linalg.norm(way))


def _mixed(model: Any, ball: int, geom: int) -> Touch:
    """Contact parameters of two geoms, combined as the engine does: by priority, or weighted with solmix."""
    pair = [ball, geom]
    weights, priority = model.geom_solmix[pair], model.geom_priority[pair]
    if priority[0] != priority[1]:
        weights = (priority == priority.max()).astype(float)
    share = weights / weights.sum() if weights.sum() > 0 else np.full(2, 0.5)
    refs = model.geom_solref[pair]
    # A negative one holds stiffness and damping, which are not averaged.
    direct = np.any(refs <= 0) and priority[0] == priority[1]
    return Touch(
        solref=_numbers(refs.min(axis=0) if direct else share @ refs),
        solimp=_numbers(share @ model.geom_solimp[pair]),
        margin=float(model.geom_margin[pair].sum()),
        gap=float(model.geom_gap[pair].sum()),
    )


def _numbers(values: Any) -> Any:
    return tuple(float(value) for value in values)
