"""Tables of numbers as text: what separates columns, what numbers look like, and a head of names
with units."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

from model.errors import InputError, suggestion

_LABEL = re.compile(r"(?P<name>.*?)\s*(?:[(\[](?P<unit>.*?)[)\]]|\bin (?P<after>.*))?")


def fields(line: str) -> list[str]:
    """The fields of a line without its comment; between semicolons and tabs a comma is a decimal
    one."""
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


def columns(head: Sequence[str], known: Mapping[str, tuple[str, Sequence[str]]]) -> dict[str, int]:
    """The column of each quantity in a table, from its head; `known` has the unit and other names
    of each quantity.

    Labels are as ``time``, ``t (s)``, ``omega_0 [rad/s]`` or ``t in s``. Raises `InputError` for
    another unit, a quantity that comes twice, or one that there isn't."""
    found = dict[str, int]()
    for k, label in enumerate(head):
        match = _LABEL.fullmatch(label.strip())
        assert match
        name = next(
            (name for name, (_, others) in known.items() if match["name"] in (name, *others)), None
        )
        if name is None:
            continue
        unit = known[name][0]
        given = (match["unit"] or match["after"] or unit).strip()
        if given not in (unit, unit.replace(" s-1", "/s")):
            raise InputError(
                f"{label.strip()!r}: {name} must be in {unit.replace(' s-1', '/s')}, not in {given}"
            )
        if name in found:
            raise InputError(f"{name} is given twice")
        found[name] = k
    for name in known:
        if name not in found:
            said = ", ".join(repr(label.strip()) for label in head)
            raise InputError(
                f"no column is called {name}{suggestion(name, head)}; there are {said}"
            )
    return found
