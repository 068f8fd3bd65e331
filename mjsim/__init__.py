"""The dual-point contact ball in MuJoCo, and Coulomb's law for any model; knows no solution of the problem."""

import model

if not hasattr(model, "Parameters"):
    raise ImportError(f"{model.__file__} hides the package model of dualball: rename that, or work in another folder")

from mjsim.contact_settings import ContactSettings
from mjsim.coulomb import Coulomb
from mjsim.engine import Run, simulate, simulate_many

__all__ = ["ContactSettings", "Coulomb", "Run", "simulate", "simulate_many"]
