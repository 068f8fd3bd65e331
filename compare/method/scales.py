"""Natural sizes, by which deviations and uncertainties are divided, of a parameter set."""

import math

from model import Parameters
from model.drag import STOKES


def time_unit(p: Parameters) -> float:
    """sqrt(R/g), s: the time in which the ball falls by half of R."""
    return math.sqrt(p.R / p.g)


def dragged_speed(p: Parameters) -> float:
    """A speed relative to the fluid, m s-1, at which drag is at least about the weight.

    By Stokes' law g/c. With another law that is far too fast: at most 20 sqrt(g R) then."""
    return p.g / p.c if p.drag == STOKES else min(p.g / p.c, 20 * math.sqrt(p.g * p.R))


def rotation_scale(p: Parameters) -> float:
    """Natural size of a rate of rotation, rad s-1: omega_0, in a fluid at rest 1/`time_unit`."""
    return abs(p.omega_0) or 1 / time_unit(p)


def slip_scale(p: Parameters) -> float:
    """Natural size of a slip, rad s-1: of the spin of a ball that rolls round."""
    return rotation_scale(p) * (p.R / p.r)


def weight(p: Parameters) -> float:
    """m g, N: natural size of a force."""
    return p.m * p.g


def slip_unit(p: Parameters) -> float:
    """The rate of slip in rad s-2 that a force as large as the weight makes at a contact."""
    return p.g / p.r * (1 + p.j) / p.j
