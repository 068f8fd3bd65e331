"""The command line: right answers for right questions, one clear line for the others."""

import itertools
import json
import os
import re
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from compare.bench import league
from compare.campaign import tasks
from compare.commands import cli, design, parsers, simulate
from compare.engines import study
from compare.subjects.catalogue import CLAIMS
from model import Parameters, storage
from tests.commands import ROOT, carried_out, parser_of, python, refused, told


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (
            "--omega-0 25",
            r"^At ω₀ = 25 rad/s the ball slips \(SS\).*with the fluid up to ω₀ = 13\.562 rad/s",
        ),
        ("--omega-0 25", "^((?!fluid's torque on).)*$"),  # where no fluid is known
        ("--fluid-torque 0.0763", r"would be 11\.2 rad/s \(-6 %\) at the rate of 0\.0763 1/s"),
        ("--omega_0 25", r"the ball slips \(SS\)"),
        ("--set reference", "slip at both points"),
        ("--set high-wall-friction", "the wall can carry it"),
        (
            "--set plastic-in-oil",
            "^Warning: the paper's model doesn't hold for this fluid: it is off by up to",
        ),
        # by the fluid's torque
        ("--set plastic-in-oil", r"the rolling ball's ω_c would be [\d.]+ rad/s \(-\d+ %\)"),
        ("--set steel-in-water", "the fluid's inertia .*: it would shift ω₀₁ by "),
        ("--set steel-in-water --omega-0 20 --drag stokes", r"Warning: Re = \d+ in SS, "),
        ("--set steel-in-water --omega-0 20", "^((?!Warning: Re).)*$"),
        ("--drag quadratic --nu-f 1e-6", r"within the case +algebraically +unstable"),
    ],
)
def test_predict_says_what_the_ball_does_what_ends_the_operating_range_and_what_to_doubt(
    capsys, given, said
):
    assert re.search(said, told(capsys, f"predict {given}"))


def test_predict_says_where_the_fluid_and_a_law_of_drag_end(capsys):
    smooth = json.loads(told(capsys, "predict --mu 0 --json"))
    assert (smooth["operating_range"], smooth["operating_range_ends"]["by"]) == (0, "SMOOTH")
    assert smooth["fluid_inertia"] is smooth["model_holds"] is None  # without a fluid
    assert {(s["Re"], s["drag_law_covers_Re"]) for s in smooth["solutions"]} == {(None, None)}
    assert json.loads(told(capsys, "predict --set plastic-in-oil --json"))["model_holds"] is False
    line = "predict --set steel-in-water --omega-0 20 --drag stokes --json"
    water = json.loads(told(capsys, line))
    p, solutions = Parameters(**water["parameters"]), {s["case"]: s for s in water["solutions"]}
    speeds = {
        "SS": p.R * (20.0 - solutions["SS"]["x"]["omega_c"]),
        "NS": -solutions["NS"]["x"]["v_y"],
    }
    for case, solved in solutions.items():
        assert solved["Re"] == pytest.approx(2 * p.r * speeds.get(case, 0.0) / p.nu_f, rel=1e-12)
        assert solved["drag_law_covers_Re"] is (case not in speeds)


def test_predict_waits_for_no_heavy_package():
    """Formulas need numpy only; the engines, scipy and the figures would take most of a second to
    load."""
    code = (
        "import sys; from compare.commands import cli; cli.main(['predict']); "
        "print(*sys.modules, file=sys.stderr)"
    )
    loaded = python("-c", code).stderr.split()
    assert "analytic.stationary.solutions" in loaded
    assert not {"h5py", "matplotlib", "mujoco", "numba", "scipy"} & set(loaded)


FOREIGN = """
import importlib
for name in ("analytic", "mjsim", "compare.testing"):
    try:
        importlib.import_module(name)
    except ImportError as error:
        print(error)
"""


def test_a_foreign_model_is_named(here):
    (here / "model.py").touch()
    said = python("-c", FOREIGN, PYTHONPATH=f"{here}{os.pathsep}{ROOT}").stdout.splitlines()
    hides = f"{here / 'model.py'} hides the package model of dualball: rename"
    assert [line.startswith(hides) for line in said] == [True] * 3
    python("-m", "compare", "--version")


def test_a_run_is_described_as_it_is_stored(tmp_path, capsys):
    run = tmp_path / "run.h5"
    printed = told(capsys, f"simulate --omega-0 25 --time 2 -o {run} --json")
    about, kept = json.loads(printed), storage.load(run)
    assert about["complete"]
    assert len(about["cases"]) > 1
    assert about["last"]["omega_c"] == kept.omega_c[-1]
    assert "omega_0 = 25" in told(capsys, f"inspect {run}")
    assert told(capsys, f"inspect {run} --json") == printed


@pytest.mark.parametrize(
    ("flow", "last"),
    [
        ("--ramp 10 20 0.2", 20),
        ("--staircase 0.1 10 12 14", 14),
        ("--sine 10 2 2.5 1 5", 8),
        ("--flow flow.csv", 9),
    ],
)
def test_flows(here, capsys, flow, last):
    Path("flow.csv").write_text("0, 3\n0.1, 9\n")
    told(capsys, f"simulate --engine event --time 0.3 {flow} -o run.h5")
    assert storage.load("run.h5").header.flow(0.3) == pytest.approx(last)


def test_a_flow_that_begins_after_the_run_is_refused(tmp_path, capsys):
    """As one with the times of a clock: the ball would meet its first value alone."""
    (clock := tmp_path / "clock.csv").write_text("1700000000, 3\n1700000001, 9\n")
    said = refused(capsys, "simulate", "--flow", clock, "--time", 5)
    assert "begins at t = 1700000000 s, but the run, from 0 on, ends at 5 s" in said


def test_a_flow_that_is_cut_off_says_so(tmp_path, capsys):
    (long := tmp_path / "long.csv").write_text("0, 3\n60, 9\n")
    words = "simulate", "--engine", "event", "--flow", long
    *_, said = carried_out(capsys, *words)
    assert "lasts 60 s, of which the first 10 s are run" in said
    *_, said = carried_out(capsys, *words, "--time", 1)
    assert not said


@pytest.mark.parametrize("design", ["--vary eta=0.1,0.5", "--vary eta=0.1:0.5 --random 2"])
def test_each_set_of_a_sweep_has_contacts_that_suit_it(tmp_path, capsys, design):
    """Fast contacts would chatter where mu eta is large; on the other set they are the defaults."""
    given = "--engine mujoco-plain --mu 0.5 --timestep 0.002 --time 0.05"
    told(capsys, f"sweep {design} {given} --workers 0 -o {tmp_path}")
    headers = [
        run.header for path in tmp_path.glob("*.h5") for run in storage.load_runs(path).values()
    ]
    for header in headers:
        suited = study.plain(0.002).suited(header.parameters)
        assert tuple(header.settings["solref"]) == suited.solref
    assert len({tuple(header.settings["solref"]) for header in headers}) == 2


def test_attractors_says_what_is_undecided_and_what_it_did_last(capsys, tmp_path):
    """JSON, and a page with a row for each set."""
    page = tmp_path / "page.md"
    line = "attractors --set hopping --start omega_c=20 --time 1 --vary omega_0=60,70"
    line += f" -o {page} --json"
    data = json.loads(told(capsys, line))
    assert [each["omega_0"] for each in data["sets"]] == [60, 70]
    for (only,) in (each["attractors"] for each in data["sets"]):
        assert only["kind"] == "undecided"
        assert only["low"]["omega_c"] <= only["mean"]["omega_c"] <= only["high"]["omega_c"]
    head, _, table = page.read_text("utf-8").partition("| omega_0")
    for words in ("μ = 0.45554, η = 0.072543", "ω₀ = 69.211 rad/s", f"dualball {line}"):
        assert words in head
    assert len([row for row in table.splitlines() if row.startswith("|")]) == 1 + 2


def test_a_run_that_diverges_is_kept_and_told(here, capsys):
    code, _, said = carried_out(capsys, "simulate --start y=1e11 --time 0.1 -o run.h5")
    assert code == 1
    assert re.search(r"diverged by t = .*; its samples so far are kept in run\.failed\.h5", said)
    assert not storage.load("run.failed.h5").complete
    # MuJoCo would leave its MUJOCO_LOG.TXT beside it
    assert [path.name for path in here.iterdir()] == ["run.failed.h5"]
    told(capsys, "simulate --time 0.1 -o run.h5")
    assert [path.name for path in here.iterdir()] == ["run.h5"]


@pytest.mark.parametrize(("interval", "block"), [(0.004, 2), (20.0, 8)])
def test_an_interrupted_run_is_kept(tmp_path, monkeypatch, capsys, interval, block):
    """By Ctrl-C in a later block of steps, which may be without a sample; the same command then
    makes it whole."""
    store, file = tasks.store, tmp_path / "run.h5"
    line = f"simulate --time 90 --sample-interval {interval} -o {file}"

    def pressing(task, path, stop, **given):
        blocks = itertools.count(1)

        def pressed():
            if next(blocks) == block:
                signal.raise_signal(signal.SIGINT)
            return stop()

        return store(task, path, stop=pressed, **given)

    with monkeypatch.context() as pressed:
        pressed.setattr(simulate, "store", pressing)
        code, _, said = carried_out(capsys, line)
    assert code == 130, said
    part = storage.load(tmp_path / "run.failed.h5")
    assert f"its samples so far are kept in {tmp_path / 'run.failed.h5'}" in said
    assert part.header.failure == f"was stopped at t = {part.time[-1]:g} s"
    told(capsys, line)
    assert [path.name for path in tmp_path.iterdir()] == ["run.h5"]
    np.testing.assert_array_equal(storage.load(file).x[: len(part.time)], part.x)


def test_help_names_every_command_engine_and_option_and_gives_examples_that_are_right(here, capsys):
    with pytest.raises(SystemExit, match="0"):
        cli.main(["--help"])
    shown = capsys.readouterr().out
    for title, names in parsers.GROUPS.items():
        assert f"{title.capitalize()}:" in shown
        assert all(f"\n  {name} " in shown for name in names)
    for name, command in parsers.COMMANDS.items():
        parser = parser_of(name)
        assert all(action.help for action in parser._actions)
        assert f"Example: dualball {name} {command.example}" in " ".join(
            parser.format_help().split()
        )
        parser.parse_args(command.example.split())
    assert "(default 30)" in parser_of("sweep").format_help()
    designs = parser_of("design").format_help()
    for fields in (design._FLUID, design._FLOW, design._BOUNDS, design._TOLERANCES, ["exit code"]):
        assert all(name in designs for name in fields)
    for name, known in (("simulate", study.ENGINES), ("league", league.ENTRIES)):
        words = set(re.findall(r"[\w-]+", re.sub(r"-\s+", "-", parser_of(name).format_help())))
        assert not {each for each in known if not {each, each.removesuffix("-defaults")} & words}


def test_claims_and_parameters_are_listed_once(monkeypatch, capsys):
    monkeypatch.delenv("COLUMNS", raising=False)  # names wrap in narrow terminals
    listed = told(capsys, "validate --list")
    assert {claim.id for claim in CLAIMS} <= set(listed.split())
    assert not [line for line in listed.splitlines() if line.endswith(" ")]
    shown, of_sweep = told(capsys, "parameters --mu 0.31"), parser_of("sweep").format_help()
    assert "0.31" in shown
    for field in Parameters.quantities():
        option = f"--{field.name.replace('_', '-')} "
        assert option in shown
        assert option not in of_sweep.replace("--mu 0.3 --omega-0 25", "")


COMPLETED = {
    "dualball sim": "simulate",
    "dualball predict --set stee": "steel-in-water",
    "dualball predict --drag sch": "schiller-naumann",
    "dualball simulate --engine mujoco-pl": "mujoco-plain",
    "dualball league --engine newton-k": "newton-kamino",
    "dualball validate --claim fig-13-l": "fig-13-left",
    "dualball figures --figure fig-1": "fig-13-right",
    "dualball figures --format p": "pdf",
    "dualball cases drill": "drilling-sphere",
}
"""Lines, and what bash offers for the last word."""


def test_shells_complete_commands_and_options(tmp_path, monkeypatch, capsys):
    for shell in ("zsh", "fish", "bash"):
        with pytest.raises(SystemExit, match="0"):
            cli.main(["--print-completion", shell])
        text = capsys.readouterr().out
        assert "sample-interval" in text
    (tmp_path / "bash").write_text(text)
    asked = "".join(
        f"COMP_WORDS=({line}); COMP_CWORD={line.count(' ')}; COMPREPLY=(); _shtab_dualball\n"
        'echo "${COMPREPLY[@]}"\n'
        for line in COMPLETED
    )
    words = ["bash", "-c", f"source ./bash\n{asked}"]
    done = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True)
    for (line, found), offered in zip(COMPLETED.items(), done.stdout.splitlines(), strict=True):
        assert found in offered.split(), line
    monkeypatch.setitem(sys.modules, "shtab", None)
    assert "pip install shtab" in refused(capsys, "--print-completion", "bash")
