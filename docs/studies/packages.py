"""Try Coulomb's law on every model of packages that others wrote: ``python -m docs.studies.packages
docs/records/packages.md DIR``, where each package lies unpacked in a folder of DIR.

A model begins as its first keyframe has it, else as its file, and runs for a second without
controls, in a process of its own."""

import argparse
import math
import sys
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import mujoco
import numpy as np

from docs.studies.tables import write
from docs.studies.ways import WAYS, Way, processor_time

KINDS = ("plain", "soft", "rigid")
LASTS, LONGEST = 1.0, 300.0
"""How long a model runs, s of its own time; and of ours, before it is given up."""
STILL = 1e-3
"""Speed below which a model is at rest, m/s or rad/s."""


@dataclass(frozen=True)
class Run:
    """What became of a model. `cost`: processor time of all steps, s; NaN if it was refused."""

    cost: float = math.nan
    blows_up: bool = False
    touches: bool = False
    rests: bool = False


def run(path: Path, way: Way) -> Run:
    """Run a model; of warnings MuJoCo resets a simulation after those of its state alone."""
    model = mujoco.MjModel.from_xml_path(str(path))
    model.opt.noslip_iterations = 0
    data = mujoco.MjData(model)
    if model.nkey:
        mujoco.mj_resetDataKeyframe(model, data, 0)
    try:
        stepper = way.begin(model)
    except ValueError:
        return Run()
    stepper.step(data)  # compiles
    cost = processor_time(partial(stepper.step, data, round(LASTS / model.opt.timestep)))
    bad = (getattr(mujoco.mjtWarning, f"mjWARN_BAD{what}") for what in ("QPOS", "QVEL", "QACC"))
    blows_up = any(data.warning[each].number for each in bad)
    rests = float(np.abs(data.qvel).max()) < STILL
    return Run(cost, blows_up, bool(data.ncon), rests)


def runs(path: Path) -> list[Run]:
    """Those of all kinds; none of what isn't a model of something that moves."""
    try:
        model = mujoco.MjModel.from_xml_path(str(path))
    except ValueError:
        return []
    return [run(path, WAYS[kind]) for kind in KINDS] if model.nv and model.ngeom else []


def apart(path: Path) -> list[Run] | None:
    """The same in a process of its own; None if that ended or hung."""
    with ProcessPoolExecutor(1) as pool:
        try:
            return pool.submit(runs, path).result(LONGEST)
        except (BrokenProcessPool, TimeoutError):
            for process in pool._processes.values():
                process.kill()
            return None


def row(name: str, found: Sequence[list[Run] | None]) -> list[str]:
    """The row of a package, or of all."""
    ran = [each for each in found if each]
    cells = [name, str(len(ran)), str(found.count(None))]
    cells += [str(sum(each[k].blows_up for each in ran)) for k in range(len(KINDS))]
    cells.append(str(sum(math.isnan(each[-1].cost) for each in ran)))
    touching = [each for each in ran if each[0].touches and not math.isnan(each[-1].cost)]
    cells.append(str(len(touching)))
    cells += [str(sum(each[k].rests for each in touching)) for k in range(len(KINDS))]
    for k in range(1, len(KINDS)):
        costs = [each[k].cost / each[0].cost for each in touching]
        least, most = np.quantile(costs, [0.5, 0.9]) if costs else (math.nan, math.nan)
        cells.append(f"{least:.1f} ({most:.1f})" if costs else "–")
    return cells


def main() -> int:
    """Run all models, and write the table."""
    parser = argparse.ArgumentParser(description="Try Coulomb's law on all models of packages.")
    parser.add_argument("page", type=Path, metavar="FILE", help="docs/records/packages.md")
    parser.add_argument("packages", type=Path, metavar="DIR", help="a folder of unpacked packages")
    args = parser.parse_args()
    head = ["package", "models", "crash or hang", *(f"{kind} blows up" for kind in KINDS)]
    head += ["rigid refused", "touch", *(f"{kind} at rest" for kind in KINDS)]
    rows = [[*head, "cost of soft", "cost of rigid"]]
    everything: list[list[Run] | None] = []
    for folder in sorted(args.packages.iterdir()):
        found = [apart(path) for path in sorted(folder.rglob("*.xml"))]
        rows.append(row(folder.name, found))
        everything += found
        print(" | ".join(rows[-1]), flush=True)
    write(args.page, "packages", [*rows, row("all", everything)])
    return 0


if __name__ == "__main__":
    sys.exit(main())
