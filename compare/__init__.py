"""Theory and engine side by side: claims, studies, campaigns, figures, the report and the command line."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from compare.claims import Check, Claim, Level, Outcome, Verdict

if TYPE_CHECKING:
    from compare.catalogue import CLAIMS
    from compare.validation import validate

__all__ = ["CLAIMS", "Check", "Claim", "Level", "Outcome", "Verdict", "validate"]


_LATE = {"CLAIMS": "catalogue", "validate": "validation"}


def __getattr__(name: str) -> Any:
    """CLAIMS and validate when they are asked for: a study that is run as a script needs no other."""
    if name in _LATE:
        return getattr(import_module(f"compare.{_LATE[name]}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
