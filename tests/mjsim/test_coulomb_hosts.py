"""Coulomb's law can't hurt the program that it is in, whatever that does: MuJoCo's own errors, or
one line.

What may end a process is tried `apart`, in another one."""

import contextlib
import copy
import faulthandler
import functools
import gc
import math
import multiprocessing
import os
import pickle
import re
import shutil
import subprocess
import sys
import tempfile
import textwrap
import threading
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path

import mujoco
import mujoco.rollout
import numpy as np
import pytest

from mjsim import Coulomb
from tests.mjsim import random_models

ROOT = Path(__file__).parents[2]
FULL, INTEGRATION = mujoco.mjtState.mjSTATE_FULLPHYSICS, mujoco.mjtState.mjSTATE_INTEGRATION
WAYS = pytest.mark.parametrize("rigid", [False, True], ids=["soft", "rigid"])
TIMEOUT = 600.0
"""After how many seconds another process gives up: compiling, too, takes time."""
BOXES = "".join(
    f'<body pos="{0.03 * (i % 2)} 0 {0.06 + 0.11 * i}"><freejoint/>'
    '<geom type="box" size=".05 .05 .05"/></body>'
    for i in range(3)
)
ARM = (
    '<body pos="0 1 .05"><joint name="j" axis="0 1 0" frictionloss=".1"/>'
    '<geom type="capsule" fromto="0 0 0 .3 0 0" size=".03"/></body>'
)


def scene(option="", actuator="", more=""):
    """Boxes that fall on each other on a slope, and a dry arm that lies."""
    model = mujoco.MjModel.from_xml_string(
        f'<mujoco><option gravity="2.5 0 -9.5" {option}/><worldbody>'
        f'<geom type="plane" size="9 9 1"/>{BOXES}{ARM}</worldbody><actuator>'
        f'<general joint="j" {actuator}/></actuator>{more}</mujoco>'
    )
    return model, mujoco.MjData(model)


@functools.cache
def another_process():
    """One serves all; it begins where MuJoCo may log."""
    context, logs = multiprocessing.get_context("spawn"), (tempfile.gettempdir(),)
    return ProcessPoolExecutor(1, context, os.chdir, logs)


@pytest.fixture(scope="module", autouse=True)
def its_end():
    yield
    another_process().shutdown()


def apart(test):
    """The test in another process; where it ends that, a new one is for the next."""

    @functools.wraps(test)
    def carried_out(**given):
        if multiprocessing.parent_process():
            faulthandler.enable()
            faulthandler.dump_traceback_later(TIMEOUT, exit=True)
            test(**given)
            return faulthandler.cancel_dump_traceback_later()
        try:
            return another_process().submit(carried_out, **given).result()
        except BrokenProcessPool:
            another_process.cache_clear()
            raise

    return carried_out


# -- copies ----------------------------------------------------------------------------------------


class Environment:
    """What programs that learn by trying copy whole."""

    def __init__(self, rigid):
        self.model, self.data = scene()
        self.law = Coulomb(self.model, rigid=rigid)

    def step(self, count):
        self.law.step(self.data, count)
        return self.data.qpos.copy()


@apart
@WAYS
def test_copies(rigid):
    """Copies of the law, and of all there is, go on to the bit, and outlive what they are of."""
    environment = Environment(rigid)
    environment.step(100)
    others = [copy.deepcopy(environment), pickle.loads(pickle.dumps(environment))]
    for make in (copy.copy, copy.deepcopy, lambda law: pickle.loads(pickle.dumps(law))):
        other = copy.deepcopy(environment)
        other.law = make(other.law)
        other.data = copy.copy(other.data)
        other.model = other.law.model
        others.append(other)
    ends = [other.step(60) for other in others]
    ends.append(environment.step(60))
    del environment
    gc.collect()
    ends += [other.step(1) for other in others]
    assert all((end == ends[0]).all() for end in ends[:6])
    assert all((end == ends[6]).all() for end in ends[6:])


@WAYS
def test_copies_after_installed(rigid):
    """Of data that it has never seen the law can't find the last forces: a copy says so."""
    one = Environment(rigid)
    with one.law.installed():
        mujoco.mj_step(one.model, one.data, 100)
    words = r"can't be copied now: .*: state\(data\), or reset\(\)"
    for make in (copy.copy, copy.deepcopy, pickle.dumps):
        with pytest.raises(TypeError, match=words):
            make(one.law)
    one.law.state(one.data)
    other = copy.deepcopy(one)
    assert (one.step(50) == other.step(50)).all()


def unpickled(kept):
    """A pickle goes on to there."""
    law, data = pickle.loads(kept)
    law.step(data, 60)
    return data.qpos


@WAYS
def test_pickles_in_another_process(rigid):
    here = Environment(rigid)
    here.step(100)
    there = another_process().submit(unpickled, pickle.dumps((here.law, here.data)))
    assert (there.result() == here.step(60)).all()


# -- errors ----------------------------------------------------------------------------------------

USER = 'dyntype="user" gaintype="user" biastype="user" actdim="1"'
SENSOR = '<sensor><user dim="1" needstage="acc" objtype="xbody" objname="world"/></sensor>'
CALLBACKS = {
    **{"control": None, "passive": None, "sensor": None, "contactfilter": 0},
    **{"act_bias": 0.0, "act_gain": 0.0, "act_dyn": 0.0},
}
"""MuJoCo's callbacks, and what they return."""
ENTRIES = ["step", "halves", "installed"]


def stepper(model, data, rigid, entry):
    """The law that enters by one of the `ENTRIES`, what that needs, and a step through it."""
    law = Coulomb(model, rigid=rigid)

    def halves():
        law.step1(data)
        law.step2(data)

    if entry == "installed":
        return law.installed(), lambda: mujoco.mj_step(model, data)
    return contextlib.nullcontext(), halves if entry == "halves" else lambda: law.step(data)


def raised_in(kind, rigid, entry):
    """What is raised by a step in which a callback raises; then it steps as if nothing was."""
    user, sensor = USER if kind.startswith("act") else "", SENSOR if kind == "sensor" else ""
    model, data = scene('cone="elliptic"', user, sensor)
    fails, found = [], []

    def called(*_):
        if fails:
            raise KeyError(f"mine, of {kind}")
        return CALLBACKS[kind]

    within, step = contextlib.nullcontext(), lambda: mujoco.mj_step(model, data)
    if entry != "plain":
        within, step = stepper(model, data, rigid, entry)
    getattr(mujoco, f"set_mjcb_{kind}")(called)
    with within:
        for _ in range(3):
            for _ in range(25):
                step()
            fails.append(True)
            with pytest.raises(KeyError) as error:
                step()
            found.append(str(error.value))
            fails.clear()
    assert getattr(mujoco, f"get_mjcb_{kind}")() is called
    getattr(mujoco, f"set_mjcb_{kind}")(None)
    assert mujoco.get_mjcb_control() is None
    assert np.isfinite(data.qpos).all()
    return found, round(data.time / model.opt.timestep)


@apart
@pytest.mark.parametrize("kind", CALLBACKS)
@WAYS
def test_callbacks_that_raise(kind, rigid):
    for entry in ENTRIES:
        assert raised_in(kind, rigid, entry) == raised_in(kind, rigid, "plain")


def outcome(step, count=40):
    """The error that steps come to; none if they don't."""
    try:
        for _ in range(count):
            step()
    except mujoco.FatalError as error:
        return re.sub(r"(?s),? at .*", "", str(error))
    return "none"


@apart
@pytest.mark.parametrize(("solver", "entry"), [("Newton", "step"), ("PGS", "installed")])
@WAYS
def test_memory_that_is_too_small(rigid, solver, entry):
    """Every size of MuJoCo's memory, from the least, is enough, or an error of MuJoCo's.

    Rigid contacts are seen earlier, so that these need another size than plain ones."""
    worlds = f'<worldbody><geom type="plane" size="9 9 1"/>{BOXES}</worldbody>'
    option = f'<option solver="{solver}" jacobian="%s" cone="elliptic"/>'
    outcomes, same, tried = set(), 0, 0
    for size in range(3000, 60000, 1357):
        jacobian = "sparse" if tried % 2 else "dense"
        text = f'<mujoco><size memory="{size}"/>{option % jacobian}{worlds}</mujoco>'
        model = mujoco.MjModel.from_xml_string(text)
        plain, data = mujoco.MjData(model), mujoco.MjData(model)
        expected = outcome(lambda d=plain, m=model: mujoco.mj_step(m, d))
        within, step = stepper(model, data, rigid, entry)
        with within:
            found = outcome(step)
        outcomes.add(found)
        same, tried = same + (found == expected), tried + 1
    assert outcomes == {"none", "mj_stackAlloc: out of memory, stack overflow"}, outcomes
    assert rigid or same >= 0.9 * tried or solver == "PGS", (same, tried)
    model, data = scene()
    Coulomb(model, rigid=rigid).step(data, 50)  # lives on
    assert mujoco.get_mjcb_control() is None
    assert data.time == pytest.approx(50 * model.opt.timestep)


# -- what is gone, or another's --------------------------------------------------------------------


@apart
@WAYS
def test_what_is_gone_or_anothers(rigid):
    """Data and models that are freed, compiled anew, or another's."""
    model, data = scene()
    law = Coulomb(model, rigid=rigid)
    with law.installed():
        mujoco.mj_step(model, data, 20)
        del data
        gc.collect()
        with pytest.raises(
            ValueError, match="the data whose last forces are asked for are unknown"
        ):
            law.state()
        law.reset()
        assert not len(law.state()["contacts"])
        for _ in range(20):
            mujoco.mj_step(model, mujoco.MjData(model), 3)
    law = Coulomb(model, rigid=rigid)
    data = mujoco.MjData(model)
    law.step(data, 40)
    assert len(law.state()["contacts"])
    del data
    gc.collect()
    assert not len(law.state()["contacts"])
    data = mujoco.MjData(model)
    del model
    gc.collect()
    law.step(data, 40)  # the law keeps its model

    spec = mujoco.MjSpec.from_string(
        f'<mujoco><worldbody><geom type="plane" size="9 9 1"/>{BOXES}</worldbody></mujoco>'
    )
    model = spec.compile()
    data, law = mujoco.MjData(model), Coulomb(model, rigid=rigid)
    law.step(data, 40)
    state = law.state(data)
    spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[0.1, 0, 0], pos=[3, 3, 3])
    anew, theirs = spec.recompile(model, data)
    with pytest.raises(ValueError, match="data belong to another MjModel"):
        law.step(theirs)
    law.step(data)
    for refuse in (lambda: Coulomb(anew, rigid=rigid).restore(state), lambda: law.state(theirs)):
        with pytest.raises(ValueError, match=r"another MjModel|not a state of this model") as error:
            refuse()
        assert "\n" not in str(error.value)
    law = Coulomb(anew, rigid=rigid)
    law.step(theirs, 40)
    assert np.isfinite(theirs.qpos).all()


def refusal(law, state):
    """What `restore` says of a state that it refuses."""
    try:
        law.restore(state)
    except ValueError as error:
        return str(error)
    return ""


@apart
@WAYS
def test_states_that_are_none(rigid):
    """States that are cut, of other kinds, foreign or not finite."""
    model, data = scene()
    law = Coulomb(model, rigid=rigid)
    law.step(data, 60)
    state = law.state(data)
    strange = [None, 3, [], "contacts", {}]
    for name, values in state.items():
        strange += [{key: value for key, value in state.items() if key != name}]
        strange += [state | {name: value} for value in (None, "x", [[1], [2, 3]], values.tolist())]
        strange += [state | {name: values.astype(np.float32)}] if values.dtype == float else []
        strange += [state | {name: values[..., None]}]
    strange += [state | {name: np.full_like(state[name], np.nan)} for name in ("joints", "spins")]
    for field in ("load", "friction", "place", "velocity"):
        far = state["contacts"].copy()
        far[field] = math.nan
        strange += [state | {"contacts": far}]
    for geoms in ((0, model.ngeom), (-1, 0), (2**30, 2**30)):
        far = state["contacts"].copy()
        far["geoms"][-1] = geoms
        strange += [state | {"contacts": far}]
    refusals = [refusal(law, given) for given in strange]
    for given, words in zip(strange, refusals, strict=True):
        if words:
            assert re.match("not a state of .{,200}$", words), words
        else:  # the same again, as lists of numbers
            assert all(np.array_equal(given[name], state[name], equal_nan=True) for name in state)
    for time in (math.nan, math.inf, -1.0, 1e300):  # other times: all is forgotten
        law.restore(state | {"time": np.full(2, time)})
        law.step(mujoco.MjData(model), 20)
    huge = state["contacts"].copy()
    for field in ("load", "friction", "velocity", "predicted", "bias", "place"):
        huge[field] = 1e300
    huge["state"] = 77
    law.restore(state | {"contacts": huge}, data)
    law.step(data, 20)
    assert sum(map(bool, refusals)) >= 30


# -- wrong types -----------------------------------------------------------------------------------

WRONG = [2.5, -1, "3", np.zeros((3, 3)), math.nan, math.inf, 1j, object, 10**400, "x" * 999]


@pytest.mark.parametrize("name", ["nstep", "rigid", "restitution", "kinetic", "servo", "share"])
@pytest.mark.parametrize("wrong", WRONG, ids=lambda wrong: f"{str(wrong)[:9]}")
def test_wrong_types_and_values_are_told_in_a_line(name, wrong):
    model, data = scene()
    if name == "servo" and isinstance(wrong, float) and wrong == 2.5:
        wrong = 1e-9
    given = {name: wrong} | ({"rigid": True} if name == "restitution" else {})
    use = functools.partial(Coulomb, model, **given)
    if name == "nstep":
        use = functools.partial(Coulomb(model).step, data, wrong)
    with pytest.raises(ValueError, match=f"^{name} = .* must be ") as error:
        use()
    assert "\n" not in str(error.value)
    assert len(str(error.value)) < 120


@pytest.mark.parametrize("wrong", [None, 3, "data", True])
def test_data_are_mujocos(wrong):
    model, _ = scene()
    law = Coulomb(model)
    for method in (law.step, law.step1, law.step2, law.forward, lambda data: law.state(data or 0)):
        with pytest.raises(ValueError, match=r"^data is a .*; a mujoco\.MjData is needed$"):
            method(wrong)


# -- the same again --------------------------------------------------------------------------------


@WAYS
@pytest.mark.parametrize("before", [0, 2, 3, 40])
def test_a_state_that_is_set_begins_anew(rigid, before):
    """After `reset()`, or a jump of time, a run is that of fresh data, to the bit."""
    model, data = scene()
    law = Coulomb(model, rigid=rigid)
    law.step(data, 33)
    kept = np.empty(mujoco.mj_stateSize(model, INTEGRATION))
    mujoco.mj_getState(model, data, kept, INTEGRATION)
    ends = []
    for reset in (True, False, None):
        if reset is None:
            data, law = mujoco.MjData(model), Coulomb(model, rigid=rigid)
        else:
            law.step(data, before)
        mujoco.mj_setState(model, data, kept, INTEGRATION)
        if reset or not before:  # else it may go on
            law.reset()
        law.step(data, 50)
        ends.append(data.qpos.copy())
        mujoco.mj_resetData(model, data)
        if reset:
            law.reset()
        law.step(data, 50)
        ends.append(data.qpos.copy())
    assert (ends[0] == ends[4]).all()
    assert (ends[2] == ends[4]).all()
    assert (ends[1] == ends[5]).all()
    assert (ends[3] == ends[5]).all()


@apart
@pytest.mark.parametrize("steps", [40, 1])
@WAYS
def test_rollouts_of_equal_starts_are_equal(rigid, steps):
    """Eight equal starts, in one thread and in two."""
    model, data = scene()
    mujoco.mj_step(model, data, 60)
    assert data.ncon
    kept = np.empty(mujoco.mj_stateSize(model, FULL))
    mujoco.mj_getState(model, data, kept, FULL)
    law, ends, datas = Coulomb(model, rigid=rigid), [], []
    for threads in (1, 2):
        datas += [[mujoco.MjData(model) for _ in range(threads)]]
        with law.installed():
            found, _ = mujoco.rollout.rollout(
                model, datas[-1], np.tile(kept, (8, 1)), nstep=steps, persistent_pool=False
            )
        ends += list(found[:, -1])
    plain, _ = mujoco.rollout.rollout(model, mujoco.MjData(model), kept, nstep=steps)
    assert (plain[0, -1] != ends[0]).any()
    assert all((end == ends[0]).all() for end in ends)


LIMITS = (
    '<body><joint name="a" axis="0 1 0" range="-20 20" frictionloss=".05"/><geom fromto="0 0 0 .3 '
    '0 0" type="capsule" size=".02"/><body pos=".3 0 0"><joint name="b" type="{}" '
    'frictionloss=".02" range="{}" damping=".1"/><geom pos=".2 0 0" size=".05"/></body></body>'
    '<body pos="0 1 0"><joint name="c" type="slide" axis="0 0 1" range="-.1 .1"/>'
    '<geom size=".05"/></body><body pos="0 2 0"><freejoint/><geom size=".04"/></body>'
)
EQUALITY = (
    '<tendon><fixed name="t" limited="true" range="-.2 .2" frictionloss=".1"><joint joint="a" '
    'coef="1"/><joint joint="c" coef="1"/></fixed></tendon><equality><joint joint1="a" joint2="c" '
    'polycoef="0 .1 0 0 0"/></equality><actuator><position joint="a" kp="5"/></actuator>'
)


@pytest.mark.parametrize("integrator", ["Euler", "RK4", "implicit", "implicitfast"])
@pytest.mark.parametrize("joint", ["hinge", "ball", "slide"])
@pytest.mark.parametrize("solver", ["Newton", "CG", "PGS"])
def test_where_nothing_touches_all_is_mujocos_own(integrator, joint, solver):
    """To the bit, with limits, equality and dry friction; Newton's method stands in for PGS."""
    spread = {"hinge": "-10 10", "ball": "0 10", "slide": "-.01 .01"}[joint]
    model = mujoco.MjModel.from_xml_string(
        f'<mujoco><option integrator="{integrator}" solver="{solver}"/>'
        f"<worldbody>{LIMITS.format(joint, spread)}</worldbody>{EQUALITY}</mujoco>"
    )
    plain, data, other = (mujoco.MjData(model) for _ in range(3))
    law, usual = Coulomb(model), model.opt.solver
    law.step(data, 200)
    with law.installed():
        mujoco.mj_step(model, other, 200)
    assert model.opt.solver == usual
    if solver == "PGS":
        model.opt.solver = mujoco.mjtSolver.mjSOL_NEWTON
    mujoco.mj_step(model, plain, 200)
    assert not plain.ncon
    assert plain.nefc
    for one in (data, other):
        for array in ("qpos", "qvel", "qacc", "qacc_warmstart", "efc_force", "sensordata"):
            assert (getattr(one, array) == getattr(plain, array)).all()


# -- several at once -------------------------------------------------------------------------------


@apart
def test_threads_and_laws_at_once():
    """Laws of one model and of two, soft and rigid, in threads, whose cone is a pyramid's."""
    model, _ = scene('cone="pyramidal"')
    stiff, _ = scene('cone="pyramidal"')
    soft, rigid = Coulomb(model), Coulomb(stiff, rigid=True)
    datas = [mujoco.MjData(model) for _ in range(3)] + [mujoco.MjData(stiff) for _ in range(3)]
    laws = [soft] * 3 + [rigid] * 3

    def steps(law, data):
        for _ in range(100):
            law.step(data, 2)
            law.step1(data)
            law.step2(data)

    threads = [threading.Thread(target=steps, args=each) for each in zip(laws, datas, strict=True)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert {model.opt.cone, stiff.opt.cone} == {mujoco.mjtCone.mjCONE_PYRAMIDAL}
    for begin in (0, 3):
        single = mujoco.MjData(laws[begin].model)
        steps(laws[begin], single)
        for data in datas[begin : begin + 3]:
            assert (data.qpos == single.qpos).all()
    assert mujoco.get_mjcb_control() is None


@WAYS
@pytest.mark.parametrize("skips", [False, True])
def test_calls_in_which_mujoco_skips_stages_change_nothing(rigid, skips):
    """Rows and inertia that the law has changed once are MuJoCo's again before it does so anew."""
    model, data = scene('integrator="implicitfast"', 'biastype="affine" biasprm="0 0 -3"')
    seen, law = mujoco.MjData(model), Coulomb(model, rigid=rigid)
    with law.installed():
        for _ in range(60):
            mujoco.mj_step(model, data)
            mujoco.mj_step1(model, seen)
            for _ in range(2):
                if skips:
                    mujoco.mj_forwardSkip(model, seen, mujoco.mjtStage.mjSTAGE_VEL, 1)
                else:
                    mujoco.mj_forward(model, seen)
            mujoco.mj_step2(model, seen)
    assert seen.qpos == pytest.approx(data.qpos, abs=1e-4)


def test_one_law_at_a_time():
    """A second law neither takes the data of one that is installed nor silences it."""
    model, data = scene()
    expected, one, two = mujoco.MjData(model), Coulomb(model), Coulomb(model)
    Coulomb(model).step(expected, 80)
    two.step(data, 3)
    mujoco.mj_resetData(model, data)
    with one.installed():
        mujoco.mj_step(model, data, 40)
        with pytest.raises(ValueError, match="these data are under the law of another Coulomb"):
            two.step(data)
        two.restore(Coulomb(model).state())  # and it forgets its own alone
        mujoco.mj_step(model, data, 40)
    assert (data.qpos == expected.qpos).all()
    stiff = Coulomb(model, rigid=True)
    with one.installed(), pytest.raises(ValueError, match=r"rigid and soft .* one at a time"):
        stiff.step(mujoco.MjData(model))
    stiff.step(mujoco.MjData(model))


def test_data_may_be_found_to_be_garbage_at_any_time():
    model, data = scene()
    law, thresholds = Coulomb(model), gc.get_threshold()
    for count in range(1, 150):
        cycle = [mujoco.MjData(model)]
        cycle.append(cycle)
        law.step(cycle[0])
        del cycle
        gc.set_threshold(count, 1, 1)
        try:
            with law.installed():
                mujoco.mj_step(model, data)
        finally:
            gc.set_threshold(*thresholds)


def test_a_callback_set_under_installed_is_told_of():
    """The law acts no longer: a step of its own takes it back, else its end says so."""
    model, data = scene()
    expected, law, calls = mujoco.MjData(model), Coulomb(model), []
    Coulomb(model).step(expected, 80)
    try:
        with law.installed():
            mujoco.mj_step(model, data, 40)
            mujoco.set_mjcb_control(lambda *given: calls.append(given))
            law.step(data, 40)
        assert (data.qpos == expected.qpos).all()
        assert len(calls) == 40
        with pytest.warns(RuntimeWarning, match="another mjcb_control was set"):  # noqa: SIM117
            with law.installed():
                mujoco.set_mjcb_control(None)
    finally:
        mujoco.set_mjcb_control(None)


# -- compiled code ---------------------------------------------------------------------------------

PACKAGE = {
    "__init__": "",
    "numbers": "FACTOR = 2.0\n",
    "inner": """
        from .compiling import kernel
        from .numbers import FACTOR
        @kernel
        def scaled(x):
            return FACTOR * x
    """,
    "outer": """
        from .compiling import entry
        from .inner import scaled
        @entry
        def serve(x):
            return scaled(x) + 1.0
    """,
}


def test_compiled_code_is_never_stale(tmp_path):
    """A number in one file, through a function in another: what is kept on disk knows both."""
    for name, text in PACKAGE.items():
        (tmp_path / "law").mkdir(exist_ok=True)
        (tmp_path / "law" / f"{name}.py").write_text(textwrap.dedent(text))
    shutil.copy(ROOT / "mjsim" / "coulomb" / "compiling.py", tmp_path / "law")
    show = (
        "from law.outer import serve; print(serve(1.0)); "
        "print(sum(serve.dispatcher.stats.cache_hits.values()))"
    )

    def run():
        done = subprocess.run(
            [sys.executable, "-c", show], cwd=tmp_path, capture_output=True, text=True, timeout=500
        )
        assert not done.returncode, done.stderr
        return done.stdout.split()

    assert [run(), run()] == [["3.0", "0"], ["3.0", "1"]]
    (tmp_path / "law" / "numbers.py").write_text("FACTOR = 5.0\n")
    assert run() == ["6.0", "0"]


def test_two_packages_of_the_law_in_a_process(tmp_path):
    """That of the study and the one that is installed alone, say: each acts, whoever came first."""
    (tmp_path / "another_law").symlink_to(ROOT / "mjsim" / "coulomb")
    slide = """
        import mujoco, mjsim, another_law
        for law in (mjsim.Coulomb, another_law.Coulomb):
            model = mujoco.MjModel.from_xml_string(
                '<mujoco><option gravity="2 0 -9"/><worldbody><geom type="plane" size="1 1 1"/>'
                '<body pos="0 0 .1"><freejoint/><geom type="box" size=".1 .1 .1" friction=".5"/>'
                '</body></worldbody></mujoco>')
            data = mujoco.MjData(model)
            law(model).step(data, 1000)
            print(abs(data.qvel[0]) < 1e-9)
    """
    done = subprocess.run(
        [sys.executable, "-c", textwrap.dedent(slide)],
        env=os.environ | {"PYTHONPATH": f"{ROOT}{os.pathsep}{tmp_path}"},
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=TIMEOUT,
    )
    assert done.stdout.split() == ["True", "True"], done.stderr


# -- anything --------------------------------------------------------------------------------------

FASTER = 20.0
"""Speed in units of plain MuJoCo's, or of 5 m/s or rad/s, from which a model has blown up."""


def fastest(model, step, data):
    """The largest speed in a motion with random controls; infinite if MuJoCo had to reset it."""
    random, largest = np.random.default_rng(1), 0.0
    bad = [
        int(getattr(mujoco.mjtWarning, f"mjWARN_BAD{what}")) for what in ("QPOS", "QVEL", "QACC")
    ]
    for _ in range(100):
        data.ctrl[:] = random.uniform(-1, 1, model.nu)
        step()
        largest = max(largest, np.abs(data.qvel).max(initial=0))
        if any(data.warning[k].number for k in bad):
            return math.inf
    return largest


@apart
@pytest.mark.parametrize("seeds", [(0, 4), pytest.param((4, 400), marks=pytest.mark.slow)], ids=str)
@WAYS
def test_random_models_end_nothing(seeds, rigid):
    """None crashes, exits or hangs, which is told by its seed; those that blow up where plain
    MuJoCo doesn't are counted."""
    blown = []
    for seed in range(*seeds):
        print(seed, file=sys.stderr, flush=True)
        model = random_models.model(seed, rigid)
        plain, data = mujoco.MjData(model), mujoco.MjData(model)
        usual = fastest(model, functools.partial(mujoco.mj_step, model, plain), plain)
        within, step = stepper(model, data, rigid, "installed" if seed % 2 else "step")
        with within:
            if fastest(model, step, data) > FASTER * max(usual, 5.0):
                blown.append(seed)
        assert mujoco.get_mjcb_control() is None
    print(f"{len(blown)} of {seeds[1] - seeds[0]} blow up: {blown}")
