"""Tables of pages have each their place, and a ladder changes one thing at a time."""

import dataclasses
import itertools
from pathlib import Path

import pytest

from compare.figures import pages
from docs.studies import friction, scenes, settings, speed, statements, tables
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


@pytest.mark.parametrize("written", [tables, speed, friction, scenes], ids=lambda m: m.__name__)
def test_every_table_has_its_place_on_a_page(written):
    pages = [ROOT / "README.md", DOCS / "friction.md", *(DOCS / "records").glob("*.md")]
    text = "".join(page.read_text("utf-8") for page in pages)
    for name in written.TABLES:
        assert text.count(f"<!-- begin: {name} -->") == text.count(f"<!-- end: {name} -->") > 0


def test_every_statement_says_where_it_is_checked():
    """The page is what the claims and the tests say now."""
    assert pages.markdown(statements.table()) in (DOCS / "records" / "statements.md").read_text(
        "utf-8"
    )
    for each in statements.TESTS:
        file, _, test = each.partition("::")
        source = (ROOT / "tests" / "analytic" / f"{file}.py").read_text("utf-8")
        assert f"def {test}(" in source, each


def test_the_ladder_ends_at_the_defaults_by_one_thing_at_a_time():
    _, *rungs, law = settings.rungs(1e-3).values()  # the first one is an engine of its own
    assert law == RigidContacts()
    assert rungs[-1] == ContactSettings()
    # one thing: what makes it stiff and continuous
    contact = {"solref", "solreffriction", "solimp", "impratio"}
    for low, high in itertools.pairwise(rungs):
        changed = {
            f.name for f in dataclasses.fields(low) if getattr(low, f.name) != getattr(high, f.name)
        }
        assert len(changed) == 1 or changed == contact
