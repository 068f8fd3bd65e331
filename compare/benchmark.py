"""Speed as ratios measured within one run: machines differ and are noisy, ratios are not and less so."""

from __future__ import annotations

import dataclasses
import statistics
import time
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from multiprocessing import get_context
from typing import Any

import numpy as np
from rich.table import Table

from mjsim import benchmark, simulate_many
from model import Parameters

BATCH = 64
STEPS = 2000
REPEATS = 5


@dataclass(frozen=True)
class Figures:
    """What `run` found."""

    single: benchmark.Cost
    """One simulation."""
    batch: benchmark.Cost
    """A batch of `BATCH`."""
    two_over_one: float
    """Throughput of two processes over that of one."""

    def to_mapping(self) -> dict[str, Any]:
        """JSON-able data."""
        return {
            "single": {**dataclasses.asdict(self.single), "ratio": self.single.ratio},
            "batch": {**dataclasses.asdict(self.batch), "ratio": self.batch.ratio},
            "two_over_one": self.two_over_one,
        }


def run() -> Figures:
    """Measure the loop over bare steps, alone and in a batch, and two processes over one."""
    p, x0 = _problem()
    return Figures(benchmark.cost(p, x0), benchmark.cost(p, x0, BATCH, STEPS // 4), _two_over_one())


def table(figures: Figures) -> Table:
    """The figures for the terminal."""
    shown = Table(title="Cost of the study's loop", title_justify="left", title_style="bold")
    for column in ("", "bare mj_step", "whole loop", "ratio"):
        shown.add_column(column, justify="right" if column else "left")
    for name, cost in (("one simulation", figures.single), (f"batch of {figures.batch.runs}", figures.batch)):
        shown.add_row(name, f"{1e6 * cost.bare:.2f} µs", f"{1e6 * cost.whole:.2f} µs", f"{cost.ratio:.2f}")
    shown.add_row("two processes over one", "", "", f"{figures.two_over_one:.2f}")
    return shown


def _problem() -> tuple[Parameters, list[float]]:
    """Two-point slipping, from rest: both contacts closed all the time."""
    return Parameters.named("reference").replace(omega_0=25.0), [0.0] * 8


def _two_over_one() -> float:
    """Median over `REPEATS` of the time of two batches one after the other, over both at once."""
    ratios = []
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as pool:
        list(pool.map(_work, [10, 10]))  # processes start and import outside the measurement
        for _ in range(REPEATS):
            start = time.perf_counter()
            pool.submit(_work, STEPS // 2).result()
            pool.submit(_work, STEPS // 2).result()
            middle = time.perf_counter()
            list(pool.map(_work, [STEPS // 2, STEPS // 2]))
            ratios.append((middle - start) / (time.perf_counter() - middle))
    return statistics.median(ratios)


def _work(steps: int) -> None:
    p, x0 = _problem()
    simulate_many([p] * BATCH, [np.array(x0)] * BATCH, steps * 1e-3, sample_interval=0.1 if steps >= 100 else None)
