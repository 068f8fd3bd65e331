"""The dual-point contact ball in MuJoCo; knows no solution of the problem."""

from mjsim.contact_settings import ContactSettings
from mjsim.engine import Run, simulate, simulate_many

__all__ = ["ContactSettings", "Run", "simulate", "simulate_many"]
