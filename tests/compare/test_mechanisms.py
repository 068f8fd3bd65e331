"""The exact cases of version 2 are right by equations of motion in space, integrated, and by balances."""

import dataclasses
import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from compare.bench import cases, run
from compare.bench.case import TOLERANCE
from model.kinematics import rotated
from tests.exact_cases import CASES

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


def switched(rates, start, times, ends, change):
    """Integrate to the samples; wherever `ends` falls to zero the state becomes what `change` makes of it."""
    begin, state, out = 0.0, np.array(start, float), []
    while begin < times[-1]:

        def falls(t, x, begin=begin):
            return ends(x) if t > begin + 1e-7 else 1.0

        falls.terminal, falls.direction = True, -1
        found = solve_ivp(rates, (begin, times[-1]), state, events=falls, dense_output=True, max_step=0.02, **SHARP)
        out += [found.sol(t) for t in times[(times > begin) & (times <= found.t[-1])]]
        begin, state = found.t[-1], change(found.y[:, -1])
    return np.array(out)


def sliding(case):
    """Blocks in translation: the lowest on floor or belt, the next one on it, by steps in time.

    The friction of both contacts is found together from velocities at the end of a step, by projection on Coulomb's
    bounds: nothing knows when what sticks or slides. Forces are constant but in the steps of a change.
    """
    (surface,), bodies = case.surfaces, case.bodies[::-1]
    normal = np.array(surface.normal)
    way, h, press = np.array([normal[2], 0.0, -normal[0]]), 1e-4, case.g * normal[2]
    masses, count = [body.mass for body in bodies], len(bodies)
    bounds = [press * surface.friction * sum(masses), press * case.between * masses[-1]][:count]
    belt, v = float(np.dot(surface.velocity, way)), [float(np.dot(body.velocity, way)) for body in bodies]
    s, out, done, f = [0.0] * count, [], 0, [0.0] * (count + 1)  # nothing lies on the highest
    for t in case.times:
        for _ in range(round(t / h) - done):
            free = [w - h * case.g * way[2] for w in v]
            for _ in range(400):
                last = list(f)
                for k in range(count):
                    under = free[k - 1] + h * (f[k - 1] - f[k]) / masses[k - 1] if k else belt
                    slip = free[k] + h * (f[k] - f[k + 1]) / masses[k] - under
                    share = 1 / masses[k] + (1 / masses[k - 1] if k else 0.0)
                    f[k] = min(max(f[k] - slip / (h * share), -bounds[k]), bounds[k])
                if max(abs(now - then) for now, then in zip(f, last, strict=True)) <= 1e-13 * max(bounds):
                    break
            new = [w + h * (f[k] - f[k + 1]) / masses[k] for k, w in enumerate(free)]
            s, v = [x + h * (w + now) / 2 for x, w, now in zip(s, v, new, strict=True)], new
        done = round(t / h)
        out.append(np.concatenate([
            part for k in range(count)[::-1] for part in (bodies[k].position + s[k] * way, v[k] * way, np.zeros(3))
        ]))  # fmt: skip
    return np.array(out)


def swinging(case):
    """The mass on spring and slide: friction keeps its sign until the speed is zero, and then holds if it can."""
    dry, k, m = case.dry, case.spring, case.body.mass

    def begins(x):
        pull = -k * x[0]
        return np.array([x[0], 0.0, 0.0 if abs(pull) <= dry else math.copysign(1.0, pull)])

    def rates(t, x):
        return [x[1], (-k * x[0] - x[2] * dry) / m if x[2] else 0.0, 0.0]

    start = begins([case.body.position[0]])
    found = switched(rates, start, case.times, lambda x: x[1] * x[2] if x[2] else 1.0, begins)
    places = np.array(case.body.position) + np.outer(found[:, 0] - start[0], [1.0, 0.0, 0.0])
    return np.concatenate([places, np.outer(found[:, 1], [1.0, 0.0, 0.0]), np.zeros_like(places)], axis=1)


def rocking(case):
    """The block in its plane, (x, z, angle) and rates, with the force at the edge from what keeps that in place.

    At a blow the impulse at the other edge is what stops it, the first edge bears none.
    """
    body = case.body
    half, (m, moment) = np.array([body.size[0], body.size[2]]), (body.mass, body.inertia[1])

    def arm(angle, side):
        x, z = side * half[0], -half[1]
        return np.array([math.cos(angle) * x + math.sin(angle) * z, -math.sin(angle) * x + math.cos(angle) * z])

    def lever(r):  # a turn w about y moves r by w (r_z, -r_x)
        return np.array([[1, 0, r[1]], [0, 1, -r[0]]])

    def held(r):
        across = lever(r)
        weight = np.diag([m, m, moment])
        return np.block([[weight, -across.T], [across, np.zeros((2, 2))]])

    def rates(t, x):
        r, w = arm(x[2], x[6]), x[5]
        right = np.concatenate([[0, -m * case.g, 0], w * w * r])  # the edge doesn't move: a + alpha x r - w^2 r = 0
        return np.concatenate([x[3:6], np.linalg.solve(held(r), right)[:3], [0.0]])

    def blow(x):
        r = arm(x[2], -x[6])
        after = np.linalg.solve(held(r), np.concatenate([m * x[3:5], [moment * x[5]], [0, 0]]))[:3]
        return np.concatenate([x[:3], after, [-x[6]]])

    lean = 2 * math.asin(body.orientation[2])
    start = [body.position[0], body.position[2], lean, 0, 0, 0, 1.0]
    found = switched(rates, start, case.times, lambda x: x[2] * x[6], blow)
    x, z, _, v_x, v_z, w, _ = found.T
    none = 0 * x
    return np.stack([x, none, z, v_x, none, v_z, none, w, none], axis=1)


def bouncing(case):
    """A fall, integrated from blow to blow."""
    (floor,), radius = case.surfaces, case.body.size[0]
    start = [case.body.position[2], case.body.velocity[2]]
    found = switched(
        lambda t, x: [x[1], -case.g], start, case.times, lambda x: x[0] - radius,
        lambda x: np.array([radius, -floor.restitution * x[1]]),
    )  # fmt: skip
    states = np.zeros((len(found), 9))
    states[:, 2], states[:, 5] = found.T
    return states


def rolling_on_a_rim(case):
    """All equations of a disc in space, its rim's lowest point at rest, with the force there from what keeps it so."""
    body = case.body
    radius, half = body.size

    def to_rim(axis):  # from the centre to the lowest point of the lower rim
        level = axis * axis[2] - [0.0, 0.0, 1.0]
        return radius * level / np.linalg.norm(level) - half * axis

    def rates(t, state):
        quaternion, velocity, spin = state[3:7], state[7:10], state[10:]
        axes = rotated(quaternion, np.eye(3)).T
        inertia, axis = axes @ np.diag(body.inertia) @ axes.T, axes[:, 2]
        c, tiny = to_rim(axis), 1e-6
        turned = tiny * np.cross(spin, axis)
        c_rate = (to_rim(axis + turned) - to_rim(axis - turned)) / (2 * tiny)
        # a = -(alpha x c + spin x c'), force = m (a + g), inertia alpha + spin x inertia spin = c x force
        cross = np.array([[0, -c[2], c[1]], [c[2], 0, -c[0]], [-c[1], c[0], 0]])
        up = np.array([0.0, 0.0, case.g])
        right = np.cross(c, body.mass * (up - np.cross(spin, c_rate))) - np.cross(spin, inertia @ spin)
        alpha = np.linalg.solve(inertia - body.mass * cross @ cross, right)
        a = cross @ alpha - np.cross(spin, c_rate)
        force = body.mass * (a + up)
        assert np.hypot(*force[:2]) < case.surfaces[0].friction * force[2]
        w, *along = quaternion
        turning = 0.5 * np.array([-spin @ along, *(w * spin + np.cross(spin, along))])
        return np.concatenate([velocity, turning, a, alpha])

    start = np.concatenate([body.position, body.orientation, body.velocity, body.spin])
    found = solve_ivp(rates, (0, case.times[-1]), start, t_eval=case.times, **SHARP).y.T
    return np.concatenate([found[:, :3], found[:, 7:]], axis=1)


WAYS = {
    "rolling-disc": (rolling_on_a_rim, 1e-7),
    "tripod-turns": (tripod, 1e-9),
    "plank": (sliding, 2.5e-4),
    "thousandfold": (sliding, 1e-9),
    "belt": (sliding, 2.5e-4),
    "dry-joint": (swinging, 1e-6),
    "rocking-block": (rocking, 1e-6),
    "bounce": (bouncing, 1e-6),
}
"""Another way to each case, and by how much that is wrong: of what starts or stops within a step, a step; of what is
switched, the time after a switch in which none is looked for."""


@pytest.mark.parametrize("name", WAYS)
def test_another_way_leads_to_the_same_motion_and_not_to_a_wrong_one(name):
    case, (way, bound) = CASES[name], WAYS[name]
    found = way(case)
    assert case.error(found) < bound
    for text, states in case.wrong.items():
        assert dataclasses.replace(case, exact=states).error(found) > 2 * TOLERANCE, text


def test_every_new_case_has_another_way():
    assert {case.name for case in cases() if case.needs} | {"rocking-block"} == WAYS.keys()


@pytest.mark.parametrize(("name", "switches"), [("rocking-block", 7), ("bounce", 5)])
def test_no_sample_is_near_a_blow(name, switches):
    """Where an engine is late by a step, it is not to be wrong by the whole jump."""
    case = CASES[name]
    fine = np.arange(1, 20000) * (case.times[-1] / 20000)
    found = (rocking if name == "rocking-block" else bouncing)(dataclasses.replace(case, times=fine))
    jumps = np.abs(np.diff(found[:, switches])) > 0.02
    assert jumps.any()
    assert np.abs(case.times[:, None] - fine[1:][jumps]).min() > 5e-3


OLD = """
def build(case, timestep):
    globals().update(case=case, now=0.0, timestep=timestep)
def step(n):
    globals().update(now=now + n * timestep)
def state():
    return case.exact[abs(case.times - now).argmin()].reshape(-1, 3)
"""


def test_an_adapter_of_version_1_takes_what_it_took_and_is_not_asked_for_more(tmp_path, monkeypatch):
    (tmp_path / "of_version_1.py").write_text(OLD)
    (tmp_path / "of_version_2.py").write_text(f"FEATURES = ('two bodies',){OLD}")
    monkeypatch.syspath_prepend(tmp_path)
    assert run(CASES["box-stops"], "of_version_1").passed
    asked = run(CASES["plank"], "of_version_1")
    assert asked.skipped == "of_version_1 doesn't say in FEATURES that it can do this: two bodies"
    assert not asked.errors
    assert run(CASES["plank"], "of_version_2").passed
