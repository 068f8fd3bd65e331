"""Exact cases with one contact, in closed form.

Each course is written as a function of time and of the constants that a wrong engine or theory would have otherwise;
the wrong answers of a case are the same course with other constants. Moments of a uniform sphere: j = 2/5.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

import numpy as np

from compare.adapters.scene import Body, Surface, Vector
from compare.bench.case import Case
from model import Parameters, State
from model.arrays import Array

G, J = 9.81, 0.4
RADIUS, BLOCK, MU = 0.1, (0.1, 0.1, 0.05), 0.5
"""Radius of the spheres and half edges of the blocks, m; all weigh 1 kg; friction of most surfaces."""
CLOSED = 1e-14
"""Round-off of a closed form, in units of the scales."""
SPEED_ALONE = (math.inf, 0.01, math.inf)
"""Scales of a body that must not move: a creep of 0.1 mm/s passes, and how far it sinks into its floor is left out."""
_UP = np.array([0.0, 0.0, 1.0])
Course = Callable[..., tuple[Array, ...]]
"""Position, velocity and spin, each (n, 3), at times (n,); then those of a body under the first."""


def cases() -> tuple[Case, ...]:
    """The cases with one contact."""
    return (*_blocks_on_slopes(), _growing_pull(), _pinched(), *_spheres(), _drilling(), _turntable(), _cylinder())


def closed(
    name: str,
    about: str,
    body: Mapping[str, Any],
    surfaces: tuple[Surface, ...],
    course: Course,
    wrong: Mapping[str, Mapping[str, Any]],
    *,
    until: float,
    scales: tuple[float, float, float],
    contacts: Callable[[float], str],
    source: str,
    under: Mapping[str, Any] | None = None,
    **forces: Any,
) -> Case:
    """A case whose course is a closed form, sampled 25 times; `wrong` are other constants of the course."""
    times: Array = np.arange(1.0, 26.0) * (until / 25)

    def states(**constants: Any) -> Array:
        return np.concatenate([np.broadcast_to(part, (25, 3)) for part in course(times, **constants)], axis=1)

    start: Any = [tuple(np.broadcast_to(part, (1, 3))[0].tolist()) for part in course(np.zeros(1))]
    return Case(
        name=name,
        about=about,
        body=Body(*start[:3], **body),
        under=Body(*start[3:], **under) if under else None,
        surfaces=surfaces,
        times=times,
        exact=states(),
        contacts=tuple(contacts(t) for t in times.tolist()),
        bound=CLOSED,
        source=source,
        scales=scales,
        wrong={text: states(**constants) for text, constants in wrong.items()},
        g=G,
        **forces,
    )


def block(tilt: float = 0.0) -> dict[str, Any]:
    """A block, turned about the y axis by an angle."""
    x, y, z = (2 * half for half in BLOCK)
    moments = ((y * y + z * z) / 12, (x * x + z * z) / 12, (x * x + y * y) / 12)
    turn = (math.cos(tilt / 2), 0.0, math.sin(tilt / 2), 0.0)
    return {"shape": "box", "size": BLOCK, "mass": 1.0, "inertia": moments, "orientation": turn}


def sphere(radius: float = RADIUS) -> dict[str, Any]:
    """A uniform sphere."""
    return {"shape": "sphere", "size": (radius,), "mass": 1.0, "inertia": (J * radius**2,) * 3}


def slope(angle: float) -> tuple[Array, Vector]:
    """The way down a slope that falls along x, and its normal."""
    down = np.array([math.cos(angle), 0.0, -math.sin(angle)])
    return down, (math.sin(angle), 0.0, math.cos(angle))


def along(way: Array, s: Any, v: Any, spin: Any, start: Any) -> tuple[Array, Array, Array]:
    """A straight course: distance and speed along a way, and a spin about the horizontal axis across it."""
    across = np.array([-way[1], way[0], 0.0]) / math.hypot(way[0], way[1])
    return start + np.outer(s, way), np.outer(v, way), np.outer(spin, across)


def _blocks_on_slopes() -> list[Case]:
    def slides(t: Array, angle: float, mu: float = MU, v: float = 0.0) -> tuple[Array, Array, Array]:
        """On a slope, from a speed; it stops where friction is the stronger and doesn't start again."""
        way, normal = slope(angle)
        a = G * (math.sin(angle) - mu * math.cos(angle))
        if a < 0:
            t = np.minimum(t, -v / a)
        return along(way, v * t + a * t**2 / 2, v + a * t, 0 * t, BLOCK[2] * np.array(normal))

    def on_slope(name: str, about: str, tangent: float, v: float, **more: Any) -> Case:
        angle = math.atan(tangent)
        floor, course = Surface("floor", MU, normal=slope(angle)[1]), partial(slides, angle=angle, v=v)
        source = "Coulomb's law with Newton's second, integrated by hand"
        return closed(name, about, block(angle), (floor,), course, source=source, **more)

    return [
        on_slope(
            "block-rests",
            "a block on a slope whose tangent is 0.9 of its friction must not move",
            0.9 * MU,
            0.0,
            contacts=lambda t: "R",
            wrong={"a threshold at 0.85 of Coulomb's": {"mu": 0.85 * MU}},
            until=2.0,
            scales=SPEED_ALONE,
        ),
        on_slope(
            "block-slides",
            "a block on a slope whose tangent is 1.25 of its friction slides down at g (sin - mu cos)",
            1.25 * MU,
            0.0,
            contacts=lambda t: "S",
            wrong={
                "no friction": {"mu": 0.0},
                "friction 5 % too strong": {"mu": 1.05 * MU},
                "a threshold at 1.3 of Coulomb's": {"mu": 1.3 * MU},
            },
            until=1.0,
            scales=(0.5, 1.0, math.inf),
        ),
        on_slope(
            "box-stops",
            "a box that is pushed off at 2 m/s slides v^2/(2 mu g) on a level floor, stops and stays",
            0.0,
            2.0,
            contacts=lambda t: "S" if t < 2.0 / (MU * G) else "R",
            wrong={"friction 5 % too weak": {"mu": 0.95 * MU}, "no friction": {"mu": 0.0}},
            until=1.0,
            scales=(0.5, 1.0, math.inf),
        ),
    ]


def _growing_pull() -> Case:
    def pulled(t: Array, mu: float = MU, grip: float = 1.0) -> tuple[Array, Array, Array]:
        late = np.maximum(t - grip * mu * G / 10.0, 0.0)
        way, a0 = np.array([1.0, 0.0, 0.0]), (grip - 1) * mu * G
        return along(way, a0 * late**2 / 2 + 10.0 * late**3 / 6, a0 * late + 5.0 * late**2, 0 * t, BLOCK[2] * _UP)

    return closed(
        "growing-pull",
        "a block under a force that grows by 10 N a second breaks away at mu m g and then slides",
        block(),
        (Surface("floor", MU),),
        pulled,
        {"it creeps from the first": {"mu": 0.0}, "static friction a tenth greater": {"grip": 1.1}},
        until=1.0,
        scales=(0.1, 0.5, math.inf),
        contacts=lambda t: "R" if t < MU * G / 10.0 else "S",
        source="Coulomb's law: m x'' = 10 t - mu m g from when that is positive",
        growth=(10.0, 0.0, 0.0),
    )


def _pinched() -> Case:
    push = G / (0.5 * MU)

    def held(t: Array, mu: float = MU) -> tuple[Array, Array, Array]:
        fall = max(G - mu * push, 0.0)
        start = np.array([-BLOCK[0], 0.0, 1.0])
        return start - np.outer(fall * t**2 / 2, _UP), -np.outer(fall * t, _UP), np.zeros((len(t), 3))

    return closed(
        "pinched-block",
        "a block is pressed against a vertical wall, half of the friction there is carries it: it must not move",
        block(),
        (Surface("wall", MU, normal=(-1.0, 0.0, 0.0)),),
        held,
        {"friction of 0.45 of Coulomb's": {"mu": 0.45 * MU}},
        until=2.0,
        scales=SPEED_ALONE,
        contacts=lambda t: "R",
        source="statics: half of mu times the force carries the weight, the pressure stays on the face",
        pull=(push, 0.0, 0.0),
    )


def _spheres() -> list[Case]:
    def rolls_at_last(t: Array, mu: float = 0.2, j: float = J) -> tuple[Array, Array, Array]:
        """From 2 m/s without spin: slides until v/r = spin, at 2/(mu g (1 + 1/j)), then rolls."""
        slid = np.minimum(t, 2.0 / (mu * G * (1 + 1 / j)))
        v, s = 2.0 - mu * G * slid, 2.0 * slid - mu * G * slid**2 / 2
        return along(np.array([1.0, 0.0, 0.0]), s + v * (t - slid), v, mu * G * slid / (j * RADIUS), RADIUS * _UP)

    def descends(t: Array, angle: float, mu: float = 0.5, j: float = J) -> tuple[Array, Array, Array]:
        """From rest on a slope: rolls if tan <= mu (1 + 1/j), else slips."""
        way, normal = slope(angle)
        a = max(G * math.sin(angle) / (1 + j), G * (math.sin(angle) - mu * math.cos(angle)))
        spun = (G * math.sin(angle) - a) / (j * RADIUS)
        return along(way, a * t**2 / 2, a * t, spun * t, RADIUS * np.array(normal))

    gentle, steep = math.atan(0.5), math.atan(2.5)
    return [
        closed(
            "sphere-slides-rolls",
            "a sphere that is pushed off at 2 m/s without spin slides, then rolls on at 5/7 of its speed",
            sphere(),
            (Surface("floor", 0.2),),
            rolls_at_last,
            {"a hollow sphere": {"j": 2 / 3}, "friction 5 % too weak": {"mu": 0.19}, "it slides on": {"j": 1e9}},
            until=1.0,
            scales=(1.0, 1.0, 10.0),
            contacts=lambda t: "S" if t < 4.0 / (7 * 0.2 * G) else "R",
            source="Newton and Euler with constant friction mu m g; rolling from t = 2 v/(7 mu g)",
        ),
        closed(
            "sphere-rolls-down",
            "a sphere rolls down a slope from rest at 5/7 g sin",
            sphere(),
            (Surface("slope", 0.5, normal=slope(gentle)[1]),),
            partial(descends, angle=gentle),
            {"it slides without friction": {"mu": 0.0}, "a hollow sphere": {"j": 2 / 3}},
            until=1.0,
            scales=(1.0, 2.0, 20.0),
            contacts=lambda t: "R",
            source="Newton and Euler: (1 + j) a = g sin",
        ),
        closed(
            "sphere-slips-down",
            "a sphere on a slope too steep for rolling, tan > 7/2 mu, slips down and is spun up by friction",
            sphere(),
            (Surface("slope", 0.5, normal=slope(steep)[1]),),
            partial(descends, angle=steep),
            {"it rolls": {"j": J, "mu": 10.0}, "friction 5 % too strong": {"mu": 0.525}},
            until=0.5,
            scales=(1.0, 2.0, 20.0),
            contacts=lambda t: "S",
            source="Newton and Euler: a = g (sin - mu cos), j r spin' = mu g cos",
        ),
    ]


def _drilling() -> Case:
    def spins(t: Array, decay: float = 0.0) -> tuple[Array, Array, Array]:
        return RADIUS * _UP, np.zeros(3), np.outer(20.0 * np.exp(-decay * t), _UP)

    return closed(
        "drilling-sphere",
        "a sphere spins about the vertical on a point, where friction has no arm: it spins for ever",
        sphere(),
        (Surface("floor", MU),),
        spins,
        {"a damping of 5 % a second": {"decay": 0.05}},
        until=2.0,
        scales=(0.1, 1.0, 20.0),
        contacts=lambda t: "R",
        source="a point contact carries no moment",
    )


def _turntable() -> Case:
    turning = 3.0

    def circles(t: Array, j: float = J) -> tuple[Array, Array, Array]:
        """x'' = k turning z x x' with k = j/(1 + j), from where it circles about the axis itself."""
        k = turning * j / (1 + j)
        cos, sin, none = np.cos(k * t), np.sin(k * t), 0 * t
        place, way = 0.5 * np.stack([cos, sin, none], axis=1), 0.5 * k * np.stack([-sin, cos, none], axis=1)
        rolling = np.cross(_UP, way - np.cross(turning * _UP, place)) / RADIUS
        return place + RADIUS * _UP, way, rolling

    return closed(
        "turntable",
        "a ball rolls on a table that turns at 3 rad/s, and circles at 2/7 of that",
        sphere(),
        (Surface("table", 0.5, turning=turning),),
        circles,
        {"a hollow sphere": {"j": 2 / 3}, "it goes with the table": {"j": 1e9}},
        until=4.0,
        scales=(0.5, 0.5, 15.0),
        contacts=lambda t: "R",
        source="Weltner, Am. J. Phys. 47 (1979): v' = 2/7 turning z x v for a uniform ball",
    )


def _cylinder() -> Case:
    orbit, turns = 1.0, 8.0
    # The same in the study's vessel, far above its floor.
    p = Parameters(m=1.0, r=RADIUS, R=orbit, j=J, mu=1.0, eta=1.0, g=G, c=0.0, omega_0=0.0)

    def rises(t: Array, j: float = J) -> tuple[Array, Array, Array]:
        """Round and down from rest: z'' = -g/(1 + j) - k^2 z with k = turns sqrt(j/(1 + j))."""
        k = turns * math.sqrt(j / (1 + j))
        deep = G / (j * turns**2)
        z, fall = -deep * (1 - np.cos(k * t)), -deep * k * np.sin(k * t)
        out = np.stack([np.cos(turns * t), np.sin(turns * t), 0 * t], axis=1)
        on = np.cross(_UP, out)
        spin = (turns * z / RADIUS)[:, None] * out - orbit * turns / RADIUS * _UP + (fall / RADIUS)[:, None] * on
        return orbit * out + np.outer(z, _UP), orbit * turns * on + np.outer(fall, _UP), spin

    return closed(
        "cylinder",
        "a ball rolls round inside a vertical cylinder: it comes down and rises again, at sqrt(2/7) of its orbit",
        sphere(),
        (Surface("wall", 1.0, radius=orbit + RADIUS),),
        rises,
        {"a hollow sphere": {"j": 2 / 3}, "it falls freely": {"j": 1e-9}},
        until=2.0,
        scales=(1.0, 8.0, 80.0),
        contacts=lambda t: "R",
        source="Newton and Euler in the turning frame: the spin along the radius changes with height",
        motion=(p, State(y=10.0, omega_c=turns, slip_x=-turns * orbit / RADIUS)),
    )
