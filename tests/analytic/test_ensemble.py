"""Many runs at once are the same runs one by one; and the step settles and chooses where it once did not."""

import math
import os
import subprocess
import sys

import numpy as np
import pytest

from analytic import Settings, simulate, simulate_many, stationary_solutions
from analytic.simulation.compiling import compiled, forget_stale
from model import Case, Flow, InputError, Parameters, State

P = Parameters.named("reference")
STEPPING = Settings(method="time-stepping", timestep=1e-3)


def groups(mu: float, eta: float, j: float, kappa: float, Omega_0: float) -> Parameters:
    unit = math.sqrt(P.R / P.g)
    return P.replace(mu=mu, eta=eta, j=j, c=kappa / unit, omega_0=Omega_0 / unit)


def test_the_same_runs_as_one_by_one():
    """To the bit: one step serves both."""
    sets = [P.replace(omega_0=omega_0) for omega_0 in (12.0, 25.0, 35.0)]
    x0s = np.array([[0.0, 0, 9, 1, 2, 3, 0, 0], [0.01, 0, 30, 1, 2, 3, 0.02, 0], [0.02, 0.1, 5, 0, 0, 0, 0, 0]])
    flows = [Flow.steady(12.0), Flow.ramp(25.0, 15.0, 0.1, 0.1), Flow.staircase([35.0, 20.0], 0.15)]
    many = simulate_many(sets, x0s, 0.3, flows, STEPPING, sample_interval=0.1, threads=2)
    assert many.failure == ("", "", "")
    for k, (p, x0, flow) in enumerate(zip(sets, x0s, flows, strict=True)):
        # At the ends of the flow's pieces a step ends, too.
        one = simulate(p, x0, 0.3, flow, STEPPING, sample_interval=0.1)
        np.testing.assert_array_equal(many.time, one.time)
        np.testing.assert_array_equal(many.x[k], one.x)
        np.testing.assert_array_equal(many.case[k, 1:], one.case[1:])


def test_landings_and_quiet():
    """A ball that falls once has landed once, and a run ends when nothing has landed for the time asked for."""
    p = P.replace(omega_0=0.0, c=0.0)
    fall = math.sqrt(2 * 0.01 / p.g)
    many = simulate_many(p, [0.01, 0, 0, 0, 0, 0, 0.02, 0], 1.0, settings=STEPPING, sample_interval=0.1, quiet=0.25)
    assert many.landings.tolist() == [[0, 1, *[0] * 9]]
    assert fall + 0.25 < many.end[0] <= fall + 0.25 + 0.1
    np.testing.assert_array_equal(many.x[0, -1], many.x[0, 4])


def test_a_run_that_fails_leaves_the_others_alone():
    """One that falls until its drag is too strong for the step, as in the tests of time stepping."""
    fast = P.replace(drag="quadratic", nu_f=1e-6, c=10 / P.R * 24e-6 / (2 * P.r * P.C_D), omega_0=0.0)
    x0, settings = State(y=1.0, h=P.R / 2), Settings(timestep=0.4 * math.sqrt(P.R / P.g))
    many = simulate_many([P, fast], x0, 0.2, settings=settings, sample_interval=0.1)
    assert many.failure[0] == ""
    assert "a shorter step" in many.failure[1]
    assert np.all(np.isfinite(many.x[0]))
    assert np.all(np.isnan(many.x[1, 1:]))


@pytest.mark.parametrize(
    ("sets", "x0s", "message"),
    [
        ([P, P], np.zeros((3, 6)), "2 parameter sets, 3 starts"),
        ([P], [[-0.01, 0, 0, 0, 0, 0]], "y = -0.01 m"),
        ([P], [[0, 0, 0, 0, 0, 0, 0.06, 0]], "h = 0.06 m"),
    ],
)
def test_bad_input(sets, x0s, message):
    with pytest.raises(InputError, match=message):
        simulate_many(sets, x0s, 0.1)


JAMMED = [
    groups(1.23, 0.17, 0.61, 0.12, 2.1),
    groups(1.2277, 0.1721, 0.611, 0.1198, 2.099),
    groups(1.7222, 0.0388, 0.482, 0.1099, 2.635),
]


@pytest.mark.parametrize("p", JAMMED)
def test_settles_where_rolling_can_jam(p):
    """mu > 1, above omega_01, at the default step: forces could hold RR for longer, but the ball comes to SS."""
    (slipping,) = [s for s in stationary_solutions(p) if s.case is Case.SS and s.exists and s.stable]
    x0s = np.zeros((4, 8))
    x0s[:, 2] = p.omega_0 * np.array([-0.5, 0.3, 0.9, 1.5])
    x0s[::2, 3:6] = p.omega_0
    x0s[2:, 0] = 0.01
    many = simulate_many(p, x0s, 80 / p.c, sample_interval=80 / p.c)
    assert many.failure == ("",) * 4
    assert set(many.case[:, -1]) == {Case.SS}
    # 80/c of settling at a rate of c/(2 (1 + 2j)) leave exp(-17).
    np.testing.assert_allclose(many.x[:, -1, 2], slipping.x[2], rtol=1e-6)


def test_settles_on_random_sets():
    """Friction up to 3, any drag and inertia: every step of 200 runs converges."""
    rng = np.random.default_rng(5)
    low, high = np.log([0.03, 0.03, 0.1, 0.01, 0.3]), np.log([3.0, 2.0, 2 / 3, 3.0, 6.0])
    sets = [groups(*each) for each in np.exp(rng.uniform(low, high, (200, 5)))]
    x0s = np.zeros((200, 8))
    x0s[:, 0] = rng.uniform(0, P.R, 200) * rng.integers(0, 2, 200)
    x0s[:, 2] = [p.omega_0 * rng.uniform(-2, 2) for p in sets]
    x0s[:, 3:6] = [p.omega_0 * p.R / p.r * rng.uniform(-2, 2, 3) for p in sets]
    many = simulate_many(sets, x0s, 0.5, sample_interval=0.5)
    assert many.failure == ("",) * 200


SCRIPT = """
import sys, numpy as np
from analytic import Settings, simulate_many
from model import Parameters
p = Parameters.named("reference")
sets = [p.replace(omega_0=12.0), p.replace(omega_0=25.0, eta=0.6), p.replace(mu=1.5, omega_0=40.0)]
x0 = [0.005, 0, 20, 10, 20, 30, 0.001, 0]
np.save(sys.argv[1], simulate_many(sets, x0, 0.05, settings=Settings(timestep=2e-4), sample_interval=0.05).x)
"""


def test_compiled_and_not_are_the_same(tmp_path):
    """Without numba the source itself runs; results may differ by rounding only."""
    pytest.importorskip("numba")
    results = []
    for switch in ("0", "1"):
        file = tmp_path / f"{switch}.npy"
        subprocess.run([sys.executable, "-c", SCRIPT, file], check=True, env=os.environ | {"NUMBA_DISABLE_JIT": switch})
        results.append(np.load(file))
    np.testing.assert_allclose(results[0], results[1], rtol=1e-9, atol=1e-12)


def test_what_was_compiled_from_other_sources_is_deleted(tmp_path):
    source, kept = tmp_path / "called.py", tmp_path / "stepping.step-1.py311.nbi"
    for text, compiles_again in (("a", True), ("a", False), ("b", True)):
        source.write_text(text)
        kept.write_text("")
        forget_stale(tmp_path, [str(source)])
        assert kept.exists() is not compiles_again


def test_functions_are_compiled_or_run_as_they_are():
    assert compiled(lambda x: x + 1)(1) == 2
