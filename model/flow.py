"""The angular velocity omega_0 of the fluid as a function of time."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
import numpy.typing as npt

from model.arrays import Array
from model.errors import InputError
from model.parameters import NOT_NEGATIVE, POSITIVE, check_number


@dataclass(frozen=True, eq=False)
class Flow:
    """A piecewise linear omega_0(t), with jumps where a piece doesn't start where the last one ended.

    Piece k holds from ``start[k]`` on and is ``value[k] + slope[k] (t - start[k])``; before the first start its
    value holds. Make one with `steady`, `ramp`, `staircase` or `sampled`.
    """

    kind: str
    """How it was made, for display."""
    start: Array
    """Start times of the pieces, shape (n,), s, increasing."""
    value: Array
    """omega_0 at the starts, shape (n,), rad s-1."""
    slope: Array
    """Rate of change in the pieces, shape (n,), rad s-2."""

    def __call__(self, t: npt.ArrayLike) -> Array:
        """omega_0 in rad s-1 at times t in s, same shape."""
        t = np.asarray(t, dtype=float)
        k = np.maximum(np.searchsorted(self.start, t, side="right") - 1, 0)
        return np.asarray(self.value[k] + self.slope[k] * np.maximum(t - self.start[k], 0.0))

    @property
    def breakpoints(self) -> Array:
        """Times in s at which omega_0 or its slope jumps: an integrator should stop there."""
        return self.start[self.start > 0]

    @property
    def is_steady(self) -> bool:
        """Whether omega_0 never changes."""
        return len(self.start) == 1 and self.slope[0] == 0

    @classmethod
    def steady(cls, omega_0: float) -> Self:
        """Constant omega_0."""
        return cls._pieces("steady", [0.0], [omega_0], [0.0])

    @classmethod
    def ramp(cls, omega_start: float, omega_end: float, duration: float, t_start: float = 0.0) -> Self:
        """From omega_start to omega_end linearly within `duration` seconds from t_start, held on either side."""
        check_number("duration", duration, "s", POSITIVE)
        check_number("t_start", t_start, "s", NOT_NEGATIVE)
        return cls.sampled([t_start, t_start + duration], [omega_start, omega_end], kind="ramp")

    @classmethod
    def staircase(cls, levels: Sequence[float], hold: float) -> Self:
        """Each level in turn held for `hold` seconds, the last one from then on."""
        check_number("hold", hold, "s", POSITIVE)
        return cls._pieces("staircase", [hold * k for k in range(len(levels))], levels, [0.0] * len(levels))

    @classmethod
    def sampled(cls, times: Sequence[float], omega_0: Sequence[float], kind: str = "sampled") -> Self:
        """Linear interpolation between samples, held at both ends; times must increase."""
        if len(times) != len(omega_0):
            raise InputError(f"a sampled flow has {len(times)} times but {len(omega_0)} values of omega_0")
        cls._check(times, omega_0)
        t, value = np.asarray(times, dtype=float), np.asarray(omega_0, dtype=float)
        slope = np.append(np.diff(value) / np.diff(t), 0.0)
        return cls._pieces(kind, t, value, slope)

    @classmethod
    def _pieces(cls, kind: str, start: Iterable[float], value: Iterable[float], slope: Iterable[float]) -> Self:
        cls._check(start, value)
        return cls(kind, *(np.array(list(a), dtype=float) for a in (start, value, slope)))

    @staticmethod
    def _check(times: Iterable[float], values: Iterable[float]) -> None:
        t = [check_number(f"time of flow sample {k}", time, "s") for k, time in enumerate(times)]
        v = [check_number(f"omega_0 of flow sample {k}", value, "rad s-1") for k, value in enumerate(values)]
        if not v:
            raise InputError("a flow needs at least one value of omega_0")
        if np.any(np.diff(t) <= 0):
            k = int(np.argmax(np.diff(t) <= 0))
            raise InputError(f"flow times must increase, but sample {k + 1} is at {t[k + 1]:g} s after {t[k]:g} s")

    def to_mapping(self) -> dict[str, Any]:
        """A JSON-able description, exact."""
        pieces = {name: getattr(self, name).tolist() for name in ("start", "value", "slope")}
        return {"kind": self.kind} | pieces

    @classmethod
    def from_mapping(cls, values: Mapping[str, Any]) -> Self:
        """Inverse of `to_mapping`; raises `InputError` if it isn't one."""
        try:
            flow = cls._pieces(str(values["kind"]), values["start"], values["value"], values["slope"])
        except (KeyError, TypeError, ValueError) as error:
            raise InputError(f"not a flow: {error}") from error
        if not flow.start.shape == flow.value.shape == flow.slope.shape or not np.all(np.isfinite(flow.slope)):
            raise InputError("not a flow: start, value and slope must be finite and of one length")
        return flow
