"""The angular velocity omega_0 of the fluid as a function of time."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Self

import numpy as np
import numpy.typing as npt

from model import table
from model.arrays import Array
from model.errors import InputError
from model.parameters import NOT_NEGATIVE, POSITIVE, REACH, Range, check_number

GAP = 10.0
"""An interval this many times the usual one (the median) is a gap in a measured flow: it wasn't
measured there. A few samples lost, or knots written by hand at uneven times, stay below it."""
_COLUMNS = {"time": ("s", ["t"]), "omega_0": ("rad s-1", ["omega0", "omega", "ω₀", "ω_0"])}
"""Of a measured flow: units, and other names."""


@dataclass(frozen=True, eq=False)
class Flow:
    """The flow omega_0(t): piecewise linear, with jumps between pieces, plus sine waves.

    Piece k holds from ``start[k]`` on and is ``value[k] + slope[k] (t - start[k])``; before the
    first start its value holds. Make one with `steady`, `ramp`, `staircase`, `sampled`, `sine`,
    `sines` or `from_csv`."""

    kind: str
    """How it was made, for display."""
    start: Array
    """Start times of the pieces, shape (n,), s, increasing."""
    value: Array
    """omega_0 at the starts, shape (n,), rad s-1."""
    slope: Array
    """Rate of change in the pieces, shape (n,), rad s-2."""
    waves: Array = field(default_factory=lambda: np.empty((0, 3)))
    """Waves amplitude sin(2 pi frequency t + phase) as rows of amplitude in rad s-1, frequency > 0
    in Hz and phase in rad, shape (k, 3)."""

    def __call__(self, t: npt.ArrayLike) -> Array:
        """omega_0 in rad s-1 at times t in s, same shape."""
        line = self.line(t)
        if not len(self.waves):
            return line
        amplitude, frequency, phase = self.waves.T
        times = np.asarray(t, dtype=float)[..., None]
        return np.asarray(line + np.sin(2 * np.pi * frequency * times + phase) @ amplitude)

    def line(self, t: npt.ArrayLike) -> Array:
        """omega_0 in rad s-1 without the waves."""
        t = np.asarray(t, dtype=float)
        k = np.maximum(np.searchsorted(self.start, t, side="right") - 1, 0)
        return np.asarray(self.value[k] + self.slope[k] * np.maximum(t - self.start[k], 0.0))

    def knots(self, t_end: float) -> Array:
        """Times, s, in (0, t_end) at which omega_0 or its slope jumps: integrators stop there."""
        return self.start[(self.start > 0) & (self.start < t_end)]

    @property
    def is_steady(self) -> bool:
        """Whether omega_0 never changes."""
        return len(self.start) == 1 and self.slope[0] == 0 and not np.any(self.waves[:, 0])

    @classmethod
    def steady(cls, omega_0: float) -> Self:
        """Constant omega_0."""
        return cls._from_pieces("steady", [0.0], [omega_0], [0.0])

    @classmethod
    def ramp(
        cls, omega_start: float, omega_end: float, duration: float, t_start: float = 0.0
    ) -> Self:
        """From omega_start to omega_end linearly within `duration`, s, from t_start; else held."""
        check_number("duration", duration, "s", POSITIVE)
        check_number("t_start", t_start, "s", NOT_NEGATIVE)
        return cls.sampled([t_start, t_start + duration], [omega_start, omega_end], kind="ramp")

    @classmethod
    def staircase(cls, levels: Sequence[float], hold: float) -> Self:
        """Each level in turn held for `hold` seconds, the last one from then on."""
        check_number("hold", hold, "s", POSITIVE)
        starts = [hold * k for k in range(len(levels))]
        return cls._from_pieces("staircase", starts, levels, [0.0] * len(levels))

    @classmethod
    def sampled(
        cls, times: Sequence[float], omega_0: Sequence[float], kind: str = "sampled"
    ) -> Self:
        """Linear interpolation between samples, held at both ends; times must increase."""
        if len(times) != len(omega_0):
            counts = f"{len(times)} times but {len(omega_0)} values of omega_0"
            raise InputError(f"a sampled flow has {counts}")
        level = cls._from_pieces(kind, times, omega_0, [0.0] * len(times))
        return replace(level, slope=np.append(np.diff(level.value) / np.diff(level.start), 0.0))

    @classmethod
    def sine(cls, mean: float, amplitude: float, frequency: float, phase: float = 0.0) -> Self:
        """mean + amplitude sin(2 pi frequency t + phase); rad s-1, Hz, rad."""
        return cls.sines(mean, [(amplitude, frequency, phase)])

    @classmethod
    def sines(cls, mean: float, waves: Iterable[tuple[float, float, float]]) -> Self:
        """The sum of a mean and waves (amplitude, frequency, phase) as in `sine`."""
        flow = cls._from_pieces("sines", [0.0], [mean], [0.0])
        frequencies, given = Range(0.0, REACH.high, open=True), list(waves)
        if any(np.shape(wave) != (3,) for wave in given):
            raise InputError("each wave needs an amplitude, a frequency and a phase")
        rows = [
            (
                check_number(f"amplitude of wave {k}", amplitude, "rad s-1", REACH),
                check_number(f"frequency of wave {k}", frequency, "Hz", frequencies),
                check_number(f"phase of wave {k}", phase, "rad"),
            )
            for k, (amplitude, frequency, phase) in enumerate(given)
        ]
        return replace(flow, waves=np.array(rows).reshape(-1, 3))

    @classmethod
    def from_csv(cls, path: str | Path, longest_interval: float | None = None) -> Self:
        """A measured flow: lines of time in s and omega_0 in rad s-1, linear in between.

        Commas, semicolons or white space separate the two; numbers may have decimal commas between
        semicolons or tabs. A first line without numbers is the head: columns are found by their
        names in it, and may be more and in any order; a unit in it must be that. What follows a #
        is a comment. Over more than `longest_interval`, in s, nothing is interpolated; `GAP` times
        the median interval if None. Raises `StorageError` for a file that can't be read,
        `InputError` that names the line where a field is missing or not a finite number, where
        times don't increase, or after a gap."""
        found, lines = table.read(path, _COLUMNS, list(_COLUMNS), ("time", "omega_0"))
        times, values = found["time"], found["omega_0"]
        if not times:
            raise InputError(f"{path} has no line with a time and a value of omega_0")
        for k in np.flatnonzero(np.diff(times) <= 0)[:1]:
            raise InputError(
                f"{path}, line {lines[k + 1]}: times must increase, but {times[k + 1]:g} s comes "
                f"after {times[k]:g} s"
            )
        if len(times) > 1:
            intervals = np.diff(times)
            usual = float(np.median(intervals))
            longest = GAP * usual if longest_interval is None else longest_interval
            check_number("longest_interval", longest, "s", POSITIVE)
            for k in np.flatnonzero(intervals > longest)[:1]:
                raise InputError(
                    f"{path}, line {lines[k + 1]}: a gap of {intervals[k]:g} s from t = "
                    f"{times[k]:g} s on; usual are {usual:g} s, and longest_interval = "
                    f"{longest:g} s"
                )
        return cls.sampled(times, values, kind="measured")

    @classmethod
    def _from_pieces(
        cls, kind: str, start: Iterable[float], value: Iterable[float], slope: Iterable[float]
    ) -> Self:
        """A flow that is linear from each start on; `InputError` for wrong values or times."""
        at = "of flow sample"
        t = [check_number(f"time {at} {k}", each, "s", REACH) for k, each in enumerate(start)]
        v = [check_number(f"omega_0 {at} {k}", w, "rad s-1", REACH) for k, w in enumerate(value)]
        if not v:
            raise InputError("a flow needs at least one value of omega_0")
        for k in np.flatnonzero(np.diff(t) <= 0)[:1]:
            after = f"sample {k + 1} is at {t[k + 1]:g} s after {t[k]:g} s"
            raise InputError(f"flow times must increase, but {after}")
        return cls(kind, np.array(t), np.array(v), np.array(list(slope), dtype=float))

    def to_mapping(self) -> dict[str, Any]:
        """A JSON-able description, exact."""
        names = ("start", "value", "slope", "waves")
        return {"kind": self.kind} | {name: getattr(self, name).tolist() for name in names}

    @classmethod
    def from_mapping(cls, values: Mapping[str, Any]) -> Self:
        """Inverse of `to_mapping`; raises `InputError` if it isn't one."""
        try:
            pieces = (values[name] for name in ("start", "value", "slope"))
            flow = cls._from_pieces(str(values["kind"]), *pieces)
            flow = replace(flow, waves=cls.sines(0.0, values["waves"]).waves)
        except (KeyError, TypeError, ValueError) as error:
            raise InputError(f"not a flow: {error}") from error
        alike = flow.start.shape == flow.value.shape == flow.slope.shape
        if not alike or not np.all(np.isfinite(flow.slope)):
            raise InputError("not a flow: start, value and slope must be finite and of one length")
        return flow
