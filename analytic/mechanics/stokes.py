"""Terminal speed of a sphere under Stokes' drag, with which (10) must agree."""

from __future__ import annotations

import math


def sinking_speed(*, nu_f: float, rho_f: float, rho_b: float, r: float, gravity: float) -> float:
    """Terminal speed v in m/s of a sphere in a fluid at rest: weight less buoyancy is 6 pi rho_f nu_f r v.

    nu_f : kinematic viscosity of the fluid, m2 s-1; rho_f, rho_b : densities of fluid and sphere, kg m-3;
    r : radius, m; gravity : m s-2, in vacuum
    """
    heavier = 4 / 3 * math.pi * r**3 * (rho_b - rho_f) * gravity
    return heavier / (6 * math.pi * rho_f * nu_f * r)
