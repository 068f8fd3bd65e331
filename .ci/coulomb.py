"""Try the wheel mujoco-coulomb, with nothing else than what it needs: python coulomb.py"""

import math

import mujoco
import numpy as np
from mujoco_coulomb import Coulomb

G = 9.81
CONES = mujoco.mjtCone.mjCONE_ELLIPTIC, mujoco.mjtCone.mjCONE_PYRAMIDAL
"""Of the model: the law's own is round."""


def boxes(mu, slope=0.0, number=1, height=0.05, **options):
    """Boxes, one above the other, over a plane; gravity is tilted instead of the plane, degrees."""
    bodies = "".join(
        f'<body pos="0 0 {height + 0.1 * i}"><freejoint/>'
        '<geom type="box" size=".05 .05 .05"/></body>'
        for i in range(number)
    )
    a = math.radians(slope)
    model = mujoco.MjModel.from_xml_string(
        f'<mujoco><option tolerance="1e-12" gravity="{G * math.sin(a)} 0 {-G * math.cos(a)}"/>'
        f'<default><geom friction="{mu}"/></default><worldbody><geom type="plane" size="9 9 1"/>'
        f"{bodies}</worldbody></mujoco>"
    )
    for name, value in options.items():
        setattr(model.opt, name, value)
    return model, mujoco.MjData(model)


def creep(step, data):
    """Speed after two seconds in which it settled, m/s."""
    for _ in range(1000):
        step()
    place, time = data.qpos[0], data.time
    for _ in range(200):
        step()
    return abs(data.qpos[0] - place) / (data.time - time)


def holds(cone, rigid):
    model, data = boxes(0.6, slope=15, cone=cone)
    coulomb = Coulomb(model, rigid=rigid)
    assert creep(lambda: coulomb.step(data), data) <= 1e-12
    assert model.opt.cone == cone


def holds_in_four_stages():
    model, data = boxes(0.6, slope=15, integrator=mujoco.mjtIntegrator.mjINT_RK4)
    with Coulomb(model).installed():
        assert creep(lambda: mujoco.mj_step(model, data), data) <= 1e-12


def slides(rigid):
    """With the acceleration of Coulomb's law, and on all four corners."""
    model, data = boxes(0.25, slope=20)
    coulomb = Coulomb(model, rigid=rigid)
    coulomb.step(data, 500)
    speed, time = data.qvel[0], data.time
    for _ in range(300):
        coulomb.step(data)
        assert data.ncon == 4
    exact = G * (math.sin(math.radians(20)) - 0.25 * math.cos(math.radians(20)))
    assert abs((data.qvel[0] - speed) / (data.time - time) / exact - 1) <= 1e-9


def lands():
    """Once the last step has closed the gap and no more, nothing moves."""
    model, data = boxes(0.6, height=0.08)
    coulomb, speeds = Coulomb(model, rigid=True), []
    while data.time < 0.2:
        coulomb.step(data)
        speeds.append(np.linalg.norm(data.qvel))
    fastest = int(np.argmax(speeds))
    assert max(speeds[fastest + 2 :]) <= 1e-10 * speeds[fastest]


def is_the_same_however_it_steps(cone, rigid):
    results = []
    for door in "step", "halves", "installed":
        model, data = boxes(0.5, slope=10, number=3, height=0.07, cone=cone)
        data.qvel[[0, 5, 7, 15]] = 0.5, 3.0, -0.4, 2.0
        coulomb = Coulomb(model, rigid=rigid)
        if door == "step":
            coulomb.step(data, 300)
        elif door == "halves":
            for _ in range(300):
                coulomb.step1(data)
                coulomb.step2(data)
        else:
            with coulomb.installed():
                mujoco.mj_step(model, data, 300)
        results.append(np.hstack([data.qpos, data.qvel]))
    assert np.isfinite(results).all()
    assert (results[0] == results[1]).all()
    assert (results[0] == results[2]).all()


if __name__ == "__main__":
    for rigid in False, True:
        slides(rigid)
        for cone in CONES:
            holds(cone, rigid)
            is_the_same_however_it_steps(cone, rigid)
    holds_in_four_stages()
    lands()
    print(f"mujoco-coulomb, MuJoCo {mujoco.__version__}: as it should be")
