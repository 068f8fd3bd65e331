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
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import NamedTuple

import mujoco
import numpy as np

from docs.studies.tables import write
from docs.studies.ways import WAYS, Way, processor_time

LASTS, LONGEST = 1.0, 300.0
"""How long a model runs, s of its own time; and of ours, before it is given up."""
STILL = 1e-3
"""Speed below which a model is at rest, m/s or rad/s."""


@dataclass(frozen=True)
class Run:
    """What became of a model; of one that is `refused` there is nothing else.

    `cost` is the processor time of all steps, s; `touches` and `rests` are said of their end."""

    refused: bool = False
    cost: float = math.nan
    blows_up: bool = False
    touches: bool = False
    rests: bool = False


class Runs(NamedTuple):
    """Those of a model."""

    plain: Run
    soft: Run
    rigid: Run


def run(path: Path, way: Way) -> Run:
    """Run a model. It blows up if MuJoCo warns of its state, and resets it."""
    model = mujoco.MjModel.from_xml_path(str(path))
    model.opt.noslip_iterations = 0
    data = mujoco.MjData(model)
    if model.nkey:
        mujoco.mj_resetDataKeyframe(model, data, 0)
    try:
        stepper = way.begin(model)
    except ValueError:
        return Run(refused=True)
    stepper.step(data)  # compiles
    cost = processor_time(partial(stepper.step, data, round(LASTS / model.opt.timestep)))
    bad = (getattr(mujoco.mjtWarning, f"mjWARN_BAD{what}") for what in ("QPOS", "QVEL", "QACC"))
    blows_up = any(data.warning[each].number for each in bad)
    rests = float(np.abs(data.qvel).max()) < STILL
    return Run(False, cost, blows_up, bool(data.ncon), rests)


def runs(path: Path) -> Runs | None:
    """Those of a file; None if it isn't a model of something that moves."""
    try:
        model = mujoco.MjModel.from_xml_path(str(path))
    except ValueError:
        return None
    moves = model.nv > 0 and model.ngeom > 0
    return Runs(*(run(path, WAYS[kind]) for kind in Runs._fields)) if moves else None


@dataclass(frozen=True)
class Package:
    """What became of its models."""

    name: str
    runs: list[Runs] = field(default_factory=list)
    ended: list[Path] = field(default_factory=list)
    """Those whose process ended, or hung."""


def tried(folder: Path) -> Package:
    """Try all models of a package, each in a process of its own."""
    package = Package(folder.name)
    for path in sorted(folder.rglob("*.xml")):
        with ProcessPoolExecutor(1) as pool:
            try:
                found = pool.submit(runs, path).result(LONGEST)
            except (BrokenProcessPool, TimeoutError):
                print(f"{path}: its process ended, or hung", file=sys.stderr)
                package.ended.append(path)
                for process in pool._processes.values():
                    process.kill()
                continue
        if found:
            package.runs.append(found)
    return package


def counts(said: Sequence[Sequence[bool]]) -> list[str]:
    """Of how many models something is true, in plain MuJoCo, by soft and by rigid contacts."""
    return [str(count) for count in np.array(said, bool).reshape(-1, 3).sum(axis=0)]


def cost(runs: Sequence[tuple[Run, Run]]) -> str:
    """The cost of the second of two runs in units of the first: the median, and what one in ten
    exceeds."""
    shares = [run.cost / plain.cost for plain, run in runs]
    return "{:.1f} ({:.1f})".format(*np.quantile(shares, [0.5, 0.9])) if shares else "–"


def row(package: Package) -> list[str]:
    """The row of a package, or of all."""
    refused = [each for each in package.runs if each.rigid.refused]
    touching = [each for each in package.runs if each.plain.touches and not each.rigid.refused]
    return [
        *(package.name, str(len(package.runs)), str(len(package.ended))),
        *counts([[run.blows_up for run in runs] for runs in package.runs]),
        *(str(len(refused)), str(len(touching))),
        *counts([[run.rests for run in runs] for runs in touching]),
        cost([(each.plain, each.soft) for each in touching]),
        cost([(each.plain, each.rigid) for each in touching]),
    ]


def main() -> int:
    """Run all models, and write the table."""
    parser = argparse.ArgumentParser(description="Try Coulomb's law on all models of packages.")
    parser.add_argument("page", type=Path, metavar="FILE", help="docs/records/packages.md")
    parser.add_argument("packages", type=Path, metavar="DIR", help="a folder of unpacked packages")
    args = parser.parse_args()
    head = ["package", "models", "crash or hang", *(f"{kind} blows up" for kind in Runs._fields)]
    head += ["rigid refused", "touch", *(f"{kind} at rest" for kind in Runs._fields)]
    rows, every = [[*head, "cost of soft", "cost of rigid"]], Package("all")
    for folder in sorted(args.packages.iterdir()):
        package = tried(folder)
        rows.append(row(package))
        every.runs.extend(package.runs)
        every.ended.extend(package.ended)
        print(" | ".join(rows[-1]), flush=True)
    write(args.page, "packages", [*rows, row(every)])
    return 0


if __name__ == "__main__":
    sys.exit(main())
