"""Measure scenes that others wrote, and write their tables: ``python -m docs.studies.scenes
docs/records/scenes.md``.

What was found is kept beside the page, as scenes.json, since the packages don't get along with one
version of MuJoCo: run it with ``--only NAME`` in an environment of each package, and with
``--kept`` where this project is installed. All take some ten minutes."""

import argparse
import dataclasses
import importlib.metadata
import importlib.util
import json
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import mujoco

from docs.studies import robot_scenes, small_scenes
from docs.studies.ways import WAYS, Found, Way

ROUNDS = 2
WORSE = 1.1
"""Times what plain MuJoCo has: more counts as worse."""
NEW = ("soft", "rigid")


@dataclass(frozen=True)
class Scene:
    """What a reader calls it, how it runs, and the package it comes from."""

    title: str
    run: Callable[[Way], Found]
    package: str | None = None


SCENES = {
    "lift": Scene("Panda lifts a cube", robot_scenes.lift, "robosuite"),
    "block": Scene("Shadow hand, block", robot_scenes.block, "gymnasium_robotics"),
    "egg": Scene("Shadow hand, egg", robot_scenes.egg, "gymnasium_robotics"),
    "ant": Scene("Ant on 12°", robot_scenes.ant, "gymnasium"),
    "quadruped": Scene("quadruped on 10°", robot_scenes.quadruped, "dm_control"),
    "humanoids": Scene("22 humanoids", robot_scenes.humanoids, "dm_control"),
    "sawyer": Scene("Sawyer holds a puck", robot_scenes.sawyer, "metaworld"),
    "treadmill": Scene("treadmill", small_scenes.treadmill),
    "carousel": Scene("carousel", small_scenes.carousel),
    "dominos": Scene("dominos", small_scenes.dominos),
    "cradle": Scene("Newton's cradle", small_scenes.cradle),
    "nut": Scene("nut and bolt", small_scenes.nut),
    "tactile": Scene("tactile pad", small_scenes.tactile),
    "castle": Scene("castle", small_scenes.castle),
    "sleeping": Scene("towers that may sleep", small_scenes.sleeping),
    "mocap": Scene("mocap gripper", small_scenes.mocap),
    "tendon": Scene("tendon with dry friction", small_scenes.tendon),
    "flex": Scene("flex gripper", small_scenes.flex),
    "rolling": Scene("rolling at 0.5 m/s", small_scenes.rolling),
}


def measure(scene: Scene) -> dict[str, Any]:
    """What a scene comes to in each way, of two runs the cheaper one; and the versions that it ran
    with."""
    needed = ["mujoco"] + ([scene.package] if scene.package else [])
    versions = ", ".join(f"{name} {importlib.metadata.version(name)}" for name in reversed(needed))
    found = {}
    for name, way in WAYS.items():
        try:
            runs = [scene.run(way) for _ in range(ROUNDS)]
        except (NotImplementedError, ValueError) as reason:
            print(f"  {name}: {reason}")
            continue
        found[name] = dataclasses.asdict(min(runs, key=lambda run: run.step))
        print(f"  {name}: {found[name]}", flush=True)
    return {"versions": versions, "ways": found}


Kept = Mapping[str, Mapping[str, Any]]
Rows = list[list[str]]


def there(kept: Kept) -> list[tuple[str, str, Any]]:
    """Titles of the scenes that are kept, the versions that each ran with, and its ways."""
    return [
        (scene.title, kept[name]["versions"], kept[name]["ways"])
        for name, scene in SCENES.items()
        if name in kept
    ]


def figures(kept: Kept) -> Rows:
    """Creep, slip and what else is measured of a scene, and what went wrong."""
    rows = [["", *WAYS]]
    for title, _, ways in there(kept):
        for quantity in ways["plain"]["values"]:
            cells = (
                ": ".join([f"{ways[way]['values'][quantity]:.1e}", *ways[way]["wrong"]])
                if way in ways
                else "–"
                for way in WAYS
            )
            rows.append([f"{title}: {quantity}", *cells])
    return rows


def cost(kept: Kept) -> Rows:
    """Processor time of a step in units of plain MuJoCo's."""
    timed = [name for name, way in WAYS.items() if way.timed and name != "plain"]
    rows = [["", "with", "contacts", "plain, µs", *timed]]
    for title, versions, ways in there(kept):
        plain = ways["plain"]["step"]
        cells = [f"{ways[way]['step'] / plain:.2f}" if way in ways else "–" for way in timed]
        contacts = str(ways["plain"]["contacts"])
        rows.append([title, versions, contacts, f"{plain * 1e6:.0f}", *cells])
    return rows


def worse(kept: Kept) -> Rows:
    """Where bodies sink in deeper, or energy rises higher, than in plain MuJoCo."""
    rows = [["", "", "plain", *NEW]]
    for title, _, ways in there(kept):
        for quantity, label in (("depth", "depth, m"), ("rise", "rise of energy, J")):
            plain, *others = (
                ways[way][quantity] if way in ways else None for way in ("plain", *NEW)
            )
            if plain is not None and any(
                other is not None and other > WORSE * plain + 1e-9 for other in others
            ):
                cells = ("–" if each is None else f"{each:.1e}" for each in (plain, *others))
                rows.append([title, label, *cells])
    return rows


TABLES = {"figures": figures, "cost": cost, "worse": worse}


def main() -> int:
    """Measure all scenes whose package is there, or those named, and write the tables."""
    what = "Measure scenes that others wrote, and write their tables."
    parser, only = argparse.ArgumentParser(description=what), "only this scene"
    parser.add_argument("page", type=Path, metavar="FILE", help="docs/records/scenes.md")
    parser.add_argument("--only", action="append", choices=[*SCENES], metavar="NAME", help=only)
    parser.add_argument("--kept", action="store_true", help="measure nothing, write what is kept")
    args = parser.parse_args()
    file = args.page.with_suffix(".json")
    for name in [] if args.kept else args.only or SCENES:
        scene = SCENES[name]
        if scene.package and not importlib.util.find_spec(scene.package):
            print(f"{name}: {scene.package} is not installed")
            continue
        print(f"{name}, MuJoCo {mujoco.__version__}", flush=True)
        found = measure(scene)
        kept = json.loads(file.read_text("utf-8")) if file.exists() else {}
        file.write_text(json.dumps(kept | {name: found}, indent=1) + "\n", "utf-8")
    try:
        from docs.studies.tables import write
    except ImportError:
        print("tables are written where this project is installed, with --kept")
        return 0
    kept = json.loads(file.read_text("utf-8"))
    for name, table in TABLES.items():
        write(args.page, name, table(kept))
    return 0


if __name__ == "__main__":
    sys.exit(main())
