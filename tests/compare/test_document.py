"""The tables of the settings page: each has its place, and writing one changes nothing else."""

from __future__ import annotations

import itertools
import math
from pathlib import Path

import pytest

from compare import pages
from compare.runs.campaign import Campaign
from compare.scorecard import league
from docs.studies import accuracy
from docs.studies import tables as document
from docs.studies.accuracy import REACHED
from model import InputError

DOCS = Path(__file__).parents[2] / "docs"
ROWS = [["a", "b"], ["1", "2"], ["3", "4"]]


def test_a_table_is_put_in_its_place(tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    page.write_text("before\n<!-- begin: x -->\nold\n<!-- end: x -->\nafter <!-- begin: y --><!-- end: y -->\n")
    for _ in range(2):
        document.write(page, "x", ROWS)
        assert page.read_text() == (
            "before\n<!-- begin: x -->\n| a | b |\n| --- | --- |\n| 1 | 2 |\n| 3 | 4 |\n<!-- end: x -->\n"
            "after <!-- begin: y --><!-- end: y -->\n"
        )
    with pytest.raises(InputError, match="must have the lines '<!-- begin: z -->'"):
        document.write(page, "z", ROWS)


@pytest.mark.parametrize("name", document.PAGES)
def test_the_page_has_a_place_for_every_table(name: str, tmp_path: Path) -> None:
    page, (_, tables) = tmp_path / name, document.PAGES[name]
    page.write_text((DOCS / name).read_text("utf-8"), "utf-8")
    for table in tables:
        document.write(page, table, ROWS)
    assert page.read_text("utf-8").count(pages.markdown(ROWS)) == len(tables)


def test_the_transient_converges_and_is_extrapolated(tmp_path: Path) -> None:
    steps = (2e-3, 1e-3, 5e-4)
    with Campaign(tmp_path, workers=0) as campaign:
        head, *rows, last = accuracy.transient(campaign, steps)
    errors = [float(row[1]) for row in rows]
    assert errors == sorted(errors, reverse=True)
    for before, row in itertools.pairwise(rows):
        # The order as it is written, to a digit, is the slope of the errors as they are written, to two.
        slope = math.log2(float(before[1]) / float(row[1]))
        assert float(row[2]) == pytest.approx(slope, abs=0.05 + 0.1 / math.log(2))
        assert slope > 1.8
    assert float(last[1]) < errors[-1]
    assert len(head) == len(last)


def test_landings_are_located_to_second_order(tmp_path: Path) -> None:
    with Campaign(tmp_path, workers=0) as campaign:
        _, *rows = accuracy.event_times(campaign, (1e-3, 5e-4))
    for (_, _, coarse, *_), (_, _, fine, order, *_) in zip(rows[::2], rows[1::2], strict=True):
        coarse, fine = (float(cell.removesuffix(" µs")) for cell in (coarse, fine))
        assert float(order) == pytest.approx(math.log2(coarse / fine), abs=0.05 + 0.1 / math.log(2))
        assert float(order) > 1.8


def test_states_are_reached_from_rest_and_from_near(tmp_path: Path) -> None:
    with Campaign(tmp_path, workers=0) as campaign:
        head, row = accuracy.reached(campaign, REACHED[:1], [4e-3])
    assert dict(zip(head, row, strict=True))["state"] == REACHED[0].name
    assert row[-1] == "0.0%"


def test_splits_lie_in_the_admissible_interval(tmp_path: Path) -> None:
    with Campaign(tmp_path, workers=0) as campaign:
        _, row = accuracy.force_split(campaign, [10.0])
    least, greatest = (float(end) for end in row[1].split(" … "))
    digit = 1e-4  # of what is written
    assert all(least - digit <= float(chosen) <= greatest + digit for chosen in row[2:])


def test_numbers_of_tables() -> None:
    assert [league.number(value) for value in (1.23e-5, 1e-16, math.nan)] == ["1.2e-05", "< 1e-14", "diverged"]
