"""The command line: right answers for right questions, one clear line for the others."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import xarray

from compare.bench import league
from compare.catalogue import CLAIMS
from compare.commands import cli, parsers
from compare.kit import engines
from mjsim import ContactSettings
from model import Parameters, Trajectory, storage
from model.trajectory import columns
from tests.commands import COMMANDS, parser_of, refused

ROOT = Path(cli.__file__).parents[2]


def test_predict_says_what_the_ball_does_and_what_ends_the_operating_range(capsys: pytest.CaptureFixture[str]) -> None:
    for given, words in (
        ("--omega-0 25", "the ball slips (SS)"),
        ("--omega_0 25", "the ball slips (SS)"),
        ("--set reference", "slip at both points"),
        ("--set high-wall-friction", "the wall can carry it"),
    ):
        assert cli.main(["predict", *given.split()]) == 0
        shown = " ".join(capsys.readouterr().out.split())
        assert words in shown
        assert "Re " not in shown  # without a fluid there is no Reynolds number
    assert cli.main(["predict", "--mu", "0", "--json"]) == 0
    described = json.loads(capsys.readouterr().out)
    assert described["operating_range"] == 0
    assert described["operating_range_ends"]["by"] == "SMOOTH"
    assert described["fluid_inertia"] is described["model_holds"] is None
    assert {(s["Re"], s["drag_law_covers_Re"]) for s in described["solutions"]} == {(None, None)}


def test_predict_waits_for_no_heavy_package() -> None:
    """Formulas need numpy only; the engines, scipy and the figures would take most of a second to load."""
    code = "import sys; from compare.commands import cli; cli.main(['predict']); print(*sys.modules, file=sys.stderr)"
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stderr.split()
    assert "analytic.stationary.solutions" in loaded
    assert not {"h5py", "matplotlib", "mujoco", "numba", "scipy"} & set(loaded)


def test_predict_doubts_the_model_before_any_threshold(capsys: pytest.CaptureFixture[str]) -> None:
    """Plastic in oil: the fluid's torque, more than the drag, makes omega_c less than half of omega_0."""
    assert cli.main(["predict", "--set", "plastic-in-oil"]) == 0
    shown = " ".join(capsys.readouterr().out.split())
    assert shown.startswith("Warning: the paper's model doesn't hold for this fluid.")
    assert "changes its numbers by up to 60 %" in shown
    assert "ω₀₁ 9.73 rad/s two-point rolling" in shown
    assert "would be 3.63 rad/s (-55 %)" in shown
    assert cli.main(["predict", "--set", "plastic-in-oil", "--json"]) == 0
    printed = json.loads(capsys.readouterr().out)
    assert printed["model_holds"] is False
    assert list(printed).index("model_holds") < list(printed).index("thresholds")


def test_the_first_lines_of_the_readme_print_what_it_says(capsys: pytest.CaptureFixture[str]) -> None:
    code, printed = re.findall(r"```(?:python)?\n(.*?)```", (ROOT / "README.md").read_text("utf-8"), re.DOTALL)[:2]
    exec(code, {})
    assert capsys.readouterr().out == printed


@pytest.mark.parametrize("package", ["analytic", "mjsim", "compare.testing"])
def test_a_foreign_model_is_named(tmp_path: Path, package: str) -> None:
    (tmp_path / "model.py").touch()
    where = {**os.environ, "PYTHONPATH": f"{tmp_path}{os.pathsep}{ROOT}"}
    command = [sys.executable, "-c", f"import {package}"]
    failed = subprocess.run(command, env=where, cwd=tmp_path, capture_output=True, text=True)
    last = failed.stderr.splitlines()[-1]
    assert last.startswith(f"ImportError: {tmp_path / 'model.py'} hides the package model of dualball: rename that")
    program = [sys.executable, "-m", "compare", "--version"]  # which finds its own beside it
    subprocess.run(program, env={**os.environ, "PYTHONPATH": str(ROOT)}, cwd=tmp_path, capture_output=True, check=True)


@pytest.mark.parametrize(("law", "covered"), [("stokes", False), ("schiller-naumann", True)])
def test_predict_says_where_a_law_of_drag_ends(capsys, law, covered):
    options = ["predict", "--set", "steel-in-water", "--omega-0", "20", "--drag", law]
    assert cli.main([*options, "--json"]) == 0
    printed = json.loads(capsys.readouterr().out)
    p, solutions = printed["parameters"], {s["case"]: s for s in printed["solutions"]}
    speeds = {"SS": p["R"] * (20.0 - solutions["SS"]["x"]["omega_c"]), "NS": -solutions["NS"]["x"]["v_y"]}
    for case, solved in solutions.items():
        assert solved["Re"] == pytest.approx(2 * p["r"] * speeds.get(case, 0.0) / p["nu_f"], rel=1e-12)
        assert solved["drag_law_covers_Re"] is (solved["Re"] == 0 or covered)
    assert cli.main(options) == 0
    shown = " ".join(capsys.readouterr().out.split())
    assert ("Warning: Re = 518 in SS, " in shown) is not covered
    assert "the fluid's inertia (added mass, pressure gradient): it would shift ω₀₁ by -3.8 %, ω₀₂ by +7 %" in shown


def test_simulate_inspect_and_xarray(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    run = tmp_path / "run.h5"
    argv = ["simulate", "--omega-0", "25", "--start", "omega_c=13.8", "--time", "0.5", "-o", str(run), "--json"]
    assert cli.main(argv) == 0
    printed = json.loads(capsys.readouterr().out)
    assert printed["complete"]
    assert cli.main(["inspect", str(run), "--plot", str(tmp_path / "run.png")]) == 0
    assert "omega_0 = 25" in capsys.readouterr().out
    assert (tmp_path / "run.png").stat().st_size > 10_000
    with xarray.open_dataset(run, engine="h5netcdf") as data:
        assert data.time[-1] == pytest.approx(0.5)
        assert float(data.omega_c[-1]) == printed["last"]["omega_c"]


@pytest.mark.parametrize(
    ("flow", "last"),
    [
        (["--ramp", "10", "20", "0.2"], 20),
        (["--staircase", "0.1", "10", "12", "14"], 14),
        (["--sine", "10", "2", "2.5", "1", "5"], 8),
        (["--flow", "flow.csv"], 9),
    ],
)
def test_flows(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, flow: list[str], last: float) -> None:
    monkeypatch.chdir(tmp_path)
    Path("flow.csv").write_text("0, 3\n0.1, 9\n")
    assert cli.main(["simulate", "--time", "0.3", *flow, "-o", "run.h5"]) == 0
    trajectory = storage.load("run.h5")
    assert trajectory.header.flow(0.3) == pytest.approx(last)


@pytest.mark.parametrize("design", [["--vary", "eta=0.1,0.5"], ["--vary", "eta=0.1:0.5", "--random", "2"]])
def test_each_set_of_a_sweep_has_contacts_that_suit_it(tmp_path: Path, design: list[str]) -> None:
    """Fast contacts would chatter where mu eta is large; on the other set they are the defaults."""
    given = ["--mu", "0.5", "--timestep", "0.002", "--time", "0.05", "--workers", "0", "-o", str(tmp_path)]
    assert cli.main(["sweep", *design, *given]) == 0
    headers = [run.header for path in tmp_path.glob("*.h5") for run in storage.load_runs(path).values()]
    for header in headers:
        suited = ContactSettings.at(0.002).suited(header.parameters)
        assert tuple(header.settings["solref"]) == suited.solref
    assert len({tuple(header.settings["solref"]) for header in headers}) == 2


def test_a_run_that_diverges_is_kept_and_told(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)  # where MuJoCo would leave its MUJOCO_LOG.TXT
    run = tmp_path / "run.h5"
    assert cli.main(["simulate", "--start", "omega_c=1e9", "--time", "0.1", "-o", str(run)]) == 1
    err = capsys.readouterr().err
    assert "diverged by t =" in err
    kept = tmp_path / "run.failed.h5"
    assert f"its samples so far are kept in {kept}" in err
    assert not storage.load(kept).complete
    assert not run.exists()
    assert cli.main(["simulate", "--time", "0.1", "-o", str(run)]) == 0
    assert [path.name for path in tmp_path.iterdir()] == ["run.h5"]


INTERRUPTED = """
import os, signal, sys
from compare.commands import cli, simulate
from compare.kit import tasks
from mjsim.journal import Journal
signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell starts what runs in the background without
tasks.LONG, stop_after = 1000, int(sys.argv[1])
tasks.Journal = lambda directory: Journal(directory, interval=0.0)
store, stored = tasks.store, 0
def pressing(task, path, stop):
    def pressed():
        global stored
        stored += 1
        if stored == stop_after:
            os.kill(os.getpid(), signal.SIGINT)
        return stop()
    return store(task, path, stop=pressed)
simulate.store = pressing
raise SystemExit(cli.main(["simulate", "--time", "90", "--sample-interval", "0.004", "-o", sys.argv[2]]))
"""


def test_an_interrupted_run_is_kept_and_goes_on(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Ctrl-C in the second block of thousands of steps: the same command computes the third and later ones."""

    def simulate(stop_after: int, output: Path) -> subprocess.CompletedProcess[str]:
        command = [sys.executable, "-c", INTERRUPTED, str(stop_after), str(output)]
        return subprocess.run(command, capture_output=True, text=True)

    output = tmp_path / "run" / "run.h5"
    output.parent.mkdir()
    stopped = simulate(2, output)
    assert stopped.returncode == 130
    (journal,) = output.parent.glob("*.journal")
    assert f"kept in {output.with_suffix('.failed.h5')}, and the same command goes on from what {journal}" in (
        stopped.stderr
    )
    part = storage.load(output.with_suffix(".failed.h5"))
    assert part.header.failure == f"was stopped at t = {part.time[-1]:g} s"
    first = min(journal.iterdir())
    kept = first.stat().st_mtime_ns
    again = simulate(4, output)  # the journal's two blocks count, and one more is new
    assert (again.returncode, first.stat().st_mtime_ns) == (130, kept)
    assert len(storage.load(output.with_suffix(".failed.h5")).time) == 2 * len(part.time)
    words = ["simulate", "--time", "90", "--sample-interval", "0.004", "-o"]
    with monkeypatch.context() as patch:
        patch.setattr("compare.kit.tasks.LONG", 1000)
        assert cli.main([*words, str(output)]) == 0
    assert [path.name for path in output.parent.iterdir()] == ["run.h5"]
    whole = tmp_path / "whole.h5"
    assert cli.main([*words, str(whole)]) == 0
    run, whole = storage.load(output), storage.load(whole)
    assert all(np.array_equal(getattr(run, name), getattr(whole, name)) for name in columns(Trajectory))
    assert run.x[: len(part.x)].tobytes() == part.x.tobytes()


def test_a_long_description_is_that_of_its_parts(tmp_path, monkeypatch, capsys):
    run = str(tmp_path / "run.h5")
    assert cli.main(["simulate", "--time", "1", "--omega-0", "20", "-o", run, "--json"]) == 0
    whole = capsys.readouterr().out
    assert len(json.loads(whole)["cases"]) > 1
    monkeypatch.setattr("compare.view.motions.PART", 7)
    assert cli.main(["inspect", run, "--json"]) == 0
    assert capsys.readouterr().out == whole


def test_help_names_every_command_in_groups_with_meanings_defaults_and_an_example(
    capsys,
):
    with pytest.raises(SystemExit, match="0"):
        cli.main(["--help"])
    shown = capsys.readouterr().out
    for title, names in parsers.GROUPS.items():
        assert f"{title.capitalize()}:" in shown
        assert all(f"\n  {name} " in shown for name in names)
    lacking = []
    for name in COMMANDS:
        told = " ".join(parser_of(name).format_help().split())
        actions = [each for each in parser_of(name)._actions if each.dest != "help"]
        lacking += [f"{name} {each.dest}: meaning" for each in actions if not each.help]
        lacking += [
            f"{name} {each.dest}: default"
            for each in actions
            if each.nargs != 0
            and isinstance(each.default, int | float)
            and each.default
            and "(default" not in (each.help or "")
            if f"(default {each.default:g})" not in told
        ]
        lacking += [f"{name}: example"] * (f"Example: dualball {name}" not in told)
    assert not lacking


def test_help_names_every_engine() -> None:
    for command, known in (("simulate", engines.ENGINES), ("league", league.ENTRIES)):
        told = set(re.findall(r"[\w-]+", re.sub(r"-\s+", "-", parser_of(command).format_help())))
        assert not {name for name in known if not {name, name.removesuffix("-defaults")} & told}


def test_the_tutorial_carries_out_every_command() -> None:
    """But for the page that waits for a browser."""
    shown = re.findall(r"^!dualball (\S+)", (ROOT / "docs" / "tutorial.md").read_text("utf-8"), re.MULTILINE)
    assert {*shown} | {"explore"} == {*COMMANDS}


def test_every_claim_is_listed(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.delenv("COLUMNS", raising=False)  # names wrap in narrow terminals
    assert cli.main(["validate", "--list"]) == 0
    assert {claim.id for claim in CLAIMS} <= set(capsys.readouterr().out.split())


def test_parameters_are_described_once(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["parameters", "--mu", "0.31"]) == 0
    shown = capsys.readouterr().out
    for field in Parameters.quantities():
        option = f"--{field.name.replace('_', '-')} "
        assert option in shown
        assert option not in parser_of("sweep").format_help().replace("--mu 0.3 --omega-0 25", "")
    assert "0.31" in shown


@pytest.mark.parametrize(
    ("argv", "says"),
    [
        ("predict --parameters broken.toml", "broken.toml is not valid TOML"),
        ("predict --j 0.7", "argument --j: 0.7 is out of range: it must be > 0 and <= 2/3"),
        ("predict --nu-f -1e-6", "argument --nu-f: -1e-06 m²/s is out of range: it must be >= 0"),
        ("predict --omega-0 1e155", "omega_0 = 1e+155 rad s-1 is out of range"),
        ("simulate --ramp 1 -2e0 -1E-3", "duration = -0.001 s is out of range"),
        ("simulate --start slip=3", "unknown state variable 'slip' (did you mean 'slip_z'?)"),
        ("simulate --sample-interval 100 --time 1", "sample_interval = 100 s is out of range: within this run"),
        ("simulate -o run.csv", "'run.csv' would hold HDF5: its name must end in .h5"),
        ("simulate --engine event --timestep 0.1", "--timestep is not for event, which takes --rtol and --restitution"),
        ("simulate --flow broken.toml", "broken.toml, line 1: no column is called time; there are 'm', '='"),
        ("simulate --omega-0 5 --ramp 1 2 3", "--omega-0 is for a steady flow, and can't be given beside --ramp"),
        ("simulate --longest-interval 3", "--longest-interval is for --flow"),
        ("sweep --vary omega_0=30:10:5", "omega_0 = 30:10 rad s-1 is in the wrong order"),
        ("sweep --vary omega_0=10:30", "here omega_0 needs values: write omega_0=from:to:count or omega_0=a,b,c"),
        ("sweep --vary omega0=10:30:5", "unknown parameter 'omega0' (did you mean 'omega_0'?)"),
        ("sweep --vary omega_0=10:30:2.5", "count of omega_0 = 2.5 points is out of range"),
        ("sweep --vary eta=1:2:400 --vary mu=1:2:400", "the grid = 160000 runs is out of range: must be >= 1 and <= 1"),
        ("sweep --vary eta=1:2:3 --vary eta=1:2:3", "eta is given 2 ranges: one is enough"),
        ("sweep --vary eta=0.1:0.2:3 --direction up", "vary omega_0 and nothing else"),
        ("sweep --vary eta=0.1,0.2,0.3 --random 4", "here eta needs a range: write eta=from:to"),
        ("judge absent", "cannot read absent/summary.json: No such file or directory"),
        ("attractors --follow omega_0=60", "omega_0=from:to"),
        ("attractors --c 0 --random 1", "say how long"),
        ("basins --across y=0:1:2 --up y=0:1:3", "across and up are both y: a plane needs two state variables"),
        ("basins --across y=0:1:2 --up h=0:99:2 --results new/map", "h = 99 m is out of range"),
        ("simulate --tme=3 --omega-0 5", "there is no option '--tme' (did you mean '--time'?)"),
        ("predict extra", "'extra' is one argument too many"),
        (
            "sweep --vary eta=0.1,0.2 --workers 1e5",
            "--workers: 100000 is out of range: it must be a whole number >= 0 and",
        ),
        ("cases block-rests -o new", "-o writes all cases: 'block-rests' has no effect beside it"),
        ("simulate --start omega_c=5 omega_c=6", "--start names omega_c twice"),
        ("simulate --view --time 3", "--time has no effect beside --view"),
        ("simulate --view --engine event", "--view shows MuJoCo, not event"),
        ("simulate --speed 2", "--speed is for --view"),
        ("sweep --vary eta=1:2:3 --eta=0.2", "--eta has no effect: eta is varied"),
        ("sweep --vary eta=1:2:3 --seed 2", "--seed is for --random"),
        ("basins --across y=0:1:2 --up h=0:0.01:2 --start y=0.1", "--start y has no effect: y spans the plane"),
        ("basins --across y=0:1:2 --up h=0:0.01:2 --plot a.png", "basins --plot is -o now"),
        ("view --omega-0 3", "'dualball simulate --view' opens the viewer"),
        ("report", "no command 'report' any more: 'dualball judge'"),
        ("grade mine.xml", "league --settings FILE.xml"),
        ("sweep --vary eta=1,2 -o all.h5", "'all.h5' would be a directory, but its name is that of a file"),
        ("league --engine mujco", "did you mean 'mujoco'?"),
        ("design absent.toml", "cannot read absent.toml: No such file or directory"),
    ],
)
def test_mistakes(tmp_path, monkeypatch, capsys, argv, says):
    monkeypatch.chdir(tmp_path)
    Path("broken.toml").write_text("m = ")
    before = sorted(Path().iterdir())
    assert says in refused(capsys, *argv.split())
    assert sorted(Path().iterdir()) == before  # and nothing is left half written


def test_shells_complete_commands_options_and_files(tmp_path, monkeypatch, capsys):
    pytest.importorskip("shtab")
    for shell in ("bash", "zsh", "fish"):
        with pytest.raises(SystemExit, match="0"):
            cli.main(["--print-completion", shell])
        text = capsys.readouterr().out
        assert "explore" in text
        assert "sample-interval" in text
        (tmp_path / shell).write_text(text)
    words = "source ./bash; COMP_WORDS=(dualball sim); COMP_CWORD=1; _shtab_dualball; echo ${COMPREPLY[@]}"
    assert subprocess.run(["bash", "-c", words], cwd=tmp_path, capture_output=True, text=True).stdout == "simulate\n"
    assert cli.main(["--print-completion", "dos"]) == 2
    assert "takes one of bash" in capsys.readouterr().err
    monkeypatch.setitem(sys.modules, "shtab", None)
    assert cli.main(["--print-completion", "bash"]) == 2
    assert "dualball[completion]" in capsys.readouterr().err
