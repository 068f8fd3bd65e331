"""Vectors of three numbers, in compiled code: arrays, or tuples, which they return."""

from __future__ import annotations

import math
from typing import Any

from .compiling import kernel

NONE = 0.0, 0.0, 0.0


@kernel
def cross(a: Any, b: Any) -> Any:
    """The cross product of two vectors."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@kernel
def dot(a: Any, b: Any) -> float:
    """The scalar product of two vectors."""
    return float(a[0] * b[0] + a[1] * b[1] + a[2] * b[2])


@kernel
def times_vector(x: float, a: Any) -> Any:
    """The vector x a."""
    return x * a[0], x * a[1], x * a[2]


@kernel
def plus(a: Any, x: float, b: Any) -> Any:
    """The vector a + x b."""
    return a[0] + x * b[0], a[1] + x * b[1], a[2] + x * b[2]


@kernel
def square_between(a: Any, b: Any) -> float:
    """The square of the distance between two points."""
    way = plus(a, -1.0, b)
    return float(dot(way, way))


@kernel
def applied(matrix: Any, a: Any) -> Any:
    """A matrix, as a tuple of its rows, times a vector."""
    return dot(matrix[0], a), dot(matrix[1], a), dot(matrix[2], a)


@kernel
def vector_at(values: Any, first: int) -> Any:
    """Three numbers of an array as a vector."""
    return values[first], values[first + 1], values[first + 2]


@kernel
def rotated(a: Any, turn: Any) -> Any:
    """A vector turned about an axis, by an angle as long as the axis, rad (Rodrigues)."""
    square, across = dot(turn, turn) + 1e-300, cross(turn, a)
    angle = math.sqrt(square)
    return plus(
        plus(a, math.sin(angle) / angle, across),
        (1 - math.cos(angle)) / square,
        cross(turn, across),
    )


@kernel
def assign(target: Any, values: Any) -> None:
    """Give the numbers of an array these values."""
    for i in range(len(target)):
        target[i] = values[i]
