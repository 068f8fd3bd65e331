import math

import numpy as np
import pytest

from model import Flow, InputError

FLOWS = [
    Flow.steady(-3.0),
    Flow.ramp(10, 30, 5, t_start=1),
    Flow.staircase([1, 4, 2], hold=2),
    Flow.sampled([0, 1, 4], [5, 6, 0]),
]


def test_values() -> None:
    steady, ramp, stairs, sampled = FLOWS
    np.testing.assert_array_equal(steady([0, 1e9]), [-3, -3])
    np.testing.assert_allclose(ramp([0, 1, 3.5, 6, 100]), [10, 10, 20, 30, 30], rtol=1e-15)
    np.testing.assert_array_equal(stairs([0, 1.99, 2, 4, 99]), [1, 1, 4, 2, 2])
    np.testing.assert_allclose(sampled([0, 0.5, 1, 2.5, 4, 9]), [5, 5.5, 6, 3, 0, 0], atol=1e-15)
    assert steady.is_steady
    assert not any(flow.is_steady for flow in FLOWS[1:])
    np.testing.assert_array_equal(stairs.breakpoints, [2, 4])
    np.testing.assert_array_equal(ramp.breakpoints, [1, 6])


@pytest.mark.parametrize("flow", FLOWS, ids=lambda f: f.kind)
def test_a_mapping_holds_all_of_it(flow: Flow) -> None:
    back = Flow.from_mapping(flow.to_mapping())
    t = np.linspace(0, 10, 101)
    np.testing.assert_array_equal(back(t), flow(t))
    assert back.kind == flow.kind


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (lambda: Flow.steady(math.nan), "omega_0 of flow sample 0 = nan rad s-1 must be finite"),
        (lambda: Flow.ramp(1, 2, 0), "duration = 0 s"),
        (lambda: Flow.ramp(1, 2, 1, t_start=-1), "t_start = -1 s"),
        (lambda: Flow.ramp(1, math.inf, 1), "must be finite"),
        (lambda: Flow.staircase([1, 2], 0), "hold = 0 s"),
        (lambda: Flow.staircase([], 1), "at least one"),
        (lambda: Flow.sampled([0, 1], [1]), "2 times but 1"),
        (lambda: Flow.sampled([0, 1, 1], [1, 2, 3]), "times must increase, but sample 2 is at 1 s"),
        (lambda: Flow.sampled([0, math.nan], [1, 2]), "time of flow sample 1"),
        (lambda: Flow.sampled([0, 1], [1, "two"]), "omega_0"),
        (lambda: Flow.from_mapping({"kind": "steady"}), "not a flow"),
        (lambda: Flow.from_mapping({"kind": "x", "start": [0], "value": [1], "slope": [math.nan]}), "not a flow"),
    ],
)
def test_bad_flows(make, says: str) -> None:
    with pytest.raises(InputError, match=says):
        make()
