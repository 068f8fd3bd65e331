"""Coulomb's law says the same in its two forms, compiled loops and formulas on arrays."""

import mujoco
import numpy as np
import pytest

from mjsim.coulomb import Coulomb, doors, formulas

compiled = pytest.importorskip("mjsim.coulomb.compiled", exc_type=ImportError)

G = 9.81
CONES = pytest.mark.parametrize("cone", ["elliptic", "pyramidal"])
LAWS = [{}, {"servo": 0.1}, {"rigid": True}, {"rigid": True, "restitution": 0.5}]
BALL, BOX = '<geom size=".05" mass="1"/>', '<geom type="box" size=".05 .05 .05" mass="1"/>'
PILE = "".join(
    f'<body pos="{0.03 * np.sin(3 * i)} {0.03 * np.cos(5 * i)} {0.08 + 0.13 * i}" euler="{20 * i} {35 * i} 10">'
    f'<freejoint/><geom type="{"box" if i % 2 else "capsule"}" size=".05 .05 .04" mass="1"/></body>'
    for i in range(4)
)
ARM = (
    '<body pos="1 0 1"><joint axis="0 1 0" frictionloss=".5"/><geom type="capsule" fromto="0 0 0 .4 0 0" size=".03"/>'
    '<body pos=".4 0 0"><joint axis="0 1 0" frictionloss=".1"/><geom type="capsule" fromto="0 0 0 .3 0 0" size=".03"/>'
    "</body></body>"
)


def boxes(count, apart=0.0, up=0.1, geom=BOX):
    """Side by side, or one on top of the other."""
    return "".join(f'<body pos="{apart * i} 0 {0.05 + up * i}"><freejoint/>{geom}</body>' for i in range(count))


STACK = "".join(
    f'<body pos="{0.011 * i} {0.007 * i} {0.05 + 0.1 * i}" euler="0 0 {7 * i}"><freejoint/>'
    f'<geom type="box" size="{0.05 - 0.006 * i} {0.05 - 0.006 * i} .05" mass="1"/></body>'
    for i in range(3)
)
"""No faces of one size: where such are flush, the collider chooses its points by rounding errors."""
SCENES = {
    "sphere, condim 6": (boxes(1, geom=BALL), '.6 .01 .002" condim="6'),
    "pile": (PILE, ".6 .005 .0001"),
    "pile, condim 1": (PILE, '.6 .005 .0001" condim="1'),
    "pile, condim 4": (PILE, '.6 .01 .0001" condim="4'),
    "pile, condim 6": (PILE, '.6 .01 .002" condim="6'),
    "dry joints": (boxes(1) + ARM, ".6 .005 .0001"),
    "dry joints alone": (ARM, ".6 .005 .0001"),
    "sparse": (boxes(11, apart=0.2, up=0.0), ".3 .005 .0001"),
    "stack": (STACK, ".6 .005 .0001"),
    "box": (boxes(1), ".6 .005 .0001"),
    "off its centre": (boxes(1, geom='<geom type="capsule" size=".03 .05" pos=".02 .01 0" quat="1 .2 .3 0"/>'), ".6"),
}


def scene(name, cone, option="", margin=0.002):
    """A model on a slope, by gravity."""
    bodies, friction = SCENES[name]
    return mujoco.MjModel.from_xml_string(
        f'<mujoco><option cone="{cone}" tolerance="1e-14" gravity="{0.15 * G} 0 {-G}" {option}/>'
        f'<default><geom friction="{friction}"/></default>'
        f'<worldbody><geom type="plane" size="9 9 1" margin="{margin}"/>{bodies}</worldbody></mujoco>'
    )


def run(monkeypatch, form, model, law, steps, installed=False):
    """Positions and velocities after each step, and what is remembered at the end."""
    monkeypatch.setattr(doors, "kernels", form)
    data, path = mujoco.MjData(model), []
    data.qvel[0] = 0.5
    coulomb = Coulomb(model, **law)
    if installed:
        with coulomb.installed():
            for _ in range(steps):
                mujoco.mj_step(model, data)
                path.append(np.append(data.qpos, data.qvel))
            state = coulomb.state()
    else:
        for _ in range(steps):
            coulomb.step(data)
            path.append(np.append(data.qpos, data.qvel))
        state = coulomb.state()
    return np.array(path), state


def check_same(monkeypatch, make, law, steps=120, installed=False):
    (one, mine), (other, its) = (run(monkeypatch, form, make(), law, steps, installed) for form in (compiled, formulas))
    np.testing.assert_allclose(other[:40], one[:40], rtol=1e-8, atol=1e-8)
    np.testing.assert_allclose(other, one, rtol=1e-4, atol=1e-4)  # rounding grows as bodies tumble
    assert mine["contacts"].shape == its["contacts"].shape
    for name in mine:
        np.testing.assert_allclose(its[name], mine[name], rtol=1e-3, atol=1e-3)


@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize("k", range(4))
def test_steps_agree(monkeypatch, name, k):
    """Each scene under each law, with either cone in turn."""
    law, cone = LAWS[k], ("elliptic", "pyramidal")[(k + k // 2 + list(SCENES).index(name)) % 2]
    assert name != "sparse" or mujoco.mj_isSparse(scene(name, cone))
    check_same(monkeypatch, lambda: scene(name, cone), law)


@pytest.mark.parametrize(("integrator", "cone"), [("Euler", "elliptic"), ("RK4", "pyramidal")])
@pytest.mark.parametrize("name", ["pile, condim 6", "dry joints", "sparse"])
def test_callbacks_agree(monkeypatch, name, integrator, cone):
    check_same(monkeypatch, lambda: scene(name, cone, f'integrator="{integrator}"'), {}, installed=True)


@CONES
def test_projected_solver_agrees(monkeypatch, cone):
    """Rigid contacts of the solver that holds softness in its matrix, too."""
    check_same(monkeypatch, lambda: scene("sphere, condim 6", cone, 'solver="PGS"'), {"rigid": True}, 60)


@pytest.mark.parametrize(("law", "cone"), [({}, "elliptic"), ({"rigid": True}, "pyramidal")], ids=str)
@pytest.mark.parametrize("form", [compiled, formulas], ids=["compiled", "formulas"])
@pytest.mark.parametrize("name", ["pile, condim 6", "dry joints", "sparse"])
def test_restored_to_the_bit(monkeypatch, name, form, law, cone):
    monkeypatch.setattr(doors, "kernels", form)
    model = scene(name, cone)
    data, again = mujoco.MjData(model), mujoco.MjData(model)
    coulomb, restored = Coulomb(model, **law), Coulomb(model, **law)
    coulomb.step(data, 60)
    restored.restore(coulomb.state())
    mujoco.mj_copyData(again, model, data)
    coulomb.step(data, 60)
    restored.step(again, 60)
    assert np.array_equal(data.qpos, again.qpos)
    assert np.array_equal(data.qvel, again.qvel)
    ours, theirs = coulomb.state(), restored.state()
    assert all(np.array_equal(ours[name], theirs[name]) for name in ours)


@pytest.mark.parametrize("form", [compiled, formulas], ids=["compiled", "formulas"])
def test_other_time_forgets_once(monkeypatch, form):
    """After a state was asked for, a jump in time costs the memory of that step, not of the next one, too."""
    monkeypatch.setattr(doors, "kernels", form)
    model = scene("pile", "elliptic")
    ends = []
    for ask in (False, True):
        data, coulomb = mujoco.MjData(model), Coulomb(model)
        coulomb.step(data, 100)
        if ask:
            coulomb.state()
        data.time = 0.0
        coulomb.step(data, 5)
        ends.append(data.qvel.copy())
    assert np.array_equal(*ends)


@CONES
def test_points_are_put_back_alike(monkeypatch, cone):
    """A collider drops a corner of a box at rest: both put it back, in the same place with the same forces."""
    contacts, ends = [], []
    for form in (compiled, formulas):
        monkeypatch.setattr(doors, "kernels", form)
        model = scene("box", cone, margin=0.0)
        data, coulomb = mujoco.MjData(model), Coulomb(model)
        coulomb.step(data, 200)
        mujoco.mj_step1(model, data)
        data.ncon = 3
        for renew in (mujoco.mj_makeConstraint, mujoco.mj_island, mujoco.mj_projectConstraint, mujoco.mj_fwdVelocity):
            renew(model, data)
        coulomb.step2(data)
        contacts.append(np.column_stack((data.contact.pos, data.contact.frame, data.contact.dist)))
        coulomb.step(data, 50)
        ends.append(np.append(data.qpos, data.qvel))
    assert len(contacts[0]) == 4
    np.testing.assert_allclose(contacts[1], contacts[0], atol=1e-12)
    np.testing.assert_allclose(ends[1], ends[0], atol=1e-9)


def test_many_pairs_in_little_memory():
    """Matching is within pairs of geoms, with ties, strays and pairs that are new or gone."""
    order, begin, count = formulas._among(np.array([7, 3, 7, 5, 3]), np.array([3, 4, 7]))
    of, at = formulas._spans(begin, count)
    assert list(zip(of.tolist(), order[at].tolist(), strict=True)) == [(0, 1), (0, 4), (2, 0), (2, 2)]
