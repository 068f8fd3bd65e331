"""Coulomb's law of friction, in any MuJoCo simulation."""

from .coulomb import Coulomb

__all__ = ["Coulomb"]
