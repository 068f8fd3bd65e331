"""Which kinematic case is it? Told from slip speed and force."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from mjsim.contact_settings import ContactSettings
from model import Case, Contact, Events, Parameters
from model.arrays import Array

_LETTERS = (Contact.R, Contact.S, Contact.N)
_CODES = np.array([[Case.of(A, B) for B in _LETTERS] for A in _LETTERS], dtype=np.int8)


def classify(block: npt.NDArray[np.void], p: Parameters, settings: ContactSettings) -> npt.NDArray[np.int8]:
    """Case codes, shape (n,), of samples of dtype `model.trajectory.SAMPLE`."""
    normal_A, friction_A = block["force_A"][:, 1], np.hypot(block["force_A"][:, 0], block["force_A"][:, 2])
    normal_B, friction_B = block["force_B"][:, 0], np.hypot(block["force_B"][:, 1], block["force_B"][:, 2])
    A = _contact(normal_A, friction_A, block["slip_speed_A"], p.mu, p, settings)
    B = _contact(normal_B, friction_B, block["slip_speed_B"], p.eta, p, settings)
    return _CODES[A, B]


def _contact(
    normal: Array, friction: Array, speed: Array, coefficient: float, p: Parameters, settings: ContactSettings
) -> npt.NDArray[np.intp]:
    """Index into `_LETTERS` for one contact: slipping takes both a speed beyond creep and the whole of the friction."""
    closed = normal > 0
    regular = settings.regularisation_speed(coefficient * np.maximum(normal / p.m, p.g))
    # With memory a force that changes little from step to step leaves no more than that share of the speed.
    fast = speed > regular * (1e-3 if settings.memory else 10)
    slips = fast & (friction >= (1 - 1e-6) * coefficient * normal)
    return np.where(closed, np.where(slips, 1, 0), 2)


class Changes:
    """Collects the changes of case of one run, block by block."""

    def __init__(self) -> None:
        self._last: int | None = None
        self._parts: list[tuple[Array, npt.NDArray[np.int8], npt.NDArray[np.int8]]] = []

    def add(self, block: npt.NDArray[np.void]) -> None:
        """Take in the next samples, with their cases."""
        case = block["case"]
        if len(case) == 0:
            return
        before = np.concatenate([[case[0] if self._last is None else self._last], case[:-1]]).astype(np.int8)
        at = before != case
        self._parts.append((block["time"][at], before[at], case[at]))
        self._last = int(case[-1])

    @property
    def events(self) -> Events:
        """What was found so far, timed at the first sample of the new case."""
        if not self._parts:
            return Events()
        time, before, after = (np.concatenate(column) for column in zip(*self._parts, strict=True))
        none = np.zeros((len(time), 3))
        return Events(time=time, from_case=before, to_case=after, impulse_A=none, impulse_B=none)
