"""Slip directions (8), as tests need them."""

import numpy as np
import numpy.typing as npt

from model import Parameters
from model.arrays import Array
from model.kinematics import slip_velocities


def slip_directions(x: npt.ArrayLike, p: Parameters) -> tuple[Array, Array]:
    """Slip directions alpha, beta (8), each (...), rad: alpha = atan2(w_x, w_z), beta = atan2(w_y, w_z)."""
    (A_x, _, A_z), (_, B_y, B_z) = (np.moveaxis(v, -1, 0) for v in slip_velocities(x, p))
    return np.arctan2(-A_z, A_x), np.arctan2(B_z, -B_y)
