"""A process for Siconos that can't be had, ends, hangs or gives no numbers is the run's failure, in a line."""

import sys

import pytest

from compare.adapters import siconos
from compare.adapters.vessel import Settings, Vessel
from compare.kit.engines import ENGINES
from compare.kit.tasks import Task, carry_out
from model import Flow, InputError, Parameters, State
from tests.commands import refused

REFERENCE = Parameters.named("reference")
ENGINE = ENGINES["siconos"]


@pytest.fixture
def elsewhere(monkeypatch):
    """No Siconos wherever this machine may have one."""
    siconos.locate.cache_clear()
    monkeypatch.delenv("DUALBALL_SICONOS_PYTHON", raising=False)
    monkeypatch.setattr(siconos.shutil, "which", lambda *_, **__: None)
    yield monkeypatch
    siconos.locate.cache_clear()


@pytest.mark.parametrize(
    ("named", "says"),
    [
        (None, "siconos is not installed: on Debian or Ubuntu, apt-get install python3-siconos"),
        ("absent", "siconos is not installed for absent, which DUALBALL_SICONOS_PYTHON names"),
    ],
)
def test_where_it_is_missing_the_program_says_what_to_do(named, says, elsewhere, capsys):
    if named:
        elsewhere.setenv("DUALBALL_SICONOS_PYTHON", named)
    assert ENGINE.missing == says
    assert ENGINE.versions["siconos"] == "not installed"
    assert refused(capsys, "simulate --engine siconos --time 0.05") == f"dualball: error: {says}\n"


def test_a_python_without_its_libraries_is_the_person_s_error(monkeypatch):
    monkeypatch.setattr(siconos, "locate", lambda named: (sys.executable, "4.4.0"))
    with pytest.raises(InputError, match=r"siconos ended \(ModuleNotFoundError: No module named 'siconos"):
        siconos.best.build(Vessel.of(REFERENCE, State(), Flow.steady(1.0)), 1e-3)


@pytest.mark.parametrize(
    ("program", "says"),
    [
        ("import os; os.abort()", "ended (exit code -6)"),
        ("raise ValueError('too much')", "ended (ValueError: too much)"),
        ("""print('{"error": "RuntimeError: singular"}')""", "could not go on (RuntimeError: singular)"),
        ("import time; time.sleep(60)", "gave no answer for 2 s"),
        ("for _ in range(3): print(STATE, flush=True), input(), print([], flush=True), input()", "diverged"),
    ],
)
def test_a_process_that_fails_is_the_run_s_failure(program, says, tmp_path, monkeypatch):
    """Whatever it does in the first step; it is gone after that."""
    script, started, popen = tmp_path / "program.py", [], siconos.subprocess.Popen
    state = "STATE = '[[0, NaN, 0], [0, 0, 0], [0, 0, 0]]'"
    script.write_text(f"{state}\nfor _ in range(2):\n    input()\n    print('null', flush=True)\ninput()\n{program}\n")
    monkeypatch.setattr(siconos, "PROGRAM", script)
    monkeypatch.setattr(siconos, "PATIENCE", 2)  # a loaded machine takes half a second to begin
    monkeypatch.setattr(siconos, "locate", lambda named: (sys.executable, "4.4.0"))
    monkeypatch.setattr(siconos.subprocess, "Popen", lambda *a, **b: started.append(popen(*a, **b)) or started[-1])
    task = Task(engine="siconos", parameters=REFERENCE, x0=(0.0,) * 6, t_end=0.01, settings=Settings())
    (run,) = carry_out([task])
    assert run.header.failure.startswith(says)
    assert run.header.versions["siconos"] == "4.4.0"
    assert not run.complete
    assert all(each.returncode is not None for each in started)
