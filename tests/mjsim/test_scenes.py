"""Small scenes of what users build, and robots that others wrote: what memory holds still, and what
it leaves alone."""

import pytest

from docs.studies import small_scenes
from docs.studies.scenes import SCENES, WORSE
from docs.studies.ways import CREEP, SLIP, WAYS


def both(run):
    """What a scene comes to in plain MuJoCo, and with a soft."""
    return run(WAYS["plain"]), run(WAYS["soft"])


STILL = {name: SCENES[name].run for name in ("treadmill", "nut", "tactile", "mocap", "sleeping")}
STILL |= {"castle": small_scenes.castle, "dominos": lambda way: small_scenes.pushed(way, push=3.5)}
"""Of dominos one push: fallen, two rows in three jerk once in some seconds as an edge on a face
loses a point."""


@pytest.mark.parametrize("name", STILL)
def test_what_should_hold_still_does(name, monkeypatch):
    """Its creep is at least a hundred times less, and the slip of what is shaken ten times."""
    monkeypatch.setattr(small_scenes, "COURSES", 2)
    plain, soft = both(STILL[name])
    assert soft.values[CREEP] < 1e-2 * plain.values[CREEP]
    assert soft.values.get(SLIP, 0) <= 0.1 * plain.values.get(SLIP, 0)
    # nothing went wrong, nothing sinks in deeper, energy rises no higher
    assert not soft.wrong
    # what slides is lifted out of its depth in plain MuJoCo alone
    assert soft.depth <= 1.3 * plain.depth
    if plain.rise is not None:
        assert soft.rise <= WORSE * plain.rise + 1e-3


def test_a_dry_tendon_holds_under_rigid_contacts_alone():
    """A soft simulation in which nothing touches is MuJoCo's own, to the bit."""
    plain, soft = both(SCENES["tendon"].run)
    assert soft.values[CREEP] == plain.values[CREEP]
    assert SCENES["tendon"].run(WAYS["rigid"]).values[CREEP] < 1e-2 * plain.values[CREEP]


def test_a_carousel_holds_what_stands_on_it():
    """An integrator of first order leaves h omega^2 r/2; rigid contacts take half a step's turning
    into account."""
    left = 0.002 * small_scenes.TURN**2 * 0.2 / 2
    assert small_scenes.carousel(WAYS["soft"]).values[CREEP] < 1.1 * left
    assert small_scenes.carousel(WAYS["rigid"]).values[CREEP] < 0.01 * left


def test_nothing_brakes_what_rolls():
    """But a pose a pair of bodies does."""
    plain, soft = both(small_scenes.rolling)
    assert soft.values == pytest.approx(plain.values, abs=1e-6)
    braked = small_scenes.rolling(WAYS["a pose a pair"])
    assert min(braked.values.values()) > 10 * max(plain.values.values())


def test_impacts_of_a_cradle_stay_as_they_are():
    plain, soft = both(small_scenes.cradle)
    assert soft.values == pytest.approx(plain.values, abs=0.02)


def test_flexes_are_left_to_mujoco():
    model = small_scenes.soft_grip()
    one, other = (small_scenes.Run(WAYS[name], model) for name in ("plain", "soft"))
    for run in (one, other):
        run.advance(0.1)
    assert other.data.qpos == pytest.approx(one.data.qpos, abs=1e-9)


@pytest.mark.parametrize(
    "name", ["ant", "quadruped", "sawyer", "egg", pytest.param("lift", marks=pytest.mark.slow)]
)
def test_robots_hold_still(name):
    pytest.importorskip(SCENES[name].package, reason="where its scene comes from")
    plain, soft = both(SCENES[name].run)
    assert soft.values[CREEP] < 1e-2 * plain.values[CREEP]
    assert not soft.wrong


def test_a_scene_says_what_failed():
    """A plate that slides off its pad, in plain MuJoCo."""
    assert small_scenes.tactile(WAYS["plain"]).wrong == ["slid off"]
