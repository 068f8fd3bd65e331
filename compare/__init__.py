"""Theory and engine side by side: measure blind, predict, judge, show."""

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from compare.method.record import Check
    from compare.plan import Level
    from compare.validation import validate
    from compare.verification.claim import Claim, Outcome, Verdict

__all__ = ["Check", "Claim", "Level", "Outcome", "Verdict", "validate"]

pytest_plugins = ("compare.plugin",)
"""Pytest's entry point is this package: a foreign ``compare`` has no such line, and breaks none."""
_MODULES = dict.fromkeys(("Claim", "Outcome", "Verdict"), "compare.verification.claim") | {
    "Check": "compare.method.record",
    "Level": "compare.plan",
    "validate": "compare.validation",
}


def __getattr__(name: str) -> Any:
    """A name when it is asked for: engines take a second to load, and `predict` needs none."""
    if name in _MODULES:
        import compare.engines  # noqa: F401  (it says so where somebody else's `model` is in the way)

        return getattr(importlib.import_module(_MODULES[name]), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
