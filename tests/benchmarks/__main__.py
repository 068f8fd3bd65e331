"""``python -m tests.benchmarks``: speed, as ratios within one run.

They depend less on the machine and its load than times do.
"""

import functools
import statistics
import time
from collections.abc import Sequence

import mujoco
import numpy as np
from mujoco.batch import Batch
from rich.console import Console

from analytic import stable_solutions
from compare.kit import pages
from mjsim import scene
from mjsim.contact_settings import ContactSettings
from mjsim.engine import Run
from mjsim.stepping import Polar
from model import Flow, Parameters
from tests.benchmarks import campaigns


def main() -> None:
    """Measure the loop over bare steps, alone and in a batch; then campaigns. Show it as a table."""
    (state,) = stable_solutions(campaigns.SLIPPING)
    rows = [["", "bare mj_step", "whole loop", "ratio"]]
    for name, runs in (("one simulation", 1), (f"batch of {campaigns.BATCH}", campaigns.BATCH)):
        bare, whole, ratio = cost(campaigns.SLIPPING, state.x.tolist(), runs)
        rows.append([name, f"{1e6 * bare:.2f} µs", f"{1e6 * whole:.2f} µs", f"{ratio:.2f}"])
    Console().print(pages.table("Cost of the study's loop", [*rows, *campaigns.rows()]))


def cost(p: Parameters, x0: Sequence[float], runs: int = 1, steps: int = 2500, repeats: int = 5) -> list[float]:
    """Processor time of a bare and of a whole step of one simulation, s, and their ratio: medians over `repeats`.

    There is a sample every 100 steps. Timings are taken in turn, each whole one between two bare ones: a machine that
    slows down does so for both.

    Start from a stationary state, or the two don't solve the same contacts: the bare steps are those of a settled run
    with its forces, margins and surface velocities left as they are, and the ball held at its azimuth, where the wall
    stands, by a single assignment a step.
    """
    settings = ContactSettings()
    model, _ = scene.build(p, settings)
    omega_0 = np.full((500, 1), p.omega_0)
    settled = Polar([model], [p], settings, [x0], 0.0, omega_0[0], batched=False)
    settled.advance(omega_0)
    bare, whole = [_bare(settled, runs, steps)], []
    for _ in range(repeats):
        duration, interval, flow = steps * settings.timestep, 100 * settings.timestep, Flow.steady(p.omega_0)
        starts = [p] * runs, [x0] * runs, duration, [flow] * runs
        loop = Run(*starts, settings, sample_interval=interval, batched=runs > 1)
        start = time.process_time()
        for _ in loop:
            pass
        whole.append(time.process_time() - start)
        bare.append(_bare(settled, runs, steps))
    ratios = [2 * w / (before + after) for w, before, after in zip(whole, bare, bare[1:], strict=False)]
    return [
        statistics.median(bare) / (steps * runs),
        statistics.median(whole) / (steps * runs),
        statistics.median(ratios),
    ]


def _bare(settled: Polar, runs: int, steps: int) -> float:
    """Time in s of the given steps with no more around them than a loop."""
    model, data = settled.model, settled.data
    if runs == 1:
        azimuth, step = data.qpos[:1], functools.partial(mujoco.mj_step, model, data)
    else:
        batch = Batch(model, nsim=runs, nthread=1)
        for name in ("qpos", "qvel", "qfrc_applied", "mocap_quat", "qacc_warmstart"):
            batch.bind(name)[:] = getattr(data, name)
        azimuth, step = batch.bind("qpos")[:, 0], batch.step
    held = float(data.qpos[0])
    start = time.process_time()
    for _ in range(steps):
        step()
        azimuth[:] = held
    return time.process_time() - start


if __name__ == "__main__":
    main()
