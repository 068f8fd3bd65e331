"""An engine that breaks loses its case and not the run, in pytest, too; files hold the whole set of
cases."""

import json
import re
from contextlib import closing
from types import SimpleNamespace

import h5py
import numpy as np
import pytest

from compare import bench
from compare.bench import cases, league, run, runner
from compare.bench.case import TIME_STEPS, VERSION
from compare.bench.runner import run_all
from compare.campaign import compiling
from model import InputError
from tests.commands import refused, told
from tests.exact_cases import CASES
from tests.exact_engine import BREAKS, Exact


def test_what_breaks_loses_the_case_and_not_the_run():
    tried = [CASES[name] for name in ("block-slides", *BREAKS, "turntable")]
    first, *broken, last = run_all(tried, Exact(breaks=True), limit=3.0)
    assert first.passed
    assert last.passed
    assert [each.failure for each in broken] == [says for _, says in BREAKS.values()]
    assert not any(each.passed or np.isfinite(each.errors).any() for each in broken)


def test_errors_order_creep_and_cost():
    case = CASES["box-stops"]
    found = run(case, Exact())
    assert (found.passed, found.steps, found.creep, found.lost) == (True, TIME_STEPS, 0, 0)
    assert found.order == pytest.approx(1.0)
    assert found.errors[-1] == pytest.approx(TIME_STEPS[-1] * case.times[-1] / case.scales[0])
    assert found.cost >= 0
    assert run(CASES["growing-pull"], Exact()).skipped == "no forces"
    # Steps between which samples lie.
    defaults = "compare.engines.adapters.mujoco_free:defaults"
    assert run(CASES["sphere-rolls-down"], defaults, [3e-3]).passed


HALF = SimpleNamespace(build=print, step=print)
NO_ENGINES = (
    ("no.such", "no.such can't be used: ModuleNotFoundError: No module named 'no'"),
    ("compare.bench.runner", "compare.bench.runner has no function build nor step nor state"),
    (HALF, "SimpleNamespace has no function state; an engine has build, step"),
    ("compare.engines.adapters.mujoco_free:gone", " has no attribute 'gone' (mujoco "),
    (Exact(PRECISION="f128"), "PRECISION = 'f128' must be one of f64, f32"),
    (Exact(PRECISION=64), "PRECISION = 64 must be a text"),
    ("tests.exact_engine:STEPLESS", "TIMESTEPS is empty"),
    ("tests.exact_engine:FEATURED", "FEATURES = 'two bodies' must be a list"),
)


@pytest.mark.parametrize(("engine", "says"), NO_ENGINES)
def test_engines_that_are_none(engine, says):
    with pytest.raises(InputError) as refused:
        run(CASES["box-stops"], engine)
    assert says in str(refused.value)


def test_an_adapter_that_gives_nothing_loses_all_cases(here, monkeypatch, capsys):
    """It has its page all the same."""
    functions = "build = lambda case, timestep: None; step = lambda n: None; state = lambda: 1 / 0"
    note = "NOTE = 'what is told of another case'"
    (here / "mine.py").write_text(f"{note}; {functions}")
    monkeypatch.syspath_prepend(here)
    shown = told(capsys, "league --engine mine --quick --quiet -o out --workers 1")
    assert re.search(r"mine +f64 +0 of \d\d lost lost lost lost", shown)
    assert "The shortest step is 2 ms." in shown
    page = (here / "out" / "league.html").read_text("utf-8")
    assert "lost" in page
    assert re.search(r"Worst: .*\. Known for: what is told of another case\.", page)


def test_a_league_says_what_mujoco_is():
    """Its 39 of 39 would be quoted as MuJoCo's own."""
    said = "mujoco-free is MuJoCo with free bodies under Coulomb's law"
    assert said in league.caption({"mujoco-free": []})
    assert "Coulomb" not in league.caption({"drake": []})


def test_the_time_that_a_league_takes_is_told_once_all_engines_are_at_work(monkeypatch):
    """One compiles before its first case, one within a case, and one can't be used."""
    now, told, takes = 0.0, [], {"slow": [40.0] + 9 * [2.0], "quick": [1.0, 0.1, 9.0] + 7 * [0.1]}
    monkeypatch.setattr(league.time, "monotonic", lambda: now)
    lasting = {f"case {k}": 1.0 for k in range(10)}
    far = league.Progress(lambda *said: told.append((now, *said)), [*takes, "none"], lasting)
    results = [(float(np.cumsum(of)[k]), name, k) for name, of in takes.items() for k in range(10)]
    far.note("none", runner.Result("case 0", runner.About("none"), skipped="not here"))
    far.over("none")
    for at, name, k in sorted(results):
        now = at
        far.note(name, runner.Result(f"case {k}", runner.About(name)))
        if k == 9:
            far.over(name)
    assert [said[1:] for said in told[:10]] == 10 * [("quick", 0, 0, 0)]
    shares = [said for said in told if said[3]]
    began, end = shares[0][0], sum(takes["slow"])
    assert began == 48.0
    for at, _, done, total, _ in shares:
        assert done / total == pytest.approx((at - began) / (end - began), abs=1e-3)


def test_a_league_hears_that_an_engine_compiles(monkeypatch):
    monkeypatch.setattr(compiling, "workers", set())
    with closing(runner.EngineProcess("tests.exact_engine:COMPILES")) as trial:
        trial.result(cases()[0], [1e-3])
        assert compiling.now().startswith("compiling")


def test_a_league_of_one(tmp_path, capsys):
    name = "tests.exact_engine:EXACT"
    shown = told(capsys, f"league --engine {name} -o {tmp_path} --workers 1 --quiet --json")
    tried = [result for result in json.loads(shown)["engines"][name] if not result["skipped"]]
    assert len(tried) == sum(not case.needs for case in cases()) - 1
    assert sum(result["passed"] for result in tried) == 22
    assert not any(result["failure"] for result in tried)
    assert "no forces" in (tmp_path / "league.html").read_text("utf-8")
    lost = tmp_path / "lost"
    for known in ("", "--engine mujoco-plain "):
        said = refused(capsys, f"league {known}--engine no.such -o {lost} --quiet")
        assert "no.such can't be used: ModuleNotFoundError: No module" in said
    assert not lost.exists()


def test_the_set_as_files(tmp_path, capsys):
    for _ in range(2):  # its own are replaced
        assert "block-rests" in told(capsys, f"cases -o {tmp_path}")
    paths = list(tmp_path.iterdir())
    assert sum(path.stat().st_size for path in paths) < 2e6
    assert len(paths) == 2 + 2 * len(cases())
    assert f"version {VERSION}" in (tmp_path / "README.md").read_text()
    with h5py.File(tmp_path / "cases.h5") as file:
        for case in cases():
            written = json.loads((tmp_path / f"{case.name}.json").read_text())
            assert written["exact"] == case.exact.tolist()
            assert tuple(written["contacts"]) == case.contacts
            assert written["body"]["size"] == list(case.body.size)
            assert np.array_equal(file[case.name]["exact"], case.exact)
            assert file[case.name]["contacts"].asstr()[:].tolist() == list(case.contacts)
    assert "a hollow sphere" in told(capsys, "cases lands")
    refused(capsys, "cases land")


OLD = """
def build(case, timestep):
    globals().update(case=case, now=0.0, timestep=timestep)
def step(n):
    globals().update(now=now + n * timestep)
def state():
    return case.exact[abs(case.times - now).argmin()].reshape(-1, 3)
"""


def test_adapters_of_a_file_are_asked_for_what_they_can_do_and_name_a_version_that_broke(
    tmp_path, monkeypatch
):
    (tmp_path / "of_version_1.py").write_text(OLD)
    (tmp_path / "of_version_2.py").write_text(f"FEATURES = ('two bodies',){OLD}")
    (tmp_path / "broke.py").write_text(
        f"KNOWN = 'numpy 0.1'{OLD}def build(*given): raise RuntimeError('gone')"
    )
    monkeypatch.syspath_prepend(tmp_path)
    assert run(CASES["box-stops"], "of_version_1").passed
    asked = run(CASES["plank"], "of_version_1")
    assert asked.skipped == "of_version_1 doesn't say in FEATURES that it can do this: two bodies"
    assert run(CASES["plank"], "of_version_2").passed
    found = run(CASES["box-stops"], "broke")
    assert found.failure.startswith("RuntimeError: gone (numpy ")
    assert found.failure.endswith("known to work: 0.1)")


pytest_plugins = ("pytester",)
ADAPTER = f"""{OLD}
exact = state
def state():
    if case.name == "cylinder":
        return [0.0], [0.0], [0.0]
    return exact() * (1.2 if case.name == "box-stops" else 1.0)
""".replace(
    "    globals",
    "    if case.name == 'turntable': raise NotImplementedError('no tables')\n    globals",
    1,
)
FIXTURES = """
from model import Parameters
def test_theory(dualball_theory):
    p = Parameters.named("reference")
    assert dualball_theory(p, 1.0) is dualball_theory(p, 1.0)
def test_case(dualball_case):
    assert dualball_case.error(dualball_case.exact) == 0
"""
INSTALLED = ("-p", "compare", "-p", "no:cacheprovider")
"""Where dualball is installed an entry point names the package `compare`."""


@pytest.fixture(autouse=True, scope="module")
def loaded():
    """What the cases need: numba, which a test would take out of memory with all that it loads,
    can't load twice."""
    bench.cases()


def test_an_engine_on_the_exact_cases_beside_tests_of_ones_own(pytester):
    pytester.makeini("[pytest]")  # names are told from here, whatever lies in directories above
    pytester.makepyfile(adapter=ADAPTER, test_mine=FIXTURES)
    known = pytester.makefile(".txt", known="# ours\ncylinder   it has no wall\nblock-rests\n")
    given = f"test_mine.py --dualball-engine adapter --dualball-known {known} -rx -n 1"
    found = pytester.runpytest_subprocess(*INSTALLED, *given.split())
    found.stdout.fnmatch_lines(
        ["*box that is pushed off*errors*allowed is 0.01*", "*exact cases:*"]
    )
    found.stdout.re_match_lines(
        [r"case +error +order", r"sphere-slides-rolls +0 .* passed", r"box-stops .* failed"]
    )
    found.stdout.fnmatch_lines(["*XFAIL adapter::cylinder - it has no wall*"])
    outcomes = found.parseoutcomes()
    new = sum(bool(case.needs) for case in bench.cases())  # of which the adapter says nothing
    told = [outcomes[name] for name in ("failed", "xfailed", "xpassed", "skipped")]
    assert told == [1, 1, 1, 1 + new]
    assert outcomes["passed"] == 2 * len(bench.cases()) - new - 3  # and the tests that are named


REFUSED = {
    "nosuch": "*nosuch can't be used: ModuleNotFoundError: No module named 'nosuch'*",
    "half": "*half has no function state*",
    "half --dualball-known half.py": "*no case is called 'build'*",
    "half --dualball-known none": "*cannot read none*",
}


@pytest.mark.parametrize(("args", "message"), REFUSED.items())
def test_what_cannot_be_tested(pytester, args, message):
    """Unless files are named nothing but the cases is collected."""
    pytester.makepyfile(half="build = step = print", test_mine="def test_mine(): assert True")
    found = pytester.runpytest_inprocess(*INSTALLED, "--dualball-engine", *args.split())
    assert found.ret != 0
    (found.stderr if "known" in args else found.stdout).fnmatch_lines([message])
    assert found.parseoutcomes().get("passed", 0) == 0


def test_runs_that_do_not_use_it(pytester):
    """They load nothing, and modules of somebody else with our names are no harm."""
    pytester.makepyfile(compare="x = 1", model="x = 1")
    heavy = '{"numpy", "mujoco", "analytic", "compare.bench"}'
    pytester.makepyfile(f"import sys\ndef test_it(): assert not {heavy} & set(sys.modules)")
    pytester.syspathinsert()
    pytester.runpytest_subprocess(*INSTALLED).assert_outcomes(passed=1)
