"""Other engines with a free body, as far as they are installed, reach the order that they have."""

import importlib
from contextlib import closing

import numpy as np
import pytest

from compare.adapters.scene import upright
from compare.bench import cases, run
from compare.bench.case import TOLERANCE
from compare.bench.runner import EngineProcess
from model.kinematics import rotated
from tests.exact_cases import CASES

OWN = "compare.adapters"


@pytest.mark.parametrize("name", ["dart", "drake", "pybullet", "rapier", "sapien"])
def test_an_engine_reaches_its_order(name):
    """Semi-implicit steps are leapfrog where a sphere slides; a block that friction can hold rests."""
    try:
        importlib.import_module(f"{OWN}.{name}")
    except ImportError as error:
        pytest.skip(str(error))
    steps = {"sphere-slips-down": None, "block-rests": None, "cylinder": (4e-3, 2e-3)}
    with closing(EngineProcess(f"{OWN}.{name}:best")) as trial:
        falls, rests, turns = (trial.result(CASES[case], those) for case, those in steps.items())
    assert falls.error < 2e-3  # substeps of Rapier, and single precision
    assert rests.passed
    assert turns.error < 2e-4 or turns.engine.precision == "f32"  # a wall that moves along is a cylinder to (omega h)^2
    assert turns.error < 5e-3
    assert run(CASES["lands"], f"{OWN}.{name}:defaults", steps=(2e-3,)).error < 2


@pytest.fixture(scope="module")
def mujoco():
    with closing(EngineProcess(f"{OWN}.mujoco_free:best")) as trial:
        yield trial


def test_under_coulombs_law_mujoco_is_right_in_every_case(mujoco):
    """At 2 ms by half of what passes at 1 ms."""
    for case in cases():
        assert mujoco.result(case, (2e-3,)).error < TOLERANCE / 2, case.name


def test_what_spins_and_rolls_has_second_order(mujoco):
    """A disc on its rim, whose gyroscopic moments are as large as those of its contact (1.6e-2 without these)."""
    coarse, fine = mujoco.result(CASES["rolling-disc"], (4e-3, 2e-3)).errors
    assert coarse < 1e-3
    assert coarse / fine > 3.5


def test_landings_are_late_by_a_part_of_a_step(mujoco):
    """A blow that lifts the ball off its floor: else gravity has it for up to a step and a half before, 2e-2."""
    assert max(mujoco.result(CASES["hits-the-wall"], (1.09e-3, 1e-3, 0.93e-3)).errors) < 2.5e-3


@pytest.mark.slow  # they compile for minutes where they haven't run before
@pytest.mark.parametrize("engine", ["newton:xpbd", "mujoco_warp:best"])
def test_engines_on_warp(engine):
    pytest.importorskip("warp")
    assert run(CASES["sphere-slips-down"], f"{OWN}.{engine}", steps=(2e-3,), limit=600).passed


@pytest.mark.parametrize("normal", [(0, 0, 1), (0, 0, -1), (-1, 0, 0), (0.6, 0, 0.8), (0, -0.6, -0.8)])
def test_turns(normal):
    assert rotated(np.array(upright(normal)), np.array([0, 0, 1])) == pytest.approx(normal)
