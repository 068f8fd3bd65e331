"""Settings of MuJoCo's own contacts, and the theory of what they do to a ball that slides and
rolls.

Force f and acceleration a of a row obey ``a + R f = a_ref`` inside the friction cone, with ``R = (1
- d)/d A`` of the inverse mass A and the impedance d (`solimp`), ``R_t = R / impratio`` in friction
rows, and

    normal row:    a_ref = -b v - k gap,   b = 2/(d tc),   k = 1/(d tc^2 dr^2),   solref = (tc, dr)
    friction rows: a_ref = -b_f v,         b_f = 2/(d tc_f),                 solreffriction = tc_f

On the cone, slip lifts the contact: with ``w = a - a_ref + R_t f`` of the friction rows, in steady
motion ``-k gap = R f - mu |w|``, ``|w| = b_f v_slip - mu R_t f``. So sliding is continuous only
while ``mu |w| < R f``: beyond, the contact switches on and off from step to step.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, Self

import numpy as np
import numpy.typing as npt

from model import InputError, Parameters
from model.arrays import Array
from model.parameters import POSITIVE, Range, check_choice, check_names, check_number

PREDICTED, YIELDS = 2e-3, 1e-5
"""Slip of rigid contacts that roll, divided by what their friction force makes in a step: in motion
at most twice, and once all is steady a hundredth of `Law.regularisation` of mjsim.coulomb. (Both
were chosen after slips of a rolling ball had been seen.)"""
LANDING_PARTS = 16
"""Into how many parts a step is divided in which a ball with rigid contacts lands: an impact falls
into one of them."""
_LEFT, _STURDY = 0.95, ((3.0, 0.75), (4.0, 1.0), (8.0, 1.0), (12.0, 1.5))
"""`contact_decay` beyond which contacts are made slower; and `solref` with its time in steps, the
fastest first: stable up to mu eta = 1.03, 2.1, 5 and 9."""


def _number(default: float, unit: str, allowed: Range) -> Any:
    """Declare a setting that is a number, with its default, unit and allowed range."""
    return dataclasses.field(default=default, metadata={"unit": unit, "allowed": allowed})


def _choice(*known: Any) -> Any:
    """Declare a setting that is one of a few values; the first is the default."""
    return dataclasses.field(default=known[0], metadata={"known": known})


def _check(settings: Any) -> None:
    """Check the fields of settings as they are declared."""
    for field in dataclasses.fields(settings):
        value = getattr(settings, field.name)
        if "unit" in field.metadata:
            check_number(field.name, value, field.metadata["unit"], field.metadata["allowed"])
        elif "known" in field.metadata:
            check_choice(field.name, value, field.metadata["known"])


@dataclass(frozen=True, kw_only=True)
class RigidContacts:
    """Rigid contacts that obey Coulomb's law as `mjsim.Coulomb` has it for any model.

    Raises `InputError` if the time step isn't positive.
    """

    timestep: float = _number(1e-3, "s", POSITIVE)
    """Time step, s."""
    midpoint: ClassVar[float] = 0.5
    """Where in a step forces are taken, in steps after its beginning."""

    def __post_init__(self) -> None:
        _check(self)

    def creep_speed(self, load: npt.ArrayLike) -> Array:
        """Slip speed (m s-1) of a contact that rolls steadily, under a friction force of m times
        `load` (m s-2): what a step changes by a share `YIELDS` of that."""
        return np.asarray(YIELDS * self.timestep * np.asarray(load, dtype=float))

    def dead_band(self, load: npt.ArrayLike) -> Array:
        """Slip speed (m s-1) below which a contact counts as rolling, under such a force."""
        return PREDICTED / YIELDS * self.creep_speed(load)

    def touching(self, load: float) -> float:
        """Gap (m) within which a ball at the start counts as touching, under a load (m s-2)."""
        return 0.0


@dataclass(frozen=True, kw_only=True)
class ContactSettings:
    """How MuJoCo's own contacts are set, by its own names. The defaults belong to a step of 1 ms.

    Raises `InputError` if a value is outside what the engine can do or would be unstable.
    """

    timestep: float = _number(1e-3, "s", POSITIVE)
    """Time step, s."""
    solref: tuple[float, float] = (2e-3, 0.5)
    """Time constant (s) and damping ratio of the normal rows; `suited` makes them slower where
    friction asks for it."""
    solreffriction: float = _number(2.0, "s", POSITIVE)
    """Time constant tc_f of the friction rows, s."""
    solimp: float = _number(1e-3, "1", Range(1e-4, 0.9999))
    """Impedance d, one value at every depth."""
    impratio: float = _number(3e3, "1", Range(0.1, 1e7))
    """How much stiffer the friction rows are than the normal row; beyond 1e7 the solver fails."""
    cone: str = _choice("elliptic", "pyramidal")
    integrator: str = _choice("Euler", "implicit", "implicitfast", "discrete")
    noslip_iterations: int = _number(0, "1", Range(0, whole=True))
    midpoint: ClassVar[float] = 0.0
    """Where in a step forces are taken, in steps after its beginning."""

    def __post_init__(self) -> None:
        if len(self.solref) != 2:
            raise InputError(
                f"solref = {self.solref!r} must be two numbers, time constant (s) and damping ratio"
            )
        check_number("solref time constant", self.solref[0], "s", POSITIVE)
        check_number("solref damping ratio", self.solref[1], "1", POSITIVE)
        _check(self)
        if self.timestep > self.largest_timestep * (1 + 1e-12):
            raise InputError(
                f"timestep = {self.timestep:g} s is too large for the contact settings: solref "
                f"{self.solref[0]:g} s and solreffriction {self.solreffriction:g} s allow at most "
                f"{self.largest_timestep:g} s"
            )

    @property
    def largest_timestep(self) -> float:
        """Largest stable time step, s.

        The normal rows need tc >= 2 h (else the engine silently replaces tc), the friction rows b_f
        h <= 1 to die out without changing sign."""
        return min(self.solref[0] / 2, self.solreffriction * self.solimp / 2)

    @property
    def b_f(self) -> float:
        """Damping of the friction rows, s-1."""
        return 2 / (self.solimp * self.solreffriction)

    @property
    def k(self) -> float:
        """Stiffness of the normal rows, s-2."""
        return 1 / (self.solimp * (self.solref[0] * self.solref[1]) ** 2)

    @property
    def regularisation(self) -> float:
        """Regularisation of the normal rows divided by the diagonal of A, R/A = (1 - d)/d, with d
        from `solimp`."""
        return (1 - self.solimp) / self.solimp

    def hover_number(self, load: float, friction: float, slip_speed: float) -> float:
        """The hover number mu |w| / (R f): a sliding contact stays closed below 1; of a `load` > 0.

        What R_t takes off |w| is left out, to be on the safe side."""
        return friction * self.b_f * slip_speed / (self.regularisation * load)

    def creep_speed(self, load: npt.ArrayLike) -> Array:
        """Slip speed (m s-1) of a contact that rolls steadily, R_t f_t / b_f, under a friction
        force of m times `load` (m s-2)."""
        own = self.regularisation / self.impratio / self.b_f
        return np.asarray(own * np.asarray(load, dtype=float))

    def dead_band(self, load: npt.ArrayLike) -> Array:
        """Slip speed (m s-1) below which a contact counts as rolling, under such a force."""
        return 0.4 * self.creep_speed(load)

    def contact_decay(self, mu: float, eta: float) -> float:
        """Largest factor by which a small displacement changes in a step, where a ball slips at
        both contacts.

        With a low impedance the accelerations are those of springs and dampers, -K (2/tc v + 1/(tc
        dr)^2 gap), and friction turns them against each other: K = [[1, eta], [-mu, 1]], with the
        eigenvalues 1 +- i sqrt(mu eta). Beyond 1 the contacts chatter."""
        (time, ratio), pull = self.solref, 1 + 1j * math.sqrt(mu * eta)
        damping, stiffness = 2 * self.timestep / time, (self.timestep / (time * ratio)) ** 2
        return float(
            np.abs(np.roots([1, pull * (damping + stiffness) - 2, 1 - pull * damping])).max()
        )

    def depth(self, load: float) -> float:
        """How deep the ball sinks under a steady load (force divided by mass, m s-2) while it
        rolls, m; slip lifts it."""
        return self.regularisation * load / self.k

    def touching(self, load: float) -> float:
        """Gap (m) within which a ball at the start counts as touching: twice the depth to which a
        load (m s-2) presses it."""
        return 2 * self.depth(load)

    @classmethod
    def from_mapping(cls, values: Mapping[str, Any]) -> Self:
        """Settings from the values of their fields, as JSON has them; raises `InputError` for an
        unknown name."""
        check_names(values, [f.name for f in dataclasses.fields(cls)], "contact setting")
        changes = dict(values)
        if "solref" in changes:
            changes["solref"] = tuple(changes["solref"])
        return cls(**changes)

    @classmethod
    def at(cls, timestep: float, **changes: Any) -> Self:
        """The defaults for another step, to which their times are scaled, and the given changes."""
        check_number("timestep", timestep, "s", POSITIVE)
        scale, (time, ratio) = timestep / 1e-3, cls.solref
        scaled = {"solref": (time * scale, ratio), "solreffriction": cls.solreffriction * scale}
        return cls.from_mapping({"timestep": timestep} | scaled | changes)

    def suited(self, p: Parameters) -> Self:
        """These settings, with slower contacts where friction between floor and wall would make the
        ball chatter."""
        if self.contact_decay(p.mu, p.eta) <= _LEFT:
            return self
        slower = [
            dataclasses.replace(self, solref=(steps * self.timestep, ratio))
            for steps, ratio in _STURDY
        ]
        return next((each for each in slower if each.contact_decay(p.mu, p.eta) <= 1), slower[-1])

    @classmethod
    def for_problem(cls, p: Parameters, timestep: float, speed: float, **changes: Any) -> Self:
        """MuJoCo's own contacts, so soft that those of this ball which slide with `speed` (m s-1)
        under the load of gravity stay closed instead of hovering.

        The impedance is lowered, where need be, until the hover number is 1/20, since a contact
        about to lift off carries little; the engine's least one, 1e-4, may stop that short. Damping
        and regularisation of the friction rows stay what they are."""
        settings = cls.at(timestep, **changes)
        hover = settings.hover_number(p.g, max(p.mu, p.eta), speed)
        if hover <= 0.05:
            return settings
        solimp = max(1 / (1 + settings.regularisation * hover / 0.05), 1e-4)
        return dataclasses.replace(
            settings,
            solimp=solimp,
            solreffriction=settings.solreffriction * settings.solimp / solimp,
            impratio=settings.impratio * settings.solimp / solimp,
        )


ContactModel = RigidContacts | ContactSettings
"""How the ball's contacts are set."""
