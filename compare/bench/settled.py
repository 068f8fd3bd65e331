"""Any MuJoCo model at rest: what moves or sleeps, what contacts bear, how fast they slip."""

from __future__ import annotations

import copy
import math
import os
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import mujoco
import numpy as np

from compare.bench.contact_law import Array, Moment, SoftContacts
from model import InputError, StorageError
from model.errors import few
from model.files import why_no_file
from model.parameters import ANY, Range, check_number, parse_number

Advance = Callable[[Any, Any, int], None]
"""Advances the data of a model, maybe a copy, by a number of steps, as `mujoco.mj_step` does."""
Tell = Callable[[float], object]  # is called with the fraction done
STEADY, STILL = 2e-3, 1e-8
"""A speed that changes by no more than this share, or this (m/s), in a window has settled."""
MOST_POINTS = 25_000_000
"""Of a heightfield or texture: 5000 by 5000, some 200 MB while it is compiled."""
NOISE = 1e-6  # speeds that are not told apart, m/s
RESTLESS, JOLT, TURNING = 0.3, 1e-3, 0.05
"""A body moves on if its speed changes by this share, or this (m/s), or it turns so, rad."""
WINDOW, WINDOW_STEPS = 0.1, 50  # a window is so long, s, and of so many steps
SHORTEST = 1e-7  # of a time step, s: a million in a window
BENT, SUNK = 0.3, 0.1
"""A robot has collapsed if a driven joint turned so, rad, and it sank by this share of its size."""
STATE = mujoco.mjtState.mjSTATE_INTEGRATION
BAD = [getattr(mujoco.mjtWarning, f"mjWARN_BADQ{name}") for name in ("POS", "VEL", "ACC")]
"""What the engine warns of when a model diverges."""


class UnsettledError(RuntimeError):
    """A model that diverges."""


@dataclass(frozen=True)
class Rest:
    """What a model has settled to; bodies in words."""

    steady: bool  # whether no speed changes any more but by little
    moving: Mapping[int, str]  # bodies that have not settled, by number
    collapsed: tuple[str, ...]  # robots that are not as they began
    asleep: tuple[str, ...]  # bodies that MuJoCo would freeze now


def load(path: Path, keyframe: str | None = None) -> tuple[Any, Any]:
    """A model and its state, at a keyframe by name or number.

    Raises `StorageError` if there is no such file, `InputError` if MuJoCo refuses it, it is huge,
    it has no such keyframe, or its time step is shorter than `SHORTEST`."""
    if why := why_no_file(path):
        raise StorageError(f"cannot read {path}: {why}")
    try:  # MuJoCo takes a name as UTF-8, also where Python's file system has another encoding
        name = os.fsencode(path).decode("utf-8")
    except UnicodeDecodeError as error:
        raise StorageError(f"cannot read {path}: MuJoCo takes no name but in UTF-8") from error
    try:
        _check_heightfields(path)
        spec = mujoco.MjSpec.from_file(name)  # with included files, and defaults
        for each in spec.hfields:
            _check_size("heightfield", each.name, each.nrow, each.ncol)
        for each in spec.textures:
            _check_size("texture", each.name, each.width, each.height)
        model = spec.compile()
        check_number("timestep", model.opt.timestep, "s", Range(SHORTEST))
    except InputError as error:
        raise InputError(f"{path}: {error}") from error
    except ValueError as error:
        said = " ".join(str(error).split())
        if of_xml := re.match(r"XML parse error \d+:.* Line number=(\d+)", said):
            raise InputError(f"{path} is not valid XML, line {of_xml[1]}") from error
        raise InputError(f"{path}: MuJoCo refuses it: {said}") from error
    data, names = mujoco.MjData(model), [model.key(k).name or str(k) for k in range(model.nkey)]
    if keyframe is not None:
        numbers = {str(k): k for k in range(model.nkey)} | {n: k for k, n in enumerate(names)}
        if keyframe not in numbers:
            others = f", but {few(names)}" if names else ""
            raise InputError(f"{path} has no keyframe {keyframe!r}{others}")
        mujoco.mj_resetDataKeyframe(model, data, numbers[keyframe])
    return model, data


def _check_size(what: str, name: str | None, rows: int, columns: int) -> None:
    """`InputError` for what a line of MJCF can ask for and no memory holds."""
    if rows * columns > MOST_POINTS:
        raise InputError(
            f"{what} {name!r} has {rows} x {columns} points; {MOST_POINTS:g} are the most that are "
            "taken"
        )


def _check_heightfields(path: Path) -> None:
    """`InputError` for a huge one in the file itself: MuJoCo makes room for it while it reads."""
    try:
        found = ElementTree.parse(path).iter("hfield")
    except (ElementTree.ParseError, LookupError, ValueError):
        return  # MuJoCo says what is wrong
    for each in found:
        rows, columns = each.get("nrow", ""), each.get("ncol", "")
        if rows.isdecimal() and columns.isdecimal():
            _check_size("heightfield", each.get("name"), int(rows), int(columns))


def set_controls(model: Any, data: Any, values: Sequence[str]) -> None:
    """Set controls: a number for each actuator, or NAME=NUMBER for some.

    Raises `InputError` for a name or a number that the model does not allow."""
    names = [model.actuator(k).name or str(k) for k in range(model.nu)]
    given = [(name, text) for name, _, text in (value.rpartition("=") for value in values)]
    if not all(name for name, _ in given):
        if any(name for name, _ in given) or len(given) != model.nu:
            raise InputError(
                f"--ctrl needs NAME=NUMBER, or as many numbers as there are actuators: {model.nu}"
            )
        given = list(zip(names, values, strict=True))
    named = [name for name, _ in given]
    for name, text in given:
        if named.count(name) > 1:
            raise InputError(f"--ctrl names {name} twice")
        if name not in names:
            others = few(names) or "none at all"
            raise InputError(f"--ctrl: there is no actuator {name!r}, but {others}")
        k = names.index(name)
        limited, limits = model.actuator_ctrllimited[k], model.actuator_ctrlrange[k].tolist()
        allowed = Range(*limits) if limited else ANY
        data.ctrl[k] = parse_number(f"--ctrl: {name}", text, "1", allowed)


def awake(model: Any) -> Any:
    """The model, or a copy of it in which MuJoCo puts no body to sleep."""
    sleep = int(mujoco.mjtEnableBit.mjENBL_SLEEP)
    if model.opt.enableflags & sleep:
        model = copy.copy(model)
        model.opt.enableflags &= ~sleep
    return model


def settle(
    model: Any, data: Any, limit: float, step: Advance = mujoco.mj_step, tell: Tell = float
) -> Rest:
    """Advance until velocities no longer change, for at most `limit` s; nothing sleeps meanwhile.

    Raises `UnsettledError` if the model diverges."""
    sleepy, model = model, awake(model)
    mujoco.mj_forward(model, data)
    first, radius = copy.copy(data), radii(model)
    scale = np.where(np.isfinite(radius), radius, 0)[:, None] ** [0, 0, 0, 1, 1, 1]
    last = np.full((model.nbody, 6), 1e9)
    begin, calm, restless = data.time, 0, np.zeros(model.nbody, bool)
    speed, change = np.zeros((2, model.nbody))
    too_much = list[float]()
    while data.time < begin + limit and calm < 2:
        start, velocity = data.time, mean_velocities(model, data, step)
        speed = np.hypot.reduce(velocity * scale, 1)
        change = np.hypot.reduce((velocity - last) * scale, 1)
        turned, last = np.hypot.reduce(velocity[:, 3:], 1) * (data.time - start), velocity
        restless = (change > np.minimum(RESTLESS * speed, JOLT) + NOISE) | (turned > TURNING)
        restless[0] = False  # the world
        # a speed may pass through a maximum
        calm = calm + 1 if (change <= STEADY * speed + STILL).all() else 0
        too_much.append(math.log(max(1.0, (change / (STEADY * speed + STILL)).max())))
        passed = data.time - begin
        tell(min(1.0, passed / min(limit, time_to_settle(too_much, passed))))
    those = np.flatnonzero(restless).tolist()
    moving = {b: f"{_body_name(model, b)} at {speed[b]:.2g} m/s" for b in those}
    steady, roots = bool((change <= STEADY * speed + NOISE).all()), list[int]()
    if sleepy is not model:  # what it puts to sleep at once if it may
        state = copy.copy(data)
        step(sleepy, state, 2 * mujoco.mjMINAWAKE)
        roots = model.tree_bodyadr[state.tree_asleep >= 0].tolist()
    asleep = tuple(_body_name(model, body) for body in roots)
    return Rest(steady, moving, tuple(_collapsed(model, first, data)), asleep)


def time_to_settle(too_much: Sequence[float], passed: float) -> float:
    """After which time velocities would no longer change, if they go on as in the second half of
    what has passed; from logarithms of how many times too much they change."""
    middle, now = len(too_much) // 2, too_much[-1]
    falls = (too_much[middle] - now) / max(1, len(too_much) - 1 - middle)  # in a window
    more = now / falls if falls > 0 else math.inf if now else 0.0
    return passed * (1 + more / len(too_much))


def _collapsed(model: Any, first: Any, data: Any) -> Iterator[str]:
    """Robots that sank while joints turned which an actuator drives, in words."""
    turned, gravity = np.zeros(model.nv), np.array(model.opt.gravity)
    mujoco.mj_differentiatePos(model, turned, 1, first.qpos, data.qpos)
    hinges = model.jnt_type[model.dof_jntid] != mujoco.mjtJoint.mjJNT_SLIDE
    driven = np.isin(np.arange(model.nv), first.moment_colind[first.actuator_moment != 0])
    bent = np.where(hinges & driven, abs(turned), 0)
    for tree in range(model.ntree):
        own, bodies = model.dof_treeid == tree, np.flatnonzero(model.body_treeid == tree)
        root, joint = bodies[0], model.joint(model.dof_jntid[(bent * own).argmax()])
        size = np.hypot.reduce(first.xipos[bodies] - first.subtree_com[root], 1).max()
        moved = data.subtree_com[root] - first.subtree_com[root]
        sunk = moved @ gravity / (np.hypot.reduce(gravity) or 1)
        if bent[own].max() > BENT and sunk > SUNK * size:
            by = f"joint {joint.name or joint.id!r} by {bent[own].max():.2g} rad"
            yield f"{_body_name(model, root)} by {sunk:.2g} m, its {by}"


def mean_velocities(model: Any, data: Any, step: Advance, time: float = WINDOW) -> Array:
    """Advance by a window; mean velocities of bodies, (nbody, 6): m/s and rad/s.

    Raises `UnsettledError` if the model diverges."""
    mujoco.mj_forward(model, data)
    place, axes, begin = data.xipos.copy(), data.xmat.reshape(-1, 3, 3).copy(), data.time
    steps = max(WINDOW_STEPS, math.ceil(time / model.opt.timestep))
    step(model, data, steps)
    if bad := [each for each in (data.warning[kind] for kind in BAD) if each.number]:
        body = _body_name(model, model.dof_bodyid[min(bad[0].lastinfo, model.nv - 1)])
        raise UnsettledError(
            f"the model diverges before {begin + steps * model.opt.timestep:.3g} s, {body} first"
        )
    mujoco.mj_forward(model, data)
    turn = data.xmat.reshape(-1, 3, 3) @ axes.transpose(0, 2, 1)
    axis = np.column_stack([turn[:, i, j] - turn[:, j, i] for i, j in ((2, 1), (0, 2), (1, 0))]) / 2
    sine = np.hypot.reduce(axis, 1, keepdims=True).clip(1e-30)
    angle = np.arctan2(sine, (np.trace(turn, axis1=1, axis2=2)[:, None] - 1) / 2)
    moved = np.hstack([data.xipos - place, axis * angle / sine])
    return np.asarray(moved / (steps * model.opt.timestep))


@dataclass(frozen=True)
class Watched:
    """What touched in a window of n steps: p pairs of geoms."""

    velocity: Array  # of each body, its mean, (nbody, 6): m/s and rad/s
    states: Array  # before each step, as `mj_getState` writes them
    pairs: Array  # (p, 2)
    loads: Array  # in each step, (n, p, 6), as `loads_by_pair` has them; 0 without contact
    flexible: int  # contacts of flexible bodies, at most

    @property
    def lost(self) -> Array:
        """Whether each pair lost contact, (p,)."""
        return np.asarray((self.loads[..., 0] == 0).any(0))

    def moments(self, model: Any) -> Iterator[tuple[Any, set[tuple[int, int]]]]:
        """As few states as give each pair at least half of the most that it bears, and the pairs of
        each."""
        borne = self.loads[..., 0]
        heavy, left = borne >= borne.max(0, initial=0) / 2, np.ones(len(self.pairs), bool)
        while left.any():
            now = (heavy & left).sum(1).argmax()
            data = mujoco.MjData(model)
            mujoco.mj_setState(model, data, self.states[now], STATE)
            yield data, set(map(tuple, self.pairs[heavy[now] & left].tolist()))
            left &= ~heavy[now]


def watch(model: Any, data: Any, step: Advance, time: float, tell: Tell) -> Watched:
    """Advance by a time, s, and note who touches whom in each step.

    What touches at one moment says little: what slides in MuJoCo is in the air most of the time.
    Raises `UnsettledError` if the model diverges."""
    states, history, flexible = list[Array](), list[dict[tuple[int, int], Array]](), 0
    now = mujoco.MjData(model)  # apart, since a step leaves loads of the last stage of RK4

    def step_and_note(model: Any, data: Any, nstep: int) -> None:
        nonlocal flexible
        for k in range(nstep):
            tell(k / nstep)
            states.append(np.empty(mujoco.mj_stateSize(model, STATE)))
            mujoco.mj_getState(model, data, states[-1], STATE)
            mujoco.mj_setState(model, now, states[-1], STATE)
            mujoco.mj_forward(model, now)
            history.append(loads_by_pair(model, now))
            flexible = max(flexible, int((now.contact.geom < 0).any(1).sum()))
            step(model, data, 1)

    velocity = mean_velocities(model, data, step_and_note, time)
    pairs = sorted({pair for each in history for pair in each})
    loads = np.array([[each.get(pair, np.zeros(6)) for pair in pairs] for each in history])
    shape = len(history), len(pairs), 6
    return Watched(
        velocity, np.array(states), np.array(pairs).reshape(-1, 2), loads.reshape(shape), flexible
    )


def loads_by_pair(model: Any, data: Any) -> dict[tuple[int, int], Array]:
    """What each pair of rigid geoms bears: load, N, depth, m, number, and friction (3), N."""
    found: dict[tuple[int, int], Array] = {}
    force = np.zeros(6)
    for k, geoms in enumerate(map(tuple, data.contact.geom.tolist())):
        mujoco.mj_contactForce(model, data, k, force)
        if force[0] > 0 and min(geoms) >= 0:
            friction = force[1:3] @ data.contact.frame[k, 3:].reshape(2, 3)
            borne = np.array([force[0], -data.contact.dist[k], 1, *friction])
            found[geoms] = found.get(geoms, 0) + borne
    return found


def measured_slip(model: Any, moment: Moment, c: SoftContacts, velocity: Array) -> dict[str, Array]:
    """How deep each contact is, and how fast its bodies slip and turn, by their mean velocities."""
    data, number = moment.data, moment.number
    found = data.contact
    depth, drift = -found.dist[number], found.surfacevel[number, :2]
    frames = found.frame[number].reshape(-1, 3, 3)
    bodies = model.geom_bodyid[c.geoms]
    lever = found.pos[number][:, None] - data.xipos[bodies]
    velocity = velocity[bodies]
    first, second = np.moveaxis(velocity, 1, 0)[..., :3]
    turning = np.diff(velocity[..., 3:], axis=1)[:, 0]
    arms = np.cross(velocity[..., 3:], lever)
    slip = np.einsum("nij,nj->ni", frames[:, 1:], second + arms[:, 1] - first - arms[:, 0]) + drift
    return {
        "depth_measured": depth,
        "creep_measured": np.where(c.dim > 1, np.hypot(*slip.T), np.nan),
        "turning_measured": np.where(c.dim > 3, np.hypot.reduce(turning, 1), np.nan),
    }


def radii(model: Any) -> Array:
    """The radius of each body, m, that of its largest geom; infinite without a size."""
    radius = np.zeros(model.nbody)
    np.maximum.at(radius, model.geom_bodyid, model.geom_rbound)
    return np.where(radius > 0, radius, np.inf)


def _body_name(model: Any, body: int) -> str:
    name = model.body(body).name
    return f"body {name!r}" if name else f"body {int(body)}"
