"""What writes the tables of pages: each has its place, and its numbers hold together."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from pathlib import Path

import pytest

from compare.kit import pages
from compare.kit.campaign import Campaign
from docs.studies import accuracy, confirmation, tables
from model import InputError

DOCS = Path(__file__).parents[2] / "docs"
ROWS = [["a", "b"], ["1", "2"], ["3", "4"]]
ROUNDED = 0.05 + 0.1 / math.log(2)
"""An order as it is written, to a digit, less the slope of errors as they are written, to two."""


@pytest.fixture
def campaign(tmp_path: Path) -> Iterator[Campaign]:
    with Campaign(tmp_path, workers=0) as made:
        yield made


def test_a_table_is_put_in_its_place(tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    page.write_text("before\n<!-- begin: x -->\nold\n<!-- end: x -->\nafter <!-- begin: y --><!-- end: y -->\n")
    for _ in range(2):
        tables.write(page, "x", ROWS)
        assert page.read_text() == (
            "before\n<!-- begin: x -->\n| a | b |\n| --- | --- |\n| 1 | 2 |\n| 3 | 4 |\n<!-- end: x -->\n"
            "after <!-- begin: y --><!-- end: y -->\n"
        )
    with pytest.raises(InputError, match="must have the lines '<!-- begin: z -->'"):
        tables.write(page, "z", ROWS)


@pytest.mark.parametrize("name", tables.PAGES)
def test_the_page_has_a_place_for_every_table(name: str, tmp_path: Path) -> None:
    page, (_, named) = tmp_path / name, tables.PAGES[name]
    page.write_text((DOCS / name).read_text("utf-8"), "utf-8")
    for table in named:
        tables.write(page, table, ROWS)
    assert page.read_text("utf-8").count(pages.markdown(ROWS)) == len(named)


def test_formulas_are_what_mujoco_does_and_one_that_is_off_is_noticed() -> None:
    rows = confirmation.rows()
    assert len({row.what for row in rows}) == len(rows)
    assert not [row for row in rows if not row.agrees]
    for measured, agrees in ((1.009, True), (1.011, False)):
        row = confirmation.Row("length", "m", predicted=1.0, measured=measured, tolerance=1e-2)
        assert row.agrees is agrees


def test_the_transient_converges_and_is_extrapolated(campaign: Campaign) -> None:
    head, *rows, last = accuracy.transient(campaign, (2e-3, 1e-3, 5e-4))
    errors = [float(row[1]) for row in rows]
    assert errors == sorted(errors, reverse=True)
    for before, row in itertools.pairwise(rows):
        slope = math.log2(float(before[1]) / float(row[1]))
        assert float(row[2]) == pytest.approx(slope, abs=ROUNDED)
        assert slope > 1.8
    assert float(last[1]) < errors[-1]
    assert len(head) == len(last)


def test_landings_are_located_to_second_order(campaign: Campaign) -> None:
    _, *rows = accuracy.event_times(campaign, (1e-3, 5e-4))
    for (_, _, coarse, *_), (_, _, fine, order, *_) in zip(rows[::2], rows[1::2], strict=True):
        coarse, fine = (float(cell.removesuffix(" µs")) for cell in (coarse, fine))
        assert float(order) == pytest.approx(math.log2(coarse / fine), abs=ROUNDED)
        assert float(order) > 1.8


def test_states_are_reached_from_rest_and_from_near(campaign: Campaign) -> None:
    head, row = accuracy.reached(campaign, accuracy.REACHED[:1], [4e-3])
    assert dict(zip(head, row, strict=True))["state"] == accuracy.REACHED[0].name
    assert row[-1] == "0.0%"


def test_splits_lie_in_the_admissible_interval(campaign: Campaign) -> None:
    _, row = accuracy.force_split(campaign, [10.0])
    least, greatest = (float(end) for end in row[1].split(" … "))
    digit = 1e-4  # of what is written
    assert all(least - digit <= float(chosen) <= greatest + digit for chosen in row[2:])
