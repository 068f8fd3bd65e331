"""What a newcomer's settings get wrong, and what takes it away: from MuJoCo's defaults to ours, a step at a time."""

from __future__ import annotations

import math
import sys
from typing import Any

from compare.claims import Check, Claim, Lab, Level
from compare.frontier import GOAL, STATES, mujoco_defaults, scores
from compare.studies import main
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
    checks = []
    for (name, settings), row in zip(LADDER.items(), scores(lab, "mujoco", list(LADDER.values())), strict=True):
        ours = settings == ContactSettings()
        for score in row:
            goal = GOAL if ours and score.quantity in STATES else math.inf
            for quantity, value, tolerance in (
                (score.quantity, score.error, goal), (f"open in {score.quantity}", 1 - score.closed, math.inf)
            ):  # fmt: skip
                checks.append(
                    Check(
                        quantity=quantity, unit="1", witness="mujoco", parameters="reference",
                        omega_0=score.task.parameters.omega_0, condition=name, predicted=0.0, measured=value,
                        uncertainty=0.0, tolerance=tolerance, run=lab.file(score.task),
                    )
                )  # fmt: skip
    return checks


CLAIMS = (
    Claim(
        id=ID, source="docs/mujoco-settings.md",
        statement="Wall, coordinates, contact parameters and corrections each take away an error of their own.",
        prediction="closed-form stationary states; the event-driven simulation for the transient",
        measurement="relative error of ω_c under settings that each have one thing more than the one before",
        tolerance=f"{GOAL:g} for stationary states under the last; what comes before is shown",
        level=Level.DEFAULT, study=_study,
    ),
)  # fmt: skip

if __name__ == "__main__":
    sys.exit(main(CLAIMS))
