"""The exact cases of version 2 by other ways: equations of motion in space, integrated, and balances."""

import dataclasses
import json
import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from compare.bench import cases, run
from compare.bench.case import TOLERANCE, VERSION, read
from compare.commands import cli
from model import InputError, StorageError
from model.kinematics import rotated

CASES = {case.name: case for case in cases()}
SHARP = {"method": "DOP853", "rtol": 1e-11, "atol": 1e-12}


def tripod(case):
    """All six equations of a body in space, with three loads that keep the feet on the floor, unknown together.

    State: position, quaternion, velocity, spin in world axes. Nothing is used of what the legs bear or where they are
    but their places on the body.
    """
    body, (floor,) = case.body, case.surfaces

    def rates(t, state):
        quaternion, velocity, spin = state[3:7], state[7:10], state[10:]
        axes = rotated(quaternion, np.eye(3)).T
        inertia = axes @ np.diag(body.inertia) @ axes.T
        arms = rotated(quaternion, body.parts) - [0.0, 0.0, body.size[0]]
        slip = (velocity + np.cross(spin, arms))[:, :2]
        push = np.column_stack([-floor.friction * slip / np.linalg.norm(slip, axis=1)[:, None], np.ones(3)])
        matrix, right = np.zeros((9, 9)), np.zeros(9)
        matrix[:3, :3], matrix[:3, 6:] = body.mass * np.eye(3), -push.T
        matrix[3:6, 3:6], matrix[3:6, 6:] = inertia, -np.cross(arms, push).T
        for k, arm in enumerate(arms):  # its vertical acceleration: a + alpha x arm
            matrix[6 + k, :6] = [0, 0, 1, arm[1], -arm[0], 0]
        right[2], right[3:6] = -body.mass * case.g, -np.cross(spin, inertia @ spin)
        found = np.linalg.solve(matrix, right)
        assert (found[6:] > 0).all()
        w, *axis = quaternion
        turning = 0.5 * np.array([-spin @ axis, *(w * spin + np.cross(spin, axis))])
        return np.concatenate([velocity, turning, found[:6]])

    start = np.concatenate([body.position, body.orientation, body.velocity, body.spin])
    found = solve_ivp(rates, (0, case.times[-1]), start, t_eval=case.times, **SHARP).y.T
    return np.concatenate([found[:, :3], found[:, 7:]], axis=1)


def steps(rates, start, switches, times):
    """Integrate to the samples; at each zero of one of `switches`, the state becomes what that makes of it.

    Rates (t, state, mode); switches: by mode, (function of t and state, next mode, what the state becomes).
    """
    begin, mode, state, out = 0.0, "start", np.array(start, float), []
    while begin < times[-1]:
        zero, after, change = switches.get(mode, (None, None, None))
        watch = None
        if zero:

            def watch(t, x, zero=zero, begin=begin):
                return zero(t, x) if t > begin + 1e-9 else -1.0

            watch.terminal, watch.direction = True, 1
        found = solve_ivp(
            lambda t, x, mode=mode: rates(t, x, mode),
            (begin, times[-1]), state, events=watch, dense_output=True, max_step=0.01, **SHARP,
        )  # fmt: skip
        own = times[(times > begin) & (times <= found.t[-1])]
        out += [found.sol(t) for t in own]
        begin = found.t[-1]
        if found.status == 1:
            mode, state = after, change(found.y[:, -1])
    return np.array(out)


def sliding(case):
    """Blocks in translation along a straight way by Newton's law: the lowest on the floor or belt, the next on it.

    Friction is Coulomb's by projection: the least acceleration that its bound allows, solved for both bodies together
    in small steps of the velocities, implicitly; extrapolated to no step.
    """
    way = np.array([1.0, 0.0, 0.0]) if case.surfaces[0].normal[2] == 1 else None
    surface = case.surfaces[0]
    if way is None:
        n = np.array(surface.normal)
        way = np.array([n[2], 0.0, -n[0]])
    pull = -case.g * way[2]
    press = case.g * surface.normal[2]
    bodies = case.bodies[::-1]  # from below
    masses = [body.mass for body in bodies]
    bounds = [surface.friction * sum(masses) * press, *([case.between * masses[1] * press] if case.under else [])]
    belt = float(np.dot(surface.velocity, way))

    def march(h):
        v = np.array([np.dot(body.velocity, way) for body in bodies])
        s, out, done = np.zeros(len(v)), [], 0
        for t in case.times:
            while done < round(t / h):
                free, f = v + h * pull, np.zeros(len(bounds))
                for _ in range(60 if len(bounds) > 1 else 1):  # Gauss and Seidel over the contacts
                    for k in range(len(f)):
                        now = free + h * (f - np.append(f[1:], 0.0)) / masses
                        below = belt if k == 0 else now[k - 1]
                        share = 1 / masses[k] + (1 / masses[k - 1] if k else 0.0)
                        f[k] = np.clip(f[k] - (now[k] - below) / (h * share), -bounds[k], bounds[k])
                new = free + h * (f - np.append(f[1:], 0.0)) / masses
                s, v, done = s + h * (v + new) / 2, new, done + 1
            out.append([s, v])
        return np.array(out)

    fine = march(1e-3)  # what changes does so within a step: the rest is exact, since forces are constant
    parts = []
    for k in range(len(bodies))[::-1]:
        start = np.array(bodies[k].position)
        parts += [start + np.outer(fine[:, 0, k], way), np.outer(fine[:, 1, k], way), np.zeros((len(fine), 3))]
    return np.concatenate(parts, axis=1)


def swinging(case):
    """The mass on spring and slide: the sign of friction is that of the last half swing until the speed is zero."""

    def rates(t, x, mode):
        pull = -case.spring * x[0]
        if mode == "stuck":
            return [0.0, 0.0]
        sign = 1.0 if mode == "right" else -1.0
        return [x[1], (pull - sign * case.dry) / case.body.mass]

    times, state, mode, begin, out = case.times, np.array([case.body.position[0], 0.0]), "", 0.0, []
    while begin < times[-1]:
        pull = -case.spring * state[0]
        mode = "stuck" if abs(pull) <= case.dry else "right" if pull > 0 else "left"

        def stops(t, x, mode=mode, begin=begin):
            return 1.0 if t < begin + 1e-6 else x[1] * (1 if mode == "right" else -1)

        stops.terminal, stops.direction = True, -1
        found = solve_ivp(rates, (begin, times[-1]), state, args=(mode,), events=None if mode == "stuck" else [
            lambda t, x, mode, stops=stops: stops(t, x)], dense_output=True, max_step=0.01, **SHARP)  # fmt: skip
        out += [found.sol(t) for t in times[(times > begin) & (times <= found.t[-1])]]
        begin, state = found.t[-1], np.array([found.y[0, -1], 0.0])
    return np.array(out)
