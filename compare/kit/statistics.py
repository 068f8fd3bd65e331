"""Numbers with uncertainties from sampled runs: window means and peaks; and numbers as JSON holds them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields, is_dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from model import Case, InputError, Trajectory
from model.arrays import Array

COVERAGE = 3.0
"""Standard uncertainties in a tolerance."""


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


def window_mean(time: npt.ArrayLike, values: npt.ArrayLike) -> Measured:
    """Mean of samples (n,) at equally spaced times (n,) of a run that has settled or nearly so.

    Three causes of uncertainty are added in quadrature: scatter, with the number of independent samples from the
    autocorrelation; the rest of an exponential approach, from the means of three thirds (Aitken); and the rounding
    of the samples themselves. Raises `InputError` for fewer than 6 samples or values that are not finite.
    """
    t, v = np.asarray(time, dtype=float), np.asarray(values, dtype=float)
    if t.shape != v.shape or t.ndim != 1 or len(v) < 6:
        raise InputError(f"a window mean needs two equal rows of 6 samples or more, not shapes {t.shape} and {v.shape}")
    if not np.all(np.isfinite(v)):
        raise InputError("a window mean needs finite samples")
    scatter = float(v.std(ddof=1)) / math.sqrt(len(v) / correlation_length(v))
    first, second, third = (float(part.mean()) for part in np.array_split(v, 3))
    ratio = abs(third - second) / abs(second - first) if second != first else 0.0
    # Thirds that come together by less than a twentieth say only that nothing has settled.
    approach = abs(third - first) / 2 + abs(third - second) * ratio / (1 - min(ratio, 0.95))
    rounding = float(np.finfo(float).eps * np.abs(v).max())
    return Measured(float(v.mean()), math.sqrt(scatter**2 + approach**2 + rounding**2))


def correlation_length(values: Array) -> float:
    """Samples per independent sample, 1 + 2 sum rho_k >= 1, summed while pairs of rho_k are positive (Geyer 1992)."""
    v = values - values.mean()
    variance = float(v @ v)
    if variance <= (np.finfo(float).eps * np.abs(values).max()) ** 2 * len(v):
        return 1.0
    spectrum = np.abs(np.fft.rfft(v, 2 * len(v))) ** 2
    rho = np.fft.irfft(spectrum)[: len(v)] / variance
    pairs = rho[: len(rho) // 2 * 2].reshape(-1, 2).sum(axis=1)
    last = int(np.argmax(pairs <= 0)) if np.any(pairs <= 0) else len(pairs)
    return float(min(max(1.0, 2 * pairs[:last].sum() - 1), len(v)))


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
