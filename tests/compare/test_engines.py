"""Other engines, as far as they are installed, reach their order with a free body, and make
trajectories in the vessel.

The same task in, the same trajectory out; what can't be had, ends, hangs or gives no numbers is
said in a line."""

import dataclasses
import re
import sys
import warnings
from concurrent.futures import ProcessPoolExecutor
from contextlib import closing
from functools import partial

import numpy as np
import pytest

import analytic
import mjsim
from compare.bench import cases, run
from compare.bench.case import TOLERANCE
from compare.bench.runner import EngineProcess
from compare.campaign.tasks import Task, carry_out, store
from compare.engines.adapters import siconos
from compare.engines.adapters.scene import upright
from compare.engines.adapters.vessel import Settings, Vessel
from compare.engines.study import ENGINES
from compare.validation import validate
from docs.studies.states import LANDING, STATES
from mjsim import RigidContacts
from model import Flow, InputError, Parameters, State
from model.drag import LAWS
from model.kinematics import rotated, to_world
from tests.commands import refused, told
from tests.drag_laws import resistance
from tests.exact_cases import CASES
from tests.random_motions import random_start

# Drake loads IPython, which leaves files open.
pytestmark = [
    pytest.mark.filterwarnings("ignore::ResourceWarning"),
    pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning"),
]

P = Parameters.named("reference")


def engines(*names):
    """Parameters of a test; those that aren't installed are skipped, and say so."""
    marks = {
        name: pytest.mark.skipif(bool(ENGINES[name].missing), reason=ENGINES[name].missing)
        for name in names
    }
    return pytest.mark.parametrize(
        "name", [pytest.param(name, marks=mark) for name, mark in marks.items()]
    )


ALL = [name for name, each in ENGINES.items() if each.needs]
BEST = [name for name in ALL if not name.endswith("-defaults")]


def task_of(name, p, x0, t_end, step, interval=None):
    settings = ENGINES[name].at(step, p)
    given = {"x0": x0, "t_end": t_end, "sample_interval": interval or step}
    return Task(engine=name, parameters=p, settings=settings, **given)


def simulated(*given, **more):
    return carry_out(task_of(*given, **more))


STEPPING = [name for name, each in ENGINES.items() if "timestep" in each.options]


@pytest.mark.parametrize("name", STEPPING)
def test_a_step_too_long_for_the_problem_is_refused_by_all(tmp_path, name):
    """By the same rule, before anything is written, and whether or not the engine is installed."""
    for orbit, least, of in ((0.0, "0.0208", "omega_0"), (100.0, "0.0025", "omega_c")):
        words = f"must be <= {least} s, half of 1/(2 {of}), the shortest time of the problem"
        with pytest.raises(InputError, match=re.escape(words)):
            store(task_of(name, P, State(omega_c=orbit), 1.0, 0.03), tmp_path / "run.h5")
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
        seen = simulated(name, p, x, 10.0, step, interval=1.0)
        assert seen.complete
        assert seen.cases[-1] is state.case
        assert seen.theta[-1] == pytest.approx(10.0 * x[2], rel=0.02)  # the azimuth isn't wrapped
        A, B = seen.force_A[-1] - truth.force_A, seen.force_B[-1] - truth.force_B
        errors.append([seen.omega_c[-1] / x[2] - 1, np.abs([A, B]).max() / (p.m * p.g)])
    assert np.abs(errors[1]).max() < 2e-3
    assert np.abs(errors[1]) == pytest.approx(np.abs(errors[0]) / 2, rel=0.2, abs=2e-4)


@engines(*BEST)
def test_a_ball_lands_slips_and_sticks_when_it_should(name):
    """Where forces are not known cases are told by gaps and slip."""
    step, told = 1e-3, name in TOLD
    lasts = 0.3 if told else 0.5
    truth = analytic.simulate(P, LANDING.x0, lasts)
    seen = simulated(name, P, LANDING.x0, lasts, step)
    assert seen.header.settings["cases_by"] == ("contact forces" if told else "gaps and slip")
    if told:
        assert seen.events.to_case.tolist() == truth.events.to_case.tolist()
        assert abs(seen.events.time[0] - truth.events.time[0]) < 2 * step
    else:
        assert np.isnan([seen.force_A, seen.force_B]).all()
        assert {case.name for case in seen.cases[:40]} == {"NS"}
        assert seen.cases[-1].name == "RR"


@engines(*ALL)
@pytest.mark.parametrize("law", LAWS)
def test_free_flight_obeys_newton_and_the_law_of_drag(name, law):
    p = P.replace(drag=law, nu_f=1e-5, omega_0=12.0, c=0.3)
    x0, lasts, step = (0.02, 0.3, 4.0, 1.0, -2.0, 3.0, 0.02, -0.1), 0.05, 1e-4
    truth, seen = analytic.simulate(p, x0, lasts), simulated(name, p, x0, lasts, step)
    assert seen.time[-1] == pytest.approx(lasts)
    assert {case.name for case in seen.cases} == {"NN"}
    # The step is of first order: a speed lacks up to what a step of the largest acceleration gives.
    slowed = resistance(np.hypot(x0[1], p.R * p.omega_0), p) * np.hypot(x0[1], p.R * p.omega_0)
    speed = step * np.hypot(p.g, slowed)
    # The spin keeps its way in space.
    spin = 2 * speed / p.r + np.linalg.norm(to_world(x0, 0.0, p).spin) * lasts * speed / p.R
    place = [lasts * speed, 2 * speed]
    allowed = [*place, 2 * speed / (p.R - x0[6]), spin, spin, spin, *place]
    assert (np.abs(seen.x[-1] - truth.x[-1]) <= allowed).all()
    assert seen.theta[-1] == pytest.approx(truth.theta[-1], abs=lasts * speed / p.R)


@engines(*BEST)
def test_a_ball_may_cross_the_axis(name):
    seen = simulated(name, P, (0.02, 0.0, 0.0, 0.0, 0.0, 0.0, 0.03, 3.0), 0.03, 1e-3)
    assert seen.complete
    assert seen.h.max() > 0.9 * P.R
    assert seen.h[-1] < seen.h.max() - 0.01


@engines("drake")
def test_a_step_that_cannot_be_solved_is_the_run_s_failure(name, monkeypatch):
    import compare.engines.adapters.drake as adapter

    monkeypatch.setattr(adapter, "STIFFNESS", 1e12)
    seen = simulated(name, P.replace(omega_0=25.0), State(), 8.0, 4e-3)
    said = "could not go on (MultibodyPlant's discrete update solver failed to converge"
    assert said in seen.header.failure
    assert 0 < len(seen.time) < 2000


LACKING = "siconos is not installed"
ABSENT = (
    ("pybullet", "", "pybullet is not installed: pip install pybullet"),
    ("dart-defaults", "", "dartpy is not installed: pip install dartpy"),
    ("siconos", "", f"{LACKING}: on Debian or Ubuntu, apt-get install python3-siconos"),
    ("siconos", "absent", f"{LACKING} for absent, which DUALBALL_SICONOS_PYTHON names"),
)


@pytest.mark.parametrize(("name", "named", "says"), ABSENT)
def test_what_is_not_installed_says_what_to_do(name, named, says, here, monkeypatch, capsys):
    asked = ["simulate", "sweep --vary eta=0.1,0.2", "attractors", "validate"]
    if ENGINES[name].missing:  # the league loads engines in processes of their own
        asked.append("league")
    monkeypatch.setattr("compare.engines.adapters.free.version", lambda package: "not installed")
    if name != "siconos":
        monkeypatch.setitem(sys.modules, f"compare.engines.adapters.{name.partition('-')[0]}", None)
    monkeypatch.setattr(siconos, "locate", siconos.locate.__wrapped__)  # which remembers nothing
    monkeypatch.setattr(siconos.shutil, "which", lambda *_, **__: None)
    monkeypatch.setenv("DUALBALL_SICONOS_PYTHON", named)
    assert ENGINES[name].missing == says
    assert "not installed" in ENGINES[name].versions.values()
    with pytest.raises(InputError, match=says):
        validate(here / "results", engine=ENGINES[name])
    for command in asked:
        assert says in refused(capsys, f"{command} --engine {name}")
    assert not [*here.iterdir()]


def test_the_torque_of_the_fluid_is_refused_by_all_that_leave_it_out(here, capsys):
    """In the words of the command, and before anything is written."""
    leave = [name for name, each in ENGINES.items() if not each.torque and not each.missing]
    assert {"event", "mujoco-defaults"} <= {*leave}
    for name in leave:
        for command in ("simulate", "sweep --vary eta=0.1,0.2", "attractors --random 1 --time 1"):
            said = refused(capsys, f"{command} --engine {name} --fluid-torque 0.0763")
            if (command, name) != ("attractors --random 1 --time 1", "event"):
                assert f"fluid_torque = 0.0763 s-1: {name} leaves it out; mujoco, " in said
    assert not [*here.iterdir()]
    p = P.replace(mu=1.0, eta=1.0, fluid_torque=10 / 3)
    for name in (name for name, each in ENGINES.items() if each.torque):
        run = carry_out(task_of(name, p, State(omega_c=0.2 * p.omega_0), 0.5, 2e-3))
        assert run.omega_c[-1] == pytest.approx(0.2 * p.omega_0, rel=2e-2)


def test_claims_can_be_judged_with_any_engine(monkeypatch, capsys):
    asked = []
    monkeypatch.setattr(
        "compare.validation.validate", lambda output, **given: asked.append(given["engine"]) or []
    )
    for words in ("--engine mujoco-free", ""):
        assert told(capsys, f"validate {words} --workers 0 --json") == "[]"
    assert asked == [ENGINES["mujoco-free"], None]


OWN = "compare.engines.adapters"


@pytest.mark.parametrize("name", ["dart", "drake", "pybullet", "rapier", "sapien"])
def test_an_engine_reaches_its_order(name):
    """Semi-implicit steps are leapfrog where a sphere slides; a block that friction can hold
    rests."""
    pytest.importorskip(f"{OWN}.{name}")
    steps = {"sphere-slips-down": None, "block-rests": None, "cylinder": (4e-3, 2e-3)}
    with closing(EngineProcess(f"{OWN}.{name}:best")) as trial:
        falls, rests, turns = (trial.result(CASES[case], those) for case, those in steps.items())
    assert falls.error < 2e-3  # substeps of Rapier, and single precision
    assert rests.passed
    # A wall that moves along is a cylinder to (omega h)^2.
    assert turns.error < 2e-4 or turns.engine.precision == "f32"
    assert turns.error < 5e-3
    assert run(CASES["lands"], f"{OWN}.{name}:defaults", steps=(2e-3,)).error < 2


def test_under_coulombs_law_mujoco_is_right_in_every_case():
    """At 2 ms by half of what passes at 1 ms."""
    with closing(EngineProcess(f"{OWN}.mujoco_free:best")) as mujoco:
        for case in cases():
            assert mujoco.result(case, (2e-3,)).error < TOLERANCE / 2, case.name
        # A disc on its rim, whose gyroscopic moments are as large as those of its contact: 1.6e-2
        # without these.
        coarse, fine = mujoco.result(CASES["rolling-disc"], (4e-3, 2e-3)).errors
        assert coarse < 1e-3
        assert coarse / fine > 3.5
        # An impact that lifts the ball off its floor: else gravity has it for up to a step and a
        # half before, 2e-2.
        assert max(mujoco.result(CASES["hits-the-wall"], (1.09e-3, 1e-3, 0.93e-3)).errors) < 2.5e-3


def test_mujocos_default_cone_is_the_pyramid_that_cases_must_notice():
    """To what it is wrong by along an axis. And its pairs have the two frictions of a surface
    whatever else is set of them."""
    pyramid = "a pyramid with its edges along the axes"
    with closing(EngineProcess(f"{OWN}.mujoco_free:defaults")) as mujoco:
        along = mujoco.result(CASES["box-stops"], (1e-3,)).error
        for name in ("slides-at-15", "slides-at-30", "slides-at-45"):
            case = CASES[name]
            weak = dataclasses.replace(case, exact=case.wrong[pyramid])
            assert mujoco.result(case, (1e-3,)).error > 3 * along
            assert mujoco.result(weak, (1e-3,)).error < along
    assert run(CASES["anisotropic"], "compare.bench.joints:on_joints", (1e-3,)).error < 0.05


@pytest.mark.slow  # they compile for minutes where they haven't run before
@pytest.mark.parametrize("engine", ["newton:xpbd", "mujoco_warp:best"])
def test_engines_on_warp(engine):
    pytest.importorskip("warp")
    assert run(CASES["sphere-slips-down"], f"{OWN}.{engine}", steps=(2e-3,), limit=600).passed


NORMALS = (0, 0, 1), (0, 0, -1), (-1, 0, 0), (0.6, 0, 0.8), (0, -0.6, -0.8)


@pytest.mark.parametrize("normal", NORMALS)
def test_turns(normal):
    assert rotated(np.array(upright(normal)), np.array([0, 0, 1])) == pytest.approx(normal)


def test_a_python_without_its_libraries_is_the_person_s_error(monkeypatch):
    monkeypatch.setattr(siconos, "locate", lambda named: (sys.executable, "4.4.0"))
    says = r"siconos ended \(ModuleNotFoundError: No module named 'siconos"
    with pytest.raises(InputError, match=says):
        siconos.best.build(Vessel.of(P, State(), Flow.steady(1.0)), 1e-3)


FAILS = {
    "import os; os.abort()": "ended (exit code -6)",
    "raise ValueError('too much')": "ended (ValueError: too much)",
    """print('{"error": "RuntimeError: it"}')""": "could not go on (RuntimeError: it)",
    "import time; time.sleep(60)": "gave no answer for 2 s",
    "while True: print(STATE, flush=True), input(), print([], flush=True), input()": "diverged",
}


@pytest.mark.parametrize(("program", "says"), FAILS.items())
def test_a_process_that_fails_is_the_run_s_failure(program, says, tmp_path, monkeypatch):
    """Whatever it does in the first step; it is gone after that."""
    script, started, popen = tmp_path / "program.py", [], siconos.subprocess.Popen
    state = "STATE = '[[0, NaN, 0], [0, 0, 0], [0, 0, 0]]'"
    begin = "for _ in range(2):\n    input()\n    print('null', flush=True)\ninput()"
    script.write_text(f"{state}\n{begin}\n{program}\n")
    monkeypatch.setattr(siconos, "PROGRAM", script)
    monkeypatch.setattr(siconos, "TIMEOUT", 2)  # a loaded machine takes half a second to begin
    monkeypatch.setattr(siconos, "locate", lambda named: (sys.executable, "4.4.0"))
    monkeypatch.setattr(
        siconos.subprocess, "Popen", lambda *a, **b: started.append(popen(*a, **b)) or started[-1]
    )
    task = Task(engine="siconos", parameters=P, x0=(0.0,) * 6, t_end=0.01, settings=Settings())
    run = carry_out(task)
    assert run.header.failure.startswith(says)
    assert run.header.versions["siconos"] == "4.4.0"
    assert not run.complete
    assert all(each.returncode is not None for each in started)


AGREE = 0.005  # difference of omega_c at the end, in units of omega_0, up to which simulators agree


def ends(seed, step=1.25e-4):
    """omega_c/omega_0 after a run of 2 s by each simulator, and by theory if the ball rolls on as
    long as it can."""
    p, x0 = random_start(seed, on_wall=True)
    # Of contacts that chatter: what comes of it is to be seen.
    warnings.simplefilter("ignore", UserWarning)
    simulators = (
        analytic.simulate,
        partial(analytic.simulate, method="time-stepping", timestep=step),
        partial(mjsim.simulate, settings=RigidContacts(timestep=step)),
        partial(analytic.simulate, leave_rolling="infeasible"),
    )
    return [
        float(simulate(p, x0, 2.0, sample_interval=0.02).omega_c[-1]) / p.omega_0
        for simulate in simulators
    ]


@pytest.mark.slow
def test_three_simulators_agree_on_random_sets():
    """But for two, at any step: undisturbed, a ball may roll on where a slight slip would grow
    (theory, section 7)."""
    with ProcessPoolExecutor() as pool:
        found = np.array(list(pool.map(ends, range(250))))
    (differ,) = np.nonzero(np.ptp(found[:, :3], axis=1) > AGREE)
    assert len(differ) <= 2, differ
    # it is a question of rolling on
    assert (np.abs(found[differ, 3] - found[differ, 0]) > AGREE).all()
