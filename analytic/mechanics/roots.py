"""Roots between bounds, element by element."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from model.arrays import Array, Real

_MOST = 200
"""Steps: more than enough for roots whose size is above 1e-44 of the interval, by halving alone."""


def sign_change(f: Callable[[Array], Real], start: npt.ArrayLike, end: npt.ArrayLike) -> Array:
    """Where f changes sign between start and end, arrays of any shape, to the last digit.

    nan where it has one sign at both. By inverse quadratic interpolation where that can be trusted,
    else by halving (Chandrupatla, Adv. Eng. Software 28 (1997) 145); the root finders of scipy take
    half a second to load."""
    a, b = (x.astype(float) for x in np.broadcast_arrays(start, end))
    f_a, f_b = np.asarray(f(a)), np.asarray(f(b))
    changes, share = (f_a < 0) != (f_b < 0), np.full(a.shape, 0.5)
    with np.errstate(all="ignore"):  # where an interpolation fails, halving takes its place
        for _ in range(_MOST):
            x = a + share * (b - a)
            f_x = np.asarray(f(x))
            same = (f_x < 0) == (f_a < 0)
            c, f_c = np.where(same, a, b), np.where(same, f_a, f_b)
            b, f_b, a, f_a = np.where(same, b, a), np.where(same, f_b, f_a), x, f_x
            best = np.where(np.abs(f_a) < np.abs(f_b), a, b)
            least = math.ulp(0.5) * np.abs(best) / np.abs(b - a)
            if np.all((least >= 0.5) | (f_a == 0) | (a == b) | ~changes):
                break
            xi, phi = (a - b) / (c - b), (f_a - f_b) / (f_c - f_b)
            far = (c - a) / (b - a) * f_a / (f_c - f_a) * f_b / (f_c - f_b)
            guess = f_a / (f_b - f_a) * f_c / (f_b - f_c) + far
            trusted = (phi**2 < xi) & ((1 - phi) ** 2 < 1 - xi) & np.isfinite(guess)
            ends = np.minimum(least, 0.5), np.maximum(1 - least, 0.5)
            share = np.clip(np.where(trusted, guess, 0.5), *ends)
    return np.where(changes, np.where(f_a == 0, a, best), np.nan)
