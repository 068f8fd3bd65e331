"""A top is found between samples, to the change of the acceleration within one."""

import analytic
from compare.kit.levels import Level
from compare.kit.sets import sets
from compare.subjects.flowmeter import measure

P = sets(Level.QUICK)["thick-fluid"]


def test_first_top_lies_between_samples():
    """Claims predict with it, too: they would not notice if it were wrong."""
    run, fine = (
        analytic.simulate(P, [0.05, 1.0, 0, 0, 0, 0, 0.01, 0], 0.5, sample_interval=interval)
        for interval in (0.01, 1e-4)
    )
    top = measure.first_top(run)
    assert abs(top.value - float(fine.y.max())) <= top.uncertainty < P.g * 0.01**2 * P.c * 0.01
