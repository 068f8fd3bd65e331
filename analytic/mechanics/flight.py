"""Free fall with drag in closed form."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from scipy.optimize import brentq

from model import Parameters


def fall(t: Any, y: float, v_y: float, p: Parameters) -> tuple[Any, Any]:
    """Height and vertical velocity after a time t (a float or an array) of flight with drag."""
    return y + v_y * _decay(t, p.c) - p.g * t**2 * second(p.c * t), speed(t, v_y, p)


def speed(t: Any, v_y: float, p: Parameters) -> Any:
    """Vertical velocity alone."""
    return v_y - (p.c * v_y + p.g) * _decay(t, p.c)


def _decay(t: Any, c: float) -> Any:
    """(1 - exp(-c t))/c."""
    if c == 0:
        return t
    return -(math.expm1(-c * t) if isinstance(t, float) else np.expm1(-c * t)) / c


def fall_time(y: float, v_y: float, p: Parameters) -> float:
    """Time until a flight ends on the floor, s; y >= 0, and v_y > 0 if y = 0."""
    free = (v_y + math.sqrt(v_y**2 + 2 * p.g * y)) / p.g
    if free == 0:
        return 0.0

    def height(t: float) -> float:
        return float(fall(t, y, v_y, p)[0])

    low, high = 0.0, free
    if v_y > 0:  # from the top on
        low = math.log1p(p.c * v_y / p.g) / p.c if p.c > 0 else v_y / p.g
    while height(high) > 0:
        low, high = high, 2 * high
    return float(brentq(height, low, high, xtol=4 * math.ulp(1.0) * high, rtol=4 * math.ulp(1.0)))


def second(s: Any) -> Any:
    """(s - 1 + exp(-s))/s^2, by its series where that cancels."""
    small = np.abs(s) < 1e-2
    safe = np.where(small, 1.0, s)
    series = 1 / 2 - s / 6 * (1 - s / 4 * (1 - s / 5 * (1 - s / 6 * (1 - s / 7))))
    return np.where(small, series, (safe + np.expm1(-safe)) / safe**2)
