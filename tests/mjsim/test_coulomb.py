"""Coulomb's law in any MuJoCo model: what sticks does not creep, what slides does not lift, what
lands does not bounce.

Closed forms are of one rigid body. MuJoCo's step is of first order: what moves is wrong by h/2
times its speed. That rigid contacts roll, turn, land and bounce as they should exact cases show, in
tests/compare/test_engines.py."""

import contextlib
import itertools
import math
from pathlib import Path

import mujoco
import numpy as np
import pytest

from docs.studies import friction
from mjsim import Coulomb
from mjsim.coulomb.parameters import Law

G = 9.81
BOX = '<geom type="box" size=".05 .05 .05" mass="1"/>'
FLAT = '<geom type="box" size=".1 .1 .05" mass="1"/>'
BALL = '<geom type="sphere" size=".05" mass="1"/>'
FLOOR = '<geom type="plane" size="9 9 1"/>'
SCENES = Path(__file__).parents[2] / "docs" / "friction"
WAYS = pytest.mark.parametrize("rigid", [False, True], ids=["soft", "rigid"])


def scene(
    slope=0.0,
    mu=0.6,
    cone="elliptic",
    boxes=1,
    geom=BOX,
    option="",
    friction=".005 .0001",
    condim=3,
    height=0.05,
):
    """Bodies one on top of the other on a plane that is tilted by `slope`, rad; gravity is turned
    instead."""
    bodies = "".join(
        f'<body pos="0 0 {height + 0.1 * i}"><freejoint/>{geom}</body>' for i in range(boxes)
    )
    model = mujoco.MjModel.from_xml_string(
        f'<mujoco><option cone="{cone}" gravity="{G * np.sin(slope)} 0 {-G * np.cos(slope)}" '
        f"{option}/>"
        f'<default><geom friction="{mu} {friction}" condim="{condim}"/></default>'
        f"<worldbody>{FLOOR}{bodies}</worldbody></mujoco>"
    )
    return model, mujoco.MjData(model)


def world(bodies, option=""):
    return mujoco.MjModel.from_xml_string(
        f"<mujoco><option {option}/><worldbody>{bodies}</worldbody></mujoco>"
    )


def creep(model, rigid):
    return friction.crept(*friction.start(model, law={"rigid": rigid}))


@WAYS
@pytest.mark.parametrize(
    ("option", "more"),
    [
        ("", {}),
        ('integrator="implicitfast"', {}),
        ('integrator="implicit" impratio="10"', {}),
        ('solver="CG"', {}),
        ('solver="PGS" iterations="1000"', {}),
        ("", {"condim": 4}),
        ("", {"condim": 6}),
        ("", {"condim": 6, "friction": ".005 .02", "geom": BALL}),
    ],
)
def test_nothing_creeps(rigid, option, more):
    """Nothing moves inside the cone, nor a ball inside that of rolling friction, .02 m of a radius
    of .05 m.

    What is left is the solver's: with its default tolerance, 1e-8, about 1e-12 m/s, with implicit
    integrators 1e-10."""
    model, _ = scene(np.radians(10), option=f'tolerance="1e-14" {option}', **more)
    assert creep(model, rigid) < 1e-12


@WAYS
def test_breaks_away_at_the_limit(rigid):
    assert friction.breakaway({"law": {"rigid": rigid}}) == pytest.approx(1, abs=5e-3)


@WAYS
@pytest.mark.parametrize("shape", ["box", "cylinder", "sphere"])
@pytest.mark.parametrize("step", [4e-3, 2e-3, 1e-3])
def test_what_slides_keeps_its_contacts(rigid, shape, step):
    """Down a slope with g (sin - mu cos), to 1e-9, and never without contact."""
    geom = f'type="{shape}" size=".05 .05 .05" mass="1"'
    # a ball slides as long as mu < 2/7 tan
    mu = 0.05 if shape == "sphere" else 0.25
    error, lost = friction.slide_down(step, {"law": {"rigid": rigid}}, geom, mu)
    # A cylinder's three points turn it a little as it begins: that dies out as slowly as it slides
    # fast.
    assert error < (1e-4 if shape == "cylinder" and rigid else 1e-9)
    assert lost == 0


@WAYS
@pytest.mark.parametrize("step", [4e-3, 1e-3])
@pytest.mark.parametrize(("mu", "speed"), [(0.2, 2), (0.4, 2), (1.2, 2), (1.2, 5)])
def test_what_is_pushed_off_keeps_its_height_and_stops_in_time(rigid, step, mu, speed):
    height, error = friction.pushed_off(step, {"law": {"rigid": rigid}}, mu, speed)
    assert height < 3e-5
    # of the way v^2/(2 mu g), that of half a step at the speed
    assert abs(error) < 1.1 * step * mu * G / speed


PLATE = '<geom type="box" size=".1 .1 .001" mass="1"/>'
FEET = PLATE.replace("/>", ' contype="0" conaffinity="0"/>') + "".join(
    f'<geom size=".001" mass="0" pos="{x} {y} 0"/>' for x in (-0.1, 0.1) for y in (-0.1, 0.1)
)


def test_what_slides_over_the_seams_of_a_floor_stops_only_at_a_wall():
    """With rigid contacts, which see the sides of tiles ahead; a wall stands on its tiles."""
    tiles = "".join(
        f'<geom type="box" size=".1 .1 .05" pos="{0.2 * i} {0.2 * j} -.05"/>'
        for i, j in itertools.product(range(5), range(5))
    )
    wall = '<geom type="box" size=".1 1 .1" pos=".8 0 .1"/>'
    model = world(f'{tiles}{wall}<body pos="-.02 .01 .05"><freejoint/>{BOX}</body>')
    model.geom_friction[:, 0] = 0.3
    data, law = mujoco.MjData(model), Coulomb(model, rigid=True)
    data.qvel[:2] = 2.0, 1.0
    law.step(data, 100)
    slower = 1 - 0.3 * G * data.time / math.hypot(2, 1)
    np.testing.assert_allclose(data.qvel[:2], [2 * slower, slower], rtol=1e-3)
    law.step(data, 400)
    assert data.qpos[0] == pytest.approx(0.65, abs=1e-4)


def test_what_hangs_below_the_floor_on_which_a_body_slides_stops_at_a_wall():
    """The wall lies below the contacts that bear the body, but not all of the body lies above."""
    high = '<geom type="box" size="2 .3 .1" pos="0 0 .8"/>'
    walls = "".join(f'<geom type="box" size=".05 .1 .25" pos="1 {y} .25"/>' for y in (-0.5, 0.5))
    legs = "".join(
        f'<geom type="capsule" fromto=".15 {y} 0 .15 {y} -.7" size=".05"/>' for y in (-0.5, 0.5)
    )
    arm = '<geom type="box" size=".2 .6 .05"/>'
    model = world(f'{high}{walls}<body pos="0 0 .95"><freejoint/>{arm}{legs}</body>')
    model.geom_friction[:, 0] = 0.01
    data = mujoco.MjData(model)
    data.qvel[0] = 1.0
    Coulomb(model, rigid=True).step(data, 600)
    assert 0.5 < data.qpos[0] < 0.8


@WAYS
@pytest.mark.parametrize("geom", [PLATE, FEET], ids=["plate", "feet"])
def test_what_slides_and_spins_turns_as_far_as_its_corners_let_it(rigid, geom):
    """Each bears a quarter of its weight; of rigid ones at last two bore it all."""
    model, data = scene(mu=0.3, geom=geom, height=0.001)
    data.qvel[[0, 5]] = 1, 10
    Coulomb(model, rigid=rigid).step(data, 300)
    h, place, velocity = 1e-4, np.zeros(3), np.array([1.0, 0, 10])  # x, y, angle
    while velocity[2] > 0:
        turned = np.exp(1j * (place[2] + np.pi / 4 + np.pi / 2 * np.arange(4))) * 0.1 * np.sqrt(2)
        slip = velocity[0] + 1j * velocity[1] + 1j * velocity[2] * turned
        force = -0.3 * G / 4 * slip / np.abs(slip)
        moment = (np.conj(turned) * force).imag.sum()
        velocity += h * np.array([force.sum().real, force.sum().imag, moment / (0.02 / 3)])
        place += h * velocity
    assert 2 * np.arctan2(data.qpos[6], data.qpos[3]) == pytest.approx(place[2], rel=0.03)
    assert data.qpos[0] == pytest.approx(0.2302, rel=0.03)


def test_baumgarte_stabilisation_takes_the_depth_away():
    """A ball that rolls down has the lever r, so that it gains 5/7 g sin(slope): 1 % less without
    it."""
    slope, ball = np.radians(5), '<geom size=".05" mass=".03" margin="2e-3"/>'
    model, data = scene(slope, geom=ball, option='tolerance="1e-12"')
    law = Coulomb(model, servo=0.1)
    law.step(data, 500)
    speed = data.qvel[0]
    law.step(data, 500)
    assert abs(data.contact.dist[0]) < 1e-9
    assert data.qvel[0] - speed == pytest.approx(5 / 7 * G * np.sin(slope), rel=1e-4)
    model, data = scene(geom=BOX.replace("mass", 'euler="10 20 0" margin="2e-3" mass'))
    data.qpos[2], free = 0.2, np.sqrt(2 * (0.2 - 0.075) / G)
    law = Coulomb(model, servo=0.1)
    law.step(data, int(free / model.opt.timestep) - 12)
    assert data.qvel[2] == pytest.approx(-G * data.time, rel=1e-9)  # the margin bears nothing
    law.step(data, 2000)
    assert np.abs(data.contact.dist).max() < 1e-9


@WAYS
def test_every_way_to_step_leads_to_the_same_bits(rigid):
    """`step`, its halves; `mj_step`, of two simulations in turn, and its halves in either order
    under the callback."""
    model, data = scene(0.3, mu=0.25, boxes=2)
    Coulomb(model, rigid=rigid).step(data, 100)
    halves, law = mujoco.MjData(model), Coulomb(model, rigid=rigid)
    for _ in range(100):
        law.step1(halves)
        law.step2(halves)
    assert (halves.qpos == data.qpos).all()
    whole, turned, other, later = (mujoco.MjData(model) for _ in range(4))
    with Coulomb(model, rigid=rigid).installed():
        mujoco.mj_step1(model, turned)
        for _ in range(100):
            mujoco.mj_step2(model, turned)  # as dm_control does
            mujoco.mj_step1(model, turned)
            mujoco.mj_step(model, whole)
            mujoco.mj_step(model, other)
        mujoco.mj_step(model, later, 100)
    assert mujoco.get_mjcb_control() is None
    for one in (whole, other, turned, later):
        assert (one.qpos == data.qpos).all()


def test_runge_kutta_has_the_callback():
    model, data = scene(np.radians(15), option='integrator="RK4" tolerance="1e-14"')
    law = Coulomb(model)
    law.step(data, 2500)
    place = data.qpos.copy()
    with law.installed():
        mujoco.mj_step(model, data, 500)
    assert data.qpos == pytest.approx(place, abs=1e-12)
    with pytest.raises(ValueError, match="integrator = RK4 has four stages"):
        law.step1(data)


def test_forward_under_the_callback_changes_nothing():
    """`mj_forward` between steps finds the forces of the step, and takes nothing from the
    memory."""
    model, data = scene(np.radians(15), option='tolerance="1e-14"')
    with Coulomb(model).installed():
        mujoco.mj_step(model, data, 1000)
        load, place = data.efc_force.copy(), data.qpos.copy()
        for _ in range(300):
            mujoco.mj_forward(model, data)
            assert data.efc_force == pytest.approx(load, rel=1e-6)
            mujoco.mj_step(model, data)
    assert data.qpos == pytest.approx(place, abs=1e-12)


def test_other_models_and_other_callbacks():
    """What isn't installed is MuJoCo's own, to the bit; what a
    program raises is raised."""
    model, data = scene(np.radians(15))
    plain, copied = mujoco.MjData(model), scene(np.radians(15))
    mujoco.mj_step(model, plain, 100)
    with Coulomb(model).installed() as law:
        mujoco.mj_step(*copied, 100)
        with pytest.raises(ValueError, match="installed\\(\\) already"), Coulomb(model).installed():
            pass
        law.step(data, 100)  # the callback serves it
        with Coulomb(copied[0]).installed():
            mujoco.mj_step(*copied)
    assert (copied[1].qpos[:3] != plain.qpos[:3]).any()
    other = mujoco.MjData(model)
    Coulomb(model).step(other, 100)
    assert (data.qpos == other.qpos).all()
    with pytest.raises(RuntimeError, match="mine"), Coulomb(model).installed():
        raise RuntimeError("mine")


def test_a_callback_of_somebody_else_is_called_first_and_comes_back():
    """And what it raises is raised, as MuJoCo alone does; the step is then begun anew."""
    model, data = scene(np.radians(15))
    law, calls = Coulomb(model), []

    def pushes(model, data):
        calls.append(data.time)
        if len(calls) == 20:
            raise KeyError("mine")

    mujoco.set_mjcb_control(pushes)
    try:
        law.step(data, 10)
        with pytest.raises(KeyError, match="mine"), law.installed():
            mujoco.mj_step(model, data, 20)
        mujoco.mj_step(model, data, 5)
        assert mujoco.get_mjcb_control() is pushes
    finally:
        mujoco.set_mjcb_control(None)
    assert len(calls) == 25
    assert data.time == pytest.approx(24 * model.opt.timestep)


@pytest.mark.parametrize(
    ("given", "law", "words"),
    [
        ({"option": 'integrator="discrete"'}, {}, "integrator = DISCRETE"),
        ({"option": 'noslip_iterations="5"'}, {}, "noslip_iterations = 5"),
        ({}, {"restitution": 0.5}, r"restitution = 0\.5 needs rigid"),
        *(
            ({}, {"rigid": True, "restitution": wrong}, r"restitution = .* must be from 0 to 1")
            for wrong in (-0.1, 1.1, math.nan, "half")
        ),
        ({}, {"servo": 1e-3}, r"servo = 0\.001 s must be at least 0\.002 s"),
    ],
)
def test_of_what_no_law_is_made(given, law, words):
    with pytest.raises(ValueError, match=words):
        Coulomb(scene(**given)[0], **law)


def test_what_is_refused():
    model, data = scene()
    law = Coulomb(model)
    with pytest.raises(ValueError, match="another MjModel"):
        law.step(scene(boxes=2)[1])
    with pytest.raises(ValueError, match="model is a MjData"):
        Coulomb(data)
    with pytest.raises(ValueError, match="not a state"):
        law.restore({"contacts": [], "joints": [], "time": [0, 0]})
    law.step(data, 9)
    state, far, cut = law.state(), law.state(), law.state()
    far["contacts"]["geoms"][0] = 0, 2
    cut["contacts"]["gap"][0] = math.nan
    for wrong, words in (
        ({"contacts": np.zeros((1, 3))}, "contacts of type float64"),
        ({"spins": np.zeros((1, 6))}, "spins of shape"),
        ({"time": np.zeros(3)}, "time of shape"),
        (far, "contacts of geoms 0 to 2, and there are 0 to 1"),
        (cut, "contacts must be finite"),
    ):
        with pytest.raises(ValueError, match=words):
            law.restore(state | wrong)
    off = scene(option="/><option")[0]
    off.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_ACTUATION
    with pytest.raises(ValueError, match="actuation is disabled"):
        Coulomb(off)
    model.geom_friction[1, 0] = math.inf
    with pytest.raises(ValueError, match=r"geom_friction\[1\] = \[inf"):
        Coulomb(model)
    model.geom_friction[1, 0] = 1.0
    law = Coulomb(model, rigid=True)
    model.opt.timestep *= 2
    with pytest.raises(ValueError, match=r"timestep = 0\.004 s was 0\.002 s"):
        law.step(data)


@pytest.mark.parametrize(("array", "value"), [("qvel", np.nan), ("qfrc_applied", 1e300)])
def test_a_state_that_mujoco_resets_is_forgotten(array, value, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)  # where MuJoCo logs that it does
    model, data = scene(np.radians(15))
    law, fresh = Coulomb(model), mujoco.MjData(model)
    law.step(data, 50)
    getattr(data, array)[0] = value
    law.step(data, 50)
    Coulomb(model).step(fresh, 50)
    assert (data.qpos == fresh.qpos).all()


@pytest.mark.parametrize(
    ("given", "solref"),
    [({"condim": 1}, (0.02, 1)), ({}, (-1000, 0)), ({"geom": BOX, "height": 9}, (0.02, 1))],
)
def test_contacts_without_friction_or_damping_or_none_at_all_are_the_engines_own(given, solref):
    model, data = scene(slope=0.1, **{"geom": BALL} | given)
    model.geom_solref[:] = solref
    plain = mujoco.MjData(model)
    Coulomb(model).step(data, 400)
    mujoco.mj_step(model, plain, 400)
    assert data.qpos == pytest.approx(plain.qpos, rel=1e-12)


def test_a_pyramid_becomes_a_cone_while_the_law_acts():
    model, data = scene(np.radians(10))
    pyramid, other = scene(np.radians(10), cone="pyramidal")
    Coulomb(model).step(data, 200)
    law = Coulomb(pyramid)
    law.step(other, 100)
    assert pyramid.opt.cone == mujoco.mjtCone.mjCONE_PYRAMIDAL
    with law.installed():
        mujoco.mj_step(pyramid, other, 100)
    assert pyramid.opt.cone == mujoco.mjtCone.mjCONE_PYRAMIDAL
    assert (data.qpos == other.qpos).all()


@pytest.mark.parametrize("name", [path.name for path in SCENES.glob("*.xml")])
@WAYS
def test_scenes_of_the_page_hold(name, rigid):
    assert creep(mujoco.MjModel.from_xml_path(str(SCENES / name)), rigid) < 1e-12


def test_a_rigid_box_stands_on_a_heightfield():
    """Of which the collider reports a corner in each step, another in the next; one start of many
    may still fall."""
    hill = '<hfield name="hill" nrow="3" ncol="3" size="1 1 .1 .1" elevation="0 0 0 0 1 0 0 0 0"/>'
    ways = []
    for x in (0.298, 0.299, 0.3, 0.301, 0.302):
        box = f'<body pos="{x} .1 .12"><freejoint/>{FLAT}</body>'
        scene = f'<worldbody><geom type="hfield" hfield="hill"/>{box}</worldbody>'
        ways.append(
            creep(
                mujoco.MjModel.from_xml_string(f"<mujoco><asset>{hill}</asset>{scene}</mujoco>"),
                True,
            )
        )
    assert np.median(ways) < 1e-5


@pytest.mark.parametrize("integrator", ["Euler", "implicitfast", "implicit"])
def test_rigid_contacts_know_of_dampers(integrator):
    """They become inertia, once, as under `implicitfast`; `implicit` has Coriolis forces'
    derivative, too."""
    model = mujoco.MjModel.from_xml_string(
        f'<mujoco><option integrator="{integrator}" timestep=".002"/><worldbody><body><joint '
        f'name="j" damping="3" '
        'axis="0 1 0"/><geom type="capsule" fromto="0 0 0 .3 0 0" size=".02"/><body pos=".3 0 '
        '0"><joint name="k" '
        'damping=".5" axis="0 1 0"/><geom name="tip" type="capsule" fromto="0 0 0 .3 0 0" '
        'size=".02"/></body></body>'
        '<geom name="floor" type="plane" pos="0 0 -.3" size="1 1 1"/></worldbody><contact><exclude '
        'body1="world" '
        'body2="world"/></contact><tendon><fixed name="t" damping="1"><joint joint="j" '
        'coef="1"/><joint joint="k" '
        'coef="-1"/></fixed></tendon><actuator><position joint="j" kp="30" kv="2"/><position '
        'tendon="t" kp="3" kv="1"/>'
        "</actuator></mujoco>"
    )
    euler, plain = integrator == "Euler", mujoco.MjData(model)
    if euler:
        model.opt.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    mujoco.mj_step(model, plain, 100)
    if euler:
        model.opt.integrator = mujoco.mjtIntegrator.mjINT_EULER
    assert not plain.ncon
    for _ in range(2):
        law, data = Coulomb(model, rigid=True), mujoco.MjData(model)
        law.step(data, 100)
        assert data.qpos == pytest.approx(
            plain.qpos, rel=1e-5 if integrator == "implicit" else 1e-9
        )


TURNS = '<body><joint name="turn" axis="0 0 1" {0}/><geom size=".1" mass="1"/></body>'
SLIDES = '<body><joint name="slide" type="slide" {0}/><geom size=".1" mass="1"/></body>'


@pytest.mark.parametrize("integrator", ["Euler", "implicitfast"])
@pytest.mark.parametrize(
    ("bodies", "actuators", "option"),
    [
        (TURNS, '<velocity joint="turn" kv="100" forcerange="-.01 .01"/>', ""),
        (TURNS, '<velocity joint="turn" kv="100" group="2"/>', 'actuatorgroupdisable="2"'),
        (TURNS.format('damping="10"'), "", '><flag damper="disable"/></option><option'),
        (TURNS, '<velocity jointinparent="turn" kv="100"/>', ""),
        (SLIDES, '<motor joint="slide" damping="2000"/>', ""),
        ('<body><freejoint/><geom size=".01" mass=".004"/></body>', "", 'viscosity="100"'),
    ],
    ids=["at its limit", "in a group", "disabled", "in the parent", "of an actuator", "fluid"],
)
def test_rigid_contacts_take_what_brakes_as_mujoco_has_it(integrator, bodies, actuators, option):
    """Of servos at their limits, and of disabled ones, nothing; of stiff ones all, at the end of
    the step; the inertia that others see afterwards is that of the bodies."""
    model = mujoco.MjModel.from_xml_string(
        f'<mujoco><option integrator="{integrator}" gravity="0 0 -9.8" {option}/><worldbody>'
        f"{bodies.format('')}</worldbody><actuator>{actuators}</actuator></mujoco>"
    )
    one, other = mujoco.MjData(model), mujoco.MjData(model)
    for data in (one, other):
        data.ctrl[:] = 5.0
        data.qfrc_applied[0] = 0.01
    Coulomb(model, rigid=True).step(one, 100)
    model.opt.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    mujoco.mj_step(model, other, 100)
    assert one.qvel == pytest.approx(other.qvel, rel=1e-9, abs=1e-15)
    assert pytest.approx(other.M) == one.M


@pytest.mark.parametrize("integrator", ["Euler", "implicitfast"])
def test_a_damped_finger_lands_in_a_step(integrator):
    model = world(
        f'{FLOOR}<body pos="0 0 .1"><joint type="slide" axis="0 0 1" damping="50"/>'
        '<geom size=".02" mass=".2"/></body>',
        f'integrator="{integrator}" timestep=".002" tolerance="1e-12"',
    )
    data, law = mujoco.MjData(model), Coulomb(model, rigid=True)
    data.qvel[0] = -24.0  # it comes into sight of the floor before it touches it
    speeds = []
    for _ in range(300):
        law.step(data)
        speeds.append(float(data.qvel[0]))
    landed = int(np.argmax(np.array(speeds) > -1e-9))
    assert landed > 0
    assert abs(data.qpos[0] + 0.08) < 1.1 * Law.depth * 0.02  # the depth that it keeps
    assert max(abs(speed) for speed in speeds[landed:]) < 2e-5
    assert abs(speeds[-1]) < 1e-12


@pytest.mark.parametrize("kind", ["capsule", "box", "cylinder"])
@pytest.mark.parametrize("centre", ["0 0 0", ".1 .05 0"])
def test_what_spins_keeps_its_energy(kind, centre):
    """With rigid contacts: Euler's method alone takes the moment of the beginning of a step, and
    feeds it."""
    geom = f'<geom type="{kind}" size=".02 .05 .03" pos="{centre}" quat="1 .3 .2 .1"/>'
    model = world(f"<body><freejoint/>{geom}</body>", 'gravity="0 0 0"')
    data, law, found = mujoco.MjData(model), Coulomb(model, rigid=True), []
    data.qvel[3:] = 1, 12, 60
    for steps in (0, 600):
        law.step(data, steps)
        for update in (mujoco.mj_forward, mujoco.mj_energyVel, mujoco.mj_subtreeVel):
            update(model, data)
        found.append(
            [data.energy[1], np.linalg.norm(data.subtree_angmom[1]), *data.subtree_linvel[1]]
        )
    (energy, momentum, *velocity), (later, kept, *then) = found
    assert (later, kept) == pytest.approx((energy, momentum), rel=1e-12)
    assert then == pytest.approx(velocity, abs=1e-11)


@pytest.mark.parametrize(("leans", "step"), [(5, 5e-4), (20, 1e-3), (40, 1e-3), (75, 1e-3)])
def test_a_disc_that_precesses_keeps_its_energy(leans, step):
    """Rigid contacts that take the arm of the beginning of a step lose a fifth of its energy at
    20°."""
    energy, more = friction.precessing(step, friction.RIGID, leans, 0.5)
    assert abs(energy) < 3e-3
    assert abs(more) < 0.5


def test_what_rolls_on_a_body_that_turns_rolls_to_second_order():
    """A ball on a turntable circles at 2/7 of its angular velocity (Weltner, Am. J. Phys. 47,
    1979)."""
    turning, far, size, off = 3.0, 0.5, 0.1, []
    for step in (4e-3, 2e-3):
        model = world(
            '<body><joint/><geom type="cylinder" size="3 .1" pos="0 0 -.1" mass="1e9"/></body>'
            f'<body pos="{far} 0 {size}"><freejoint/><geom size="{size}" mass="1"/></body>',
            f'timestep="{step}" tolerance="1e-20"',
        )
        data, law = mujoco.MjData(model), Coulomb(model, rigid=True)
        circles = 2 / 7 * turning
        data.qvel[[0, 2, 4]] = turning, far * circles, far * (turning - circles) / size
        law.step(data, round(1 / step))
        angle = circles * data.time
        off.append(np.abs(data.qpos[1:3] - far * np.array([np.cos(angle), np.sin(angle)])).max())
    assert off[0] < 1e-5
    assert off[0] / off[1] == pytest.approx(4, abs=0.3)


@WAYS
def test_a_caster_swings_in_behind_what_draws_it(rigid):
    """Its wheel rolls where it points: tan(angle / 2) falls by a factor e when it is drawn as far
    as it trails. Soft wheels that slipped by what their turning adds in 10 ms fell by 4.5."""
    trail, speed, step, found = 0.04, 1.0, 5e-4, []
    wheel = f'<body pos="-{trail} 0 0"><joint axis="0 1 0"/><geom size=".05" mass=".2"/></body>'
    mass = '<inertial pos="0 0 0" mass="{}" diaginertia="1e-5 1e-5 1e-5"/>'
    swivel = f'<body><joint axis="0 0 1"/>{mass.format(0.05)}{wheel}</body>'
    cart = '<joint type="slide" axis="1 0 0" armature="1e3"/><joint type="slide" axis="0 0 1"/>'
    bodies = f'{FLOOR}<body pos="0 0 .05">{cart}{mass.format(5)}{swivel}</body>'
    model = world(bodies, f'timestep="{step}"')
    data, law = mujoco.MjData(model), Coulomb(model, rigid=rigid)
    data.qpos[2], data.qvel[0], data.qvel[3] = 0.5, speed, speed / 0.05
    for _ in range(3):
        law.step(data, round(trail / speed / step))
        found.append(math.tan(data.qpos[2] / 2))
    assert found[1] / found[2] == pytest.approx(math.e, rel=0.02)


@WAYS
@pytest.mark.parametrize("seeds", [[3], pytest.param(range(20), marks=pytest.mark.slow)])
def test_piles_come_to_rest(seeds, rigid):
    """The collider of boxes drops points and finds them again: bodies would rock if they were not
    put back."""
    models = [friction.pile(seed, mixed=False) for seed in seeds]
    plain = [friction.settle(*friction.start(model))[1] for model in models]
    law = {"rigid": rigid}
    drift, rise = np.transpose([friction.settle(*friction.start(m, law=law)) for m in models])
    assert (drift < friction.STILL).sum() >= 0.95 * len(models)
    assert rise.max() <= max(friction.RISE, *plain)


@pytest.mark.parametrize("installed", [False, True])
@pytest.mark.parametrize(
    "joint",
    [
        '<joint axis="0 1 0" damping=".01"/><geom size=".02" pos=".3 0 0" mass=".2"/>',
        '<joint type="slide" damping=".01"/><geom size=".05" mass=".1"/>',  # "simple" to MuJoCo
        '<freejoint/><geom size=".05" mass=".1"/>',
    ],
)
def test_rigid_contacts_know_of_dampers_that_are_changed_while_it_runs(joint, installed):
    model = world(f"<body>{joint}</body>", 'gravity="0 0 0"')
    law, data, plain = Coulomb(model, rigid=True), *(mujoco.MjData(model) for _ in range(2))
    data.qvel[0] = plain.qvel[0] = 1.0
    for damping in (0.01, 200.0, 3.0):
        model.dof_damping[:] = damping
        mujoco.mj_step(model, plain, 5)
        with law.installed() if installed else contextlib.nullcontext():
            mujoco.mj_step(model, data, 5) if installed else law.step(data, 5)
        assert data.qvel == pytest.approx(plain.qvel, rel=1e-9, abs=1e-15)


@WAYS
def test_what_is_computed_between_steps_changes_nothing(rigid):
    """A viewer or logger calls `mj_forward`, which is plain MuJoCo's, pyramid and all."""
    model, data = scene(np.radians(15), cone="pyramidal", option='tolerance="1e-14"')
    law, other = Coulomb(model, rigid=rigid), mujoco.MjData(model)
    seen = Coulomb(model, rigid=rigid)
    for _ in range(300):
        law.step(data)
        seen.step(other)
        mujoco.mj_forward(model, other)
    law.step(data, 500)
    place = other.qpos.copy()
    for _ in range(500):
        seen.step(other)
        mujoco.mj_forward(model, other)
    assert other.qpos == pytest.approx(place, abs=1e-11)


@WAYS
@pytest.mark.parametrize("apart", [0.0, 0.013], ids=["stack", "steps"])
def test_points_that_the_collider_adds_for_a_step_jolt_nothing(rigid, apart):
    """Of boxes of one size: flush, and each a little further down the slope than the one below."""
    bodies = "".join(
        f'<body pos="{apart * k} 0 {0.0508 + 0.1 * k}"><freejoint/>{BOX}</body>' for k in range(3)
    )
    model = world(FLOOR + bodies, 'gravity="1.2 0 -9.7"')
    model.geom_friction[:, 0] = 0.6
    data, law, counts, fastest = mujoco.MjData(model), Coulomb(model, rigid=rigid), set(), 0.0
    law.step(data, 1000)
    for _ in range(4000):
        law.step(data)
        counts.add(int(data.ncon))
        fastest = max(fastest, np.abs(data.qvel).max())
    assert fastest < 1e-9
    assert rigid or apart or len(counts) > 1  # the collider does add points


@pytest.mark.parametrize("corners", [6, 7])
def test_corners_that_the_collider_takes_by_turns_jolt_nothing(corners):
    """Four of a polygon, of a prism that rests on a slope; it crept as in plain MuJoCo."""
    ring = [(np.cos(a), np.sin(a)) for a in np.arange(corners) * 2 * np.pi / corners]
    mesh = " ".join(f"{0.1 * x} {0.1 * y} {z}" for x, y in ring for z in (0, 0.1))
    model = mujoco.MjModel.from_xml_string(
        '<mujoco><option gravity="2.3 1.7 -9.4" tolerance="1e-12"/>'
        f'<asset><mesh name="prism" vertex="{mesh}"/></asset><worldbody>{FLOOR}<body pos="0 0 .05">'
        '<freejoint/><geom type="mesh" mesh="prism" mass="1"/></body></worldbody></mujoco>'
    )
    data = mujoco.MjData(model)
    Coulomb(model).step(data, 750)
    assert np.abs(data.qvel).max() < 1e-9


@WAYS
@pytest.mark.parametrize("speed", [0.1, 0.5])
def test_mocap_bodies_push(rigid, speed):
    """Whose velocity MuJoCo doesn't know; rigid contacts let them pass."""
    pusher = '<body mocap="true" pos="-.1 0 .05"><geom type="box" size=".05 .05 .04"/></body>'
    model = world(f"{FLOOR}{pusher}<body pos='0 0 .05'><freejoint/>{BOX}</body>")
    model.geom_friction[:, 0] = 0.3
    data, law = mujoco.MjData(model), Coulomb(model, rigid=rigid)
    for _ in range(500):
        data.mocap_pos[0, 0] += speed * model.opt.timestep
        law.step(data)
    assert data.qvel[0] == pytest.approx(speed, rel=1e-2)
    assert 0.1 - data.qpos[0] + data.mocap_pos[0, 0] < 0.04 * speed


@WAYS
@pytest.mark.parametrize("solver", ["CG", "PGS"])
def test_what_lands_as_it_slides_is_caught(rigid, solver):
    """By any solver as by Newton's method: PGS let it fall until it was 4 mm deep."""
    ends = []
    for each in ("Newton", solver):
        model, data = scene(option=f'solver="{each}" tolerance="1e-14"')
        data.qvel[:2] = 1.2, 0.3
        Coulomb(model, rigid=rigid).step(data, 20)
        ends.append(data.qpos.copy())
    np.testing.assert_allclose(*ends, atol=1e-6)


@pytest.mark.parametrize("shape", ['"cylinder" size=".009 .03"', '"capsule" size=".009 .03"'])
def test_what_lies_on_its_smooth_side_stays(shape):
    """Under rigid contacts, whose points colliders must not find a micrometre beside."""
    model = world(
        '<geom type="box" size=".2 .2 .03" pos="0 0 .03"/><body pos=".003 .002 .069" '
        f'euler="90 0 0"><freejoint/><geom type={shape} mass=".05"/></body>'
    )
    data = mujoco.MjData(model)
    Coulomb(model, rigid=True).step(data, 1000)
    assert np.abs(data.qvel).max() < 1e-6
    assert model.opt.ccd_tolerance == 1e-6


OVERLAPS = {
    "ball joint in the floor": '<body pos="0 0 .05"><joint type="ball"/>'
    '<geom type="box" size=".1 .05 .08" pos=".03 .02 0"/></body>',
    "hinge in the floor": '<body pos="0 0 .05"><joint axis="1 .3 .2"/>'
    '<geom type="box" size=".1 .05 .08" pos=".03 .02 0"/></body>',
    "wedged": '<geom type="box" size=".1 .1 .1" pos=".16 0 .1"/>'
    '<geom type="box" size=".1 .1 .1" pos="-.16 0 .1"/><body pos="0 0 .1" euler="0 10 5">'
    '<freejoint/><geom type="box" size=".08 .05 .1"/></body>',
    "arm in a wall": '<geom type="box" size=".1 .5 .5" pos=".5 0 .5"/><body pos="0 0 .5">'
    '<joint axis="0 1 0"/><geom type="capsule" fromto="0 0 0 .45 0 .1" size=".05"/></body>',
}


@WAYS
@pytest.mark.parametrize("bodies", OVERLAPS.values(), ids=OVERLAPS)
def test_geoms_that_cannot_part_come_to_rest(rigid, bodies):
    """What would push them out of each other would do work for ever."""
    model = world(FLOOR + bodies)
    data, law = mujoco.MjData(model), Coulomb(model, rigid=rigid)
    law.step(data, 4000)
    assert np.abs(data.qvel).max() < 1e-6


@WAYS
@pytest.mark.parametrize("direction", [0.0, 0.5])
def test_what_slides_has_kinetic_friction_and_what_stops_holds_by_static_friction(rigid, direction):
    """Beyond mu W a box breaks away, with kinetic mu it slides, in any direction; at rest it holds
    again."""
    mu, kinetic, h = 0.5, 0.6, 2e-3
    model, data = scene(mu=mu, geom=FLAT, option=f'timestep="{h}"')
    law, along = Coulomb(model, rigid=rigid, kinetic=kinetic), np.array([1.0, 0.0, 0.0])
    along[:2] = np.cos(direction), np.sin(direction)

    def pull(start, end, steps):
        """Speed and mean acceleration of a box pulled by a force that grows, in weights."""
        before = data.qvel[:3] @ along
        for force in np.linspace(start, end, steps):
            data.xfrc_applied[1, :3] = force * G * along
            law.step(data)
        speed = data.qvel[:3] @ along
        return speed, (speed - before) / (steps * h)

    for _ in range(2):
        assert abs(pull(0.0, 0.99 * mu, 1000)[0]) < 1e-3 * G * h  # held, up to what is soft
        assert pull(0.99 * mu, 1.01 * mu, 200)[0] > G * h  # gone
        _, acceleration = pull(0.45, 0.45, 100)
        assert acceleration == pytest.approx((0.45 - kinetic * mu) * G, rel=1e-4)
        pull(0.0, 0.0, 1000)


def test_kinetic_friction_is_not_taken_twice_from_contacts_that_are_asked_again():
    model, data = scene(mu=0.5, geom=FLAT)
    law, moving = Coulomb(model, rigid=True, kinetic=0.5), [1.0, 0, 0, 0, 0, 0]
    data.qvel[:] = moving
    law.step(data, 10)
    with law.acting(data):
        mujoco.mj_forward(model, data)
        for _ in range(2):
            assert data.contact.friction[:, 0] == pytest.approx(0.25)
            mujoco.mj_forwardSkip(model, data, mujoco.mjtStage.mjSTAGE_POS, 0)


@pytest.mark.parametrize(
    "option", ['gravity="0 0 0"', '><flag override="enable"/></option><option'], ids=["free", "one"]
)
def test_what_lands_without_gravity_or_with_one_margin_for_all_is_seen_ahead(option):
    body = '<body pos="0 0 .2015"><freejoint/><geom type="box" size=".1 .1 .1" mass="1"/></body>'
    model = world(FLOOR + body, option)
    data, law = mujoco.MjData(model), Coulomb(model, rigid=True)
    data.qvel[2] = -2.0
    for _ in range(200):
        law.step(data)
        assert data.qpos[2] > 0.1 - 1e-5
    assert np.abs(data.qvel).max() < 1e-6


@pytest.mark.parametrize("gap", [0.0, 0.01])
def test_adhesion_holds_what_touches_and_reaches_no_farther(gap):
    """A box at a wall, at which 20 N hold its weight; a hundredth beside it falls freely."""
    model = mujoco.MjModel.from_xml_string(
        f'<mujoco><worldbody><geom type="box" pos="{0.2 + gap} 0 0" size=".1 1 1" friction=".5"/>'
        '<body name="box"><freejoint/><geom type="box" size=".1 .1 .1" mass="1" friction=".5"/>'
        '</body></worldbody><actuator><adhesion body="box" ctrlrange="0 1" gain="20"/></actuator>'
        "</mujoco>"
    )
    data, law = mujoco.MjData(model), Coulomb(model, rigid=True)
    data.ctrl[:] = 1.0
    law.step(data, 200)
    assert data.qvel == pytest.approx([0, 0, -9.81 * 0.4 if gap else 0, 0, 0, 0], abs=1e-12)


@pytest.mark.parametrize("away", [0.01, 4e-3, 2e-3, 5e-4])
def test_a_ball_that_is_hit_next_to_a_cushion_bounces_and_hits_back(away):
    """Each impact follows the other in a step, or within it: one after the other they bounce."""
    balls = "".join(
        f'<body pos="{x} 0 .03"><freejoint/><geom size=".03" friction="0"/></body>'
        for x in (-0.3, 0)
    )
    cushion = f'<geom type="box" pos="{0.08 + away} 0 .05" size=".05 1 .05" friction="0"/>'
    model = world(FLOOR.replace("/>", ' friction="0"/>') + cushion + balls, 'timestep=".002"')
    data, law = mujoco.MjData(model), Coulomb(model, rigid=True, restitution=1.0)
    data.qvel[0] = 2.0
    law.step(data, 200)
    assert data.qvel[[0, 6]] == pytest.approx([-2.0, 0.0], abs=1e-3)


def test_a_billiard_break_keeps_its_energy():
    """Fifteen balls that all but touch, with hardly any friction."""
    r, places = 0.0286, [(-0.3, 0.003)]
    for row in range(5):
        for k in range(row + 1):
            places.append((1.0005 * row * r * 3**0.5, 1.0005 * (2 * k - row) * r))
    balls = "".join(
        f'<body pos="{x} {y} {r}"><freejoint/><geom size="{r}" mass=".17" friction="0"/></body>'
        for x, y in places
    )
    model = world(FLOOR.replace("/>", ' friction="0"/>') + balls, 'timestep=".002"')
    data, law = mujoco.MjData(model), Coulomb(model, rigid=True, restitution=1.0)
    data.qvel[0] = 5.0
    law.step(data, 150)
    assert np.sort(np.abs(data.qvel))[-9] > 0.5  # they have gone apart
    assert (data.qvel**2).sum() == pytest.approx(25.0, rel=1e-4)


def test_restitution_of_each_geom():
    """A ball bounces by what it has, another one not at all."""
    balls = (f'<body pos="{x} 0 1"><freejoint/><geom size=".05"/></body>' for x in (0, 1))
    model = world(FLOOR + "".join(balls))
    data, law = mujoco.MjData(model), Coulomb(model, rigid=True, restitution=[0.0, 0.8, 0.0])
    heights = []
    for _ in range(450):  # until .9 s: the first falls for .44 s
        law.step(data)
        heights.append(data.qpos[[2, 9]].copy())
    after = np.array(heights)[230:]
    assert after[:, 0].max() - 0.05 == pytest.approx(0.8**2 * 0.95, rel=1e-2)
    assert after[:, 1].max() < 0.0501
    with pytest.raises(
        ValueError,
        match=r"restitution = \[0.5, 0.5\] must be one number, or one for each of 3 geoms",
    ):
        Coulomb(model, rigid=True, restitution=[0.5, 0.5])
    with pytest.raises(ValueError, match=r"restitution\[1\] = 1.5 must be from 0 to 1"):
        Coulomb(model, rigid=True, restitution=[0.0, 1.5, 0.0])


@pytest.mark.parametrize("table", [False, True])
@pytest.mark.parametrize("speed", [1e-3, 0.03, 1.0])
def test_nothing_is_too_slow_to_bounce_off_what_it_does_not_fall_on(table, speed):
    """Billiard balls, and such in space: below 4 cm/s one stopped the other half way."""
    ball = '<geom size=".05" mass="1" condim="1"/>'
    bodies = "".join(f'<body pos="{x} 0 .05"><freejoint/>{ball}</body>' for x in (0, 0.12))
    smooth = FLOOR.replace("/>", ' condim="1"/>') if table else ""
    model = world(smooth + bodies, f'gravity="0 0 {-G * table}"')
    data = mujoco.MjData(model)
    data.qvel[0] = speed
    Coulomb(model, rigid=True, restitution=0.9).step(data, int(0.04 / speed / 2e-3))
    np.testing.assert_allclose(data.qvel[[0, 6]], [0.05 * speed, 0.95 * speed], rtol=1e-3)


def test_steps_that_did_not_come_to_their_share_are_counted():
    """A share that no solution reaches in the steps it may take."""
    model = world(f'{FLOOR}<body pos="0 0 .3" euler="10 20 0"><freejoint/>{BOX}</body>')
    usual, strict = Coulomb(model), Coulomb(model, share=1e-9)
    for law in (usual, strict):
        data = mujoco.MjData(model)
        data.qvel[:] = 1.0
        law.step(data, 500)
    assert usual.unsolved == 0 < strict.unsolved


@WAYS
def test_tendons_move_beside_what_rests(rigid):
    """A body without geoms swings on a tendon with dry friction while a box lies there: the
    tendon's Jacobian is that of each step, as it is with a geom on the body."""
    found = []
    for geom in ("", '<geom size=".001" mass="0" contype="0" conaffinity="0"/>'):
        model = mujoco.MjModel.from_xml_string(f"""<mujoco><worldbody>
            <geom type="plane" size="0 0 1"/>
            <body pos="0 0 .1"><freejoint/><geom type="box" size=".1 .1 .1" mass="1"/></body>
            <body pos="0 1 1"><joint type="hinge" axis="0 1 0"/>{geom}
              <inertial pos=".2 0 0" mass=".2" diaginertia="1e-3 1e-3 1e-3"/>
              <site name="s" pos=".2 0 0"/></body>
            <site name="s2" pos="0 1 1.3"/></worldbody>
            <tendon><spatial frictionloss="1"><site site="s"/><site site="s2"/></spatial></tendon>
            </mujoco>""")
        data = mujoco.MjData(model)
        Coulomb(model, rigid=rigid).step(data, 500)
        found.append(float(data.qpos[-1]))
    assert abs(found[1]) > 0.1
    assert found[0] == pytest.approx(found[1], abs=1e-9)
