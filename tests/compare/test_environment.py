"""The program works in environments that are not a developer's: encodings, backends, closed
outputs, no home."""

import ast
import os
import re
import shlex
import shutil
import subprocess
import sys

import pytest

from model import storage
from tests.commands import ROOT, SCENE, carried_out, python, refused


@pytest.fixture(scope="module")
def here(tmp_path_factory, stocked):
    """A directory with a run, whose name has a space and letters beyond ASCII."""
    made = tmp_path_factory.mktemp("mit Öl ω")
    shutil.copy(stocked / "run.h5", made / "run é.h5")
    return made


def dualball(where, *words, before="", **environment):
    """The program in a shell, after redirections; without what pytest's own environment says of
    output."""
    kept = {
        name: value
        for name, value in os.environ.items()
        if not name.startswith(("PYTHON", "LC_", "LANG"))
    }
    shell = ["bash", "-c", f'"$@" {before}', "bash", sys.executable, "-m", "compare", *words]
    own = {"PYTHONPATH": str(ROOT)} | environment  # to load what is compiled takes longer
    done = subprocess.run(shell, cwd=where, env=kept | own, capture_output=True, timeout=120)
    assert b"Traceback" not in done.stdout + done.stderr, done.stderr
    assert b"Exception ignored" not in done.stderr
    return done


@pytest.mark.parametrize("encoding", ["ascii", "cp1252", "utf-16"])
def test_any_encoding(here, encoding):
    done = dualball(here, "predict", PYTHONIOENCODING=encoding)
    assert done.returncode == 0
    shown = done.stdout.decode(encoding)
    assert ("omega_01" in shown) is (encoding != "utf-16")
    if encoding == "ascii":  # the tables are straight all the same
        for table in shown.split("Stationary solutions"):
            assert len({len(line) for line in table.splitlines() if line.startswith("|")}) == 1
    spelled = {
        "ω₀₁ Ω ω̃² √± … é \udcff✓": "omega_01 Omega omega~^2 sqrt+- ... e ?+",
        "8πρ_fνr = c√(R/g)": "8 pi rho_f nu r = c sqrt(R/g)",
        "ω₀√(R/g) −½ 10⁻³ m²/s": "omega_0 sqrt(R/g) -1/2 10^-3 m^2/s",
    }
    for text, plain in spelled.items():
        assert text.encode("ascii", "spelled").decode() == plain


def test_any_backend_and_no_home(here):
    wild = {
        "MPLBACKEND": "module://matplotlib_inline.backend_inline",
        "MUJOCO_GL": "x",
        "HOME": "/nonexistent",
    }
    assert dualball(here, "inspect", "run é.h5", "--plot", "run ü.png", **wild).returncode == 0
    assert (here / "run ü.png").stat().st_size > 10_000


def test_numbers_are_worked_out_in_one_thread(monkeypatch):
    """On a machine with other work two of OpenBLAS took five times as long as one.

    A thread that was joined is still listed for a moment: one in 200, and OpenBLAS' to the end."""
    code = (
        "import atexit, os, sys, time; from compare.commands import cli\n"
        "def least():\n"
        "    looks = [time.sleep(0.05) or len(os.listdir('/proc/self/task')) for _ in range(10)]\n"
        "    print(min(looks))\n"
        "atexit.register(least); sys.argv[1:] = ['predict']; cli.program()"
    )
    for name in [name for name in os.environ if "NUM_THREADS" in name]:
        monkeypatch.delenv(name)
    assert python("-c", code).stdout.splitlines()[-1] == "1"


@pytest.mark.slow
def test_no_place_for_what_is_compiled(here):
    """As for a user without a home, of a package that root has installed: it is compiled each
    time, and says so."""
    pytest.importorskip("numba")
    nowhere = {
        "NUMBA_CACHE_LOCATOR_CLASSES": "UserProvidedCacheLocator",
        "NUMBA_CACHE_DIR": "/proc/nowhere",
    }
    done = dualball(here, "simulate", "--time", "0.05", **nowhere)
    assert done.returncode == 0
    assert b"compiling, each time: no place to keep it; NUMBA_CACHE_DIR can name one" in done.stderr


@pytest.mark.parametrize("words", ["predict", "--help", "--version"])
def test_a_full_output_is_said(here, words):
    done = dualball(here, words, before=">/dev/full")
    assert (done.returncode, done.stdout) == (2, b"")
    assert (
        done.stderr
        == b"dualball: error: cannot write to standard output: No space left on device\n"
    )


def test_a_reader_that_has_gone_is_no_error(here):
    done = dualball(here, "predict", before="| true; exit ${PIPESTATUS[0]}")
    assert (done.returncode, done.stderr) == (0, b"")


@pytest.mark.parametrize("closed", [">&-", "<&- >&- 2>&-"])
def test_closed_outputs_take_nothing_with_them(here, closed):
    """A file that is opened next would have their numbers, and what is printed would go into it."""
    made = [here / "open.csv", here / "closed.csv"]
    for path, before in zip(made, ("", closed), strict=True):
        assert dualball(here, "predict", "-o", str(path), before=before).returncode == 0
    assert made[0].read_bytes() == made[1].read_bytes()
    assert dualball(here, "predict", "--nonsense", before=closed).returncode == 2


def test_no_file_takes_the_place_of_a_closed_output():
    """Into which C libraries, and a signal's last words, write by its number."""
    code = (
        "import os\nfrom compare.__main__ import main\ntry:\n main()\n"
        "except SystemExit:\n os._exit(os.open(os.devnull, os.O_RDONLY))"
    )
    line = shlex.join([sys.executable, "-c", code, "--version"])
    done = subprocess.run(f"{line} <&- >&- 2>&-", shell=True, env={"PYTHONPATH": str(ROOT)})
    assert done.returncode > 2


def test_make_installs_all_that_readme_imports():
    code = re.findall(
        r"^```python\n(.*?)^```", (ROOT / "README.md").read_text("utf-8"), re.M | re.S
    )
    nodes = [node for each in code for node in ast.walk(ast.parse(each))]
    names = {alias.name for node in nodes if isinstance(node, ast.Import) for alias in node.names}
    locked = re.findall(r"^([\w-]+)==", (ROOT / "requirements.lock").read_text("utf-8"), re.M)
    assert names <= {*locked, "analytic", "mjsim"}
    assert {"xarray", "h5netcdf"} <= {*locked}  # by which pages read runs


def test_a_directory_in_which_nothing_can_be_written(monkeypatch, capsys):
    """Not even by the superuser."""
    monkeypatch.chdir("/proc")
    assert carried_out(capsys, "simulate --start y=1e11 --time 0.05")[0] == 1
    for line in ("sweep --vary eta=0.1,0.2 --workers 0", "simulate -o run.h5"):
        assert "cannot write" in refused(capsys, line)


def test_names_beyond_ascii_in_the_c_locale(here):
    """As Python takes it only if it is told to."""
    strict = {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}
    named = SCENE.replace("<geom type", '<geom name="Tür" type', 1)
    (here / "Würfel.xml").write_text(named, "utf-8")
    assert dualball(here, "forecast", "Würfel.xml", "-o", "Würfel.html", **strict).returncode == 0
    assert "Würfel.xml" in (here / "Würfel.html").read_text("utf-8")
    assert dualball(here, "simulate", "--time", "0.05", "-o", "läuft.h5", **strict).returncode == 0
    assert storage.load(here / "läuft.h5").complete
    done = dualball(here, "inspect", "weg ä.h5", **strict)
    assert (done.returncode, done.stderr.count(b"\n")) == (2, 1)
