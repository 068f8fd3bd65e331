"""Self-contained pages, from templates that share `base.html`; and tables of text."""

from __future__ import annotations

import codecs
import re
import sys
import unicodedata
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rich.console import JustifyMethod
    from rich.table import Table
    from rich.text import Text

Rows = Sequence[Sequence[str]]
"""A table: its head, then its body."""


_UNITS = {
    " s-2": "/s²", " s-1": "/s", " m-3": "/m³", "s-1": "1/s", "rad-1": "1/rad",
    "m2": "m²", "m3": "m³", "rad2": "rad²",
}  # fmt: skip


def readable(unit: str) -> str:
    """A unit of the files as a reader writes it: rad s-1 is rad/s, 1 is nothing."""
    for written, read in _UNITS.items():
        unit = unit.replace(written, read)
    return "" if unit == "1" else unit


_SIGNS = {
    "±": "+-", "×": "x", "–": "-", "—": "-", "−": "-", "·": "*", "≈": "~", "≤": "<=", "≥": ">=",
    "→": "->", "“": '"', "”": '"', "’": "'", "✓": "+", "✗": "x",
    "\u0303": "~", "⁻": "-",
}  # fmt: skip
_ABOVE, _BELOW = "⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "₀₁₂₃₄₅₆₇₈₉"


def spell_out(error: UnicodeError) -> tuple[str, int]:
    """An error handler of `codecs`: spells out Greek letters, and shows others without accents and
    digits as such, x₀₁ as x_01, 10⁻³ as 10^-3."""
    assert isinstance(error, UnicodeEncodeError)
    text, shown = error.object, list[str]()
    for k in range(error.start, error.end):
        letter, before, after = text[k], text[k - 1 : k], text[k + 1 : k + 2]
        if _is_greek(letter) or letter == "√":  # symbols in a row are words of their own
            name = unicodedata.name(letter).split()
            word = "sqrt" if letter == "√" else name[-1].lower()
            word = word.capitalize() if "CAPITAL" in name else word
            gap = before.isalnum() and not _is_greek(before)
            shown.append(" " * gap + word + " " * (after.isalpha() or after == "√"))
            continue
        parts = unicodedata.normalize("NFKD", letter).replace("⁄", "/")
        plain = _SIGNS.get(letter) or parts.encode("ascii", "ignore").decode()
        for digits, mark in ((_ABOVE, "^"), (_BELOW, "_")):
            if letter in digits and before not in digits:
                plain = mark + plain
        shown.append(plain or "?" * (not unicodedata.combining(letter)))
    return "".join(shown), error.end


codecs.register_error("spelled", spell_out)


def for_terminal(text: str) -> str:
    """A text as standard output can show it: a table that is spelled out later isn't straight."""
    encoding = getattr(sys.stdout, "encoding", None) or "utf-8"
    return text.encode(encoding, "spelled").decode(encoding)


def _is_greek(letter: str) -> bool:
    return unicodedata.name(letter, "").startswith("GREEK") if letter else False


_SIGNS_OF_PAGES = {
    # ω_c, B_x, jω_c: a letter and index; names of programs, slip_x, stay as they are
    r"([Α-ω]\u0303?|(?<![\w.])[A-Za-z])_([A-Za-z0-9]{1,3})(?![A-Za-z0-9_(])": r"\1<sub>\2</sub>",
    r"\^\(?([\d/]+)\)?": r"<sup>\1</sup>",  # ρ^(2/3)
    r"(?<= )-(?= )|(?<![\w).])-(?=\d)": "−",
}
"""What pages write otherwise than terminals, JSON and sources do."""


def typeset(text: str) -> str:
    """Text of a page in HTML: indices and powers in their places, and minus signs."""
    import markupsafe  # comes with jinja2

    shown = str(markupsafe.escape(text))
    for plain, of_pages in _SIGNS_OF_PAGES.items():
        shown = re.sub(plain, of_pages, shown)
    return markupsafe.Markup(shown)


def render(package: str, template: str, **values: Any) -> str:
    """A template of a package, filled in and escaped; a missing value is an error."""
    import jinja2  # here, because the terminal has no pages
    import markupsafe

    loader = jinja2.ChoiceLoader(
        [jinja2.PackageLoader(package), jinja2.PackageLoader("compare.figures.pages")]
    )
    environment = jinja2.Environment(
        loader=loader, autoescape=True, undefined=jinja2.StrictUndefined
    )
    environment.filters["typeset"] = typeset
    environment.globals["source"] = lambda name: markupsafe.Markup(
        loader.get_source(environment, name)[0]
    )
    return environment.get_template(template).render(**values)


def by_heading(rows: Sequence[Mapping[str, str]]) -> Rows:
    """A table from its rows, each with a cell by heading."""
    return [[*rows[0]], *([*row.values()] for row in rows)]


def markdown(rows: Rows) -> str:
    """A table in Markdown; columns of short cells, most of them numbers, to the right."""
    short = [all(len(cell) <= 9 for cell in column[1:]) for column in zip(*rows, strict=True)]
    cells = [rows[0], ["--:" if k and short[k] else "---" for k in range(len(short))], *rows[1:]]
    return "\n".join(
        "| " + " | ".join(cell.replace("|", "\\|") for cell in row) + " |" for row in cells
    )


def least_width(cells: Iterable[str], whole: bool = False) -> int:
    """Columns of a terminal that a table's column needs: for its longest word, or `whole` cells."""
    from rich.cells import cell_len  # here, because help has no tables

    shown = [for_terminal(cell) for cell in cells]
    return max(map(cell_len, shown if whole else " ".join(shown).split()), default=0)


def pairs(rows: Mapping[str, str]) -> Table:
    """A table of two columns for the terminal: names, and what they stand for."""
    from rich.table import Table  # here, because help has no tables
    from rich.text import Text

    shown = Table(show_header=False, box=None, padding=(0, 2, 0, 0))
    for column in ({*rows}, {*rows.values()}):
        shown.add_column(min_width=least_width(column))
    for name, text in rows.items():
        shown.add_row(Text(for_terminal(name), "bold"), Text(for_terminal(text)))
    return shown


def table(
    title: str,
    rows: Sequence[Sequence[str | Text]],
    no_wrap: bool = False,
    justify: JustifyMethod = "right",
    **look: Any,
) -> Table:
    """A table for the terminal; with `no_wrap` only head and first column may be broken.

    `justify` is for all columns but the first, and those of words."""
    from rich import box
    from rich.table import Table
    from rich.text import Text

    usual: dict[str, Any] = {
        "title_justify": "left",
        "title_style": "bold",
        "caption_justify": "left",
    }
    shown = Table(title=title, **({"box": box.SIMPLE_HEAD} | usual | look))
    for k, name in enumerate(rows[0]):
        cells = [str(row[k]) for row in rows[1:]]
        words = cells and all(cell[:1].isalpha() for cell in cells)
        least = max(least_width([str(name)]), least_width(cells, whole=no_wrap and k > 0))
        side = "left" if k == 0 or words else justify
        shown.add_column(for_terminal(str(name)), justify=side, min_width=least)
    for row in rows[1:]:
        texts = (
            Text(for_terminal(cell), no_wrap=no_wrap and k > 0) if isinstance(cell, str) else cell
            for k, cell in enumerate(row)
        )
        shown.add_row(*texts)
    return shown
