"""Coulomb's law goes on from a state to the bit, forgets once, and puts back what the collider
drops."""

from concurrent.futures import ThreadPoolExecutor

import mujoco
import numpy as np
import pytest

from mjsim import Coulomb

G = 9.81
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


BOXES = [
    f'<body pos="{0.2 * i} 0 .05"><freejoint/><geom type="box" size=".05 .05 .05" mass="1"/></body>'
    for i in range(11)
]
SCENES = {
    "pile": (PILE, ".6 .005 .0001"),
    "pile, condim 6": (PILE, '.6 .01 .002" condim="6'),
    "dry joints": (BOXES[0] + ARM, ".6 .005 .0001"),
    "sparse": ("".join(BOXES), ".3 .005 .0001"),
    "box": (BOXES[0], ".6 .005 .0001"),
}


def scene(name, margin=0.002):
    """A model on a slope, by gravity."""
    bodies, friction = SCENES[name]
    return mujoco.MjModel.from_xml_string(
        f'<mujoco><option cone="elliptic" tolerance="1e-14" gravity="{0.15 * G} 0 {-G}"/>'
        f'<default><geom friction="{friction}"/></default>'
        f'<worldbody><geom type="plane" size="9 9 1" '
        f'margin="{margin}"/>{bodies}</worldbody></mujoco>'
    )


@pytest.mark.parametrize("law", [{}, {"rigid": True}], ids=str)
@pytest.mark.parametrize("name", ["pile, condim 6", "dry joints", "sparse"])
def test_restored_to_the_bit(name, law):
    """Others that go on from a state or a copy, each in a thread of its own."""
    model = scene(name)
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
    model = scene("pile")
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


def test_a_point_that_the_collider_drops_is_put_back():
    """A corner of a box at rest, with the force it had."""
    model = scene("box", margin=0.0)
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
