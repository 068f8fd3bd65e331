"""Theory and engine side by side: measure blind, predict, judge, show."""

from typing import TYPE_CHECKING, Any

from compare.claims.claim import Check, Claim, Outcome, Verdict
from compare.measure.lab import Level

if TYPE_CHECKING:
    from compare.validation import validate

__all__ = ["Check", "Claim", "Level", "Outcome", "Verdict", "validate"]


def __getattr__(name: str) -> Any:
    """`validate` when it is asked for: it draws, and a worker that imports this package never does."""
    if name == "validate":
        from compare.validation import validate

        return validate
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
