"""What pages print is true: commands are those of the program, and what stands below one is what it
says. Pages with cells are run where they are built."""

import re
import shlex
from pathlib import Path
from typing import NamedTuple

import pytest

from compare.commands import parsers
from tests.commands import COMMANDS, ROOT, carried_out

DOCS = ROOT / "docs"
PAGES = [
    ROOT / "README.md",
    ROOT / "CONTRIBUTING.md",
    *sorted(DOCS.glob("*.md")),
    *sorted(DOCS.glob("notebooks/*.py")),
]
LIMITS = {"README.md": 700, "CHANGELOG.md": 1500}
"""Words of a page, at most."""
ALL = 26_000
"""Words of all pages that are to be read, at most; records are not."""


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


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_commands_of_pages_are_those_of_the_program(page, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    for line in commands(page):
        words = shlex.split(line)[1:]
        parsers.parser(words).parse_args(words)  # or raises, and says which


def test_every_command_is_on_a_page():
    told = {line.split()[1] for page in PAGES for line in commands(page)}
    assert told >= {*COMMANDS}


@pytest.fixture
def here(monkeypatch, tmp_path):
    """A directory from which pages see the files of the clone that they name."""
    (tmp_path / "docs").symlink_to(DOCS)
    monkeypatch.chdir(tmp_path)
    return tmp_path


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


@pytest.mark.parametrize(
    "number", [0, pytest.param(1, marks=pytest.mark.slow)], ids=["quick", "longer"]
)
def test_the_cheat_sheet_runs(number, here, capsys):
    (here / "meter.toml").write_text(
        "fluid = {nu_f = 1e-6, rho_f = 1000}\nflow = {slowest = 2, fastest = 8}\n"
        "bounds = {r = [2e-3, 8e-3], R = [2e-2, 8e-2], mu = 0.1, eta = 0.1, rho_b = 7800}\n"
    )
    sheet = [block.text for block in blocks(DOCS / "cheat-sheet.md") if block.language == "sh"]
    for line in sheet[number].splitlines():
        words = shlex.split(line, comments=True)[1:]
        if words[0] != "explore":  # which waits for a browser
            code, _, err = carried_out(capsys, *words)
            assert code == 0, f"{line}: {err}"


def test_pages_stay_short():
    for name, limit in LIMITS.items():
        assert len((ROOT / name).read_text("utf-8").split()) <= limit, name
    read = [page for page in PAGES if page.suffix == ".md" and page.name != "mutants.md"]
    words = sum(len(page.read_text("utf-8").split()) for page in [*read, ROOT / "CHANGELOG.md"])
    for notebook in DOCS.glob("notebooks/*.py"):
        said = re.findall(r"^# (?!%)(.*)", notebook.read_text("utf-8"), re.M)
        words += sum(len(line.split()) for line in said)
    assert words <= ALL
