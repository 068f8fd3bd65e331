"""What an engine comes in, and what to say where it isn't."""

from __future__ import annotations

import importlib
import importlib.util
from dataclasses import dataclass
from typing import Any, Protocol

from model import InputError
from model.trajectory import version


class Library(Protocol):
    """What an engine comes in."""

    @property
    def name(self) -> str:
        """What it is called where it is installed."""

    @property
    def missing(self) -> str:
        """Why it can't be used here, and what to do about it; empty if it can."""

    @property
    def version(self) -> str:
        """Or that it isn't installed."""

    def load(self) -> Any:
        """What a scene is built with; `InputError` if it is missing."""


@dataclass(frozen=True)
class Package:
    """A Python package of the extra ``engines``."""

    name: str
    module: str
    """The module to import, which may be called otherwise."""

    @property
    def missing(self) -> str:
        """As in `Library`."""
        return "" if importlib.util.find_spec(self.module.split(".")[0]) else self._advice

    @property
    def version(self) -> str:
        """As in `Library`."""
        return version(self.name)

    def load(self) -> Any:
        """The module."""
        try:
            return importlib.import_module(self.module)
        except ImportError as error:
            raise InputError(self._advice) from error

    @property
    def _advice(self) -> str:
        return f'{self.name} is not installed: pip install "dualball[engines]"'
