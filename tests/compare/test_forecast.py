"""The forecast of contacts stands beside what MuJoCo does in twenty small scenes, and its advice does what it says."""

from __future__ import annotations

from typing import Any

import mujoco
import pytest

from compare.bench import forecast
from compare.bench.forecast import Forecast

FLOOR = '<geom name="floor" type="plane" size="20 20 .1" {}/>'
SLOPE = FLOOR.format('euler="0 15 0"')


def box(place: str = ".013 0 .0525", angle: str = "0 15 0", name: str = "box") -> str:
    geom = f'<geom name="{name}" type="box" size=".05 .05 .05" mass="1"/>'
    return f'<body name="{name}" pos="{place}" euler="{angle}"><freejoint/>{geom}</body>'


def mjcf(world: str, option: str = "", geom: str = 'friction=".6"', rest: str = "", flag: str = "") -> str:
    start = f"<mujoco><option {option}>{flag}</option><default><geom {geom}/></default>"
    return f"{start}<worldbody>{world}</worldbody>{rest}</mujoco>"


ON_SLOPE = SLOPE + box()
STACK = SLOPE + "".join(box(f"{0.0135 + k * 0.0263} 0 {0.0525 + k * 0.0967}", name=f"box{k}") for k in range(4))
FINGER = (
    '<body name="{0}" pos="{1} 0 .2"><joint name="{0}" type="slide" axis="1 0 0" damping="20"/>'
    '<geom name="{0}" type="box" size=".01 .03 .03" mass=".2"/></body>'
)
GRIPPER = FINGER.format("left", -0.0305) + FINGER.format("right", 0.0305)
GRIPPER += '<body name="rod" pos="0 0 .2"><freejoint/><geom name="rod" type="capsule" size=".02 .03" mass=".1"/></body>'
SQUEEZE = '<actuator><motor joint="left" ctrlrange="-9 9"/><motor joint="right" ctrlrange="-9 9"/></actuator>'
SQUEEZE += '<keyframe><key name="held" ctrl="5 -5"/></keyframe>'
BALL = SLOPE + (
    '<body name="ball" pos=".013 0 .0515"><freejoint/>'
    '<geom name="ball" type="sphere" size=".05" mass="1" condim="6" friction=".6 .01 .03"/></body>'
)
PAIR = (
    '<contact><pair geom1="floor" geom2="box" friction=".7 .5 .01 .001 .001" solreffriction="{}" condim="4"/></contact>'
)
SCENES = {
    "slope": mjcf(ON_SLOPE, 'cone="elliptic"'),
    "slope, impratio 10": mjcf(ON_SLOPE, 'cone="elliptic" impratio="10"'),
    "slope, pyramidal": mjcf(ON_SLOPE),
    "slope, pyramidal, impratio 10": mjcf(ON_SLOPE, 'impratio="10"'),
    "slope, pyramidal, condim 4": mjcf(ON_SLOPE, geom='friction=".6" condim="4"'),
    "slope, springs": mjcf(ON_SLOPE, 'cone="elliptic"', 'friction=".6" solref="-5000 -100"'),
    "slope, pyramidal, springs": mjcf(ON_SLOPE, geom='friction=".6" solref="-5000 -100"'),
    "slope, discrete": mjcf(ON_SLOPE, 'cone="elliptic" integrator="discrete"'),
    "slope, pyramidal, discrete": mjcf(ON_SLOPE, 'integrator="discrete"', 'friction=".6" solref=".01 .7"'),
    "slope, implicitfast, wide impedance": mjcf(
        ON_SLOPE, 'cone="elliptic" integrator="implicitfast"', 'friction=".6" solimp=".3 .9 .004 .4 3"'
    ),
    "slope, large step": mjcf(ON_SLOPE, 'cone="elliptic" timestep=".015"'),
    "slope, RK4": mjcf(ON_SLOPE, 'cone="elliptic" integrator="RK4"'),
    "slope, PGS": mjcf(ON_SLOPE, 'cone="elliptic" solver="PGS" iterations="400" tolerance="0"'),
    "slope, noslip": mjcf(ON_SLOPE, 'cone="elliptic" noslip_iterations="30" noslip_tolerance="0"'),
    "slope, pair": mjcf(ON_SLOPE, 'cone="elliptic" impratio="3"', rest=PAIR.format("-1 -60")),
    "slope, pair, skew": mjcf(SLOPE + box(angle="0 15 40"), rest=PAIR.format(".05 1")),
    "slope, margin": mjcf(ON_SLOPE, 'cone="elliptic"', 'friction=".6" margin=".002"'),
    "stack": mjcf(STACK, 'cone="elliptic" impratio="5"'),
    "stack, pyramidal": mjcf(STACK),
    "gripper": mjcf(GRIPPER, 'cone="elliptic" impratio="10"', rest=SQUEEZE),
    "gripper, pyramidal": mjcf(GRIPPER, rest=SQUEEZE),
    "ball held by rolling friction": mjcf(BALL, 'cone="elliptic" impratio="3"'),
    "ball held by rolling friction, pyramidal": mjcf(BALL),
    "hidden mix": mjcf(
        FLOOR.format('solref=".004 1" friction=".3" euler="0 12 0"') + box(".01 0 .0525", angle="0 12 0")
    ),
}


def settled(text: str, keyframe: str | None = None, limit: float = 10.0) -> tuple[Any, Any, Forecast]:
    """A model, its state, and its forecast."""
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    if model.nkey:
        mujoco.mj_resetDataKeyframe(model, data, 0)
    return model, data, forecast.forecast(model, data, forecast.settle(model, data, limit))


@pytest.mark.parametrize("scene", SCENES)
def test_depth_and_creep_are_as_predicted(scene: str) -> None:
    _, _, found = settled(SCENES[scene])
    assert not found.moving
    for pair in found.pairs:
        assert not pair.slides
        assert pair.depth == pytest.approx(pair.depth_measured, rel=5e-2)
        # Round-off of a place, over the window.
        assert pair.creep == pytest.approx(pair.creep_measured, rel=1e-2, abs=1e-11)
        assert pair.turning == pytest.approx(pair.turning_measured, rel=1e-2, abs=forecast.STILL)
