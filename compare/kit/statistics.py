"""Numbers with uncertainties from sampled runs: window means and peaks; and numbers as JSON holds them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields, is_dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from model import Case, Trajectory
from model.arrays import Array

COVERAGE = 3.0
"""Standard uncertainties in a tolerance."""
TAPER = 8
"""Exponent of the sine that the window is: m periods within it leave about (TAPER/2)!^2/(pi m^(TAPER+1)) of one."""


@dataclass(frozen=True)
class Measured:
    """A value and its standard uncertainty."""

    value: float
    uncertainty: float


def plain(value: Any) -> Any:
    """Nested data as JSON holds it: dataclasses as mappings, arrays as lists, a case by its name, complex as a pair.

    Of numbers that are not finite None is left.
    """
    if is_dataclass(value):
        value = {each.name: getattr(value, each.name) for each in fields(value)}
    if isinstance(value, Mapping):
        return {name: plain(part) for name, part in value.items()}
    if isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
    if isinstance(value, complex):
        value = value.real, value.imag
    if isinstance(value, list | tuple):
        return [plain(part) for part in value]
    if isinstance(value, Case):
        return value.name
    return None if isinstance(value, float) and not math.isfinite(value) else value


def taper(length: int) -> Array:
    """The tapered window (n,)."""
    return np.asarray(np.sin(np.pi * (np.arange(length) + 0.5) / length) ** TAPER)


def steady_mean(values: Array, length: int) -> tuple[Array, Array]:
    """Mean of rows (k, n) over their last `length` samples, tapered, and how far it may be from its limit; both (k,).

    From three windows, each a quarter of its length later than the one before: what is left of an approach by a
    constant ratio, plus the last change itself.
    """
    weights = taper(length)
    weights /= weights.sum()
    n, shift = values.shape[1], length // 4
    first, second, last = (values[:, n - length - k * shift : n - k * shift] @ weights for k in (2, 1, 0))
    before, after = np.abs(second - first), np.abs(last - second)
    ratio = np.minimum(np.divide(after, before, out=np.zeros_like(after), where=before > 0), 0.9)
    return last, after / (1 - ratio)


def tail(run: Trajectory, share: float = 0.1) -> slice:
    """The samples of the last part of a run."""
    return slice(int((1 - share) * len(run.time)), None)


def settled_case(run: Trajectory) -> Case:
    """The case of most samples in the last part of a run."""
    return Case(int(np.bincount(run.case[tail(run)]).argmax()))


def peaks(values: Array) -> tuple[npt.NDArray[np.intp], Array]:
    """Local maxima of samples (n,): their indices, and how much later, in samples, the parabolas have their tops."""
    k = 1 + np.flatnonzero((values[1:-1] > values[:-2]) & (values[1:-1] >= values[2:]))
    before, at, after = values[k - 1], values[k], values[k + 1]
    return k, (before - after) / (2 * (before - 2 * at + after))


def top(values: Array, k: npt.NDArray[np.intp], late: Array) -> Array:
    """The heights of the parabolas that `peaks` puts through samples (n,)."""
    return np.asarray(values[k] + late * (values[k + 1] - values[k - 1]) / 4)


def hops(run: Trajectory, share: float = 1 / 3) -> bool:
    """Whether a ball hops on in the last part of a run: twice near the floor, and high above it in between.

    High is more than half as high as the highest sample, near less than a fifth: every tenth sample of a hop is so low.
    What stays below 1e-4 R doesn't hop.
    """
    late = run.y[tail(run, share)]
    highest = late.max()
    near = np.flatnonzero(late < highest / 5)
    if highest < 1e-4 * run.header.parameters.R or not len(near):
        return False
    return bool(late[near[0] : near[-1] + 1].max() > highest / 2)
