"""Which kinematic case is it, and when does it change? Detected step by step from slip speed and
force.

A contact is open where it carries no force. A closed one slips where it uses the whole of the
friction and moves faster than a dead band; it rolls where either is clearly not so; in between it
keeps its state. A state counts only if it lasts for `PERSISTENCE` steps: single steps of a contact
that hovers or rebounds change nothing.

Events are located between steps: a contact closes where the parabola through its last three gaps
vanishes, opens where that through its normal forces does, and sticks where that through its slip
speeds does; it slips where that through the share of the friction in use reaches one. Where that
isn't within the step of the change, it is the nearer end of it."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from model import Case, Contact, Events, Parameters
from model.arrays import Array

PERSISTENCE = 3
"""Steps a contact must stay in a state for it to count."""

_CONTACTS = (Contact.R, Contact.S, Contact.N)
_R, _S, _N, _AS_BEFORE = range(4)
_SATURATED, _FREE = 1e-6, 1e-4
"""How far from its Coulomb value friction may be for slipping, and must be for rolling,
relative."""
_ROUND_OFF = 1e-9
"""Normal force, in weights, up to which a contact is open: what a solver leaves of none."""
_SLIDES = 3.0
"""A sliding contact is faster than so many times the change of its speed in a step: ending slip
changes faster."""
_SHARED = 10.0
"""A contact that creeps no faster than so many times as another one that holds doesn't slip by
itself."""
_BACK = 16
"""Steps that are kept to locate a change: how long a slip that sets in may take to leave the dead
band."""


class ContactHistory(NamedTuple):
    """What the contacts A and B do in successive steps: arrays (steps, 2)."""

    normal: Array
    """Normal force, N; 0 where the contact is open."""
    friction: Array
    """N"""
    speed: Array
    """Of slip, at the beginning of the step, m s-1."""
    gap: Array
    """m; so many steps after its beginning as forces are."""


class Classifier:
    """The cases of a run; steps too recent to judge wait for the next ones.

    Parameters
    ----------
    timestep : s
    midpoint : where in a step forces are found, in steps after its beginning
    dead_band : slip speeds, m s-1, below which contacts roll, of their friction forces divided by
        the mass, m s-2"""

    def __init__(
        self,
        p: Parameters,
        timestep: float,
        midpoint: float,
        dead_band: Callable[[npt.ArrayLike], Array],
    ) -> None:
        self._p, self._timestep, self._midpoint, self._dead_band = p, timestep, midpoint, dead_band
        self._coefficients = np.array([p.mu, p.eta])
        self.decided = 0
        """How many steps are."""
        self._waiting = 0
        """How many are not."""
        self._latest = np.empty((len(ContactHistory._fields) + 1, 0, 2))
        """The last steps, decided or not, and the state of the contacts in each of them judged
        alone."""
        self._changes: list[tuple[int, float, int, int]] = []
        """The first step of a new case, when it began in s, the case before and the new one; from
        the first case on."""

    def add(self, contacts: ContactHistory, last: bool = False) -> None:
        """Take in the next steps; with `last` all are decided, since no more will come."""
        first = self._latest.shape[1] - self._waiting
        steps = np.concatenate([self._latest, [*contacts, self._judge(contacts)]], axis=1)
        shown = steps[-1]
        # between the bands a contact is what it was
        shown[:] = _carried_on(shown, shown != _AS_BEFORE)
        shown[shown == _AS_BEFORE] = _R
        stop = max(first, len(shown) - (0 if last else PERSISTENCE - 1))
        if stop > first:
            states = self._lasting(shown[first:])[: stop - first + 1]
            changes = states[1:] != states[:-1]
            for k in np.flatnonzero(changes[:, 0] | changes[:, 1]).tolist():
                self._note(self.decided + k, steps[:-1, : first + k + 1], states[k], states[k + 1])
        self.decided += stop - first
        self._waiting, self._latest = len(shown) - stop, steps[:, max(0, stop - _BACK) :].copy()

    def _judge(self, contacts: ContactHistory) -> npt.NDArray[np.int_]:
        """States of the contacts (rolling, slipping, open) by each step alone, (steps, 2)."""
        normal, friction, speed, _ = contacts
        limit = self._coefficients * normal
        closed = normal > _ROUND_OFF * self._p.m * self._p.g
        # A friction force of which one step can build up only a part leaves, while it changes
        # slowly, a creep far below the speed that belongs to all of it.
        load = self._coefficients * np.maximum(normal / self._p.m, self._p.g)
        band = self._dead_band(load)
        saturated = friction >= (1 - _SATURATED) * limit
        # A rotation that slips at both contacts alike while one of them holds is creep, too: the
        # load moves from one to the other, as it may where both roll, and slip would be stopped by
        # the one that holds.
        held = (closed & ~saturated)[..., ::-1] & (speed < _SHARED * speed[..., ::-1])
        slips = saturated & (speed > 3 * band) & ~held
        rolls = (friction < (1 - _FREE) * limit) | (speed < band) | held
        return np.select([~closed, slips, rolls], [_N, _S, _R], _AS_BEFORE)

    def _lasting(self, shown: Array) -> Array:
        """The states of the contacts that last, (steps + 1, 2): before these steps, and in each of
        them."""
        more = min(PERSISTENCE, len(shown)) - 1
        seen = len(shown) - more
        lasts = np.zeros(shown.shape, dtype=bool)
        lasts[:seen] = True
        for k in range(1, more + 1):
            lasts[:seen] &= shown[k : k + seen] == shown[:seen]
        if not self._changes:  # the first that lasts, or the first of all
            begin = _case_number(shown[lasts.argmax(axis=0), [0, 1]])
            self._changes.append((0, 0.0, begin, begin))
        now = divmod(self._changes[-1][-1], len(_CONTACTS))
        return _carried_on(np.vstack([now, shown]), np.vstack([[True, True], lasts]))

    def _note(self, step: int, steps: Array, old: Array, new: Array) -> None:
        """Note that a case begins with a step, the last one of `steps` (4, n, 2), and locate its
        beginning."""
        mid = self._midpoint
        closes, other = list[float](), list[float]()
        for contact in np.flatnonzero(old != new).tolist():
            normal, friction, speed, gap = steps[..., contact]
            k = last = len(gap) - 1
            values, ahead, within = normal, mid, (mid - 1, mid)
            if old[contact] == _N:
                values, within = gap, (-1.0, 0.01)
            elif old[contact] == _S and new[contact] == _R:
                while k > 3 and speed[k - 1] < _SLIDES * (speed[k - 2] - speed[k - 1]):
                    k -= 1
                values, ahead, within = speed, 0.0, (-1.0, last - k + 3.0)
            elif new[contact] == _S:
                values = (
                    1
                    - _SATURATED
                    - friction / (self._coefficients[contact] * np.maximum(normal, 1e-300))
                )
                while last - k < _BACK - 1 and k > 1 and values[k - 1] <= 0:
                    k -= 1
            found = k - last + _vanishes(values[:k], ahead, within)
            (closes if old[contact] == _N else other).append(found)
        located = (step + (min(closes) if closes else max(other))) * self._timestep
        self._changes.append(
            (step, max(self._changes[-1][1], located), _case_number(old), _case_number(new))
        )

    def cases(self, steps: npt.NDArray[np.int_]) -> npt.NDArray[np.int8]:
        """Numbers of the cases in these steps; steps not yet decided get the case of the last
        decided one."""
        first, codes = [step for step, *_ in self._changes], [code for *_, code in self._changes]
        return np.array(codes, dtype=np.int8)[np.searchsorted(first, steps, side="right") - 1]

    def events(self, until: float = math.inf) -> Events:
        """Changes of case so far, up to a time in s."""
        changes = [change for change in self._changes[1:] if change[1] <= until]
        _, time, before, after = np.array(changes).reshape(-1, 4).T
        none = np.zeros((len(time), 3))
        codes = {"from_case": before.astype(np.int8), "to_case": after.astype(np.int8)}
        return Events(time=time, **codes, impulse_A=none, impulse_B=none)


def _case_number(states: Array) -> int:
    """Number of the case in which the contacts A and B are in such states."""
    return Case.of(*(_CONTACTS[int(state)] for state in states)).value


def _carried_on(states: Array, known: npt.NDArray[np.bool_]) -> Array:
    """States (steps, 2), each that isn't known replaced by the last one before it that is."""
    latest = np.maximum.accumulate(np.where(known, np.arange(len(states))[:, None], 0), axis=0)
    return np.take_along_axis(states, latest, axis=0)


def _vanishes(values: Array, ahead: float, within: tuple[float, float]) -> float:
    """Where the parabola through the last three values of successive steps vanishes, in steps after
    the next one.

    A value is that of so many steps `ahead` of the beginning of its step. The result is the nearest
    root `within` an interval, or else the end of it nearest to a root."""
    if len(values) < 3 or not np.isfinite(values[-3:]).all():
        return within[0]
    a, b, c = values[-3:].tolist()
    # in steps after the last
    roots = np.roots([(a - 2 * b + c) / 2, (a - 4 * b + 3 * c) / 2, c]).real + ahead - 1
    inside = np.clip(roots, *within)
    return float(inside[np.abs(inside - roots).argmin()]) if len(roots) else within[0]
