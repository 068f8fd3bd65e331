"""Each deviation from what holds at every instant is noticed by itself."""

from dataclasses import replace

import numpy as np
import pytest

from compare.subjects.motion.measure import laws
from model import Case, Parameters
from tests.measured import motion

P = Parameters.named("high-wall-friction")
SAMPLES = 50


def sliding(**changes):
    """A ball that slips at both points as (14) and (15) say, with some of it changed."""
    rng = np.random.default_rng(4)
    w_x, w_y, w_z = slips = rng.uniform(5.0, 20.0, (3, SAMPLES))
    normal = P.m * P.g * rng.uniform(0.5, 1.0, SAMPLES)
    (A_x, A_z), (B_y, B_z) = (
        -coefficient * normal * np.stack([first, second]) / np.hypot(first, second)
        for coefficient, first, second in ((P.mu, w_z, -w_x), (P.eta, -w_z, w_y))
    )
    made = dict(zip(("slip_x", "slip_y", "slip_z"), slips, strict=True))
    made |= {"force_A": np.stack([A_x, normal, A_z], axis=-1), "force_B": np.stack([normal, B_y, B_z], axis=-1)}
    return replace(motion(P, np.linspace(0.0, 1.0, SAMPLES), case=Case.SS, **made), **changes)


def values(run):
    return {(law.split(":")[0], contact): value for (_, law, contact), value in laws.deviations([run]).items()}


def test_every_deviation_is_measured_and_there_is_none_where_the_laws_hold():
    run, ratio, law = sliding(), "friction over normal force", "(14), (15)"
    worst = values(run)
    for contact, coefficient in (("A", P.mu), ("B", P.eta)):
        assert worst[law, contact] <= laws.ROUNDING
        assert worst[ratio, contact] == pytest.approx(coefficient, rel=laws.ROUNDING)
        # Nothing rolls: that law has no samples.
        assert np.isnan(worst["where it rolls it doesn't slip", contact])
    assert values(sliding(force_B=run.force_B * [1.0, 1.01, 1.01]))[ratio, "B"] == pytest.approx(1.01 * P.eta)
    assert values(sliding(force_A=run.force_A * [0.99, 1.0, 0.99]))[ratio, "A"] == pytest.approx(0.99 * P.mu)
    turned = run.force_B.copy()
    turned[7, 1] *= -1.0  # one sample is enough
    assert values(sliding(force_B=turned))[law, "B"] > 0.1 * P.eta
    gaps = values(sliding(gap_A=np.full(SAMPLES, 1e-3 * P.R)))
    assert gaps["where it is closed there is no gap", "A"] == pytest.approx(1e-3)
    slow = sliding(slip_z=1e-3 * run.slip_z, slip_x=1e-3 * run.slip_x, case=np.full(SAMPLES, Case.RS, np.int8))
    assert values(slow)["where it rolls it doesn't slip", "A"] > 0
