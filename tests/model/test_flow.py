"""Flows have the values that they are made of, and files, pieces and steps that are wrong are
refused by name."""

import numpy as np
import pytest

from model import Flow, InputError, Parameters, State, StorageError
from model.time_scales import check_timestep

FLOWS = [
    Flow.steady(-3.0),
    Flow.ramp(10, 30, 5, t_start=1),
    Flow.staircase([1, 4, 2], hold=2),
    Flow.sampled([0, 1, 4], [5, 6, 0]),
    Flow.sine(10, 2, 0.5, phase=0.3),
    Flow.sines(10, [(2, 0.5, 0), (1, 3, 1.5)]),
]


def test_values():
    steady, ramp, stairs, sampled, sine, sines = FLOWS
    np.testing.assert_array_equal(steady([0, 1e9]), [-3, -3])
    np.testing.assert_allclose(ramp([0, 1, 3.5, 6, 100]), [10, 10, 20, 30, 30], rtol=1e-15)
    np.testing.assert_array_equal(stairs([0, 1.99, 2, 4, 99]), [1, 1, 4, 2, 2])
    np.testing.assert_allclose(sampled([0, 0.5, 1, 2.5, 4, 9]), [5, 5.5, 6, 3, 0, 0], atol=1e-15)
    expected = [10 + 2 * np.sin(0.3), 10 + 2 * np.cos(0.3)]
    np.testing.assert_allclose(sine([0, 0.5]), expected, rtol=1e-15)
    assert sines(0.25) == pytest.approx(10 + np.sqrt(2) + np.sin(1.5 * np.pi + 1.5), rel=1e-15)
    np.testing.assert_array_equal(sines.line([0.1, 0.2]), [10, 10])
    assert sine(np.zeros((2, 3))).shape == (2, 3)
    assert steady.is_steady
    assert not any(flow.is_steady for flow in FLOWS[1:])
    np.testing.assert_array_equal(stairs.knots(np.inf), [2, 4])
    np.testing.assert_array_equal(ramp.knots(6.5), [1, 6])


@pytest.mark.parametrize("flow", FLOWS, ids=lambda f: f.kind)
def test_a_mapping_holds_all_of_it(flow):
    back = Flow.from_mapping(flow.to_mapping())
    t = np.linspace(0, 10, 101)
    np.testing.assert_array_equal(back(t), flow(t))
    assert back.kind == flow.kind


@pytest.mark.parametrize(
    "text",
    [
        "0,5\n1,6\n4,0\n",
        "t in s; omega_0\n0; 5\n1; 6\n4; 0\n\n",
        "# measured\n0 5\n1\t6  # late\n4 0",
        '\ufeff"time","omega_0"\r\n"0","5"\r\n1,6\r\n4,0\r\n',
        "omega_0 [rad/s],time (s)\n5,0\n6,1\n0,4\n",
        "no;ω₀ in rad/s;t;valve\n1;5,0;0,0;open\n2;6;1;open\n3;0,0;4,00;shut\n",
        "0,0\t5,0\n1\t6\n4,0\t0\n",
    ],
    ids=[
        "plain",
        "semicolons",
        "white space",
        "spreadsheet",
        "turned round",
        "decimal commas",
        "tabs",
    ],
)
def test_measured(tmp_path, text):
    (tmp_path / "flow.csv").write_text(text, "utf-8")
    measured, sampled = Flow.from_csv(tmp_path / "flow.csv").to_mapping(), FLOWS[3].to_mapping()
    assert measured == sampled | {"kind": "measured"}


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("time,omega_0\n0,5\n1,\n", "line 3: omega_0 = '' must be a number in rad s-1"),
        ("0,5\n,6\n", "line 2: time = '' must be a number in s"),
        ("0,5\n1\n", "line 2: needs two values, time and omega_0, but has 1"),
        ("0,5\n2,6\n1,7\n", "line 3: times must increase, but 1 s comes after 2 s"),
        ("0,5\n1,nan\n", "line 2: omega_0 = nan rad s-1 must be finite"),
        (
            "# logger\n0,5\n1,6\n2,6\n2.5,5\n13,6\n",
            "line 6: a gap of 10.5 s from t = 2.5 s on; usual are 1 s, and",
        ),
        ("time,omega_0\n", "no line with a time"),
        ("time (ms),rpm\n0,5\n", r"line 1: 'time \(ms\)': time must be in s, not in ms"),
        ("time,omega_0 [rpm]\n0,5\n", "line 1: .* must be in rad/s, not in rpm"),
        ("time,speed\n0,5\n", "line 1: no column is called omega_0; there are 'time', 'speed'"),
        ("t,omega_0,time\n0,5,0\n", "line 1: time is given twice"),
        ("no,time,omega_0\n0,5\n", "line 2: needs 3 values, as the head, but has 2"),
        (
            "time,omega_0\n0,5,12,3\n",
            "line 2: .* but has 4; with decimal commas, separate them by semicolons",
        ),
    ],
)
def test_bad_measurements(tmp_path, text, says):
    (tmp_path / "flow.csv").write_text(text)
    with pytest.raises(InputError, match=says):
        Flow.from_csv(tmp_path / "flow.csv")


def test_a_gap_that_is_accepted(tmp_path):
    path = tmp_path / "flow.csv"
    path.write_text("0,5\n1,6\n2,7\n13,18\n")
    assert Flow.from_csv(path, longest_interval=11)(12.0) == 17
    with pytest.raises(InputError, match=r"line 4: .*longest_interval = 10.5 s"):
        Flow.from_csv(path, longest_interval=10.5)
    with pytest.raises(InputError, match="longest_interval = 0 s is out of range"):
        Flow.from_csv(path, longest_interval=0)
    path.write_text("0,5\n1,6\n2,7\n11,16\n")
    assert Flow.from_csv(path)(10.0) == 15  # nine usual intervals


def test_unreadable_measurements(tmp_path):
    with pytest.raises(StorageError, match=r"cannot read .*: No such file"):
        Flow.from_csv(tmp_path / "flow.csv")
    (tmp_path / "flow.csv").write_bytes(b"\xff\x00\x01")
    with pytest.raises(InputError, match="not a text file"):
        Flow.from_csv(tmp_path / "flow.csv")


P = Parameters.named("reference")
SLOW = {"omega_0": 1.0, "c": 1.0}
QUADRATIC = {"drag": "quadratic", "nu_f": 1e-6}


@pytest.mark.parametrize(
    ("changes", "flow", "x0", "shortest", "name"),
    [
        (SLOW, None, State(), np.sqrt(P.R / P.g), r"sqrt\(R/g\)"),
        (SLOW | {"omega_0": -25.0}, None, State(), 1 / 50, r"1/\(2 omega_0\)"),
        (SLOW, Flow.ramp(1.0, 50.0, 0.05), State(), 1 / 100, r"1/\(2 omega_0\)"),
        (
            SLOW,
            Flow.ramp(1.0, 50.0, 0.05, t_start=0.1),
            State(),
            np.sqrt(P.R / P.g),
            r"sqrt\(R/g\)",
        ),
        (SLOW, Flow.sine(10.0, 40.0, 1.0), State(), 1 / 100, r"1/\(2 omega_0\)"),
        (SLOW, Flow.sine(1.0, 1.0, 20.0), State(), 1 / (40 * np.pi), r"1/\(2 pi f\)"),
        (SLOW, None, State(omega_c=-50.0), 1 / 100, r"1/\(2 omega_c\)"),
        (SLOW, None, State(omega_c=-50.0, h=P.R / 2), 1 / 50, r"1/\(2 omega_c\)"),
        (SLOW, None, State(y=P.R, v_y=-2.0), P.R, r"\(R\+y\)/v_y"),
        (SLOW, None, State(v_h=2.0), P.R / 2, "R/v_h"),
        (SLOW, None, State(slip_z=-1e5), 1e-3, "100/slip_z"),
        (SLOW | {"c": 100.0}, None, State(), 1 / 100, "1/c"),
        (SLOW | {"c": 0.0}, None, State(), np.sqrt(P.R / P.g), r"sqrt\(R/g\)"),
        (SLOW | QUADRATIC, None, State(), 1 / (2 * 700 * P.R), r"1/\(2 c\(R omega_0\)\)"),
    ],
)
def test_a_step_too_large_for_the_problem_is_refused(changes, flow, x0, shortest, name):
    p = P.replace(**changes)
    problem = p, flow or Flow.steady(p.omega_0), 0.1, lambda speed: 700 * speed, x0
    words = rf"with .* it must be <= .* s, half of {name}, the shortest "
    with pytest.raises(InputError, match=words):
        check_timestep(0.501 * shortest, *problem)
    check_timestep(0.499 * shortest, *problem)
