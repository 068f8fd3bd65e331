"""The nine kinematic cases (Fig. 2) and what each of them fixes (Tables 3 and 4)."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum, IntEnum

from model.errors import InputError


class Contact(Enum):
    """State of one contact point."""

    R = "rolling"
    S = "slipping"
    N = "no contact"


class Case(IntEnum):
    """Kinematic case: a letter for the floor (A), one for the wall (B); its value in files."""

    RR = 0
    RS = 1
    RN = 2
    SR = 3
    SS = 4
    SN = 5
    NR = 6
    NS = 7
    NN = 8

    @classmethod
    def _missing_(cls, value: object) -> Case:
        """Let ``Case("SS")`` give the case of that name; raise `InputError` if there is none."""
        if isinstance(value, str) and value in cls.__members__:
            return cls[value]
        raise InputError(f"case = {value!r} must be one of {', '.join(cls.__members__)}")

    @property
    def A(self) -> Contact:
        """Contact with the floor."""
        return Contact[self.name[0]]

    @property
    def B(self) -> Contact:
        """Contact with the wall."""
        return Contact[self.name[1]]

    @classmethod
    def of(cls, A: Contact, B: Contact) -> Case:
        """The case with the given contacts."""
        return cls[A.name + B.name]


@dataclass(frozen=True)
class CaseTraits:
    """One row of Tables 3 and 4, extended to motion away from the wall.

    ``constraints`` are expressions in the variables of `model.kinematics.VARIABLES` that vanish in
    the case; ``active`` are the independent variables left, as many as the third number of each
    panel of Fig. 2 says."""

    constraints: tuple[str, ...]
    active: tuple[str, ...]


TRAITS: dict[Case, CaseTraits] = {
    Case.RR: CaseTraits(("y", "v_y", "h", "v_h", "slip_x", "slip_y", "slip_z"), ("omega_c",)),
    Case.RS: CaseTraits(("y", "v_y", "h", "v_h", "slip_x", "slip_z"), ("omega_c", "slip_y")),
    Case.SR: CaseTraits(("y", "v_y", "h", "v_h", "slip_y", "slip_z"), ("omega_c", "slip_x")),
    Case.SS: CaseTraits(("y", "v_y", "h", "v_h"), ("omega_c", "slip_x", "slip_y", "slip_z")),
    Case.NR: CaseTraits(("h", "v_h", "slip_y", "slip_z"), ("y", "v_y", "omega_c", "slip_x")),
    Case.NS: CaseTraits(("h", "v_h"), ("y", "v_y", "omega_c", "slip_x", "slip_y", "slip_z")),
    # Rolling on the floor away from the wall: the contact point rests, v_A = (v_h + r slip_z, 0, -r
    # slip_x) = 0.
    Case.RN: CaseTraits(
        ("y", "v_y", "slip_x", "v_h + r slip_z"), ("omega_c", "slip_y", "h", "v_h")
    ),
    Case.SN: CaseTraits(("y", "v_y"), ("omega_c", "slip_x", "slip_y", "slip_z", "h", "v_h")),
    Case.NN: CaseTraits((), ("y", "v_y", "omega_c", "slip_x", "slip_y", "slip_z", "h", "v_h")),
}
