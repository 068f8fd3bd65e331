"""The model in closed form: what the equations of the paper say the ball does."""

import model

if not hasattr(model, "Parameters"):
    raise ImportError(
        f"{model.__file__} hides the package model of dualball: rename that, or work in another "
        f"folder"
    )

from analytic.bifurcation.diagram import Thresholds, thresholds
from analytic.flowmeter.characteristic import (
    OperatingLimit,
    characteristic_slope,
    mean_slope,
    operating_limit,
    operating_range,
    reading_range,
    slope_jump,
    unloading_limit,
)
from analytic.mechanics.dynamics import contact_forces, vector_field
from analytic.orbits.attractors import attractors
from analytic.simulation.ensemble import Ensemble, simulate_many
from analytic.simulation.settings import Settings
from analytic.simulation.simulator import simulate
from analytic.slipping.slip_stability import SlipStability
from analytic.stationary.solutions import (
    Stability,
    StationarySolution,
    eigenmodes_SR,
    slowest_time_constant,
    solution,
    stable_solutions,
    stationary_solutions,
)

__all__ = [
    "Ensemble",
    "OperatingLimit",
    "Settings",
    "SlipStability",
    "Stability",
    "StationarySolution",
    "Thresholds",
    "attractors",
    "characteristic_slope",
    "contact_forces",
    "eigenmodes_SR",
    "mean_slope",
    "operating_limit",
    "operating_range",
    "reading_range",
    "simulate",
    "simulate_many",
    "slope_jump",
    "slowest_time_constant",
    "solution",
    "stable_solutions",
    "stationary_solutions",
    "thresholds",
    "unloading_limit",
    "vector_field",
]
