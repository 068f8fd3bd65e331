"""What pages print is true: commands are those of the program, and what stands below one is what it
says. Pages with cells are run where they are built."""

import importlib.util
import os
import re
import shlex
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

import pytest

from compare.commands import parsers
from docs.studies import cells
from model import Parameters
from tests.commands import COMMANDS, METER, ROOT, SCENE, carried_out

DOCS = ROOT / "docs"
PAGES = [
    ROOT / "README.md",
    ROOT / "CONTRIBUTING.md",
    *sorted(DOCS.glob("*.md")),
    *sorted(DOCS.glob("notebooks/*.py")),
]
WRITTEN = [ROOT / "mjsim" / "coulomb" / "README.md", *sorted(DOCS.glob("records/**/*.md"))]
"""Pages that say what was done and how; their commands exist, and may take hours."""
LIMITS = {"README.md": 700, "CHANGELOG.md": 1500}
"""Words of a page, at most."""
ALL = 24_700
"""Words of all pages that are to be read, at most; records are not."""
RECORDS = ("mutants.md", "blind.md")
"""Pages beside those in docs/records that a script writes; a round played blind adds to one."""


class Block(NamedTuple):
    """What stands between two fences of a page."""

    language: str
    text: str


def written(page: Path) -> str:
    """A page as text; of a notebook, which is a script, what its comments say."""
    text = page.read_text("utf-8")
    return re.sub(r"^# ?", "", text, flags=re.M) if page.suffix == ".py" else text


def blocks(page: Path) -> list[Block]:
    found = re.findall(r"^```(\S*)[^\n]*\n(.*?)^```$", written(page), re.M | re.S)
    return [Block(*each) for each in found]


def commands(page: Path) -> list[str]:
    """All that a page tells the reader to type, without what only the shell understands, and
    without names that stand for others."""
    code = "\n".join(block.text for block in blocks(page))
    lines = re.findall(r"^(?:\$ |!)?(dualball [a-z].*?)(?: +#.*| *[|>].*)?$", code, re.M)
    prose = re.sub(r"^```.*?^```$", "", written(page), flags=re.M | re.S)
    spoken = re.findall(r"`(dualball [a-z][^`]*)`", prose)
    told = [re.sub(r"\s+", " ", each).strip() for each in lines + spoken]
    return [each for each in told if not re.search(r"\b[A-Z]{2,}\b|…", each)]


@pytest.fixture
def here(monkeypatch, tmp_path):
    """A directory from which pages see the files of the clone that they name."""
    (tmp_path / "docs").symlink_to(DOCS)
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize("page", [*PAGES, *WRITTEN], ids=lambda page: page.stem)
def test_commands_of_pages_are_those_of_the_program(page, here):
    for line in commands(page):
        words = shlex.split(line)[1:]
        parsers.parser(words).parse_args(words)  # or raises, and says which


@pytest.mark.parametrize("page", [*PAGES, *WRITTEN], ids=lambda page: page.stem)
def test_modules_and_steps_of_make_that_pages_name_are_there(page):
    make = (ROOT / "Makefile").read_text("utf-8")
    shown = "\n".join(block.text for block in blocks(page) if block.language == "sh")
    said = re.findall(r"`([^`\n]+(?:\n[^`\n]+)?)`", written(page))
    told = "\n".join([shown, *said])
    for module in re.findall(r"^python -m\s+([\w.]+)", told, re.M):
        assert importlib.util.find_spec(module), module
    for step in re.findall(r"^make ([a-z-]+)", told, re.M):
        assert re.search(rf"^{step}:", make, re.M), step


def test_every_command_is_on_a_page():
    told = {line.split()[1] for page in PAGES for line in commands(page)}
    assert told >= {*COMMANDS}


def test_what_readme_shows_below_a_command_is_what_it_says(here, capsys, monkeypatch):
    monkeypatch.delenv("COLUMNS", raising=False)  # lines are whole where no terminal is
    shown = [block.text for block in blocks(ROOT / "README.md") if block.language == "console"]
    assert len(shown) == 3  # a door each
    for text in shown:
        command, *lines = text.splitlines()
        code, out, err = carried_out(capsys, *shlex.split(command)[2:])
        assert code == 0, err
        assert lines
        assert [line for line in out.splitlines() if line in lines] == lines, out


def test_the_first_lines_of_readme_print_what_it_says(capsys):
    found = blocks(ROOT / "README.md")
    code = next(k for k, block in enumerate(found) if block.language == "python")
    exec(found[code].text, {})
    assert capsys.readouterr().out == found[code + 1].text


NEEDS_MORE = {
    "explore": "it waits for a browser",
    "--scheduler": "it wants a cluster",
    "mypkg": "an adapter of the reader's own",
    "dask_jobqueue": "it wants a cluster",
}
"""What isn't run as printed, by a word of it, and why."""


MADE = ("simulate --time 1 -o run.h5", "calibrate --parameters mine.toml -o curve.csv")
"""What pages take for made before."""
SWEEP = "dualball sweep --vary eta=0.1,0.2 --time 0.1 --workers 0"
"""The same, of pages that carry none out themselves."""


def printed(page: Path) -> list[str]:
    """The lines that a page gives to be typed into a shell, whole; those of cells are run where the
    site is built."""
    code = "\n".join(block.text for block in blocks(page) if block.language in ("sh", "console"))
    lines = re.findall(r"^(?:\$ )?(dualball [a-z].*)$", code, re.M)
    there = {line.partition("#")[0].strip() for line in lines}
    told = [each for each in commands(page) if each not in there]
    lines += [each for each in told if f"!{each}" not in written(page)]
    return [line for line in lines if not any(word in line for word in NEEDS_MORE)]


@pytest.fixture
def at_home(here, capsys):
    """A fresh directory with the files that pages take for the reader's own, and its shell."""
    (here / "meter.toml").write_text(METER.replace("fastest = 40", "fastest = 8"))
    for name in ("mine.toml", "glass.toml"):
        Parameters.named("glass-in-water").save(here / name)
    (here / "scene.xml").write_text(SCENE)
    for line in MADE:
        code, _, err = carried_out(capsys, line)
        assert code == 0, err
    program = here / "bin" / "dualball"
    program.parent.mkdir()
    program.write_text(f'#!/bin/sh\nexec {sys.executable} -m compare "$@"\n')
    program.chmod(0o755)
    paths = {"PATH": f"{program.parent}:{os.environ['PATH']}", "PYTHONPATH": str(ROOT)}

    def run(line: str) -> None:
        """Carry a line out as it is printed."""
        done = subprocess.run(
            line, shell=True, capture_output=True, text=True, env=os.environ | paths
        )
        assert done.returncode == 0, f"{line}: {done.stdout}{done.stderr}"

    return run


def test_cells_of_pages_hide_no_mistake(capsys):
    cells.shell("exit 1")
    with pytest.raises(RuntimeError, match="exit code 2"):
        cells.shell("exit 2")
    cells.shell(f"exit 2  {cells.REFUSED}")
    with pytest.raises(RuntimeError, match="exit code 0"):
        cells.shell(f"exit 0  {cells.REFUSED}")


@pytest.mark.slow
@pytest.mark.parametrize("page", [*filter(printed, PAGES)], ids=lambda page: page.stem)
def test_commands_run_as_printed(page, at_home):
    lines = printed(page)
    own = any(line.startswith("dualball sweep") for line in lines)
    for line in lines if own else [SWEEP, *lines]:
        at_home(line)


def self_contained(page: Path) -> list[str]:
    """The Python of a page that begins with what it imports, in blocks that aren't cells."""
    return [
        block.text for block in blocks(page)
        if block.language == "python" and re.match("import|from", block.text)
        and not any(word in block.text for word in NEEDS_MORE)
    ]  # fmt: skip


@pytest.mark.parametrize("page", [*filter(self_contained, PAGES[1:])], ids=lambda page: page.stem)
def test_python_runs_as_printed(page, here):
    for text in self_contained(page):
        exec(text, {})


def test_pages_stay_short():
    for name, limit in LIMITS.items():
        assert len((ROOT / name).read_text("utf-8").split()) <= limit, name
    read = [page for page in PAGES if page.suffix == ".md" and page.name not in RECORDS]
    words = sum(len(page.read_text("utf-8").split()) for page in [*read, ROOT / "CHANGELOG.md"])
    for notebook in DOCS.glob("notebooks/*.py"):
        said = re.findall(r"^# (?!%)(.*)", notebook.read_text("utf-8"), re.M)
        words += sum(len(line.split()) for line in said)
    assert words <= ALL
