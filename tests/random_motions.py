"""Seeded random parameters and starts, all over the range in which the simulators are tried."""

import math

import numpy as np

from model import Case, Parameters, State
from model.cases import TRAITS

P = Parameters.named("reference")
UNIT = math.sqrt(P.g / P.R)


def random_start(seed: int, on_wall: bool = False) -> tuple[Parameters, State]:
    """mu 0.03-3, eta 0.03-2, j 0.1-0.66, r/R 0.05-0.6, kappa 0.01-3, Omega_0 0.3-6; on the floor or
    up to R above it.

    One ball in five starts off the wall, unless `on_wall`."""
    rng = np.random.default_rng([77, seed])

    def log_uniform(low: float, high: float) -> float:
        return float(10 ** rng.uniform(math.log10(low), math.log10(high)))

    p = P.replace(
        r=rng.uniform(0.05, 0.6) * P.R,
        mu=log_uniform(0.03, 3),
        eta=log_uniform(0.03, 2),
        j=rng.uniform(0.1, 0.66),
        c=log_uniform(0.01, 3) * UNIT,
        omega_0=rng.uniform(0.3, 6) * UNIT,
    )
    speed = 0.3 * UNIT * P.R
    x = State(omega_c=rng.uniform(-0.5, 1.5) * p.omega_0)
    slips = rng.normal(size=3) * p.omega_0 * p.R / p.r * 10 ** rng.uniform(-2, 0.3)
    x = x._replace(**dict(zip(("slip_x", "slip_y", "slip_z"), slips.tolist(), strict=True)))
    if rng.random() < 0.5:
        x = x._replace(y=rng.uniform(0, P.R), v_y=rng.normal() * speed)
    if rng.random() < 0.2 and not on_wall:
        x = x._replace(h=rng.uniform(0, 0.9) * P.R, v_h=rng.normal() * speed)
    return p, x


def random_state(case: Case, rng: np.random.Generator, p: Parameters) -> State:
    """A state of a case."""
    values = State(*rng.normal(size=8) * [0.1, 0.3, 10, 20, 20, 20, 0, 0.3])
    values = values._replace(y=abs(values.y), h=p.R * rng.uniform(0.1, 0.9))
    active = TRAITS[case].active
    x = State(*(v if n in active else 0.0 for n, v in values._asdict().items()))
    return x._replace(slip_z=-x.v_h / p.r) if case is Case.RN else x
