"""Exact cases of version 2: on feet, one body on another, on a belt, on a joint, on an edge or a rim, after a bounce.

Like `compare.bench.closed_forms`: courses are functions of time and of the constants that a wrong engine or theory
would have otherwise. Those of the tripod and of what it stands on are quadratures, to 1e-12.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp
from scipy.special import ellipj, ellipk, ellipkinc

from compare.adapters.scene import Surface
from compare.bench.case import Case
from compare.bench.closed_forms import SPEED_ALONE, UP, WAY, G, along, block, closed_form, slope, sphere
from model.arrays import Array

_Motion = tuple[Array, ...]


def _tripod() -> Case:
    mu, speed, spin, mass = 0.3, 1.5, 10.0, 1.0
    foot, out, down = size = 0.01, 0.1, 0.04
    moments = (0.004, 0.004, 0.006)
    angles = math.tau / 3 * np.arange(3)

    def courses(t: Array, mu: float = mu, height: float = foot + down, share: float = 1.0) -> _Motion:
        """Position, velocity and spin of a tripod each foot of which bears what keeps it from tilting.

        The loads N of three feet at p follow from sum N = m g and the two moments of weight and friction about the
        centre, at `height`; `share` 0 gives each a third of the weight.
        """

        def rates(t: float, state: Array) -> Array:
            _, _, turn, *velocity, spin = state
            p = out * np.array([np.cos(angles + turn), np.sin(angles + turn)])
            slip = np.array(velocity)[:, None] + spin * np.array([-p[1], p[0]])
            slip /= np.hypot(*slip)
            tilting = p - share * height * mu * slip
            loads = np.linalg.solve(np.vstack([np.ones(3), tilting if share else p]), [mass * G, 0.0, 0.0])
            friction = -mu * loads * slip
            torque = float(np.sum(p[0] * friction[1] - p[1] * friction[0]))
            return np.array([*velocity, spin, *friction.sum(axis=1) / mass, torque / moments[2]])

        start, end = np.array([0.0, 0.0, 0.0, speed, 0.0, spin]), float(max(t[-1], 1e-3))
        found = solve_ivp(rates, (0.0, end), start, method="DOP853", rtol=1e-13, atol=1e-14, dense_output=True)
        assert found.sol is not None
        x, y, _, v_x, v_y, turning = found.sol(t)
        none = 0 * t
        place = np.stack([x, y, none + foot + down], axis=1)
        return place, np.stack([v_x, v_y, none], axis=1), np.outer(turning, UP)

    return closed_form(
        "tripod-turns",
        "three legs that slide and turn: each bears what keeps it from tilting, and slows it along its own slip",
        {"shape": "tripod", "size": size, "mass": mass, "inertia": moments}, (Surface("floor", mu),), courses,
        wrong={"each leg bears a third": {"share": 0.0}, "friction 5 % too weak": {"mu": 0.95 * mu},
               "a centre twice as high": {"height": 2 * (foot + down)}},
        until=0.3, scales=(0.1, 0.5, 5.0), contacts=("S",),
        source="Newton and Euler in the plane, loads from the balance of moments, integrated to 1e-13",
    )  # fmt: skip


PLANK = (0.6, 0.2, 0.02)
"""Half edges of what another body stands on, m."""


def plate(mass: float, tilt: float = 0.0, size: tuple[float, float, float] = PLANK) -> dict[str, Any]:
    """A box of a size and mass, turned about the y axis, as fields of `Body`."""
    x, y, z = (2 * half for half in size)
    moments = tuple(mass / 12 * sum(pair) for pair in ((y * y, z * z), (x * x, z * z), (x * x, y * y)))
    return block(tilt) | {"size": size, "mass": mass, "inertia": moments}


def _plank() -> Case:
    above, below, speed, mass = 0.4, 0.1, 2.0, 2.0

    def dragged(t: Array, above: float = above, below: float = below, load: float = 1.0) -> _Motion:
        """A block that slides on a plank slows by mu g and draws the plank until both go together, then stop.

        `load` is what of the block's weight the floor bears under the plank.
        """
        a = max(above * G - below * (mass + load) * G, 0.0) / mass
        meet = speed / (above * G + a)
        common, brake = a * meet, below * G
        stop = common / brake
        early, late = np.minimum(t, meet), np.clip(t - meet, 0.0, stop)
        ours = speed * early - above * G * early**2 / 2
        theirs, after = a * early**2 / 2, common * late - brake * late**2 / 2
        v, w = speed - above * G * early - brake * late, a * early - brake * late
        height = PLANK[2] * UP
        up = 2 * height + block()["size"][2] * UP
        return *along(WAY, ours + after, v, 0 * t, up - 0.3 * WAY), *along(WAY, theirs + after, w, 0 * t, height)

    meet = speed / (above * G + (above - below * (mass + 1)) * G / mass)
    stop = meet + (speed - above * G * meet) / (below * G)

    return closed_form(
        "plank", "a block that is pushed off on a plank draws it along, until both go together and stop on the floor",
        block(), (Surface("floor", below),), dragged,
        wrong={"the floor doesn't feel the block": {"load": 0.0},
               "friction between them 5 % too weak": {"above": 0.95 * above}, "the plank is held": {"below": above}},
        until=1.2, scales=(0.2, 0.5, math.inf), contacts=("SS", meet, "SR", stop, "RR"),
        source="Coulomb's law and Newton's third: m mu g drives the plank, mu' (m + M) g brakes it",
        under=plate(mass), between=above,
    )  # fmt: skip


def _heavy_on_light() -> Case:
    tilt = math.atan(0.9 * 0.5)

    def stays(t: Array, mu: float = 0.5) -> _Motion:
        way, normal = slope(tilt)
        a = max(G * (math.sin(tilt) - mu * math.cos(tilt)), 0.0)
        under, half = 0.1, 0.2
        low, high = under * np.array(normal), (2 * under + half) * np.array(normal)
        return *along(way, a * t**2 / 2, a * t, 0 * t, high), *along(way, a * t**2 / 2, a * t, 0 * t, low)

    return closed_form(
        "thousandfold",
        "a block of 1000 kg on one of 1 kg on a slope whose tangent is 0.9 of their friction: neither must move",
        plate(1000.0, tilt, (0.2, 0.2, 0.2)), (Surface("slope", 0.5, normal=slope(tilt)[1]),), stays,
        wrong={"a threshold at 0.85 of Coulomb's": {"mu": 0.425}},
        until=2.0, scales=SPEED_ALONE, contacts=("RR",),
        source="Coulomb's law: whatever the masses, tan < mu holds both",
        under=plate(1.0, tilt, (0.2, 0.2, 0.1)), between=0.5,
    )  # fmt: skip


def _belt() -> Case:
    tilt, mu, belt, speed = math.atan(0.3), 0.5, 1.0, 0.8
    way, normal = slope(tilt)

    def rides(t: Array, mu: float = mu, belt: float = belt) -> _Motion:
        """A block that slides down a belt is slowed by g (mu cos - sin) until it goes up with the belt."""
        a = G * (mu * math.cos(tilt) - math.sin(tilt))
        slid = np.minimum(t, (speed + belt) / a)
        s = speed * slid - a * slid**2 / 2 - belt * (t - slid)
        return along(way, s, speed - a * slid, 0 * t, block()["size"][2] * np.array(normal))

    caught = (speed + belt) / (G * (mu * math.cos(tilt) - math.sin(tilt)))
    return closed_form(
        "belt", "a block slides down an inclined belt that runs up, stops and is carried off by it",
        block(tilt), (Surface("belt", mu, normal=normal, velocity=tuple((-belt * way).tolist())),), rides,
        wrong={"the belt stands": {"belt": 1e-9}, "friction 5 % too strong": {"mu": 1.05 * mu}},
        until=2.0, scales=(0.5, 0.5, math.inf), contacts=("S", caught, "R"),
        source="Coulomb's law against the slip on the belt, integrated by hand",
    )  # fmt: skip


def _joint() -> Case:
    stiffness, dry, start = 100.0, 4.0, 0.3

    def swings(t: Array, dry: float = dry, stiffness: float = stiffness) -> _Motion:
        """Half swings about -+ dry/stiffness: each ends 2 dry/stiffness nearer, until the spring is too weak."""
        rate, shift = math.sqrt(stiffness), dry / stiffness
        half = np.floor(t * rate / math.pi)
        last = max(math.ceil((start / shift - 1) / 2), 0) if shift else math.inf
        side, stopped = 1 - 2 * (np.minimum(half, last) % 2), half >= last
        width = start - (2 * np.minimum(half, last) + 1) * shift
        phase = rate * t - math.pi * half
        s = side * (shift + width * np.cos(np.where(stopped, 0.0, phase)))
        return along(WAY, s, np.where(stopped, 0.0, -side * width * rate * np.sin(phase)), 0 * t, UP)

    return closed_form(
        "dry-joint",
        "a mass on a spring and a slide with dry friction: each half swing is shorter by 2 F/k, then it sticks",
        sphere(), (), swings, wrong={"friction 5 % too weak": {"dry": 0.95 * dry}, "none": {"dry": 0.0}},
        until=1.6, scales=(0.3, 3.0, math.inf), contacts=("S", 4 * math.pi / 10, "R"),
        source="m x'' = -k x -+ F: half circles in the phase plane about -+ F/k",
        spring=stiffness, joint=(1.0, 0.0, 0.0), dry=dry,
    )  # fmt: skip


def _rocking() -> Case:
    half_x, half_z, lean = 0.25, 1.0, 0.12
    size = (half_x, 0.5, half_z)
    arm, alpha = math.hypot(half_x, half_z), math.atan2(half_x, half_z)
    body = plate(1.0, lean, size)
    about = body["inertia"][1] + arm**2

    def rocks(t: Array, kept: float = 1 - arm**2 / about * (1 - math.cos(2 * alpha)), moment: float = about) -> _Motion:
        """A pendulum upside down about the edge it stands on: from rest at an angle to upright and, slower, beyond.

        With the angle psi of the centre from straight below the edge, psi = pi - alpha + lean, it is sin(psi/2) =
        k sn(K - p t, k), p^2 = m g arm/moment. Each blow on the other edge leaves `kept` of the angular velocity.
        """
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
        tilt = np.sign(angle) * alpha - angle  # of the way from the edge to the centre, from the vertical
        place = np.stack([np.sign(angle) * half_x - arm * np.sin(tilt), 0 * t, arm * np.cos(tilt)], axis=1)
        velocity = np.stack([arm * np.cos(tilt) * rate, 0 * t, arm * np.sin(tilt) * rate], axis=1)
        return place, velocity, np.outer(rate, [0.0, 1.0, 0.0])

    return closed_form(
        "rocking-block", "a block rocks from edge to edge, and loses the same share of its speed at every blow",
        body, (Surface("floor", 1.0),), rocks,
        wrong={"nothing is lost in a blow": {"kept": 1.0}, "inertia of a point": {"moment": arm**2}},
        until=0.8, scales=(0.2, 1.0, 1.0), contacts=("T",),
        source="Housner, Bull. Seismol. Soc. Am. 53 (1963): a pendulum upside down, momentum about the new edge",
    )  # fmt: skip


def _bounce() -> Case:
    share, drop = 0.7, 1.8

    def bounces(t: Array, share: float = share) -> _Motion:
        """A ball falls and bounces in parabolas: each blow leaves `share` of the speed."""
        speed, begin = math.sqrt(2 * G * drop), math.sqrt(2 * drop / G)
        z, v = drop - G * t**2 / 2, -G * t
        while begin < t[-1]:
            speed *= share
            since = t - begin
            z, v = np.where(since < 0, z, speed * since - G * since**2 / 2), np.where(since < 0, v, speed - G * since)
            begin += 2 * speed / G
        none = 0 * t
        return np.stack([none, none, 0.1 + z], axis=1), np.stack([none, none, v], axis=1), np.zeros((len(t), 3))

    return closed_form(
        "bounce", "a ball that falls on a floor leaves it with 0.7 of its speed, again and again",
        sphere(), (Surface("floor", 0.5, restitution=share),), bounces,
        wrong={"0.65 of it": {"share": 0.65}, "all of it": {"share": 1.0}},
        until=2.0, scales=(1.0, 6.0, 10.0), contacts=("N",),
        source="Newton's law of restitution, parabolas between",
    )  # fmt: skip


def _disc() -> Case:
    mass, radius, thickness, lean, turning = 1.0, 0.2, 0.02, math.radians(80), 0.5
    sin, cos = math.sin(lean), math.cos(lean)

    def rolls(t: Array, ring: float = 0.5, half: float = thickness, share: float = 1.0) -> _Motion:
        """Steady rolling on the rim, round a circle at the rate Omega, the disc's axis at `lean` from the vertical.

        The lowest point of the rim is at c = (c_r, c_z) from the centre, outwards and up. With the spin s about the
        axis it is at rest if the centre goes round at rho = (w_r c_z - w_z c_r)/Omega, w = (s sin, Omega + s cos).
        Weight and the force -m Omega^2 rho turn the angular momentum: Omega L_r = -c_r m g - c_z m Omega^2 rho. That is
        linear in s. `ring` is the polar moment divided by m radius^2; with `share` 0 L_r would count for nothing.
        """
        c_r, c_z = radius * cos - half * sin, -radius * sin - half * cos
        across, about = mass * (radius**2 / 4 + half**2 / 3), ring * mass * radius**2
        fixed, by_spin = -c_r, (sin * c_z - cos * c_r) / turning  # rho = fixed + by_spin s
        gain = share * turning * about * sin + c_z * mass * turning**2 * by_spin
        rest = share * turning**2 * sin * cos * (across - about) - c_r * mass * G - c_z * mass * turning**2 * fixed
        s = rest / gain
        rho, none = fixed + by_spin * s, 0 * t
        out = np.stack([np.cos(turning * t), np.sin(turning * t), none], axis=1)
        along = np.stack([-out[:, 1], out[:, 0], none], axis=1)
        return rho * out - c_z * UP, turning * rho * along, s * sin * out + (turning + s * cos) * UP

    across = mass * (radius**2 / 4 + thickness**2 / 3)
    return closed_form(
        "rolling-disc", "a disc that leans rolls on its rim, round and round",
        {"shape": "disc", "size": (radius, thickness), "mass": mass,
         "inertia": (across, across, mass * radius**2 / 2),
         "orientation": (math.cos(lean / 2), 0.0, math.sin(lean / 2), 0.0)},
        (Surface("floor", 0.5),), rolls,
        wrong={"inertia of a ring": {"ring": 1.0}, "no thickness": {"half": 0.0},
               "no gyroscopic moment": {"share": 0.0}},
        until=1.2, scales=(2.0, 1.0, 5.0), contacts=("T",),
        source="balances of momentum and angular momentum in axes that go round with the disc",
    )  # fmt: skip


MECHANISMS = (_tripod, _plank, _heavy_on_light, _belt, _joint, _rocking, _bounce, _disc)
"""Functions that make these cases."""
