"""The plugin for pytest judges an engine on the exact cases, and is no burden on runs that don't use it."""

import pytest

from compare import bench

pytest_plugins = ("pytester",)
ADAPTER = """
def build(case, timestep):
    if case.name == "turntable":
        raise NotImplementedError("tables don't turn here")
    globals().update(case=case, now=0.0, timestep=timestep)

def step(n):
    global now
    now += n * timestep

def state():
    if case.name == "cylinder":
        return [0.0], [0.0], [0.0]
    k = abs(case.times - now).argmin()
    return case.exact[k].reshape(3, 3) * (1.2 if case.name == "box-stops" else 1.0)
"""
INSTALLED = ("-p", "compare", "-p", "no:cacheprovider")
"""Where dualball is installed an entry point names the package `compare`."""


@pytest.fixture(autouse=True, scope="module")
def loaded():
    """What the cases need: numba, which a test would take out of memory with all that it loads, can't load twice."""
    bench.cases()


def test_an_engine_on_the_exact_cases(pytester):
    pytester.makepyfile(adapter=ADAPTER, test_mine="def test_mine(): assert True")
    known = pytester.makefile(".txt", known="# ours\ncylinder   it has no wall\nblock-rests\n")
    given = "test_mine.py", "--dualball-engine", "adapter", "--dualball-known", str(known), "-rx", "-n", "1"
    found = pytester.runpytest_subprocess(*INSTALLED, *given)
    found.stdout.fnmatch_lines(["*box that is pushed off*errors*allowed is 0.01*", "*exact cases:*"])
    found.stdout.re_match_lines([r"case +error +order", r"sphere-slides-rolls +0 .* passed", r"box-stops .* failed"])
    found.stdout.fnmatch_lines(["*XFAIL adapter::cylinder - it has no wall*"])
    outcomes = found.parseoutcomes()
    new = sum(bool(case.needs) for case in bench.cases())  # of which the adapter says nothing
    assert (outcomes["failed"], outcomes["xfailed"], outcomes["xpassed"], outcomes["skipped"]) == (1, 1, 1, 1 + new)
    assert outcomes["passed"] == len(bench.cases()) - new - 3  # and the test that is named


@pytest.mark.parametrize(
    ("args", "message"),
    [
        ("--dualball-engine nosuch", "*nosuch can't be used: ModuleNotFoundError: No module named 'nosuch'*"),
        ("--dualball-engine half", "*half has no function state*"),
        ("--dualball-engine half --dualball-known half.py", "*no case is called 'build'*"),
        ("--dualball-engine half --dualball-known none", "*cannot read none*"),
    ],
)
def test_what_cannot_be_tested(pytester, args, message):
    """Unless files are named nothing but the cases is collected."""
    pytester.makepyfile(half="build = step = print", test_mine="def test_mine(): assert True")
    found = pytester.runpytest_inprocess(*INSTALLED, *args.split())
    assert found.ret != 0
    (found.stderr if "known" in args else found.stdout).fnmatch_lines([message])
    assert found.parseoutcomes().get("passed", 0) == 0


def test_fixtures(pytester):
    pytester.makepyfile(
        """
        from model import Parameters

        def test_theory(dualball_theory):
            p = Parameters.named("reference")
            assert dualball_theory(p, 1.0) is dualball_theory(p, 1.0)

        def test_case(dualball_case):
            assert dualball_case.error(dualball_case.exact) == 0
        """
    )
    found = pytester.runpytest_inprocess(*INSTALLED, "-k", "theory or drilling")
    found.assert_outcomes(passed=2, deselected=found.parseoutcomes()["deselected"])


def test_runs_that_do_not_use_it(pytester):
    """They load nothing, and modules of somebody else with our names are no harm."""
    pytester.makepyfile(compare="x = 1", model="x = 1")
    heavy = '{"numpy", "mujoco", "analytic", "compare.bench"}'
    pytester.makepyfile(f"import sys\ndef test_it(): assert not {heavy} & set(sys.modules)")
    pytester.syspathinsert()
    pytester.runpytest_subprocess(*INSTALLED).assert_outcomes(passed=1)
