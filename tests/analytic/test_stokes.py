"""Stokes' drag and (10) are one law: a ball with the drag (10) sinks at Stokes' speed."""

from __future__ import annotations

import math

import pytest

from analytic import stokes
from model import Parameters


@pytest.mark.parametrize(("nu_f", "rho_f", "rho_b", "r"), [(1e-6, 998.0, 7850.0, 5e-3), (1e-3, 1260.0, 2500.0, 8e-3)])
def test_the_balance_of_forces(nu_f: float, rho_f: float, rho_b: float, r: float) -> None:
    speed = stokes.sinking_speed(nu_f=nu_f, rho_f=rho_f, rho_b=rho_b, r=r, gravity=9.81)
    p = Parameters.from_fluid(nu_f=nu_f, rho_f=rho_f, rho_b=rho_b, r=r, R=5 * r, mu=0.2, eta=0.2, gravity=9.81)
    assert p.m * p.c * speed == pytest.approx(p.m * p.g, rel=1e-14)
    assert 6 * math.pi * nu_f * rho_f * r * speed == pytest.approx(p.m * p.g, rel=1e-14)
