"""The longest step of a problem."""

from typing import Any

import numpy as np
import pytest

from model import Flow, InputError, Parameters
from model.time_scales import check_timestep

P = Parameters.named("reference")
SLOW: dict[str, Any] = {"omega_0": 1.0, "c": 1.0}
QUADRATIC: dict[str, Any] = {"drag": "quadratic", "nu_f": 1e-6}


@pytest.mark.parametrize(
    ("changes", "flow", "shortest", "name"),
    [
        (SLOW, None, np.sqrt(P.R / P.g), r"sqrt\(R/g\)"),
        (SLOW | {"omega_0": -25.0}, None, 1 / 25, "1/omega_0"),
        (SLOW, Flow.ramp(1.0, 50.0, 0.05), 1 / 50, "1/omega_0"),
        (SLOW, Flow.ramp(1.0, 50.0, 0.05, t_start=0.1), np.sqrt(P.R / P.g), r"sqrt\(R/g\)"),
        (SLOW, Flow.sine(10.0, 40.0, 1.0), 1 / 50, "1/omega_0"),
        (SLOW, Flow.sine(1.0, 1.0, 20.0), 1 / (40 * np.pi), r"1/\(2 pi f\)"),
        (SLOW | {"c": 100.0}, None, 1 / 100, "1/c"),
        (SLOW | {"c": 0.0}, None, np.sqrt(P.R / P.g), r"sqrt\(R/g\)"),
        (SLOW | QUADRATIC, None, 1 / (2 * 700 * P.R), r"1/\(2 c\(R omega_0\)\)"),
    ],
)
def test_a_step_too_large_for_the_problem_is_refused(
    changes: dict[str, Any], flow: Flow | None, shortest: float, name: str
) -> None:
    p = P.replace(**changes)
    problem = p, flow or Flow.steady(p.omega_0), 0.1, lambda speed: 700 * speed
    words = rf"timestep = .* s is out of range: must be <= .* s, half of {name}, the shortest time of the problem"
    with pytest.raises(InputError, match=words):
        check_timestep(0.501 * shortest, *problem)
    check_timestep(0.499 * shortest, *problem)
