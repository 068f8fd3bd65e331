"""Roots between bounds, element by element."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from model.arrays import Array, Real


def bisected(f: Callable[[Array], Real], start: npt.ArrayLike, end: npt.ArrayLike) -> Array:
    """Where f (arrays of any shape, element by element) changes sign between start and end, to the last digit.

    nan where it has one sign at both. Halving takes no longer than the root finders of scipy on these small problems,
    and loading those takes half a second.
    """
    low, high = np.asarray(start, dtype=float), np.asarray(end, dtype=float)
    rises = np.asarray(f(low)) < 0
    changes = (np.asarray(f(high)) < 0) != rises
    for _ in range(_HALVINGS):
        middle = (low + high) / 2
        if np.all((middle == low) | (middle == high)):
            break
        before = (np.asarray(f(middle)) < 0) == rises
        low, high = np.where(before, middle, low), np.where(before, high, middle)
    return np.where(changes, high, np.nan)


_HALVINGS = 200
"""More than enough for roots whose size is above 1e-44 of the interval."""


def rising(f: Callable[[Array], tuple[Array, Array]], start: Array, end: Array, guess: Array) -> Array:
    """Where f, given with its derivative, rises through zero on the way from start to end, to the last digits.

    By Newton's method from a guess, or halving where that leaves what is known to hold the root.
    """
    below, above, root = start, end, guess
    for _ in range(_HALVINGS):
        before, (value, slope) = root, f(root)
        below, above = np.where(value < 0, root, below), np.where(value < 0, above, root)
        root = root - value / np.where(slope == 0, np.inf, slope)
        root = np.where((root - below) * (root - above) <= 0, root, (below + above) / 2)
        if np.all(np.abs(root - before) <= 2 * math.ulp(1.0) * np.abs(before)):
            break
    return np.asarray(root)
