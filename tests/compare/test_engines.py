"""Engines of the extra ``engines``: the same task in, the same trajectory out."""

import json
import math
import sys

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import analytic
from compare.commands import cli
from compare.kit.engines import ENGINES, NEWCOMER
from compare.kit.tasks import Task, carry_out, store
from docs.studies.states import HITTING, LANDING, STATES
from model import InputError, Parameters, State
from model.drag import LAWS
from model.kinematics import Motion as World
from model.kinematics import from_world, to_world
from tests.drag_laws import resistance

# Drake loads IPython, which leaves files open.
pytestmark = [
    pytest.mark.filterwarnings("ignore::ResourceWarning"),
    pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning"),
]

REFERENCE = Parameters.named("reference")


def engines(*names):
    """Parameters of a test; those that aren't installed are skipped, and say so."""
    marks = {name: pytest.mark.skipif(bool(ENGINES[name].missing), reason=ENGINES[name].missing) for name in names}
    return pytest.mark.parametrize("name", [pytest.param(name, marks=mark) for name, mark in marks.items()])


ALL = [name for name, each in ENGINES.items() if each.needs]
BEST = [name for name in ALL if ENGINES[name].as_it_comes != name]
NEWCOMERS = [name for name in ALL if name not in BEST]


def task_of(name, p, x0, t_end, step, interval=None):
    settings = ENGINES[name].at(step, p)
    return Task(engine=name, parameters=p, x0=x0, t_end=t_end, settings=settings, sample_interval=interval or step)


def run(*given, **more):
    (trajectory,) = carry_out([task_of(*given, **more)])
    return trajectory


@pytest.mark.parametrize("name", [name for name, each in ENGINES.items() if "timestep" in each.options])
def test_a_step_too_long_for_the_problem_is_refused_by_all(tmp_path, name):
    """By the same rule, before anything is written, and whether or not the engine is installed."""
    words = r"timestep = 0\.5 s is out of range: must be <= 0\.0357 s, half of sqrt\(R/g\), the shortest time of"
    if name == NEWCOMER.name:
        words = r"timestep = 0\.5 s is too large for the contact settings: .* allow at most 0\.009 s"
    with pytest.raises(InputError, match=words):
        store(task_of(name, REFERENCE, State(), 1.0, 0.5), tmp_path / "run.h5")
    assert not list(tmp_path.iterdir())


@engines(*BEST)
def test_a_stationary_state_is_that_of_theory(name):
    """PyBullet's to round-off; a ball of Drake sinks in by its load over the stiffness, and creeps at up to v_s.

    Sinking in shortens its lever. Friction works against creep, as drag does: m c R^2 omega_c d omega_c.
    """
    state = STATES[2]
    settings, p, x = ENGINES[name].at(4e-3, state.p), state.p, state.solution.x
    tolerance = 1e-12
    if name == "drake":
        load = max(state.solution.force_A[1], state.solution.force_B[0])
        friction = p.mu * state.solution.force_A[1] + p.eta * state.solution.force_B[0]
        tolerance += 2 * load / settings.stiffness / p.r + friction * settings.stiction / (
            p.m * p.c * (p.R * x[2]) ** 2
        )
    start = x * [1, 1, 0.98, 0.98, 0.98, 0.98, 1, 1]
    ended = run(name, p, start, state.forgets, 4e-3, interval=1.0)
    # What is left of the start after `forgets` is round-off, which the settled ball goes on making.
    rest = 0.02 * math.exp(-float(ended.time[-1]) / state.forgets * -math.log(np.finfo(float).eps))
    assert ended.complete
    assert abs(ended.omega_c[-1] / x[2] - 1) < tolerance + 1e4 * rest
    assert ended.cases[-1] is state.case
    assert ended.force_A[-1, 1] + ended.force_B[-1, 1] == pytest.approx(p.m * p.g, rel=1e-6)


@engines(*BEST)
def test_a_ball_lands_slips_and_sticks_when_it_should(name):
    step, x0 = 1e-3, LANDING.x0
    truth = analytic.simulate(REFERENCE, x0, 0.3)
    seen = run(name, REFERENCE, x0, 0.3, step)
    assert seen.events.to_case.tolist() == truth.events.to_case.tolist()
    assert abs(seen.events.time[0] - truth.events.time[0]) < 2 * step


@engines(*ALL)
@pytest.mark.parametrize("law", LAWS)
def test_free_flight_obeys_newton_and_the_law_of_drag(name, law):
    p = REFERENCE.replace(drag=law, nu_f=1e-5, omega_0=12.0, c=0.3)
    x0 = (0.02, 0.3, 4.0, 1.0, -2.0, 3.0, 0.02, -0.1)
    lasts, step = 0.05, 1e-4
    begin = to_world(x0, 0.0, p)

    def motion(_, now):
        w = now[3:] - p.omega_0 * np.array([-now[1], now[0], 0.0])
        return np.concatenate([now[3:], -resistance(np.linalg.norm(w), p) * w - [0.0, 0.0, p.g]])

    ended = solve_ivp(motion, (0, lasts), np.concatenate([begin.position, begin.velocity]), rtol=1e-9, atol=1e-12)
    truth, theta = from_world(World(ended.y[:3, -1], ended.y[3:, -1], begin.spin), p)
    seen = run(name, p, x0, lasts, step)
    assert seen.time[-1] == pytest.approx(lasts)
    assert {case.name for case in seen.cases} == {"NN"}
    # The step is of first order: a speed lacks up to what a step of the largest acceleration gives.
    speed = np.abs(np.diff(ended.y[3:], axis=1) / np.diff(ended.t)).max() * step
    assert seen.theta[-1] == pytest.approx(float(theta), abs=lasts * speed / p.R)
    assert seen.y[-1] == pytest.approx(truth.y, abs=lasts * speed)
    assert seen.h[-1] == pytest.approx(truth.h, abs=lasts * speed)
    assert seen.v_y[-1] == pytest.approx(truth.v_y, abs=2 * speed)
    assert seen.omega_c[-1] == pytest.approx(truth.omega_c, abs=2 * speed / (p.R - truth.h))
    turned = np.linalg.norm(begin.spin) * lasts * speed / p.R  # the spin keeps its direction in space
    for slip in ("slip_x", "slip_y", "slip_z"):
        assert getattr(seen, slip)[-1] == pytest.approx(getattr(truth, slip), abs=2 * speed / p.r + turned)


@engines(*NEWCOMERS)
def test_a_newcomer_goes_round_and_round(name):
    seen = run(name, REFERENCE.replace(omega_0=12.0), (0, 0, 11.0, 0, 0, 0), 2.0, 2e-3, interval=0.02)
    assert seen.complete
    assert np.all(np.diff(seen.theta) > 0)  # the azimuth isn't wrapped
    assert seen.theta[-1] == pytest.approx(np.trapezoid(seen.omega_c, seen.time), rel=0.02)


@engines(*BEST)
def test_polar_coordinates_end_at_the_axis(name):
    seen = run(name, REFERENCE, (0.02, 0.0, 0.0, 0.0, 0.0, 0.0, 0.03, 3.0), 0.05, 1e-3)
    assert "axis" in seen.header.failure
    assert not seen.complete
    assert 0 < len(seen.time) < 20


@engines("drake")
def test_a_step_that_cannot_be_solved_is_the_run_s_failure(name):
    settings = ENGINES[name].settings(timestep=1e-3, stiffness=1e12, stiction=1e-12, dissipation=10.0)
    (seen,) = carry_out([Task(engine=name, parameters=REFERENCE, x0=HITTING.x0, t_end=0.1, settings=settings)])
    assert "converge" in seen.header.failure


@pytest.mark.parametrize(("name", "package"), [("pybullet", "pybullet"), ("drake-defaults", "drake")])
def test_what_is_not_installed_says_what_to_install(name, package, monkeypatch, capsys):
    for module in ("pybullet", "pydrake", "pydrake.all"):
        monkeypatch.setitem(sys.modules, module, None)
    assert cli.main(["simulate", "--engine", name, "--time", "0.05"]) == 2
    error = capsys.readouterr().err
    assert error == f"dualball: error: {package} is not installed: pip install {package}\n"


@pytest.mark.parametrize("name", ALL)
def test_settings_out_of_range_are_refused(name):
    settings = ENGINES[name].settings
    with pytest.raises(InputError, match="timestep = -1 s"):
        settings(timestep=-1.0)
    with pytest.raises(InputError, match="coordinates = 'polar'"):
        settings(coordinates="polar")


def test_claims_can_be_judged_with_any_engine(monkeypatch, capsys):
    asked = []
    monkeypatch.setattr("compare.validation.validate", lambda output, **given: asked.append(given["engine"]) or [])
    assert cli.main(["validate", "--engine", "drake", "--workers", "0", "--json"]) == 0
    assert cli.main(["validate", "--workers", "0", "--json"]) == 0
    assert asked == [ENGINES["drake"], None]
    assert json.loads(capsys.readouterr().out.splitlines()[0]) == []
