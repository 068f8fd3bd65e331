"""What a newcomer's settings get wrong, and what takes it away: from MuJoCo's defaults to ours, a step at a time.

What is judged is that each step takes away something: at least one error, or one share of samples in which a contact
that should carry a force is open, falls to less than half.
"""

from __future__ import annotations

import sys
from typing import Any

from compare.claims import Check, Claim, Lab, Level
from compare.frontier import Score, mujoco_defaults, scores
from compare.studies import Bench, main
from mjsim import ContactSettings

ID = "ablation"
STEP = 1e-3
"""Time step, s."""
_CURE: dict[str, Any] = {"memory": False, "servo": 0.0, "order": 1}
LADDER: dict[str, ContactSettings] = {
    "free joint, prism, MuJoCo's defaults": mujoco_defaults(STEP, cone="pyramidal", coordinates="free", wall="prism"),
    "+ one wall that turns along": mujoco_defaults(STEP, cone="pyramidal", coordinates="free"),
    "+ elliptic cone": mujoco_defaults(STEP, coordinates="free"),
    "+ polar joints": mujoco_defaults(STEP),
    "+ stiff, continuous contact": ContactSettings.at(STEP, **_CURE),
    "+ servo of the margins": ContactSettings.at(STEP, **_CURE | {"servo": ContactSettings.servo}),
    "+ memory of friction": ContactSettings.at(STEP, order=1),
    "+ midpoint (ours)": ContactSettings.at(STEP),
}
"""Settings, each with one thing more than the one before."""


def _study(lab: Lab) -> list[Check]:
    bench, before, found = Bench(lab, "reference"), None, []
    for name, row in zip(LADDER, scores(lab, "mujoco", list(LADDER.values())), strict=True):
        for score in row:
            found.append(bench.shown(score.task, score.quantity, name, score.error))
            found.append(bench.shown(score.task, f"open in {score.quantity}", name, 1 - score.closed))
        if before:
            found.append(bench.count(row[-1].task, "steps in vain", name, 0, int(not _gain(before, row))))
        before = row
    return found


def _gain(before: list[Score], row: list[Score]) -> bool:
    """Whether at least one number fell to less than half."""
    pairs = list(zip(before, row, strict=True))
    return any(b.error < a.error / 2 or 1 - b.closed < (1 - a.closed) / 2 for a, b in pairs)


CLAIMS = (
    Claim(
        id=ID, source="docs/mujoco-settings.md",
        statement="Wall, coordinates, contact parameters and corrections each take away an error of their own.",
        prediction="closed-form stationary states; the event-driven simulation for the transient",
        measurement="relative error of ω_c under settings that each have one thing more than the one before",
        tolerance="none: every step must at least halve one of the errors, or one of the shares of open samples",
        level=Level.DEFAULT, study=_study,
    ),
)  # fmt: skip

if __name__ == "__main__":
    sys.exit(main(CLAIMS))
