"""The fluid's inertia against the balance of forces and moments of a ball in a swirl, written out here."""

from __future__ import annotations

import math

import numpy as np
import pytest

from analytic.bifurcation import diagram as bifurcation
from model import Parameters

BALL = Parameters.named("steel-in-water")
RATIOS = [0.0, 0.127, 0.4, 0.7]


def rolls(p: Parameters, omega: float) -> bool:
    """Whether forces within both cones hold a ball that rolls round with the fluid: some free force B_y does.

    Newton with the pressure gradient of the swirl, 3/2 of the displaced mass times its centripetal acceleration, and
    with half the displaced mass added to the ball's; Euler without either.
    """
    s, centripetal = p.density_ratio, p.R * omega**2
    pull = 1.5 * s * p.m * centripetal
    B_y = np.linspace(0.0, p.m * p.g, 200_001)
    A_y = p.m * p.g - B_y
    A_x = B_y - p.j * p.m * centripetal  # turns the spin with the orbit
    B_x = (p.m + s * p.m / 2) * centripetal - pull - A_x
    return bool(np.any((np.abs(A_x) <= p.mu * A_y) & (B_y <= p.eta * B_x)))


@pytest.mark.parametrize("s", RATIOS)
@pytest.mark.parametrize(("mu", "eta"), [(0.2, 0.2), (0.05, 0.3), (0.5, 0.1)])
def test_rolling_ends_where_no_forces_hold_it(s, mu, eta):
    p = BALL.replace(mu=mu, eta=eta, density_ratio=s)
    omega_01 = bifurcation.thresholds_with_inertia(p)["omega_01"]
    # B_y is tried in 2e5 parts of m g: relative changes of omega_01 that matter are far above their size.
    assert rolls(p, omega_01 * (1 - 1e-4))
    assert not rolls(p, omega_01 * (1 + 1e-4))


@pytest.mark.parametrize("s", RATIOS)
def test_the_wall_carries_the_ball(s):
    p = BALL.replace(density_ratio=s)
    changed = bifurcation.thresholds_with_inertia(p)
    weight = p.m * p.g
    load = (1 + s / 2) * p.m * p.R * changed["omega_02"] ** 2 - 1.5 * s * p.m * p.R * changed["omega_02"] ** 2
    assert p.eta * load == pytest.approx(weight, rel=1e-12)


def test_shifts():
    p = BALL.replace(density_ratio=0.4)
    by = bifurcation.inertia_shifts(p)
    assert by["omega_02"] == pytest.approx(1 / math.sqrt(0.6) - 1, rel=1e-12)
    assert by["rolling_rate"] == pytest.approx(1.8 / 2.0 - 1, rel=1e-12)
    assert all(shift == 0.0 for shift in bifurcation.inertia_shifts(p.replace(density_ratio=0.0)).values())
    assert math.isnan(bifurcation.inertia_shifts(p.replace(eta=0.5))["omega_01"])  # there is none without it
    assert math.isfinite(
        bifurcation.thresholds_with_inertia(p.replace(eta=0.5))["omega_01"]
    )  # but eta < j/(1 - s) is enough
    assert "omega_01" not in bifurcation.inertia_shifts(p.replace(mu=0.0))
