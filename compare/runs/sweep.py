"""Designs: which parameters to vary, and the tasks that follow."""

from __future__ import annotations

import dataclasses
import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from compare.runs.tasks import Task
from model import Flow, InputError, Parameters
from model.parameters import Range, check_names, check_number, parse_number

FIELDS = tuple(field.name for field in Parameters.quantities())
DIRECTIONS = ("held", "up", "down", "both")


@dataclass(frozen=True)
class Axis:
    """A parameter and its values in order, or the two ends of its range where values are drawn at random."""

    name: str
    values: tuple[float, ...]

    @classmethod
    def parse(cls, text: str) -> Axis:
        """Read ``name=from:to:count``, ``name=from:to`` or ``name=a,b,c``; raises `InputError`."""
        name, _, rest = text.partition("=")
        check_names([name], FIELDS, "parameter")
        unit = Parameters.__dataclass_fields__[name].metadata["unit"]
        if ":" not in rest:
            return cls(name, tuple(parse_number(name, part, unit) for part in rest.split(",")))
        low, high, *count = rest.split(":")
        if len(count) > 1:
            raise InputError(f"{text!r} is no range: write {name}=from:to:count")
        first, last = (parse_number(name, end, unit) for end in (low, high))
        if first >= last:
            raise InputError(
                f"{name} = {first:g}:{last:g} {unit} is in the wrong order: a range runs from low to high "
                "(to sweep downwards choose --direction down)"
            )
        if not count:
            return cls(name, (first, last))
        points = int(parse_number(f"count of {name}", count[0], "points", Range(2, whole=True)))
        return cls(name, tuple(np.linspace(first, last, points).tolist()))


def grid(p: Parameters, axes: Sequence[Axis]) -> Iterator[Parameters]:
    """Every combination of the axes' values, the last axis fastest."""
    for values in itertools.product(*(axis.values for axis in axes)):
        yield p.replace(**dict(zip((axis.name for axis in axes), values, strict=True)))


def random(p: Parameters, axes: Sequence[Axis], count: int, seed: int) -> Iterator[Parameters]:
    """`count` points that fill the box of the axes' ranges evenly (scrambled Sobol sequence)."""
    from scipy.stats import qmc  # slow to import, and only needed here

    check_number("random", count, "points", Range(1, whole=True))
    for axis in axes:
        if len(axis.values) != 2:
            raise InputError(f"a random design needs a range for {axis.name}: write {axis.name}=from:to")
    low, high = (np.array(end) for end in zip(*(axis.values for axis in axes), strict=True))
    unit = qmc.Sobol(len(axes), rng=np.random.default_rng(seed)).random(2 ** math.ceil(math.log2(count)))
    for row in (low + unit[:count] * (high - low)).tolist():
        yield p.replace(**dict(zip((axis.name for axis in axes), row, strict=True)))


def levels(axes: Sequence[Axis], direction: str) -> list[float]:
    """omega_0 as one run visits it: up, down, or up and down again."""
    if len(axes) != 1 or axes[0].name != "omega_0":
        raise InputError(f"direction = {direction!r} sweeps omega_0 within one run: vary omega_0 and nothing else")
    up = sorted(axes[0].values)
    return {"up": up, "down": up[::-1], "both": up + up[-2::-1]}[direction]


def held(template: Task, points: Iterator[Parameters]) -> list[Task]:
    """A run of its own at every point."""
    return [dataclasses.replace(template, parameters=p) for p in points]


def staircase(template: Task, omegas: Sequence[float], hold: float) -> Task:
    """One run that holds each omega_0 for `hold` seconds."""
    p, flow = template.parameters.replace(omega_0=omegas[0]), Flow.staircase(omegas, hold)
    return dataclasses.replace(template, parameters=p, flow=flow, t_end=hold * len(omegas))
