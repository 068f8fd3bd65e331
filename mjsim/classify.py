"""Which kinematic case is it? Told from slip speed and force over several samples, with hysteresis.

A contact is open where it carries no force. A closed one slips where it uses the whole of the friction and moves faster
than a dead band; it rolls where either is clearly not so; in between it is what it was. A state counts only if it
lasts for `PERSISTENCE` samples: single samples of a contact that hovers or rebounds change nothing.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from mjsim.contact_settings import ContactSettings
from model import Case, Contact, Events, Parameters
from model.arrays import Array

PERSISTENCE = 3
"""Samples a contact must stay in a state for it to count."""

_LETTERS = (Contact.R, Contact.S, Contact.N)
_R, _S, _N, _AS_BEFORE = 0, 1, 2, 3
_CODES = np.array([[Case.of(A, B) for B in _LETTERS] for A in _LETTERS], dtype=np.int8)
_SATURATED, _FREE = 1e-6, 1e-4
"""How far from its Coulomb value friction may be for slipping, and must be for rolling, relative."""


class Classifier:
    """Classifies one run, block by block; samples too recent to judge wait for the next block."""

    def __init__(self, p: Parameters, settings: ContactSettings) -> None:
        self._p, self._settings = p, settings
        self._waiting: list[npt.NDArray[np.void]] = []
        self._A, self._B = _Persistent(), _Persistent()
        self._changes: list[tuple[float, int, int]] = []
        self._last: int | None = None

    def add(self, block: npt.NDArray[np.void], last: bool) -> npt.NDArray[np.void]:
        """Take in the next samples, dtype `model.trajectory.SAMPLE`; return those that are decided, with their case.

        With `last` all are, since no more will come.
        """
        if len(block):
            self._waiting.append(block)
        A, B = block["force_A"], block["force_B"]
        normal = np.stack([A[:, 1], B[:, 0]])
        friction = np.stack([np.hypot(A[:, 0], A[:, 2]), np.hypot(B[:, 1], B[:, 2])])
        letters = self._letters(normal, friction, np.stack([block["slip_speed_A"], block["slip_speed_B"]]))
        self._A.add(letters[0])
        self._B.add(letters[1])
        count = min(self._A.decide(last), self._B.decide(last))
        waiting = np.concatenate(self._waiting) if self._waiting else block
        done, self._waiting = waiting[:count], [waiting[count:]]
        done["case"] = _CODES[self._A.take(count), self._B.take(count)]
        self._note_changes(done)
        return done

    def _letters(self, normal: Array, friction: Array, speed: Array) -> npt.NDArray[np.intp]:
        """What each sample by itself says of the contacts; all arrays of shape (2, n), A before B."""
        p, settings = self._p, self._settings
        limit = np.array([[p.mu], [p.eta]]) * normal
        # A friction force of which one step can build up only a part leaves, while it changes slowly, a creep far
        # below the speed that belongs to all of it.
        load = np.array([[p.mu], [p.eta]]) * np.maximum(normal / p.m, p.g)
        band = settings.regularisation_speed(load) * (1e-3 if settings.memory else 3.0)
        saturated = friction >= (1 - _SATURATED) * limit
        # A rotation that slips at both contacts alike while one of them holds is creep, too: the load moves from one
        # to the other, as it may where both roll, and slip would be stopped by the one that holds.
        held = ((normal > 0) & ~saturated)[::-1] & (speed < 3 * speed[::-1])
        slips = saturated & (speed > 3 * band) & ~held
        rolls = (friction < (1 - _FREE) * limit) | (speed < band) | held
        letters: npt.NDArray[np.intp] = np.select([normal <= 0, slips, rolls], [_N, _S, _R], _AS_BEFORE)
        return letters

    def _note_changes(self, done: npt.NDArray[np.void]) -> None:
        case = done["case"].astype(int)
        if len(case) == 0:
            return
        before = np.concatenate([[case[0] if self._last is None else self._last], case[:-1]])
        for k in np.flatnonzero(before != case):
            self._changes.append((float(done["time"][k]), int(before[k]), int(case[k])))
        self._last = int(case[-1])

    @property
    def events(self) -> Events:
        """Changes of case so far, timed at the first sample of the new case."""
        if not self._changes:
            return Events()
        time, before, after = zip(*self._changes, strict=True)
        none = np.zeros((len(time), 3))
        return Events(
            time=np.array(time), from_case=np.array(before, np.int8), to_case=np.array(after, np.int8),
            impulse_A=none, impulse_B=none,
        )  # fmt: skip


class _Persistent:
    """Letters of one contact, where what doesn't last is replaced by what was before (or, at the start, comes next)."""

    def __init__(self) -> None:
        self._letters = np.empty(0, dtype=np.intp)
        self._decided = 0
        self._newest, self._state = _R, -1

    def add(self, letters: npt.NDArray[np.intp]) -> None:
        """Append letters; one that says "as before" becomes the one before."""
        known = np.maximum.accumulate(np.where(letters == _AS_BEFORE, -1, np.arange(len(letters))))
        letters = np.where(known < 0, self._newest, letters[known])
        self._newest = int(letters[-1]) if len(letters) else self._newest
        self._letters = np.concatenate([self._letters, letters])

    def decide(self, last: bool) -> int:
        """Replace what doesn't last; return how many letters, from the first, are final."""
        letters = self._letters
        bounds = self._decided + np.flatnonzero(np.diff(letters[self._decided :])) + 1
        starts, stops = [self._decided, *bounds.tolist()], [*bounds.tolist(), len(letters)]
        for start, stop in zip(starts, stops, strict=True):
            letter = int(letters[start]) if start < stop else self._state
            if stop - start >= PERSISTENCE:
                self._state = letter
            elif letter != self._state and stop == len(letters) and not last:
                break  # it may yet last
            elif self._state < 0:
                self._state = self._first(start, letter)
            letters[start:stop] = self._state
            self._decided = stop
        return self._decided

    def _first(self, start: int, otherwise: int) -> int:
        """The first letter from `start` on that lasts."""
        for k in range(start, len(self._letters) - PERSISTENCE + 1):
            if np.all(self._letters[k : k + PERSISTENCE] == self._letters[k]):
                return int(self._letters[k])
        return otherwise

    def take(self, count: int) -> npt.NDArray[np.intp]:
        """Hand out the first letters, which must be final."""
        taken, self._letters = self._letters[:count], self._letters[count:]
        self._decided -= count
        return taken
