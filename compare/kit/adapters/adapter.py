"""What an adapter brings: where its engine comes from, how it is set, and a ball that takes steps."""

from __future__ import annotations

import importlib
import importlib.util
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple, Protocol

import numpy as np
import numpy.typing as npt

from model import InputError
from model.arrays import Array
from model.parameters import POSITIVE, check_choice, check_number
from model.trajectory import version

Floats = Sequence[float]


@dataclass(frozen=True)
class Library:
    """What an engine comes in: here a Python package of the extra ``engines``."""

    name: str
    """What it is called where it is installed."""
    module: str = ""
    """The module to import."""

    @property
    def missing(self) -> str:
        """Why it can't be used here, and what to do about it; empty if it can."""
        there = importlib.util.find_spec(self.module.split(".")[0])
        return "" if there else f"{self.name} is not installed: pip install {self.name}"

    @property
    def version(self) -> str:
        """Or that it isn't installed."""
        return version(self.name)

    def load(self) -> Any:
        """What a scene is built with; `InputError` if it is missing."""
        try:
            return importlib.import_module(self.module)
        except ImportError as error:
            raise InputError(self.missing or f"{self.name} can't be imported: {error}") from error


@dataclass(frozen=True, kw_only=True)
class Settings:
    """What the settings of all engines have."""

    timestep: float = 1e-3
    """s"""
    coordinates: str = "joints"
    """``joints``, or ``free`` for a free ball."""

    rolls: ClassVar[float] = 3.0
    """Share of `regularisation_speed` below which a contact rolls: how exact that speed is isn't known."""
    midpoint: ClassVar[float] = 0.0
    """Forces are those at the beginning of a step."""

    def __post_init__(self) -> None:
        check_number("timestep", self.timestep, "s", POSITIVE)
        check_choice("coordinates", self.coordinates, ("joints", "free"))

    @property
    def resolution(self) -> float:
        """The least slip speed that the engine tells from rolling, m s-1."""
        return 0.0

    def regularisation_speed(self, load: npt.ArrayLike) -> Array:
        """The resolution, and for round-off at least 1e-9 m s-1."""
        return np.full(np.shape(load), max(self.resolution, 1e-9))


class Touch(NamedTuple):
    """What a contact point of the engine carried in the last step."""

    contact: int
    """0 for the floor (A), 1 for the wall (B)."""
    force: Array
    """On the ball, in the axes of the scene, shape (3,), N."""
    gap: float
    """m"""


class Scene(Protocol):
    """A ball in an engine. Its axes are the world's; on joints, those in which the azimuth is zero."""

    def start(self, place: Floats, velocity: Floats) -> None:
        """Put the ball somewhere: what the three and six numbers are, `compare.kit.adapters.loop` says."""

    def advance(self, force: Floats) -> tuple[Floats, Floats]:
        """Take a step under a (generalised) force of three components; return place and velocity after it.

        On joints the azimuth in `place` is that of this step alone. Raises `BreakdownError`.
        """

    def touches(self) -> list[Touch]:
        """The contact points of the last step."""

    def close(self) -> None:
        """Release what the engine holds."""


class BreakdownError(RuntimeError):
    """The engine can't take the next step."""


def tangent(radius: float, azimuth: float) -> tuple[Array, Array]:
    """Point and inward normal, each (3,), of the plane that touches a cylinder about the z axis there."""
    normal = -np.array([math.cos(azimuth), math.sin(azimuth), 0.0])
    return -radius * normal, normal
