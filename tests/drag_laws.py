"""The laws of drag written out from the coefficient of a sphere, for tests of the code's own."""

import numpy as np
import numpy.typing as npt

from model import Parameters
from model.arrays import Array
from model.drag import LAWS

BALL = Parameters.named("steel-in-water").replace(drag="stokes")
BY_LAW = {law: BALL.replace(drag=law, C_D=0.6) for law in LAWS}
"""A ball in water at up to Re = 1e5 by each law."""


def resistance(speed: npt.ArrayLike, p: Parameters) -> Array:
    """c(|w|) = c C_D Re/24, s-1, at speeds > 0."""
    Re = 2 * p.r * np.asarray(speed) / p.nu_f
    wake = 24 / Re * (1 + 0.15 * Re**0.687)
    C_D = {
        "stokes": 24 / Re,
        "schiller-naumann": np.maximum(wake, 0.44),
        "quadratic": np.full_like(Re, p.C_D),
    }
    return np.asarray(p.c * C_D[p.drag] * Re / 24)
