"""What a campaign keeps of a run: its samples, whole or not, and beside them what it cost."""

from __future__ import annotations

import json
from collections.abc import Callable

from compare.runs.campaign import Campaign
from compare.runs.tasks import Task, failed_path
from model import Trajectory, storage
from model.files import write_text


def run(campaign: Campaign, task: Task) -> Trajectory:
    """The run of a task, or what there is of one that broke down."""
    path = campaign.path(task)
    return storage.load(path if path.exists() else failed_path(path))


def cost(campaign: Campaign, task: Task, measured: Callable[[], float]) -> float:
    """Processor time over simulated time of a run: `measured` once, and kept beside the run."""
    path = campaign.path(task).with_suffix(".cost.json")
    if not path.exists():
        write_text(path, json.dumps(measured()))
    return float(json.loads(path.read_text("utf-8")))
