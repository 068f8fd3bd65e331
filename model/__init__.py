"""What the system is: parameters, kinematics, cases, flow, and the trajectories that simulators return."""

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from model.cases import Case, Contact
    from model.errors import InputError, SimulationError, StorageError
    from model.flow import Flow
    from model.kinematics import State
    from model.parameters import Parameters
    from model.trajectory import Events, Header, Trajectory

__all__ = [
    "Case",
    "Contact",
    "Events",
    "Flow",
    "Header",
    "InputError",
    "Parameters",
    "SimulationError",
    "State",
    "StorageError",
    "Trajectory",
]
_MODULES = {
    **dict.fromkeys(("Case", "Contact"), "cases"),
    **dict.fromkeys(("InputError", "SimulationError", "StorageError"), "errors"),
    "Flow": "flow",
    "State": "kinematics",
    "Parameters": "parameters",
    **dict.fromkeys(("Events", "Header", "Trajectory"), "trajectory"),
}


def __getattr__(name: str) -> Any:
    """A name when it is asked for: the help of a command needs none of the arrays that most of them are made of."""
    if name in _MODULES:
        return globals().setdefault(name, getattr(importlib.import_module(f"model.{_MODULES[name]}"), name))
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
