"""The model in closed form: what the equations of the paper say the ball does."""

from analytic.bifurcation import Thresholds, operating_range, thresholds
from analytic.dynamics import contact_forces, vector_field
from analytic.settings import Settings
from analytic.simulation import simulate
from analytic.stationary import Stability, StationarySolution, stationary_solutions

__all__ = [
    "Settings", "Stability", "StationarySolution", "Thresholds", "contact_forces", "operating_range", "simulate",
    "stationary_solutions", "thresholds", "vector_field",
]  # fmt: skip
