"""The command line: right answers for right questions, one clear line for the others."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import xarray

from compare.commands import cli
from compare.kit.sweep import FIELDS
from mjsim import ContactSettings
from model import Parameters, Trajectory, storage
from model.trajectory import columns


def refused(capsys: pytest.CaptureFixture[str], *argv: object) -> str:
    """The one line in which a command refuses its arguments."""
    code = cli.main([str(arg) for arg in argv])
    captured = capsys.readouterr()
    assert code == 2
    assert captured.out == ""
    assert captured.err.startswith("dualball: error: ")
    assert captured.err.count("\n") == 1
    return captured.err


def test_predict_says_what_the_ball_does_and_what_ends_the_operating_range(capsys: pytest.CaptureFixture[str]) -> None:
    for options, words in (
        ("--omega-0 25", "the ball slips (SS)"),
        ("--set reference", "slip at both points"),
        ("--set high-wall-friction", "the wall can carry it"),
    ):
        assert cli.main(["predict", *options.split()]) == 0
        assert words in " ".join(capsys.readouterr().out.split())
    assert cli.main(["predict", "--mu", "0", "--json"]) == 0
    described = json.loads(capsys.readouterr().out)
    assert described["operating_range"] == 0
    assert described["operating_range_ends"]["by"] == "SMOOTH"


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
    assert "changes its numbers by up to 60%" in shown
    assert "ω₀₁ 10 rad/s two-point rolling" in shown
    assert "would be 3.63 rad/s (-55%)" in shown
    assert cli.main(["predict", "--set", "plastic-in-oil", "--json"]) == 0
    printed = json.loads(capsys.readouterr().out)
    assert printed["model_holds"] is False
    assert list(printed).index("model_holds") < list(printed).index("thresholds")


@pytest.mark.parametrize(("law", "covered"), [("stokes", False), ("schiller-naumann", True)])
def test_predict_says_where_a_law_of_drag_ends(capsys: pytest.CaptureFixture[str], law: str, covered: bool) -> None:
    options = ["predict", "--set", "steel-in-water", "--omega-0", "20", "--drag", law]
    assert cli.main([*options, "--json"]) == 0
    printed = json.loads(capsys.readouterr().out)
    p, solutions = printed["parameters"], {s["case"]: s for s in printed["solutions"]}
    assert p["c"] == Parameters.named("steel-in-water").c
    assert {"RR", "NS"} <= solutions.keys()
    lag, sinking = (solutions[case]["x"][name] for case, name in (("SS", "omega_c"), ("NS", "v_y")))
    assert solutions["SS"]["Re"] == pytest.approx(2 * p["r"] * p["R"] * (20.0 - lag) / p["nu_f"], rel=1e-12)
    assert solutions["NS"]["Re"] == pytest.approx(2 * p["r"] * -sinking / p["nu_f"], rel=1e-12)
    assert [s["drag_law_covers_Re"] for s in solutions.values()] == [
        s["Re"] == 0 or covered for s in solutions.values()
    ]
    assert {case for case, s in solutions.items() if s["Re"] == 0} == {"RR", "SR", "NR"}
    assert cli.main(options) == 0
    shown = " ".join(capsys.readouterr().out.split())
    assert ("Warning: Re = 518 in SS, " in shown) is not covered
    assert "the fluid's inertia (added mass, pressure gradient): it would shift ω₀₁ by -3.8 %, ω₀₂ by +7 %" in shown


def test_predict_without_a_fluid_knows_no_reynolds_number(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["predict", "--omega-0", "25"]) == 0
    assert "Re " not in capsys.readouterr().out
    assert cli.main(["predict", "--omega-0", "25", "--json"]) == 0
    printed = json.loads(capsys.readouterr().out)
    assert printed["fluid_inertia"] is None
    assert printed["model_holds"] is None
    assert {(s["Re"], s["drag_law_covers_Re"]) for s in printed["solutions"]} == {(None, None)}


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


def test_sweep_and_collect(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    where = ["-o", str(tmp_path / "runs"), "--workers", "0", "--time", "0.2"]
    assert cli.main(["sweep", "--vary", "omega_0=5:10:3", "--vary", "eta=0.1,0.3", *where]) == 0
    assert cli.main(["collect", str(tmp_path / "runs"), "-o", str(tmp_path / "all.h5")]) == 0
    with xarray.open_dataset(tmp_path / "all.h5", engine="h5netcdf") as data:
        assert data.sizes["run"] == 6
        assert sorted(set(data.omega_0.values)) == [5.0, 7.5, 10.0]
        assert np.isfinite(data.omega_c).all()
        assert data.omega_c.units == "rad s-1"
    capsys.readouterr()
    assert cli.main(["sweep", "--vary", "eta=0.1:0.5", "--random", "3", "--json", *where]) == 0
    assert json.loads(capsys.readouterr().out)["whole"] == 3


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


def test_a_run_that_diverges_is_kept_and_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
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
raise SystemExit(cli.main(["simulate", "--time", "6", "--sample-interval", "0.005", "-o", sys.argv[2]]))
"""


def test_an_interrupted_run_is_kept_and_goes_on(tmp_path: Path) -> None:
    """Ctrl-C in the second block of samples of five: the third and later are what the same command computes."""

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
    first = sorted(journal.iterdir())
    again = simulate(4, output)  # the journal's two blocks count, and one more is new
    assert again.returncode == 130
    assert sorted(journal.iterdir())[: len(first)] == first
    assert len(storage.load(output.with_suffix(".failed.h5")).time) == 2 * len(part.time)
    assert simulate(0, output).returncode == 0
    assert [path.name for path in output.parent.iterdir()] == ["run.h5"]
    assert simulate(0, tmp_path / "whole.h5").returncode == 0
    run, whole = storage.load(output), storage.load(tmp_path / "whole.h5")
    assert all(np.array_equal(getattr(run, name), getattr(whole, name)) for name in columns(Trajectory))
    assert run.x[: len(part.x)].tobytes() == part.x.tobytes()


def test_a_long_description_is_that_of_its_parts(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    run = str(tmp_path / "run.h5")
    assert cli.main(["simulate", "--time", "1", "--omega-0", "20", "-o", run, "--json"]) == 0
    whole = capsys.readouterr().out
    assert len(json.loads(whole)["cases"]) > 1
    monkeypatch.setattr("compare.view.inspection.PART", 7)
    assert cli.main(["inspect", run, "--json"]) == 0
    assert capsys.readouterr().out == whole


def test_claims_are_listed(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["validate", "--list"]) == 0
    shown = capsys.readouterr().out
    assert all(name in shown for name in ("prop-1", "prop-4"))


def test_help_names_every_command_in_groups_and_says_every_default(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit, match="0"):
        cli.main(["--help"])
    shown = capsys.readouterr().out
    for title, names in cli.GROUPS.items():
        assert f"{title}:" in shown
        assert all(f"\n  {name} " in shown for name in names)
    for name in ("predict", "design", "report", "figures", "inspect", "render", "view"):
        parser = cli._parser([name])._subparsers._group_actions[0].choices[name]
        assert all(action.help for action in parser._actions)
        assert f"Example: dualball {name} " in parser.format_help()
    assert "(default 6)" in cli._parser(["render"])._subparsers._group_actions[0].choices["render"].format_help()


@pytest.mark.parametrize(
    ("argv", "says"),
    [
        ("predict --parameters absent.toml", "cannot read absent.toml: No such file or directory"),
        ("predict --parameters broken.toml", "broken.toml is not valid TOML"),
        ("predict --parameters unknown.toml", "unknown.toml: unknown parameter 'muu' (did you mean 'mu'?)"),
        ("predict --parameters text.toml", "text.toml: m = 'heavy' must be a number in kg"),
        ("predict --set referense", "no parameter set is named 'referense' (did you mean 'reference'?)"),
        ("predict --j 0.7", "j = 0.7 1 is out of range: dimensionless moment of inertia must be > 0 and <= 2/3"),
        ("predict --c=-1", "c = -1 s-1 is out of range"),
        ("predict --nu-f -1e-6", "nu_f = -1e-06 m2 s-1 is out of range"),
        ("predict --mu -.5e0", "mu = -0.5 1 is out of range"),
        ("predict --R -inf", "R = -inf m must be finite"),
        ("simulate --ramp 1 -2e0 -1E-3", "duration = -0.001 s is out of range"),
        ("simulate --start slip=3", "unknown state variable 'slip' (did you mean 'slip_z'?)"),
        ("simulate --start omega_c=fast", "omega_c = 'fast' must be a number in rad s-1"),
        ("simulate --start omega_c=nan", "omega_c = nan rad s-1 must be finite"),
        ("simulate --time=-1", "time = -1 s is out of range"),
        ("simulate --timestep=-1", "timestep"),
        ("simulate --sample-interval=1e-9", "sample_interval = 1e-09 s is out of range"),
        ("simulate --engine event --timestep 0.1", "drake-defaults, siconos, siconos-defaults, not for event"),
        ("simulate --restitution 0.5", "--restitution is for event, time-stepping, not for mujoco"),
        ("simulate --engine event --restitution 1.5", "restitution = 1.5 1 is out of range"),
        ("simulate --flow absent.txt", "cannot read the flow from absent.txt"),
        ("simulate --flow broken.toml", "broken.toml has no line with a time and a value"),
        ("simulate --ramp 1 2 0", "duration = 0 s is out of range"),
        ("simulate --omega-0 5 --ramp 1 2 3", "--omega-0 is for a steady flow, and can't be given beside --ramp"),
        ("figures --results absent", "cannot read absent: there is no such directory"),
        ("simulate --longest-interval 3", "--longest-interval is for --flow"),
        ("simulate -o absent/run.h5", "cannot write absent/run.h5: there is no directory absent"),
        ("sweep --vary omega_0=30:10:5", "omega_0 = 30:10 rad s-1 is in the wrong order"),
        ("sweep --vary omega0=10:30:5", "unknown parameter 'omega0' (did you mean 'omega_0'?)"),
        ("sweep --vary omega_0=10:30:1", "count of omega_0 = 1 points is out of range: must be a whole number >= 2"),
        ("sweep --vary omega_0=10:30:2.5", "count of omega_0 = 2.5 points is out of range"),
        ("sweep --vary omega_0=10:30:many", "count of omega_0 = 'many' must be a number in points"),
        ("sweep --vary omega_0=10:30:3:4", "'omega_0=10:30:3:4' is no range"),
        ("sweep --vary eta=0.1:0.2 --random 0", "random = 0 points is out of range: must be a whole number >= 1"),
        ("sweep --vary eta=0.1,0.2 --limit 0", "limit = 0 s is out of range: must be > 0"),
        ("sweep --vary omega_0=a:b:3", "omega_0 = 'a' must be a number in rad s-1"),
        ("sweep --vary eta=0.1:0.2:3 --direction up", "vary omega_0 and nothing else"),
        ("sweep --vary eta=0.1,0.2,0.3 --random 4", "here eta needs a range: write eta=from:to"),
        ("collect absent", "cannot read absent: there is no such directory"),
        ("inspect absent.h5", "cannot read absent.h5: there is no such file"),
        ("inspect broken.toml", "cannot read broken.toml: it is not an HDF5 file"),
        ("validate --claim prop1", "no claim is called 'prop1'"),
        ("validate -o broken.toml", "cannot write to broken.toml"),
        ("report absent", "cannot read absent/summary.json: No such file or directory"),
    ],
)
def test_mistakes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], argv: str, says: str
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("broken.toml").write_text("m = ")
    Path("unknown.toml").write_text("muu = 0.2")
    Path("text.toml").write_text("m = 'heavy'\n" + "".join(f"{k} = 0.1\n" for k in list(FIELDS)[1:]))
    before = sorted(Path().iterdir())
    assert says in refused(capsys, *argv.split())
    assert sorted(Path().iterdir()) == before  # and nothing is left half written


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write everywhere")
def test_a_directory_that_cannot_be_written(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    tmp_path.chmod(0o500)
    assert "Permission denied" in refused(capsys, "validate", "-o", tmp_path)
