"""Any engine makes a trajectory of the ball in the vessel: the same task in, the same trajectory out."""

import sys

import numpy as np
import pytest

import analytic
from compare.kit.engines import ENGINES
from compare.kit.tasks import Task, carry_out, store
from docs.studies.states import LANDING, STATES
from model import InputError, Parameters, State
from model.drag import LAWS
from model.kinematics import to_world
from tests.commands import refused, told
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
NEWCOMERS = [name for name in ALL if name.endswith("-defaults")]
BEST = [name for name in ALL if name not in NEWCOMERS]


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
    with pytest.raises(InputError, match=words):
        store(task_of(name, REFERENCE, State(), 1.0, 0.5), tmp_path / "run.h5")
    assert not list(tmp_path.iterdir())


TOLD = [name for name in BEST if name not in ("rapier", "sapien")]
"""Whose adapters tell what contacts carry."""


@engines(*TOLD)
def test_errors_of_a_stationary_state_fall_with_the_step(name):
    """Slipping on both, theory's speed and forces to first order."""
    state = STATES[2]
    p, x, truth = state.p, state.solution.x, state.solution
    errors = []
    for step in (4e-3, 2e-3):
        seen = run(name, p, x, 10.0, step, interval=1.0)
        assert seen.complete
        assert seen.cases[-1] is state.case
        forces = np.concatenate([seen.force_A[-1] - truth.force_A, seen.force_B[-1] - truth.force_B])
        errors.append([seen.omega_c[-1] / x[2] - 1, np.abs(forces).max() / (p.m * p.g)])
    assert np.abs(errors[1]).max() < 2e-3
    assert np.abs(errors[1]) == pytest.approx(np.abs(errors[0]) / 2, rel=0.2, abs=2e-4)


@engines(*TOLD)
def test_a_ball_lands_slips_and_sticks_when_it_should(name):
    step, x0 = 1e-3, LANDING.x0
    truth = analytic.simulate(REFERENCE, x0, 0.3)
    seen = run(name, REFERENCE, x0, 0.3, step)
    assert seen.events.to_case.tolist() == truth.events.to_case.tolist()
    assert abs(seen.events.time[0] - truth.events.time[0]) < 2 * step


@engines("rapier", "sapien")
def test_cases_are_told_by_gaps_and_slip_where_forces_are_not_known(name):
    seen = run(name, REFERENCE, LANDING.x0, 0.5, 1e-3)
    assert np.isnan(seen.force_A).all()
    assert np.isnan(seen.force_B).all()
    assert seen.header.settings["cases_by"] == "gaps and slip"
    assert {case.name for case in seen.cases[:40]} == {"NS"}
    assert seen.cases[-1].name == "RR"


@engines(*ALL)
@pytest.mark.parametrize("law", LAWS)
def test_free_flight_obeys_newton_and_the_law_of_drag(name, law):
    p = REFERENCE.replace(drag=law, nu_f=1e-5, omega_0=12.0, c=0.3)
    x0, lasts, step = (0.02, 0.3, 4.0, 1.0, -2.0, 3.0, 0.02, -0.1), 0.05, 1e-4
    truth, seen = analytic.simulate(p, x0, lasts), run(name, p, x0, lasts, step)
    assert seen.time[-1] == pytest.approx(lasts)
    assert {case.name for case in seen.cases} == {"NN"}
    # The step is of first order: a speed lacks up to what a step of the largest acceleration gives.
    slowed = resistance(np.hypot(x0[1], p.R * p.omega_0), p) * np.hypot(x0[1], p.R * p.omega_0)
    speed = step * np.hypot(p.g, slowed)
    spin = 2 * speed / p.r + np.linalg.norm(to_world(x0, 0.0, p).spin) * lasts * speed / p.R  # keeps its way in space
    allowed = [lasts * speed, 2 * speed, 2 * speed / (p.R - x0[6]), spin, spin, spin, lasts * speed, 2 * speed]
    assert (np.abs(seen.x[-1] - truth.x[-1]) <= allowed).all()
    assert seen.theta[-1] == pytest.approx(truth.theta[-1], abs=lasts * speed / p.R)


@engines(*NEWCOMERS)
def test_a_newcomer_goes_round_and_round(name):
    seen = run(name, REFERENCE.replace(omega_0=12.0), (0, 0, 11.0, 0, 0, 0), 2.0, 2e-3, interval=0.02)
    assert seen.complete
    assert np.all(np.diff(seen.theta) > 0)  # the azimuth isn't wrapped
    assert seen.theta[-1] == pytest.approx(np.trapezoid(seen.omega_c, seen.time), rel=0.02)


@engines(*BEST)
def test_a_ball_may_cross_the_axis(name):
    seen = run(name, REFERENCE, (0.02, 0.0, 0.0, 0.0, 0.0, 0.0, 0.03, 3.0), 0.03, 1e-3)
    assert seen.complete
    assert seen.h.max() > 0.9 * REFERENCE.R
    assert seen.h[-1] < seen.h.max() - 0.01


@engines("drake")
def test_a_step_that_cannot_be_solved_is_the_run_s_failure(name, monkeypatch):
    import compare.adapters.drake as adapter

    monkeypatch.setattr(adapter, "STIFFNESS", 1e12)
    seen = run(name, REFERENCE.replace(omega_0=25.0), State(), 8.0, 4e-3)
    assert "could not go on (MultibodyPlant's discrete update solver failed to converge" in seen.header.failure
    assert 0 < len(seen.time) < 2000


@pytest.mark.parametrize(("name", "package"), [("pybullet", "pybullet"), ("dart-defaults", "dartpy")])
def test_what_is_not_installed_says_what_to_install(name, package, monkeypatch, capsys):
    monkeypatch.setattr("compare.adapters.free.version", lambda package: "not installed")
    monkeypatch.setitem(sys.modules, f"compare.adapters.{name.partition('-')[0]}", None)
    said = refused(capsys, f"simulate --engine {name} --time 0.05")
    assert said == f"dualball: error: {package} is not installed: pip install {package}\n"


def test_claims_can_be_judged_with_any_engine(monkeypatch, capsys):
    asked = []
    monkeypatch.setattr("compare.validation.validate", lambda output, **given: asked.append(given["engine"]) or [])
    for words in ("--engine drake", ""):
        assert told(capsys, f"validate {words} --workers 0 --json") == "[]"
    assert asked == [ENGINES["drake"], None]
