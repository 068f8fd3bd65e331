"""What the contacts of a MuJoCo model will do, and measurably do, and what to change.

The engine says what the contacts of a settled model carry. From that `compare.bench.contact_law`
computes depth, creep and the rest; measured are the places of bodies before and after the next
tenth of a second, or of a second where some of them still move."""

from __future__ import annotations

import copy
import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import mujoco
import numpy as np

from compare.bench import advice
from compare.bench.contact_law import LARGEST, Array, contacts, geom_names, replacements
from compare.bench.settled import (
    WINDOW,
    Advance,
    Rest,
    Tell,
    UnsettledError,
    awake,
    loads_by_pair,
    measured_slip,
    radii,
    settle,
    step_to_most_contacts,
)
from compare.campaign.progress import part
from model import InputError
from model.errors import few

DEPTH = 0.01  # what passes for good unless said, in radii of the smaller body
SECOND, CHECKED = 1.0, 3.0
"""How long what moves is measured, s; and within how many a changed model must settle."""
SHOWN = 12  # the worst pairs, which are shown


@dataclass(frozen=True)
class Tolerances:
    """What passes for good."""

    creep: float = 1e-5  # m/s
    depth: float | None = None  # m; None: `DEPTH` times a body's radius


@dataclass(frozen=True)
class PairForecast:
    """Two geoms in contact, at the worst of their contacts: predicted, and measured.

    If speeds still change, loads are means over the second in which the rest was measured. Of a
    pair that `moves`, as its bodies move on or lose contact, depth, creep and turning aren't
    predicted: nan."""

    name: str
    members: tuple[int, ...]  # its contacts, by number among all
    moves: bool
    parts: bool  # whether any joint can part it
    load: float  # N
    depth: float
    depth_measured: float
    creep: float  # m/s; nan if the pair slides, or has no friction
    creep_measured: float
    turning: float  # creep of spinning and rolling friction, rad/s; nan if the pair has none
    turning_measured: float
    cone: float  # share of the friction cone, or pyramid, in use
    short: float
    """Share of Coulomb's friction that the pyramid lacks in the direction of the load or, if the
    pair slides or moves, against its slip, of all its contacts; nan for an elliptic cone, and where
    next to no friction acts."""
    slides: bool
    hover: float  # slip speed from which contact is lost again and again, m/s
    largest_step: float  # largest stable time step, s; inf if there is none below one second
    replaced: Mapping[str, str]
    """What the engine takes in the place of what the model says: kinds, and how."""
    harm: Mapping[str, float]  # for each of `advice.FAULTS`, how many times what passes for good


@dataclass(frozen=True)
class Forecast:
    """Of a settled model: pairs in contact, the worst first, and what to do."""

    pairs: tuple[PairForecast, ...]
    timestep: float
    largest_step: float  # of all contacts together, s
    settled: Rest
    flexible: int  # contacts of flexible bodies, which are left out
    change: advice.Change | None = None
    remedy: str = ""  # lines of Python that hold what still creeps harmfully; empty: nothing does

    @property
    def unsettled(self) -> str:
        """If nothing that touches is at rest: what moves, in words."""
        if not all(p.moves for p in self.pairs):
            return ""
        those = [*self.settled.moving.values()] or [p.name for p in self.pairs]
        return f"what touches still moves: {few(those)}"


def forecast(
    model: Any,
    data: Any,
    settled: Rest,
    tolerances: Tolerances = Tolerances(),
    step: Advance = mujoco.mj_step,
    tell: Tell = float,
) -> Forecast:
    """The forecast for a model as `settle` has left it; `data` is left at its end.

    Raises `InputError` if nothing touches, `UnsettledError` if the model diverges."""
    scene = _measured(model, data, settled, step, tolerances, part(tell, 0, 1 / 4))
    found = _without_advice(scene)
    worst = found.pairs[0]

    def calm(other: Any) -> bool:
        """Whether a changed model settles as well: contacts may chatter."""
        try:
            found = settle(other, copy.copy(scene.data), CHECKED, step)
            return len(found.moving) <= len(settled.moving)
        except UnsettledError:
            return False

    trying = part(tell, 1 / 4, 1)
    change, left = advice.best_change(scene, worst.name, worst.members, worst.harm, calm, trying)
    creeps = max(pair.harm["creep"] for pair in found.pairs) > 1
    remedy = advice.remedy_code(model) if creeps and 1 < left["creep"].max() < math.inf else ""
    return replace(found, change=change, remedy=remedy)


def follow_advice(
    model: Any,
    data: Any,
    before: Forecast,
    limit: float,
    tolerances: Tolerances = Tolerances(),
    tell: Tell = float,
) -> tuple[Forecast, Forecast | None, Forecast | None]:
    """Follow the advice and settle anew, for at most `limit` s: forecasts before, after, beyond.

    The second forecast is that after the change, which is made in `model`, the third that with the
    remedy on top; None of what isn't advised. Raises as `forecast` does."""
    after = held = None

    def again(model: Any, data: Any, step: Advance, tell: Tell) -> Forecast:
        rest = settle(model, data, limit, step, part(tell, 0, 1 / 2))
        scene = _measured(model, data, rest, step, tolerances, part(tell, 1 / 2, 1))
        return _without_advice(scene)

    if change := before.change:
        advice.apply(model, change.option, change.value)
        after = again(model, data, mujoco.mj_step, part(tell, 0, 1 / 2))
        measured = "_measured" if change.quantity in ("creep", "depth") else ""
        those = [pair for pair in after.pairs if pair.name == change.pair]
        found = [getattr(pair, f"{change.quantity}{measured}") for pair in those]
        change = replace(change, found=max(found, default=math.nan))
        before = replace(before, change=change)
    if before.remedy:
        held = again(*advice.remedied(model, data), part(tell, 1 / 2, 1))
        pairs = (replace(p, creep=0 * p.creep, turning=0 * p.turning) for p in held.pairs)
        held = replace(held, pairs=tuple(pairs))
    return before, after, held


def _measured(
    model: Any,
    data: Any,
    settled: Rest,
    step: Advance,
    tolerances: Tolerances,
    tell: Tell,
) -> advice.AtRest:
    """The contacts of a settled model and what was measured; `data` is at its end."""
    model, moving = awake(model), settled.moving
    if moving:
        step_to_most_contacts(model, data, step)
    those, number = contacts(model, data)
    if not len(number):
        flexible = _count_flexible(data)
        also = f"; {flexible} contacts of flexible bodies are left out" if flexible else ""
        also += f"; after {data.time:.3g} s {few(moving.values())}" if moving else ""
        also += f"; gone down: {few(settled.collapsed)}" if settled.collapsed else ""
        raise InputError(f"nothing touches: the model has no contact under load{also}")
    start, bodies = copy.copy(data), model.geom_bodyid[those.geoms]
    moves = np.array([not moving.keys().isdisjoint(both) for both in bodies.tolist()])
    radius = radii(model)[bodies].min(1)
    history: list[dict[tuple[int, int], Array]] = []

    def step_and_record(model: Any, data: Any, nstep: int) -> None:
        for k in range(nstep):
            tell(k / nstep)
            step(model, data, 1)
            history.append(loads_by_pair(model, data))

    time = WINDOW if settled.steady and not moving else SECOND
    found = measured_slip(model, data, those, number, step_and_record, time)
    now = loads_by_pair(model, start)
    for pair in np.unique(those.geoms, axis=0):
        part, key = (those.geoms == pair).all(1), tuple(pair.tolist())
        series = np.array([each.get(key, np.zeros(6)) for each in history])
        moves[part] |= bool((series[:, 0] == 0).any())  # contact is lost
        if moves[part].any() or time == SECOND:  # the load of a moment may say nothing
            mean, then = series.mean(0), now[key]
            friction, sideways = np.hypot.reduce([mean[3:], then[3:]], 1)
            load = mean[0] / then[0]
            those.force[part, 0] *= load
            those.force[part, 1:] *= friction / sideways if sideways > 1e-9 * then[0] else load
            found["depth_measured"][part] = mean[1] / max(mean[2], 1e-300)
    own = those.subset(np.ones(len(number), bool))
    good = tolerances.creep, tolerances.depth or DEPTH * radius
    return advice.AtRest(model, start, settled, own, number, radius, moves, found, *good)


def _without_advice(scene: advice.AtRest) -> Forecast:
    """The forecast for a settled model without advice."""
    those, moves, names = scene.contacts, scene.moves, geom_names(scene.model)
    law, harms, pairs = those.law(), scene.harm(those), []
    told = {
        name: np.where(moves, np.nan, getattr(law, name)) for name in ("depth", "creep", "turning")
    }
    told |= {"cone": np.where(moves, np.nan, those.cone), **scene.found}
    geoms, belongs = np.unique(those.geoms, axis=0, return_inverse=True)
    for k, (first, second) in enumerate(geoms):
        part = belongs.ravel() == k
        own = those.subset(part)
        largest = own.largest_step()
        harm = {name: float(values[part].max()) for name, values in harms.items()}
        pairs.append(
            PairForecast(
                name=f"{names[first]} / {names[second]}",
                members=tuple(np.flatnonzero(part).tolist()),
                moves=bool(moves[part].any()),
                parts=own.parts,
                load=float(own.force[:, 0].sum()),
                short=own.lacking((law.slides | moves)[part]),
                slides=bool((law.slides & ~moves)[part].any()),
                hover=float(law.hover[part].min()),
                largest_step=largest,
                replaced=dict(replacements(scene.model, own, names)),
                harm=harm | {"largest_step": those.timestep / largest},
                **{name: float(values[part].max()) for name, values in told.items()},
            )
        )
    pairs.sort(key=lambda pair: -max(pair.harm.values()))
    alone = min(pair.largest_step for pair in pairs)
    largest = min(alone, those.largest_step(min(alone, LARGEST)))
    step, flexible = scene.model.opt.timestep, _count_flexible(scene.data)
    return Forecast(tuple(pairs), step, largest, scene.settled, flexible)


def _count_flexible(data: Any) -> int:
    """How many contacts of flexible bodies there are, which are left out."""
    return int((data.contact.geom < 0).any(1).sum())
