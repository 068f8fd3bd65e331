"""Under which conditions a number was measured: every one by name, with its unit and its meaning.

A protocol names those on which its numbers depend; a file has a column ``at_NAME`` for each."""

from __future__ import annotations

from typing import Annotated, TypedDict, cast, get_type_hints

from model.arrays import Array
from model.kinematics import UNITS as STATE_UNITS
from model.kinematics import VARIABLES


class FluidConditions(TypedDict, total=False):
    """A ball that falls in a fluid."""

    nu_f: Annotated[float, "m2 s-1"]  #: kinematic viscosity
    rho_f: Annotated[float, "kg m-3"]  #: density of the fluid
    rho_b: Annotated[float, "kg m-3"]  #: density of the ball
    r: Annotated[float, "m"]  #: radius of the ball
    gravity: Annotated[float, "m s-2"]


class Conditions(FluidConditions, total=False):
    """What a number depends on beside its parameters; what its protocol doesn't name is absent."""

    # a state, in the units of `model.kinematics`
    y: float
    v_y: float
    omega_c: float
    slip_x: float
    slip_y: float
    slip_z: float
    h: float
    v_h: float

    case: str  #: name of the case, of a settled state or at the end of a motion
    before: str  #: name of the case on the level before
    inner: str  #: name of the case out of which a ball is pushed
    outer: str  #: name of the case into which
    start: str  #: how the ball starts
    by: str  #: how the number was found
    side: str  #: from which side of a threshold, or on the way up or down
    figure: str  #: the figure of the paper that is measured
    event: str
    slips: str  #: whether a ball slips at one point or at both
    contact: str  #: A or B
    law: str  #: a law of contact, in words
    of: str  #: the variable that answers a push
    pushed: str  #: the variable that is pushed
    level: float  #: number of a level of the flow, from 1
    mode: float  #: number of a mode in order of frequency, from 1
    restitution: float
    time: Annotated[float, "s"]
    duration: Annotated[float, "s"]
    period: Annotated[float, "s"]
    f: Annotated[float, "Hz"]  #: frequency of a pulsation
    amplitude: Annotated[float, "rad s-1"]  #: of a pulsation
    rate: Annotated[float, "rad s-2"]  #: at which the flow rises
    slip: Annotated[float, "rad s-1"]  #: size of a push
    # direction of a push, a unit vector
    n_x: float
    n_y: float
    n_z: float


UNITS = dict(zip(VARIABLES, STATE_UNITS, strict=True)) | {
    name: kind.__metadata__[0]
    for name, kind in get_type_hints(Conditions, include_extras=True).items()
    if hasattr(kind, "__metadata__")
}
"""SI units of those that have one."""


def state_of(x: Array) -> Conditions:
    """A state (8,), or without the last two (6,), as conditions."""
    return cast(Conditions, dict(zip(VARIABLES, x.tolist(), strict=False)))
