"""Theory and engine side by side: claims, studies, campaigns, figures, the report and the command line."""

from compare.claims import Check, Claim, Level, Outcome, Verdict
from compare.validation import CLAIMS, validate

__all__ = ["CLAIMS", "Check", "Claim", "Level", "Outcome", "Verdict", "validate"]
