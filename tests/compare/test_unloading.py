"""Predictions of unloading are as sure as they say, and a top is found between samples."""

import pytest

import analytic
from compare.judge import forget
from compare.kit.levels import Level
from compare.kit.record import Records
from compare.kit.sets import sets
from compare.subjects.flowmeter import measure
from compare.subjects.flowmeter.claims import CLAIMS
from tests.measured import thresholds

NAME = "thick-fluid"
P = sets(Level.QUICK)[NAME]
UNLOADING = [claim for claim in CLAIMS if "unloading" in claim.protocols]


@pytest.fixture(scope="module")
def records(lab):
    known = thresholds(NAME, P, "omega_02")
    return known + Records.of(measure.unloading(lab, {NAME: P}, known))


def test_predictions_are_as_sure_as_they_say(records, monkeypatch):
    def predicted():
        forget()
        bearings = [b for claim in UNLOADING for b in claim.bearings if b.quantity != "case"]
        return [b.predict(m) for b in bearings for m in records.select("unloading", b.quantity, b.when)]

    usual = predicted()
    monkeypatch.setattr("compare.subjects.flowmeter.claims.RTOL", 1e-11)
    for one, finer in zip(usual, predicted(), strict=True):
        assert abs(one.value - finer.value) <= one.uncertainty


def test_first_top_lies_between_samples():
    run = analytic.simulate(P, [0.05, 1.0, 0, 0, 0, 0, 0.01, 0], 0.5, sample_interval=0.01)
    fine = analytic.simulate(P, [0.05, 1.0, 0, 0, 0, 0, 0.01, 0], 0.5, sample_interval=1e-4)
    # Between samples 10 ms apart only the change of the acceleration is left out, c per second of it.
    top = measure.first_top(run)
    assert abs(top.value - float(fine.y.max())) <= top.uncertainty < P.g * 0.01**2 * P.c * 0.01
