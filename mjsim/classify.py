"""Which kinematic case is it, and when does it change? Detected step by step from slip speed and force.

A contact is open where it carries no force. A closed one slips where it uses the whole of the friction and moves faster
than a dead band; it rolls where either is clearly not so; in between it keeps its state. A state counts only if it
lasts for `PERSISTENCE` steps: single steps of a contact that hovers or rebounds change nothing.

Events are located between steps: a contact closes where the parabola through its last three gaps vanishes, opens where
that through its normal forces does, and sticks where that through its slip speeds does; it slips where that through the
share of the friction in use reaches one. Where that isn't within the step of the change, it is the nearer end of it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple, Protocol

import numpy as np
import numpy.typing as npt

from model import Case, Contact, Events, Parameters
from model.arrays import Array

PERSISTENCE = 3
"""Steps a contact must stay in a state for it to count."""

_CONTACTS = (Contact.R, Contact.S, Contact.N)
_R, _S, _N, _AS_BEFORE = range(4)
_CODES = np.array([[Case.of(A, B) for B in _CONTACTS] for A in _CONTACTS], dtype=np.int8)
_SATURATED, _FREE = 1e-6, 1e-4
"""How far from its Coulomb value friction may be for slipping, and must be for rolling, relative."""
_SLIDES = 3.0
"""A sliding contact is faster than so many times the change of its speed in a step: ending slip changes faster."""
_SHARED = 10.0
"""A contact that creeps no faster than so many times as another one that holds doesn't slip by itself."""
_BACK = 16
"""Steps that are kept to locate a change: how long a slip that sets in may take to leave the dead band."""

_CARRIED = "_latest", "_shown", "_now", "_begin"


class Regularised(Protocol):
    """The numbers of an engine's settings that the classifier needs, see `ContactSettings`."""

    @property
    def timestep(self) -> float: ...
    @property
    def rolls(self) -> float: ...
    @property
    def midpoint(self) -> float: ...
    def regularisation_speed(self, load: npt.ArrayLike) -> Array: ...


class Contacts(NamedTuple):
    """What the contacts A and B of each run do in successive steps: arrays (steps, runs, 2)."""

    normal: Array
    """Normal force, N; 0 where the contact is open."""
    friction: Array
    """N"""
    speed: Array
    """Of slip, at the beginning of the step, m s-1."""
    gap: Array
    """m; so many steps after its beginning as forces are."""


class Classifier:
    """The cases of one or many runs; steps too recent to judge wait for the next ones."""

    def __init__(self, parameters: Sequence[Parameters], settings: Regularised) -> None:
        self._settings, runs = settings, len(parameters)
        self._m, self._g = (np.array([[getattr(p, name)] for p in parameters]) for name in "mg")
        self._coefficients = np.array([(p.mu, p.eta) for p in parameters])
        self.decided = 0
        """How many steps are."""
        self._latest = np.empty((len(Contacts._fields), 0, runs, 2))
        """The last steps, decided or not,"""
        self._shown = np.empty((0, runs, 2), dtype=np.intp)
        """and the state of the contacts in each of them judged alone."""
        self._now, self._begin = np.full((runs, 2), _AS_BEFORE), np.zeros(runs, dtype=np.intp)
        """State of the contacts in the last step that is decided, and the case of the first one."""
        self._waiting = 0
        self._changes: list[list[tuple[int, float, int, int]]] = [[] for _ in parameters]
        """Of each run: the first step of a new case, when it began in s, the case before and the new one."""

    def add(self, contacts: Contacts, last: bool = False) -> None:
        """Take in the next steps; with `last` all are decided, since no more will come."""
        first = len(self._shown) - self._waiting
        steps = np.concatenate([self._latest, contacts], axis=1)
        shown = self._shown = np.concatenate([self._shown, self._judge(contacts)])
        if (unclear := shown == _AS_BEFORE).any():  # between the bands a contact is what it was
            known = np.maximum.accumulate(np.where(unclear, 0, np.arange(len(shown))[:, None, None]), axis=0)
            shown = self._shown = np.take_along_axis(shown, known, axis=0)
            shown[shown == _AS_BEFORE] = _R
        stop = max(first, len(shown) - (0 if last else PERSISTENCE - 1))
        new, count = shown[first:], stop - first
        if count and (new != self._now).any():
            lasts = np.zeros(new.shape, dtype=bool)
            alike = np.lib.stride_tricks.sliding_window_view(new, min(PERSISTENCE, len(new)), axis=0)
            lasts[: len(alike)] = (alike == alike[..., :1]).all(axis=-1)
            if self._now[0, 0] == _AS_BEFORE:  # the first that lasts, or the first of all
                self._now = np.take_along_axis(new, lasts.argmax(axis=0)[None], axis=0)[0]
                self._begin = _CODES[tuple(self._now.T)].astype(np.intp)
            latest = np.maximum.accumulate(np.where(lasts, np.arange(len(new))[:, None, None], -1), axis=0)[:count]
            decided = np.where(latest < 0, self._now, np.take_along_axis(new, np.maximum(latest, 0), axis=0))
            before = np.concatenate([self._now[None], decided[:-1]])
            for k, run in np.argwhere((decided != before).any(axis=2)).tolist():
                self._note(run, self.decided + k, steps[:, : first + k + 1, run], before[k, run], decided[k, run])
            self._now = decided[-1]
        self.decided += count
        self._waiting, old = len(shown) - stop, max(0, stop - _BACK)
        self._latest, self._shown = steps[:, old:].copy(), shown[old:].copy()

    def _judge(self, contacts: Contacts) -> npt.NDArray[np.intp]:
        """States of the contacts (rolling, slipping, open) by each step alone, (steps, runs, 2)."""
        settings, (normal, friction, speed, _) = self._settings, contacts
        limit = self._coefficients * normal
        # A friction force of which one step can build up only a part leaves, while it changes slowly, a creep far
        # below the speed that belongs to all of it.
        load = self._coefficients * np.maximum(normal / self._m, self._g)
        band = settings.regularisation_speed(load) * settings.rolls
        saturated = friction >= (1 - _SATURATED) * limit
        # A rotation that slips at both contacts alike while one of them holds is creep, too: the load moves from one
        # to the other, as it may where both roll, and slip would be stopped by the one that holds.
        held = ((normal > 0) & ~saturated)[..., ::-1] & (speed < _SHARED * speed[..., ::-1])
        slips = saturated & (speed > 3 * band) & ~held
        rolls = (friction < (1 - _FREE) * limit) | (speed < band) | held
        shown: npt.NDArray[np.intp] = np.select([normal <= 0, slips, rolls], [_N, _S, _R], _AS_BEFORE)
        return shown

    def _note(self, run: int, step: int, steps: Array, *contacts: npt.NDArray[np.intp]) -> None:
        """Note that a case begins with a step, the last one of `steps` (4, n, 2), and locate its beginning."""
        (old, new), mid = contacts, self._settings.midpoint
        closes, other = [], []
        for contact in np.flatnonzero(old != new).tolist():
            normal, friction, speed, gap = steps[..., contact]
            if old[contact] == _N:
                closes.append(_vanishes(gap[:-1], mid, (-1.0, 0.01)))
            elif new[contact] == _N:
                other.append(_vanishes(normal[:-1], mid, (mid - 1, mid)))
            elif old[contact] == _S:
                k = len(speed) - 1
                while k > 3 and speed[k - 1] < _SLIDES * (speed[k - 2] - speed[k - 1]):
                    k -= 1
                other.append(k - len(speed) + 1 + _vanishes(speed[:k], 0.0, (-1.0, len(speed) - k + 2.0)))
            else:
                limit = self._coefficients[run, contact] * np.maximum(normal, 1e-300)
                free = 1 - _SATURATED - friction / limit
                k = len(free) - 1
                while len(free) - k < _BACK and k > 1 and free[k - 1] <= 0:
                    k -= 1
                other.append(k - len(free) + 1 + _vanishes(free[:k], mid, (mid - 1, mid)))
        earliest = self._changes[run][-1][1] if self._changes[run] else 0.0
        time = max(earliest, (step + (min(closes) if closes else max(other))) * self._settings.timestep)
        self._changes[run].append((step, time, int(_CODES[tuple(old)]), int(_CODES[tuple(new)])))

    def cases(self, run: int, steps: npt.NDArray[np.int_]) -> npt.NDArray[np.int8]:
        """The case of a run in some steps, those not yet decided as the last one that is."""
        first = np.array([step for step, *_ in self._changes[run]], dtype=int)
        codes = np.array([self._begin[run], *(after for *_, after in self._changes[run])], dtype=np.int8)
        return codes[np.searchsorted(first, steps, side="right")]

    def events(self, run: int, until: float = math.inf) -> Events:
        """Changes of case of a run so far, up to a time in s."""
        changes = [change for change in self._changes[run] if change[1] <= until]
        if not changes:
            return Events()
        _, time, before, after = (np.array(column) for column in zip(*changes, strict=True))
        none, codes = np.zeros((len(time), 3)), {"from_case": before.astype(np.int8), "to_case": after.astype(np.int8)}
        return Events(time=time, **codes, impulse_A=none, impulse_B=none)

    def state(self) -> dict[str, npt.NDArray[Any]]:
        """Copies of all that is carried from one call to the next."""
        changes = [(run, *change) for run, own in enumerate(self._changes) for change in own]
        counts = np.array([self.decided, self._waiting])
        kept = {name: getattr(self, name).copy() for name in _CARRIED}
        return kept | {"counts": counts, "changes": np.array(changes).reshape(-1, 5)}

    def restore(self, state: dict[str, npt.NDArray[Any]]) -> None:
        """Go on from such a state."""
        for name in _CARRIED:
            setattr(self, name, state[name])
        self.decided, self._waiting = state["counts"].tolist()
        for run, step, time, before, after in state["changes"].tolist():
            self._changes[int(run)].append((int(step), time, int(before), int(after)))


def _vanishes(values: Array, ahead: float, within: tuple[float, float]) -> float:
    """Where the parabola through the last three values of successive steps vanishes, in steps after the next one.

    A value is that of so many steps `ahead` of the beginning of its step. The result is the nearest root `within` an
    interval, or else the end of it nearest to a root.
    """
    if len(values) < 3 or not np.isfinite(values[-3:]).all():
        return within[0]
    a, b, c = values[-3:].tolist()
    roots = np.roots([(a - 2 * b + c) / 2, (a - 4 * b + 3 * c) / 2, c]).real + ahead - 1  # in steps after the last
    inside = np.clip(roots, *within)
    return float(inside[np.abs(inside - roots).argmin()]) if len(roots) else within[0]
