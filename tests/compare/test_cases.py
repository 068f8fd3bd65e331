"""Exact contact cases are right by other ways, and would notice a wrong engine."""

import math

import mujoco
import numpy as np
import pytest
from scipy.integrate import solve_ivp

import analytic
from compare.bench import cases, exact
from compare.bench.case import TIME_STEPS, TOLERANCE, VERSION
from compare.bench.case import reach as reached
from model import Case as Kinds
from tests.compare.test_mechanisms import WAYS
from tests.exact_cases import CASES, LISTED

NAMES = [name for name, *_ in LISTED["cases"]]
ALL = pytest.mark.parametrize("case", NAMES, indirect=True)
OF_VERSION_1 = pytest.mark.parametrize("case", [name for name in NAMES if name not in WAYS], indirect=True)
"""The others have ways of their own, in test_mechanisms.py."""
UP = np.array([0.0, 0.0, 1.0])


@pytest.fixture
def case(request):
    return CASES[request.param]


@ALL
def test_a_case_is_whole(case):
    n = len(case.times)
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
    for name, states in case.wrong.items():
        assert case.error(states) > 2.5 * TOLERANCE, name


def test_the_list_that_is_shown_is_that_of_the_cases():
    """templates/cases.json spares the list the simulations."""
    assert {"version": VERSION, "cases": exact.listing()} == LISTED


@ALL
def test_mjcf_is_the_same_scene_at_the_same_start(case):
    model = mujoco.MjModel.from_xml_string(case.mjcf())
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    mujoco.mj_forward(model, data)
    body = data.body("body")
    velocity = np.empty(6)
    mujoco.mj_objectVelocity(model, data, mujoco.mjtObj.mjOBJ_BODY, body.id, velocity, 0)
    assert np.allclose(body.xpos, case.body.position)
    assert np.allclose(velocity, [*case.body.spin, *case.body.velocity], atol=1e-12)
    assert model.body_mass[body.id] == case.body.mass
    touched = {contact.friction[0] for contact in data.contact if abs(contact.dist) < 1e-9}
    assert touched <= {*(surface.friction for surface in case.surfaces), case.between}


def newton(case, letters):
    """The rates of a state (9,) by Newton and Euler in world axes, with contact forces from the constraints.

    A second way to the motion that knows nothing of the paper's variables: the forces are solved for from the
    accelerations of the contact points, least squares where two rolling contacts leave them open.
    """
    body = case.body

    def contacts(x):
        for surface, letter in zip(case.surfaces, letters, strict=True):
            if letter == "N":
                continue
            if surface.radius is None:
                normal, curvature = np.array(surface.normal), 0.0
            else:
                rho = np.hypot(*x[:2])
                normal = -np.array([x[0], x[1], 0.0]) / rho
                turn = np.cross(UP, normal)
                curvature = (x[3:6] @ turn) ** 2 / rho  # of the centre's path along the wall
            yield surface, letter, normal, curvature, float(reached(body, normal[None])[0])

    def unaccelerated(x, forces, t):
        """Accelerations of centre and spin under forces at the contacts."""
        linear = np.array([0.0, 0.0, -case.g]) + np.array(case.force(t, x[:3], x[3:6])) / body.mass
        angular = np.zeros(3)
        for (_, _, normal, _, reach), force in zip(contacts(x), forces, strict=True):
            linear = linear + force / body.mass
            if body.shape == "sphere":
                angular = angular + np.cross(-reach * normal, force) / body.inertia[0]
        return linear, angular

    def rates(t, x):
        own = list(contacts(x))

        def residual(unknown):
            linear, angular = unaccelerated(x, unknown.reshape(-1, 3), t)
            left = []
            for (surface, letter, normal, curvature, reach), force in zip(own, unknown.reshape(-1, 3), strict=True):
                left.append(linear @ normal - curvature)
                arm = -reach * normal
                spun = np.cross(x[6:], arm) if body.shape == "sphere" else 0.0
                if letter == "S":
                    slip = x[3:6] + spun - surface.turning * np.cross(UP, x[:3] + arm)
                    slip = slip - (slip @ normal) * normal
                    left += list(force - (force @ normal) * (normal - surface.friction * slip / np.linalg.norm(slip)))
                    continue
                turned = np.zeros(3)
                if surface.radius is not None:  # the normal turns with the body
                    turned = np.cross(UP, normal) * (x[3:6] @ np.cross(normal, UP)) / np.hypot(*x[:2])
                moves = np.cross(angular, arm) + np.cross(x[6:], -reach * turned) if body.shape == "sphere" else 0.0
                table = surface.turning * np.cross(UP, x[3:6] - reach * turned)
                gives = linear + moves - table
                left += list(gives - (gives @ normal) * normal)
            return np.array(left)

        forces = np.zeros((0, 3))
        if own:
            at_none = residual(np.zeros(3 * len(own)))
            matrix = np.stack([residual(row) - at_none for row in np.eye(3 * len(own))], axis=1)
            forces = np.linalg.lstsq(matrix, -at_none, rcond=1e-12)[0].reshape(-1, 3)
        linear, angular = unaccelerated(x, forces, t)
        return np.concatenate([x[3:6], linear, angular])

    return rates


def changes(case):
    """Times of all changes of case, and whether a contact closes or opens there."""
    if not case.motion:
        return np.empty(0), []
    p, x0 = case.motion
    events = analytic.simulate(p, x0, case.times[-1], rtol=1e-12).events
    pairs = [(Kinds(a).name, Kinds(b).name) for a, b in zip(events.from_case, events.to_case, strict=True)]
    return events.time, ["N" in before and before != after for before, after in pairs]


@OF_VERSION_1
def test_integrated_in_world_axes_the_motion_is_the_same(case):
    """From every sixth sample to the next, where the contacts are the same all the while and the body moves."""
    (events, _), checked = changes(case), 0
    for k in range(1, len(case.times), 6):
        (begin, end), letters = case.times[k - 1 : k + 1], case.contacts[k]
        changed = letters != case.contacts[k - 1] or ((begin < events) & (events < end)).any()
        if changed or not np.any(case.exact[k - 1, 3:]):
            continue
        found = solve_ivp(
            newton(case, letters), (begin, end), case.exact[k - 1], method="DOP853", rtol=1e-10, atol=1e-12
        )
        off = np.linalg.norm((found.y[:, -1] - case.exact[k]).reshape(3, 3), axis=1) / case.scales
        assert off.max() < 1e-9, (end, letters)
        checked += 1
    assert checked >= 2 or not np.any(case.exact[-1, 3:])


@pytest.mark.parametrize(
    ("name", "share"), [("block-rests", 0.9), ("block-slides", 1.25), ("pinched-block", 0.5), ("groove-rests", 0.9)]
)
def test_rest_needs_the_share_of_friction_that_is_said(name, share):
    """Statics: normal forces balance what acts across the surfaces, and friction what is left."""
    case = CASES[name]
    body, normals = case.body, np.array([surface.normal for surface in case.surfaces])
    acts = np.array(case.force(0.0, np.array(body.position), np.zeros(3))) - case.g * body.mass * UP
    loads = -np.linalg.lstsq(normals.T, acts)[0]
    assert (loads > 0).all()
    limit = sum(surface.friction * load for surface, load in zip(case.surfaces, loads, strict=True))
    assert np.linalg.norm(acts + loads @ normals) / limit == pytest.approx(share, rel=1e-12)


def test_no_sample_is_near_an_impact():
    """Where an engine is late by a step, it is not to be wrong by the whole jump."""
    in_the_vessel = [case for case in cases() if case.motion]
    assert in_the_vessel
    for case in in_the_vessel:
        for time, jumps in zip(*changes(case), strict=True):
            assert not jumps or np.abs(case.times - time).min() > 5e-3, case.name
