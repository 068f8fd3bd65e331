"""Scenes of robots that others wrote, each with the package it comes from; no window is opened.

Each is a function of a `Way`, which steps it and returns what was `Found`."""

import functools
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from docs.studies.small_scenes import tilt
from docs.studies.ways import CREEP, SLIP, Array, Found, Run, Way, worst

HUMANOIDS = 22


def lift(way: Way) -> Found:
    """Panda of robosuite, by its own controller: lifts a cube, holds it, shakes it, places it and
    lets it go."""
    import robosuite

    unseen = dict.fromkeys(("has_renderer", "has_offscreen_renderer", "use_camera_obs"), False)
    env = robosuite.make("Lift", robots="Panda", **unseen, horizon=10**6, seed=0)
    env.reset()
    run = Run(way, env.sim.model._model, env.sim.data._data)
    data, hand, cube = run.data, "gripper0_right_eef", "cube_main"
    steps = round(env.control_timestep / run.model.opt.timestep)

    def act(seconds: float, move: Callable[[float], Any], grip: float) -> None:
        """Move the hand as `move` says of the time since the beginning, with the grip open (-1) or
        closed (1)."""
        for period in range(round(seconds / env.control_timestep)):
            action = np.array([*move(period * env.control_timestep), 0, 0, 0, grip])
            for k in range(steps):
                run.step(functools.partial(env._pre_action, action, k == 0))

    def towards(place: Array, speed: float = 1.0) -> Callable[[float], Any]:
        at = run.model.site("gripper0_right_grip_site").id
        return lambda _: np.clip(10 * (place - data.site_xpos[at]), -speed, speed)

    def shaken(time: float) -> tuple[float, float, float]:
        return 0.0, math.copysign(1, math.sin(6 * math.pi * time)), 0.0

    def still(_: float) -> tuple[float, float, float]:
        return 0.0, 0.0, 0.0

    start, up = run.places(cube)[0], np.array([0, 0, 0.15])
    act(2, towards(start + up), -1)
    act(2, towards(start, 0.3), -1)
    start = run.places(cube)[0]
    act(1, still, 1)
    act(2, towards(start + up), 1)
    act(2, still, 1)
    before = run.places(cube, of=hand)
    act(1, still, 1)
    held, height = run.places(cube, of=hand), run.places(cube)[0, 2] - start[2]
    creep = float(np.abs(held - before).max())
    act(2, shaken, 1)
    act(1, still, 1)
    slip = float(np.abs(run.places(cube, of=hand) - held).max())
    act(3, towards(start, 0.3), 1)
    act(1, still, -1)
    act(2, towards(start + up), -1)
    placed = run.places(cube)[0, 2]
    wrong = {"not lifted": height < 0.1, "not placed": abs(placed - start[2]) > 5e-3}
    return run.found({CREEP: creep, SLIP: slip}, wrong)


def hand(name: str, way: Way) -> Found:
    """Shadow hand of gymnasium-robotics, palm upwards, with the object of an environment; the worst
    of three starts."""
    return worst([_held(way, name, seed) for seed in (3, 4, 5)])


def _held(way: Way, name: str, seed: int) -> Found:
    """The object lies in the closing hand, which is then shaken."""
    import gymnasium
    import gymnasium_robotics

    gymnasium.register_envs(gymnasium_robotics)
    env: Any = gymnasium.make(name).unwrapped
    env.reset(seed=seed)
    env._set_action(np.zeros(20))
    run = Run(way, env.model, env.data)
    palm, wrist = "robot0:palm", run.model.actuator("robot0:A_WRJ0").id
    run.advance(3)
    creep = run.creep("object", of=palm)
    before, begin, middle = run.places("object", of=palm), run.data.time, run.data.ctrl[wrist]

    def shake() -> None:
        run.data.ctrl[wrist] = middle + 0.1 * math.sin(6 * math.pi * (run.data.time - begin))

    run.advance(2, shake)
    run.data.ctrl[wrist] = middle
    run.advance(1)
    slip = float(np.abs(run.places("object", of=palm) - before).max())
    return run.found({CREEP: creep, SLIP: slip}, {"dropped": run.places("object")[0, 2] < 0.1})


block, egg = (functools.partial(hand, f"HandManipulate{name}-v1") for name in ("Block", "Egg"))


def ant(way: Way) -> Found:
    """Gymnasium's Ant-v5, its motors off, on a slope of 12°; by Euler's method, as RK4 has no two
    halves."""
    import gymnasium

    env: Any = gymnasium.make("Ant-v5").unwrapped
    env.reset(seed=0)
    env.model.opt.integrator = mujoco.mjtIntegrator.mjINT_EULER
    tilt(env.model, 12)
    run = Run(way, env.model, env.data)
    run.advance(14)
    return run.found({CREEP: run.creep()})


def quadruped(way: Way) -> Found:
    """The quadruped of dm_control stands on a slope of 10°, by its own servos."""
    from dm_control import suite

    physics = suite.load("quadruped", "walk", task_kwargs={"random": 0}).physics
    model = physics.model.ptr
    tilt(model, 10)
    run = Run(way, model)
    run.data.qpos[2] = 0.6
    run.advance(4)
    return run.found({CREEP: run.creep()}, {"fell": run.data.body("torso").xmat[8] < 0.9})


def humanoids(way: Way) -> Found:
    """22 of dm_control's humanoids fall in a heap, and lie."""
    import dm_control.suite

    one = mujoco.MjSpec.from_file(str(Path(dm_control.suite.__file__).parent / "humanoid.xml"))
    one.delete(one.geom("floor"))
    world = mujoco.MjSpec()
    world.memory = 1 << 28
    world.option.timestep = 0.005
    world.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_PLANE, size=[9, 9, 1])
    for k in range(HUMANOIDS):
        frame = world.worldbody.add_frame(pos=[k % 3, k // 3 % 3, 2.0 * (k // 9)])
        world.attach(one.copy(), prefix=f"h{k}-", frame=frame)
    run = Run(way, world.compile(), passive=True)
    run.advance(5)
    return run.found({CREEP: run.creep()})


def sawyer(way: Way) -> Found:
    """Metaworld's Sawyer, by its scripted policy: it grasps a puck, lifts and holds it."""
    import metaworld
    from metaworld.policies.sawyer_pick_place_v3_policy import SawyerPickPlaceV3Policy

    tasks = metaworld.MT1("pick-place-v3", seed=1)
    env: Any = tasks.train_classes["pick-place-v3"]()
    env.set_task(tasks.train_tasks[0])
    observed, _ = env.reset()
    run, policy = Run(way, env.model, env.data), SawyerPickPlaceV3Policy()

    def step(ctrl: Any, frames: int) -> None:
        run.data.ctrl[:] = ctrl
        for _ in range(frames):
            run.step()

    env._step_mujoco_simulation = step
    for _ in range(150):
        observed, _, _, _, found = env.step(np.clip(policy.get_action(observed), -1, 1))
    for _ in range(150):  # stays where it is
        observed, _, _, _, found = env.step(np.array([0, 0, 0, 0.6]))
    run.advance(5)
    creep, before = run.creep("obj", of="rightpad"), run.places("obj", of="rightpad")
    for k in range(80):
        env.step(np.array([math.copysign(1, math.sin(k)), 0, 0, 0.6]))
    slip = float(np.abs(run.places("obj", of="rightpad") - before).max())
    return run.found({CREEP: creep, SLIP: slip}, {"not grasped": not found["grasp_success"]})
