"""Shell completion: the printed script, run by a real bash."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest

from compare.claims.catalogue import CLAIMS
from compare.commands import cli
from model import Parameters

COMPLETE = """
source "$1"; shift
COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1)); COMP_LINE="$*"; COMP_POINT=${#COMP_LINE}
$(complete -p dualball | sed 's/.* -F \\([^ ]*\\) .*/\\1/')
printf '%s\\n' "${COMPREPLY[@]}"
"""


@pytest.fixture(scope="module")
def script(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What the program prints for bash."""
    path = tmp_path_factory.mktemp("completion") / "dualball.bash"
    with pytest.MonkeyPatch.context() as patch, path.open("w") as file:
        patch.setattr("sys.stdout", file)
        with pytest.raises(SystemExit, match="0"):
            cli.main(["--print-completion", "bash"])
    return path


def completed(script: Path, where: Path, *words: str) -> set[str]:
    """What bash offers for the last word of a command."""
    command = ["bash", "--norc", "-c", COMPLETE, "bash", str(script), "dualball", *words]
    shown = subprocess.run(command, capture_output=True, text=True, check=True, cwd=where)
    assert shown.stderr == ""
    return set(shown.stdout.split())


@pytest.mark.skipif(not shutil.which("bash"), reason="needs bash")
def test_bash_completes(script: Path, tmp_path: Path) -> None:
    (tmp_path / "run.h5").touch()
    (tmp_path / "runs").mkdir()
    assert completed(script, tmp_path, "in") == {"inspect"}
    assert "--engine" in completed(script, tmp_path, "simulate", "--en")
    assert completed(script, tmp_path, "predict", "--set", "") == set(Parameters.names())
    assert completed(script, tmp_path, "judge", "--claim", "table-") == {
        claim.id for claim in CLAIMS if claim.id.startswith("table-")
    }
    assert completed(script, tmp_path, "simulate", "--start", "omega") == {"omega_c="}
    assert {"run.h5", "runs"} <= completed(script, tmp_path, "inspect", "ru")
    assert completed(script, tmp_path, "collect", "ru") == {"runs"}


@pytest.mark.parametrize("shell", ["zsh", "fish", "tcsh"])
def test_other_shells_have_a_script(shell: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit, match="0"):
        cli.main(["--print-completion", shell])
    shown = capsys.readouterr().out
    assert all(name in shown for name in ("validate", *Parameters.names()))
