"""Nothing of a user's is overwritten by any command, and what can't be written leaves nothing behind."""

import resource
import shutil
from pathlib import Path

import pytest

from compare.commands import options
from tests.commands import COMMANDS, NEEDED, parser_of, refused


def reading(command, file):
    """A command line that reads a file."""
    if "--parameters" in parser_of(command)._option_string_actions:
        return [command, *NEEDED.get(command, "").split(), "--parameters", file]
    return [command, file, *NEEDED[command].split()[1:]]


OUTPUTS = [
    (command, action.option_strings[-1], suffix)
    for command in COMMANDS
    for action in parser_of(command)._actions
    if isinstance(action.type, options.Output)
    for suffix in action.type.suffixes
]
"""Every command with each of its options that names a file to be written, and what that may end in."""


@pytest.mark.parametrize(("command", "option", "suffix"), OUTPUTS)
def test_an_output_that_is_read_is_refused(command, option, suffix, tmp_path, capsys):
    """By its own name, by one that leads elsewhere, or by a link."""
    mine, soft, hard = (tmp_path / f"{name}{suffix}" for name in ("mine", "soft", "hard"))
    mine.write_text("mine")
    soft.symlink_to(mine)
    hard.hardlink_to(mine)
    for output in (mine, tmp_path / ".." / tmp_path.name / mine.name, soft, hard):
        assert "is read and would be lost" in refused(capsys, *reading(command, mine), option, output)
    assert {path.read_text() for path in (mine, soft, hard)} == {"mine"}
    assert soft.is_symlink()


@pytest.mark.parametrize(
    "words",
    [
        "simulate --engine event --time 0.1 -o new.h5",
        "collect runs --workers 0 -o new.h5",
        "inspect run.h5 --plot new.png",
        "inspect run.h5 --plot run.svg",
        "compare run.h5 run.h5 --plot new.svg",
        "attractors --set hopping --start omega_c=20 --time 0.1 -o new.md",
        "basins --across omega_c=1:2:2 --up y=0:0.01:2 --workers 0 --quiet --results new/map -o new.json",
        "cases -o new/cases",
        "sweep --vary eta=0.1,0.2 --time 0.01 --workers 0 --quiet -o new/runs",
    ],
)
def test_a_full_disk_leaves_nothing_behind(words, stocked, tmp_path, monkeypatch, capsys):
    """Nor does it touch what was there; a limit on the size of files plays the disk that is full."""
    monkeypatch.chdir(shutil.copytree(stocked, tmp_path / "here"))
    Path("run.svg").write_text("mine")
    before = {path: path.is_file() and path.read_bytes() for path in Path().rglob("*")}
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (20, hard))
    try:
        assert "File too large" in refused(capsys, words)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert {path: path.is_file() and path.read_bytes() for path in Path().rglob("*")} == before


def test_runs_are_not_gathered_into_one_of_themselves(stocked, tmp_path, capsys):
    runs = shutil.copytree(stocked / "runs", tmp_path / "runs")
    one, link = min(runs.glob("*.h5")), tmp_path / "link.h5"
    before = one.read_bytes()
    link.symlink_to(one)
    for output in (one, link):
        assert "can't be the output, too" in refused(capsys, f"collect {runs} -o {output}")
    assert one.read_bytes() == before


@pytest.mark.parametrize(
    ("command", "name"),
    [("cases", "README.md"), ("league --engine mujoco-plain --workers 1", "league.html"), ("validate", "report.html")],
)
def test_a_page_of_somebody_else_is_left_alone(command, name, tmp_path, capsys):
    (tmp_path / name).write_text("mine")
    assert f"{name} is not of this program" in refused(capsys, *command.split(), "-o", tmp_path)
    assert [path.read_text() for path in tmp_path.iterdir()] == ["mine"]
