"""Small scenes of what users of MuJoCo build, that need no package but MuJoCo.

Each is a function of a `Way`, which steps it and returns what was `Found`."""

import itertools
import math
from typing import Any

import mujoco
import numpy as np

from docs.studies.ways import CREEP, SLIP, Found, Run, Way, worst

SPEED, TURN = 0.2, 2.0
"""Of a belt, m/s, and of a carousel, rad/s."""
BRICKS, COURSES = 16, 8
"""Of a castle: bricks in each of its round courses."""
DOMINOS = 10


def model(
    body: str,
    option: str = "",
    more: str = "",
    slope: float = 0.0,
    mu: float = 0.6,
    extra: str = "",
) -> Any:
    """A world on a slope, degrees, downwards along x."""
    made = mujoco.MjModel.from_xml_string(
        f'<mujoco><option cone="elliptic" {option}>{extra}</option><default><geom friction="{mu}"/>'
        f"</default><worldbody>{body}</worldbody>{more}</mujoco>"
    )
    tilt(made, slope)
    return made


def tilt(model: Any, slope: float) -> None:
    """Let a world slope, degrees, downwards along x: it is gravity that is turned."""
    a = math.radians(slope)
    model.opt.gravity[:] = 9.81 * math.sin(a), 0, -9.81 * math.cos(a)


def free(name: str, place: str, geom: str, **attributes: str) -> str:
    """A body that may go anywhere."""
    more = " ".join(f'{key}="{value}"' for key, value in attributes.items())
    return f'<body name="{name}" pos="{place}" {more}><freejoint/><geom {geom}/></body>'


FLOOR = '<geom name="floor" type="plane" size="9 9 1"/>'


def treadmill(way: Way) -> Found:
    """A box rides up a belt of 10°: by the velocity of its surface, or, where there is none, on a
    plate that moves."""
    surface = hasattr(mujoco.MjModel, "geom_surfacevel")
    belt, box = 'type="box" size="3 .2 .05" pos="0 0 -.05"', 'type="box" size=".05 .05 .05"'
    moves, rides = '<joint type="slide" axis="1 0 0"/>', f'surfacevel="{-SPEED} 0 0 0 0 0"'
    plate = f'<body gravcomp="1">{moves}<geom {belt} mass="1e6"/></body>'
    world = f"<geom {belt} {rides}/>" if surface else plate
    run = Run(way, model(world + free("box", "0 0 .05", box), slope=10))
    if not surface:
        run.data.qvel[0] = -SPEED
    run.advance(2)
    before = run.places("box")[0, 0]
    run.advance(1)
    return run.found({CREEP: abs(run.places("box")[0, 0] - before + SPEED)})


def carousel(way: Way) -> Found:
    """A box rides on a disc that turns; it drifts outwards, too, as the integrator takes the
    tangent for the circle."""
    plate = '<geom type="cylinder" size=".5 .02" pos="0 0 -.02" mass="1e6"/>'
    disc = f'<body name="disc"><joint axis="0 0 1"/>{plate}</body>'
    run = Run(way, model(disc + free("box", ".2 0 .03", 'type="box" size=".03 .03 .03"')))
    run.data.qvel[0] = run.data.qvel[6] = TURN
    run.data.qvel[2] = 0.2 * TURN
    run.advance(2)
    return run.found({CREEP: run.creep("box", of="disc")})


def dominos(way: Way) -> Found:
    """A row of dominos, of which the first is pushed; they come to lie on each other; the worst of
    four pushes."""
    return worst([pushed(way, push) for push in (3.0, 3.2, 3.5, 4.0)])


def pushed(way: Way, push: float) -> Found:
    """The first begins to turn about its edge, at so many rad/s."""
    size = 'type="box" size=".005 .025 .05" mass=".05"'
    row = "".join(free(f"d{k}", f"{0.04 * k} 0 .05", size) for k in range(DOMINOS))
    run = Run(way, model(FLOOR + row), passive=True)
    run.data.qvel[[0, 4]] = 0.05 * push, push
    run.advance(3)
    upright = sum(run.data.body(f"d{k}").xmat[8] > 0.9 for k in range(DOMINOS))
    return run.found({CREEP: run.creep()}, {f"{upright} still stand": bool(upright)})


def cradle(way: Way) -> Found:
    """Newton's cradle: what the last of five balls reaches of the angle of the first, by damped
    stiff contacts."""
    balls = "".join(
        f'<body name="b{k}" pos="{0.1005 * k} 0 0"><joint axis="0 1 0" pos="0 0 .5"/>'
        f'<geom size=".05" mass="1" solref="-1e6 -20"/></body>'
        for k in range(5)
    )
    run, highest = Run(way, model(balls, 'timestep="2e-4"', mu=0.3), passive=True), 0.0
    run.data.qpos[0] = math.radians(30)
    for _ in range(20):
        run.advance(0.05)
        highest = max(highest, -run.data.qpos[4])
    return run.found({"short of the angle by": 1 - highest / math.radians(30)})


def nut(way: Way) -> Found:
    """A nut on a standing bolt, of MuJoCo's plugin of signed distances: its thread should hold
    it."""
    names = {"nut": 0.26, "bolt": 0.255}
    key = '<config key="radius" value="{}"/>'
    named = "".join(
        f'<plugin plugin="mujoco.sdf.{name}"><instance name="{name}">{key.format(radius)}'
        "</instance></plugin>"
        for name, radius in names.items()
    )
    mesh = "".join(f'<mesh name="{name}"><plugin instance="{name}"/></mesh>' for name in names)
    geom = (
        '<geom type="sdf" mesh="{0}" {1} friction=".3" solref=".01 1" solimp=".95 .99 1e-4">'
        '<plugin instance="{0}"/></geom>'
    )
    heavy = geom.format("nut", 'mass="2"')
    bodies = (
        f'<body name="nut" pos="0 0 .83" euler="180 0 0"><freejoint/>{heavy}</body>'
        f'<body name="bolt" euler="180 0 0">{geom.format("bolt", "")}</body>'
    )
    more = f"<extension>{named}</extension><asset>{mesh}</asset>"
    option = 'sdf_iterations="10" sdf_initpoints="20"'
    run = Run(way, model(bodies, option, more), passive=True)
    run.advance(1)
    return run.found({CREEP: run.creep("nut")}, {"left the bolt": run.places("nut")[0, 2] < 0.4})


def tactile(way: Way) -> Found:
    """A plate on a pad of 36 sprung spheres, each with a sensor of touch, on a slope of 15°."""
    at = list(itertools.product(range(6), range(6)))
    sprung = '<joint type="slide" axis="0 0 1" stiffness="300" damping="1"/>'
    pad = "".join(
        f'<body pos="{0.01 * i} {0.01 * j} 0">{sprung}<geom size=".004" mass=".001"/>'
        f'<site name="s{i}{j}" size=".004"/></body>'
        for i, j in at
    )
    touch = "".join(f'<touch site="s{i}{j}"/>' for i, j in at)
    plate = free("plate", ".025 .025 .009", 'type="box" size=".04 .04 .005" mass=".2"')
    run = Run(way, model(pad + plate, slope=15, more=f"<sensor>{touch}</sensor>"), passive=True)
    run.advance(2)
    creep = run.creep("plate")
    felt = float(run.data.sensordata.sum()) / (0.2 * 9.81 * math.cos(math.radians(15))) - 1
    return run.found({CREEP: creep, "error of what is felt": abs(felt)}, {"slid off": felt < -0.9})


def castle(way: Way) -> Found:
    """A round tower of bricks in eight courses, some 1500 contacts, in a wind that friction
    withstands."""
    half, radius = 0.05, 0.3
    bricks = "".join(
        free(
            f"b{k}-{i}",
            f"{radius * math.cos(turn):.5f} {radius * math.sin(turn):.5f} {0.03 * (2 * k + 1):.5f}",
            f'type="box" size=".035 {half} .03" mass=".3"',
            axisangle=f"0 0 1 {math.degrees(turn):.4f}",
        )
        for k in range(COURSES)
        for i in range(BRICKS)
        for turn in [2 * math.pi * (i + k % 2 / 2) / BRICKS]
    )
    run = Run(way, model(FLOOR + bricks, slope=3), passive=True)
    run.advance(1)
    creep = run.creep(seconds=0.2)
    top = run.places(f"b{COURSES - 1}-0")[0, 2]
    return run.found({CREEP: creep}, {"fell": top < 0.06 * (COURSES - 1)})


def sleeping(way: Way) -> Found:
    """Three towers of three boxes, with sleeping on: how many bodies are awake after 4 s, and after
    a push."""
    if not hasattr(mujoco.mjtEnableBit, "mjENBL_SLEEP"):
        raise NotImplementedError(f"MuJoCo {mujoco.__version__} does not sleep")
    box = 'type="box" size=".05 .05 .05"'
    boxes = "".join(
        free(f"t{k}-{j}", f"{0.3 * k} 0 {0.05 + 0.1 * j}", box) for k in range(3) for j in range(3)
    )
    run = Run(way, model(FLOOR + boxes, slope=8, extra='<flag sleep="enable"/>'), passive=True)
    run.advance(4)
    awake = int((run.data.tree_asleep < 0).sum())
    return run.found({CREEP: run.creep()}, {f"{awake} awake": bool(awake)})


def mocap(way: Way) -> Found:
    """A gripper that is welded to a mocap body: it closes, lifts a box, holds it, and shakes it."""
    finger = (
        '<body pos="0 {0} -.08"><joint name="f{1}" type="slide" axis="0 {2} 0" damping="5"/>'
        '<geom type="box" size=".015 .01 .04" mass=".1"/></body>'
    )
    palm = '<geom type="box" size=".03 .08 .02" mass=".5" contype="0" conaffinity="0"/>'
    fingers = finger.format(-0.05, 1, 1) + finger.format(0.05, 2, -1)
    hand = (
        '<body name="target" mocap="true" pos="0 0 .15"/>'
        f'<body name="hand" pos="0 0 .15"><freejoint/>{palm}{fingers}</body>'
    )
    more = (
        '<equality><weld body1="target" body2="hand" solref=".01 1"/></equality>'
        '<actuator><motor joint="f1"/><motor joint="f2"/></actuator>'
    )
    box = free("box", "0 0 .03", 'type="box" size=".03 .03 .03" mass=".2"')
    run = Run(way, model(FLOOR + hand + box, more=more))
    data, target = run.data, run.data.mocap_pos[0]
    data.ctrl[:] = 8
    run.advance(0.5)
    start = run.places("box", of="hand")
    run.advance(1, lambda: target.__setitem__(2, 0.15 + 0.1 * min(data.time - 0.5, 1)))
    run.advance(0.5)
    creep, begin, before = run.creep("box", of="hand"), data.time, run.places("box", of="hand")

    def shake() -> None:
        target[0] = 0.02 * math.sin(8 * math.pi * (data.time - begin))

    run.advance(1, shake)
    run.advance(0.5)
    there = run.places("box", of="hand")
    slip, dropped = np.abs(there - before).max(), abs(there - start).max() > 0.02
    return run.found({CREEP: creep, SLIP: slip}, {"dropped": dropped})


def tendon(way: Way) -> Found:
    """A weight of 3 N on a tendon over a pulley, whose dry friction of 5 N should hold it."""
    world = (
        '<site name="above" pos="0 0 1"/><body name="weight" pos="0 0 .5"><site name="hook"/>'
        '<joint type="slide" axis="0 0 1"/><geom size=".05" mass=".306"/></body>'
    )
    sites = '<site site="above"/><site site="hook"/>'
    tendon = f'<tendon><spatial frictionloss="5">{sites}</spatial></tendon>'
    run = Run(way, model(world, more=tendon), passive=True)
    run.advance(1)
    return run.found({CREEP: run.creep("weight")})


def soft_grip() -> Any:
    """A box between two soft pads of finite elements."""
    pad = (
        '<body name="{0}" pos="0 {1} .2">'
        '<joint name="{0}" type="slide" axis="0 {2} 0" damping="20"/>'
        '<geom type="box" size=".03 .005 .03" mass=".2" pos="0 {3} 0" contype="0" conaffinity="0"/>'
        '<flexcomp name="p{0}" type="grid" count="4 3 4" spacing=".015 .01 .015" dim="3" '
        'radius=".001" mass=".05"><contact selfcollide="none" solref=".01 1"/>'
        '<edge equality="true"/><pin gridrange="0 {4} 0 3 {4} 3"/></flexcomp></body>'
    )
    pads = pad.format("left", -0.041, 1, -0.015, 0) + pad.format("right", 0.041, -1, 0.015, 2)
    world = pads + free("box", "0 0 .2", 'type="box" size=".03 .03 .03" mass=".1"')
    actuators = '<actuator><motor joint="left"/><motor joint="right"/></actuator>'
    return model(world, 'integrator="implicitfast"', more=actuators, mu=1)


def flex(way: Way) -> Found:
    """Two soft pads close on a box, and hold it as its weight sets in."""
    run = Run(way, soft_grip())
    run.data.ctrl[:] = 4
    run.model.opt.gravity[:] = 0
    run.advance(0.5)
    run.model.opt.gravity[2] = -9.81
    run.advance(0.5)
    return run.found({CREEP: run.creep("box")}, {"dropped": run.places("box")[0, 2] < 0.1})


def rolling(way: Way) -> Found:
    """A wheel and a ball that roll at .5 m/s: what they lose of it in a second."""
    ball, wheel = 'size=".05" mass="1"', 'type="cylinder" size=".05 .02" mass="1" euler="90 0 0"'
    world = FLOOR + free("ball", "0 0 .0499", ball) + free("wheel", "0 .5 .0499", wheel)
    run = Run(way, model(world), passive=True)
    for first in (0, 6):
        run.data.qvel[first], run.data.qvel[first + 4] = 0.5, 10.0
    run.advance(1)
    names = "speed the ball loses, m/s", "speed the wheel loses, m/s"
    return run.found(dict(zip(names, 0.5 - run.data.qvel[[0, 6]], strict=True)))
