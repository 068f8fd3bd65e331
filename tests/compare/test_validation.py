"""One failure takes its own claim only, and nothing is measured again that is kept."""

import dataclasses
import json
import threading

import pytest

from compare import validation
from compare.engines.study import EVENT, MUJOCO
from compare.method import record
from compare.method.protocol import UNDAMPED, Job, Protocol, carry_out, lacking
from compare.method.record import Check, Missing, Records
from compare.plan import ONE_BALL, PLAN, Entry, Level
from compare.report import results
from compare.verification.claim import Criterion, Outcome, Verdict
from model import Parameters, StorageError
from model.drag import SCHILLER_NAUMANN
from tests.commands import carried_out
from tests.measured import claim, measured

pytestmark = pytest.mark.usefixtures("few_figures")
P = Parameters.named("reference")
SETS = {"mine": P, "undamped": P.replace(c=0.0)}
OTHERS = SETS | {"mine": P.replace(mu=0.3)}


def going_round(runner, sets, records):
    """A measurement of every set, made up."""
    for name, p in sets.items():
        row = measured("round", "omega_c", p.omega_0, 1e-9, p, name)
        yield dataclasses.replace(row, engine=runner.engine.name)


def after(runner, sets, records):
    """Goes out from what was measured before."""
    for m in records.select("round"):
        yield Missing("after", m.set, f"nothing comes after {m.value:g} rad/s")


def broken(runner, sets, records):
    raise ArithmeticError("it can't be done")
    yield


def about(protocol):
    return claim(f"of-{protocol}", Criterion(protocol, "omega_c", lambda m: m.parameters.omega_0))


MEASURED = {"round": going_round, "broken": broken, "next": going_round, "after": after}
NEEDS = {"next": ("broken",), "after": ("round",)}


@pytest.fixture
def counted(monkeypatch):
    """Some protocols and their claims in the place of the real ones; the names of those that were
    carried out."""
    done = []

    def counting(name, measure):
        def carried_out(runner, sets, records):
            done.append(name)
            yield from measure(runner, sets, records)

        monkeypatch.setitem(PLAN, name, Entry())
        return Protocol(name, carried_out, NEEDS.get(name, ()))

    protocols = [counting(*each) for each in MEASURED.items()]
    monkeypatch.setattr(validation, "PROTOCOLS", tuple(protocols))
    monkeypatch.setattr(validation, "CLAIMS", tuple(about(p.name) for p in protocols))
    return done


def run(directory, sets=SETS, **how):
    return validation.validate(directory, level=Level.QUICK, sets=sets, workers=0, **how)


def test_one_failure_takes_its_own_claim_only_and_a_set_that_never_settles_is_named(
    tmp_path, counted
):
    """What needs a broken protocol isn't measured: it would be kept, and taken for whole once the
    other is mended."""
    verdicts = run(tmp_path)
    assert [verdict.outcome for verdict in verdicts] == ["confirmed", "error", "error", "not run"]
    assert (tmp_path / results.REPORT).exists()
    assert [*map(str, verdicts[0].missing)] == [f"undamped: {UNDAMPED}"]
    assert {check.measurement.set for check in verdicts[0].checks} == {"mine"}
    assert counted == ["round", "broken", "after"]


def test_a_bound_is_found_where_drag_bends_the_line_to_it(tmp_path):
    """At Reynolds numbers of hundreds in greater drag than in the sets of the study: by two flows
    near the zero of a line that is far from the bound, that was off by ten uncertainties."""
    p = Parameters(
        **{"mu": 0.86, "eta": 0.295, "j": 0.575, "r": 0.0101, "R": 0.07, "m": 0.02, "g": 9.2},
        **{"c": 0.177, "nu_f": 4.6e-5, "omega_0": 1.0, "drag": SCHILLER_NAUMANN},
    )
    (said,) = run(tmp_path, {"wake": p}, engine=EVENT, claims=["eq-66"], report=False)
    assert said.outcome == "confirmed"


def test_steps_that_agree_by_chance_where_drag_has_a_corner_are_not_too_sure(tmp_path):
    """Of a ball that is thrown up: halving the step changed a billionth, and it was ten times as
    far off."""
    p = Parameters(
        **{"mu": 0.7616, "eta": 0.2981, "j": 0.3613, "r": 0.006454, "R": 0.04103, "m": 0.04087},
        **{"g": 6.98, "c": 0.3253, "nu_f": 3.277e-5, "omega_0": 1.0, "drag": SCHILLER_NAUMANN},
    )
    (said,) = run(tmp_path, {"corner": p}, engine=MUJOCO, claims=["flight"], report=False)
    assert said.outcome == "confirmed"


def test_an_engine_that_is_named_is_heard_alone(tmp_path, counted):
    usual = ["mujoco", "mujoco-plain", "mujoco-defaults"]
    for engine, heard in (None, usual), (MUJOCO, usual[:1]):
        (said,) = run(tmp_path, engine=engine, claims=["of-round"])
        assert [each.engine for each in said.engines] == heard


def test_only_what_a_claim_needs_and_what_is_new_is_measured(tmp_path, counted):
    """And other sets apart."""
    assert [verdict.outcome for verdict in run(tmp_path, claims=["of-after"])] == ["not run"]
    assert counted == ["round", "after"]
    run(tmp_path)
    run(tmp_path)
    assert counted == ["round", "after", "broken", "broken"]
    run(tmp_path, OTHERS)
    assert counted.count("round") == 2
    assert len(list(tmp_path.glob("measurements/*/round.h5"))) == 2


def test_stored_measurements_are_judged_again(tmp_path, counted):
    """A file that was touched, or is gone, is named."""
    run(tmp_path)
    (tmp_path / results.REPORT).unlink()
    (verdict,) = validation.judge_stored(tmp_path, ["of-round"])
    assert verdict.outcome is Outcome.CONFIRMED
    assert (tmp_path / results.REPORT).exists()
    assert counted == ["round", "broken", "after"]
    (path,) = tmp_path.glob("measurements/*/round.h5")
    for spoil in (lambda: path.write_bytes(path.read_bytes()[:-100]), path.unlink):
        spoil()
        with pytest.raises(StorageError, match=r"round\.h5"):
            validation.judge_stored(tmp_path)


@pytest.mark.parametrize("what", ["engine", "protocol", "plan", "old"])
def test_measurements_belong_to_who_measured_them(what, tmp_path, counted, capsys):
    """A file in the place of another engine's, protocol's or plan's, or one of a program that
    didn't write down whose it is, is refused in one line."""
    run(tmp_path)
    (mine,) = tmp_path.glob("measurements/*/round.h5")
    apart = tmp_path / "others"
    if what == "engine":
        run(apart, engine=EVENT)
    elif what == "plan":
        run(apart, OTHERS)
    if what == "old":
        other = tmp_path / "old.h5"
        record.save(record.load(mine), other, {"protocol": mine.stem, "engine": "mujoco"})
    else:
        name = "after" if what == "protocol" else mine.stem
        (other,) = (tmp_path if name == "after" else apart).glob(f"measurements/*/{name}.h5")
    mine.write_bytes(other.read_bytes())
    said = f"{mine.name}.*(it holds measurements of|it doesn't say).*remove it, and 'dualball"
    for again in (run, validation.judge_stored):
        with pytest.raises(StorageError, match=said):
            again(tmp_path)
    code, _, errors = carried_out(capsys, f"judge {tmp_path} --workers 0")
    assert (code, len(errors.splitlines())) == (2, 1)
    mine.unlink()
    assert run(tmp_path)[0].outcome is Outcome.CONFIRMED


def test_verdicts_are_announced_as_they_come(tmp_path, counted, monkeypatch):
    """Each as soon as its protocols have measured, while others measure."""
    seen, first = [], threading.Event()

    def announce(verdict):
        seen.append(verdict.claim.id)
        first.set()

    def waiting(runner, sets, before):
        assert first.wait(30)
        yield from ()

    monkeypatch.setitem(PLAN, "waiting", Entry())
    protocols = *validation.PROTOCOLS, Protocol("waiting", waiting)
    monkeypatch.setattr(validation, "PROTOCOLS", protocols)
    monkeypatch.setattr(validation, "CLAIMS", (*validation.CLAIMS, about("waiting")))
    assert run(tmp_path, announce=announce)[-1].outcome == "not run"
    assert set(seen) == {each.id for each in validation.CLAIMS}
    assert seen[0] != "of-waiting"


@pytest.fixture
def found_by(tmp_path, runner, monkeypatch):
    """What a protocol finds that has this entry in the plan."""

    def found_by(measure, sets, entry, name="round"):
        monkeypatch.setitem(PLAN, name, entry)
        return carry_out(Job(Protocol(name, measure), runner, tmp_path, sets), Records())

    return found_by


def test_too_weak_a_drag_keeps_protocols_from_waiting(found_by):
    seen = []

    def measure(runner, sets, before):
        seen.extend(sets)
        yield from ()

    named = {name: Parameters.named(name) for name in ("air", "steel-in-water")}
    for settles in (True, False):
        found = found_by(measure, named, Entry(settles=settles), f"settles-{settles}")
        assert [m.set for m in found.missing] == ["air"] * settles
        assert all("1/c = 2.39e+03 s, 1.2e+06 time steps" in m.reason for m in found.missing)
    assert seen == ["steel-in-water", "air", "steel-in-water"]


def test_a_set_of_which_nothing_is_said_is_counted(found_by):
    def measure(runner, sets, before):
        yield from going_round(runner, {"one": sets["one"]}, before)
        yield Missing("round", "other", "it has a reason", 0)

    found = found_by(measure, dict.fromkeys(("one", "other", "third"), P), Entry())
    assert found.lost == {("round", "third", ""): 1}


def test_numbers_that_are_planned_and_do_not_come_are_counted(runner, tmp_path, monkeypatch):
    """At the quick level, of the sets of the study."""

    def measure(runner, sets, before):
        for _ in range(3):
            yield from going_round(runner, sets, before)
        yield Missing("round", "blunt", "it has a reason", 2)

    monkeypatch.setitem(PLAN, "round", Entry(("reference", "blunt"), numbers=5))
    job = Job(Protocol("round", measure), runner, tmp_path)
    assert carry_out(job, Records()).lost == {("round", "reference", ""): 2}
    monkeypatch.setitem(PLAN, "round", Entry(("reference",), only=ALONE, numbers=20))
    assert lacking(job, [Missing("round", "own", "why", 19)]).total() == 1


ALONE = "it is that of the reference"


def test_what_only_the_reference_shows_is_not_missed_on_other_sets(found_by):
    """All sets are planned at the default level: its claims came out inconclusive."""

    def measure(runner, sets, before):
        yield from going_round(runner, {"reference": sets["reference"]}, before)

    named = dict.fromkeys(("reference", "other"), P)
    found = found_by(measure, named, Entry(ONE_BALL, only=ALONE))
    assert (len(found.measurements), found.lost.total()) == (1, 0)


def test_another_engine_may_measure_what_only_the_reference_shows(found_by):
    for engine in (None, MUJOCO):  # what one measured is not taken for the other's
        (row,) = found_by(going_round, {"mine": P}, Entry(by=engine)).measurements
        assert row.engine == (engine or EVENT).name
    for name, count in (("mine", 1), ("reference", 0)):
        of = f"of-{name}"
        found = found_by(lambda *_: (), {name: P}, Entry(only=ALONE), of)
        assert found.missing == (Missing(of, name, ALONE, 0),) * count


@pytest.mark.parametrize("command", ["validate", "judge"])
def test_the_command_line(command, tmp_path, counted, capsys):
    validate = f"validate --quick -o {tmp_path} --workers 0 --set reference"
    code, shown, _ = carried_out(capsys, f"{validate} --quiet")
    assert (code, "of-round" in shown, "it can't be done" in shown) == (1, True, True)
    assert len(shown.splitlines()) < 12
    again = f"judge {tmp_path} --workers 0" if command == "judge" else validate
    first, *_ = json.loads(carried_out(capsys, f"{again} --json")[1])
    assert (first["id"], first["verdict"], first["passed"]) == ("of-round", "confirmed", True)
    assert set(first["resolving_power"]) == {"omega_c"}
    assert first["checks"][0]["predicted"] == P.omega_0


@pytest.mark.parametrize(
    ("of", "outcome", "code"),
    [
        ("reference", Outcome.INCONCLUSIVE, 1),
        ("mine", Outcome.INCONCLUSIVE, 0),
        ("mine", Outcome.REFUTED, 1),
        ("mine", Outcome.ERROR, 1),
    ],
)
def test_what_a_set_of_ones_own_is_too_rough_for_is_no_failure(
    of, outcome, code, monkeypatch, tmp_path, capsys
):
    row = measured("round", "omega_c", 12.0, 1.0, set=of)
    check = Check(measurement=row, predicted=12.0, uncertainty=0.3, scale=12.0)
    found = Verdict(claim=about("round"), outcome=outcome, checks=(check,))
    monkeypatch.setattr(validation, "judge_stored", lambda *_: [found])
    ended, said, _ = carried_out(capsys, f"judge {tmp_path}")
    assert ended == code
    unsure = "1 of 1 claims can't be told from what was measured: of-round"
    assert (unsure in said) == (outcome is Outcome.INCONCLUSIVE)
