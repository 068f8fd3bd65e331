"""The dual-point contact ball in MuJoCo, and Coulomb's law for any model; knows no solution of the
problem."""

import importlib
from typing import TYPE_CHECKING, Any

import mujoco

import model

if not hasattr(model, "Parameters"):
    raise ImportError(
        f"{model.__file__} hides the package model of dualball: rename that, or work in another "
        f"folder"
    )

if not hasattr(mujoco.MjModel, "pair_adhesion"):
    raise ImportError(
        f"dualball needs MuJoCo 4.0, and this is {mujoco.__version__}: Coulomb's law alone, "
        f"package mujoco-coulomb, "
        "runs on 3.3.6 and later"
    )

from mjsim.contact_settings import ContactSettings, RigidContacts
from mjsim.engine import Run, simulate, simulate_many

if TYPE_CHECKING:
    from mjsim.coulomb import Coulomb

__all__ = ["ContactSettings", "Coulomb", "RigidContacts", "Run", "simulate", "simulate_many"]


def __getattr__(name: str) -> Any:
    """The law when it is asked for: compiled, it takes as long to load as all else."""
    if name == "Coulomb":
        return importlib.import_module("mjsim.coulomb").Coulomb
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
