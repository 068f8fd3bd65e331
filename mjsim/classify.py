"""Which kinematic case is it? Detected from slip speed and force over several samples, with hysteresis.

A contact is open where it carries no force. A closed one slips where it uses the whole of the friction and moves faster
than a dead band; it rolls where either is clearly not so; in between it keeps its state. A state counts only if it
lasts for `PERSISTENCE` samples: single samples of a contact that hovers or rebounds change nothing.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np
import numpy.typing as npt

from model import Case, Contact, Events, Parameters
from model.arrays import Array
from model.trajectory import SAMPLE

PERSISTENCE = 3
"""Samples a contact must stay in a state for it to count."""

_CONTACTS = (Contact.R, Contact.S, Contact.N)
_R, _S, _N, _AS_BEFORE, _UNKNOWN = range(5)
_CODES = np.array([[Case.of(A, B) for B in _CONTACTS] for A in _CONTACTS], dtype=np.int8)
_SATURATED, _FREE = 1e-6, 1e-4
"""How far from its Coulomb value friction may be for slipping, and must be for rolling, relative."""


class Regularised(Protocol):
    """What the classifier needs of an engine's settings."""

    @property
    def memory(self) -> bool:
        """Whether friction that the engine regularises is corrected for."""

    def regularisation_speed(self, load: npt.ArrayLike) -> Array:
        """Slip speed, m s-1, up to which friction is less than Coulomb's, for the latter over mass in m s-2."""


class Classifier:
    """Classifies one run, block by block; samples too recent to judge wait for the next block."""

    def __init__(self, p: Parameters, settings: Regularised) -> None:
        self._p, self._settings = p, settings
        self._samples = np.empty(0, SAMPLE)
        self._waiting = np.empty((2, 0), dtype=np.intp)
        """Samples that wait, and the state of A and B in each of them judged alone."""
        self._shown, self._states = np.array([_R, _R]), np.array([_UNKNOWN, _UNKNOWN])
        """Their state in the newest sample judged alone, and in the newest one that is decided."""
        self._changes: list[tuple[float, int, int]] = []

    def add(self, block: npt.NDArray[np.void], last: bool) -> npt.NDArray[np.void]:
        """Take in the next samples, dtype `model.trajectory.SAMPLE`; return those that are decided, with their case.

        With `last` all are, since no more will come.
        """
        contacts = np.concatenate([self._waiting, self._shown_by(block)], axis=1)
        samples = np.concatenate([self._samples, block])
        A, B = (_lasting(own, int(state), last) for own, state in zip(contacts, self._states, strict=True))
        count = min(len(A), len(B))
        if count:
            samples["case"][:count] = _CODES[A[:count], B[:count]]
            time, case = samples["time"], samples["case"][:count].astype(int)
            before = case[0] if self._states[0] == _UNKNOWN else _CODES[tuple(self._states)]
            for k in np.flatnonzero(np.diff(case, prepend=before)):
                self._changes.append((float(time[k]), int(case[k - 1] if k else before), int(case[k])))
            self._states = np.array([A[count - 1], B[count - 1]])
        self._samples, self._waiting = samples[count:], contacts[:, count:]
        return samples[:count]

    def _shown_by(self, block: npt.NDArray[np.void]) -> npt.NDArray[np.intp]:
        """State of A and B in samples judged alone, (2, n); between the bands that of the sample before."""
        A, B = block["force_A"], block["force_B"]
        normal = np.stack([A[:, 1], B[:, 0]])
        friction = np.stack([np.hypot(A[:, 0], A[:, 2]), np.hypot(B[:, 1], B[:, 2])])
        contacts = self._judge(normal, friction, np.stack([block["slip_speed_A"], block["slip_speed_B"]]))
        contacts = np.concatenate([self._shown[:, None], contacts], axis=1)
        known = np.maximum.accumulate(np.where(contacts == _AS_BEFORE, 0, np.arange(contacts.shape[1])), axis=1)
        contacts = np.take_along_axis(contacts, known, axis=1)
        self._shown = contacts[:, -1]
        return contacts[:, 1:]

    def _judge(self, normal: Array, friction: Array, speed: Array) -> npt.NDArray[np.intp]:
        """What each sample by itself says of the contacts; all arrays of shape (2, n), in the order A, B."""
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
        contacts: npt.NDArray[np.intp] = np.select([normal <= 0, slips, rolls], [_N, _S, _R], _AS_BEFORE)
        return contacts

    @property
    def events(self) -> Events:
        """Changes of case so far, timed at the first sample of the new case."""
        if not self._changes:
            return Events()
        time, before, after = (np.array(column) for column in zip(*self._changes, strict=True))
        none, codes = np.zeros((len(time), 3)), {"from_case": before.astype(np.int8), "to_case": after.astype(np.int8)}
        return Events(time=time, **codes, impulse_A=none, impulse_B=none)


def _lasting(contacts: npt.NDArray[np.intp], state: int, last: bool) -> npt.NDArray[np.intp]:
    """State of a contact in each sample; one that doesn't last is replaced by the state before.

    An unknown state is replaced by the first one. All samples are decided if they are the `last`, else those that later
    samples can't change.
    """
    if len(contacts) == 0:
        return contacts
    starts = np.flatnonzero(np.diff(contacts, prepend=-1))
    lengths, values = np.diff(starts, append=len(contacts)), contacts[starts]
    lasts = (lengths >= PERSISTENCE) | (values == state)
    if state == _UNKNOWN:
        if not (lasts.any() or last):
            return contacts[:0]
        state = int(values[np.argmax(lasts)])  # the first that lasts, or the first of all
    latest = np.maximum.accumulate(np.where(lasts, np.arange(len(values)), -1))
    decided = np.repeat(np.where(latest < 0, state, values[latest]), lengths)
    return decided if last or lasts[-1] else decided[: starts[-1]]
