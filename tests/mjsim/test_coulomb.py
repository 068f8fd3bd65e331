"""Coulomb's law in any MuJoCo model: what sticks does not creep, what slides does not lift, what
lands does not bounce.

Closed forms are of one rigid body. MuJoCo's step is of first order: what moves is wrong by h/2
times its speed. That rigid contacts roll, turn, land and bounce as they should exact cases show, in
tests/compare/test_engines.py."""

import contextlib
import math
from pathlib import Path

import mujoco
import numpy as np
import pytest

from docs.studies import friction
from docs.studies.friction import BALL, BOX, FLAT, G
from docs.studies.small_scenes import FLOOR, free, model
from mjsim import Coulomb
from mjsim.coulomb.parameters import Law

WAY = friction.SOFT, friction.RIGID
SCENES = Path(__file__).parents[2] / "docs" / "friction"
SMOOTH = FLOOR.replace("/>", ' friction="0"/>')
PYRAMID = mujoco.mjtCone.mjCONE_PYRAMIDAL
WAYS = pytest.mark.parametrize("rigid", [False, True], ids=["soft", "rigid"])
INTEGRATORS = pytest.mark.parametrize("integrator", ["Euler", "implicitfast", "implicit"])


def world(bodies, option="", **more):
    """A model, and data of it."""
    made = model(bodies, option, **more)
    return made, mujoco.MjData(made)


def scene(geom=BOX, option="", height=0.05, **more):
    """A body on a plane, which may slope."""
    return world(FLOOR + free("body", f"0 0 {height}", geom), option, **more)


def stack(**more):
    """Two boxes, one on top of the other."""
    return world(FLOOR + free("one", "0 0 .05", BOX) + free("two", "0 0 .15", BOX), **more)


def creep(made, rigid):
    return friction.crept(*friction.start(made, WAY[rigid]))


@WAYS
@pytest.mark.parametrize(
    ("option", "geom"),
    [
        ("", BOX),
        ('integrator="implicitfast"', BOX),
        ('integrator="implicit" impratio="10"', BOX),
        ('solver="CG"', BOX),
        ('solver="PGS" iterations="1000"', BOX),
        ("", f'{BOX} condim="4"'),
        ("", f'{BOX} condim="6"'),
        ("", f'{BALL} condim="6" friction=".6 .005 .02"'),
    ],
)
def test_nothing_creeps(rigid, option, geom):
    """Nothing moves inside the cone, nor a ball inside that of rolling friction, .02 m of a radius
    of .05 m.

    What is left is the solver's: with its default tolerance, 1e-8, about 1e-12 m/s, with implicit
    integrators 1e-10."""
    assert creep(scene(geom, f'tolerance="1e-14" {option}', slope=10)[0], rigid) < 1e-12


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
        bodies = '<geom type="hfield" hfield="hill"/>' + free("box", f"{x} .1 .12", FLAT)
        ways.append(creep(model(bodies, more=f"<asset>{hill}</asset>", mu=1.0), rigid=True))
    assert np.median(ways) < 1e-5


@WAYS
@pytest.mark.parametrize("direction", [0.0, 0.5])
def test_what_slides_has_kinetic_friction_and_what_stops_holds_by_static_friction(rigid, direction):
    """Beyond mu W a box breaks away, with kinetic mu it slides, in any direction; at rest it holds
    again."""
    mu, kinetic, h = 0.5, 0.6, 2e-3
    made, data = scene(FLAT, mu=mu)
    law = Coulomb(made, rigid=rigid, kinetic=kinetic)
    along = np.array([np.cos(direction), np.sin(direction), 0])

    def pull(start, end, steps):
        """Speed and mean acceleration of a box pulled by a force that grows, in weights."""
        before = data.qvel[:3] @ along
        for force in np.linspace(start, end, steps):
            data.xfrc_applied[1, :3] = force * G * along
            law.step(data)
        speed = data.qvel[:3] @ along
        return speed, (speed - before) / (steps * h)

    for _ in range(2):
        assert abs(pull(0.0, 0.995 * mu, 1000)[0]) < 1e-3 * G * h  # held, up to what is soft
        assert pull(0.995 * mu, 1.005 * mu, 200)[0] > G * h  # gone
        pull(0.45, 0.45, 50)  # until it rocks no more
        _, acceleration = pull(0.45, 0.45, 100)
        assert acceleration == pytest.approx((0.45 - kinetic * mu) * G, rel=1e-4)
        pull(0.0, 0.0, 1000)


@WAYS
@pytest.mark.parametrize("geom", ['type="box" size=".05 .05 .05"', 'type="cylinder" size=".1 .05"'])
def test_what_is_pulled_suddenly_gives_way_a_little_and_keeps_its_static_friction(rigid, geom):
    made, data = scene(f'{geom} mass="1"', mu=0.6)
    law = Coulomb(made, rigid=rigid, kinetic=0.5)
    law.step(data, 500)
    data.xfrc_applied[1, 0] = 0.98 * 0.6 * G
    law.step(data, 500)
    assert np.abs(data.qvel).max() < 1e-6


def test_kinetic_friction_is_not_taken_twice_from_contacts_that_are_asked_again():
    made, data = scene(FLAT, mu=0.5)
    law = Coulomb(made, rigid=True, kinetic=0.5)
    data.qvel[0] = 1.0
    law.step(data, 10)
    with law.acting(data):
        mujoco.mj_forward(made, data)
        for _ in range(2):
            assert data.contact.friction[:, 0] == pytest.approx(0.25)
            mujoco.mj_forwardSkip(made, data, mujoco.mjtStage.mjSTAGE_POS, 0)


@WAYS
@pytest.mark.parametrize("shape", ["box", "cylinder", "sphere"])
@pytest.mark.parametrize("step", [4e-3, 2e-3, 1e-3])
def test_what_slides_keeps_its_contacts(rigid, shape, step):
    """Down a slope with g (sin - mu cos), to 1e-9, and never without contact."""
    geom = f'type="{shape}" size=".05 .05 .05" mass="1"'
    # a ball slides as long as mu < 2/7 tan
    mu = 0.05 if shape == "sphere" else 0.25
    error, lost = friction.slide_down(step, WAY[rigid], geom, mu)
    # A cylinder's three points turn it a little as it begins: that dies out as slowly as it slides
    # fast.
    assert error < (1e-4 if shape == "cylinder" and rigid else 1e-9)
    assert lost == 0


@WAYS
@pytest.mark.parametrize("step", [4e-3, 1e-3])
@pytest.mark.parametrize(("mu", "speed"), [(0.2, 2), (0.4, 2), (1.2, 2), (1.2, 5)])
def test_what_is_pushed_off_keeps_its_height_and_stops_in_time(rigid, step, mu, speed):
    height, error = friction.pushed_off(step, WAY[rigid], mu, speed)
    assert height < 3e-5
    # of the way v^2/(2 mu g), that of half a step at the speed
    assert abs(error) < 1.1 * step * mu * G / speed


PLATE = 'type="box" size=".1 .1 .001" mass="1"'
CORNERS = [f'size=".001" mass="0" pos="{x} {y} 0"' for x in (-0.1, 0.1) for y in (-0.1, 0.1)]
FEET = "/><geom ".join([f'{PLATE} contype="0" conaffinity="0"', *CORNERS])


def test_what_slides_over_the_seams_of_a_floor_stops_only_at_a_wall():
    """With rigid contacts, which see the sides of tiles ahead; a wall stands on its tiles."""
    tile = '<geom type="box" size=".1 .1 .05" pos="{} {} -.05"/>'
    tiles = "".join(tile.format(0.2 * i, 0.2 * j) for i in range(5) for j in range(5))
    wall = '<geom type="box" size=".1 1 .1" pos=".8 0 .1"/>'
    made, data = world(tiles + wall + free("box", "-.02 .01 .05", BOX), mu=0.3)
    law = Coulomb(made, rigid=True)
    data.qvel[:2] = 2.0, 1.0
    law.step(data, 100)
    slower = 1 - 0.3 * G * data.time / math.hypot(2, 1)
    np.testing.assert_allclose(data.qvel[:2], [2 * slower, slower], rtol=1e-3)
    law.step(data, 400)
    assert data.qpos[0] == pytest.approx(0.65, abs=1e-4)


@WAYS
@pytest.mark.parametrize("geom", [BOX, 'type="cylinder" size=".08 .03"'])
@pytest.mark.parametrize("rise", [0.0, 0.1])
def test_what_slides_over_a_heightfield_stops_at_no_edge_of_its_cells(rigid, geom, rise):
    """Flat, or a slope that rises by `rise`."""
    heights = " ".join(f"{x / 16}" for _ in range(9) for x in range(17))
    hill = (
        f'<hfield name="hill" nrow="9" ncol="17" size="1 .5 {2 * rise} .1" elevation="{heights}"/>'
    )
    if rise == 0:
        hill = '<hfield name="hill" nrow="9" ncol="17" size="1 .5 .1 .1"/>'
    angle, mu = math.atan(rise), 0.2
    bodies = '<geom type="hfield" hfield="hill"/>' + free(
        "body", f"-.7 .03 {0.3 * rise + 0.06}", geom
    )
    made = model(bodies, more=f"<asset>{hill}</asset>", mu=mu)
    data, law = mujoco.MjData(made), Coulomb(made, rigid=rigid)
    law.step(data, 500)
    begin, speed = data.qpos[:3].copy(), 1.5
    data.qvel[:] = 0
    data.qvel[0], data.qvel[2] = speed * math.cos(angle), speed * math.sin(angle)
    law.step(data, 500)
    way = speed**2 / (2 * G * (mu * math.cos(angle) + math.sin(angle)))
    assert np.linalg.norm(data.qpos[:3] - begin) == pytest.approx(way, rel=0.02)


@pytest.mark.parametrize("turned", [203, 323])
def test_what_slides_down_across_tilted_cells_isnt_held_by_their_seams(turned):
    """Normals of seams lean uphill, no farther than those of cells lean downhill: they passed for
    these."""
    angle, mu, time = math.radians(15), 0.15, 0.7
    x, y = np.meshgrid(*2 * [np.linspace(-4, 4, 63)])
    along, across = math.cos(math.radians(turned)), math.sin(math.radians(turned))
    heights = -math.tan(angle) * (along * x + across * y)
    rise = np.ptp(heights)
    hill = f'<hfield name="hill" nrow="63" ncol="63" size="4 4 {rise} .5"/>'
    bodies = f'<geom type="hfield" hfield="hill" pos="0 0 {heights.min()}"/>'
    box = free("box", "0 0 0", 'type="box" size=".1 .1 .05"')
    made, data = world(bodies + box, more=f"<asset>{hill}</asset>", mu=mu)
    made.hfield_data[:] = (heights.ravel() - heights.min()) / rise
    normal = np.array([along * math.sin(angle), across * math.sin(angle), math.cos(angle)])
    down = np.array([along * math.cos(angle), across * math.cos(angle), -math.sin(angle)])
    axes = np.stack([down, np.cross(normal, down), normal], axis=1)
    mujoco.mju_mat2Quat(data.qpos[3:], axes.ravel())
    data.qpos[:3] = begin = 0.05 * normal + 0.013 * down
    Coulomb(made, rigid=True).step(data, round(time / made.opt.timestep))
    way = G * (math.sin(angle) - mu * math.cos(angle)) * time**2 / 2
    assert (data.qpos[:3] - begin) @ down == pytest.approx(way, rel=5e-3)


@pytest.mark.parametrize("geom", [BOX, 'type="capsule" size=".05 .05"'])
def test_a_finely_meshed_heightfield_holds_what_covers_many_of_its_cells(geom):
    """MuJoCo takes 50 points of it: of more, those within the margin pushed out those below."""
    hill = '<hfield name="hill" nrow="81" ncol="81" size=".6 .6 .1 .1"/>'
    bodies = '<geom type="hfield" hfield="hill"/>' + free("body", "0 0 .12", geom, euler="50 20 0")
    made, data = world(bodies, more=f"<asset>{hill}</asset>", mu=0.3)
    Coulomb(made, rigid=True).step(data, 1000)
    assert data.qpos[2] == pytest.approx(0.05, abs=1e-4)


@pytest.mark.parametrize(("cells", "size"), [(10, 3), (100, 30)])
@pytest.mark.parametrize("seed", [6, 12, 18, 19, 29, 39, 51, 174])
def test_what_lands_on_a_coarse_heightfield_comes_to_rest(seed, cells, size):
    """On a cell the collider has one point of it, of one corner now, of another in the next step,
    beside some of inner walls: it sank in, shook for ever, or fell through. How large a floor is
    doesn't matter: of 200 such boxes on the larger one 188 did so."""
    hill = f'<hfield name="hill" nrow="{cells + 1}" ncol="{cells + 1}" size="{size} {size} .1 .1"/>'
    box = free("box", ".013 .02 .3", 'type="box" size=".05 .04 .03"')
    bodies = '<geom type="hfield" hfield="hill"/>' + box
    made, data = world(bodies, more=f"<asset>{hill}</asset>", mu=0.5)
    random = np.random.default_rng(seed)
    data.qpos[3:] = random.normal(size=4)
    data.qvel[:] = random.normal(size=6) * [0.5, 0.5, 0.5, 4, 4, 4]
    Coulomb(made, rigid=True).step(data, 1500)
    assert data.qpos[2] > 0.03 - 1e-6
    assert np.abs(data.qvel).max() < 1e-6


def test_what_slides_over_the_corner_of_a_cell_keeps_its_corners():
    """Inner walls, which pass near its corners, took over what these bore: it tipped, and a wall
    stopped it with 16 times its weight."""
    hill = '<hfield name="hill" nrow="17" ncol="17" size="4 4 .1 .1"/>'
    angle, mu, speed = math.radians(323), 0.3, 1.5
    box = free("box", "0 0 .05", 'type="box" size=".1 .1 .05"')
    bodies = '<geom type="hfield" hfield="hill"/>' + box
    made, data = world(bodies, more=f"<asset>{hill}</asset>", mu=mu)
    ahead = np.array([math.cos(angle), math.sin(angle)])
    data.qpos[:2], data.qvel[:2] = 0.013 * ahead, speed * ahead
    data.qpos[3], data.qpos[6] = math.cos(angle / 2), math.sin(angle / 2)
    Coulomb(made, rigid=True).step(data, 600)
    way = speed**2 / (2 * mu * G)
    assert ahead @ data.qpos[:2] - 0.013 == pytest.approx(way, rel=0.01)


@pytest.mark.parametrize("shape", ['type="box" size=".1 .1 .05"', 'type="cylinder" size=".1 .05"'])
def test_what_slides_over_cells_larger_than_itself_is_stopped_by_no_inner_wall(shape):
    """Where the collider had but one point beside that of the wall, it was, in one of ten
    directions: a third of its way was missing."""
    asset = '<asset><hfield name="hill" nrow="7" ncol="7" size="1.5 1.5 1 1"/></asset>'
    bodies = '<geom type="hfield" hfield="hill"/>' + free("body", "0 0 .55", shape)
    speed, start, ways = 2.0, np.array([0.03, 0.02]), []
    for angle in np.radians(range(0, 360, 12)):
        made, data = world(bodies, more=asset, mu=0.5)
        made.hfield_data[:] = 0.5
        data.qpos[:2], data.qvel[:2] = start, speed * np.array([np.cos(angle), np.sin(angle)])
        data.qpos[3], data.qpos[6] = np.cos(angle / 2 + 0.1), np.sin(angle / 2 + 0.1)
        Coulomb(made, rigid=True).step(data, 750)
        ways.append(np.hypot(*data.qpos[:2] - start))
    assert np.array(ways) == pytest.approx(speed**2 / (2 * 0.5 * G), rel=0.01)


def test_a_wheel_rolls_over_cells_of_a_heightfield_as_over_a_plane():
    """It bore on points some mm below it, to which the collider jumped, and lost 4 % of its way."""
    hill = '<hfield name="hill" nrow="21" ncol="21" size="4 4 .1 .1"/>'
    geom = 'type="cylinder" size=".15 .05" euler="90 0 0"'
    wheel = free("wheel", "0 0 .15", geom, euler="0 0 133")
    bodies = '<geom type="hfield" hfield="hill"/>' + wheel
    made, data = world(bodies, more=f"<asset>{hill}</asset>", mu=0.8)
    angle, speed = math.radians(133), 1.5
    ahead = np.array([math.cos(angle), math.sin(angle)])
    data.qvel[:2], data.qvel[4] = speed * ahead, speed / 0.15
    Coulomb(made, rigid=True).step(data, 500)
    assert ahead @ data.qpos[:2] == pytest.approx(speed, rel=5e-3)


@WAYS
@pytest.mark.parametrize(("y", "tilt"), [(0.2, -5), (0.1, 20)])
def test_what_lands_across_the_rim_of_a_box_bears_on_it(rigid, y, tilt):
    """Its contacts with a face and the rim have different normals, and the rim is no inner edge.
    In plain MuJoCo it comes 10.6 mm deep."""
    capsule = free("capsule", f"0 {y} .3", 'type="capsule" size=".05 .1"', euler=f"{90 + tilt} 0 0")
    made, data = world('<geom type="box" size=".2 .2 .1"/>' + capsule)
    coulomb = Coulomb(made, rigid=rigid)
    for _ in range(150):
        coulomb.step(data)
        assert data.contact.dist.min(initial=0.0) > -0.012


def test_what_hangs_below_the_floor_on_which_a_body_slides_stops_at_a_wall():
    """The wall lies below the contacts that bear the body, but not all of the body lies above."""
    high = '<geom type="box" size="2 .3 .1" pos="0 0 .8"/>'
    wall = '<geom type="box" size=".05 .1 .25" pos="1 {} .25"/>'
    leg = 'type="capsule" fromto=".15 {0} 0 .15 {0} -.7" size=".05"'
    parts = "/><geom ".join(['type="box" size=".2 .6 .05"', leg.format(-0.5), leg.format(0.5)])
    bodies = high + wall.format(-0.5) + wall.format(0.5) + free("bridge", "0 0 .95", parts)
    made, data = world(bodies, mu=0.01)
    data.qvel[0] = 1.0
    Coulomb(made, rigid=True).step(data, 600)
    assert 0.5 < data.qpos[0] < 0.8


@WAYS
@pytest.mark.parametrize(
    ("geom", "height", "mu", "spin"),
    [(PLATE, 0.001, 0.3, 10), (FEET, 0.001, 0.3, 10), (FLAT, 0.05, 0.6, 1)],
    ids=["plate", "feet", "box"],
)
def test_what_slides_and_spins_turns_as_far_as_its_corners_let_it(rigid, geom, height, mu, spin):
    """They bear it as springs would; of rigid ones at last two or three bore it all."""
    made, data = scene(geom, height=height, mu=mu)
    data.qvel[[0, 1, 5]] = 1, 0.3, spin
    Coulomb(made, rigid=rigid).step(data, 300)
    inertia = made.body_inertia[1, 2]
    h, place, velocity = 1e-4, np.zeros(3), np.array([1.0, 0.3, spin])  # x, y, angle
    while velocity[0] > 0.01:
        corners = np.exp(1j * (place[2] + np.pi / 4 + np.pi / 2 * np.arange(4))) * 0.1 * np.sqrt(2)
        slip = velocity[0] + 1j * velocity[1] + 1j * velocity[2] * corners
        push = -mu * slip / np.abs(slip)  # of a load of 1 N
        arms = corners + height * push  # moments of all loads about the centre are none
        plane = np.array([np.ones(4), corners.real, corners.imag])
        balance = np.array([np.ones(4), arms.real, arms.imag])
        force = push * (np.linalg.solve(balance @ plane.T, [G, 0, 0]) @ plane)
        moment = (np.conj(corners) * force).imag.sum()
        velocity += h * np.array([force.sum().real, force.sum().imag, moment / inertia])
        place += h * velocity
    assert 2 * np.arctan2(data.qpos[6], data.qpos[3]) == pytest.approx(place[2], rel=0.03)
    assert data.qpos[:2] == pytest.approx(place[:2], rel=0.03)


def test_baumgarte_stabilisation_takes_the_depth_away():
    """A ball that rolls down has the lever r, so that it gains 5/7 g sin(slope): 1 % less without
    it."""
    made, data = scene('size=".05" mass=".03" margin="2e-3"', 'tolerance="1e-12"', slope=5)
    law = Coulomb(made, servo=0.1)
    law.step(data, 500)
    speed = data.qvel[0]
    law.step(data, 500)
    assert abs(data.contact.dist[0]) < 1e-9
    assert data.qvel[0] - speed == pytest.approx(5 / 7 * G * np.sin(np.radians(5)), rel=1e-4)
    made, data = scene(f'{BOX} euler="10 20 0" margin="2e-3"', height=0.2)
    law, free_fall = Coulomb(made, servo=0.1), np.sqrt(2 * (0.2 - 0.075) / G)
    law.step(data, int(free_fall / made.opt.timestep) - 12)
    assert data.qvel[2] == pytest.approx(-G * data.time, rel=1e-9)  # the margin bears nothing
    law.step(data, 2000)
    assert np.abs(data.contact.dist).max() < 1e-9


# -- ways to step ----------------------------------------------------------------------------------


@WAYS
def test_every_way_to_step_leads_to_the_same_bits(rigid):
    """`step`, its halves; `mj_step`, of two simulations in turn, and its halves in either order
    under the callback; on a pyramid, which becomes a cone while the law acts, also where a program
    has found constraints by it between both halves."""
    made, data = stack(slope=17, mu=0.25)
    Coulomb(made, rigid=rigid).step(data, 100)
    for cone in (made.opt.cone, PYRAMID):
        made.opt.cone = cone
        others = at_once, halves, asked, whole, turned, other, later = [
            mujoco.MjData(made) for _ in range(7)
        ]
        law = Coulomb(made, rigid=rigid)
        law.step(at_once, 100)
        for _ in range(100):
            for one in (halves, asked):
                law.step1(one)
                if one is asked:
                    mujoco.mj_fwdPosition(made, one)
                law.step2(one)
        with Coulomb(made, rigid=rigid).installed():
            mujoco.mj_step1(made, turned)
            for _ in range(100):
                mujoco.mj_step2(made, turned)  # as dm_control does
                mujoco.mj_step1(made, turned)
                mujoco.mj_step(made, whole)
                mujoco.mj_step(made, other)
            mujoco.mj_step(made, later, 100)
        assert mujoco.get_mjcb_control() is None
        assert made.opt.cone == cone
        for one in others:
            assert (one.qpos == data.qpos).all()


def test_runge_kutta_has_the_callback():
    made, data = scene(option='integrator="RK4" tolerance="1e-14"', slope=15)
    law = Coulomb(made)
    law.step(data, 2500)
    place = data.qpos.copy()
    with law.installed():
        mujoco.mj_step(made, data, 500)
    assert data.qpos == pytest.approx(place, abs=1e-12)
    with pytest.raises(ValueError, match="integrator = RK4 has four stages"):
        law.step1(data)


@pytest.mark.parametrize("installed", [False, True])
@WAYS
def test_what_is_computed_between_steps_changes_nothing(rigid, installed):
    """A viewer or logger calls `mj_forward`: under the callback it finds the forces of the step,
    else it is plain MuJoCo's, pyramid and all; neither takes anything from the memory."""
    made, data = scene(option='tolerance="1e-14"', slope=15)
    made.opt.cone = made.opt.cone if installed else PYRAMID
    law = Coulomb(made, rigid=rigid)
    law.step(data, 1000)
    place, load = data.qpos.copy(), data.efc_force.copy()
    with law.installed() if installed else contextlib.nullcontext():
        for _ in range(500):
            mujoco.mj_forward(made, data)
            if installed:
                assert data.efc_force == pytest.approx(load, rel=1e-6)
            law.step(data)
    assert data.qpos == pytest.approx(place, abs=1e-11)


def test_other_models_and_other_callbacks():
    """What isn't installed is MuJoCo's own, to the bit; what a program raises is raised."""
    (made, data), (copy, copied) = (scene(slope=15) for _ in range(2))
    plain, other = mujoco.MjData(made), mujoco.MjData(made)
    mujoco.mj_step(made, plain, 100)
    with Coulomb(made).installed() as law:
        mujoco.mj_step(copy, copied, 100)
        assert (copied.qpos == plain.qpos).all()
        with pytest.raises(ValueError, match="installed\\(\\) already"), Coulomb(made).installed():
            pass
        law.step(data, 100)  # the callback serves it
        with Coulomb(copy).installed():
            mujoco.mj_step(copy, copied)
    mujoco.mj_step(made, plain)
    assert (copied.qpos != plain.qpos).any()
    Coulomb(made).step(other, 100)
    assert (data.qpos == other.qpos).all()
    with pytest.raises(RuntimeError, match="mine"), Coulomb(made).installed():
        raise RuntimeError("mine")


def test_a_callback_of_somebody_else_is_called_first_and_comes_back():
    """And what it raises is raised, as MuJoCo alone does; the step is then begun anew."""
    made, data = scene(slope=15)
    law, calls = Coulomb(made), []

    def pushes(model, data):
        calls.append(data.time)
        if len(calls) == 20:
            raise KeyError("mine")

    mujoco.set_mjcb_control(pushes)
    try:
        law.step(data, 10)
        with pytest.raises(KeyError, match="mine"), law.installed():
            mujoco.mj_step(made, data, 20)
        mujoco.mj_step(made, data, 5)
        assert mujoco.get_mjcb_control() is pushes
    finally:
        mujoco.set_mjcb_control(None)
    assert len(calls) == 25
    assert data.time == pytest.approx(24 * made.opt.timestep)


@pytest.mark.parametrize(
    ("option", "law", "words"),
    [
        ('integrator="discrete"', {}, "integrator = DISCRETE"),
        ('noslip_iterations="5"', {}, "noslip_iterations = 5"),
        ('><flag actuation="disable"/></option><option', {}, "actuation is disabled"),
        ("", {"restitution": 0.5}, r"restitution = 0\.5 needs rigid"),
        ("", {"servo": 1e-3}, r"servo = 0\.001 s must be at least 0\.002 s"),
        *(
            ("", {"rigid": True, "restitution": wrong}, words)
            for wrong, words in (
                (math.nan, r"restitution = nan must be from 0 to 1"),
                ([0.5] * 3, r"= \[0.5, 0.5, 0.5\] must be one number, or one for each of 2 geoms"),
                ([0.0, 1.5], r"restitution\[1\] = 1.5 must be from 0 to 1"),
            )
        ),
    ],
)
def test_of_what_no_law_is_made(option, law, words):
    with pytest.raises(ValueError, match=words):
        Coulomb(scene(option=option)[0], **law)


def test_what_is_refused():
    made, data = scene()
    law = Coulomb(made)
    with pytest.raises(ValueError, match="another MjModel"):
        law.step(stack()[1])
    with pytest.raises(ValueError, match="model is a MjData"):
        Coulomb(data)
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
    made.geom_friction[1, 0] = math.inf
    with pytest.raises(ValueError, match=r"geom_friction\[1\] = \[inf"):
        Coulomb(made)
    made.geom_friction[1, 0] = 1.0
    law = Coulomb(made, rigid=True)
    made.opt.timestep *= 2
    with pytest.raises(ValueError, match=r"timestep = 0\.004 s was 0\.002 s"):
        law.step(data)


@pytest.mark.parametrize(("array", "value"), [("qvel", np.nan), ("qfrc_applied", 1e300)])
def test_a_state_that_mujoco_resets_is_forgotten(array, value, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)  # where MuJoCo logs that it does
    made, data = scene(slope=15)
    law, fresh = Coulomb(made), mujoco.MjData(made)
    law.step(data, 50)
    getattr(data, array)[0] = value
    law.step(data, 50)
    Coulomb(made).step(fresh, 50)
    assert (data.qpos == fresh.qpos).all()


@pytest.mark.parametrize(("condim", "solref"), [(1, (0.02, 1)), (3, (-1000, 0))])
def test_contacts_without_friction_or_damping_are_the_engines_own(condim, solref):
    made, data = scene(BALL, slope=6)
    made.geom_condim[:], made.geom_solref[:] = condim, solref
    plain = mujoco.MjData(made)
    Coulomb(made).step(data, 400)
    mujoco.mj_step(made, plain, 400)
    assert data.qpos == pytest.approx(plain.qpos, rel=1e-12)


def test_steps_that_did_not_come_to_their_share_are_counted():
    """A share that no solution reaches in the steps it may take."""
    made, _ = scene(f'{BOX} euler="10 20 0"', height=0.3)
    usual, strict = Coulomb(made), Coulomb(made, share=1e-9)
    for law in (usual, strict):
        data = mujoco.MjData(made)
        data.qvel[:] = 1.0
        law.step(data, 500)
    assert usual.unsolved == 0 < strict.unsolved


# -- what brakes -----------------------------------------------------------------------------------

TURNS = '<body><joint name="turn" axis="0 0 1" {0}/><geom size=".1" mass="1"/></body>'
SLIDES = '<body><joint name="slide" type="slide"/><geom size=".1" mass="1"/></body>'
SERVO = '<velocity joint="turn" kv="100" {}/>'
LINK = '<geom type="capsule" fromto="0 0 0 .3 0 0" size=".02" contype="0"/>'
ARM = (
    f'<body><joint name="j" damping="3" axis="0 1 0"/>{LINK}'
    f'<body pos=".3 0 0"><joint name="k" damping=".5" axis="0 1 0"/>{LINK}</body></body>'
)
TENDON = '<joint joint="j" coef="1"/><joint joint="k" coef="-1"/>'
SERVOS = '<position joint="j" kp="30" kv="2"/><position tendon="t" kp="3" kv="1"/>'
BRAKED = {
    "at its limit": (TURNS, SERVO.format('forcerange="-.01 .01"'), ""),
    "in a group": (TURNS, SERVO.format('group="2"'), 'actuatorgroupdisable="2"'),
    "disabled": (TURNS.format('damping="10"'), "", '><flag damper="disable"/></option><option'),
    "in the parent": (TURNS, '<velocity jointinparent="turn" kv="100"/>', ""),
    "of an actuator": (SLIDES, '<motor joint="slide" damping="2000"/>', ""),
    "fluid": (free("ball", "0 0 0", 'size=".01" mass=".004"'), "", 'viscosity="100"'),
    "of an arm": (ARM, SERVOS, ""),
}


@INTEGRATORS
@pytest.mark.parametrize("name", BRAKED)
def test_rigid_contacts_take_what_brakes_as_mujoco_has_it(integrator, name):
    """Dampers become inertia, once, as under `implicitfast`; `implicit` has Coriolis forces'
    derivative, too. Of servos at their limits, and of disabled ones, nothing; of stiff ones all, at
    the end of the step; the inertia that others see afterwards is that of the bodies."""
    bodies, actuators, option = BRAKED[name]
    more = f"<actuator>{actuators}</actuator>"
    if name == "of an arm":
        more += f'<tendon><fixed name="t" damping="1">{TENDON}</fixed></tendon>'
    made, one = world(bodies.format(""), f'integrator="{integrator}" {option}', more=more)
    other = mujoco.MjData(made)
    for data in (one, other):
        data.ctrl[:] = 5.0 * (name != "of an arm")
        data.qfrc_applied[0] = 0.01
    Coulomb(made, rigid=True).step(one, 100)
    if integrator == "Euler":
        made.opt.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    mujoco.mj_step(made, other, 100)
    error = 1e-5 if integrator == "implicit" and name == "of an arm" else 1e-9
    assert one.qvel == pytest.approx(other.qvel, rel=error, abs=1e-15)
    assert one.qpos == pytest.approx(other.qpos, rel=error, abs=1e-15)
    assert pytest.approx(other.M, rel=1e-5) == one.M


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
    made, data = world(f"<body>{joint}</body>")
    made.opt.gravity[:] = 0
    law, plain = Coulomb(made, rigid=True), mujoco.MjData(made)
    data.qvel[0] = plain.qvel[0] = 1.0
    for damping in (0.01, 200.0, 3.0):
        made.dof_damping[:] = damping
        mujoco.mj_step(made, plain, 5)
        with law.installed() if installed else contextlib.nullcontext():
            mujoco.mj_step(made, data, 5) if installed else law.step(data, 5)
        assert data.qvel == pytest.approx(plain.qvel, rel=1e-9, abs=1e-15)


@pytest.mark.parametrize("rigid", [False, True])
def test_what_rests_becomes_softer_while_it_runs(rigid):
    """A weld at rest asks for the same acceleration as in the step before, but gives way more."""
    weld = '<body name="w" pos="0 0 1" gravcomp="1"><freejoint/><geom size=".1"/></body>'
    made, data = world(
        FLOOR + free("box", "1 0 .05", BOX) + weld, more='<equality><weld body1="w"/></equality>'
    )
    law = Coulomb(made, rigid=rigid)
    law.step(data, 50)
    made.eq_solimp[:, :2] = 0.5
    law.step(data)
    fresh = mujoco.MjData(made)
    fresh.qpos[:] = data.qpos
    mujoco.mj_forward(made, fresh)
    assert data.efc_R[:6] == pytest.approx(fresh.efc_R[:6], rel=1e-9)


def test_only_islands_in_doubt_are_solved():
    """Where a box tumbles; not where another one rests."""
    made, data = world(FLOOR + free("rests", "0 0 .05", BOX) + free("tumbles", "1 0 1.5", BOX))
    law, solved = Coulomb(made, rigid=True), np.zeros(2, int)
    data.qpos[10:14] = 0.8, 0.3, 0.4, 0.33
    for step in range(500):
        law.step(data)
        for contact in law._simulation(data)._array("contact")[: data.ncon] if step > 100 else ():
            solved[made.geom_bodyid[contact["geoms"][1]] - 1] += contact["solved"]
    assert solved[0] == 0
    assert solved[1] > 5


@INTEGRATORS
def test_a_damped_finger_lands_in_a_step(integrator):
    finger = '<joint type="slide" axis="0 0 1" damping="50"/><geom size=".02" mass=".2"/>'
    option = f'integrator="{integrator}" tolerance="1e-12"'
    made, data = world(f'{FLOOR}<body pos="0 0 .1">{finger}</body>', option)
    law, speeds = Coulomb(made, rigid=True), []
    data.qvel[0] = -24.0  # it comes into sight of the floor before it touches it
    for _ in range(300):
        law.step(data)
        speeds.append(float(data.qvel[0]))
    landed = int(np.argmax(np.array(speeds) > -1e-9))
    assert landed > 0
    assert abs(data.qpos[0] + 0.08) < 1.1 * Law.depth * 0.02  # the depth that it keeps
    assert max(abs(speed) for speed in speeds[landed:]) < 2e-5
    assert abs(speeds[-1]) < 1e-12


# -- what turns ------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", ["capsule", "box", "cylinder"])
@pytest.mark.parametrize("centre", ["0 0 0", ".1 .05 0"])
def test_what_spins_keeps_its_energy(kind, centre):
    """With rigid contacts: Euler's method alone takes the moment of the beginning of a step, and
    feeds it."""
    geom = f'type="{kind}" size=".02 .05 .03" pos="{centre}" quat="1 .3 .2 .1"'
    made, data = world(free("body", "0 0 0", geom))
    made.opt.gravity[:] = 0
    law, found = Coulomb(made, rigid=True), []
    data.qvel[3:] = 1, 12, 60
    for steps in (0, 600):
        law.step(data, steps)
        for update in (mujoco.mj_forward, mujoco.mj_energyVel, mujoco.mj_subtreeVel):
            update(made, data)
        momentum = np.linalg.norm(data.subtree_angmom[1])
        found.append([data.energy[1], momentum, *data.subtree_linvel[1]])
    np.testing.assert_allclose(*found, rtol=1e-12, atol=1e-11)


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
    table = '<body><joint/><geom type="cylinder" size="3 .1" pos="0 0 -.1" mass="1e9"/></body>'
    bodies = table + free("ball", f"{far} 0 {size}", f'size="{size}" mass="1"')
    for step in (4e-3, 2e-3):
        made, data = world(bodies, f'timestep="{step}" tolerance="1e-20"', mu=1.0)
        circles = 2 / 7 * turning
        data.qvel[[0, 2, 4]] = turning, far * circles, far * (turning - circles) / size
        Coulomb(made, rigid=True).step(data, round(1 / step))
        angle = circles * data.time
        off.append(np.abs(data.qpos[1:3] - far * np.array([np.cos(angle), np.sin(angle)])).max())
    assert off[0] < 1e-5
    assert off[0] / off[1] == pytest.approx(4, abs=0.3)


AXLE = '<body><joint/><inertial pos="0 0 0" mass="1" diaginertia="1e6 1e6 1e6"/>'
TABLES = pytest.mark.parametrize(
    "table",
    [
        '<geom type="box" size="1 1 .1" pos="0 0 -.1"/></body>',
        '</body><geom type="plane" size="9 9 1" surfacevel="0 0 0 0 0 2"/>',
    ],
    ids=["turns", "seems to turn"],
)


@WAYS
@TABLES
def test_what_stands_on_a_turntable_stays_there(rigid, table):
    """Also of a host that calls `mj_forward` after each step. What slips by what its turning adds
    in 10 ms comes 4 % farther out in a second."""
    made, data = world(AXLE + table + free("box", ".5 0 .05", FLAT), mu=1.0)
    data.qvel[[0, 2, 6]] = 2.0, 1.0, 2.0
    with Coulomb(made, rigid=rigid).installed():
        for _ in range(500):
            mujoco.mj_step(made, data)
            mujoco.mj_forward(made, data)
    assert math.hypot(*data.qpos[1:3]) == pytest.approx(0.5, rel=2e-4)
    assert math.atan2(data.qpos[2], data.qpos[1]) == pytest.approx(2 * data.time, abs=2e-4)


@WAYS
@TABLES
def test_what_a_turntable_has_caught_slips_no_more(rigid, table):
    """It did so for ever, by as much as in plain MuJoCo, 3 mm: half of its contacts stuck by turns.
    Rigid ones shake by half a µm in a tenth of a second."""
    made, data = world(AXLE + table + free("box", ".3 0 .05", 'type="box" size=".03 .03 .05"'))
    data.qvel[0] = 2.0
    law = Coulomb(made, rigid=rigid)
    law.step(data, 150)
    radius = math.hypot(*data.qpos[1:3])
    law.step(data, 250)
    assert math.hypot(*data.qpos[1:3]) == pytest.approx(radius, abs=1e-6)


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
    made, data = world(bodies, f'timestep="{step}"', mu=1.0)
    law = Coulomb(made, rigid=rigid)
    data.qpos[2], data.qvel[0], data.qvel[3] = 0.5, speed, speed / 0.05
    for _ in range(3):
        law.step(data, round(trail / speed / step))
        found.append(math.tan(data.qpos[2] / 2))
    assert found[1] / found[2] == pytest.approx(math.e, rel=0.02)


# -- what comes to rest ----------------------------------------------------------------------------


@WAYS
@pytest.mark.parametrize("seeds", [[3], pytest.param(range(20), marks=pytest.mark.slow)])
def test_piles_come_to_rest(seeds, rigid):
    """The collider of boxes drops points and finds them again: bodies would rock if they were not
    put back."""
    models = [friction.pile(seed, mixed=False) for seed in seeds]
    (_, usual), (drift, rise) = (
        np.transpose([friction.settle(*friction.start(each, way)) for each in models])
        for way in (friction.PLAIN, WAY[rigid])
    )
    assert (drift < friction.STILL).sum() >= 0.95 * len(models)
    assert rise.max() <= max(friction.RISE, *usual)


@WAYS
@pytest.mark.parametrize("apart", [0.0, 0.013], ids=["stack", "steps"])
def test_points_that_the_collider_adds_for_a_step_jolt_nothing(rigid, apart):
    """Of boxes of one size: flush, and each a little further down the slope than the one below."""
    boxes = (free(f"b{k}", f"{apart * k} 0 {0.0508 + 0.1 * k}", BOX) for k in range(3))
    made, data = world(FLOOR + "".join(boxes))
    made.opt.gravity[:] = 1.2, 0, -9.7
    law, counts, fastest = Coulomb(made, rigid=rigid), set(), 0.0
    law.step(data, 1000)
    for _ in range(4000):
        law.step(data)
        counts.add(int(data.ncon))
        fastest = max(fastest, np.abs(data.qvel).max())
    assert fastest < 1e-9
    assert rigid or apart or len(counts) > 1  # the collider does add points


@pytest.mark.parametrize("corners", [3, 6, 12])
def test_what_has_more_points_than_the_collider_takes_comes_to_rest(corners):
    """A prism that lands on a cylinder, on a table: one point takes the place of another, steps
    away, and both rocked at 3e-5 rad/s for ever."""
    ring = 0.1 * np.exp(2j * np.pi * np.arange(corners) / corners)
    mesh = " ".join(f"{at.real} {at.imag} {z}" for at in ring for z in (-0.05, 0.05))
    bodies = '<geom type="box" size=".5 .5 .1"/>'
    bodies += free("below", "0 0 .151", 'type="cylinder" size=".1 .05"')
    bodies += free("above", ".03 .02 .2525", 'type="mesh" mesh="prism"', euler="3 2 20")
    asset = f'<asset><mesh name="prism" vertex="{mesh}"/></asset>'
    made, data = world(bodies, more=asset, mu=1.0)
    data.qvel[6], data.qvel[-1], fastest = 0.3, 6.0, 0.0
    law = Coulomb(made, rigid=True)
    law.step(data, 1000)
    for _ in range(2000):
        law.step(data)
        fastest = max(fastest, np.abs(data.qvel).max())
    assert fastest < 1e-9


@pytest.mark.parametrize("corners", [6, 7])
def test_corners_that_the_collider_takes_by_turns_jolt_nothing(corners):
    """Four of a polygon, of a prism that rests on a slope; it crept as in plain MuJoCo."""
    ring = 0.1 * np.exp(2j * np.pi * np.arange(corners) / corners)
    mesh = " ".join(f"{at.real} {at.imag} {z}" for at in ring for z in (0, 0.1))
    asset = f'<asset><mesh name="prism" vertex="{mesh}"/></asset>'
    made, data = scene('type="mesh" mesh="prism" mass="1"', 'tolerance="1e-12"', more=asset, mu=1.0)
    made.opt.gravity[:] = 2.3, 1.7, -9.4
    Coulomb(made).step(data, 750)
    assert np.abs(data.qvel).max() < 1e-9


BLOCK = 'type="box" size=".1 .05 .08" pos=".03 .02 0"'
STEMS = [f'<geom type="box" size=".1 .1 .1" pos="{x} 0 .1"/>' for x in (0.16, -0.16)]
OVERLAPS = {
    "ball joint in the floor": f'<body pos="0 0 .05"><joint type="ball"/><geom {BLOCK}/></body>',
    "hinge in the floor": f'<body pos="0 0 .05"><joint axis="1 .3 .2"/><geom {BLOCK}/></body>',
    "wedged": "".join(STEMS)
    + free("box", "0 0 .1", 'type="box" size=".08 .05 .1"', euler="0 10 5"),
    "arm in a wall": '<geom type="box" size=".1 .5 .5" pos=".5 0 .5"/><body pos="0 0 .5">'
    '<joint axis="0 1 0"/><geom type="capsule" fromto="0 0 0 .45 0 .1" size=".05"/></body>',
}


@WAYS
@pytest.mark.parametrize("bodies", OVERLAPS.values(), ids=OVERLAPS)
def test_geoms_that_cannot_part_come_to_rest(rigid, bodies):
    """What would push them out of each other would do work for ever."""
    made, data = world(FLOOR + bodies)
    Coulomb(made, rigid=rigid).step(data, 4000)
    assert np.abs(data.qvel).max() < 1e-9


@pytest.mark.parametrize(
    ("shape", "place"),
    [
        ('type="cylinder" size=".009 .03"', ".003 .002 .069"),
        ('type="capsule" size=".009 .03"', ".003 .002 .069"),
        ('type="ellipsoid" size=".03 .01 .02"', ".01 -.007 .07"),
    ],
)
def test_what_lies_on_its_smooth_side_stays(shape, place):
    """Under rigid contacts, whose points colliders must not find a micrometre beside."""
    slab = '<geom type="box" size=".2 .2 .03" pos="0 0 .03"/>'
    made, data = world(slab + free("rod", place, f'{shape} mass=".05"', euler="90 0 0"))
    Coulomb(made, rigid=True).step(data, 1000)
    assert np.abs(data.qvel).max() < 1e-6
    assert made.opt.ccd_tolerance == 1e-6


@WAYS
def test_what_rolls_fast_has_no_more_points_than_the_collider_finds(rigid):
    """It left the last step's point behind, as if that were the corner of a face."""
    round_ones = 'type="sphere" size=".05"', 'type="ellipsoid" size=".05 .08 .05"'
    bodies = [free(f"b{k}", f"0 {k} .05", each) for k, each in enumerate(round_ones)]
    bodies.append(free("c", "0 3 .05", 'type="cylinder" size=".05 .1"', euler="90 0 0"))
    made, data = world(FLOOR + "".join(bodies), mu=0.6)
    data.qvel[::6], data.qvel[4::6] = 1.0, 20.0
    law = Coulomb(made, rigid=rigid)
    law.step(data, 100)
    assert data.ncon == 4


def test_where_rigid_forces_are_predicted_the_solver_has_nothing_to_do():
    """What slides down a slope goes as Coulomb's law says, to round-off all the same."""
    made, data = scene(slope=20, mu=0.25)
    coulomb = Coulomb(made, rigid=True)
    coulomb.step(data, 500)
    before, idle = data.qvel[0], 0
    for _ in range(100):
        coulomb.step(data)
        idle += data.solver_niter[0] == 0
    assert idle > 50
    angle = math.radians(20)
    gained = 9.81 * (math.sin(angle) - 0.25 * math.cos(angle)) * 100 * made.opt.timestep
    assert data.qvel[0] - before == pytest.approx(gained, rel=1e-10)
    assert made.opt.tolerance == 1e-8


def test_dry_joints_stop_as_suddenly_as_rigid_contacts():
    """After J w^2/(2 M), to half a step's way. In plain MuJoCo what is slower than M/J times the
    joint's time constant dies out: it would go 2.4 times as far."""
    body = '<body><joint frictionloss="5"/><inertial pos="0 0 0" mass="1" {}/></body>'
    made, data = world(body.format('diaginertia=".02 .02 .02"'), 'timestep="1e-3"')
    data.qvel[0] = 2.0
    Coulomb(made, rigid=True).step(data, 200)
    assert data.qpos[0] == pytest.approx(0.02 * 2.0**2 / (2 * 5) - 2.0 * 1e-3 / 2, rel=1e-3)


OCTAGON = " ".join(
    f"{0.05 * math.cos(k * math.pi / 4)} {0.05 * math.sin(k * math.pi / 4)} {z}"
    for k in range(8)
    for z in (-0.05, 0.05)
)


@WAYS
@pytest.mark.parametrize("geom", ['type="cylinder" size=".05 .05"', 'type="mesh" mesh="octagon"'])
@pytest.mark.parametrize("direction", np.linspace(0.1, 5.5, 5))
def test_what_stands_on_many_corners_tips_over_none_of_them_too_early(rigid, geom, direction):
    """It would tip by 1.13 times the pull. Of a face the collider takes four points within
    the margin, also those that rise."""
    bodies = '<geom type="box" size="1 1 .1" pos="0 0 -.1"/>' + free("body", "0 0 .05", geom)
    mesh = f'<asset><mesh name="octagon" vertex="{OCTAGON}"/></asset>'
    made, data = world(bodies, more=mesh, mu=2.0)
    made.opt.gravity[:2] = 8.0 * math.cos(direction), 8.0 * math.sin(direction)
    Coulomb(made, rigid=rigid).step(data, 250)
    assert data.body("body").xmat[8] > math.cos(math.radians(0.5))


def test_contacts_keep_their_gaps_while_points_are_added():
    """Two of them had that of another point, mm away, after which the collider had been asked."""
    bodies = '<geom type="box" size="1 1 .1" pos="0 0 -.1"/>' + free(
        "body", "0 0 .06", 'type="cylinder" size=".05 .05"', euler="3 2 0"
    )
    made, data = world(bodies, mu=2.0)
    made.opt.gravity[:] = 7.0, 4.0, -9.81
    law = Coulomb(made, rigid=True)
    for _ in range(300):
        with law.acting(data):
            mujoco.mj_forward(made, data)
            memory = law._simulation(data)
            contacts = memory._array("contact")[: memory.record["contacts"][0]]
            assert (contacts["gap"] == data.contact.dist[contacts["index"]]).all()
        law.step(data)


@WAYS
def test_tendons_move_beside_what_rests(rigid):
    """A body without geoms swings on a tendon with dry friction while a box lies there: the
    tendon's Jacobian is that of each step, as it is with a geom on the body."""
    mass = '<inertial pos=".2 0 0" mass=".2" diaginertia="1e-3 1e-3 1e-3"/>'
    sites = '<site site="s"/><site site="s2"/>'
    tendon = f'<tendon><spatial frictionloss="1">{sites}</spatial></tendon>'
    found = []
    for geom in ("", '<geom size=".001" mass="0" contype="0" conaffinity="0"/>'):
        swings = f'<joint axis="0 1 0"/>{geom}{mass}<site name="s" pos=".2 0 0"/>'
        bodies = f'<body pos="0 1 1">{swings}</body><site name="s2" pos="0 1 1.3"/>'
        made, data = world(FLOOR + free("box", "0 0 .05", BOX) + bodies, more=tendon)
        Coulomb(made, rigid=rigid).step(data, 500)
        found.append(float(data.qpos[-1]))
    assert abs(found[1]) > 0.1
    assert found[0] == pytest.approx(found[1], abs=1e-9)


# -- what is pushed, lands and bounces -------------------------------------------------------------


@WAYS
@pytest.mark.parametrize("speed", [0.1, 0.5])
def test_mocap_bodies_push(rigid, speed):
    """Whose velocity MuJoCo doesn't know; rigid contacts let them pass."""
    pusher = '<body mocap="true" pos="-.1 0 .05"><geom type="box" size=".05 .05 .04"/></body>'
    made, data = world(FLOOR + pusher + free("box", "0 0 .05", BOX), mu=0.3)
    law = Coulomb(made, rigid=rigid)
    for _ in range(500):
        data.mocap_pos[0, 0] += speed * made.opt.timestep
        law.step(data)
    assert data.qvel[0] == pytest.approx(speed, rel=1e-2)
    assert 0.1 - data.qpos[0] + data.mocap_pos[0, 0] < 0.04 * speed


@pytest.mark.parametrize("gap", [0.0, 0.01])
def test_adhesion_holds_what_touches_and_reaches_no_farther(gap):
    """A box at a wall, at which 20 N hold its weight; a hundredth beside it falls freely."""
    wall = f'<geom type="box" pos="{0.15 + gap} 0 0" size=".1 1 1"/>'
    glue = '<actuator><adhesion body="box" ctrlrange="0 1" gain="20"/></actuator>'
    made, data = world(wall + free("box", "0 0 0", BOX), more=glue, mu=0.5)
    data.ctrl[:] = 1.0
    Coulomb(made, rigid=True).step(data, 200)
    assert data.qvel == pytest.approx([0, 0, -G * 0.4 if gap else 0, 0, 0, 0], abs=1e-12)


@WAYS
@pytest.mark.parametrize("solver", ["CG", "PGS"])
def test_what_lands_as_it_slides_is_caught(rigid, solver):
    """By any solver as by Newton's method: PGS let it fall until it was 4 mm deep."""
    ends = []
    for each in ("Newton", solver):
        made, data = scene(option=f'solver="{each}" tolerance="1e-14"')
        data.qvel[:2] = 1.2, 0.3
        Coulomb(made, rigid=rigid).step(data, 20)
        ends.append(data.qpos.copy())
    np.testing.assert_allclose(*ends, atol=1e-6)


@pytest.mark.parametrize("flag", ["gravity", "override"])
def test_what_lands_without_gravity_or_with_one_margin_for_all_is_seen_ahead(flag):
    value = {"gravity": "disable", "override": "enable"}[flag]
    made, data = scene(height=0.1515, extra=f'<flag {flag}="{value}"/>')
    law = Coulomb(made, rigid=True)
    data.qvel[2] = -2.0
    for _ in range(200):
        law.step(data)
        assert data.qpos[2] > 0.05 - 1e-5
    assert np.abs(data.qvel).max() < 1e-6


def test_what_lands_on_one_of_several_geoms_of_a_body_is_seen_ahead():
    """MuJoCo first compares such bodies by margins of their own."""
    made, data = world(FLOOR + '<geom type="box" size=".3 .3 .1"/>' + free("box", "0 0 .3", BOX))
    law = Coulomb(made, rigid=True)
    for _ in range(200):
        law.step(data)
        assert data.qpos[2] > 0.15 - 1e-5


def balls(*places, radius=0.03, geom='friction="0"'):
    """Balls of the same kind on a floor."""
    geom = f'size="{radius}" mass=".17" {geom}'
    return "".join(free(f"b{k}", f"{x} {y} {radius}", geom) for k, (x, y) in enumerate(places))


@pytest.mark.parametrize("away", [0.01, 4e-3, 2e-3, 5e-4])
def test_a_ball_that_is_hit_next_to_a_cushion_bounces_and_hits_back(away):
    """Each impact follows the other in a step, or within it: one after the other they bounce."""
    cushion = f'<geom type="box" pos="{0.08 + away} 0 .05" size=".05 1 .05" friction="0"/>'
    made, data = world(SMOOTH + cushion + balls((-0.3, 0), (0, 0)))
    data.qvel[0] = 2.0
    Coulomb(made, rigid=True, restitution=1.0).step(data, 200)
    assert data.qvel[[0, 6]] == pytest.approx([-2.0, 0.0], abs=1e-3)


def test_a_billiard_break_keeps_its_energy():
    """Fifteen balls that all but touch, with hardly any friction."""
    r, places = 0.0286, [(-0.3, 0.003)]
    for row in range(5):
        for k in range(row + 1):
            places.append((1.0005 * row * r * 3**0.5, 1.0005 * (2 * k - row) * r))
    made, data = world(SMOOTH + balls(*places, radius=r))
    data.qvel[0] = 5.0
    Coulomb(made, rigid=True, restitution=1.0).step(data, 150)
    assert np.sort(np.abs(data.qvel))[-9] > 0.5  # they have gone apart
    assert (data.qvel**2).sum() == pytest.approx(25.0, rel=1e-4)


def test_restitution_of_each_geom():
    """A ball bounces by what it has, another one not at all."""
    made, data = world(FLOOR + free("one", "0 0 1", BALL) + free("other", "1 0 1", BALL))
    law, heights = Coulomb(made, rigid=True, restitution=[0.0, 0.8, 0.0]), []
    for _ in range(450):  # until .9 s: the first falls for .44 s
        law.step(data)
        heights.append(data.qpos[[2, 9]].copy())
    after = np.array(heights)[230:]
    assert after[:, 0].max() - 0.05 == pytest.approx(0.8**2 * 0.95, rel=1e-2)
    assert after[:, 1].max() < 0.0501


@pytest.mark.parametrize("table", [False, True])
@pytest.mark.parametrize("speed", [1e-3, 0.03, 1.0])
def test_nothing_is_too_slow_to_bounce_off_what_it_does_not_fall_on(table, speed):
    """Billiard balls, and such in space: below 4 cm/s one stopped the other half way."""
    bodies = balls((0, 0), (0.12, 0), radius=0.05, geom='condim="1"')
    made, data = world(FLOOR.replace("/>", ' condim="1"/>') * table + bodies)
    made.opt.gravity[2] *= table
    data.qvel[0] = speed
    Coulomb(made, rigid=True, restitution=0.9).step(data, int(0.04 / speed / 2e-3))
    np.testing.assert_allclose(data.qvel[[0, 6]], [0.05 * speed, 0.95 * speed], rtol=1e-3)
