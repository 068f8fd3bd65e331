"""Assertions for one's own scene: does the ball settle and move as it should?

One's own motion: times and omega_c, as arrays, a CSV file, or any program's HDF5 file."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

import analytic
from analytic.stationary.solutions import time_constant
from compare.method.scales import rotation_scale
from model import Case, InputError, Parameters, StorageError, Trajectory, storage, table
from model.arrays import Array
from model.errors import check_type, suggestion
from model.hdf5 import dataset, reading
from model.parameters import POSITIVE, check_number
from model.trajectory import COMPONENTS, columns, component

__tracebackhide__ = True  # pytest shows the test that fails, and what is said of it
SETTLED_PART = 0.25
"""Last part of a motion, in which it has to have settled."""
FEWEST, SAMPLES = 10, 10_000_000
"""Samples below which nothing is judged, and most that are read of another program's file."""
UNITS: dict[str, str] = {
    name: columns(Trajectory)[column]["units"] for name, (column, _) in COMPONENTS.items()
}
"""Units of what a motion may have, by name: columns of a trajectory, components of forces."""
_COLUMNS = {
    name: (unit, [*(["t"] * (name == "time"))]) for name, unit in UNITS.items() if name != "case"
}


@dataclass(frozen=True, eq=False)
class Series:
    """A motion, whole or in part; raises `InputError` for what can't be one."""

    name: str
    time: Array
    """s, shape (n,)."""
    values: Mapping[str, Array]
    """Quantities by the names of `UNITS`, each (n,), SI units."""
    run: Trajectory | None = None
    """The trajectory that it is made of, if it was one."""

    def __post_init__(self) -> None:
        for name, values in {"time": self.time, **self.values}.items():
            if values.ndim != 1:
                raise InputError(f"{self.name}: {name} must be one column of numbers")
            if not len(values):
                raise InputError(f"{self.name} has no samples of {name}")
            if len(values) != self.time.size:
                raise InputError(
                    f"{self.name} needs {name} at each time, but has {self.time.size} times and "
                    f"{len(values)} values of {name}"
                )
            for k in np.flatnonzero(~np.isfinite(values))[:1]:
                raise InputError(
                    f"{self.name}: {name} is {values[k]} in sample {k}, at t = {self.time[k]:g} s"
                )
        for k in np.flatnonzero(np.diff(self.time) <= 0)[:1]:
            raise InputError(
                f"{self.name}: times must increase, but {self.time[k + 1]:g} s comes after "
                f"{self.time[k]:g} s"
            )

    def __getitem__(self, quantity: str) -> Array:
        """A quantity (n,); raises `InputError` for one that it doesn't have."""
        if quantity not in self.values:
            hint, known = suggestion(quantity, self.values), ", ".join(self.values)
            raise InputError(f"{self.name} has no {quantity}{hint}; it has {known}")
        return self.values[quantity]


Arrays = Mapping[str, npt.ArrayLike] | tuple[npt.ArrayLike, npt.ArrayLike]
Source = Series | Trajectory | str | Path | Arrays
"""A motion: what `read` takes."""


def read(source: Source, name: str = "") -> Series:
    """A motion from a trajectory, a file, arrays by name with ``time``, or (time, omega_c).

    Files are dualball's own, other HDF5 files with datasets of such names, or CSV with a head of
    such names; without one its columns are time and omega_c. `name` is what errors call it. Raises
    `InputError`."""
    if isinstance(source, Series):
        return source
    if isinstance(source, str | Path):
        name, path = name or str(source), Path(source)
        if path.suffix.lower() in (".csv", ".txt"):
            source, _ = table.read(path, _COLUMNS, ["time"], ("time", "omega_c"))
        else:
            source = _hdf5(path)
    run = source if isinstance(source, Trajectory) else None
    name = name or (run.header.engine if run else "the motion")
    given: dict[str, npt.ArrayLike]
    if isinstance(source, Trajectory):
        given = {quantity: component(source, quantity) for quantity in COMPONENTS}
    elif isinstance(source, Mapping):
        given = dict(source)
    else:
        try:
            given = dict(zip(("time", "omega_c"), source, strict=True))
        except (TypeError, ValueError) as error:
            raise InputError(
                f"{name} must be (time, omega_c), arrays by name, a file or a trajectory"
            ) from error
    given = {"time" if key == "t" else key: values for key, values in given.items()}
    try:
        known = {key: _column(key, given[key]) for key in given if key in UNITS}
    except InputError as error:
        raise InputError(f"{name}: {error}") from error
    if "time" not in known or not known.keys() & UNITS.keys() - {"time"}:
        raise InputError(
            f"{name} needs time and, say, omega_c; it has "
            f"{', '.join(given) or 'nothing of the kind'}"
        )
    return Series(name, known.pop("time"), known, run)


def _column(name: str, values: Any) -> Array:
    """The values of a quantity; `InputError` for no numbers, or another unit."""
    about = getattr(values, "attrs", {})  # of a data set of HDF5, and of an array of xarray
    for unit in [about[key] for key in ("units", "unit") if key in about][:1]:
        said = unit.decode("utf-8", "replace") if isinstance(unit, bytes) else str(unit)
        table.check_unit(name, name, said, UNITS[name])
    try:
        if not np.iscomplexobj(values):
            return np.asarray(values, float)
    except (TypeError, ValueError) as error:
        raise InputError(f"{name} must be a column of numbers") from error
    raise InputError(f"{name} must be a column of real numbers")


def _hdf5(path: Path) -> Trajectory | dict[str, Array]:
    """The trajectory in an HDF5 file, or the columns of a file that names no schema."""
    try:
        return storage.load(path)
    except StorageError as error:
        if not path.is_file():
            raise
        ours = error
    with reading(path, ours=False) as file:
        if "schema" not in file.attrs:
            names = [name for name in ("t", *UNITS) if file.get(name, getlink=True)]
            found = {name: dataset(file, name) for name in names}
            for name, stored in found.items():
                if stored.dtype.kind not in "fiu" or len(stored.shape or ()) != 1:
                    raise StorageError(f"{name!r} is no column of numbers")
                if len(stored) > SAMPLES:
                    most = f"{SAMPLES:g} are the most that are compared"
                    raise StorageError(f"{name!r} has {len(stored):g} samples, and {most}")
            return {n: _column("time" if n == "t" else n, stored) for n, stored in found.items()}
    raise ours


@dataclass(frozen=True)
class Difference:
    """How far two motions are apart in a quantity, in its SI unit."""

    quantity: str
    rms: float
    largest: float
    at: float
    """When it is largest, s."""
    scale: float
    """Largest absolute value in the second motion."""
    doubt: float
    """Rms of what interpolating may have added; 0 where both have samples at the same times."""


def common_times(a: Series, b: Series) -> Array:
    """Sample times (n,) of the sparser motion while both last; `InputError` below `FEWEST`."""
    begin, end = max(a.time[0], b.time[0]), min(a.time[-1], b.time[-1])
    times: Array = min((t[(begin <= t) & (t <= end)] for t in (a.time, b.time)), key=len)
    if len(times) < FEWEST:
        raise InputError(
            f"{a.name} and {b.name} have {len(times)} samples while both last; {FEWEST} are needed"
        )
    return times


def difference(a: Series, b: Series, quantity: str) -> Difference:
    """How far a is from b in a quantity at `common_times`; raises `InputError`."""
    times, rows, doubts = common_times(a, b), [], []
    for t, values in ((each.time, each[quantity]) for each in (a, b)):
        rows.append(np.interp(times, t, values))
        # Between every second sample linear interpolation is off by four times as much.
        coarser = np.interp(t[1::2], t[::2], values[::2]) - values[1::2]
        doubts.append(0.0 if np.isin(times, t).all() else _rms(coarser) / 4)
    off, scale = np.abs(rows[0] - rows[1]), float(np.abs(rows[1]).max())
    k = int(off.argmax())
    largest, at = float(off[k]), float(times[k])
    return Difference(quantity, _rms(off), largest, at, scale, math.hypot(*doubts))


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))


def assert_tracks(
    mine: Source, reference: Source, *, quantity: str = "omega_c", rms: float
) -> None:
    """Assert that a motion follows a reference; both are what `read` takes.

    The root mean square of the difference must not exceed `rms` of the largest value.

    Raises
    ------
    AssertionError
        If it does.
    InputError
        For fewer than `FEWEST` samples, a reference that ends earlier, samples too far apart
        to be interpolated."""
    check_number("rms", rms, "1", POSITIVE)
    a, b = read(mine), read(reference)
    off, unit = difference(a, b, quantity), UNITS[quantity]
    slack = (a.time[-1] - a.time[0]) / 100
    if b.time[-1] < a.time[-1] - slack or b.time[0] > a.time[0] + slack:
        spans = [f"from {each.time[0]:g} to {each.time[-1]:g} s" for each in (b, a)]
        raise InputError(f"the reference lasts {spans[0]}, but {a.name} {spans[1]}")
    if off.scale == 0:
        raise InputError(
            f"{quantity} of the reference {b.name} is zero all the time: there is no scale for an "
            f"error"
        )
    if off.doubt > rms * off.scale / 2:
        raise InputError(
            f"samples are too far apart: interpolating {quantity} may be off by {off.doubt:.1e} "
            f"{unit}, while rms = {rms:g} allows {rms * off.scale:.1e} {unit}"
        )
    assert off.rms <= rms * off.scale, (
        f"{quantity} of {a.name} does not track {b.name}: rms {off.rms / off.scale:.2e} > {rms:g} "
        f"of the largest value, {off.scale:.6g} {unit}; farthest off at t = {off.at:g} s, by "
        f"{off.largest:.3g} {unit}"
    )


def assert_settles(
    time: npt.ArrayLike,
    omega_c: npt.ArrayLike,
    p: Parameters,
    *,
    case: Case | str | None = None,
    rtol: float,
) -> None:
    """Assert that a ball settles in a stationary state: of a case, or in any but NS.

    In the last quarter of the motion omega_c must stay within `rtol`, relative, of the state's.
    That doesn't tell apart the states that go round with the fluid (RR, NR, NS).

    Parameters
    ----------
    time, omega_c : arrays, shape (n,), s and rad s-1; they may be parts of a longer motion.

    Raises
    ------
    AssertionError
        If it doesn't.
    InputError
        If there is no such state, or the motion is too short to judge: before its last
        quarter three of the slowest time constants must pass, or a ball that started in theory's
        state might not have left it yet. They are those of a disturbance of the state and of a ball
        that is taken along from rest, (1 + 2 j)/c with the c of its lag in the state, and no less
        than Stokes'."""
    check_number("rtol", rtol, "1", POSITIVE)
    check_type("p", p, Parameters)
    motion = read((time, omega_c))
    if isinstance(case, str) and case not in Case.__members__:
        raise InputError(f"there is no case {case!r}; there are {', '.join(Case.__members__)}")
    lasting = analytic.stable_solutions(p, sinking=True) if p.c else []
    states = [s for s in lasting if not s.moves]
    if case is not None:
        states = [analytic.solution(p, Case[case] if isinstance(case, str) else case)]
    if not states or not p.c:
        raise InputError(
            f"at c = {p.c:g} s-1, omega_0 = {p.omega_0:g} rad s-1 there is no state to settle in"
        )
    if len(motion.time) < FEWEST:
        raise InputError(
            f"the motion is too short to judge: {len(motion.time)} samples, at least {FEWEST} are "
            f"needed"
        )
    t, w = (
        row[motion.time >= np.quantile(motion.time[[0, -1]], 1 - SETTLED_PART)]
        for row in (motion.time, motion["omega_c"])
    )
    state = min(states, key=lambda s: abs(s.state.omega_c - w.mean()))
    name, exact = state.case.name, state.state.omega_c
    slowest = time_constant(p, state)
    lasts, swing = float(motion.time[-1] - motion.time[0]), float(np.ptp(w))
    scale, off = abs(exact) or rotation_scale(p), np.abs(w - exact)
    still_moves = off.max() > rtol * scale < swing
    time_constants = max(3.0, -math.log(rtol)) if still_moves else 3.0
    needed = time_constants * slowest / (1 - SETTLED_PART)
    if lasts < needed:
        raise InputError(
            f"the motion is too short to judge: it lasts {lasts:.3g} s and should last "
            f"{needed:.3g} s, since to forget "
            f"its start takes the ball time constants of {slowest:.3g} s"
        )
    near = (s.case.name for s in lasting if np.all(np.abs(w - s.state.omega_c) <= rtol * scale))
    k = int(off.argmax())
    assert off[k] <= rtol * scale, (
        f"the ball does not settle in {name}: for the last {SETTLED_PART * lasts:.3g} s omega_c "
        f"should be within {rtol:g} of {exact:.8g} rad/s. It is off by {off[k] / scale:.2e} at t "
        f"= {t[k]:g} s (on average {w.mean():.8g} rad/s; it swings by {swing:.1e} rad/s)"
        + "".join(f"; it settles in {other}" for other in [*near][:1])
    )
