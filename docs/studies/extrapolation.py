"""How often the zero-step limit is off by more than three of its standard uncertainties: rows
of a table."""

from collections.abc import Callable

import numpy as np

from compare.figures.pages import Rows
from compare.method.statistics import COVERAGE
from compare.verification.convergence import extrapolated
from model.arrays import Array

COUNT = 4000
"""Random series of each kind."""
FINEST = (3, 4)
"""Numbers of time steps: h, h/2, h/3, and h/4 or not."""
COARSE = 1 / 20
"""The first step in natural units, that of the studies."""
Series = Callable[[np.random.Generator, Array], Array]
"""Random deviations (n,) at time steps (n,) in natural units."""


def _powers(lowest: float, growth: float) -> Series:
    """Six terms from order 1 or 2 on, of sizes up to 1, `growth` times as large from each to the
    next."""

    def deviations(rng: np.random.Generator, h: Array) -> Array:
        first = int(rng.integers(1, 3))
        sizes = rng.uniform(lowest, 1.0, 6) * rng.choice([-1, 1], 6)
        return np.asarray(sum(size * growth**k * h ** (first + k) for k, size in enumerate(sizes)))

    return deviations


def _root(rng: np.random.Generator, h: Array) -> Array:
    """A root of the step, and a term of first order up to ten times as large or as small."""
    root, line = rng.choice([-1, 1], 2)
    return np.asarray(root * np.sqrt(h) + line * 10 ** rng.uniform(-1, 1) * h)


KINDS: dict[str, Series] = {
    "powers of h with coefficients of 0.3 to 1": _powers(0.3, 1.0),
    "coefficients of 0 to 1": _powers(0.0, 1.0),
    "coefficients ten times as large from each power to the next": _powers(0.3, 10.0),
    "√h, and h with a coefficient of 0.1 to 10": _root,
}
"""What deviations may be made of."""


def misses() -> Rows:
    """The share of random series whose limit misses the truth, by kind and number of steps."""
    rows = [["deviation", *(f"{n} steps" for n in FINEST)]]
    for kind, series in KINDS.items():
        shares = []
        for n in FINEST:
            rng, h = np.random.default_rng(n), COARSE / np.arange(1.0, n + 1)
            missed = 0
            for _ in range(COUNT):
                noise = 10 ** rng.uniform(-9, -5)
                errors = series(rng, h) + noise * rng.normal(size=n)
                limit, _ = extrapolated(h, errors, np.full(n, noise))
                missed += abs(limit.value) > COVERAGE * limit.uncertainty
            shares.append(f"{missed / COUNT:.2%}")
        rows.append([kind, *shares])
    return rows
