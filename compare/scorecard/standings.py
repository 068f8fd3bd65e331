"""The league as text: rows for the terminal, the page and the documentation."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any

from rich.table import Table

from compare import pages
from compare.pages import Rows
from compare.scorecard.league import CASES, COST, OPEN, WALL, Entry


def rows(entries: Sequence[Entry]) -> Rows:
    """A head, and a row for each entry; only disciplines that some entry has."""
    asked = list(dict.fromkeys(name for entry in entries for name in entry.scores))
    table = [["engine", "step", *asked]]
    for entry in entries:
        step = "its own" if entry.step is None else f"{1e3 * entry.step:g} ms"
        cells = ["failed" if name in entry.failures else cell(name, entry.scores.get(name)) for name in asked]
        table.append([entry.name, step, *cells])
    return table


def cell(discipline: str, score: float | None) -> str:
    """A score as a person reads it."""
    if score is None:
        return ""
    if math.isnan(score):
        return "not seen"
    return _FORMS.get(discipline, number)(score)


def number(value: float) -> str:
    """An error: round-off is shown as such, a run without one as diverged."""
    return "diverged" if math.isnan(value) else "< 1e-14" if value < 1e-14 else f"{value:.1e}"


_FORMS = {CASES: "{:.0f}".format, COST: "{:.2g}".format, OPEN: "{:.0%}".format, WALL: "≤ {:g}".format}


def tables(entries: Sequence[Entry]) -> Iterator[Table]:
    """The league for the terminal: for each time step a column an engine, those that choose their own in all."""
    steps: list[float | None] = [step for step in dict.fromkeys(entry.step for entry in entries) if step]
    for step in steps or [None]:
        own = [entry for entry in entries if entry.step in (step, None)]
        title = "League" if step is None else f"League, step {1e3 * step:g} ms"
        _, _, *lines = zip(*rows(own), strict=True)
        yield pages.table(
            title, [["", *(entry.name.replace("-", "- ") for entry in own)], *lines], no_wrap=True, padding=0
        )


def settings(data: dict[str, Any]) -> Rows:
    """What each contestant was set to, of `league.to_mapping`: a name, versions, and settings or why it is missing."""
    table = [["engine", "versions", "settings"]]
    for each in data["contestants"]:
        versions = ", ".join(f"{name} {version}" for name, version in each["versions"].items())
        given = ", ".join(f"{name} {value}" for name, value in each.get("settings", {}).items() if name != "timestep")
        table.append([each["name"], versions, each["missing"] or given])
    return table


CAPTION = (
    "Relative errors of ω_c: in stationary states (case and ω₀ in rad/s) from rest, once the start is forgotten; as "
    "root mean square in motions. ω₀₁: relative error of the flow at which rolling ends; ω₀₂: how near to the flow at "
    "which the wall begins to carry the ball the engine is right on both sides. Cost: processor time over simulated "
    "time."
)
"""What the columns are."""
