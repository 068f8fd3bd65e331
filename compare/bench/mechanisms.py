"""Exact cases of version 2: on feet, bodies, a belt, a joint, an edge or a rim, after a bounce.

As in `compare.bench.closed_forms`: courses are functions of time and of the constants that a wrong
engine or theory would have otherwise, each under its case. That of the tripod and of what it stands
on are quadratures, to 1e-12."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial

import numpy as np
from scipy.integrate import solve_ivp
from scipy.special import ellipj, ellipk, ellipkinc

from compare.bench.case import ContactCase
from compare.bench.closed_forms import (
    BLOCK,
    SPEED_ALONE,
    UP,
    WAY,
    G,
    Motion,
    along,
    block,
    case,
    slope,
    sphere,
    vectors,
)
from compare.engines.adapters.scene import Surface
from model.arrays import Array

MECHANISMS: list[Callable[[], ContactCase]] = []
"""Functions that make these cases, in the order in which they are listed."""
_case = partial(case, MECHANISMS)

# fmt: off
_FOOT, _OUT, _DOWN, _MOMENT = 0.01, 0.1, 0.04, 0.006
"""Of the tripod the size, m, as a `Body` has it, and the moment about its axis, kg m2."""
TRIPOD = {
    "shape": "tripod", "size": (_FOOT, _OUT, _DOWN), "mass": 1.0,
    "inertia": (0.004, 0.004, _MOMENT),
}
WRONG_TRIPODS = {
    "each leg bears a third": {"share": 0.0}, "friction 5 % too weak": {"mu": 0.95 * 0.3},
    "a centre twice as high": {"height": 2 * (_FOOT + _DOWN)},
}
BALANCE = "Newton and Euler in the plane, loads from the balance of moments, integrated to 1e-13"


def integrated(rates: Callable[[float, Array], Array], start: Array, t: Array) -> Array:
    """The solution of a differential equation at times, a row for each variable."""
    span = (0.0, float(max(t[-1], 1e-3)))
    found = solve_ivp(
        rates, span, start, method="DOP853", rtol=1e-13, atol=1e-14, dense_output=True
    )
    assert found.sol is not None
    return np.asarray(found.sol(t))


@_case(
    "tripod-turns",
    "three legs that slide and turn: each bears what keeps it from tilting, and slows it along its "
    "own slip",
    TRIPOD, (Surface("floor", 0.3),), wrong=WRONG_TRIPODS,
    until=0.3, scales=(0.1, 0.5, 5.0), contacts=("S",), source=BALANCE)
def tripod(t: Array, mu: float = 0.3, height: float = _FOOT + _DOWN, share: float = 1.0,
           start: tuple[float, float] = (0.0, 10.0), pyramid: bool = False) -> Motion:
    """Position, velocity and spin of a tripod of 1 kg each foot of which bears what keeps it from
    tilting.

    At the `start` it goes at 1.5 m/s, so many degrees from the x axis, and turns at so many rad/s.
    The loads N of three feet at p follow from sum N = m g and the two moments of weight and
    friction about the centre, at `height`; `share` 0 gives each a third of the weight. A `pyramid`
    |f_x| + |f_y| <= mu N is as weak as that between its edges. """

    angles, way = math.tau / 3 * np.arange(3), math.radians(start[0])

    def rates(t: float, state: Array) -> Array:
        _, _, turn, *velocity, spin = state
        p = _OUT * np.array([np.cos(angles + turn), np.sin(angles + turn)])
        slip = np.array(velocity)[:, None] + spin * np.array([-p[1], p[0]])
        slip /= np.abs(slip).sum(axis=0) if pyramid else np.hypot(*slip)
        tilting = p - share * height * mu * slip
        loads = np.linalg.solve(np.vstack([np.ones(3), tilting if share else p]), [G, 0.0, 0.0])
        friction = -mu * loads * slip
        torque = float(np.sum(p[0] * friction[1] - p[1] * friction[0]))
        return np.array([*velocity, spin, *friction.sum(axis=1), torque / _MOMENT])

    first = np.array([0.0, 0.0, 0.0, 1.5 * math.cos(way), 1.5 * math.sin(way), start[1]])
    x, y, _, v_x, v_y, rate = integrated(rates, first, t)
    return vectors(x, y, _FOOT + _DOWN), vectors(v_x, v_y, 0.0), np.outer(rate, UP)


_PLANK = (0.6, 0.2, 0.02)  # half edges of the plank, m
_ABOVE, _BELOW, _SPEED, _HEAVIER = 0.4, 0.1, 2.0, 2.0
"""Friction on and under it, speed of the block at first, m/s, and mass of the plank, kg."""
_MEET = _SPEED / (_ABOVE * G + (_ABOVE - _BELOW * (_HEAVIER + 1)) * G / _HEAVIER)
_STOP = _MEET + (_SPEED - _ABOVE * G * _MEET) / (_BELOW * G)
"""When block and plank go together, and when they stop, s."""


@_case(
    "plank", "a block that is pushed off on a plank draws it along, until both go together and "
             "stop on the floor",
    block(), (Surface("floor", _BELOW),),
    wrong={"the floor doesn't feel the block": {"load": 0.0},
           "friction between them 5 % too weak": {"above": 0.95 * _ABOVE},
           "the plank is held": {"below": _ABOVE}},
    until=1.2, scales=(0.2, 0.5, math.inf), contacts=("SS", _MEET, "SR", _STOP, "RR"),
    source="Coulomb's law and Newton's third: m mu g drives the plank, mu' (m + M) g brakes it",
    under=block(0.0, _PLANK, _HEAVIER), between=_ABOVE)
def _dragged(t: Array, above: float = _ABOVE, below: float = _BELOW, load: float = 1.0) -> Motion:
    """A block that slides on a plank slows by mu g and draws the plank until both go together, then
    stop.

    `load` is what of the block's weight the floor bears under the plank."""
    a = max(above * G - below * (_HEAVIER + load) * G, 0.0) / _HEAVIER
    meet = _SPEED / (above * G + a)
    common, brake = a * meet, below * G
    stop = common / brake
    early, late = np.minimum(t, meet), np.clip(t - meet, 0.0, stop)
    ours = _SPEED * early - above * G * early**2 / 2
    theirs, after = a * early**2 / 2, common * late - brake * late**2 / 2
    v, w = _SPEED - above * G * early - brake * late, a * early - brake * late
    height = _PLANK[2] * UP
    up = 2 * height + BLOCK[2] * UP
    block = along(WAY, ours + after, v, 0 * t, up - 0.3 * WAY)
    return *block, *along(WAY, theirs + after, w, 0 * t, height)


_LEAN = math.atan(0.9 * 0.5)


@_case(
    "thousandfold",
    "a block of 1000 kg on one of 1 kg on a slope whose tangent is 0.9 of their friction: neither "
    "must move",
    block(_LEAN, (0.2, 0.2, 0.2), 1000.0), (Surface("slope", 0.5, normal=slope(_LEAN)[1]),),
    wrong={"a threshold at 0.85 of Coulomb's": {"mu": 0.425}},
    until=2.0, scales=SPEED_ALONE, contacts=("RR",), source="Coulomb's law: whatever the masses, "
                                                            "tan < mu holds both",
    under=block(_LEAN, (0.2, 0.2, 0.1)), between=0.5)
def _stays(t: Array, mu: float = 0.5) -> Motion:
    """Two blocks on a slope, the lower of which slides where friction is the weaker."""
    way, normal = slope(_LEAN)
    a = max(G * (math.sin(_LEAN) - mu * math.cos(_LEAN)), 0.0)
    under, half = 0.1, 0.2
    low, high = under * np.array(normal), (2 * under + half) * np.array(normal)
    s, v = a * t**2 / 2, a * t
    return *along(way, s, v, 0 * t, high), *along(way, s, v, 0 * t, low)


_INCLINE, _DOWNHILL = math.atan(0.3), 0.8  # of the belt; speed of the block at first, m/s


@_case(
    "belt", "a block slides down an inclined belt that runs up, stops and is carried off by it",
    block(_INCLINE),
    (Surface("belt", 0.5, normal=slope(_INCLINE)[1],
             velocity=tuple((-slope(_INCLINE)[0]).tolist())),),
    wrong={"the belt stands": {"belt": 1e-9}, "friction 5 % too strong": {"mu": 1.05 * 0.5}},
    until=2.0, scales=(0.5, 0.5, math.inf),
    contacts=("S", (_DOWNHILL + 1.0) / (G * (0.5 * math.cos(_INCLINE) - math.sin(_INCLINE))), "R"),
    source="Coulomb's law against the slip on the belt, integrated by hand")
def _rides(t: Array, mu: float = 0.5, belt: float = 1.0) -> Motion:
    """A block that slides down a belt is slowed by g (mu cos - sin) until it goes up with the
    belt."""
    a = G * (mu * math.cos(_INCLINE) - math.sin(_INCLINE))
    slid = np.minimum(t, (_DOWNHILL + belt) / a)
    s = _DOWNHILL * slid - a * slid**2 / 2 - belt * (t - slid)
    return along(slope(_INCLINE)[0], s, _DOWNHILL - a * slid, 0 * t,
                 BLOCK[2] * np.array(slope(_INCLINE)[1]))


@_case(
    "dry-joint",
    "a mass on a spring and a slide with dry friction: each half swing is shorter by 2 F/k, then "
    "it sticks",
    sphere(), (), wrong={"friction 5 % too weak": {"dry": 0.95 * 4.0}, "none": {"dry": 0.0}},
    until=1.6, scales=(0.3, 3.0, math.inf), contacts=("S", 4 * math.pi / 10, "R"),
    source="m x'' = -k x -+ F: half circles in the phase plane about -+ F/k",
    spring=100.0, joint=(1.0, 0.0, 0.0), dry=4.0)
def _swings(t: Array, dry: float = 4.0, stiffness: float = 100.0, start: float = 0.3) -> Motion:
    """Half swings about -+ dry/stiffness: each ends 2 dry/stiffness nearer, then sticks."""
    rate, shift = math.sqrt(stiffness), dry / stiffness
    half = np.floor(t * rate / math.pi)
    last = max(math.ceil((start / shift - 1) / 2), 0) if shift else math.inf
    side, stopped = 1 - 2 * (np.minimum(half, last) % 2), half >= last
    width = start - (2 * np.minimum(half, last) + 1) * shift
    phase = rate * t - math.pi * half
    s = side * (shift + width * np.cos(np.where(stopped, 0.0, phase)))
    return along(WAY, s, np.where(stopped, 0.0, -side * width * rate * np.sin(phase)), 0 * t, UP)


_HALF, _LEANS = (0.25, 0.5, 1.0), 0.12
"""Half edges of the rocking block, m, and how it leans at first, rad."""
_ARM, _ALPHA = math.hypot(_HALF[0], _HALF[2]), math.atan2(_HALF[0], _HALF[2])
"""From an edge to the centre: how far, m, and the angle with the vertical."""
_ROCKING = block(_LEANS, _HALF)
_MOMENT_OF_EDGE = _ROCKING["inertia"][1] + _ARM**2
_KEPT = 1 - _ARM**2 / _MOMENT_OF_EDGE * (1 - math.cos(2 * _ALPHA))


@_case(
    "rocking-block", "a block rocks from edge to edge, and loses the same share of its speed at "
                     "every impact",
    _ROCKING, (Surface("floor", 1.0),),
    wrong={
        "nothing is lost in an impact": {"kept": 1.0},
        "inertia of a point": {"moment": _ARM**2},
    },
    until=0.8, scales=(0.2, 1.0, 1.0), contacts=("T",),
    source="Housner, Bull. Seismol. Soc. Am. 53 (1963): a pendulum upside down, momentum about the "
           "new edge")
def _rocks(t: Array, kept: float = _KEPT, moment: float = _MOMENT_OF_EDGE) -> Motion:
    """A pendulum upside down about an edge: from rest at an angle to upright and beyond.

    With the angle psi of the centre from straight below the edge, psi = pi - alpha + lean, it is
    sin(psi/2) = k sn(K - p t, k), p^2 = m g arm/moment. Each impact on the other edge leaves `kept`
    of the angular velocity. """
    arm, alpha, lean = _ARM, _ALPHA, _LEANS
    p, side = math.sqrt(G * arm / moment), 1.0
    angle, rate, done = np.zeros_like(t), np.zeros_like(t), np.zeros(t.shape, bool)
    top, begin, first = lean, 0.0, True  # the greatest lean of this rock
    while not done.all():
        k = math.sin((math.pi - alpha + top) / 2)
        upright = math.sin((math.pi - alpha) / 2) / k
        quarter = float(ellipk(k * k) - ellipkinc(math.asin(upright), k * k)) / p  # to upright
        peak = begin + (0.0 if first else quarter)
        own = ~done & (t < peak + quarter)
        u = ellipk(k * k) - p * (t[own] - peak)
        sn, cn, _, _ = ellipj(u, k * k)
        psi = 2 * np.arcsin(k * sn)
        angle[own], rate[own] = side * (psi - math.pi + alpha), -side * 2 * p * k * cn
        done |= own
        begin, side, first = peak + quarter, -side, False
        risen = kept**2 * (math.cos(alpha - top) - math.cos(alpha))  # of the centre, divided by arm
        top = alpha - math.acos(math.cos(alpha) + risen)
    # of the way from the edge to the centre, from the vertical
    tilt = np.sign(angle) * alpha - angle
    place = vectors(np.sign(angle) * _HALF[0] - arm * np.sin(tilt), 0.0, arm * np.cos(tilt))
    velocity = vectors(arm * np.cos(tilt) * rate, 0.0, arm * np.sin(tilt) * rate)
    return place, velocity, np.outer(rate, [0.0, 1.0, 0.0])


@_case(
    "bounce", "a ball that falls on a floor leaves it with 0.7 of its speed, again and again",
    sphere(), (Surface("floor", 0.5, restitution=0.7),),
    wrong={"0.65 of it": {"share": 0.65}, "all of it": {"share": 1.0}},
    until=2.0, scales=(1.0, 6.0, 10.0), contacts=("N",), source="Newton's law of restitution, "
                                                                "parabolas between")
def _bounces(t: Array, share: float = 0.7, drop: float = 1.8) -> Motion:
    """A ball falls and bounces in parabolas: each impact leaves `share` of the speed."""
    speed, begin = math.sqrt(2 * G * drop), math.sqrt(2 * drop / G)
    z, v = drop - G * t**2 / 2, -G * t
    while begin < t[-1]:
        speed *= share
        since = t - begin
        z = np.where(since < 0, z, speed * since - G * since**2 / 2)
        v = np.where(since < 0, v, speed - G * since)
        begin += 2 * speed / G
    return vectors(0.0, 0.0, 0.1 + z), vectors(0.0, 0.0, v), np.zeros(3)


_RADIUS, _THICK, _TILT = 0.2, 0.02, math.radians(80)
"""Of the disc radius and half the thickness, m, and the angle of its axis with the vertical."""
_ACROSS = _RADIUS**2 / 4 + _THICK**2 / 3


@_case(
    "rolling-disc", "a disc that leans rolls on its rim, round and round",
    {"shape": "disc", "size": (_RADIUS, _THICK), "mass": 1.0,
     "inertia": (_ACROSS, _ACROSS, _RADIUS**2 / 2),
     "orientation": (math.cos(_TILT / 2), 0.0, math.sin(_TILT / 2), 0.0)},
    (Surface("floor", 0.5),),
    wrong={"inertia of a ring": {"ring": 1.0}, "no thickness": {"half": 0.0},
           "no gyroscopic moment": {"share": 0.0}},
    until=1.2, scales=(2.0, 1.0, 5.0), contacts=("T",),
    source="balances of momentum and angular momentum in axes that go round with the disc")
def _rolls_round(t: Array, ring: float = 0.5, half: float = _THICK, share: float = 1.0) -> Motion:
    """Steady rolling on the rim, round a circle at the rate Omega, the axis at `lean`.

    The lowest point of the rim is at c = (c_r, c_z) from the centre, outwards and up. With the spin
    s about the axis it is at rest if the centre goes round at rho = (w_r c_z - w_z c_r)/Omega, w =
    (s sin, Omega + s cos). Weight and the force -m Omega^2 rho turn the angular momentum: Omega L_r
    = -c_r m g - c_z m Omega^2 rho. That is linear in s. `ring` is the polar moment divided by m
    radius^2; with `share` 0 L_r would count for nothing. """
    radius, turning, sin, cos = _RADIUS, 0.5, math.sin(_TILT), math.cos(_TILT)
    c_r, c_z = radius * cos - half * sin, -radius * sin - half * cos
    across, about = radius**2 / 4 + half**2 / 3, ring * radius**2
    fixed, by_spin = -c_r, (sin * c_z - cos * c_r) / turning  # rho = fixed + by_spin s
    gain = share * turning * about * sin + c_z * turning**2 * by_spin
    rest = share * turning**2 * sin * cos * (across - about) - c_r * G - c_z * turning**2 * fixed
    s = rest / gain
    rho, out = fixed + by_spin * s, vectors(np.cos(turning * t), np.sin(turning * t), 0.0)
    along = vectors(-out[:, 1], out[:, 0], 0.0)
    return rho * out - c_z * UP, turning * rho * along, s * sin * out + (turning + s * cos) * UP
# fmt: on
