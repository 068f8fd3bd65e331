"""Tables of numbers as text: separators, numbers, and a head of names with units."""

import csv
import io
import itertools
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from model.errors import InputError, StorageError, suggestion
from model.files import write_text
from model.parameters import parse_number

LONGEST = 500_000_000
"""Characters of a table that is read: a device has no end."""
BLOCK = 10_000
"""Rows that are written before that is told."""
_LABEL = re.compile(r"(?P<name>.*?)\s*(?:[(\[](?P<unit>.*?)[)\]]|\bin (?P<after>.*))?")

_SHORT = {"second": "s", "seconds": "s", "sec": "s", "radian": "rad", "radians": "rad"}


def fields(line: str) -> list[str]:
    """Fields of a line without its comment; between semicolons or tabs a comma is a decimal one."""
    line = line.partition("#")[0]
    for separator in ";\t":
        if separator in line:
            return [text.strip(' "').replace(",", ".") for text in line.split(separator)]
    return [text.strip(' "') for text in line.split(",")] if "," in line else line.split()


def is_number(text: str) -> bool:
    """Whether a text is a number."""
    try:
        float(text)
    except ValueError:
        return False
    return True


def check_unit(label: str, name: str, given: str, unit: str) -> None:
    """`InputError` for values in another unit than that of the quantity: nothing is converted."""
    if _factors(given) != _factors(unit):
        wanted = unit.replace(" s-1", "/s")
        raise InputError(f"{label!r}: {name} must be in {wanted}, not in {given}")


def _factors(unit: str) -> list[str]:
    """A unit as factors in a line, however it is written: ``rad/s`` as ``rad s^-1``."""
    plain = unit.replace("⁻¹", "-1").replace("^", "").replace("/", " /")
    words = [_SHORT.get(word, word) for word in re.split(r"[\s·*]+", plain.strip())]
    return [f"{word[1:]}-1" if word.startswith("/") else word for word in words if word != "1"]


def columns(
    head: Sequence[str], known: Mapping[str, tuple[str, Sequence[str]]], needed: Iterable[str]
) -> dict[str, int]:
    """The column of each quantity in a table, from its head; `known` has its unit and other names.

    Labels are as ``time``, ``t (s)``, ``omega_0 [rad/s]`` or ``t in s``. Raises `InputError` for
    another unit, a quantity that comes twice, or one that is needed and isn't there."""
    found = dict[str, int]()
    for k, label in enumerate(head):
        match = _LABEL.fullmatch(label.strip())
        assert match
        called = (name for name, (_, others) in known.items() if match["name"] in (name, *others))
        if (name := next(called, None)) is None:
            continue
        if given := match["unit"] or match["after"]:
            check_unit(label.strip(), name, given, known[name][0])
        if name in found:
            raise InputError(f"{name} is given twice")
        found[name] = k
    for name in needed:
        if name not in found:
            there = f"there are {', '.join(repr(label.strip()) for label in head)}"
            raise InputError(f"no column is called {name}{suggestion(name, head)}; {there}")
    return found


def read(
    path: str | Path,
    known: Mapping[str, tuple[str, Sequence[str]]],
    needed: Sequence[str],
    bare: tuple[str, str],
) -> tuple[dict[str, list[float]], list[int]]:
    """The values of each quantity in a table of numbers, and the line of each row.

    A first line without numbers is its head, see `columns`; without one the table has the two
    columns `bare`. Columns that are not `known` are left out; empty lines, and what follows a #,
    are none. Raises `StorageError` for a file that can't be read, `InputError` that names the line
    for anything else."""
    try:
        with Path(path).open(encoding="utf-8-sig") as file:
            text = file.read(LONGEST + 1)
    except OSError as error:
        raise StorageError(f"cannot read {path}: {error.strerror}") from error
    except UnicodeDecodeError as error:
        raise InputError(f"{path} is not a text file in UTF-8") from error
    if len(text) > LONGEST:
        raise StorageError(f"cannot read {path}: it has more than {LONGEST / 1e6:g} MB")
    lines = text.splitlines()
    rows = [(n, row) for n, line in enumerate(lines, 1) if any(row := fields(line))]
    place, width = {name: k for k, name in enumerate(bare)}, len(bare)
    if rows and not any(is_number(text) for text in rows[0][1]):
        n, head = rows.pop(0)
        with _in_line(path, n):
            place, width = columns(head, known, needed), len(head)
    found: dict[str, list[float]] = {name: [] for name in place}
    for n, texts in rows:
        with _in_line(path, n):
            if len(texts) != width:
                two, comma = f"two values, {' and '.join(bare)}", ""
                if len(texts) == 2 * width:
                    comma = "; with decimal commas, separate them by semicolons"
                wanted = two if width == 2 else f"{width} values, as the head"
                raise InputError(f"needs {wanted}, but has {len(texts)}{comma}")
            for name, k in place.items():
                found[name].append(parse_number(name, texts[k], known[name][0]))
    return found, [n for n, _ in rows]


@contextmanager
def _in_line(path: str | Path, n: int) -> Iterator[None]:
    """A context in which an `InputError` names the line of a file."""
    try:
        yield
    except InputError as error:
        raise InputError(f"{path}, line {n}: {error}") from error


def label(name: str, unit: str) -> str:
    """The label of a column, as `columns` reads it: ``omega_c (rad/s)``."""
    return name if unit == "1" else f"{name} ({unit.replace(' s-1', '/s')})"


def write(
    path: Path, columns: Mapping[str, Sequence[Any]], tell: Callable[[float], object] = float
) -> None:
    """Write columns of numbers and text by their labels as CSV, whole or not at all; raises
    `StorageError`. `tell` is called with the fraction done."""
    text = io.StringIO()
    rows = csv.writer(text, lineterminator="\n")
    rows.writerow(columns)
    table, count = zip(*columns.values(), strict=True), len(next(iter(columns.values())))
    for written in range(0, count, BLOCK):
        tell(written / count)
        rows.writerows(itertools.islice(table, BLOCK))
    write_text(path, text.getvalue())
