"""The score card as lines, for the terminal, and as a page."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from rich import box
from rich.table import Table
from rich.text import Text

from compare import pages
from compare.scorecard.contenders import OURS
from compare.scorecard.grade import GOOD, GOOD_SPEED, Column
from compare.scorecard.trials import AGREES, APPROACH, ROLLING, STATES
from model import Case

CAPTION = (
    "dualball: the study's settings. MuJoCo: its defaults, in the study's scene. newcomer: its defaults, a free joint, "
    "a wall of flat facets."
)

Cell = tuple[str, bool | None]
"""A text, and whether what it says is good; None: neither."""


@dataclass(frozen=True)
class Line:
    """One line of the card: what it is, and a cell for each column."""

    group: str
    name: str
    cells: tuple[Cell, ...]


def lines(columns: Sequence[Column]) -> list[Line]:
    """The card as text, without the advice."""

    def line(group: str, name: str, cells: Iterable[Cell]) -> Line:
        return Line(group, name, tuple(cells))

    cases, slipping = columns[0].cases, [state for state in STATES if state.case is Case.SS]
    return [
        *[line("share of time in the case", name, (_share(c.cases[name]) for c in columns)) for name in cases],
        *[line("relative error of ω_c", s.name, (_relative(c.of(s).omega_c) for c in columns)) for s in STATES],
        *[line("error of slip (m/s)", s.name, (_speed(c.of(s).slip) for c in columns)) for s in STATES],
        *[line("steps that lose contact", s.name, (_open(c.of(s).open) for c in columns)) for s in slipping],
        line("other errors", f"creep in {ROLLING.name} (m/s)", (_speed(c.of(ROLLING).creep) for c in columns)),
        line("other errors", "ω₀₁, end of rolling", (_relative(c.omega_01) for c in columns)),
        line("other errors", f"{APPROACH.name}, rms", (_relative(c.transient, "") for c in columns)),
        line("cost", "time step (ms)", ((f"{1e3 * c.timestep:g}", None) for c in columns)),
        line("cost", f"a step ({OURS.name} 1)", ((f"{c.cost:.2f}", None) for c in columns)),
        line("cost", f"a second ({OURS.name} 1)", ((f"{c.cost_of_a_second:.2f}", None) for c in columns)),
    ]


def _share(share: float) -> Cell:
    good = share >= AGREES
    return f"{'✓' if good else '✗'} {math.floor(100 * share)} %", good


def _relative(error: float, sign: str = "+") -> Cell:
    return ("missing", False) if math.isnan(error) else (f"{error:{sign}.1e}", abs(error) <= GOOD)


def _speed(error: float) -> Cell:
    return ("diverged", False) if math.isnan(error) else (f"{error:.1e}", error <= GOOD_SPEED)


def _open(share: float) -> Cell:
    return ("diverged", False) if math.isnan(share) else (f"{100 * share:.3g} %", share == 0)


def headline(column: Column) -> str:
    """A column in one sentence."""
    errors = [abs(held.omega_c) for held in column.stationary]
    worst = "a stationary state diverges" if np.isnan(errors).any() else f"ω_c is off by up to {max(errors):.1g}"
    onset = "the loss of rolling does not show" if math.isnan(column.omega_01) else "the loss of rolling shows"
    return f"{column.name}: {len(column.reproduced)} of {len(column.cases)} cases reproduced, {worst}, {onset}"


def table(columns: Sequence[Column]) -> Table:
    """The card for the terminal."""
    shown = Table(box=box.SIMPLE_HEAD, title="Score card", title_justify="left", title_style="bold")
    shown.add_column("")
    for column in columns:
        shown.add_column(column.name, justify="right")
    last = ""
    for line in lines(columns):
        if line.group != last:
            shown.add_row(Text(line.group, style="dim"))
            last = line.group
        cells = [Text(text, style={True: "green", False: "red", None: ""}[good]) for text, good in line.cells]
        shown.add_row(f"  {line.name}", *cells)
    shown.caption, shown.caption_justify = CAPTION, "left"
    return shown


def html(columns: Sequence[Column], settings: str) -> str:
    """The card as one self-contained page; `settings` says in words what was graded."""
    shown = {"caption": CAPTION, "columns": columns, "lines": lines(columns), "headline": headline(columns[0])}
    return pages.render("compare.scorecard", "grade.html", **shown, settings=settings, good=GOOD, good_speed=GOOD_SPEED)
