"""What the contacts of a MuJoCo model will do, and measurably do, and what to change.

The engine says what the contacts of a settled model carry. From that `compare.bench.contact_law`
computes depth, creep and the rest; measured are the places of bodies before and after the next
tenth of a second, or of a second where some of them still move or lose contact. Every pair that
touches meanwhile counts."""

from __future__ import annotations

import copy
import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import mujoco
import numpy as np

from compare.bench import advice
from compare.bench.contact_law import (
    LARGEST,
    Array,
    Moment,
    SoftContacts,
    contacts,
    geom_names,
    replacements,
)
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
    watch,
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

    If speeds still change, or contact is lost, loads are means over the second in which the rest
    was measured. Of a pair that `moves`, as its bodies move on or lose contact, depth, creep and
    turning aren't predicted: nan."""

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
    model: Any, data: Any, settled: Rest, step: Advance, tolerances: Tolerances, tell: Tell
) -> advice.AtRest:
    """The contacts of a settled model and what was measured; `data` is left at its end."""
    model, moving, start = awake(model), settled.moving, copy.copy(data)
    calm = settled.steady and not moving
    if calm:
        seen = watch(model, data, step, WINDOW, part(tell, 0, 1 / 2))
        calm = not seen.lost.any()
    if not calm:
        seen = watch(model, data, step, SECOND, part(tell, 1 / 2, 1))
    several, moments = list[SoftContacts](), list[Moment]()
    measured, then = list[dict[str, Array]](), dict[tuple[int, int], Array]()
    for state, pairs in seen.moments(model):
        those, moment = contacts(model, state, pairs)
        several.append(those)
        moments.append(moment)
        measured.append(measured_slip(model, moment, those, seen.velocity))
        bear = loads_by_pair(model, state)
        then |= {pair: bear[pair] for pair in pairs & bear.keys()}
    if not any(len(moment.number) for moment in moments):
        flexible = seen.flexible
        also = f"; {flexible} contacts of flexible bodies are left out" if flexible else ""
        also += f"; after {data.time:.3g} s {few(moving.values())}" if moving else ""
        also += f"; gone down: {few(settled.collapsed)}" if settled.collapsed else ""
        raise InputError(f"nothing touches: the model has no contact under load{also}")
    those = SoftContacts.joined(several)
    found = {name: np.concatenate([each[name] for each in measured]) for name in measured[0]}
    bodies = model.geom_bodyid[those.geoms]
    moves = np.array([not moving.keys().isdisjoint(both) for both in bodies.tolist()])
    radius = radii(model)[bodies].min(1)
    for pair, lost, series in zip(seen.pairs, seen.lost, seen.loads.swapaxes(0, 1), strict=True):
        own = (those.geoms == pair).all(1)
        moves[own] |= lost
        if own.any() and not calm:  # the load of a moment may say nothing
            mean, borne = series.mean(0), then[tuple(pair.tolist())]
            friction, sideways = np.hypot.reduce([mean[3:], borne[3:]], 1)
            load = mean[0] / borne[0]
            those.force[own, 0] *= load
            those.force[own, 1:] *= friction / sideways if sideways > 1e-9 * borne[0] else load
            found["depth_measured"][own] = mean[1] / max(mean[2], 1e-300)
    those = those.subset(np.ones(len(radius), bool))
    good = tolerances.creep, tolerances.depth or DEPTH * radius
    return advice.AtRest(
        model, start, settled, those, moments, radius, moves, found, seen.flexible, *good
    )


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
    step = scene.model.opt.timestep
    return Forecast(tuple(pairs), step, largest, scene.settled, scene.flexible)
