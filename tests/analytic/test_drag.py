"""Each law of drag has the coefficient of its source."""

import math

import numpy as np
import pytest

from analytic.mechanics import drag
from model import Parameters
from model.drag import LAWS
from tests.drag_laws import BALL, BY_LAW, resistance


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("Re", [1e-6, 0.3, 50.0, 800.0, 985.0, 1200.0, 1e5])
def test_the_drag_is_that_of_its_coefficient(law, Re):
    p = BY_LAW[law]
    speed = Re * p.nu_f / (2 * p.r)
    force = p.m * float(resistance(speed, p)) * speed
    assert p.m * drag.coefficient(speed, p) * speed == pytest.approx(force, rel=1e-12)
    assert drag.reynolds(speed, p) == pytest.approx(Re, rel=1e-14)
    assert drag.speed_of(force / p.m, p) == pytest.approx(speed, rel=1e-12)
    step = 1e-100  # derivatives by complex steps, exact
    whole = np.complex128(speed + 1j * step)
    assert drag.slope(speed, p) == pytest.approx((drag.coefficient(whole, p) * whole).imag / step, rel=1e-12)


def test_the_drag_is_half_the_dynamic_pressure_times_area_and_coefficient():
    """And the speed relative to the fluid has three components; Stokes' law is what it was."""
    for zero in (0.0, np.array([0.0])):
        assert drag.speed(zero + 2.0, zero + 3.0, zero + 6.0) == 7.0
    assert drag.coefficient(0.3, BALL) == drag.rate(0.3, drag.law(BALL)) == BALL.c
    assert drag.speed_of(0.3, BALL) == 0.3 / BALL.c
    assert math.isnan(drag.reynolds(0.3, Parameters.named("reference")))
    p, rho_f, speed = BY_LAW["quadratic"], 998.2, 0.7
    force = rho_f / 2 * speed**2 * math.pi * p.r**2 * p.C_D
    assert p.m * drag.coefficient(speed, p) * speed == pytest.approx(force, rel=1e-13)


def test_a_law_without_a_formula_is_not_taken_for_another(monkeypatch):
    monkeypatch.setattr("model.drag.LAWS", (*LAWS, "oseen"))
    with pytest.raises(KeyError, match="oseen"):
        drag.coefficient(0.3, BALL.replace(drag="oseen"))
