"""The tables of the settings page: each has its place, and writing one changes nothing else."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from compare import accuracy, document
from compare.campaign import Campaign
from compare.claims import Lab, Level
from model import InputError

PAGE = Path(__file__).parents[2] / "docs" / "mujoco-settings.md"
ROWS = [["a", "b"], ["1", "2"], ["3", "4"]]


def test_a_table_is_put_in_its_place(tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    page.write_text("before\n<!-- begin: x -->\nold\n<!-- end: x -->\nafter <!-- begin: y --><!-- end: y -->\n")
    for _ in range(2):
        document.write(page, "x", ROWS)
        assert page.read_text() == (
            "before\n<!-- begin: x -->\n| a | b |\n|---|---|\n| 1 | 2 |\n| 3 | 4 |\n<!-- end: x -->\n"
            "after <!-- begin: y --><!-- end: y -->\n"
        )
    with pytest.raises(InputError, match="must have the lines '<!-- begin: z -->'"):
        document.write(page, "z", ROWS)


def test_the_page_has_a_place_for_every_table(tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    page.write_text(PAGE.read_text("utf-8"), "utf-8")
    for name in document.TABLES:
        document.write(page, name, ROWS)
    assert page.read_text("utf-8").count(document.markdown(ROWS)) == len(document.TABLES)


def test_random_sets_are_in_range_and_settle() -> None:
    sets = accuracy._random(6)
    assert sets == accuracy._random(6)
    for p in sets:
        unit = np.sqrt(p.g / p.R)
        values = {"R": p.R, "r/R": p.r / p.R, "j": p.j, "mu": p.mu, "eta": p.eta, "g": p.g, "kappa": p.c / unit}
        assert all(accuracy.LOW[name] <= value <= accuracy.HIGH[name] for name, value in values.items())


def test_the_transient_converges_and_is_extrapolated(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(accuracy, "FINE", (2e-3, 1e-3, 5e-4))
    with Campaign(tmp_path, workers=0) as campaign:
        _, *rows, last = accuracy.transient(Lab(campaign, Level.QUICK))
    errors = [float(row[1]) for row in rows]
    assert float(rows[-1][2]) > 1.8
    assert float(last[1]) < errors[-1] < errors[0]
