"""Trials: from where runs begin."""

from __future__ import annotations

from dataclasses import dataclass

from model import Parameters
from model.arrays import Array


@dataclass(frozen=True, eq=False)
class Start:
    """From where a run begins."""

    set: str
    p: Parameters
    name: str
    x0: Array
