"""What a real fluid does beside the drag (9): its torque on the ball, and more drag near a wall.

The paper leaves both out, and so do the simulators; added mass and the pressure of the swirl are in
`bifurcation.diagram`. They are estimates of how far to trust the model for a ball alone.

A sphere that turns at w relative to the fluid feels the torque -j m r^2 k(|w|) w. By Stokes k = 8
pi rho_f nu_f r/(j m), which (10) makes 4 c/(3 j), whatever the ball. From Re = |w| r^2/nu_f = 8 on
the torque of a boundary layer is larger, 6.45/sqrt(Re) + 32.1/Re instead of 16 pi/Re, in units of
rho_f w^2 r^5/2 (S. C. R. Dennis, S. N. Singh and D. B. Ingham, J. Fluid Mech. 101 (1980) 257). The
fluid itself turns at omega_0."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from analytic.bifurcation import diagram as bifurcation
from analytic.mechanics import drag, roots
from model import Parameters
from model.arrays import Array, Real

LIMIT = 0.01
"""Relative shift of omega_c above which the model doesn't hold: a usual flowmeter's accuracy."""
AT_A_WALL = 1.7009
"""Stokes' drag on a sphere that touches a plane wall, relative to that far from it (M. E. O'Neill,
Chem. Eng. Sci. 23 (1968) 1293: at rest in a slow shear flow). A ball that touches two walls feels
more."""
_SHARES = 2001
"""Values of the free force of RR among which that of least friction is looked for."""


@dataclass(frozen=True)
class Rolling:
    """Steady rolling at both points of a ball whose spin the fluid's torque brakes."""

    omega_c: float
    """rad s-1"""
    shift: float
    """omega_c/omega_0 - 1: 0 without the torque."""
    Re: float
    """|w| r^2/nu_f of the spin."""
    friction: float
    """Friction that it takes, divided by what there is; beyond 1 the ball can't roll so."""


def torque_rate(spin: Real, p: Parameters, layer: bool = True) -> Real:
    """Rate k, s-1, at which the fluid's torque brakes a spin, rad s-1; by Stokes unless `layer`.

    p.fluid_torque takes the place of both if it is given."""
    if p.fluid_torque:
        return p.fluid_torque + 0.0 * spin
    stokes, Re = 4 * p.c / (3 * p.j), spin * p.r**2 / p.nu_f if p.nu_f else 0.0 * spin
    # The two torques are equal at Re = 8, to 0.2 %.
    return stokes * np.maximum(1.0, layer * (6.45 * np.sqrt(Re) + 32.1) / (16 * math.pi))


def rolling(p: Parameters, layer: bool = True) -> Rolling:
    """The stationary RR at p.omega_0 with the fluid's torque; nan where omega_0 or c is 0.

    In RR the spin is (R omega_c/r, -R omega_c/r, 0) (4). It is steady if friction balances the
    torque, A_z = -j k m R omega_c and B_z = -j k m (R omega_c + r omega_0), and drag these, j k (2
    R omega_c + r omega_0) = c(|w|) R (omega_0 - omega_c): omega_c < omega_0 at first order in the
    torque."""
    if p.omega_0 == 0 or p.c == 0:
        return Rolling(*(math.nan,) * 4)
    flow, per = abs(p.omega_0), p.R / p.r

    def relative_spin(omega_c: Real) -> Real:
        return np.hypot(per * omega_c, per * omega_c + flow)

    def excess_friction(omega_c: Array) -> Array:
        lag = p.R * (flow - omega_c)
        k = torque_rate(relative_spin(omega_c), p, layer)
        held = p.j * k * (2 * p.R * omega_c + p.r * flow)
        return np.asarray(held - drag.coefficient(lag, p) * lag)

    omega_c = float(roots.sign_change(excess_friction, -flow * max(1.0, p.r / (2 * p.R)), flow))
    turn = relative_spin(omega_c)
    k, Re = float(torque_rate(turn, p, layer)), turn * p.r**2 / p.nu_f if p.nu_f else math.nan
    u = p.R * omega_c**2 / p.g
    z_A, z_B = (p.j * k * (p.R * omega_c + more) / p.g for more in (0.0, p.r * flow))
    # As in `rolling_forces`, with B_y = s m g free, but with forces along the orbit that differ.
    s = np.linspace(0.0, min(p.j * u, 1.0), _SHARES)
    with np.errstate(divide="ignore", invalid="ignore"):
        floor = np.hypot(p.j * u - s, z_A) / (p.mu * (1 - s))
        wall = np.hypot(s, z_B) / (p.eta * ((1 + p.j) * u - s))
    friction = float(np.nanmin(np.maximum(floor, wall))) if p.mu and p.eta else math.inf
    return Rolling(math.copysign(1.0, p.omega_0) * omega_c, omega_c / flow - 1, float(Re), friction)


def model_error(p: Parameters) -> float:
    """Relative error of the model, without the fluid's torque and inertia; 0 if it isn't known.

    By Stokes, by the boundary layer, or by the fluid's inertia, whichever is the largest."""
    if not (p.nu_f or p.fluid_torque):
        return 0.0
    shifts = [rolling(p, layer).shift for layer in (False, True)]
    return float(np.nanmax(np.abs([*shifts, *bifurcation.inertia_shifts(p).values(), 0.0])))
