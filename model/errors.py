"""What goes wrong, said in one line that a person can act on."""

from collections.abc import Iterable
from types import NoneType, UnionType
from typing import Any, get_args

MOST_NAMES = 20
"""Of what there is, in a line that refuses what there isn't."""


class InputError(ValueError):
    """A user's mistake: the message is one line naming field, value, unit and range."""


class StorageError(InputError):
    """A file that is missing, cut short, foreign, or newer than this program."""


class SimulationError(RuntimeError):
    """A run that could not reach its end: the message names time and state."""

    def __init__(self, message: str, trajectory: Any) -> None:
        """`trajectory` is the `model.Trajectory` that there is of it."""
        super().__init__(message)
        self.trajectory = trajectory


def check_type(name: str, value: object, kind: type | UnionType) -> None:
    """`InputError` for a value of another type, as for a dict where `Parameters` are needed."""
    if not isinstance(value, kind):
        kinds = [each.__name__ for each in get_args(kind) or (kind,) if each is not NoneType]
        raise InputError(f"{name} must be {' or '.join(kinds)}, not {type(value).__name__}")


def few(names: Iterable[str], most: int = 3) -> str:
    """The first of some names, and how many more there are."""
    every = list(names)
    more = f" and {len(every) - most} more" if len(every) > most else ""
    return ", ".join(every[:most]) + more


def suggestion(name: str, known: Iterable[str]) -> str:
    """Return ``" (did you mean 'x'?)"`` for the known name nearest to `name`, or ``""``."""
    import difflib  # here and below, because only a mistake needs it
    import unicodedata

    def plain(text: str) -> str:
        """In small letters, with Greek ones spelled out."""
        names = [(letter, unicodedata.name(letter, "").split()) for letter in text.lower()]
        return "".join(of[-1].lower() if of[:1] == ["GREEK"] else letter for letter, of in names)

    spelled = {plain(each): each for each in known}
    near = difflib.get_close_matches(plain(str(name)), list(spelled), n=1)
    return f" (did you mean {spelled[near[0]]!r}?)" if near else ""
