"""Under which conditions a number was measured: every one by name, with its unit and its meaning.

A protocol names those on which its numbers depend; a file has a column ``at_NAME`` for each."""

from __future__ import annotations

from typing import Annotated, TypedDict, cast, get_type_hints

from model.arrays import Array
from model.kinematics import UNITS as STATE_UNITS
from model.kinematics import VARIABLES


class FluidConditions(TypedDict, total=False):
    """A ball that falls in a fluid."""

    nu_f: Annotated[float, "m2 s-1"]
    """Kinematic viscosity."""
    rho_f: Annotated[float, "kg m-3"]
    """Density of the fluid."""
    rho_b: Annotated[float, "kg m-3"]
    """Density of the ball."""
    r: Annotated[float, "m"]
    """Radius of the ball."""
    gravity: Annotated[float, "m s-2"]


class Conditions(FluidConditions, total=False):
    """What a number depends on beside its parameters; those that its protocol doesn't name are
    absent."""

    y: float
    """This and those up to `v_h`: a state, in the units of `model.kinematics`."""
    v_y: float
    omega_c: float
    slip_x: float
    slip_y: float
    slip_z: float
    h: float
    v_h: float
    case: str
    """Name of the case, of a settled state or at the end of a motion."""
    before: str
    """Name of the case on the level before."""
    inner: str
    """Name of the case out of which a ball is pushed."""
    outer: str
    """Name of the case into which."""
    start: str
    """How the ball starts."""
    by: str
    """How the number was found."""
    side: str
    """From which side of a threshold, or on the way up or down."""
    figure: str
    """The figure of the paper that is measured."""
    event: str
    slips: str
    """Whether a ball slips at one point or at both."""
    contact: str
    """A or B."""
    law: str
    """A law of contact, in words."""
    of: str
    """The variable that answers a push."""
    pushed: str
    """The variable that is pushed."""
    level: float
    """Number of a level of the flow, from 1."""
    mode: float
    """Number of a mode in order of frequency, from 1."""
    restitution: float
    time: Annotated[float, "s"]
    duration: Annotated[float, "s"]
    period: Annotated[float, "s"]
    f: Annotated[float, "Hz"]
    """Frequency of a pulsation."""
    amplitude: Annotated[float, "rad s-1"]
    """Of a pulsation."""
    rate: Annotated[float, "rad s-2"]
    """At which the flow rises."""
    slip: Annotated[float, "rad s-1"]
    """Size of a push."""
    n_x: float
    """Direction of a push, a unit vector."""
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
