"""Genesis beside Coulomb's law: ``python -m docs.studies.genesis docs/records/league.md``.

It needs Genesis, which needs PyTorch: ``pip install -e . genesis-world torch``. Scenes and what is
measured are those of `docs.studies.friction`."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable
from typing import Any

import genesis as gs
import numpy as np

from compare.figures.pages import Rows
from docs.studies import friction
from docs.studies.friction import SOFT, G
from docs.studies.tables import write_all

STEP = 2e-3
COLUMNS: dict[str, dict[str, Any]] = {
    "signorini": {"contact_resolution": "signorini"},
    "impratio 1": {"contact_resolution": "signorini", "impratio": 1.0},
    "convex": {"contact_resolution": "convex"},
}
"""Options of Genesis, which by itself has De Saxcé's shift, `signorini`, and a large impratio."""
SHAPES: dict[str, dict[str, Any]] = {
    "Box": {"size": (0.1, 0.1, 0.1)},
    "Slab": {"size": (0.2, 0.2, 0.1)},
    "Sphere": {"radius": 0.05},
}


class Body:
    """A body on a plane, on a slope in degrees, in double precision."""

    def __init__(self, options: dict[str, Any], shape: str, mu: float, slope: float = 0.0) -> None:
        leans = math.radians(slope)
        gravity = G * math.sin(leans), 0.0, -G * math.cos(leans)
        resolution = getattr(gs.contact_resolution, options["contact_resolution"])
        self.scene = gs.Scene(
            sim_options=gs.options.SimOptions(dt=STEP, substeps=1, gravity=gravity),
            rigid_options=gs.options.RigidOptions(
                friction_cone=gs.friction_cone.elliptic,
                tolerance=1e-12,
                **options | {"contact_resolution": resolution},
            ),
            show_viewer=False,
        )
        material = gs.materials.Rigid(friction=mu)
        self.scene.add_entity(gs.morphs.Plane(), material=material)
        morph = getattr(gs.morphs, {"Slab": "Box"}.get(shape, shape))
        body = morph(pos=(0, 0, 0.05), **SHAPES[shape])
        self.entity = self.scene.add_entity(body, material=material)
        self.scene.build()

    def step(self, count: int = 1) -> None:
        for _ in range(count):
            self.scene.step()

    @property
    def place(self) -> Any:
        """m"""
        return self.entity.get_pos().cpu().numpy().ravel()

    @property
    def speed(self) -> float:
        """Along x, m/s."""
        return float(self.entity.get_dofs_velocity().cpu().numpy().ravel()[0])

    def push_off(self, speed: float) -> None:
        """Give it a speed along x, after a second of rest, m/s."""
        self.step(round(1 / STEP))
        self.entity.set_dofs_velocity(np.array([speed, 0, 0, 0, 0, 0]))


def creep(options: dict[str, Any]) -> float:
    """How far a box on 15° goes in the sixth second, m."""
    box = Body(options, "Box", 0.6, 15)
    box.step(2500)
    place = box.place
    box.step(500)
    return float(np.abs(box.place - place).max())


def slide_down(options: dict[str, Any]) -> float:
    """Largest relative error of the acceleration of a box that slides down 20°."""
    box = Body(options, "Box", 0.25, 20)
    box.step(round(1.5 / STEP))
    speeds = [box.speed]
    for _ in range(round(0.5 / STEP)):
        box.step()
        speeds.append(box.speed)
    exact = G * (math.sin(math.radians(20)) - 0.25 * math.cos(math.radians(20)))
    return float(np.abs(np.diff(speeds) / STEP / exact - 1).max())


def pushed_off(options: dict[str, Any]) -> float:
    """By how much the height of a box varies that is pushed off with 2 m/s, m."""
    slab, heights = Body(options, "Slab", 0.4), []
    slab.push_off(2.0)
    for _ in range(round(2.4 / (0.4 * G * STEP))):
        slab.step()
        heights.append(slab.place[2])
    return float(np.ptp(heights))


def rolling(options: dict[str, Any]) -> float:
    """Relative error of the speed, 5/7 of that at the start, with which a ball that slid rolls."""
    ball = Body(options, "Sphere", 0.3)
    ball.push_off(1.0)
    ball.step(round(1 / STEP))
    return ball.speed * 7 / 5 - 1


def table() -> Rows:
    """What Genesis makes of scenes of friction.md, and MuJoCo under the law, soft."""
    gs.init(backend=gs.cpu, precision="64", logging_level="error")
    data, stepper = friction.start(friction.of_page("box"), SOFT)
    law = {
        "box on a slope of 15°: creep, m/s": friction.crept(data, stepper),
        "box that slides down 20°: error of its acceleration": friction.slide_down(STEP, SOFT)[0],
        "box pushed off with 2 m/s: its height varies by, m": friction.pushed_off(STEP, SOFT)[0],
        "ball that slides, then rolls: error of its speed": friction.rolling(STEP, SOFT)[0],
    }
    measures: list[Callable[[dict[str, Any]], float]] = [creep, slide_down, pushed_off, rolling]
    rows = [[f"Genesis {gs.__version__}", *COLUMNS, "MuJoCo under the law, soft"]]
    for (name, ours), measure in zip(law.items(), measures, strict=True):
        found = [measure(options) for options in COLUMNS.values()]
        rows.append([name, *(f"{value:.1e}" for value in [*found, ours])])
    return rows


TABLES = {"genesis": table}


if __name__ == "__main__":
    sys.exit(write_all(TABLES, "Measure Genesis.", "docs/records/league.md"))
