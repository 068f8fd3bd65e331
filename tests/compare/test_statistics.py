"""Uncertainties hold what they promise, on series whose truth is known."""

import json

import numpy as np
import pytest

from compare.kit.fits import value_and_slope, zero_and_slope
from compare.kit.statistics import plain


def test_a_polynomial_gives_back_value_and_slope():
    x = np.linspace(2.0, 2.3, 17)
    value, slope = value_and_slope(x, np.stack([3 * x**3 - x, np.full(17, 5.0)], axis=-1), 3, 2.1)
    np.testing.assert_allclose(value, [3 * 2.1**3 - 2.1, 5.0], rtol=1e-12)
    np.testing.assert_allclose(slope, [9 * 2.1**2 - 1, 0.0], rtol=1e-10, atol=1e-10)


@pytest.mark.parametrize("power", [1.3, 1.687, 2.0])
def test_a_bent_line_has_its_zero_and_slope(power):
    x, noise = np.array([0.0, 1.1, 1.5, 2.0]), np.full(4, 1e-6)
    zero, slope = zero_and_slope(x, x**power - 1.7, noise)
    assert abs(zero.value - 1.7 ** (1 / power)) < 3 * zero.uncertainty < 0.03
    assert abs(slope.value - power * zero.value ** (power - 1)) < 3 * slope.uncertainty < 0.06
    assert np.isnan([m.value for m in zero_and_slope(x, x + 1, noise)]).all()


def test_numbers_of_numpy_are_written_as_json():
    data = {"a": (np.int64(3), np.float64(np.nan), np.True_), "b": [np.float64(0.5), "text", None]}
    assert json.loads(json.dumps(plain(data))) == {"a": [3, None, True], "b": [0.5, "text", None]}
