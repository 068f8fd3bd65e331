"""Write the tables on friction that holds: ``python -m docs.studies.friction docs/friction.md``.

All take some ten minutes, most of them the piles (``--only piles``).
"""

from __future__ import annotations

import argparse
import functools
import itertools
import math
import sys
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any, Protocol
from unittest import mock

import mujoco
import numpy as np

from compare.kit.pages import Rows
from docs.studies.tables import write
from mjsim import Coulomb

G = 9.81
SCENES = {
    "box": "box on a slope of 15°",
    "stack": "four slabs on it",
    "fingers": "capsule between two fingers",
    "grasp": "cylinder between three fingertips",
    "ball": "ball held by rolling friction",
    "cart": "cart with its wheels braked",
}
WAYS: dict[str, dict[str, Any]] = {
    "plain": {},
    "impratio 10": {"impratio": 10},
    "impratio 100": {"impratio": 100},
    "noslip": {"noslip_iterations": 10},
    "memory": {"memory": True},
    "memory, pyramidal": {"memory": True, "cone": mujoco.mjtCone.mjCONE_PYRAMIDAL},
}
"""Options, and whether there is a memory."""
PILES, BODIES, SETTLING, LAST = 100, 18, 5.0, 1.0
STILL, RISES = 1e-9, (1e-9, 1e-2)
"""Most that a body at rest moves in the last second, m; rises of energy that are counted, J."""


class Stepper(Protocol):
    def step(self, data: Any, nstep: int = 1) -> None: ...


class Plain:
    """`mj_step` with the methods of a memory."""

    def __init__(self, model: Any) -> None:
        self.model = model

    def step(self, data: Any, nstep: int = 1) -> None:
        mujoco.mj_step(self.model, data, nstep)


def start(model: Any, memory: bool = False, **options: Any) -> tuple[Any, Stepper]:
    """Data of a model with other options, and what steps them."""
    for name, value in options.items():
        setattr(model.opt, name, value)
    return mujoco.MjData(model), Coulomb(model) if memory else Plain(model)


def one(geom: str, mu: float = 0.6, slope: float = 0.0) -> Any:
    """A body on a plane; gravity is tilted instead of the plane, degrees."""
    a = math.radians(slope)
    return mujoco.MjModel.from_xml_string(
        f'<mujoco><option cone="elliptic" tolerance="1e-12" gravity="{G * math.sin(a)} 0 {-G * math.cos(a)}"/>'
        f'<default><geom friction="{mu}"/></default><worldbody><geom type="plane" size="9 9 1"/>'
        f'<body pos="0 0 .05"><freejoint/>{geom}</body></worldbody></mujoco>'
    )


BOX, BALL = '<geom type="box" size=".05 .05 .05" mass="1"/>', '<geom type="sphere" size=".05" mass="1"/>'


def creep(scene: str, way: dict[str, Any]) -> float:
    """How far a body of a scene goes in a second once it has settled, m s-1."""
    data, stepper = start(mujoco.MjModel.from_xml_path(f"docs/friction/{scene}.xml"), **way)
    stepper.step(data, 2500)
    place = data.xpos.copy()
    stepper.step(data, 500)
    return float(np.abs(data.xpos - place).max())


def breakaway(way: dict[str, Any]) -> float:
    """Force that starts to move a box, faster than 1e-5 m/s, in units of mu N; it grows for 11 s."""
    data, stepper = start(one(BOX), **way)
    stepper.step(data, 500)
    shares = np.linspace(0, 1.1, 5500)
    for share in shares:
        data.qfrc_applied[0] = share * 0.6 * G
        stepper.step(data)
        if data.qvel[0] > 1e-5:
            return float(share)
    return math.inf


def shaken(way: dict[str, Any]) -> float:
    """How far a box on a slope of 10° goes in 8 s, shaken along it by 2 N at 40 rad/s, m."""
    data, stepper = start(one(BOX, slope=10), **way)
    stepper.step(data, 500)
    place = data.qpos[0]
    for _ in range(4000):
        data.qfrc_applied[0] = 2 * math.sin(40 * data.time)
        stepper.step(data)
    return float(abs(data.qpos[0] - place))


def wall() -> Any:
    """A wall of nine boxes in three courses with 56 contacts, leaning on friction."""
    boxes = "".join(
        f'<body pos="{0.22 * i + 0.11 * row} 0 {0.05 + 0.1 * row}"><freejoint/>'
        f'<geom type="box" size=".1 {0.06 - 0.01 * row} .05" mass="1"/></body>'
        for row in range(3)
        for i in range(4 - row)
    )
    return mujoco.MjModel.from_xml_string(
        '<mujoco><option cone="elliptic" gravity="1 0 -9.6"/><worldbody><geom type="plane" size="9 9 1"/>'
        f"{boxes}</worldbody></mujoco>"
    )


def cost(way: dict[str, Any], rounds: int = 25) -> float:
    """Processor time of a step at `wall`, in units of plain MuJoCo's with the same cone: median of runs in turn.

    Both are at rest, in the state to which memory has brought them.
    """
    plain = {name: value for name, value in way.items() if name == "cone"}
    settled, remembering = start(wall(), memory=True, **plain)
    remembering.step(settled, 2500)
    runs, times = [start(wall(), **each) for each in (plain, way)], np.empty((rounds, 2))
    for data, stepper in runs:
        data.qpos[:], data.qvel[:] = settled.qpos, settled.qvel
        stepper.step(data, 1000)
    for row in times:
        row[:] = [processor_time(stepper, data, 300) for data, stepper in runs]
    return float(np.median(times[:, 1] / times[:, 0]))


def cost_in_motion(way: dict[str, Any]) -> float:
    """The same while 18 boxes fall upon each other, up to 70 contacts: sums of ten piles, 2.4 s each."""
    plain, times = {name: value for name, value in way.items() if name == "cone"}, np.zeros(2)
    for seed in range(10):
        runs = [start(pile(seed, mixed=False), **each) for each in (plain, way)]
        for _ in range(4):
            times += [processor_time(stepper, data, 300) for data, stepper in runs]
    return float(times[1] / times[0])


def processor_time(stepper: Stepper, data: Any, steps: int) -> float:
    """Of some steps, s."""
    begin = time.process_time()
    stepper.step(data, steps)
    return time.process_time() - begin


def uncompiled(measure: Callable[[dict[str, Any]], float], way: dict[str, Any]) -> str:
    """Cost of a memory without numba."""
    with mock.patch.object(memory, "_kernels", memory.Formulas):
        return f"{measure(way):.2f}" if "memory" in way else "–"


def holding() -> Rows:
    """Creep in the scenes, breakaway, drift of a shaken box, and cost, one row each, for each way."""
    costs = {"wall of boxes at rest, 56 contacts": cost, "boxes that fall upon each other": cost_in_motion}
    return [
        ["", *WAYS],
        *(
            [f"{name} (`{scene}.xml`): creep, m/s", *(f"{creep(scene, way):.0e}" for way in WAYS.values())]
            for scene, name in SCENES.items()
        ),
        ["box that is pulled: breaks away at, μN", *(f"{breakaway(way):.4f}" for way in WAYS.values())],
        ["box shaken on a slope of 10°: drift in 8 s, m", *(f"{shaken(way):.0e}" for way in WAYS.values())],
        *(
            row
            for name, measure in costs.items()
            for row in (
                [f"{name}: cost of a step", *(f"{measure(way):.2f}" for way in WAYS.values())],
                ["the same without numba", *(uncompiled(measure, way) for way in WAYS.values())],
            )
        ),
    ]


def sliding() -> Rows:
    """Motions that slide, relative to their closed forms, with and without memory."""

    def acceleration(way: dict[str, Any]) -> float:
        data, stepper = start(one(BOX, 0.3, 20), **way)
        data.qvel[0] = speed = 1.0
        stepper.step(data, 500)
        exact = G * (math.sin(math.radians(20)) - 0.3 * math.cos(math.radians(20)))
        return float((data.qvel[0] - speed) / exact - 1)  # in a second

    def stopping(way: dict[str, Any]) -> float:
        data, stepper = start(one(BOX, 0.3), **way)
        stepper.step(data, 500)
        data.qvel[0], place = 1.0, data.qpos[0]
        stepper.step(data, 500)
        return float((data.qpos[0] - place) * 2 * 0.3 * G - 1)

    def rolling(way: dict[str, Any]) -> float:
        data, stepper = start(one(BALL, 0.3), **way)
        stepper.step(data, 500)
        data.qvel[0] = 1.0
        stepper.step(data, 500)
        return float(data.qvel[0] * 7 / 5 - 1)

    ways = {name: WAYS[name] for name in ("plain", "memory", "memory, pyramidal")}
    ways["plain, pyramidal"] = {"cone": mujoco.mjtCone.mjCONE_PYRAMIDAL}
    return [
        ["motion, error relative to its closed form", *ways],
        *(
            [name, *(f"{measure(way):+.2e}" for way in ways.values())]
            for name, measure in (
                ("box that slides down 20° from 1 m/s: g (sin − μ cos)", acceleration),
                ("box that slides to a stop: v²/(2 μ g)", stopping),
                ("ball that slides, then rolls: 5/7 v", rolling),
            )
        ),
    ]


def servo() -> Rows:
    """Depth and creep with a servo and without."""

    def grasped(scene: str, servo: float | None) -> list[str]:
        model = mujoco.MjModel.from_xml_path(f"docs/friction/{scene}.xml")
        return settled(model, servo)

    def settled(model: Any, servo: float | None) -> list[str]:
        model.geom_margin[:] = 4e-3 if servo else 0.0
        data, stepper = mujoco.MjData(model), Coulomb(model, servo)
        stepper.step(data, 2500)
        place = data.xpos.copy()
        stepper.step(data, 500)
        return [f"{np.abs(data.contact.dist).max():.0e}", f"{np.abs(data.xpos - place).max():.0e}"]

    def rolls(servo: float | None) -> list[str]:
        model = one('<geom size=".01" mass=".03"/>', slope=5)
        model.geom_margin[:] = 4e-3 if servo else 0.0
        model.qpos0[2] = 0.01
        data, stepper = mujoco.MjData(model), Coulomb(model, servo)
        stepper.step(data, 500)
        speed = data.qvel[0]
        stepper.step(data, 500)
        exact = 5 / 7 * G * math.sin(math.radians(5))
        return [f"{np.abs(data.contact.dist).max():.0e}", f"{(data.qvel[0] - speed) / exact - 1:+.1e}"]

    def dropped(servo: float | None) -> list[str]:
        model = one(BOX.replace("mass", 'euler="10 20 0" mass'))
        model.qpos0[2] = 0.2
        return settled(model, servo)

    def resting(servo: float | None) -> list[str]:
        still = 0
        for seed in range(10):
            model = pile(seed, mixed=False)
            model.geom_margin[:] = 4e-3 if servo else 0.0
            still += settle(model, Coulomb(model, servo))[0] < STILL
        return ["–", f"{still} of 10"]

    scenes: dict[str, Callable[[float | None], list[str]]] = {
        SCENES["stack"] + ": creep, m/s": functools.partial(grasped, "stack"),
        SCENES["fingers"] + ": creep, m/s": functools.partial(grasped, "fingers"),
        SCENES["grasp"] + ": creep, m/s": functools.partial(grasped, "grasp"),
        "box dropped on an edge: creep, m/s": dropped,
        "ball of 1 cm that rolls down 5°: acceleration, error": rolls,
        "piles of 18 boxes: at rest": resting,
    }
    servos = {"no servo": None, "servo 0.1 s": 0.1, "servo 0.02 s": 0.02}
    head = [text for name in servos for text in (f"{name}: depth, m", "")]
    return [
        ["scene", *head],
        *([name, *(cell for servo in servos.values() for cell in measure(servo))] for name, measure in scenes.items()),
    ]


def pile(seed: int, mixed: bool) -> Any:
    """Random bodies that fall on a floor one after the other: boxes, or five kinds."""
    rng, bodies = np.random.default_rng(seed), ""
    for k in range(BODIES):
        size, turn = rng.uniform(0.03, 0.06, 3), rng.normal(size=4)
        x, y = rng.uniform(-0.1, 0.1, 2)
        kind = rng.choice(["box", "capsule", "ellipsoid", "cylinder", "sphere"]) if mixed else "box"
        q, s = (" ".join(map(str, values)) for values in (turn / np.linalg.norm(turn), size))
        bodies += f'<body pos="{x} {y} {0.1 + 0.12 * k}" quat="{q}"><freejoint/><geom type="{kind}" size="{s}"/></body>'
    return mujoco.MjModel.from_xml_string(
        '<mujoco><option cone="elliptic"/><default><geom friction=".6"/></default><worldbody>'
        f'<geom type="plane" size="9 9 1"/>{bodies}</worldbody></mujoco>'
    )


def settle(model: Any, stepper: Stepper) -> tuple[float, float]:
    """How far bodies go in the last second, m, and the most that energy rises above what it was since the fall, J."""
    data, lowest, rise = mujoco.MjData(model), math.inf, 0.0
    for k in range(round((SETTLING + LAST) / 0.01)):
        if k == round(SETTLING / 0.01):
            place = data.xpos.copy()
        stepper.step(data, 5)
        if data.time > SETTLING / 2:
            mujoco.mj_energyVel(model, data)
            energy = data.energy[1] + G * float(model.body_mass @ data.xipos[:, 2])
            lowest = min(lowest, energy)
            rise = max(rise, energy - lowest)
    return float(np.abs(data.xpos - place).max()), rise


def fallen(remembers: bool, mixed: bool, seed: int) -> tuple[float, float]:
    """What `settle` finds of a pile."""
    model = pile(seed, mixed)
    return settle(model, Coulomb(model) if remembers else Plain(model))


def piles() -> Rows:
    """How many piles come to rest, and how energy rises."""
    counted = [f"energy rises by more than {rise:.0e} J in" for rise in RISES]
    rows = [["piles", "way", "at rest to 1e-9 m", "largest drift in a second: median, m", *counted, "by at most, J"]]
    for mixed, remembers in itertools.product((False, True), repeat=2):
        with ProcessPoolExecutor() as pool:
            done = pool.map(functools.partial(fallen, remembers, mixed), range(PILES), chunksize=5)
            drift, rise = np.transpose(list(done))
        kind, way = f"{PILES} of {BODIES} {'mixed bodies' if mixed else 'boxes'}", "memory" if remembers else "plain"
        rose = [str((rise > least).sum()) for least in RISES]
        rows.append([kind, way, str((drift < STILL).sum()), f"{np.median(drift):.0e}", *rose, f"{rise.max():.0e}"])
    return rows


TABLES: dict[str, Callable[[], Rows]] = {"holding": holding, "sliding": sliding, "servo": servo, "piles": piles}


def main(argv: Sequence[str] | None = None) -> int:
    """Measure and write all tables, or those named."""
    parser = argparse.ArgumentParser(description="Write the tables on the memory for friction.")
    parser.add_argument("page", type=Path, metavar="FILE", help="docs/friction.md")
    parser.add_argument("--only", action="append", choices=list(TABLES), metavar="NAME", help="only this table")
    args = parser.parse_args(argv)
    for name in args.only or TABLES:
        write(args.page, name, TABLES[name]())
    return 0


if __name__ == "__main__":
    sys.exit(main())
