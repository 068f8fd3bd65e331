"""Exact cases of version 3: bodies that slide, or are pulled, off the axes of a contact.

Coulomb's cone is round. A pyramid with its edges along x and y is weaker between them, and turns
what slides there; its courses are the wrong answers that these cases must notice. As in
`compare.bench.closed_forms`, courses are functions of time and of the constants that a wrong engine
or theory would have otherwise. Those of a tripod and under friction that depends on the direction
are integrated, to 1e-12."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from compare.bench.case import ContactCase
from compare.bench.closed_forms import (
    BLOCK,
    MU,
    RADIUS,
    SPEED_ALONE,
    UP,
    G,
    J,
    Motion,
    block,
    case,
    sphere,
    vectors,
)
from compare.bench.mechanisms import BALANCE, TRIPOD, WRONG_TRIPODS, integrated, tripod
from compare.engines.adapters.scene import Surface
from model.arrays import Array

OBLIQUE: list[Callable[[], ContactCase]] = []
"""Functions that make these cases, in the order in which they are listed."""
_case = partial(case, OBLIQUE)
_SPEED = 2.0  # of what is pushed off, m/s
_PYRAMID = "a pyramid with its edges along the axes"
_WRONG = {"friction 5 % too weak": {"mu": 0.95 * MU}, _PYRAMID: {"pyramid": True}}


def _way(degrees: float) -> Array:
    """The level way at an angle to the x axis."""
    angle = math.radians(degrees)
    return np.array([math.cos(angle), math.sin(angle), 0.0])


def _ways(way: Array, mu: float, pyramid: bool) -> list[tuple[Array, float]]:
    """Ways along which friction acts on its own, each with its coefficient.

    For Coulomb's law it is that of the slip. The pyramid |f_x| + |f_y| <= mu N is a square across
    the diagonals, so that there are two, with mu/sqrt(2) each."""
    if not pyramid:
        return [(way, mu)]
    return [(_way(diagonal), mu * math.sqrt(0.5)) for diagonal in (45.0, -45.0)]


def _slides_off(
    t: Array,
    degrees: float,
    v: float = 0.0,
    pull: float = 0.0,
    mu: float = MU,
    pyramid: bool = False,
) -> Motion:
    """A block on a level floor with a speed v, or pulled, at an angle to the x axis."""
    way, place, velocity = _way(degrees), BLOCK[2] * UP, np.zeros(3)
    for along, strength in _ways(way, mu, pyramid):
        share = float(way @ along)
        own, a = v * share, G * (pull * share - strength)
        moving = np.minimum(t, -own / a) if a < 0 else t
        place = place + np.outer(own * moving + a * moving**2 / 2, along)
        velocity = velocity + np.outer(own + a * moving, along)
    return place, velocity, 0 * velocity


def _off_axes(
    name: str, degrees: float, about: str, v: float = 0.0, share: float = 0.0, **given: Any
) -> None:
    """Add the case of a block that is pushed off, or pulled by a share of its friction."""
    pull = share * MU
    add = _case(
        f"{name}-at-{degrees:.0f}",
        about,
        block(),
        (Surface("floor", MU),),
        pull=tuple((pull * G * _way(degrees)).tolist()),
        **given,
    )
    add(partial(_slides_off, degrees=degrees, v=v, pull=pull))


# fmt: off
for _degrees in (15.0, 30.0, 45.0):
    _off_axes(
        "slides", _degrees,
        f"a box that is pushed off at {_degrees:.0f} degrees to the axes slides straight on, "
        "slower by mu g, and stops", v=_SPEED,
        wrong=_WRONG,
        until=1.0, scales=(0.5, 1.0, math.inf), contacts=("S", _SPEED / (MU * G), "R"),
        source="Coulomb's law: friction is opposite to the slip")
for _degrees in (30.0, 45.0):
    _pulled = f"a block that is pulled at {_degrees:.0f} degrees to the axes by"
    _strong = "Coulomb's law: friction is as strong in every direction"
    _off_axes(
        "held", _degrees, f"{_pulled} 0.9 of its friction must not move", share=0.9,
        wrong={"a threshold at 0.85 of Coulomb's": {"mu": 0.85 * MU}, _PYRAMID: {"pyramid": True}},
        until=2.0, scales=SPEED_ALONE, contacts=("R",), source=_strong)
    _off_axes(
        "gives-way", _degrees, f"{_pulled} 1.25 of its friction slides along the pull", share=1.25,
        wrong=_WRONG,
        until=1.0, scales=(0.5, 1.0, math.inf), contacts=("S",), source=_strong)

_ALONG, _ACROSS = 0.3, 0.6  # friction along x and along y


@_case(
    "anisotropic",
    "a block on a floor that is twice as rough along y as along x turns towards x as it slides",
    block(), (Surface("floor", _ALONG, across=_ACROSS),),
    wrong={
        "friction opposite to the slip": {"power": 1},
        "the axes exchanged": {"along": _ACROSS, "across": _ALONG},
        "the same along both": {"along": 0.45, "across": 0.45},
    },
    until=0.4, scales=(0.5, 1.0, math.inf), contacts=("S",),
    source="maximal dissipation: f_i = -mu_i^2 v_i m g/|mu v|, integrated to 1e-13")
def _turns_aside(
    t: Array, along: float = _ALONG, across: float = _ACROSS, power: int = 2
) -> Motion:
    """A block under the force of the ellipse (f_x/mu_x)^2 + (f_y/mu_y)^2 <= (m g)^2 that takes the
    most power; with `power` 1 under the one of it that is opposite to the slip."""
    mu = np.array([along, across])

    def rates(_: float, state: Array) -> Array:
        v = state[2:]
        of_slip = mu**2 * v / np.hypot(*(mu * v)) if power == 2 else v / np.hypot(*(v / mu))
        return np.concatenate([v, -G * of_slip])

    x, y, v_x, v_y = integrated(rates, np.concatenate([[0.0, 0.0], _SPEED * _way(60.0)[:2]]), t)
    return vectors(x, y, BLOCK[2]), vectors(v_x, v_y, 0.0), np.zeros(3)


_BALL_MU, _TOP, _SIDE = 0.2, 15.0, 20.0
"""Friction under the ball, and its spin at first about x and about the vertical, rad/s."""
_FIRST = np.array([_SPEED, RADIUS * _TOP, 0.0])  # slip of the ball at first, m/s
_ROLLS = float(np.linalg.norm(_FIRST)) / (_BALL_MU * G * (1 + 1 / J))  # when it no longer slips, s


@_case(
    "ball-curves",
    "a ball that is pushed off with spin across its way slides along a parabola, then rolls "
    "straight on; it spins on about the vertical",
    sphere(), (Surface("floor", _BALL_MU),),
    wrong={
        "a hollow sphere": {"j": 2 / 3},
        "friction 5 % too weak": {"mu": 0.95 * _BALL_MU},
        _PYRAMID: {"pyramid": True},
    },
    until=1.0, scales=(1.0, 1.0, 10.0), contacts=("S", _ROLLS, "R"),
    source="Newton and Euler: the slip keeps its direction and falls by mu g (1 + 1/j)")
def _curves(t: Array, mu: float = _BALL_MU, j: float = J, pyramid: bool = False) -> Motion:
    """A sphere that slides and spins at once, about axes along its way, across it and upright."""
    place, velocity = RADIUS * UP + np.outer(_SPEED * t, _way(0.0)), _SPEED * _way(0.0)
    spin = np.array([_TOP, 0.0, _SIDE])
    for along, strength in _ways(_FIRST / np.linalg.norm(_FIRST), mu, pyramid):
        a = strength * G
        slid = np.minimum(t, _FIRST @ along / (a * (1 + 1 / j)))
        lost = a * slid
        place = place - np.outer(lost * (t - slid / 2), along)
        velocity = velocity - np.outer(lost, along)
        spin = spin + np.outer(lost / (j * RADIUS), np.cross(UP, along))
    return place, velocity, spin


_case(
    "tripod-off-axes",
    "three legs that slide off the axes and turn slowly, so that they stay off them",
    TRIPOD, (Surface("floor", 0.3),), wrong=WRONG_TRIPODS | {_PYRAMID: {"pyramid": True}},
    until=0.3, scales=(0.1, 0.5, 5.0), contacts=("S",), source=BALANCE,
)(partial(tripod, start=(30.0, 3.0)))
# fmt: on
