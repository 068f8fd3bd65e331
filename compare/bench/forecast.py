"""What the contacts of any MuJoCo model will do, beside what they measurably do, and the one option to change.

The engine settles the model and says what its contacts carry. From that `compare.bench.contact_law` computes depth,
creep and the rest; measured are the places of bodies before and after the next tenth of a second.
"""

from __future__ import annotations

import copy
import dataclasses
import itertools
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from compare.bench.contact_law import LARGEST, MEETING, Array, Contacts, contacts, parameters, replaced
from compare.kit import pages
from model import InputError, StorageError

CREEP, DEPTH = 1e-5, 0.01
"""What passes for good where nobody says: creep in m/s; depth divided by the radius of the smaller body."""
STEADY, STILL = 2e-3, 1e-8
"""A speed that changes by less than this share, or by this (m/s), from one window to the next has settled."""
RESTLESS, JOLT, TURNING = 0.3, 1e-3, 0.05
"""A body moves on if its speed changes by this share, or this (m/s), between windows, or if it turns by this, rad."""
WINDOW, WINDOW_STEPS = 0.1, 50
"""A window is so long, s, and of so many steps."""
BAD = [getattr(mujoco.mjtWarning, f"mjWARN_BADQ{name}") for name in ("POS", "VEL", "ACC")]
"""What the engine warns of when a model diverges."""
G = 9.81
"""m s-2."""
CHECKED, CHECKS = 3.0, 3
"""A changed model must settle within so many s to be advised; so many are tried, after which there is no advice."""
SHOWN, OFF = 12, 0.05
"""Pairs in a table; and share of the predicted creep by which the measured one may differ without a word."""
FAULTS = {
    "creep": ("creep", 1e6, "µm/s"),
    "depth": ("depth", 1e6, "µm"),
    "largest_step": ("largest step", 1e3, "ms"),
}
"""What may be wrong with a pair, in words, its unit, and the factor from SI to it."""


class UnsettledError(RuntimeError):
    """A model that diverges, or of which all that touches still moves."""


@dataclass(frozen=True)
class PairForecast:
    """Two geoms in contact, at the worst of their contacts: what is predicted of them, and what was measured."""

    name: str
    members: tuple[int, ...]
    """Its contacts, by number among all."""
    load: float
    """N."""
    depth: float
    depth_measured: float
    creep: float
    """m/s; nan if the pair slides, or has no friction."""
    creep_measured: float
    turning: float
    """Creep of spinning and rolling friction, rad/s."""
    turning_measured: float
    cone: float
    """Share of the friction cone, or pyramid, in use."""
    slides: bool
    hover: float
    """Slip speed from which contact is lost again and again, m/s."""
    rebound: float
    """Share of its speed with which the pair alone parts again, at that of a fall as far as the smaller radius."""
    rebound_measured: float
    decay: float
    """Rate at which the slowest disturbance dies out, s-1."""
    largest_step: float
    """Largest stable time step, s; inf if there is none below one second."""
    replaced: tuple[str, ...]
    """What the engine takes in the place of what the model says."""
    harm: Mapping[str, float]
    """For each of `FAULTS`, how many times what passes for good."""


@dataclass(frozen=True)
class Change:
    """The one option to change, and what that does to the worst pair."""

    option: str
    value: tuple[float, ...]
    pair: str
    quantity: str
    before: float
    after: float
    """Predicted."""
    found: float = math.nan
    """Measured, if it was tried."""

    @property
    def written(self) -> str:
        """As in MJCF."""
        return f'{self.option}="{"elliptic" if self.option == "cone" else " ".join(f"{v:g}" for v in self.value)}"'


@dataclass(frozen=True)
class Forecast:
    """Of a settled model: pairs in contact, the worst first, and what to do."""

    pairs: tuple[PairForecast, ...]
    timestep: float
    largest_step: float
    """Of all contacts together, s."""
    moving: tuple[str, ...]
    """Bodies that have not settled, in words; their pairs are left out."""
    flexible: int
    """Contacts of flexible bodies, which are left out, too."""
    change: Change | None
    memory: bool
    """Whether creep stays harmful with the change, or without one if none helps."""


def load(path: Path, keyframe: str | None = None) -> tuple[Any, Any]:
    """A model and its state, at a keyframe by name or number.

    Raises `StorageError` if there is no such file, `InputError` if MuJoCo refuses it or it has no such keyframe.
    """
    if not path.is_file():
        raise StorageError(f"cannot read {path}: {'it is a directory' if path.is_dir() else 'there is no such file'}")
    try:
        model = mujoco.MjModel.from_xml_path(str(path))
    except ValueError as error:
        raise InputError(f"{path}: MuJoCo refuses it: {' '.join(str(error).split())}") from error
    data, names = mujoco.MjData(model), [model.key(k).name or str(k) for k in range(model.nkey)]
    if keyframe is not None:
        if keyframe not in names and keyframe not in map(str, range(model.nkey)):
            raise InputError(f"{path} has no keyframe {keyframe!r}, but {', '.join(names) or 'none at all'}")
        mujoco.mj_resetDataKeyframe(model, data, names.index(keyframe) if keyframe in names else int(keyframe))
    return model, data


def settle(model: Any, data: Any, limit: float) -> dict[int, str]:
    """Step until velocities no longer change, for at most `limit` s; of each body that still moves, how, in words.

    Raises `UnsettledError` if the model diverges.
    """
    radius = _radius(model)
    scale = np.where(np.isfinite(radius), radius, 0)[:, None] ** [0, 0, 0, 1, 1, 1]
    last = np.full((model.nbody, 6), 1e9)
    begin, calm, restless, speed = data.time, 0, np.zeros(model.nbody, bool), np.zeros(model.nbody)
    while data.time < begin + limit and calm < 2:
        start, velocity = data.time, _advance(model, data)
        speed, change = np.hypot.reduce(velocity * scale, 1), np.hypot.reduce((velocity - last) * scale, 1)
        turned, last = np.hypot.reduce(velocity[:, 3:], 1) * (data.time - start), velocity
        restless = (change > np.minimum(RESTLESS * speed, JOLT) + 1e2 * STILL) | (turned > TURNING)
        restless[0] = False  # the world
        calm = calm + 1 if (change <= STEADY * speed + STILL).all() else 0  # a speed may pass through a maximum
    return {int(b): f"{_body(model, int(b))} at {speed[b]:.2g} m/s" for b in np.flatnonzero(restless)}


def forecast(
    model: Any, data: Any, moving: Mapping[int, str], creep: float = CREEP, depth: float | None = None
) -> Forecast:
    """The forecast for a settled state; what moves is measured over a window, at the end of which `data` is left.

    `moving` are bodies to leave out, as `settle` finds them; `creep` (m/s) and `depth` (m; by default a hundredth of a
    body's radius) are what passes for good. Raises `InputError` if nothing touches, `UnsettledError` if all that
    touches moves.
    """
    those, number = contacts(model, data)
    bodies = model.geom_bodyid[those.geoms]
    flexible = int((data.contact.geom < 0).any(1).sum())
    if not len(number):
        also = f"; {flexible} contacts of flexible bodies are left out" if flexible else ""
        also += f"; after {data.time:.3g} s {_few([*moving.values()])}" if moving else ""
        raise InputError(f"nothing touches: the model has no contact under load{also}")
    kept = np.array([moving.keys().isdisjoint(both) for both in bodies.tolist()], bool)
    if not kept.any():
        rate = those.decay()
        hint = f"; disturbances of its contacts die out at {rate:.2g} 1/s only" if rate < 1 else ""
        raise UnsettledError(f"after {data.time:.3g} s what touches still moves: {_few([*moving.values()])}{hint}")
    rows, those, number, bodies = those.rows[kept], those.only(kept), number[kept], bodies[kept]
    start, radius = copy.copy(data), _radius(model)[bodies].min(1)
    good = np.full(len(number), depth) if depth else DEPTH * radius
    found = _measured(model, data, those, number, bodies)
    law, harm = those.law(), _harm(those, radius, good, creep)
    names = [model.geom(g).name or f"{model.body(model.geom_bodyid[g]).name}#{g}" for g in range(model.ngeom)]
    geoms, belongs = np.unique(those.geoms, axis=0, return_inverse=True)
    pairs = []
    for k, (first, second) in enumerate(geoms):
        part = belongs.ravel() == k
        own = those.only(part)
        step, speed = own.largest_step(), math.sqrt(2 * G * min(radius[part].min(), 1))
        pairs.append(
            PairForecast(
                name=f"{names[first]} / {names[second]}",
                members=tuple(np.flatnonzero(part).tolist()),
                load=float(own.force[:, 0].sum()),
                cone=float(own.cone.max()),
                slides=bool(law.slides[part].any()),
                hover=float(law.hover[part].min()),
                rebound=own.rebound(speed),
                rebound_measured=_rebound(model, start, dataclasses.replace(own, rows=rows[part]), number[part], speed),
                decay=own.decay(),
                largest_step=step,
                replaced=tuple(replaced(model, own, names)),
                harm={name: float(values[part].max()) for name, values in harm.items()}
                | {"largest_step": those.timestep / step},
                **{name: float(getattr(law, name)[part].max()) for name in ("depth", "creep", "turning")},
                **{name: float(values[part].max()) for name, values in found.items()},
            )
        )
    pairs.sort(key=lambda pair: -max(pair.harm.values()))
    alone = min(pair.largest_step for pair in pairs)
    step = min(alone, those.largest_step(min(alone, LARGEST)))
    best, left = _change(model, start, those, number, lambda c: _harm(c, radius, good, creep), pairs[0], len(moving))
    memory = max(pair.harm["creep"] for pair in pairs) > 1 and bool(1 < left["creep"].max() < math.inf)
    return Forecast(tuple(pairs), model.opt.timestep, step, tuple(moving.values()), flexible, best, memory)


def _measured(model: Any, data: Any, c: Contacts, number: Array, bodies: Array) -> dict[str, Array]:
    """How deep each contact is, and how fast its two bodies slip past each other and turn, in the mean of a window."""
    found = data.contact
    depth, drift, frames = -found.dist[number], found.surfacevel[number, :2], found.frame[number].reshape(-1, 3, 3)
    lever = found.pos[number][:, None] - data.xipos[bodies]
    velocity = _advance(model, data)[bodies]
    (first, second), turning = np.moveaxis(velocity, 1, 0)[..., :3], np.diff(velocity[..., 3:], axis=1)[:, 0]
    arms = np.cross(velocity[..., 3:], lever)
    slip = np.einsum("nij,nj->ni", frames[:, 1:], second + arms[:, 1] - first - arms[:, 0]) + drift
    return {
        "depth_measured": depth,
        "creep_measured": np.where(c.dim > 1, np.hypot(*slip.T), np.nan),
        "turning_measured": np.where(c.dim > 3, np.hypot.reduce(turning, 1), 0),
    }


def _rebound(model: Any, data: Any, c: Contacts, number: Array, speed: float) -> float:
    """Share of its speed with which a pair parts; it meets anew, without other contacts, weight or forces of joints."""
    twin, state = copy.copy(model), mujoco.MjData(model)
    mujoco.mj_copyData(state, model, data)
    mujoco.mj_forward(model, state)
    mass, bit = np.zeros((model.nv, model.nv)), mujoco.mjtDisableBit
    mujoco.mj_fullM(model, state, mass)
    approach = c.approach()
    if np.isnan(approach).any():
        return math.nan
    way = np.linalg.solve(np.linalg.cholesky(mass).T, approach)
    for name in ("GRAVITY", "SPRING", "DAMPER", "ACTUATION", "FRICTIONLOSS", "LIMIT", "EQUALITY"):
        twin.opt.disableflags |= getattr(bit, f"mjDSBL_{name}")
    others = ~np.isin(np.arange(model.ngeom), c.geoms[0])
    for kind, which in (("geom", others), ("flex", slice(None))):
        for mask in ("contype", "conaffinity"):
            getattr(twin, f"{kind}_{mask}")[which] = 0
    explicit = np.column_stack([twin.pair_geom1, twin.pair_geom2])
    twin.pair_margin[~np.isin(explicit, c.geoms[0]).all(1)] = -1e3
    gap = float(np.mean(state.contact.dist[number] - c.margin))
    mujoco.mj_integratePos(model, state.qpos, way, -gap - model.opt.timestep * speed / 2)
    state.qvel[:], state.qfrc_applied[:], state.xfrc_applied[:] = -speed * way, 0, 0
    for _ in range(round(MEETING / model.opt.timestep)):
        mujoco.mj_step(twin, state)
        if not (state.nefc and state.efc_force.any()):
            break
    return float(way @ mass @ state.qvel) / float(approach @ approach) / speed


@np.errstate(over="ignore")
def _harm(c: Contacts, radius: Array, good: Array, creep: float) -> dict[str, Array]:
    """By what may be wrong with each contact: how many times what passes for good."""
    law = c.law()
    speed = np.nan_to_num(np.fmax(law.creep, law.turning * np.where(c.dim > 3, radius, 0)))
    step = np.full(len(speed), 0.0 if c.stable(c.timestep) else 2.0)
    return {"creep": speed / creep, "depth": law.depth / good, "largest_step": step}


def _options(c: Contacts) -> Iterator[tuple[str, tuple[float, ...]]]:
    """Options that may help the contacts of a pair, and their values, the mildest first."""
    largest = 10 if c.pyramidal else 1e4  # edges that are harder still push the pair apart
    for power, digit in itertools.product((10, 100, 1e3, 1e4), (1, 2, 5)):
        if c.impratio < power * digit <= largest:
            yield "impratio", (power * digit,)
    if c.pyramidal:
        yield "cone", (int(mujoco.mjtCone.mjCONE_ELLIPTIC),)
    time, ratio = c.solref[0]
    if time < 0 and ratio == 0:
        yield "solref", (time, -_rounded(2 * math.sqrt(-time)))  # critical
    for share in (0.7, 0.5, 0.35, 0.25, 0.2, 0.15, 0.1):
        if time > 0 and share * time >= 2 * c.timestep:
            yield "solref", (_rounded(share * time), ratio)
        elif time < 0:
            yield "solref", (_rounded(time / share**2), _rounded(ratio / share))
    for impedance in (0.95, 0.98, 0.99, 0.995, 0.998, 0.999):
        if c.solimp[0, 0] < impedance:
            yield "solimp", (impedance, max(impedance, c.solimp[0, 1]))
    for share in (0.7, 0.5, 0.35, 0.2, 0.1):
        yield "timestep", (_rounded(share * c.timestep),)


def _rounded(value: float) -> float:
    return float(f"{value:.2g}")


def apply(model: Any, option: str, value: Sequence[float]) -> None:
    """Change one option of a model; those of contacts for all geoms and pairs that are softer."""
    if option in ("impratio", "cone", "timestep"):
        setattr(model.opt, option, value[0])
    for own in (getattr(model, f"{kind}_{option}") for kind in ("geom", "pair") if option in ("solref", "solimp")):
        if option == "solimp":
            own[:, :2] = np.maximum(own[:, :2], value)
        else:
            own[own[:, 0] > value[0] if value[0] > 0 else own[:, 0] < 0] = value


def _change(
    model: Any,
    data: Any,
    c: Contacts,
    number: Array,
    harm: Callable[[Contacts], Any],
    pair: PairForecast,
    restless: int,
) -> tuple[Change | None, dict[str, Array]]:
    """The first option, in its mildest value, that makes all contacts good, or else the one that helps most.

    Also the harm that is left then. A change after which more bodies than before, `restless`, do not settle is none.
    """
    what = max(pair.harm, key=lambda name: pair.harm[name])
    part, tried = np.isin(np.arange(len(c.dim)), pair.members), []
    for option, value in _options(c.only(part)) if pair.harm[what] > 1 else ():
        other, state = copy.copy(model), copy.copy(data)
        apply(other, option, value)
        mujoco.mj_fwdPosition(other, state)
        changed = dataclasses.replace(c, **parameters(other, state, number))
        harms, effect = harm(changed), [_of(each, part, what) for each in (c, changed)]
        left = max(float(each.max()) for each in harms.values())
        tried.append((left, harms, Change(option, value, pair.name, what, *effect), other))
    cures = [each for each in tried if each[0] <= 1]
    helps = [each for each in tried if 1 < each[0] < pair.harm[what] / 1.4]
    helps.sort(key=lambda each: (each[0], max(1, float(each[1][what].max()))))
    for _, harms, best, other in [*cures, *helps][:CHECKS]:
        if _restless(other, data) <= restless:
            return best, harms
    return None, harm(c)


def _restless(model: Any, data: Any) -> float:
    """How many bodies of a changed model do not settle: contacts may chatter that are stable for small motions."""
    try:
        return len(settle(model, copy.copy(data), CHECKED))
    except UnsettledError:
        return math.inf


def _of(c: Contacts, part: Array, quantity: str) -> float:
    """Creep, depth, or largest step of some contacts."""
    return c.only(part).largest_step() if quantity == "largest_step" else float(getattr(c.law(), quantity)[part].max())


def _advance(model: Any, data: Any) -> Array:
    """Mean velocities of the bodies in a window, shape (nbody, 6): of the centre of mass, m/s, and turning, rad/s.

    Raises `UnsettledError` if the model diverges.
    """
    mujoco.mj_forward(model, data)
    place, axes, begin = data.xipos.copy(), data.xmat.reshape(-1, 3, 3).copy(), data.time
    steps = max(WINDOW_STEPS, math.ceil(WINDOW / model.opt.timestep))
    mujoco.mj_step(model, data, steps)
    if bad := [each for each in (data.warning[kind] for kind in BAD) if each.number]:
        body = _body(model, model.dof_bodyid[min(bad[0].lastinfo, model.nv - 1)])
        raise UnsettledError(f"the model diverges before {begin + steps * model.opt.timestep:.3g} s, {body} first")
    mujoco.mj_forward(model, data)
    turn = data.xmat.reshape(-1, 3, 3) @ axes.transpose(0, 2, 1)
    axis = np.column_stack([turn[:, i, j] - turn[:, j, i] for i, j in ((2, 1), (0, 2), (1, 0))]) / 2
    sine = np.hypot.reduce(axis, 1, keepdims=True).clip(1e-30, 1)
    mean: Array = np.hstack([data.xipos - place, axis * np.arcsin(sine) / sine]) / (steps * model.opt.timestep)
    return mean


def _body(model: Any, body: int) -> str:
    return f"body {model.body(body).name or body!r}"


def _radius(model: Any) -> Array:
    """Of each body, m: that of its largest geom; infinite where none has a size."""
    radius = np.zeros(model.nbody)
    np.maximum.at(radius, model.geom_bodyid, model.geom_rbound)
    return np.where(radius > 0, radius, np.inf)


def tried(model: Any, data: Any, before: Forecast, limit: float, **good: Any) -> tuple[Forecast, Forecast]:
    """The forecast with what was found after the advised change, and that of the changed model, settled anew."""
    assert before.change
    apply(model, before.change.option, before.change.value)
    after = forecast(model, data, settle(model, data, limit), **good)
    what = before.change.quantity
    for pair in after.pairs:
        if pair.name == before.change.pair:
            found = getattr(pair, f"{what}_measured" if what in ("creep", "depth") else what)
            before = dataclasses.replace(before, change=dataclasses.replace(before.change, found=found))
    return before, after


def sentences(f: Forecast) -> Iterator[str]:
    """What to do, what was found when it was tried, and what else should be known, in words."""
    sliding = [p.name for p in f.pairs if p.slides]
    if f.change:
        name, factor, unit = FAULTS[f.change.quantity]
        endless = "any" if f.change.quantity == "largest_step" else "∞"
        before, after, found = (_number(v, factor, endless) for v in (f.change.before, f.change.after, f.change.found))
        done = "" if found == "–" else f" Tried: {found} {unit}."
        yield f"Set {f.change.written}: the {name} of {f.change.pair} goes from {before} to {after} {unit}.{done}"
    if f.memory:
        yield (
            f"{'That alone does not cure' if f.change else 'No single option cures'} the creep. Step the model with "
            "mjsim.FrictionMemory (integrator Euler, implicit or implicitfast): what friction can hold then stays."
        )
    if sliding:
        yield f"Friction is used up, so these slide: {_few(sliding)}. No setting but more friction holds them."
    if lost := [p.name for p in f.pairs if p.slides and p.creep_measured > p.hover]:
        yield f"These slide so fast that contact is lost again and again: {_few(lost)}."
    if off := [p.name for p in f.pairs if abs(p.creep_measured - p.creep) > OFF * p.creep + 1e2 * STILL]:
        yield f"Creep is not what was predicted at {_few(off)}: not settled yet, or the solver stops early (tolerance)."
    if f.moving:
        yield f"Not settled, and left out: {_few(f.moving)}."
    if not (f.change or f.memory or sliding):
        yield "Nothing needs to change."
    for line in dict.fromkeys(line for p in f.pairs for line in p.replaced):
        yield f"MuJoCo replaces something at {_few([p.name for p in f.pairs if line in p.replaced])}: {line}."
    if math.isfinite(f.largest_step):
        yield f"The contacts are stable up to a step of {1e3 * f.largest_step:.3g} ms (now {1e3 * f.timestep:g} ms)."
    if f.flexible:
        yield f"{f.flexible} contacts of flexible bodies are left out."


def _number(value: float, factor: float = 1, endless: str = "any") -> str:
    """Three digits, none for what is next to nothing."""
    value *= factor
    if not math.isfinite(value):
        return endless if math.isinf(value) else "–"
    return f"{value:.0f}" if abs(value) >= 1e3 else f"{value:.3g}" if abs(value) >= 1e-3 else "0"


def _few(names: Sequence[str]) -> str:
    return ", ".join(names[:3]) + (f" and {len(names) - 3} more" if len(names) > 3 else "")


def tables(f: Forecast) -> list[tuple[str, list[list[str]]]]:
    """Titles and tables, a head first, of the worst pairs: at rest and in motion; what was measured is called found."""
    rest = [["pair", "load\nN", "depth\nµm", "found\nµm", "creep\nµm/s", "found\nµm/s", "mm/\nmin", "cone\n%"]]
    motion = [["pair", "hover\nmm/s", "bounce\n%", "found\n%", "decay\n1/s", "step\nms"]]
    for p in f.pairs[:SHOWN]:
        micro = [_number(v, 1e6, "∞") for v in (p.depth, p.depth_measured, p.creep, p.creep_measured)]
        rest.append([p.name, _number(p.load), *micro, _number(p.creep_measured, 6e4), _number(p.cone, 100)])
        bounce = [_number(v, 100) for v in (p.rebound, p.rebound_measured)]
        motion.append([p.name, _number(p.hover, 1e3), *bounce, _number(p.decay), _number(p.largest_step, 1e3)])
    title = f"Pairs in contact: {len(f.pairs)}" + (f", of which the {SHOWN} worst" if len(f.pairs) > SHOWN else "")
    return [(title, rest), ("In motion", motion)]


def changed(f: Forecast, after: Forecast) -> tuple[str, list[list[str]]]:
    """Title and table of what the change was for, after it."""
    return "After the change", tables(after)[bool(f.change and f.change.quantity == "largest_step")][1]


def html(f: Forecast, after: Forecast | None, file: str) -> str:
    """The forecast, and that after the change, as one self-contained page."""
    shown = tables(f) + ([changed(f, after)] if after else [])
    return pages.render("compare.bench", "forecast.html", file=file, tables=shown, sentences=list(sentences(f)))
