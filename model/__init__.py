"""What the system is: parameters, kinematics, cases, flow, and the trajectories that simulators return."""

from model.cases import Case, Contact
from model.errors import InputError, StorageError
from model.flow import Flow
from model.kinematics import State
from model.parameters import Parameters
from model.trajectory import Events, Header, SimulationError, Trajectory

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
