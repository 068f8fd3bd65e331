"""Exact contact cases are right by equations of motion in space, integrated, and would notice a
wrong engine."""

import dataclasses
import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import analytic
from compare.bench import exact
from compare.bench.case import TIME_STEPS, TOLERANCE, VERSION
from model import Case as Kinds
from model.kinematics import rotated
from tests.exact_cases import CASES, LISTED

NAMES = [name for name, *_ in LISTED["cases"]]
UP = np.array([0.0, 0.0, 1.0])
SHARP = {"method": "DOP853", "rtol": 1e-11, "atol": 1e-12}


@pytest.mark.parametrize("name", NAMES)
def test_a_case_is_whole_and_no_sample_near_an_impact(name):
    case, n = CASES[name], len(CASES[name].times)
    assert case.exact.shape == (n, 9 * len(case.bodies))
    assert len(case.contacts) == n
    assert case.bound <= 1e-10
    assert case.about
    assert case.source
    for step in TIME_STEPS:  # every sample falls on a step
        assert np.allclose(case.times / step, np.rint(case.times / step), atol=1e-9)
    assert case.error(case.exact) == 0
    gaps, slips = case.touching(case.exact)
    assert np.abs(gaps[case.in_contact("RS")]).max(initial=0.0) < 1e-12
    assert (gaps[case.in_contact("N")] > 0).all()
    assert gaps.shape == case.in_contact("R").shape
    assert slips[case.in_contact("R")].max(initial=0.0) < 1e-12
    assert slips[case.in_contact("S")].min(initial=math.inf) > 1e-6
    assert case.wrong
    for text, states in case.wrong.items():
        assert case.error(states) > 2.5 * TOLERANCE, text
    # No sample is near an impact: where an engine is late by a step, it is not to be wrong by the
    # whole jump.
    impacts = [time for time, jumps in zip(*changes(case), strict=True) if jumps]
    if what := {"rocking-block": 7, "bounce": 5}.get(name):  # what jumps there of a state
        fine = np.arange(1, 20000) * (case.times[-1] / 20000)
        found = WAYS[name][0](dataclasses.replace(case, times=fine))[:, what]
        impacts = fine[1:][np.abs(np.diff(found)) > 0.02]
        assert len(impacts)
    assert all(np.abs(case.times - time).min() > 5e-3 for time in impacts)


def test_the_list_that_is_shown_is_that_of_the_cases():
    """templates/cases.json spares the list the simulations."""
    assert {"version": VERSION, "cases": exact.listing()} == LISTED


def newton(case, touching=None, friction=()):
    """The rates of a body's place, quaternion, velocity and spin in world axes, (13,), by Newton
    and Euler.

    A second way to the motions, which knows nothing of the variables in which they are known.

    `touching` gives of place and quaternion for each contact its arm from the centre, its normal
    and the velocity of what it touches; `friction` the coefficients, None for what rolls. All
    forces are solved for together from what keeps contacts closed and, where they roll, without
    slip; least squares where that leaves some open."""
    body, near = case.body, 1e-6  # s, half the time of a difference

    def rates(t, state):
        (w, *axis), velocity, spin = state[3:7], state[7:10], state[10:]
        turning = 0.5 * np.array([-spin @ axis, *(w * spin + np.cross(spin, axis))])
        begin = np.concatenate([velocity, turning])
        axes = rotated(state[3:7], np.eye(3)).T
        inertia = axes @ np.diag(body.inertia) @ axes.T
        linear = np.array(case.force(t, state[:3], velocity)) / body.mass - case.g * UP
        # without contacts
        found = np.concatenate([linear, np.linalg.solve(inertia, -np.cross(spin, inertia @ spin))])
        if not friction:
            return np.concatenate([begin, found])
        now, after, before = (np.array(touching(state[:7] + d * begin)) for d in (0.0, near, -near))
        crosses = [np.cross(arm, np.eye(3)).T for arm, _, _ in now]
        # rows of what all forces must come to
        of_forces = np.vstack(
            [
                np.hstack([np.eye(3) / body.mass] * len(now)),
                np.linalg.solve(inertia, np.hstack(crosses)),
            ]
        )
        rows, right = [], []
        for k, ((arm, normal, under), rate) in enumerate(
            zip(now, (after - before) / (2 * near), strict=True)
        ):
            slip, of_slip = (
                velocity + np.cross(spin, arm) - under,
                np.hstack([np.eye(3), -crosses[k]]),
            )
            rest = rate[2] - np.cross(spin, rate[0]) - of_slip @ found
            if friction[k] is None:
                rows.append(of_slip @ of_forces)
                right.append(rest)
                continue
            along = slip - (slip @ normal) * normal
            sliding = normal - friction[k] * along / np.linalg.norm(along)
            law = np.eye(3) - np.outer(sliding, normal)
            rows += [normal[None] @ of_slip @ of_forces, np.kron(np.eye(len(now))[k], law)]
            right += [[normal @ rest - rate[1] @ slip], np.zeros(3)]
        forces = np.linalg.lstsq(np.vstack(rows), np.concatenate(right), rcond=1e-12)[0]
        return np.concatenate([begin, found + of_forces @ forces])

    return rates


def moved(case, rates, more=(), ends=lambda x: 1.0, change=None):
    """Place, velocity and spin of a body at the samples; `more` than they may belong to the state.

    Wherever `ends` falls to zero the state becomes what `change` makes of it."""
    body = case.body
    start = [*body.position, *body.orientation, *body.velocity, *body.spin, *more]
    return np.delete(switched(rates, start, case.times, ends, change)[:, :13], range(3, 7), axis=1)


def switched(rates, start, times, ends, change):
    begin, state, out = 0.0, np.array(start, float), []
    while begin < times[-1]:

        def falls(t, x, begin=begin):
            return ends(x) if t > begin + 1e-7 else 1.0

        falls.terminal, falls.direction = True, -1
        how = SHARP | {"events": falls, "dense_output": True, "max_step": 0.02}
        found = solve_ivp(rates, (begin, times[-1]), state, **how)
        out += [found.sol(t) for t in times[(times > begin) & (times <= found.t[-1])]]
        begin, state = found.t[-1], change and change(found.y[:, -1])
    return np.array(out)


def ball(case, letters):
    """A sphere, or a block that doesn't turn and bears at its centre, which touches as these
    letters say."""
    own = [pair for pair in zip(case.surfaces, letters, strict=True) if pair[1] != "N"]

    def touching(place):
        for surface, _ in own:
            normal = np.array(surface.normal)
            if surface.radius:
                normal = -place[:3] * [1, 1, 0] / np.hypot(*place[:2])
            arm = -case.body.size[0] * (case.body.shape == "sphere") * normal
            yield arm, normal, surface.turning * np.cross(UP, place[:3] + arm)

    friction = [surface.friction if letter == "S" else None for surface, letter in own]
    return newton(case, lambda place: [*touching(place)], friction)


def ellipse(case):
    """A block in translation by the midpoint rule, under that force of an ellipse, of many, which
    takes the most power."""
    (surface,), h = case.surfaces, 1e-3
    angles = np.arange(0.0, math.tau, 2e-4)
    forces = case.g * np.stack(
        [surface.friction * np.cos(angles), surface.across * np.sin(angles), 0 * angles], axis=1
    )

    def brakes(v):
        return forces[(forces @ v).argmax()]

    x, v, out = np.array(case.body.position), np.array(case.body.velocity), []
    for k in range(1, round(case.times[-1] / h) + 1):
        middle = v - h / 2 * brakes(v)
        x, v = x + h * middle, v - h * brakes(middle)
        if np.isclose(case.times, k * h).any():
            out.append(np.concatenate([x, v, 0 * v]))
    return np.array(out)


def floor(arms):
    """A floor at rest, touched at these arms of a place."""
    return lambda place: [(arm, UP, 0 * UP) for arm in arms(place)]


def tripod(case):
    """On three feet, each of which bears what keeps it on the floor."""
    feet = floor(lambda place: rotated(place[3:], case.body.parts) - case.body.size[0] * UP)
    return moved(case, newton(case, feet, 3 * [case.surfaces[0].friction]))


def disc(case):
    """On the lowest point of its lower rim."""
    radius, half = case.body.size

    def lowest(place):
        axis = rotated(place[3:], UP)
        level = axis * axis[2] - UP
        return [radius * level / np.linalg.norm(level) - half * axis]

    return moved(case, newton(case, floor(lowest), [None]))


def rocking(case):
    """On an edge, to the side that is the last of the state; a hit of the other one has no moment
    about that."""
    body = case.body

    def corner(state, side):
        return rotated(state[3:7], np.array(body.size) * [side, 0, -1])

    def rates(t, state):
        edge = floor(lambda place: [corner(place, state[13])])
        return np.append(newton(case, edge, [None])(t, state[:13]), 0)

    def impact(state):
        arm, moment = corner(state, -state[13]), body.inertia[1]
        about = moment * state[11] - body.mass * np.cross(arm, state[7:10])[1]
        spin = np.array([0, about / (moment + body.mass * arm @ arm), 0])
        return np.concatenate([state[:7], -np.cross(spin, arm), spin, [-state[13]]])

    return moved(case, rates, [1.0], lambda x: x[5] * x[13], impact)


def bouncing(case):
    """A fall, from impact to impact."""
    back = np.where(np.arange(13) == 9, -case.surfaces[0].restitution, 1.0)
    return moved(case, newton(case), (), lambda x: x[2] - case.body.size[0], back.__mul__)


def swinging(case):
    """The mass on spring and slide: friction keeps its sign until the speed is zero, and then holds
    if it can."""
    dry, k, m = case.dry, case.spring, case.body.mass

    def begins(x):
        return np.array([x[0], 0.0, 0.0 if abs(k * x[0]) <= dry else -math.copysign(1.0, x[0])])

    def rates(t, x):
        return [x[1], (-k * x[0] - x[2] * dry) / m if x[2] else 0.0, 0.0]

    start = begins([case.body.position[0]])
    found = switched(rates, start, case.times, lambda x: x[1] * x[2] if x[2] else 1.0, begins)
    states = np.tile([*case.body.position, *np.zeros(6)], (len(found), 1))
    states[:, 0] += found[:, 0] - start[0]
    states[:, 3] = found[:, 1]
    return states


def sliding(case):
    """Blocks in translation: the lowest on floor or belt, the next one on it, by steps in time.

    The friction of both contacts is found together from velocities at the end of a step, by
    projection on Coulomb's bounds: nothing knows when what sticks or slides. Forces are constant
    but in the steps of a change."""
    (surface,), bodies, h = case.surfaces, case.bodies[::-1], 1e-4
    normal, masses = np.array(surface.normal), np.array([body.mass for body in bodies])
    way, press, count = np.array([normal[2], 0.0, -normal[0]]), case.g * normal[2], len(bodies)
    bounds = press * np.array([surface.friction * masses.sum(), case.between * masses[-1]])[:count]
    slips = np.eye(count) - np.eye(count, k=-1)  # of velocities: each body's past what is under it
    belt = np.eye(count)[0] * np.dot(surface.velocity, way)
    answer = h * slips / masses @ slips.T  # of slips to friction
    v, out, done = np.array([body.velocity for body in bodies]) @ way, [], 0
    s, f = np.zeros((2, count))
    for t in case.times:
        for _ in range(round(t / h) - done):
            free = v - h * case.g * way[2]
            for _ in range(400):
                last = f.copy()
                for k in range(count):
                    slip = (slips @ free - belt + answer @ f)[k]
                    f[k] = min(max(f[k] - slip / answer[k, k], -bounds[k]), bounds[k])
                if np.abs(f - last).max() <= 1e-13 * bounds.max():
                    break
            new = free + h * slips.T @ f / masses
            s, v = s + h * (v + new) / 2, new
        done = round(t / h)
        places = [body.position for body in bodies] + np.outer(s, way)
        states = np.stack([places, np.outer(v, way), np.outer(0 * v, way)], axis=1)
        out.append(np.ravel(states[::-1]))
    return np.array(out)


WAYS = {
    "rolling-disc": (disc, 1e-7),
    "tripod-turns": (tripod, 1e-9),
    "plank": (sliding, 2.5e-4),
    "thousandfold": (sliding, 1e-9),
    "belt": (sliding, 2.5e-4),
    "dry-joint": (swinging, 1e-6),
    "rocking-block": (rocking, 1e-6),
    "bounce": (bouncing, 1e-6),
    "anisotropic": (ellipse, 1e-5),
    "tripod-off-axes": (tripod, 1e-9),
}
"""Of the cases since version 2, and by how much each is wrong: of what starts or stops within a
step, a step; of what is switched, the time after a switch in which none is looked for; of the
ellipse, the square of a step divided by the time in which the motion changes."""


@pytest.mark.parametrize("name", WAYS)
def test_another_way_leads_to_the_same_motion_and_not_to_a_wrong_one(name):
    case, (way, bound) = CASES[name], WAYS[name]
    found = way(case)
    assert case.error(found) < bound
    for text, states in case.wrong.items():
        assert dataclasses.replace(case, exact=states).error(found) > 2 * TOLERANCE, text


def changes(case):
    """Times of all changes of case, and whether a contact closes or opens there."""
    if not case.motion:
        return np.empty(0), []
    p, x0 = case.motion
    events = analytic.simulate(p, x0, case.times[-1], rtol=1e-12).events
    open_before = np.array(["N" in Kinds(each).name for each in events.from_case], bool)
    return events.time, open_before & (events.from_case != events.to_case)


@pytest.mark.parametrize("name", [name for name in NAMES if name not in WAYS])
def test_a_ball_moves_so_from_every_sixth_sample_to_the_next(name):
    """Where the contacts are the same all the while and the body moves."""
    case = CASES[name]
    (events, _), checked = changes(case), 0
    for k in range(1, len(case.times), 6):
        (begin, end), letters = case.times[k - 1 : k + 1], case.contacts[k]
        changed = letters != case.contacts[k - 1] or ((begin < events) & (events < end)).any()
        if changed or not np.any(case.exact[k - 1, 3:]):
            continue
        start = np.insert(case.exact[k - 1], 3, case.body.orientation)
        found = solve_ivp(ball(case, letters), (begin, end), start, **SHARP | {"rtol": 1e-10})
        off = np.delete(found.y[:, -1], range(3, 7)) - case.exact[k]
        off = np.linalg.norm(off.reshape(3, 3), axis=1) / case.scales
        assert off.max() < 1e-9, (end, letters)
        checked += 1
    assert checked >= 2 or not np.any(case.exact[-1, 3:])


SHARES = {
    "block-rests": 0.9,
    "block-slides": 1.25,
    "pinched-block": 0.5,
    "groove-rests": 0.9,
    **{f"held-at-{degrees}": 0.9 for degrees in (30, 45)},
    **{f"gives-way-at-{degrees}": 1.25 for degrees in (30, 45)},
}


@pytest.mark.parametrize(("name", "share"), SHARES.items())
def test_rest_needs_the_share_of_friction_that_is_said(name, share):
    """Statics: normal forces balance what acts across the surfaces, and friction what is left."""
    case = CASES[name]
    body, normals = case.body, np.array([surface.normal for surface in case.surfaces])
    acts = np.array(case.force(0.0, np.array(body.position), np.zeros(3))) - case.g * body.mass * UP
    loads = -np.linalg.lstsq(normals.T, acts)[0]
    assert (loads > 0).all()
    limit = sum(surface.friction * load for surface, load in zip(case.surfaces, loads, strict=True))
    assert np.linalg.norm(acts + loads @ normals) / limit == pytest.approx(share, rel=1e-12)
