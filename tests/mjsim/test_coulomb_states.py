"""Coulomb's law goes on from a state to the bit, forgets once, and puts back what the collider
drops."""

from concurrent.futures import ThreadPoolExecutor

import mujoco
import numpy as np
import pytest

from docs.studies.friction import BOX, G
from docs.studies.small_scenes import FLOOR, free, model
from mjsim import Coulomb

PILE = "".join(
    free(
        f"b{i}",
        f"{0.03 * np.sin(3 * i)} {0.03 * np.cos(5 * i)} {0.08 + 0.13 * i}",
        f'type="{"box" if i % 2 else "capsule"}" size=".05 .05 .04" mass="1"',
        euler=f"{20 * i} {35 * i} 10",
    )
    for i in range(4)
)
ROD = 'type="capsule" size=".03"'
LINK = f'<joint axis="0 1 0" frictionloss="{{}}"/><geom {ROD} fromto="0 0 0 {{}} 0 0"/>'
ARM = (
    f'<body pos="1 0 1">{LINK.format(0.5, 0.4)}'
    f'<body pos=".4 0 0">{LINK.format(0.1, 0.3)}</body></body>'
)
BOXES = [free(f"box{i}", f"{0.2 * i} 0 .05", BOX) for i in range(11)]
SCENES = {
    "pile": (PILE, ".6 .005 .0001"),
    "pile, condim 6": (PILE, '.6 .01 .002" condim="6'),
    "dry joints": (BOXES[0] + ARM, ".6 .005 .0001"),
    "sparse": ("".join(BOXES), ".3 .005 .0001"),
    "box": (BOXES[0], ".6 .005 .0001"),
}


def scene(name, margin=0.002):
    """A model on a slope, and data."""
    bodies, friction = SCENES[name]
    made = model(FLOOR + bodies, 'tolerance="1e-14"', mu=friction)
    made.opt.gravity[:] = 0.15 * G, 0, -G
    made.geom_margin[0] = margin
    return made, mujoco.MjData(made)


@pytest.mark.parametrize("law", [{}, {"rigid": True}], ids=str)
@pytest.mark.parametrize("name", ["pile, condim 6", "dry joints", "sparse"])
def test_restored_to_the_bit(name, law):
    """Others that go on from a state or a copy, each in a thread of its own."""
    model, data = scene(name)
    coulomb = Coulomb(model, **law)
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
    ends = []
    for ask in (False, True):
        model, data = scene("pile")
        coulomb = Coulomb(model)
        coulomb.step(data, 100)
        if ask:
            coulomb.state()
        data.time = 0.0
        coulomb.step(data, 5)
        ends.append(data.qvel.copy())
    assert np.array_equal(*ends)


def test_a_point_that_the_collider_drops_is_put_back():
    """A corner of a box at rest, with the force it had."""
    model, data = scene("box", margin=0.0)
    coulomb = Coulomb(model)
    coulomb.step(data, 200)
    mujoco.mj_step1(model, data)
    places, still = data.contact.pos.copy(), np.abs(data.qvel).max()
    data.ncon = 3
    for stage in ("makeConstraint", "island", "projectConstraint", "fwdVelocity"):
        getattr(mujoco, f"mj_{stage}")(model, data)
    coulomb.step2(data)
    np.testing.assert_allclose(data.contact.pos, places, atol=1e-9)
    assert np.abs(data.qvel).max() < still + 1e-9
