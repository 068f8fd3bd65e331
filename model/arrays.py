"""The array types of the project's annotations."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
Complex = npt.NDArray[np.complex128]
Real = Any
"""A float, or an array of any shape: for formulas that take both."""
