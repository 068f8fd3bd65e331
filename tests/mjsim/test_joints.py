"""The ball on joints under the general law: settled states are those of the closed form."""

from __future__ import annotations

import pytest

import analytic
from mjsim import joints
from model import Parameters, State


@pytest.mark.parametrize(
    ("case", "omega_0", "eta"), [("RR", 9, 0.2), ("SS", 20, 0.2), ("NR", 25, 0.6)]
)
def test_a_settled_state_is_that_of_the_closed_form(case, omega_0, eta):
    p = Parameters.named("reference").replace(omega_0=float(omega_0), eta=eta)
    exact = State.one(analytic.solution(p, case).state)
    found, _ = joints.advance(exact, p, 8.0, 1e-3)
    # What the first step's places leave decays as slowly as RR does: exp(-8 c / (1 + 2 j)).
    assert found.omega_c == pytest.approx(exact.omega_c, rel=1e-9)
    # The depth that rigid contacts keep by default is a lever: RR would seem to slip by 1e-6 rad/s.
    for slip in ("slip_x", "slip_y", "slip_z"):
        assert getattr(found, slip) == pytest.approx(getattr(exact, slip), abs=1e-7)
