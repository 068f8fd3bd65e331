"""Coulomb's law does the same compiled and as it stands, in scenes of all kinds, and goes on from a
state."""

import contextlib
import importlib.util
import sys
from concurrent.futures import ThreadPoolExecutor

import mujoco
import numpy as np
import pytest

from mjsim.coulomb import Coulomb, compiled, doors

G = 9.81
BOTH = "elliptic", "pyramidal"
LAWS = [{}, {"servo": 0.1}, {"rigid": True}, {"rigid": True, "restitution": 0.5}]
BALL, BOX = '<geom size=".05" mass="1"/>', '<geom type="box" size=".05 .05 .05" mass="1"/>'
PILE = "".join(
    f'<body pos="{0.03 * np.sin(3 * i)} {0.03 * np.cos(5 * i)} {0.08 + 0.13 * i}" euler="{20 * i} '
    f'{35 * i} 10">'
    f'<freejoint/><geom type="{"box" if i % 2 else "capsule"}" size=".05 .05 .04" mass="1"/></body>'
    for i in range(4)
)
ARM = (
    '<body pos="1 0 1"><joint axis="0 1 0" frictionloss=".5"/><geom type="capsule" fromto="0 0 0 '
    '.4 0 0" size=".03"/>'
    '<body pos=".4 0 0"><joint axis="0 1 0" frictionloss=".1"/><geom type="capsule" fromto="0 0 0 '
    '.3 0 0" size=".03"/>'
    "</body></body>"
)


def boxes(count, apart=0.0, up=0.1, geom=BOX):
    """Side by side, or one on top of the other."""
    return "".join(
        f'<body pos="{apart * i} 0 {0.05 + up * i}"><freejoint/>{geom}</body>' for i in range(count)
    )


STACK = "".join(
    f'<body pos="{0.011 * i} {0.007 * i} {0.05 + 0.1 * i}" euler="0 0 {7 * i}"><freejoint/>'
    f'<geom type="box" size="{0.05 - 0.006 * i} {0.05 - 0.006 * i} .05" mass="1"/></body>'
    for i in range(3)
)
"""No faces of one size: where such are flush, the collider chooses its points by rounding
errors."""
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
    "off its centre": (
        boxes(1, geom='<geom type="capsule" size=".03 .05" pos=".02 .01 0" quat="1 .2 .3 0"/>'),
        ".6",
    ),
}


def scene(name, cone, option="", margin=0.002):
    """A model on a slope, by gravity."""
    bodies, friction = SCENES[name]
    return mujoco.MjModel.from_xml_string(
        f'<mujoco><option cone="{cone}" tolerance="1e-14" gravity="{0.15 * G} 0 {-G}" {option}/>'
        f'<default><geom friction="{friction}"/></default>'
        f'<worldbody><geom type="plane" size="9 9 1" '
        f'margin="{margin}"/>{bodies}</worldbody></mujoco>'
    )


@pytest.fixture(scope="module")
def plain():
    """The loops once more, where there is no numba."""
    if not compiled.COMPILES:
        pytest.skip("nothing is compiled here")
    spec = importlib.util.spec_from_file_location("mjsim.coulomb.as_it_stands", compiled.__file__)
    module = importlib.util.module_from_spec(spec)
    with pytest.MonkeyPatch.context() as without:
        without.setitem(sys.modules, "numba", None)
        spec.loader.exec_module(module)
    assert not module.COMPILES
    return module


def run(monkeypatch, form, model, law, steps, installed):
    """Positions and velocities after each step, and what is remembered at the end."""
    monkeypatch.setattr(doors, "compiled", form)
    data, path, coulomb = mujoco.MjData(model), [], Coulomb(model, **law)
    data.qvel[0] = 0.5
    with coulomb.installed() if installed else contextlib.nullcontext():
        for _ in range(steps):
            mujoco.mj_step(model, data) if installed else coulomb.step(data)
            path.append(np.append(data.qpos, data.qvel))
        return np.array(path), coulomb.state()


@pytest.mark.parametrize(
    ("name", "law", "cone", "option", "installed"),
    [
        *(
            (name, LAWS[k], BOTH[(i + k + k // 2) % 2], "", False)
            for i, name in enumerate(SCENES)
            for k in range(4)
        ),
        *(
            (name, {}, "elliptic", 'integrator="Euler"', True)
            for name in ("pile, condim 6", "dry joints")
        ),
        *(
            (name, {}, "pyramidal", 'integrator="RK4"', True)
            for name in ("pile, condim 6", "dry joints")
        ),
        *(("sphere, condim 6", {"rigid": True}, cone, 'solver="PGS"', False) for cone in BOTH),
    ],
)
def test_steps_agree(monkeypatch, plain, name, law, cone, option, installed):
    """Each scene under each law, with either cone in turn; callbacks; the solver that holds
    softness in its matrix."""
    assert name != "sparse" or mujoco.mj_isSparse(scene(name, cone))
    (one, mine), (other, its) = (
        run(monkeypatch, form, scene(name, cone, option), law, 20 if installed else 40, installed)
        for form in (compiled, plain)
    )
    np.testing.assert_allclose(other, one, rtol=1e-8, atol=1e-8)
    for kept, ours in zip(its.values(), mine.values(), strict=True):
        np.testing.assert_allclose(kept, ours, rtol=1e-3, atol=1e-3)


@pytest.mark.parametrize(
    ("law", "cone"), [({}, "elliptic"), ({"rigid": True}, "pyramidal")], ids=str
)
@pytest.mark.parametrize("name", ["pile, condim 6", "dry joints", "sparse"])
def test_restored_to_the_bit(name, law, cone):
    """Others that go on from a state or a copy, each in a thread of its own."""
    model = scene(name, cone)
    data, coulomb = mujoco.MjData(model), Coulomb(model, **law)
    coulomb.step(data, 60)
    others = [(Coulomb(model, **law), mujoco.MjData(model)) for _ in range(3)]
    kept = np.empty(mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_INTEGRATION))
    mujoco.mj_getState(model, data, kept, mujoco.mjtState.mjSTATE_INTEGRATION)
    for restored, again in others:
        restored.restore(coulomb.state())
        mujoco.mj_setState(model, again, kept, mujoco.mjtState.mjSTATE_INTEGRATION)
    mujoco.mj_copyData(others[0][1], model, data)
    coulomb.step(data, 60)
    with ThreadPoolExecutor(3) as pool:
        list(pool.map(lambda other: other[0].step(other[1], 60), others))
    for restored, again in others:
        np.testing.assert_array_equal(
            np.append(again.qpos, again.qvel), np.append(data.qpos, data.qvel)
        )
        for kept, ours in zip(restored.state().values(), coulomb.state().values(), strict=True):
            np.testing.assert_array_equal(kept, ours)


def test_other_time_forgets_once():
    """After a state was asked for, a jump in time costs the memory of that step, not of the next
    one, too."""
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


@pytest.mark.parametrize("cone", BOTH)
def test_a_point_that_the_collider_drops_is_put_back(cone):
    """A corner of a box at rest, with the force it had."""
    model = scene("box", cone, margin=0.0)
    data, coulomb = mujoco.MjData(model), Coulomb(model)
    coulomb.step(data, 200)
    mujoco.mj_step1(model, data)
    places, still = data.contact.pos.copy(), np.abs(data.qvel).max()
    data.ncon = 3
    for renew in (
        mujoco.mj_makeConstraint,
        mujoco.mj_island,
        mujoco.mj_projectConstraint,
        mujoco.mj_fwdVelocity,
    ):
        renew(model, data)
    coulomb.step2(data)
    np.testing.assert_allclose(data.contact.pos, places, atol=1e-9)
    assert np.abs(data.qvel).max() < still + 1e-9
