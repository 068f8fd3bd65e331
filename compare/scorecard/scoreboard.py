"""The scores that figures draw, kept beside the results."""

from __future__ import annotations

import json
from pathlib import Path

from compare.runs.campaign import Campaign
from compare.scorecard import scores
from compare.scorecard.scores import ELSEWHERE, Score
from model import StorageError
from model.files import write_text

FILE = "scores.json"
STEPS = (4e-3, 2e-3, 1e-3)
"""Time steps of error against cost, s."""


def write(campaign: Campaign, directory: Path) -> None:
    """Measure ladder and error against cost, unless they are there."""
    if not (directory / FILE).exists():
        measured = {"ladder": scores.ladder(campaign), "frontier": scores.frontier(campaign, STEPS)}
        content = {name: [score.to_mapping() for score in row] for name, row in measured.items()}
        write_text(directory / FILE, json.dumps(content, indent=1))


def read(directory: Path) -> dict[str, tuple[Score, ...]]:
    """The scores by name, none where none were measured; raises `StorageError` for a file that isn't whole."""
    path = directory / FILE
    if not path.exists():
        return {}
    try:
        rows = json.loads(path.read_text("utf-8"))
        kept = {name: tuple(Score.from_mapping(values) for values in rows[name]) for name in ("ladder", "frontier")}
    except (ValueError, KeyError, TypeError) as error:
        raise StorageError(f"{path} is damaged: remove it, and it is measured again") from error
    return {**kept, "elsewhere": tuple(ELSEWHERE)}
