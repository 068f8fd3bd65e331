"""Write the tables on Coulomb's law: ``python -m docs.studies.friction docs/friction.md``, and
``docs/records/law.md``.

All take some ten minutes."""

import copy
import itertools
import math
import sys
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from typing import Any

import mujoco
import numpy as np

from compare.figures.pages import Rows
from docs.studies import ways
from docs.studies.small_scenes import FLOOR, free
from docs.studies.small_scenes import model as world
from docs.studies.tables import write_all
from docs.studies.ways import Stepper, Way, processor_time
from mjsim import Coulomb
from mjsim.coulomb.parameters import Law

G = 9.81
SCENES = {
    "box": "box on a slope of 15°",
    "stack": "four slabs on it",
    "fingers": "capsule between two fingers",
    "grasp": "cylinder between three fingertips",
    "ball": "ball held by rolling friction",
    "cart": "cart with its wheels braked",
}
WAYS = {name: way for name, way in ways.WAYS.items() if way.timed}
THREE = {name: WAYS[name] for name in ("plain", "soft", "rigid")}
PLAIN, SOFT, RIGID = THREE.values()
BOX, BALL = 'type="box" size=".05 .05 .05" mass="1"', 'type="sphere" size=".05" mass="1"'
FLAT = 'type="box" size=".1 .1 .05" mass="1"'
LONG = "falling heap of 216", "at rest, 1000"
"""Scenes that are measured with soft contacts only: others take half an hour."""
HEAPS, FALL = 5, 600
"""Heaps of each size, and steps in which they fall."""
FIRST, EVERY, HALF = 30, 6, 0.05
"""Of these steps how many come before the first that is solved again, and from one to the next;
half an edge of a box, m."""
PILES, BODIES, SETTLING, LAST = 10, 18, 5.0, 1.0
STILL, RISE = 1e-9, 1e-9
"""Most that a body at rest moves in the last second, m; and that energy rises, J."""


class Installed(Coulomb):
    """`mj_step` under the callback."""

    def step(self, data: Any, nstep: int = 1) -> None:
        with self.installed():
            mujoco.mj_step(self.model, data, nstep)


def start(model: Any, way: Way) -> tuple[Any, Stepper]:
    """Data of a model, and what steps them."""
    stepper = way.begin(model)
    return mujoco.MjData(model), stepper


def one(
    geom: str, mu: float = 0.6, slope: float = 0.0, height: float = 0.05, step: float = 2e-3
) -> Any:
    """A body on a plane, on a slope in degrees."""
    option = f'tolerance="1e-12" timestep="{step}"'
    return world(FLOOR + free("body", f"0 0 {height}", geom), option, slope=slope, mu=mu)


# -- what holds ------------------------------------------------------------------------------------


def of_page(scene: str) -> Any:
    """The model of a scene."""
    return mujoco.MjModel.from_xml_path(f"docs/friction/{scene}.xml")


def crept(data: Any, stepper: Stepper) -> float:
    """How far a body goes in the sixth second, at steps of 2 ms, m."""
    stepper.step(data, 2500)
    place = data.xpos.copy()
    stepper.step(data, 500)
    return float(np.abs(data.xpos - place).max())


def breakaway(way: Way) -> float:
    """Force that starts to move a box, faster than 1e-5 m/s, in units of mu N; it grows for 11
    s."""
    data, stepper = start(one(BOX), way)
    stepper.step(data, 500)
    for share in np.linspace(0, 1.1, 5500):
        data.qfrc_applied[0] = share * 0.6 * G
        stepper.step(data)
        if data.qvel[0] > 1e-5:
            return float(share)
    return math.inf


def shaken(way: Way) -> float:
    """How far a box on a slope of 10° goes in 8 s, shaken along it by 2 N at 40 rad/s, m."""
    data, stepper = start(one(BOX, slope=10), way)
    stepper.step(data, 500)
    place = data.qpos[0]
    for _ in range(4000):
        data.qfrc_applied[0] = 2 * math.sin(40 * data.time)
        stepper.step(data)
    return float(abs(data.qpos[0] - place))


def holding() -> Rows:
    """Creep in the scenes, breakaway, and drift of a shaken box, one row each, for each way."""
    rows = [["", *WAYS]]
    for scene, name in SCENES.items():
        creep = (f"{crept(*start(of_page(scene), way)):.1e}" for way in WAYS.values())
        rows.append([f"{name} (`{scene}.xml`): creep, m/s", *creep])
    pulled = "box that is pulled: breaks away at, share of Coulomb's limit"
    rows.append([pulled, *(f"{breakaway(way):.4f}" for way in WAYS.values())])
    drifts = "box shaken on a slope of 10°: drift in 8 s, m"
    return [*rows, [drifts, *(f"{shaken(way):.1e}" for way in WAYS.values())]]


# -- what a step costs -----------------------------------------------------------------------------


def columns(count: int) -> Any:
    """Stacks of boxes with four contacts each; one ball for a single contact."""
    across = max(round(math.sqrt(count / 4)), 1)
    boxes = "".join(
        free(f"b{k}", f"{0.3 * (k % across)} 0 {0.05 + 0.1 * (k // across)}", BOX)
        for k in range(count // 4)
    )
    model = world(FLOOR + (boxes or free("ball", "0 0 .05", BALL)))
    model.opt.gravity[:] = 1, 0, -9.6
    return model


def heap(count: int, seed: int) -> Any:
    """Boxes that fall on a floor in layers of nine, each turned a little: 30 contacts of 8 boxes to
    270 of 64."""
    rng, bodies = np.random.default_rng([count, seed]), ""
    for k in range(count):
        place = f"{0.13 * (k % 3 - 1)} {0.13 * (k // 3 % 3 - 1)} {0.1 + 0.15 * (k // 9)}"
        angles = " ".join(f"{angle:.3f}" for angle in rng.normal(size=3) * 10)
        bodies += free(f"b{k}", place, BOX, euler=angles)
    return world(FLOOR + bodies, more='<size memory="50M"/>')


def bin_of_balls(seed: int) -> Any:
    """64 balls that fall into a bin."""
    rng, balls = np.random.default_rng(seed), ""
    for k in range(64):
        x, y = 0.11 * np.array([k % 4 - 1.5, k // 4 % 4 - 1.5]) + rng.uniform(-5e-3, 5e-3, 2)
        balls += free(f"b{k}", f"{x} {y} {0.06 + 0.11 * (k // 16)}", BALL)
    walls = (
        f'<geom type="plane" size="9 9 1" zaxis="{x} {y} 0" pos="{-0.25 * x} {-0.25 * y} 0"/>'
        for x, y in ((1, 0), (-1, 0), (0, 1), (0, -1))
    )
    return world(FLOOR + "".join(walls) + balls, more='<size memory="50M"/>')


def on(floor: str, more: str = "") -> Any:
    """64 boxes on a floor 2.5 m wide."""
    places = itertools.product(0.3 * np.arange(8), repeat=2)
    boxes = (free(f"b{k}", f"{x} {y} .06", BOX) for k, (x, y) in enumerate(places))
    return world(floor + "".join(boxes), more=more + '<size memory="50M"/>')


TILES = "".join(
    f'<geom type="box" size=".125 .125 .05" pos="{0.25 * i} {0.25 * j} -.05"/>'
    for i, j in itertools.product(range(10), repeat=2)
)
FIELD = '<geom type="hfield" hfield="flat" pos="1.05 1.05 0"/>'
CELLS = '<asset><hfield name="flat" nrow="51" ncol="51" size="1.25 1.25 1 .1"/></asset>'


def cost(
    model: Any, way: Way, begin: Callable[[Any, Stepper], None], rounds: int, steps: int
) -> float:
    """Processor time of a step, plain MuJoCo's being 1: median of runs in turn."""
    runs, times = [start(copy.copy(model), each) for each in (PLAIN, way)], np.empty((rounds, 2))
    for row in times:
        for k, (data, stepper) in enumerate(runs):
            begin(data, stepper)
            row[k] = processor_time(partial(stepper.step, data, steps))
    return float(np.median(times[:, 1] / times[:, 0]))


def at_rest(model: Any, steps: int, way: Way) -> float:
    """Cost of a step at rest, to which each comes by itself."""

    def begin(data: Any, stepper: Stepper) -> None:
        if data.time == 0:
            stepper.step(data, 1500)

    return cost(model, way, begin, 15, steps)


def moving(model: Any, rounds: int, steps: int, speed: float, way: Way) -> float:
    """Cost of a step from the beginning, where the first body may have a speed."""

    def begin(data: Any, stepper: Stepper) -> None:
        mujoco.mj_resetData(model, data)
        data.qvel[0] = speed
        stepper.step(data)

    return cost(model, way, begin, rounds, steps)


def falling(build: Callable[[int], Any], way: Way) -> list[float]:
    """Cost of a step of several heaps, each built by its seed."""
    return [moving(build(seed), 1, FALL, 0.0, way) for seed in range(HEAPS)]


def costs() -> Rows:
    """What a step costs, in units of plain MuJoCo's."""
    doors = {"soft": SOFT, "soft, installed": Way(Installed), "rigid": RIGID}
    scenes: dict[str, Callable[[Way], float | list[float]]] = {
        f"at rest, {n} contacts": partial(at_rest, columns(n), max(3000 // n, 40))
        for n in (1, 12, 52, 200, 1000)
    }
    scenes["64 boxes on tiles"] = partial(at_rest, on(TILES), 40)
    scenes["64 boxes on a heightfield"] = partial(at_rest, on(FIELD, CELLS), 40)
    scenes["a box that slides"] = partial(moving, one(BOX, 0.25, 20), 15, 500, 1.0)
    for n in (8, 27, 64, 216):
        scenes[f"falling heap of {n} boxes"] = partial(falling, partial(heap, n))
    scenes["64 balls in a bin"] = partial(falling, bin_of_balls)
    rows = [["cost of a step", *doors]]
    for name, measure in scenes.items():
        ways_of_it = [SOFT] if name.startswith(LONG) else doors.values()
        found = (spread(measure(way)) if way in ways_of_it else "–" for way in doors.values())
        rows.append([name, *found])
    return rows


def spread(found: float | list[float]) -> str:
    """The mean, and of several the least and the most."""
    mean = f"{np.mean(found):.2f}"
    return f"{mean} ({min(found):.1f}–{max(found):.1f})" if isinstance(found, list) else mean


# -- what slides or rolls, in closed form ----------------------------------------------------------


def slide_down(step: float, way: Way, geom: str = BOX, mu: float = 0.25) -> tuple[float, float]:
    """A body that slides down 20°: error of its acceleration, at most; share of steps without
    contact."""
    data, stepper = start(one(geom, mu, 20, step=step), way)
    stepper.step(data, round(1.5 / step))
    speeds, lost = [data.qvel[0]], 0
    for _ in range(round(0.5 / step)):
        stepper.step(data)
        speeds.append(data.qvel[0])
        lost += data.efc_force.max(initial=0) <= 0
    exact = G * (math.sin(math.radians(20)) - mu * math.cos(math.radians(20)))
    return float(np.abs(np.diff(speeds) / step / exact - 1).max()), lost * step / 0.5


def pushed_off(step: float, way: Way, mu: float = 0.4, speed: float = 2.0) -> tuple[float, float]:
    """A box on the floor that gets a speed: by how much its height varies, m; its way, relative to
    the exact one."""
    data, stepper = start(one(FLAT, mu, step=step), way)
    stepper.step(data, round(1 / step))
    data.qvel[0], begin, heights = speed, data.qpos[0], []
    for _ in range(round(1.2 * speed / (mu * G * step))):
        stepper.step(data)
        heights.append(data.qpos[2])
    return float(np.ptp(heights)), float((data.qpos[0] - begin) * 2 * mu * G / speed**2 - 1)


def precessing(
    step: float, way: Way, leans: float = 20.0, lasts: float = 2.0
) -> tuple[float, float]:
    """Euler's disc, a thin one that rolls round on its rim while its centre rests: what its energy
    changes by, relative, and by how many degrees it leans more. (Moffatt, Nature 404, 2000, has its
    speed about the vertical, sqrt(4 g/(a sin)).)"""
    angle, radius, thick = math.radians(leans), 0.05, 3e-4
    lowest = radius * math.sin(angle) + thick * math.cos(angle)
    disc = f'type="cylinder" size="{radius} {thick}" mass=".2"'
    data, stepper = start(model := one(disc, 1.0, height=lowest, step=step), way)
    data.qpos[[3, 5]] = math.cos(angle / 2), math.sin(angle / 2)
    data.qvel[3] = -math.sqrt(4 * G * math.sin(angle) / radius)
    energies = []
    for seconds in (0, lasts):
        stepper.step(data, round(seconds / step))
        for update in (mujoco.mj_forward, mujoco.mj_energyPos, mujoco.mj_energyVel):
            update(model, data)
        energies.append(float(data.energy.sum()))
    now = math.degrees(math.acos(abs(data.xmat[1, 8])))
    return energies[1] / energies[0] - 1, now - leans


def rolling(step: float, way: Way) -> tuple[float]:
    """A ball that slides, then rolls: relative error of its speed, 5/7 of that it begins with."""
    data, stepper = start(one(BALL, 0.3, step=step), way)
    stepper.step(data, round(1 / step))
    data.qvel[0] = 1.0
    stepper.step(data, round(1 / step))
    return (float(data.qvel[0] * 7 / 5 - 1),)


SLIDING: dict[Callable[[float, Way], tuple[float, ...]], dict[str, str]] = {
    slide_down: {
        "box that slides down 20°, μ 0.25: relative error of its acceleration": "{0:.1e}",
        "its contact is lost in": "{1:.0%}",
    },
    pushed_off: {
        "box pushed off with 2 m/s, μ 0.4: its height varies by, µm": "{0:.2g}",
        "relative error of its way, v²/(2 μ g)": "{1:+.1e}",
    },
    rolling: {"ball that slides, then rolls with 5/7 v: relative error": "{0:+.1e}"},
    precessing: {"Euler's disc at 20°: energy gained in 2 s": "{0:+.1e}"},
}
"""Motions that have a closed form, by what measures them at a time step and in a way; and what is
told of all that is measured, lengths in µm."""


def sliding() -> Rows:
    """Motions that slide or roll, with their closed forms."""
    rows = [["", "step, ms", *THREE]]
    for measure, told in SLIDING.items():
        unit = 1e6 if measure is pushed_off else 1.0
        found = {step: [measure(step, way) for way in THREE.values()] for step in (2e-3, 1e-3)}
        for name, form in told.items():
            for step, values in found.items():
                cells = (form.format(unit * first, *rest) for first, *rest in values)
                rows.append([name, f"{1e3 * step:g}", *cells])
    return rows


def landing() -> Rows:
    """A fall of 0.2 m: the depth, the fastest and the highest that a body comes up again."""
    head = ["falls 0.2 m, step 2 ms", "deepest, m", "comes up at, m/s"]
    rows = [[*head, "comes up to, share of 0.2 m"]]
    bounce = {
        f"rigid, restitution {e:g}": Way(partial(Coulomb, rigid=True, restitution=e))
        for e in (0.5, 0.9, 1.0)
    }
    boxes = [("box", BOX, how, way) for how, way in THREE.items()]
    balls = [("ball", BALL, how, way) for how, way in (THREE | bounce).items()]
    for name, geom, how, way in boxes + balls:
        data, stepper = start(one(geom, height=0.25), way)
        heights, speeds = [0.2], [0.0]
        for _ in range(500):
            stepper.step(data)
            heights.append(data.qpos[2] - 0.05)
            speeds.append(data.qvel[2])
        pairs = enumerate(itertools.pairwise(heights))
        lowest = next(k for k, (now, then) in pairs if now < 0.02 and then >= now)
        ups = f"{max(speeds[lowest:]):.1e}", f"{max(heights[lowest:]) / 0.2:.4f}"
        rows.append([f"{name}, {how}", f"{max(-min(heights), 0):.1e}", *ups])
    return rows


# -- what numbers of the law decide ----------------------------------------------------------------


def pile(seed: int, mixed: bool) -> Any:
    """Random bodies that fall on a floor one after the other: boxes, or five kinds."""
    rng, bodies = np.random.default_rng(seed), ""
    for k in range(BODIES):
        size, turn = rng.uniform(0.03, 0.06, 3), rng.normal(size=4)
        x, y = rng.uniform(-0.1, 0.1, 2)
        kind = rng.choice(["box", "capsule", "ellipsoid", "cylinder", "sphere"]) if mixed else "box"
        q, s = (" ".join(map(str, values)) for values in (turn / np.linalg.norm(turn), size))
        place = f"{x} {y} {0.1 + 0.12 * k}"
        bodies += free(f"b{k}", place, f'type="{kind}" size="{s}"', quat=q)
    return world(FLOOR + bodies)


def settle(data: Any, stepper: Stepper) -> tuple[float, float]:
    """How far bodies go in the last second, m, and the most that energy rises above what it was
    since the fall, J."""
    model, lowest, rise = stepper.model, math.inf, 0.0
    for k in range(round((SETTLING + LAST) / 0.01)):
        if k == round(SETTLING / 0.01):
            place = data.xpos.copy()
        stepper.step(data, round(0.01 / model.opt.timestep))
        if data.time > SETTLING / 2:
            mujoco.mj_energyVel(model, data)
            energy = data.energy[1] + G * float(model.body_mass @ data.xipos[:, 2])
            lowest = min(lowest, energy)
            rise = max(rise, energy - lowest)
    return float(np.abs(data.xpos - place).max()), rise


def numbers(rigid: bool = False, **law: Any) -> Way:
    """The law with other numbers, by their names in `Law`."""

    def stepper(model: Any) -> Coulomb:
        coulomb = Coulomb(model, rigid=rigid)
        coulomb._law = replace(coulomb._law, **law)
        return coulomb

    return Way(stepper)


LAWS = {
    "**soft**: slip predicted to a fiftieth of gravity": numbers(),
    "to a hundredth": numbers(share=0.01),
    "predicted, never solved for": numbers(most=0),
    "at most 5 solutions": numbers(most=5),
    "**rigid**: R = 1e-3": numbers(rigid=True),
    "predicted to a hundredth": numbers(rigid=True, share=0.01),
    "loses all its depth in a step": numbers(rigid=True, push=1.0),
    "keeps none": numbers(rigid=True, depth=0.0),
}


def choices() -> Rows:
    """What the numbers of the law decide: how many steps are in doubt, and what gets worse."""
    head = ["rule", "steps in doubt, share", "piles of boxes at rest"]
    rows = [[*head, "energy rises by at most, J", "height varies by, µm"]]
    for name, way in LAWS.items():
        solves, steps, rest, rise = 0, 0, 0, 0.0
        for seed, mixed in itertools.product(range(PILES), (False, True)):
            data, stepper = start(pile(seed, mixed), way)
            drift, risen = settle(data, stepper)
            rest, rise = rest + (drift < STILL and not mixed), max(rise, risen)
            (own,) = stepper._simulations.values()
            solves, steps = solves + int(own.record["solves"][0]), steps + 3000
        pushes = (0.2, 2.0), (1.2, 2.0), (1.2, 5.0)
        height = max(pushed_off(4e-3, way, mu, speed)[0] for mu, speed in pushes)
        found = f"{solves / steps:.2f}", f"{rest} of {PILES}", f"{rise:.1e}", f"{1e6 * height:.2g}"
        rows.append([name, *found])
    return rows


def speed_errors(count: int, seed: int, rigid: bool) -> Iterator[float]:
    """By how much steps of a falling heap are off: the greatest difference of a speed, of middles
    or of edges about them, to that of the same step solved a hundred times as exactly, in units of
    gravity times the step; nan where that wasn't reached."""
    model, kind = heap(count, seed), mujoco.mjtState.mjSTATE_INTEGRATION
    state = np.empty(mujoco.mj_stateSize(model, kind))
    data, again = mujoco.MjData(model), mujoco.MjData(model)
    law, exact = Coulomb(model, rigid=rigid), Coulomb(model, rigid=rigid, share=Law.share / 100)
    law.step(data, FIRST)
    for _ in range(FIRST, FALL, EVERY):
        mujoco.mj_getState(model, data, state, kind)
        mujoco.mj_setState(model, again, state, kind)
        exact.restore(law.state(data), again)
        unsolved = exact.unsolved
        law.step(data)
        exact.step(again)
        off = np.abs(data.qvel - again.qvel).reshape(-1, 6) * ([1.0] * 3 + [HALF] * 3)
        solved = exact.unsolved == unsolved
        yield off.max() / (G * model.opt.timestep) if solved else math.nan
        law.step(data, EVERY - 1)


def speeds() -> Rows:
    """How far off single speeds of heaps that fall are."""
    head = ["heaps", "steps", "no reference", "off by more than 0.01 g h"]
    rows = [[*head, "nine of ten, g h", "the greatest, g h"]]
    for count, rigid in itertools.product((8, 27, 64), (False, True)):
        found = [each for seed in range(HEAPS) for each in speed_errors(count, seed, rigid)]
        off = np.array(found)[np.isfinite(found)]
        name = f"{count} boxes, {'rigid' if rigid else 'soft'}"
        counts = str(len(found)), str(len(found) - len(off)), f"{np.mean(off > 0.01):.0%}"
        rows.append([name, *counts, f"{np.quantile(off, 0.9):.1e}", f"{off.max():.1e}"])
    return rows


def stabilised(model: Any, time: float | None) -> tuple[Any, Coulomb]:
    """Data and the law, with Baumgarte stabilisation of a time constant, or none."""
    model.geom_margin[:] = 4e-3 if time else 0.0
    return mujoco.MjData(model), Coulomb(model, servo=time)


def creeps(model: Any, time: float | None) -> list[str]:
    """Depth and creep of what has settled."""
    data, law = stabilised(model, time)
    way = crept(data, law)
    return [f"{np.abs(data.contact.dist).max():.1e}", f"{way:.1e}"]


def rolls(model: Any, time: float | None) -> list[str]:
    """Depth of a ball that rolls down 5°, and the relative error of its acceleration."""
    data, law = stabilised(model, time)
    law.step(data, 500)
    speed = data.qvel[0]
    law.step(data, 500)
    error = (data.qvel[0] - speed) / (5 / 7 * G * math.sin(math.radians(5))) - 1
    return [f"{np.abs(data.contact.dist).max():.1e}", f"{error:+.1e}"]


def servo() -> Rows:
    """Depth and creep with Baumgarte stabilisation and without."""
    times = {"none": None, "0.1 s": 0.1, "0.02 s": 0.02}
    tilted = one(f'{BOX} euler="10 20 0"', height=0.2)
    kept = ("stack", "fingers", "grasp")
    scenes = {f"{SCENES[name]}: creep, m/s": of_page(name) for name in kept}
    scenes["box dropped on an edge: creep, m/s"] = tilted
    ball = one('size=".01" mass=".03"', slope=5, height=0.01)
    rolling_down = "ball of 1 cm that rolls down 5°: acceleration, error"
    rows = [["scene", *(text for name in times for text in (f"{name}: depth, m", ""))]]
    for name, model in scenes.items():
        rows.append([name, *(cell for time in times.values() for cell in creeps(model, time))])
    rows.append([rolling_down, *(cell for time in times.values() for cell in rolls(ball, time))])
    resting = []
    for time in times.values():
        piles = (stabilised(pile(seed, mixed=False), time) for seed in range(PILES))
        resting += ["–", f"{sum(settle(*each)[0] < STILL for each in piles)} of {PILES}"]
    return [*rows, [f"piles of {BODIES} boxes: at rest", *resting]]


TABLES: dict[str, Callable[[], Rows]] = {
    "holding": holding,
    "sliding": sliding,
    "landing": landing,
    "costs": costs,
    "choices": choices,
    "speeds": speeds,
    "servo": servo,
}


if __name__ == "__main__":
    sys.exit(write_all(TABLES, "Write the tables on Coulomb's law.", "docs/friction.md"))
