"""Uncertainties that hold what they promise, on series whose truth is known."""

import json

import numpy as np
import pytest

from compare.kit.fits import value_and_slope, zero_and_slope
from compare.kit.statistics import correlation_length, plain, window_mean
from model import InputError

T = np.linspace(0, 10, 1001)


def test_uncertainty_of_correlated_noise_covers_the_truth() -> None:
    """AR(1) noise with coefficient a has correlation length (1 + a)/(1 - a)."""
    rng, a, n, runs = np.random.default_rng(2), 0.9, 4000, 200
    noise = rng.normal(size=(runs, n))
    for k in range(1, n):
        noise[:, k] += a * noise[:, k - 1]
    time = np.arange(n)
    means = [window_mean(time, row) for row in noise]
    assert np.mean([correlation_length(row) for row in noise]) == pytest.approx((1 + a) / (1 - a), rel=0.1)
    # 95 % of a normal distribution lies within two standard deviations; 200 draws scatter by 1.5 %.
    assert np.mean([abs(m.value) <= 2 * m.uncertainty for m in means]) >= 0.95 - 3 * 0.015


def test_a_constant_is_certain_and_uncertainty_covers_the_rest_of_an_exponential_approach() -> None:
    mean = window_mean(T, np.full_like(T, 13.7))
    assert mean.value == pytest.approx(13.7, rel=1e-15)
    assert mean.uncertainty <= 2 * np.finfo(float).eps * 13.7
    for rate in (0.1, 0.3, 1.0, 3.0):
        mean = window_mean(T, 2.0 + 1e-3 * np.exp(-rate * T))
        assert abs(mean.value - 2.0) <= 2 * mean.uncertainty


def test_bad_input() -> None:
    with pytest.raises(InputError, match="6 samples or more"):
        window_mean([0, 1], [1, 2])
    with pytest.raises(InputError, match="finite"):
        window_mean(np.arange(6), [1, 2, 3, 4, 5, np.nan])


def test_a_polynomial_gives_back_value_and_slope() -> None:
    x = np.linspace(2.0, 2.3, 17)
    value, slope = value_and_slope(x, np.stack([3 * x**3 - x, np.full(17, 5.0)], axis=-1), 3, 2.1)
    np.testing.assert_allclose(value, [3 * 2.1**3 - 2.1, 5.0], rtol=1e-12)
    np.testing.assert_allclose(slope, [9 * 2.1**2 - 1, 0.0], rtol=1e-10, atol=1e-10)


@pytest.mark.parametrize("power", [1.3, 1.687, 2.0])
def test_a_bent_line_has_its_zero_and_slope(power: float) -> None:
    x, noise = np.array([0.0, 1.1, 1.5, 2.0]), np.full(4, 1e-6)
    zero, slope = zero_and_slope(x, x**power - 1.7, noise)
    assert abs(zero.value - 1.7 ** (1 / power)) < 3 * zero.uncertainty < 0.03
    assert abs(slope.value - power * zero.value ** (power - 1)) < 3 * slope.uncertainty < 0.06
    assert np.isnan([m.value for m in zero_and_slope(x, x + 1, noise)]).all()


def test_numbers_of_numpy_are_written_as_json() -> None:
    data = {"a": (np.int64(3), np.float64(np.nan), np.True_), "b": [np.float64(0.5), "text", None]}
    assert json.loads(json.dumps(plain(data))) == {"a": [3, None, True], "b": [0.5, "text", None]}
