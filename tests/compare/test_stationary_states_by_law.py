"""Stationary states under each law of drag: those of the closed forms are where MuJoCo stays and where it comes to."""

from __future__ import annotations

import numpy as np
import pytest

import analytic
import mjsim
from mjsim import ContactSettings
from model import Case, Parameters
from model.drag import LAWS, QUADRATIC

P = Parameters.named("reference").replace(nu_f=2e-5)


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize(("case", "omega_0"), [(Case.RR, 10.0), (Case.SS, 29.0), (Case.NS, 20.0)])
def test_mujoco_comes_to_the_stationary_state(law: str, case: Case, omega_0: float) -> None:
    """omega_c to 1e-9. Under the quadratic law rolling with the fluid begins there: it is approached like 1/t only."""
    p = P.replace(drag=law, omega_0=omega_0)
    s = analytic.solution(p, case)
    x0 = s.x.copy()
    x0[0] = 100.0 if case is Case.NS else 0.0  # no landing
    away = 0.0 if case is Case.RR and law == QUADRATIC else 1e-4
    x0[2] *= 1 - away
    end = 20.0 if case is Case.RR else 10.0
    left = away * np.exp(-end / analytic.slowest_time_constant(s))
    run = mjsim.simulate(p, x0, end, settings=ContactSettings.for_problem(p, 5e-4), sample_interval=end / 2)
    assert run.cases[-1] is case
    assert abs(run.omega_c[-1] / s.state.omega_c - 1) <= 1e-9 + 2 * left
