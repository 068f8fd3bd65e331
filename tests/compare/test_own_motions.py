"""Assertions about one's own motions fail just where they should, and two motions are told
apart."""

import json
from pathlib import Path

import h5py
import numpy as np
import pytest
import xarray

import analytic
from compare.testing import assert_settles, assert_tracks, difference, read
from model import InputError, Parameters, storage
from tests.commands import told

pytest_plugins = ("pytester",)
P = Parameters.named("reference").replace(omega_0=25.0)


@pytest.fixture(scope="module")
def theory():
    return analytic.simulate(P, [0.0] * 6, 12.0)


def wrong(run, error):
    """The motion, some percent too slow."""
    return run.time[::3], run.omega_c[::3] * (1 - error)


def test_a_ball_that_settles(theory):
    for case in (None, "SS"):
        assert_settles(*wrong(theory, 0.9e-3), P, case=case, rtol=1e-3)
        with pytest.raises(
            AssertionError, match=r"does not settle in SS.* within 0\.001 of 13\.85"
        ):
            assert_settles(*wrong(theory, 1.1e-3), P, case=case, rtol=1e-3)
    with pytest.raises(AssertionError, match=r"does not settle in SS: .*; it settles in NS"):
        assert_settles(np.linspace(0, 60, 500), np.full(500, 25.0), P, rtol=1e-3)
    # 30 s are enough, as slip lets drag grow
    steel = Parameters.named("steel-in-water").replace(omega_0=23.0)
    run = analytic.simulate(steel, [0.0] * 6, 30.0)
    assert_settles(run.time, run.omega_c, steel, case="SS", rtol=1e-3)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"part": slice(400)}, r"too short to judge: it lasts 4\.\d+ s and should last 7\.2 s"),
        ({"part": slice(0, None, 300)}, "too short to judge: 4 samples"),
        ({"case": "XS"}, "no case 'XS'"),
        ({"case": "RR"}, "no stable stationary solution"),
        ({"p": P.replace(c=0.0)}, "c = 0 s-1"),
        ({"rtol": -1.0}, "rtol"),
        ({"spoilt": np.nan}, "omega_c is nan in sample 7, at t = "),
    ],
)
def test_what_cannot_be_judged(theory, given, message):
    part, spoilt = given.pop("part", slice(None)), given.pop("spoilt", 0.0)
    w = theory.omega_c.copy()
    w[7] += spoilt
    with pytest.raises(InputError, match=message):
        assert_settles(theory.time[part], w[part], **{"p": P, "rtol": 1e-3} | given)


def test_tracking(theory):
    assert_tracks(wrong(theory, 0.9e-3), theory, rms=1e-3)
    with pytest.raises(
        AssertionError, match=r"does not track event: rms .*e-03 > 0.001 .*; farthest off at t = "
    ):
        assert_tracks(wrong(theory, 1.1e-3), theory, rms=1e-3)
    mine = read({"time": theory.time, "slip_x": theory.slip_x + 1}, "x")
    with pytest.raises(AssertionError, match="slip_x of x"):
        assert_tracks(mine, theory, quantity="slip_x", rms=0.1)
    coarse = (theory.time[::40], theory.omega_c[::40])
    for part, message in (
        (slice(20, -20, 40), "too far apart"),
        (slice(5), "5 samples while both last"),
    ):
        with pytest.raises(InputError, match=message):
            assert_tracks(
                (theory.time[part], theory.omega_c[part]), coarse if part.step else theory, rms=1e-4
            )
    with pytest.raises(
        InputError, match="the reference lasts from 0 to 12 s, but the motion from 0 to 24"
    ):
        assert_tracks((theory.time * 2, theory.omega_c), theory, rms=1.0)
    with pytest.raises(InputError, match=r"no omega_x.*did you mean 'omega_"):
        assert_tracks(theory, theory, quantity="omega_x", rms=1.0)


def test_pytest_shows_the_test_that_fails_and_no_line_of_ours(pytester):
    pytester.makepyfile(
        """
        import numpy as np
        from compare.testing import assert_tracks

        def test_mine():
            t = np.linspace(0, 1, 50)
            assert_tracks((t, t), (t, 1 + t), rms=1e-3)

        def test_bad():
            assert_tracks(([0, 1], [0, np.nan]), ([0, 1], [0, 1]), rms=1e-3)
        """
    )
    shown = pytester.runpytest("-p", "no:cacheprovider").stdout.str()
    assert "omega_c of the motion does not track the motion: rms" in shown
    assert "omega_c is nan in sample 1" in shown
    assert "testing.py" not in shown


def test_the_doubt_is_what_interpolation_adds(theory):
    """Both are the same motion after its kinks: all that there is comes from interpolation."""
    here, there = ((theory.time[begin::4], theory.omega_c[begin::4]) for begin in (300, 301))
    off = difference(read(here), read(there), "omega_c")
    assert 0 < off.rms < 2 * off.doubt < 20 * off.rms


def test_motions_in_files(theory, tmp_path):
    own, foreign, table, bare = (
        tmp_path / name for name in ("own.h5", "foreign.h5", "table.csv", "bare.csv")
    )
    storage.save(theory, own)
    with h5py.File(foreign, "w") as file:
        file["t"], file["omega_c"] = theory.time, theory.omega_c
    rows = np.stack([theory.time, theory.omega_c], axis=1).tolist()
    table.write_text('# mine\n"t"; omega_c\n' + "\n".join(f"{t!r}; {w!r}" for t, w in rows))
    bare.write_text("\n".join(f"{t!r},{w!r}" for t, w in rows))
    for path in (own, foreign, table, bare):
        assert_tracks(path, theory, rms=1e-15)


@pytest.mark.parametrize("unit", ["rpm", b"rpm", "deg/s", "1/s", "Hz"])
def test_another_unit_is_refused_wherever_it_is_said(tmp_path, theory, unit):
    """In a file of HDF5 of another program, and in arrays of xarray; the same in other spelling is
    taken."""
    path, said = tmp_path / "foreign.h5", unit if isinstance(unit, str) else unit.decode()
    for own, name in ((unit, "units"), (unit, "unit"), ("rad/s", "units"), (b"rad s^-1", "units")):
        with h5py.File(path, "w") as file:
            file["t"], file["omega_c"] = theory.time, theory.omega_c
            file["t"].attrs["units"], file["omega_c"].attrs[name] = "seconds", own
        if own is not unit:
            assert_tracks(path, theory, rms=1e-15)
            continue
        with pytest.raises(InputError, match=f"omega_c must be in rad/s, not in {said}") as told:
            read(path)
        assert str(told.value).count(path.name) == 1
    series = xarray.DataArray(theory.omega_c, attrs={"units": said})
    with pytest.raises(InputError, match=f"omega_c must be in rad/s, not in {said}"):
        assert_settles(theory.time, series, P, rtol=1e-3)


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("a.csv", "t,omega_c\n0,1\n1,x\n", "a.csv, line 3: omega_c = 'x' must be a number in rad"),
        (
            "a.csv",
            "t,omega_c (rpm)\n0,1\n",
            "line 1: 'omega_c .rpm.': omega_c must be in rad/s, not",
        ),
        ("a.csv", "t,omega_c\n1,1\n1,1\n", "times must increase, but 1 s comes after 1 s"),
        ("a.csv", "t,speed\n1,1\n", "needs time and, say, omega_c; it has time"),
        ("a.csv", "", "has no samples of time"),
        ("a.h5", "no file of HDF5", "it is not an HDF5 file"),
        ("a.h5", {"schema": "other"}, "checksum"),
        ("a.h5", {}, "needs time and, say, omega_c"),
        ("none.h5", None, "there is no such file"),
    ],
)
def test_files_that_hold_no_motion(tmp_path, name, content, message):
    if isinstance(content, dict):
        with h5py.File(tmp_path / name, "w") as file:
            file.attrs.update(content)
    elif content is not None:
        (tmp_path / name).write_text(content)
    with pytest.raises(InputError, match=message):
        read(tmp_path / name)


def test_two_runs_side_by_side(theory, here, capsys):
    storage.save(theory, "a.h5")
    storage.save(analytic.simulate(P.replace(omega_0=24.0), [0.0] * 6, 9.0), "b.h5")
    Path("c.csv").write_text(
        "\n".join(f"{t} {w + 0.5}" for t, w in zip(theory.time, theory.omega_c, strict=True))
    )
    shown = told(capsys, "compare a.h5 b.h5 --plot d.png")
    assert Path("d.png").stat().st_size > 10_000
    assert all(
        text in shown
        for text in ("omega_0 = 25.0 in a, 24.0 in b", "RR 0.", "from 0 to 9 s", "force_Bx")
    )
    (difference,) = json.loads(told(capsys, "compare c.csv a.h5 --json"))["differences"]
    assert difference["rms"] == pytest.approx(0.5)
