"""Settings of an MJCF file reach the engine as MuJoCo itself reads them, and bad files are refused by name."""

import dataclasses
import json
import re

import mujoco
import pytest

from compare.adapters.mujoco_free import Bodies
from compare.bench import native
from compare.bench.native import Pair
from model import InputError
from tests.commands import told
from tests.exact_cases import CASES

BALL = '<body name="ball"><freejoint/><geom name="ball" type="sphere" size="0.01"/></body>'
WALL = '<geom name="wall" type="box" size="0.1 1 1" pos="0.11 0 0" solref="0.03 1"/>'
FLOOR = '<geom name="floor" type="plane" size="1 1 1"/>'


def mjcf(world, rest=""):
    return f"<mujoco>{rest}<worldbody>{world}</worldbody></mujoco>"


@pytest.fixture
def read(tmp_path):
    """Settings read from a file with this text."""

    def read(text):
        (tmp_path / "scene.xml").write_text(text)
        return native.read(tmp_path / "scene.xml")

    return read


def test_the_league_takes_the_settings_of_a_file(tmp_path, capsys, monkeypatch):
    """A block on a slope creeps as MuJoCo comes and holds with a cone; the step is that of the file."""
    monkeypatch.setattr("compare.bench.league.cases", lambda: [CASES["block-rests"], CASES["rolls-on-both"]])
    (tmp_path / "mine.xml").write_text(mjcf(FLOOR + BALL, '<option timestep="0.001" cone="elliptic" impratio="100"/>'))
    words = f"league --settings {tmp_path / 'mine.xml'} --engine mujoco-defaults -o {tmp_path} --json"
    found = json.loads(told(capsys, words))["engines"]
    assert list(found) == ["mine", "mujoco-defaults"]
    mine, usual = ({result["case"]: result for result in results}["block-rests"] for results in found.values())
    assert mine["steps"] == [0.001]
    assert "no wall" in mine["engine"]["note"]
    assert mine["errors"][-1] < usual["errors"][-1] / 30


def test_settings_come_through_to_the_engine(read):
    text = (
        '<option integrator="implicitfast" cone="elliptic" solver="CG" impratio="7" iterations="33" tolerance="1e-5" '
        'noslip_iterations="2"/>'
    )
    A, B = Pair(solref=(0.005, 0.8), margin=1e-4), Pair(solimp=(0.2, 0.3, 0.01, 0.4, 3))
    given = dataclasses.replace(read(mjcf(FLOOR + WALL + BALL, text)), A=A, B=B)
    body = Bodies("mine", "", tune=given.tune)
    body.build(CASES["rolls-on-both"], 0.0015)
    option = body.model.opt
    assert (option.timestep, option.tolerance, option.noslip_iterations) == (0.0015, 1e-5, 2)
    assert (option.impratio, option.iterations, option.cone) == (7.0, 33, mujoco.mjtCone.mjCONE_ELLIPTIC)
    assert (option.integrator, option.solver) == (mujoco.mjtIntegrator.mjINT_IMPLICITFAST, mujoco.mjtSolver.mjSOL_CG)
    for k, geom in enumerate(body.model.pair_geom1):
        if body.model.geom(geom).name == "floor":
            assert (*body.model.pair_solref[k], body.model.pair_margin[k]) == (0.005, 0.8, 1e-4)
        else:
            assert body.model.pair_solimp[k].tolist() == [0.2, 0.3, 0.01, 0.4, 3]


def test_geoms_are_mixed_as_the_engine_does(read):
    """Against the contact that MuJoCo itself makes."""
    text = mjcf(
        '<geom name="floor" type="plane" size="1 1 1" solref="0.01 0.9" solmix="3" margin="0.001"/>'
        '<geom name="wall" type="box" size="0.1 1 1" pos="0.1095 0 0" solimp="0.5 0.6 0.01" priority="1"/>'
        '<body pos="0 0 0.0095"><freejoint/><geom type="sphere" size="0.01" solref="0.03 1.1"/></body>'
    )
    of_scene, model = read(text), mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    assert data.ncon == 2
    for contact in data.contact:
        pair = of_scene.A if model.geom("floor").id in contact.geom else of_scene.B
        assert pair.solref == pytest.approx(tuple(contact.solref))
        assert pair.solimp == pytest.approx(tuple(contact.solimp))
        assert pair.margin == pytest.approx(contact.includemargin)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("<mujoco", "MuJoCo refuses it"),
        (mjcf(FLOOR), "there is no ball"),
        (mjcf(BALL), "the ball has no contacts"),
        (mjcf(FLOOR + BALL, '<option><flag contact="disable"/></option>'), "the ball has no contacts"),
        (mjcf(FLOOR + BALL.replace("ball", "a") + BALL.replace("ball", "b")), "there are 2 spheres that move"),
        ("\0\1\2", "MuJoCo refuses it"),
        (mjcf(FLOOR + BALL, '<contact><pair geom1="ball" geom2="wall"/></contact>'), "MuJoCo refuses it"),
        (mjcf(FLOOR + BALL, '<option tolerance="-1"/>'), "tolerance = -1 is out of range: must be >= 0"),
    ],
)
def test_files_without_such_contacts(read, text, message):
    with pytest.raises(InputError, match=message) as refused:
        read(text)
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize(
    ("world", "lacks"),
    [
        *((FLOOR + BALL.replace(">", f' pos="0 0 {z}">', 1), "no wall .* its floor") for z in (-0.004, 0.0, 0.0099, 1)),
        (WALL + BALL, "no floor .* its wall"),
        (FLOOR + WALL + BALL, "^$"),
    ],
)
def test_what_stands_for_what_is_missing(read, world, lacks):
    of_scene = read(mjcf(world))
    assert re.search(lacks, of_scene.note)
    assert "\n" not in of_scene.note
    assert (of_scene.A == of_scene.B) is bool(of_scene.note)
