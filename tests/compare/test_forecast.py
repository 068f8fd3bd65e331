"""Forecasts of contacts stand beside what MuJoCo does in small scenes, and their advice does what
it says.

Settings of an MJCF file reach the engine of the league as MuJoCo itself reads them."""

import itertools
import json
import math
import re
from unittest import mock

import mujoco
import numpy as np
import pytest

from compare.bench import forecast, forecast_page
from compare.bench.settled import STILL, settle, time_to_settle
from model import InputError
from tests.commands import carried_out

FLOOR = '<geom name="floor" type="plane" size="20 20 .1" {}/>'
SPHERE, BLOCK = 'type="sphere" size=".05"', 'type="box" size=".05 .05 .05"'
GROUND, SLOPE = FLOOR.format(""), FLOOR.format('euler="0 15 0"')


def box(place=".013 0 .0525", angle="0 15 0", name="box", shape=BLOCK):
    geom = f'<geom name="{name}" {shape} mass="1"/>'
    return f'<body name="{name}" pos="{place}" euler="{angle}"><freejoint/>{geom}</body>'


def mjcf(world, option="", geom='friction=".6"', rest="", flag=""):
    start = f"<mujoco><option {option}>{flag}</option><default><geom {geom}/></default>"
    return f"{start}<worldbody>{world}</worldbody>{rest}</mujoco>"


ON_SLOPE = SLOPE + box()
STACK = SLOPE + "".join(
    box(f"{0.0135 + k * 0.0263} 0 {0.0525 + k * 0.0967}", name=f"box{k}") for k in range(4)
)
FINGER = (
    '<body name="{0}" pos="{1} 0 .2"><joint name="{0}" type="slide" axis="1 0 0" damping="20"/>'
    '<geom name="{0}" type="box" size=".01 .03 .03" mass=".2"/></body>'
)
GRIPPER = FINGER.format("left", -0.0305) + FINGER.format("right", 0.0305)
GRIPPER += '<body name="rod" pos="0 0 .2"><freejoint/>'
GRIPPER += '<geom name="rod" type="capsule" size=".02 .03" mass=".1"/></body>'
SQUEEZE = '<actuator><motor joint="left" ctrlrange="-9 9"/>'
SQUEEZE += '<motor joint="right" ctrlrange="-9 9"/></actuator>'
SQUEEZE += '<keyframe><key name="held" ctrl="5 -5"/></keyframe>'
BALL = SLOPE + box(".013 0 .0515", "0 0 0", "ball", f'{SPHERE} condim="6" friction=".6 .01 .03"')
PAIR = '<contact><pair geom1="floor" geom2="box" friction=".7 .5 .01" '
PAIR += 'solreffriction="{}" condim="4"/></contact>'
WHEEL = (
    '<body pos="{0} {1} 0"><joint axis="0 1 0" frictionloss="1"/>'
    '<geom name="wheel{2}" type="cylinder" size=".05 .02" euler="90 0 0" mass=".3"/></body>'
)
WHEELS = "".join(
    WHEEL.format(x, y, k) for k, (x, y) in enumerate(itertools.product((-0.1, 0.1), (-0.11, 0.11)))
)
CART = (
    '<body pos=".013 0 .0515" euler="0 15 0"><freejoint/><geom type="box" size=".15 .08 .02" '
    f'mass="2"/>{WHEELS}</body>'
)
ELLIPTIC = 'cone="elliptic"'
ROLLING = "ball held by rolling friction"
SCENES = {
    "slope": mjcf(ON_SLOPE, ELLIPTIC),
    "slope, pyramidal": mjcf(ON_SLOPE),
    "slope, pyramidal, condim 4": mjcf(ON_SLOPE, geom='friction=".6" condim="4"'),
    "slope, pyramidal, springs": mjcf(ON_SLOPE, geom='friction=".6" solref="-5000 -100"'),
    "slope, pyramidal, discrete": mjcf(
        ON_SLOPE, 'integrator="discrete"', 'friction=".6" solref=".01 .7"'
    ),
    "slope, implicitfast, wide impedance": mjcf(
        ON_SLOPE, f'{ELLIPTIC} integrator="implicitfast"', 'friction=".6" solimp=".3 .9 .004 .4 3"'
    ),
    "slope, RK4": mjcf(ON_SLOPE, f'{ELLIPTIC} integrator="RK4"'),
    "slope, PGS": mjcf(ON_SLOPE, f'{ELLIPTIC} solver="PGS" iterations="400" tolerance="0"'),
    "slope, noslip": mjcf(ON_SLOPE, f'{ELLIPTIC} noslip_iterations="30" noslip_tolerance="0"'),
    "slope, pair": mjcf(ON_SLOPE, f'{ELLIPTIC} impratio="3"', rest=PAIR.format("-1 -60")),
    "slope, margin": mjcf(
        ON_SLOPE, f'{ELLIPTIC} integrator="implicit"', 'friction=".6" margin=".002"'
    ),
    "stack": mjcf(STACK, f'{ELLIPTIC} impratio="5"'),
    "gripper": mjcf(GRIPPER, f'{ELLIPTIC} impratio="10"', rest=SQUEEZE),
    ROLLING: mjcf(BALL, f'{ELLIPTIC} impratio="3"'),
    f"{ROLLING}, pyramidal": mjcf(BALL),
    "wheels held by dry friction": mjcf(SLOPE + CART, f'{ELLIPTIC} impratio="20"'),
    "hidden mix": mjcf(
        FLOOR.format('solref=".004 1" friction=".3" euler="0 12 0"')
        + box(".01 0 .0525", angle="0 12 0")
    ),
}


def at_start(text):
    """A model of MJCF and its data, at its first keyframe if it has one."""
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    if model.nkey:
        mujoco.mj_resetDataKeyframe(model, data, 0)
    return model, data


def settled(text, limit=10.0, step=mujoco.mj_step):
    """A model, its state, and its forecast."""
    model, data = at_start(text)
    still = settle(model, data, limit, step)
    return model, data, forecast.forecast(model, data, still, step=step)


@pytest.fixture
def forecasts(tmp_path, capsys):
    """What the command says of a scene."""

    def forecasts(text, *words, code=0):
        (tmp_path / "scene.xml").write_text(text)
        ended, out, err = carried_out(capsys, "forecast", tmp_path / "scene.xml", *words)
        assert ended == code, err
        return json.loads(out) if "--json" in words else err if code else out

    return forecasts


UNADVISED = mock.patch.object(
    forecast.advice, "best_change", mock.Mock(return_value=(None, {"creep": np.zeros(1)}))
)
"""Without advice, whose search takes most of the time."""


@UNADVISED
@pytest.mark.parametrize("scene", SCENES)
def test_depth_creep_and_turning_are_as_predicted(scene):
    _, _, found = settled(SCENES[scene])
    assert not found.settled.moving
    for pair in found.pairs:
        assert not pair.slides
        assert pair.depth == pytest.approx(pair.depth_measured, rel=5e-2)
        # Round-off of a place, over the window.
        assert pair.creep == pytest.approx(pair.creep_measured, rel=1e-2, abs=1e-11)
        assert pair.turning == pytest.approx(
            pair.turning_measured, rel=1e-2, abs=STILL, nan_ok=True
        )


# A body that a moving floor drags under a guide; how far its place is from where it was put, and
# its pair.
GUIDED = (
    '<body pos="0 0 .0495"><joint type="slide" axis="0 0 1"/><geom name="box" {} mass="1"/></body>'
)
SLIDING = {
    "elliptic": (ELLIPTIC, 'friction=".6"', SPHERE),
    "springs": (ELLIPTIC, 'friction=".3" solref="-3000 -80"', SPHERE),
    "wide impedance": (ELLIPTIC, 'friction=".6" solimp=".3 .9 .002"', BLOCK),
    "pyramidal": ("", 'friction=".6"', SPHERE),
    "pyramidal, discrete": ('integrator="discrete"', 'friction=".4"', SPHERE),
    "solreffriction": (ELLIPTIC, "", SPHERE),
}


@UNADVISED
@pytest.mark.parametrize("name", SLIDING)
def test_contact_is_lost_from_the_predicted_speed_on(name):
    option, geom, shape = SLIDING[name]
    rest = PAIR.format(".2 1") if name == "solreffriction" else ""
    floor = FLOOR.format('surfacevel="1e-12 0 0"')  # what doesn't move at the beginning never does
    model, data, found = settled(mjcf(floor + GUIDED.format(shape), option, geom, rest))
    predicted = found.pairs[0].hover
    first, second = data.contact.frame[0].reshape(3, 3)[1:]
    pyramid = model.opt.cone == mujoco.mjtCone.mjCONE_PYRAMIDAL
    direction = (first + second) / math.sqrt(2) if pyramid else first
    for share, lost in ((0.95, False), (1.05, True)):
        for speed in np.linspace(0.1, share, 20) * predicted:
            model.geom_surfacevel[0, :3] = speed * direction
            carried = []
            for _ in range(100):
                mujoco.mj_step(model, data)
                carried.append(data.nefc > 0 and data.efc_force.max() > 0)
        assert (not all(carried)) == lost


# A box that gravity draws along its floor, a ball that rolling friction holds, and one that a motor
# turns as well: at a share of the load that Coulomb's law holds. For each the directions loaded,
# force divided by coefficient. Contacts are harder than MuJoCo's own, which hop where they have
# yet 2 or 3 % to give.
DRAWN = '<pair geom1="floor" geom2="{}" condim="{}" friction="{} {} .02 .02 .02" '
DRAWN += 'solimp=".99 .99 .001"/>'
ON_GUIDES = (
    '<body name="ball" pos="0 0 .0495"><joint type="slide" axis="1 0 0"/>'
    '<joint type="slide" axis="0 1 0"/><joint type="slide" axis="0 0 1"/>'
    f'<joint name="turn" axis="0 0 1"/><geom name="ball" {SPHERE} mass="1"/></body>'
)


def drawn(world, geom, condim, degrees, along=0.4, across=0.4, torque=0.0, arm=0.0):
    """A function of that share that makes the scene, and the load in units of the coefficients."""
    way = [math.cos(math.radians(degrees)), math.sin(math.radians(degrees))]
    u = np.array([way[0] / along, way[1] / across, (torque + arm) / 0.02])

    def scene(share):
        pull = 9.81 * share / np.linalg.norm(u)
        option = f'gravity="{pull * way[0]} {pull * way[1]} -9.81"'
        turns = f'<keyframe><key ctrl="{torque * pull}"/></keyframe>'
        turns = f'<actuator><motor joint="turn"/></actuator>{turns}' if torque else ""
        # The engine's first direction on a level floor is y.
        pair = f"<contact>{DRAWN.format(geom, condim, across, along)}</contact>"
        return mjcf(FLOOR.format("") + world, option, "", pair + turns)

    return scene, u


FLAT, BALL_ON_TOP = box("0 0 .05", "0 0 0"), box("0 0 .05", "0 0 0", "ball", SPHERE)
OFF_AXES = {
    "along an axis": drawn(FLAT, "box", 3, 0),
    "at 20 degrees": drawn(FLAT, "box", 3, 20),
    "at 30 degrees": drawn(FLAT, "box", 3, 30),
    "at 45 degrees": drawn(FLAT, "box", 3, 45),
    "anisotropic": drawn(FLAT, "box", 3, 45, 0.3, 0.6),
    "condim 4": drawn(ON_GUIDES, "ball", 4, 30, torque=0.02),
    "condim 6": drawn(BALL_ON_TOP, "ball", 6, 0, arm=0.05),
}


@UNADVISED
@pytest.mark.parametrize("name", OFF_AXES)
def test_friction_off_the_axes_of_the_pyramid_is_short_by_what_is_said(name):
    """Measured by the load that gives way: over two seconds it goes faster than anything creeps
    here."""
    scene, u = OFF_AXES[name]
    (pair,) = settled(scene(0.4))[2].pairs
    assert pair.short == pytest.approx(1 - np.linalg.norm(u) / np.abs(u).sum(), abs=2e-3)
    held, lost = 0.4, 1.2
    while lost - held > 2e-3:
        share = (held + lost) / 2
        model, data = at_start(scene(share))
        mujoco.mj_step(model, data, 500)
        begin = data.qpos[:2].copy()
        mujoco.mj_step(model, data, 1000)
        slid = np.linalg.norm(data.qpos[:2] - begin) / 2.0
        held, lost = (held, share) if slid > 0.015 else (share, lost)
    assert 1 - held == pytest.approx(pair.short, abs=1e-2)


@UNADVISED
@pytest.mark.parametrize("degrees", [20, 30, 45])
def test_what_slides_off_the_axes_is_braked_by_less_by_what_is_said(degrees):
    """By a floor that runs under a guided ball. Where contact is about to be lost each edge pushes
    as it slips, so that the force is opposite to the slip; where the last edge that pushes on has
    just gone, those beside it push more."""
    way = np.array([math.cos(math.radians(degrees)), math.sin(math.radians(degrees)), 0])
    floor = FLOOR.format(f'surfacevel="{1e-3 * way[0]} {1e-3 * way[1]} 0"')
    _, data, found = settled(mjcf(floor + GUIDED.format(SPHERE), 'impratio="10"'))
    force, (pair,) = np.empty(6), found.pairs
    mujoco.mj_contactForce(_, data, 0, force)
    braked = abs(force[:3] @ data.contact.frame[0].reshape(3, 3) @ way) / (0.6 * force[0])
    assert pair.slides
    assert pair.short == pytest.approx(1 - 1 / (way[0] + way[1]), abs=1e-6)
    edges = np.array([way[0] + way[1], 2 * way[1]])
    assert edges @ way[:2] / edges.sum() < braked < 1 - pair.short + 1e-3
    said = " ".join(forecast_page.sentences(found))
    assert "may hold them: floor / box" in said
    assert "No setting but more friction" not in said


@UNADVISED
def test_a_short_pyramid_is_told_and_a_round_cone_is_not():
    scene, _ = OFF_AXES["at 45 degrees"]
    found = settled(scene(0.4))[2]
    said = [line for line in forecast_page.sentences(found) if "pyramid" in line]
    assert len(said) == 1
    assert "floor / box by 29 %" in said[0]
    assert "Nothing needs to change." not in forecast_page.sentences(found)
    assert "short\n%" in forecast_page.tables(found)[0][1][0]
    found = settled(scene(0.4).replace("<option", '<option cone="elliptic"'))[2]
    assert math.isnan(found.pairs[0].short)
    assert not [line for line in forecast_page.sentences(found) if "pyramid" in line]
    assert "short\n%" not in forecast_page.tables(found)[0][1][0]


PULLED = (
    '<body pos="0 {1} .05"><joint name="{0}x" type="slide" axis="1 0 0" damping="20"/>'
    '<joint name="{0}y" type="slide" axis="0 1 0" damping="20"/><joint type="slide" axis="0 0 1"/>'
    f'<geom name="{{0}}" {BLOCK} mass="1"/></body>'
)
PULLS = "".join(
    f'<motor joint="{name}" gear="{pull}"/>'
    for name, pull in {"onex": 3, "oney": 5.2, "twox": -5, "twoy": 4.5}.items()
)
PULLS = f'<actuator>{PULLS}</actuator><keyframe><key ctrl="1 1 1 1"/></keyframe>'


@UNADVISED
@pytest.mark.parametrize("integrator", ["Euler", "RK4"])
def test_what_hops_as_it_slides_is_named_whichever_body_is_in_the_air(integrator):
    """Two boxes slide on in different directions, in the air most of the time."""
    world = GROUND + PULLED.format("one", 0) + PULLED.format("two", 1)
    text = mjcf(world, f'integrator="{integrator}"', 'friction=".3"', PULLS)
    for limit in (0.2, 0.5, 1.0, 1.1, 1.7, 3.0):
        _, _, found = settled(text, limit)
        pairs = sorted(found.pairs, key=lambda pair: pair.name)
        assert [pair.name for pair in pairs] == ["floor / one", "floor / two"]
        for pair in pairs:
            assert pair.moves
            assert len(pair.members) == 4
            assert pair.short == pytest.approx(1 - math.sqrt(1 / 2), abs=5e-3)
            if integrator == "Euler":
                assert pair.load == pytest.approx(9.81, rel=1e-2)
        (said,) = [line for line in forecast_page.sentences(found) if "pyramid" in line]
        assert "one by 29 %" in said
        assert "two by 29 %" in said


LEVEL = GROUND + box(place="0 0 .0499", angle="0 0 0")
ROUND = box("0 0 .0499", "0 0 0", "ball", SPHERE)
UNSAFE = '<flag refsafe="disable"/>'
STEPS = {
    "springs": mjcf(LEVEL, ELLIPTIC, 'solref="-5000 -100"'),
    "springs, pyramidal": mjcf(LEVEL, geom='solref="-5000 -100"'),
    "springs, little damping": mjcf(LEVEL, ELLIPTIC, 'solref="-5000 -10"'),
    "springs, RK4": mjcf(LEVEL, 'cone="elliptic" integrator="RK4"', 'solref="-5000 -100"'),
    "springs, gripper": mjcf(
        GRIPPER, 'cone="elliptic" impratio="10"', 'friction=".6" solref="-20000 -200"', SQUEEZE
    ),
    "friction": mjcf(LEVEL, ELLIPTIC, rest=PAIR.format("-1 -90")),
    "refsafe off": mjcf(LEVEL, ELLIPTIC, 'solref=".004 1"', flag=UNSAFE),
    "low impedance": mjcf(LEVEL, ELLIPTIC, 'solimp=".1 .1 .001"'),
}


@UNADVISED
@pytest.mark.parametrize("scene", STEPS)
def test_small_motions_grow_from_the_predicted_step_on(scene):
    model, data, found = settled(STEPS[scene])
    left = []
    for share in (1 / 1.1, 1.3):
        model.opt.timestep = share * found.largest_step
        trial = mujoco.MjData(model)
        trial.qpos[:], trial.ctrl[:] = data.qpos, data.ctrl
        mujoco.mj_step(model, trial, 300)  # depth depends on the step
        creeping = trial.qvel.copy()
        trial.qvel[:] += 1e-6 * np.cos(np.arange(model.nv))
        mujoco.mj_step(model, trial, 300)
        left.append(np.abs(trial.qvel - creeping).max())
    assert left[0] < 3e-5  # a ball goes on rolling
    assert left[1] > 1e-4


DEEP = {
    "deep": mjcf(LEVEL, ELLIPTIC, 'solref=".1 1"'),
    "deep, pyramidal": mjcf(LEVEL, geom='solref=".2 1"'),
    "deep, springs": mjcf(LEVEL, ELLIPTIC, 'solref="-100 -10"'),
}
QUICK = ("slope", "gripper", "ball held by rolling friction", "deep", "slope, pyramidal, springs")
ADVISED = [name for name in SCENES | DEEP if name != "slope, noslip"]


@pytest.mark.parametrize(
    "scene", [pytest.param(n, marks=() if n in QUICK else pytest.mark.slow) for n in ADVISED]
)
def test_advice_does_what_it_says(scene, here):
    """What is to be pasted is an element of MJCF that does the same, and a program that runs."""
    model, data, found = settled((SCENES | DEEP)[scene])
    found, after, held = forecast.follow_advice(model, data, found, 10.0)
    assert after
    change = found.change
    assert change
    assert change.found == pytest.approx(change.after, rel=0.2)
    assert change.found < change.before / 1.4
    text = (SCENES | DEEP)[scene].replace("<worldbody>", f"{change.mjcf}<worldbody>", 1)
    pasted = mujoco.MjModel.from_xml_string(text)
    names = [f"{kind}_{change.option}" for kind in ("geom", "pair")]
    for name in names if hasattr(model, names[0]) and not change.own else ():
        np.testing.assert_allclose(getattr(pasted, name), getattr(model, name))
    for name in [change.option] if hasattr(model.opt, change.option) else ():
        assert getattr(pasted.opt, name) == getattr(model.opt, name)
    creeps = max(pair.creep for pair in after.pairs) > forecast.Tolerances.creep
    assert bool(found.remedy) == bool(held) == creeps
    if held:
        (here / "scene.xml").write_text((SCENES | DEEP)[scene])
        exec(dict(forecast_page.snippets(found, "scene.xml"))["Python"], names := {})
        assert names["data"].time == names["model"].opt.timestep
    for pair in held.pairs if held else ():
        assert pair.creep == 0
        assert pair.creep_measured < 1e-3 * forecast.Tolerances.creep


CLOTH = '<flexcomp name="c" type="grid" count="4 4 1" spacing=".05 .05 .05" '
CLOTH += 'pos="1 1 .1" radius=".01" mass=".1">'
CLOTH += '<edge equality="true"/></flexcomp>'
FALLING = '<body name="stone"><freejoint/><geom size=".1"/></body>'
REFUSED = {
    "<mujoco><worldbody><geom type='brick'/></worldbody></mujoco>": (2, "MuJoCo refuses it"),
    mjcf(""): (2, "nothing touches"),
    mjcf(FALLING): (2, "nothing touches.*body 'stone' at .* m/s"),
    mjcf(FALLING, rest='<equality><weld body1="stone"/></equality>'): (2, "nothing touches"),
    mjcf(GROUND + CLOTH): (2, "nothing touches.*16 contacts of flexible bodies are left out"),
    mjcf(SLOPE + ROUND): (1, "still moves: body 'ball' at"),
    mjcf(LEVEL.replace('"/></body>', '" /><joint/></body>')): (2, "MuJoCo refuses it"),
    mjcf(LEVEL, 'timestep="0"'): (2, "scene.xml: timestep = 0 s is out of range: must be >= 1e-07"),
    mjcf(LEVEL, 'timestep="1e-12"'): (2, "scene.xml: timestep = 1e-12 s is out of range"),
    mjcf(LEVEL, 'timestep="nan"'): (2, "scene.xml: timestep = nan s must be finite"),
}


@pytest.mark.parametrize("text", REFUSED)
def test_what_has_no_forecast_gets_one_line(text, forecasts, tmp_path):
    code, said = REFUSED[text]
    error = forecasts(text, "--settle", "2", code=code)
    assert re.search(said, error)
    said = [line for line in error.splitlines() if not re.match(r"(\d+ s: )?forecast", line)]
    assert len(said) == 1  # beside how long it has been at it
    assert [each.name for each in tmp_path.iterdir()] == ["scene.xml"]


def test_a_huge_heightfield_is_refused_before_it_is_made(forecasts, monkeypatch):
    monkeypatch.delattr(mujoco, "MjSpec")  # which would make room for it
    field = '<asset><hfield name="h" nrow="5001" ncol="5000" size="1 1 1 1"/></asset>'
    said = "scene.xml: heightfield 'h' has 5001 x 5000 points; 2.5e+07 are the most"
    assert said in forecasts(mjcf(LEVEL, rest=field), code=2)


def test_a_huge_texture_is_refused_in_included_files_too(forecasts, tmp_path):
    texture = '<texture name="t" builtin="flat" width="6000" height="6000"/>'
    (tmp_path / "more.xml").write_text(f"<mujoco><asset>{texture}</asset></mujoco>")
    error = forecasts(mjcf(LEVEL, rest='<include file="more.xml"/>'), code=2)
    assert "texture 't' has 6000 x 6000 points" in error


def test_the_page_the_json_and_what_the_engine_replaces(forecasts, tmp_path):
    text = SCENES["hidden mix"].replace("<option ", '<option timestep=".008" ')
    shown = forecasts(text, "--try", "--json", "-o", str(page := tmp_path / "page.html"))
    (pair,) = shown["before"]["pairs"]
    creep = shown["after"]["pairs"][0]["creep_measured"]
    assert creep == pytest.approx(shown["before"]["change"]["after"], rel=0.2)
    assert [kind.partition(" ")[0] for kind in pair["replaced"]] == ["solref", "solref", "friction"]
    short = pair["replaced"]["solref too short for the time step"]
    assert short == "0.012 s: 0.016 s is taken (refsafe)"
    assert "To paste: MJCF" in page.read_text("utf-8")


def test_settling_and_following_advice_tell_how_far_they_are():
    for world, limit in ((GROUND + box("0 0 .05", "0 0 0"), 100.0), (ON_SLOPE, 1.0)):
        (model, data), told = at_start(mjcf(world)), list[float]()
        rest = settle(model, data, limit, tell=told.append)
        assert told[-1] == 1.0
        assert all(0 < done <= 1 for done in told)
        assert data.time < 10.0  # long before the most that it may take
    told.clear()
    before = forecast.forecast(model, data, rest, tell=told.append)
    assert told == sorted(told)
    assert 1 < len({done for done in told if done > 1 / 4}) < len(set(told)) - 40  # options, steps
    told.clear()
    forecast.follow_advice(model, data, before, limit, tell=told.append)
    assert told == sorted(told)
    assert told[-1] > 0


def test_what_never_settles_is_as_far_as_its_time():
    assert time_to_settle([3.0, 4.0, 3.0, 4.0], 4.0) == math.inf
    assert time_to_settle([8.0, 7.0, 6.0, 5.0, 4.0], 5.0) == pytest.approx(9.0)
    assert time_to_settle([2.0, 0.0], 2.0) == 2.0


@UNADVISED
def test_eighty_contacts_stay_readable():
    """A line says what the engine replaces at all of them."""
    boxes = "".join(box(f"{k / 5} 0 .0499", "0 0 0", f"box{k}") for k in range(20))
    _, _, found = settled(mjcf(FLOOR.format('solref=".03 1"') + boxes), limit=2.0)
    assert sum(len(pair.members) for pair in found.pairs) == 80
    assert [len(rows) for _, rows in forecast_page.tables(found)] == [forecast.SHOWN + 1] * 2
    said = [line for line in forecast_page.sentences(found) if "replaces solref" in line]
    assert sum("at 19 more" in line for line in said) == 1


TURNING = f'<body pos="0 0 .0499"><joint axis="0 0 1"/><geom name="box" {BLOCK} mass="1"/></body>'
ACROSS = TURNING.replace("<joint ", '<joint type="slide" ').replace("0 0 1", "1 0 0")
ODD = {
    mjcf(GROUND + TURNING): "No joint can part these",
    mjcf(GROUND + ACROSS): "No joint can part these",
    mjcf(
        ON_SLOPE, 'cone="elliptic" sleep_tolerance=".01"', flag='<flag sleep="enable"/>'
    ): "sleep.* body 'box'",
}


@UNADVISED
@pytest.mark.parametrize("text", ODD)
def test_what_no_joint_can_part_or_sleeps_has_a_forecast_nevertheless(text):
    (pair,) = (found := settled(text)[2]).pairs
    assert any(re.search(ODD[text], line) for line in forecast_page.sentences(found))
    assert pair.parts == ("sleep" in text)
    if pair.parts:  # as of what is awake
        assert 5e-4 < pair.creep == pytest.approx(pair.creep_measured, rel=1e-2)


def test_what_rattles_is_measured_by_means_and_ends_with_1(forecasts):
    (pair,) = forecasts(mjcf(LEVEL, geom='solref="-5000 0"'), "--settle", "1", "--json", code=1)[
        "before"
    ]["pairs"]
    assert pair["moves"]
    assert pair["creep"] is None
    assert pair["load"] == pytest.approx(9.81, rel=2e-2)
    assert pair["depth_measured"] == pytest.approx(55e-6, rel=5e-2)
    assert pair["creep_measured"] < STILL


POLE = (
    '<body name="pole" pos="0 0 .02"><joint name="hip" axis="0 1 0" damping=".5"/>'
    '<geom name="pole" type="capsule" fromto="0 0 0 .05 0 .5" size=".02" mass="1"/></body>'
)
HIP = '<actuator><motor name="hip" joint="hip" ctrlrange="-9 9"/></actuator>'


@UNADVISED
def test_a_robot_that_falls_is_said_to_and_one_that_its_controller_holds_is_not():
    def hold(model, data, nstep):
        for _ in range(nstep):
            data.ctrl[0] = -50 * data.qpos[0] - 5 * data.qvel[0]
            mujoco.mj_step(model, data)

    text = mjcf(GROUND + POLE + LEVEL.removeprefix(GROUND).replace('pos="0', 'pos="1'), rest=HIP)
    _, _, fallen = settled(text)
    assert re.match("body 'pole' by .* m, its joint 'hip' by 1.* rad", fallen.settled.collapsed[0])
    assert "floor / pole" in [pair.name for pair in fallen.pairs]
    _, _, held = settled(text, step=hold)
    assert not held.settled.collapsed
    assert [pair.name for pair in held.pairs] == ["floor / box"]


@UNADVISED
def test_controls_come_by_number_name_or_keyframe_and_bad_ones_get_one_line(forecasts):
    """What creeps or sinks in by more than is allowed ends with 1."""
    text = SCENES["gripper"].replace("<motor joint", '<motor name="{}" joint').format("l", "r")
    held = forecasts(text, "--json", "--keyframe", "held")
    for same in (("--keyframe", "0"), ("--ctrl", "5", "-5"), ("--ctrl", "r=-5", "l=5")):
        assert forecasts(text, "--json", *same)["before"]["pairs"] == held["before"]["pairs"]
    for said, values in {
        "no keyframe 'dropped', but held": ["--keyframe", "dropped"],
        "as many numbers as there are actuators: 2": ["--ctrl", "5"],
        "needs NAME=NUMBER, or": ["--ctrl", "5", "r=5"],
        "no actuator 'thumb', but l, r": ["--ctrl", "thumb=5"],
        "--ctrl names l twice": ["--ctrl", "l=5", "l=6"],
        "l = 'five' must be a number": ["--ctrl", "l=five"],
        "l = nan must be finite": ["--ctrl", "l=nan"],
        "l = 10 is out of range: must be >= -9 and <= 9": ["--ctrl", "l=10"],
    }.items():
        error = forecasts(text, *values, code=2)
        assert said in error
        assert error.count("\n") == 1
    words = ["--keyframe", "held", "--max-creep"]
    said = forecasts(text, *words, "1e-6", code=1)
    assert re.search(r"rod / left: creep 0.000\d+ m/s, more than 1e-06", said)
    forecasts(text, *words, "1e-3", "--max-depth", "1e-3")


@UNADVISED
def test_a_contact_counts_from_a_thousandth_of_the_lighter_bodys_weight():
    wall = '<geom name="wall" type="plane" size="1 1 .1" euler="0 90 0"/>'
    leaning = (
        '<body pos=".05 0 1"><joint type="slide" axis="1 0 0" stiffness="1" damping="1" '
        'springref="{}"/>'
        '<geom name="ball" size=".05" mass="1"/></body>'
    )
    assert settled(mjcf(wall + leaning.format(-0.02)))[2].pairs[0].load == pytest.approx(
        0.02, rel=1e-2
    )
    with pytest.raises(InputError, match="nothing touches"):
        settled(mjcf(wall + leaning.format(-0.005)))


def test_where_no_option_helps_coulomb_does(forecasts):
    shown = forecasts(SCENES["ball held by rolling friction, pyramidal"], "--try")
    assert "coulomb = mjsim.Coulomb(model)" in shown
    (ball,) = re.findall(r"floor / ball +(.*)", shown.partition("With mjsim.Coulomb")[2])
    assert ball.split()[:4] == ["0"] * 4  # creep and turning, predicted and found
