"""Sweeps: the parameter sets that axes span."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from model import InputError, Parameters
from model.arrays import Array
from model.parameters import Range, check_names, check_number, parse_number

MOST = 100_000  #: most runs of a sweep
FIELDS = {field.name: field.metadata["unit"] for field in Parameters.quantities()}
"""Units of the parameters."""


@dataclass(frozen=True)
class Axis:
    """A quantity and its values in order, or the two ends of its range."""

    name: str
    values: tuple[float, ...]
    between: bool = False  #: whether no more than the two ends were given

    @classmethod
    def parse(cls, text: str, units: Mapping[str, str] = FIELDS, kind: str = "parameter") -> Axis:
        """Read ``name=from:to:count``, ``name=from:to`` or ``name=a,b,c``; raises `InputError`."""
        name, _, rest = text.partition("=")
        check_names([name], list(units), kind)
        if ":" not in rest:
            parts = rest.split(",")
            values = tuple(parse_number(name, part, units[name]) for part in parts)
            if len(set(values)) < len(values):
                raise InputError(f"{name} = {rest} names a value twice")
            return cls(name, values)
        low, high, *count = rest.split(":")
        if len(count) > 1:
            raise InputError(f"{text!r} is no range: write {name}=from:to:count")
        first, last = (parse_number(name, end, units[name]) for end in (low, high))
        if first >= last:
            given = f"{name} = {first:g}:{last:g} {units[name]}"
            raise InputError(f"{given} is in the wrong order: a range runs from low to high")
        if not count:
            return cls(name, (first, last), between=True)
        points = parse_number(f"count of {name}", count[0], "points", Range(2, MOST, whole=True))
        return cls(name, tuple(np.linspace(first, last, int(points)).tolist()))

    @classmethod
    def several(cls, texts: Sequence[str]) -> list[Axis]:
        """Read several parameters as `parse` does; `InputError` for a name that comes twice."""
        axes = [cls.parse(text) for text in texts]
        names = [axis.name for axis in axes]
        for name in names:
            if names.count(name) > 1:
                raise InputError(f"{name} is given {names.count(name)} ranges: one is enough")
        return axes

    @property
    def points(self) -> tuple[float, ...]:
        """The values; raises `InputError` if only the ends of a range were given."""
        if self.between:
            ways = f"{self.name}=from:to:count or {self.name}=a,b,c"
            raise InputError(f"here {self.name} needs values: write {ways}")
        return self.values

    @property
    def ends(self) -> tuple[float, float]:
        """Lowest and highest value of the range; raises `InputError` if there is none."""
        if len(self.values) != 2:
            raise InputError(f"here {self.name} needs a range: write {self.name}=from:to")
        return self.values[0], self.values[1]


def check_size(axes: Sequence[Axis], unit: str) -> None:
    """`InputError` if axes span more than `MOST` points."""
    check_number("the grid", math.prod(len(axis.points) for axis in axes), unit, Range(1, MOST))


def grid(p: Parameters, axes: Sequence[Axis]) -> Iterator[Parameters]:
    """Every combination of the axes' values, the last axis fastest; `InputError` beyond `MOST`."""
    check_size(axes, "runs")
    for values in itertools.product(*(axis.points for axis in axes)):
        yield p.replace(**dict(zip((axis.name for axis in axes), values, strict=True)))


def random(p: Parameters, axes: Sequence[Axis], count: int, seed: int) -> Iterator[Parameters]:
    """`count` points that fill the box of the axes' ranges evenly."""
    check_number("random", count, "points", Range(1, MOST, whole=True))
    low, high = np.array([axis.ends for axis in axes]).T
    for row in (low + sobol(len(axes), count, seed) * (high - low)).tolist():
        yield p.replace(**dict(zip((axis.name for axis in axes), row, strict=True)))


def sobol(dimensions: int, count: int, seed: int) -> Array:
    """The first points (count, dimensions) of a scrambled Sobol sequence in the unit cube."""
    from scipy.stats import qmc  # slow to import

    sequence = qmc.Sobol(dimensions, rng=np.random.default_rng(seed))
    return np.asarray(sequence.random(2 ** math.ceil(math.log2(count)))[:count])
