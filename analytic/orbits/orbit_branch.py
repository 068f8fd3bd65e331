"""Branches of periodic motions: orbits followed in one parameter from birth to death.

The branch is followed by its length (in natural units of the state, and the logarithm of the
parameter), so that it may turn back: a step along the tangent, then Newton's method across it.
Where stability or the sequence of cases changes between two orbits, the place is located."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.optimize import brentq

from analytic.orbits import periodic
from analytic.orbits.periodic import Changes, NoOrbitError, Orbit, landings, refine
from model import InputError, Parameters, State
from model.arrays import Array, Complex
from model.parameters import check_names, check_number

FIRST_STEP, LEAST_STEP, LONGEST_STEP = 0.2, 1e-5, 0.5
"""Steps along the branch, in natural units: the first, the least, and the longest."""
GRAZING = 0.01
"""Longest step in which the number of landings may change: other branches, as of balls that ride
the wall, are near."""
EASY = 5
"""Steps of Newton's method up to which the next step along the branch is longer."""
SHARP = 1e-6
"""How sharply a change of stability is located along the branch; of cases by `HALVINGS`."""
HALVINGS = 10
SMALL = 0.05
"""Extent relative to the branch's largest below which the branch is extrapolated to zero."""


class Bifurcation(StrEnum):
    """What happens to a branch of orbits at a place."""

    FOLD = "fold"
    """It turns back."""
    DOUBLING = "period doubling"
    """A multiplier passes -1."""
    TORUS = "torus"
    """A pair of multipliers passes the unit circle (Neimark and Sacker)."""
    GRAZING = "grazing"
    """The number of landings in a period changes."""
    PERSISTENCE = "persistence"
    """The sequence of cases changes without a landing more or less, and the orbit goes on."""
    HOPF = "Hopf"
    """It shrinks to a stationary motion within one case."""
    BIRTH = "nonsmooth birth"
    """It shrinks to a stationary motion where cases meet: linearly, not like a root."""
    LOST = "lost"
    """It isn't followed any further, for a reason that is given."""
    RANGE = "end of the range"


@dataclass(frozen=True)
class Place:
    """Where something happens to a branch of orbits: a bifurcation, or its end."""

    kind: Bifurcation
    value: float
    """The parameter there, SI."""
    orbit: Orbit
    """The orbit there, or nearest to it."""
    reason: str = ""
    """Why the branch is lost."""

    def __str__(self) -> str:
        return f"{self.kind} at {self.value:.6g}" + (f" ({self.reason})" if self.reason else "")


@dataclass(frozen=True)
class OrbitBranch:
    """Orbits along a branch, from one end to the other."""

    name: str
    """The parameter that varies, or `RESTITUTION`."""
    orbits: tuple[Orbit, ...]
    places: tuple[Place, ...]
    """Where something happens, in order; the first and the last are its ends."""

    @property
    def values(self) -> Array:
        """The parameter at the orbits, SI, shape (n,)."""
        return np.array([orbit.loop.value(self.name) for orbit in self.orbits])

    @property
    def stable(self) -> npt.NDArray[np.bool_]:
        """Whether each orbit is stable, shape (n,)."""
        return np.array([orbit.stable for orbit in self.orbits], dtype=bool)


def follow(start: Orbit, name: str, low: float, high: float, most: int = 100) -> OrbitBranch:
    """Follow an orbit both ways in a parameter to [low, high], its end, or `most` orbits each way.

    Raises `InputError` if there is no such parameter, or the orbit isn't within the range."""
    names = [*(field.name for field in Parameters.quantities()), periodic.RESTITUTION]
    check_names([name], names, "parameter")
    low = check_number(f"lowest {name}", low, "SI")
    high = check_number(f"highest {name}", high, "SI")
    if not low <= (value := start.loop.value(name)) <= high or value == 0:
        raise InputError(
            f"{name} = {value:g} of the orbit is out of range: must be within {low:g} … {high:g}, "
            f"not 0"
        )
    down, up = ([*_one_way(start, name, (low, high), sign, most)] for sign in (-1.0, 1.0))
    every: list[Orbit | Place] = [*down[::-1], start, *up]
    return OrbitBranch(
        name,
        tuple(each for each in every if isinstance(each, Orbit)),
        tuple(each for each in every if isinstance(each, Place)),
    )


def _one_way(
    start: Orbit, name: str, span: tuple[float, float], sign: float, most: int
) -> Iterator[Orbit | Place]:
    """Orbits and places along the branch towards larger (sign 1) or smaller values, to its end."""
    here, step, before = start, FIRST_STEP, [start]
    along = np.append(np.zeros(len(start.loop.free)), sign)
    try:
        for _ in range(most):
            matrix = periodic.defect_jacobian(here.loop, here.derivative, name)
            tangent = np.linalg.svd(matrix)[2][-1]
            along = tangent if tangent @ along >= 0 else -tangent
            there = None
            while there is None:
                try:
                    there = _next_orbit(here, step * along, name, matrix)
                except NoOrbitError:
                    step /= 2
                    if step <= LEAST_STEP:
                        raise
            met = _places_between(here, there, step * along, name, matrix)
            yield from (place for place in met if span[0] <= place.value <= span[1])
            if not span[0] <= there.loop.value(name) <= span[1]:
                orbit = _at_end_of_range(here, there, name, span)
                yield from (orbit, Place(Bifurcation.RANGE, orbit.loop.value(name), orbit))
                return
            yield there
            step = min(LONGEST_STEP, 1.5 * step if there.steps <= EASY else 0.7 * step)
            # The same orbit through a section anew: on the floor orbits may shrink away from one.
            if State.of(there.loop.x).y > 0:
                here = replace(there, loop=replace(there.loop, extent=periodic.extent(there.cycle)))
            else:
                here = refine(there.p, there.loop.x, there.period, there.loop.restitution)
                if (here.loop.case, here.loop.fixed) != (there.loop.case, there.loop.fixed):
                    # The section is another: the parameter alone says which way to go on.
                    along = np.append(np.zeros(len(here.loop.free)), along[-1])
            before.append(here)
            if here.loop.extent < SMALL * max(each.loop.extent for each in before):
                # The extent will be zero where a parabola through the last three orbits says.
                kind, power = (Bifurcation.BIRTH, 1) if here.changes else (Bifurcation.HOPF, 2)
                last = before[-3:]
                sizes = np.array([each.loop.extent for each in last]) ** power
                values = np.array([each.loop.value(name) for each in last])
                yield Place(kind, float(np.polyfit(sizes, values, len(last) - 1)[-1]), here)
                return
        raise NoOrbitError(f"not followed beyond {most} orbits")
    except NoOrbitError as error:
        yield Place(Bifurcation.LOST, here.loop.value(name), here, str(error))


def _at_end_of_range(inside: Orbit, outside: Orbit, name: str, span: tuple[float, float]) -> Orbit:
    """The orbit where the branch leaves the range, between one within and one outside."""
    start, end = inside.loop.value(name), outside.loop.value(name)
    value = min(max(end, span[0]), span[1])
    share = (value - start) / (end - start)
    x = inside.loop.x + share * (outside.loop.x - inside.loop.x)
    period = (1 - share) * inside.period + share * outside.period
    return periodic.closed_orbit(replace(inside.loop.with_value(name, value), x=x, period=period))


def _next_orbit(here: Orbit, by: Array, name: str, matrix: Array) -> Orbit:
    """The next orbit, a step `by` away; `NoOrbitError` also if it is of another branch."""
    orbit = periodic.closed_orbit(here.loop.moved(by, name), name, matrix)
    if _on_other_branch(here, by, orbit.changes):
        raise NoOrbitError("the nearest orbit is one of another branch")
    return orbit


def _places_between(
    here: Orbit, there: Orbit, step: Array, name: str, matrix: Array
) -> Iterator[Place]:
    """Bifurcations between an orbit and the next one on the branch, each located."""
    first, last = here.multipliers, there.multipliers
    crosses = np.sum(np.abs(first) > 1) != np.sum(np.abs(last) > 1)
    for kind, sign in _TESTS.items():
        if not crosses or (sign(first) > 0) == (sign(last) > 0):
            continue

        def sign_at(share: float, sign: Callable[[Any], float] = sign) -> float:
            return sign(_next_orbit(here, share * step, name, matrix).multipliers)

        try:
            share = brentq(sign_at, 0.0, 1.0, xtol=SHARP, rtol=SHARP)
            orbit = _next_orbit(here, share * step, name, matrix)
        except (NoOrbitError, ValueError):
            orbit = there  # where the sequence of cases changes, too, the test may jump
        yield Place(kind, orbit.loop.value(name), orbit)
    before = _rotated_to_least(here.changes)
    if before == _rotated_to_least(there.changes):
        return
    # Where the sequence of cases changes, by halving as far as orbits are found.
    low, high, loop = 0.0, 1.0, there.loop
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        try:
            found, back, _ = periodic.close_loop(here.loop.moved(middle * step, name), name, matrix)
        except NoOrbitError:
            break
        if _on_other_branch(here, middle * step, back.changes):
            break
        loop = found
        low, high = (middle, high) if _rotated_to_least(back.changes) == before else (low, middle)
    try:
        nearest = periodic.closed_orbit(loop)
    except NoOrbitError:  # disturbances there land where others don't
        nearest = there
    same = sum(landings(here.changes)) == sum(landings(there.changes))
    kind = Bifurcation.PERSISTENCE if same else Bifurcation.GRAZING
    yield Place(kind, loop.value(name), nearest)


def _rotated_to_least(changes: Changes) -> Changes:
    """The changes of case of a period in a form that doesn't depend on where the period begins."""
    turns = [changes[k:] + changes[:k] for k in range(len(changes))]
    return min(turns, default=())


def _on_other_branch(here: Orbit, by: Array, changes: Changes) -> bool:
    """Whether a long step led to another number of landings, so to another branch."""
    if np.linalg.norm(by) <= GRAZING:
        return False
    return bool(sum(landings(changes)) != sum(landings(here.changes)))


_TESTS: dict[Bifurcation, Callable[[Complex], float]] = {
    Bifurcation.FOLD: lambda m: -float(np.prod(1 - m[np.isreal(m)].real)),
    Bifurcation.DOUBLING: lambda m: -float(np.prod(1 + m[np.isreal(m)].real)),
    Bifurcation.TORUS: lambda m: float(np.abs(m[np.imag(m) != 0]).max(initial=0.0)) - 1,
}
"""Positive if an odd number of multipliers is real and beyond 1 (-1), or a pair off the circle."""
