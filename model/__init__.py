"""What the system is: parameters, kinematics, cases, flow, and what simulators return."""

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from model.cases import Case as Case
    from model.cases import Contact as Contact
    from model.errors import InputError as InputError
    from model.errors import SimulationError as SimulationError
    from model.errors import StorageError as StorageError
    from model.flow import Flow as Flow
    from model.kinematics import State as State
    from model.parameters import Parameters as Parameters
    from model.trajectory import Events as Events
    from model.trajectory import Header as Header
    from model.trajectory import Trajectory as Trajectory

_MODULES = {
    **dict.fromkeys(("Case", "Contact"), "cases"),
    **dict.fromkeys(("InputError", "SimulationError", "StorageError"), "errors"),
    "Flow": "flow",
    "State": "kinematics",
    "Parameters": "parameters",
    **dict.fromkeys(("Events", "Header", "Trajectory"), "trajectory"),
}
__all__ = [*_MODULES]


def __getattr__(name: str) -> Any:
    """A name when it is asked for: the help of a command needs no arrays."""
    if name not in _MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    module = importlib.import_module(f"model.{_MODULES[name]}")
    return globals().setdefault(name, getattr(module, name))
