"""Friction that holds: what Coulomb's law says exactly of one body, on any MuJoCo model."""

import threading
from pathlib import Path
from types import SimpleNamespace

import mujoco
import numpy as np
import pytest

from mjsim import FrictionMemory, memory
from model import InputError

G = 9.81
BOX = '<geom type="box" size=".05 .05 .05" mass="1"/>'
BALL = '<geom type="sphere" size=".05" mass="1"/>'
SCENES = Path(__file__).parents[2] / "docs" / "friction"
CONES = pytest.mark.parametrize("cone", ["elliptic", "pyramidal"])


def scene(slope=0.0, mu=0.6, cone="elliptic", boxes=1, geom=BOX, option="", friction=".005 .0001", condim=3):
    """Bodies one on top of the other on a plane that is tilted by `slope`, rad; gravity is turned instead."""
    bodies = "".join(f'<body pos="0 0 {0.05 + 0.1 * i}"><freejoint/>{geom}</body>' for i in range(boxes))
    model = mujoco.MjModel.from_xml_string(
        f'<mujoco><option cone="{cone}" gravity="{G * np.sin(slope)} 0 {-G * np.cos(slope)}" {option}/>'
        f'<default><geom friction="{mu} {friction}" condim="{condim}"/></default>'
        f'<worldbody><geom type="plane" size="9 9 1"/>{bodies}</worldbody></mujoco>'
    )
    return model, mujoco.MjData(model)


def creep(model):
    """How far bodies move in 500 steps after 2500, m."""
    data, stepper = mujoco.MjData(model), FrictionMemory(model)
    stepper.step(data, 2500)
    place = data.xpos.copy()
    stepper.step(data, 500)
    return np.abs(data.xpos - place).max()


@CONES
@pytest.mark.parametrize(
    ("option", "more"),
    [
        ("", {}),
        ('integrator="implicitfast"', {}),
        ('integrator="implicit" impratio="10"', {}),
        ('solver="CG"', {}),
        ("", {"condim": 4}),
        ("", {"condim": 6}),
        ("", {"condim": 6, "friction": ".005 .02", "geom": BALL}),
    ],
)
def test_nothing_creeps(cone, option, more):
    """Nothing moves inside the cone, nor a ball inside that of rolling friction, .02 m of a radius of .05 m.

    What is left is the solver's: with its default tolerance, 1e-8, about 1e-12 m/s, with implicit integrators 1e-10.
    """
    assert creep(scene(np.radians(10), cone=cone, option=f'tolerance="1e-14" {option}', **more)[0]) < 1e-12


@CONES
def test_breaks_away_at_the_limit(cone):
    model, data = scene(cone=cone)
    stepper = FrictionMemory(model)
    for share in [*np.linspace(0, 0.95, 500), *np.linspace(0.95, 1.05, 1000)]:
        data.qfrc_applied[0] = share * 0.6 * G
        stepper.step(data)
        if share > 0.97 and data.qvel[0] > 1e-5:
            break
    assert share == pytest.approx(1, abs=5e-3)


@CONES
def test_servo_takes_the_depth_away(cone):
    """A ball that rolls down has the lever r, so that it gains 5/7 g sin(slope): 1 % less without servo."""
    slope, ball = np.radians(5), '<geom size=".05" mass=".03" margin="2e-3"/>'
    model, data = scene(slope, cone=cone, geom=ball, option='tolerance="1e-12"')
    stepper = FrictionMemory(model, servo=0.1)
    stepper.step(data, 500)
    speed = data.qvel[0]
    stepper.step(data, 500)
    assert abs(data.contact.dist[0]) < 1e-9
    assert data.qvel[0] - speed == pytest.approx(5 / 7 * G * np.sin(slope), rel=1e-4)
    model, data = scene(geom=BOX.replace("mass", 'euler="10 20 0" margin="2e-3" mass'), cone=cone)
    data.qpos[2], free = 0.2, np.sqrt(2 * (0.2 - 0.075) / G)
    stepper = FrictionMemory(model, servo=0.1)
    stepper.step(data, int(free / model.opt.timestep) - 12)
    assert data.qvel[2] == pytest.approx(-G * data.time, rel=1e-9)  # the margin bears nothing
    stepper.step(data, 2000)
    assert np.abs(data.contact.dist).max() < 1e-9
    with pytest.raises(InputError, match="servo"):
        FrictionMemory(model, servo=1e-3)


def test_states_threads_and_neighbours():
    """Memories are independent, and one that is restored goes on to the bit."""
    model, data = scene(np.radians(15), boxes=2)
    stepper = FrictionMemory(model)
    stepper.step(data, 60)
    kept, copies = stepper.state(), [mujoco.MjData(model) for _ in range(3)]
    others = [FrictionMemory(model) for _ in copies]
    for other, copied in zip(others, copies, strict=True):
        mujoco.mj_copyData(copied, model, data)
        other.restore(kept)
    stepper.step(data, 60)
    threads = [threading.Thread(target=o.step, args=(c, 60)) for o, c in zip(others, copies, strict=True)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert all((copied.qpos == data.qpos).all() for copied in copies)


def test_what_is_refused():
    model, _ = scene()
    with pytest.raises(InputError, match="another MjModel"):
        FrictionMemory(model).step(scene()[1])
    for integrator in ("RK4", "discrete"):
        with pytest.raises(InputError, match=f"integrator = {integrator.upper()} .* needs Euler"):
            FrictionMemory(scene(option=f'integrator="{integrator}"')[0])


@pytest.mark.parametrize(("array", "value"), [("qvel", np.nan), ("qfrc_applied", 1e300)])
def test_a_state_that_mujoco_resets_is_forgotten(array, value, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)  # where MuJoCo logs that it does
    model, data = scene(np.radians(15))
    stepper, fresh = FrictionMemory(model), mujoco.MjData(model)
    stepper.step(data, 50)
    getattr(data, array)[0] = value
    stepper.step(data, 50)
    FrictionMemory(model).step(fresh, 50)
    assert (data.qpos == fresh.qpos).all()


@CONES
@pytest.mark.parametrize(
    ("given", "solref", "begin"),
    [
        ({"slope": np.radians(30), "mu": 0.3}, (0.02, 1), 100),
        ({"slope": 0.1, "condim": 1, "geom": BALL}, (0.02, 1), 0),
        ({"slope": 0.1, "geom": BALL}, (-1000, 0), 0),
    ],
)
def test_fast_sliding_and_contacts_without_friction_or_damping_are_the_engines_own(cone, given, solref, begin):
    model, data = scene(cone=cone, **given)
    model.geom_solref[:] = solref
    mujoco.mj_step(model, data, begin)
    plain = mujoco.MjData(model)
    mujoco.mj_copyData(plain, model, data)
    FrictionMemory(model).step(data, 400)
    mujoco.mj_step(model, plain, 400)
    assert data.qpos == pytest.approx(plain.qpos, rel=1e-12)


@CONES
def test_compiled_as_written(cone):
    """The loops that numba compiles give what the array formulas do: bodies that fall, slide, spin and settle."""
    pytest.importorskip("numba")
    bodies = "".join(
        f'<body pos="{0.02 * k} 0 {0.06 + 0.11 * k}" euler="{20 * k} 9 0"><freejoint/>'
        f'<geom type="{kind}" size=".05 .04 .03" condim="{condim}"/></body>'
        for k, (kind, condim) in enumerate([("box", 3), ("sphere", 4), ("capsule", 6), ("box", 4)])
    )
    model = mujoco.MjModel.from_xml_string(
        f'<mujoco><option cone="{cone}"/><worldbody><geom type="plane" size="9 9 1"/>{bodies}</worldbody></mujoco>'
    )
    data, stepper = mujoco.MjData(model), FrictionMemory(model)
    assert apart(data, stepper, 200) < 1e-9
    assert data.ncon >= 4
    model, data = scene(0.1, boxes=3, cone=cone)  # comes to rest
    stepper = FrictionMemory(model)
    stepper.step(data, 2000)
    assert apart(data, stepper, 50) < 2 * memory.STILL


def apart(data, stepper, steps):
    """Most that compiled loops differ from formulas, relative to what they add and remember."""
    compiled, written, most = stepper._kernels, memory.Formulas(), [0.0]

    def compare(found, wanted):
        for one, same in zip(found, wanted, strict=True):
            most.append(np.abs(one - same).max(initial=0) / np.abs(1.0 * same).max(initial=1e-3))

    def recall(model, data, kept, *more):
        begin, given = data.efc_aref.copy(), kept
        if written._kept.shape == kept.shape:
            given = written._kept
            given[:] = kept
        wanted = written.recall(model, data, given, *more)
        added = data.efc_aref - begin
        data.efc_aref[:] = begin
        found = compiled.recall(model, data, kept, *more)
        compare([data.efc_aref - begin, found[0][:, :8], found[1]], [added, wanted[0][:, :8], wanted[1]])
        return found

    def retain(model, data, kept, *more):
        wanted = kept.copy()
        written.retain(model, data, wanted, *more)
        compiled.retain(model, data, kept, *more)
        compare([kept], [wanted])

    stepper._kernels = SimpleNamespace(recall=recall, retain=retain)
    stepper.step(data, steps)
    return max(most)


@pytest.mark.parametrize("name", [path.name for path in SCENES.glob("*.xml")])
def test_scenes_of_the_page_hold(name):
    assert creep(mujoco.MjModel.from_xml_path(str(SCENES / name))) < 1e-12


def test_forces_turn_with_a_hand():
    fingers = "".join(
        f'<body pos="{side * 0.03} 0 0"><joint type="slide" axis="{-side} 0 0" stiffness="500" damping="20" '
        'springref=".02"/><geom type="box" size=".01 .03 .03" mass=".2"/></body>'
        for side in (-1, 1)
    )
    model = mujoco.MjModel.from_xml_string(
        '<mujoco><option cone="elliptic" tolerance="1e-12"/><default><geom friction="1"/></default><worldbody><body>'
        f'<joint axis="0 0 1" armature="1000"/><geom size=".005" contype="0" conaffinity="0"/>{fingers}</body>'
        '<body><freejoint/><geom type="capsule" size=".02 .03" mass=".1"/></body></worldbody></mujoco>'
    )
    data, stepper = mujoco.MjData(model), FrictionMemory(model)
    data.qvel[0] = 2
    stepper.step(data, 2000)
    height, turned = data.qpos[5], data.qpos[0]
    stepper.step(data, 500)
    assert data.qpos[5] == pytest.approx(height, abs=1e-12)
    assert data.qpos[0] - turned > 1


def rise(model, stepper, seconds, velocity=()):
    """Most that the energy of free bodies, kinetic and potential, rises above the least it has been so far, J."""
    data, least, most = mujoco.MjData(model), np.inf, 0.0
    data.qvel[: len(velocity)] = velocity
    for _ in range(round(seconds / model.opt.timestep)):
        stepper(data)
        mujoco.mj_energyVel(model, data)
        energy = data.energy[1] - model.body_mass @ (data.xipos @ model.opt.gravity)
        least = min(least, energy)
        most = max(most, energy - least)
    return most


@pytest.mark.parametrize(
    ("geom", "velocity"),
    [
        (BOX, (1, 0.3, 0)),  # slides to a stop
        (BOX, (0, 0, 0.5, 3, 5, 1)),  # is thrown
        (BALL, (1, 0, 0)),  # slides, then rolls
        (BALL, (1, 0, 0, 0, 20, 0)),  # rolls
        (BALL, (0, 0, 0, 0, 0, 30)),  # spins
    ],
)
def test_never_more_energy(geom, velocity):
    """Energy rises no further than in plain MuJoCo, whose bodies hop; five starts of each, as the hops are random."""
    model, _ = scene(geom=geom, condim=4)
    starts = [factor * np.array(velocity) for factor in (0.8, 0.9, 1.0, 1.1, 1.2)]
    plain = [rise(model, lambda data: mujoco.mj_step(model, data), 0.8, start) for start in starts]
    ours = [rise(model, FrictionMemory(model).step, 0.8, start) for start in starts]
    assert np.mean(ours) <= np.mean(plain) + np.std(plain) + 1e-6


@pytest.mark.parametrize("seeds", [[47], pytest.param(range(20), marks=pytest.mark.slow)])
def test_piles_come_to_rest(seeds):
    """The collider of boxes drops points and finds them again: bodies would rock if they were not put back."""
    from docs.studies import friction

    models = [friction.pile(seed, mixed=False) for seed in seeds]
    drift, rise = np.transpose([friction.settle(model, FrictionMemory(model)) for model in models])
    assert (drift < friction.STILL).sum() >= 0.95 * len(models)
    plain = [friction.settle(model, friction.Plain(model))[1] for model in models]
    assert rise.max() <= max(friction.RISES[0], *plain)
