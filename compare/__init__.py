"""Theory and engine side by side: claims, studies, campaigns, figures, the report and the command line."""

from typing import TYPE_CHECKING, Any

from compare.claims import Check, Claim, Level, Outcome, Verdict

if TYPE_CHECKING:
    from compare.validation import CLAIMS, validate

__all__ = ["CLAIMS", "Check", "Claim", "Level", "Outcome", "Verdict", "validate"]


def __getattr__(name: str) -> Any:
    """CLAIMS and validate when they are asked for: a study that is run as a script needs no other."""
    if name in ("CLAIMS", "validate"):
        from compare import validation

        return getattr(validation, name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
