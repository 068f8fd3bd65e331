"""Time the map of Fig. 7 at 1000 x 1000 points: ``python tests/benchmarks/case_map.py``. The aim is 2 s."""

from __future__ import annotations

import time

import numpy as np

from analytic.bifurcation import case_map
from model import Parameters

if __name__ == "__main__":
    p = Parameters.named("reference")
    times = []
    for _ in range(5):
        start = time.perf_counter()
        case_map(p, p.mu, np.linspace(0.0, 0.8, 1000), np.linspace(0.0, 100.0, 1000))
        times.append(time.perf_counter() - start)
    print(f"1000 x 1000 map: best {min(times):.3f} s, worst {max(times):.3f} s of {len(times)}")
