"""Exact cases in closed form: a block or a ball on a surface, or in a groove.

Each course is written as a function of time and of the constants that a wrong engine or theory
would have otherwise; the wrong answers of a case are the same course with other constants. Above a
course stands its case, or below it, if it has several. Moments of a uniform sphere: j = 2/5."""

from __future__ import annotations

import math
from bisect import bisect
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

import numpy as np

from compare.bench.case import ContactCase
from compare.engines.adapters.scene import Body, Surface, Vector
from model import Parameters, State
from model.arrays import Array

G, J = 9.81, 0.4
RADIUS, BLOCK, MU = 0.1, (0.1, 0.1, 0.05), 0.5
"""Radius of spheres and half edges of blocks, m; they weigh 1 kg; friction of most surfaces."""
CLOSED_FORMS: list[Callable[[], ContactCase]] = []
"""Functions that make these cases, in the order in which they are listed."""
CLOSED = 1e-14  # round-off of a closed form, in units of the scales
SPEED_ALONE = (math.inf, 0.01, math.inf)
"""Of a body that must not move: a creep of 0.1 mm/s passes; how far it sinks in is left out."""
UP, WAY = np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0])
"""The vertical, and the way of what goes along a level floor."""
Motion = tuple[Array, ...]
"""Position, velocity and spin, each (n, 3); then those of a body under the first."""
Course = Callable[..., Motion]  # the motion at times (n,) in s


def closed_form(
    course: Course,
    name: str,
    about: str,
    body: Mapping[str, Any],
    surfaces: tuple[Surface, ...],
    *,
    wrong: Mapping[str, Mapping[str, Any]],
    until: float,
    contacts: tuple[str | float, ...],
    under: Mapping[str, Any] | None = None,
    **fields: Any,
) -> ContactCase:
    """A case whose course is a closed form; `wrong` are other constants of the course.

    `contacts` are letters of `ContactCase.contacts`, between them when they change, s; `fields` are
    all that the case has as they stand."""
    times: Array = np.arange(1.0, 26.0) * (until / 25)
    letters, changes = contacts[::2], contacts[1::2]

    def states(t: Array, **constants: Any) -> Array:
        parts = course(t, **constants)
        return np.concatenate([np.broadcast_to(part, (len(t), 3)) for part in parts], axis=1)

    start: Any = tuple(map(tuple, states(np.zeros(1)).reshape(-1, 3).tolist()))
    return ContactCase(
        name=name,
        about=about,
        body=Body(*start[:3], **body),
        under=Body(*start[3:], **under) if under else None,
        surfaces=surfaces,
        times=times,
        exact=states(times),
        contacts=tuple(str(letters[bisect(changes, t)]) for t in times.tolist()),
        bound=CLOSED,
        wrong={text: states(times, **constants) for text, constants in wrong.items()},
        g=G,
        **fields,
    )


def case(
    forms: list[Callable[[], ContactCase]], *row: Any, **given: Any
) -> Callable[[Course], Course]:
    """A decorator that adds the case of a course to `forms`, with what else `closed_form` takes."""

    def add(course: Course) -> Course:
        forms.append(partial(closed_form, course, *row, **given))
        return course

    return add


_case = partial(case, CLOSED_FORMS)


def block(tilt: float = 0.0, size: Vector = BLOCK, mass: float = 1.0) -> dict[str, Any]:
    """A block turned about the y axis by an angle, as fields of `Body`."""
    x, y, z = ((2 * half) ** 2 for half in size)
    moments = (mass / 12 * (y + z), mass / 12 * (x + z), mass / 12 * (x + y))
    turn = (math.cos(tilt / 2), 0.0, math.sin(tilt / 2), 0.0)
    return {"shape": "box", "size": size, "mass": mass, "inertia": moments, "orientation": turn}


def sphere() -> dict[str, Any]:
    """A uniform sphere, as fields of `Body`."""
    return {"shape": "sphere", "size": (RADIUS,), "mass": 1.0, "inertia": (J * RADIUS**2,) * 3}


def slope(angle: float) -> tuple[Array, Vector]:
    """The way down a slope that falls along x, and its normal."""
    down = np.array([math.cos(angle), 0.0, -math.sin(angle)])
    return down, (math.sin(angle), 0.0, math.cos(angle))


def vectors(x: Any, y: Any, z: Any) -> Array:
    """Vectors (n, 3) of these components, each (n,) or a number."""
    return np.stack(np.broadcast_arrays(x, y, z), axis=1)


def along(way: Array, s: Any, v: Any, spin: Any, start: Any) -> Motion:
    """Distance s, speed v along a straight way, and a spin about the horizontal across it."""
    across = np.array([-way[1], way[0], 0.0]) / math.hypot(way[0], way[1])
    return start + np.outer(s, way), np.outer(v, way), np.outer(spin, across)


# fmt: off
def _slides_down(t: Array, angle: float, mu: float = MU, v: float = 0.0) -> Motion:
    """A block on a slope with a speed v at first; where friction is stronger it stops."""
    way, normal = slope(angle)
    a = G * (math.sin(angle) - mu * math.cos(angle))
    if a < 0:
        t = np.minimum(t, -v / a)
    return along(way, v * t + a * t**2 / 2, v + a * t, 0 * t, BLOCK[2] * np.array(normal))


def _on_slope(tangent: float, v: float, *row: str, **given: Any) -> None:
    """Add the case of a block with a speed v on a slope of this tangent."""
    angle, source = math.atan(tangent), "Coulomb's law with Newton's second, integrated by hand"
    floor = Surface("floor", MU, normal=slope(angle)[1])
    add = _case(*row, block(angle), (floor,), source=source, **given)
    add(partial(_slides_down, angle=angle, v=v))


_on_slope(
    0.9 * MU, 0.0, "block-rests", "a block on a slope whose tangent is 0.9 of its friction must "
                                  "not move",
    wrong={"a threshold at 0.85 of Coulomb's": {"mu": 0.85 * MU}},
    until=2.0, scales=SPEED_ALONE, contacts=("R",))
_on_slope(
    1.25 * MU, 0.0,
    "block-slides", "a block on a slope whose tangent is 1.25 of its friction slides down at g "
                    "(sin - mu cos)",
    wrong={"no friction": {"mu": 0.0}, "friction 5 % too strong": {"mu": 1.05 * MU},
           "a threshold at 1.3 of Coulomb's": {"mu": 1.3 * MU}},
    until=1.0, scales=(0.5, 1.0, math.inf), contacts=("S",))
_on_slope(
    0.0, 2.0, "box-stops", "a box that is pushed off at 2 m/s slides v^2/(2 mu g) on a level "
                           "floor, stops and stays",
    wrong={"friction 5 % too weak": {"mu": 0.95 * MU}, "no friction": {"mu": 0.0}},
    until=1.0, scales=(0.5, 1.0, math.inf), contacts=("S", 2.0 / (MU * G), "R"))


@_case(
    "growing-pull", "a block under a force that grows by 10 N a second breaks away at mu m g and "
                    "then slides",
    block(), (Surface("floor", MU),),
    wrong={"it creeps from the first": {"mu": 0.0},
           "static friction a tenth greater": {"grip": 1.1}},
    until=1.0, scales=(0.1, 0.5, math.inf), contacts=("R", MU * G / 10.0, "S"),
    source="Coulomb's law: m x'' = 10 t - mu m g from when that is positive",
    growth=(10.0, 0.0, 0.0))
def _pulled_ever_harder(t: Array, mu: float = MU, grip: float = 1.0) -> Motion:
    """A block pulled by a force that grows by 10 N each second until it slides."""
    late = np.maximum(t - grip * mu * G / 10.0, 0.0)
    a0 = (grip - 1) * mu * G
    return along(WAY, a0 * late**2 / 2 + 10.0 * late**3 / 6, a0 * late + 5.0 * late**2, 0 * t,
                 BLOCK[2] * UP)


_PUSH = G / (0.5 * MU)  # force at which half of the friction of a wall carries a block, N


@_case(
    "pinched-block",
    "a block is pressed against a vertical wall, half of the friction there is carries it: it must "
    "not move",
    block(), (Surface("wall", MU, normal=(-1.0, 0.0, 0.0)),),
    wrong={"friction of 0.45 of Coulomb's": {"mu": 0.45 * MU}},
    until=2.0, scales=SPEED_ALONE, contacts=("R",),
    source="statics: half of mu times the force carries the weight, the pressure stays on the face",
    pull=(_PUSH, 0.0, 0.0))
def _pressed_to_wall(t: Array, mu: float = MU) -> Motion:
    """A block pressed to a wall: friction holds it, or it falls along the wall."""
    fall = max(G - mu * _PUSH, 0.0)
    start = np.array([-BLOCK[0], 0.0, 1.0])
    return start - np.outer(fall * t**2 / 2, UP), -np.outer(fall * t, UP), np.zeros(3)


@_case(
    "sphere-slides-rolls",
    "a sphere that is pushed off at 2 m/s without spin slides, then rolls on at 5/7 of its speed",
    sphere(), (Surface("floor", 0.2),),
    wrong={"a hollow sphere": {"j": 2 / 3}, "friction 5 % too weak": {"mu": 0.19},
           "it slides on": {"j": 1e9}},
    until=1.0, scales=(1.0, 1.0, 10.0), contacts=("S", 4.0 / (7 * 0.2 * G), "R"),
    source="Newton and Euler with constant friction mu m g; rolling from t = 2 v/(7 mu g)")
def _slides_then_rolls(t: Array, mu: float = 0.2, j: float = J) -> Motion:
    """A sphere pushed off at 2 m/s without spin: slides until v/r = spin, at 2/(mu g (1 + 1/j)),
    then rolls."""
    slid = np.minimum(t, 2.0 / (mu * G * (1 + 1 / j)))
    v, s = 2.0 - mu * G * slid, 2.0 * slid - mu * G * slid**2 / 2
    return along(WAY, s + v * (t - slid), v, mu * G * slid / (j * RADIUS), RADIUS * UP)


def _rolls_down(t: Array, angle: float, mu: float = 0.5, j: float = J) -> Motion:
    """A sphere from rest on a slope: rolls if tan <= mu (1 + 1/j), else slips."""
    way, normal = slope(angle)
    a = max(G * math.sin(angle) / (1 + j), G * (math.sin(angle) - mu * math.cos(angle)))
    spun = (G * math.sin(angle) - a) / (j * RADIUS)
    return along(way, a * t**2 / 2, a * t, spun * t, RADIUS * np.array(normal))


_GENTLE, _STEEP = math.atan(0.5), math.atan(2.5)
"""Slopes on which a sphere rolls, and on which it slips."""
_case(
    "sphere-rolls-down", "a sphere rolls down a slope from rest at 5/7 g sin",
    sphere(), (Surface("slope", 0.5, normal=slope(_GENTLE)[1]),),
    wrong={"it slides without friction": {"mu": 0.0}, "a hollow sphere": {"j": 2 / 3}},
    until=1.0, scales=(1.0, 2.0, 20.0), contacts=("R",), source="Newton and Euler: (1 + j) a = g "
                                                                "sin",
)(partial(_rolls_down, angle=_GENTLE))
_case(
    "sphere-slips-down",
    "a sphere on a slope too steep for rolling, tan > 7/2 mu, slips down and is spun up by "
    "friction",
    sphere(), (Surface("slope", 0.5, normal=slope(_STEEP)[1]),),
    wrong={"it rolls": {"j": J, "mu": 10.0}, "friction 5 % too strong": {"mu": 0.525}},
    until=0.5, scales=(1.0, 2.0, 20.0), contacts=("S",),
    source="Newton and Euler: a = g (sin - mu cos), j r spin' = mu g cos",
)(partial(_rolls_down, angle=_STEEP))


@_case(
    "drilling-sphere",
    "a sphere spins about the vertical on a point, where friction has no arm: it spins for ever",
    sphere(), (Surface("floor", MU),), wrong={"a damping of 5 % a second": {"decay": 0.05}},
    until=2.0, scales=(0.1, 1.0, 20.0), contacts=("R",), source="a point contact carries no moment")
def _spins_on_the_spot(t: Array, decay: float = 0.0) -> Motion:
    """A sphere that spins about the vertical for ever."""
    return RADIUS * UP, np.zeros(3), np.outer(20.0 * np.exp(-decay * t), UP)


_TURNING = 3.0  # of the turntable, rad/s


@_case(
    "turntable", "a ball rolls on a table that turns at 3 rad/s, and circles at 2/7 of that",
    sphere(), (Surface("table", 0.5, turning=_TURNING),),
    wrong={"a hollow sphere": {"j": 2 / 3}, "it goes with the table": {"j": 1e9}},
    until=4.0, scales=(0.5, 0.5, 15.0), contacts=("R",),
    source="Weltner, Am. J. Phys. 47 (1979): v' = 2/7 turning z x v for a uniform ball")
def _circles_on_turntable(t: Array, j: float = J) -> Motion:
    """A sphere on a turntable, x'' = k turning z x x' with k = j/(1 + j): it circles."""
    k = _TURNING * j / (1 + j)
    cos, sin = np.cos(k * t), np.sin(k * t)
    place, way = 0.5 * vectors(cos, sin, 0.0), 0.5 * k * vectors(-sin, cos, 0.0)
    rolling = np.cross(UP, way - np.cross(_TURNING * UP, place)) / RADIUS
    return place + RADIUS * UP, way, rolling


_ORBIT, _TURNS = 1.0, 8.0
"""Radius in m and angular velocity in rad/s at which a ball goes round in a cylinder."""
_CYLINDER = Parameters(m=1.0, r=RADIUS, R=_ORBIT, j=J, mu=1.0, eta=1.0, g=G, c=0.0, omega_0=0.0)
"""The same in the study's vessel, far above its floor."""


@_case(
    "cylinder",
    "a ball rolls round inside a vertical cylinder: it comes down and rises again, at sqrt(2/7) of "
    "its orbit",
    sphere(), (Surface("wall", 1.0, radius=_ORBIT + RADIUS),),
    wrong={"a hollow sphere": {"j": 2 / 3}, "it falls freely": {"j": 1e-9}},
    until=2.0, scales=(1.0, 8.0, 80.0), contacts=("R",),
    source="Newton and Euler in the turning frame: the spin along the radius changes with height",
    motion=(_CYLINDER, State(y=10.0, omega_c=_TURNS, slip_x=-_TURNS * _ORBIT / RADIUS)))
def _rolls_in_cylinder(t: Array, j: float = J) -> Motion:
    """A sphere rolling in a cylinder: z'' = -g/(1 + j) - k^2 z, k^2 = turns^2 j/(1 + j)."""
    k = _TURNS * math.sqrt(j / (1 + j))
    deep = G / (j * _TURNS**2)
    z, fall = -deep * (1 - np.cos(k * t)), -deep * k * np.sin(k * t)
    out = vectors(np.cos(_TURNS * t), np.sin(_TURNS * t), 0.0)
    on = np.cross(UP, out)
    turned = (_TURNS * z / RADIUS)[:, None] * out - _ORBIT * _TURNS / RADIUS * UP
    spin = turned + (fall / RADIUS)[:, None] * on
    return _ORBIT * out + np.outer(z, UP), _ORBIT * _TURNS * on + np.outer(fall, UP), spin


def _groove(angle: float, mu: float) -> tuple[Surface, Surface]:
    """The planes of a right-angled groove down a slope."""
    half = math.sqrt(0.5)
    up = half * np.array(slope(angle)[1])
    left, right = (tuple((up + side * np.array([0.0, half, 0.0])).tolist()) for side in (-1.0, 1.0))
    return Surface("left", mu, normal=left), Surface("right", mu, normal=right)


def _descends(t: Array, angle: float, lever: float = 2 * J, mu: float = 9.0) -> Motion:
    """A body goes down a groove at g sin/(1 + j/sin^2 45) if it rolls, faster if it slips.

    Each plane of the groove carries m g cos/sqrt(2)."""
    way, normal = slope(angle)
    a = max(G * math.sin(angle) / (1 + lever),
            G * (math.sin(angle) - mu * math.cos(angle) / math.sqrt(0.5)))
    spin = a * t / (math.sqrt(0.5) * RADIUS) if lever < 9 else 0 * t
    return along(way, a * t**2 / 2, a * t, spin, RADIUS / math.sqrt(0.5) * np.array(normal))


_PINCHED = math.atan(0.9 * 0.5 / math.sqrt(0.5))  # a groove in which a cube stays
_IN_GROOVE = "Newton and Euler; by symmetry both planes carry m g cos/sqrt(2)"
_TURN, _ACROSS = _PINCHED / 2, math.pi / 8
_CUBE = {
    "shape": "box", "size": (RADIUS,) * 3, "mass": 1.0, "inertia": (0.04 / 6,) * 3,
    "orientation": (math.cos(_TURN) * math.cos(_ACROSS), math.cos(_TURN) * math.sin(_ACROSS),
                    math.sin(_TURN) * math.cos(_ACROSS), -math.sin(_TURN) * math.sin(_ACROSS)),
}
"""With an edge down in it."""
_case(
    "groove-rolls", "a sphere rolls down a right-angled groove on two points, at 5/9 g sin",
    sphere(), _groove(_GENTLE, 0.5),
    wrong={"on one point, 5/7 g sin": {"lever": J}, "a hollow sphere": {"lever": 4 / 3}},
    until=1.0, scales=(1.0, 2.0, 30.0), contacts=("RR",), source=_IN_GROOVE,
)(partial(_descends, angle=_GENTLE))
_case(
    "groove-rests",
    "a cube pinched by its weight in a right-angled groove stays, at 0.9 of sqrt(2) times its "
    "friction",
    _CUBE, _groove(_PINCHED, 0.5),
    wrong={"a threshold as on a plane": {"mu": 0.5 * math.sqrt(0.5)},
           "at 0.85 of Coulomb's": {"mu": 0.425}},
    until=2.0, scales=SPEED_ALONE, contacts=("RR",), source=_IN_GROOVE,
)(partial(_descends, angle=_PINCHED, lever=math.inf))
# fmt: on
