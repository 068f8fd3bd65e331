"""Coulomb's law of friction, in any MuJoCo simulation."""

from .doors import Coulomb

__all__ = ["Coulomb"]
