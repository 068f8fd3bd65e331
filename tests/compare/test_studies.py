"""Tables of pages have each their place, formulas are what MuJoCo does, and a ladder changes one
thing at a time."""

import dataclasses
import itertools
from pathlib import Path

import pytest

from compare.kit import pages
from docs.studies import confirmation, settings, statements, tables
from mjsim import ContactSettings, RigidContacts
from model import InputError

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
ROWS = [["a", "b"], ["1", "2"], ["3", "4"]]


def test_a_table_is_put_in_its_place(tmp_path):
    page = tmp_path / "page.md"
    page.write_text(
        "before\n<!-- begin: x -->\nold\n<!-- end: x -->\nafter <!-- begin: y --><!-- end: y -->\n"
    )
    for _ in range(2):
        tables.write(page, "x", ROWS)
        assert page.read_text() == (
            "before\n<!-- begin: x -->\n| a | b |\n| --- | --: |\n| 1 | 2 |\n| 3 | 4 |\n<!-- end: "
            "x -->\n"
            "after <!-- begin: y --><!-- end: y -->\n"
        )
    with pytest.raises(InputError, match="must have the lines '<!-- begin: z -->'"):
        tables.write(page, "z", ROWS)


@pytest.mark.parametrize("name", tables.PAGES)
def test_the_page_has_a_place_for_every_table(name, tmp_path):
    page, (_, named) = tmp_path / name, tables.PAGES[name]
    page.write_text(
        (ROOT / name if name == "README.md" else DOCS / "records" / name).read_text("utf-8"),
        "utf-8",
    )
    for table in named:
        tables.write(page, table, ROWS)
    assert page.read_text("utf-8").count(pages.markdown(ROWS)) == len(named)


def test_every_statement_says_where_it_is_checked():
    """The page is what the claims and the tests say now."""
    assert pages.markdown(statements.table()) in (DOCS / "records" / "statements.md").read_text(
        "utf-8"
    )
    for each in statements.TESTS:
        file, _, test = each.partition("::")
        source = (ROOT / "tests" / "analytic" / f"{file}.py").read_text("utf-8")
        assert f"def {test}(" in source, each


def test_formulas_are_what_mujoco_does_and_one_that_is_off_is_noticed():
    rows = confirmation.rows()
    assert len({row.what for row in rows}) == len(rows)
    assert not [row for row in rows if not row.agrees]
    for measured, agrees in ((1.009, True), (1.011, False)):
        row = confirmation.Row("length", "m", predicted=1.0, measured=measured, tolerance=1e-2)
        assert row.agrees is agrees


def test_the_ladder_ends_at_the_defaults_by_one_thing_at_a_time():
    _, *rungs, law = settings.rungs(1e-3).values()  # the first one is an engine of its own
    assert law == RigidContacts()
    assert rungs[-1] == ContactSettings()
    contact = {
        "solref",
        "solreffriction",
        "solimp",
        "impratio",
    }  # one thing: what makes it stiff and continuous
    for low, high in itertools.pairwise(rungs):
        changed = {
            f.name for f in dataclasses.fields(low) if getattr(low, f.name) != getattr(high, f.name)
        }
        assert len(changed) == 1 or changed == contact
