"""Theory and engine side by side: measure blind, predict, judge, show."""

from compare.claims.claim import Check, Claim, Outcome, Verdict
from compare.measure.lab import Level

__all__ = ["Check", "Claim", "Level", "Outcome", "Verdict"]
