"""What to change in a settled model: the one option that helps its contacts, and the law that holds where none does."""

from __future__ import annotations

import copy
import dataclasses
import itertools
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np

from compare.bench.contact_law import Array, Contacts, parameters
from mjsim import Coulomb

CHECKS = 3
"""Of the changes that help, so many are tried, after which there is no advice."""
LINES = 8
"""Geoms in what is to be pasted."""
FAULTS = {
    "creep": ("creep", 1e6, "µm/s"),
    "depth": ("depth", 1e6, "µm"),
    "largest_step": ("largest step", 1e3, "ms"),
}
"""What may be wrong with a pair, in words, its unit, and the factor from SI to it."""


@dataclass(frozen=True)
class Change:
    """The one option to change, and what that does to the worst pair."""

    option: str
    value: tuple[float, ...]
    pair: str
    quantity: str
    before: float
    after: float
    """Predicted."""
    geoms: tuple[str, ...]
    """Of those that touch, the ones to be changed."""
    found: float = math.nan
    """Measured, if it was tried."""

    @property
    def written(self) -> str:
        """As in MJCF."""
        return f'{self.option}="{"elliptic" if self.option == "cone" else " ".join(f"{v:g}" for v in self.value)}"'

    @property
    def mjcf(self) -> str:
        """What to paste: an element for the model, or one for each geom."""
        if self.option not in ("solref", "solimp"):
            return f"<option {self.written}/>"
        more = len(self.geoms) - LINES
        lines = [f"<geom {self.written}/> <!-- {name} -->" for name in self.geoms[:LINES]]
        return "\n".join([*lines, *([f"<!-- and {more} more geoms -->"] if more > 0 else [])])


def python(model: Any) -> str:
    """What to write for a model whose contacts no option holds."""
    integrator = mujoco.mjtIntegrator
    two_halves = model.opt.integrator not in (integrator.mjINT_RK4, integrator.mjINT_DISCRETE)
    other = "" if two_halves else "model.opt.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST\n"
    return f"{other}coulomb = mjsim.Coulomb(model)\ncoulomb.step(data)  # in the place of mujoco.mj_step(model, data)"


def remedied(model: Any, data: Any) -> tuple[Any, Any, Callable[[Any, Any, int], None]]:
    """A copy of a model and its data, and how to step them with the remedy."""
    twin = copy.copy(model)
    if "integrator" in python(model):
        twin.opt.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    twin.opt.enableflags &= ~int(mujoco.mjtEnableBit.mjENBL_SLEEP)
    state = mujoco.MjData(twin)
    mujoco.mj_copyData(state, twin, data)
    remedy = Coulomb(twin)
    return twin, state, lambda _, own, nstep: remedy.step(own, nstep)


def apply(model: Any, option: str, value: Sequence[float]) -> None:
    """Change one option of a model; those of contacts for all geoms and pairs that are softer."""
    if option in ("impratio", "cone", "timestep"):
        setattr(model.opt, option, value[0])
    for own in (getattr(model, f"{kind}_{option}") for kind in ("geom", "pair") if option in ("solref", "solimp")):
        if option == "solimp":
            own[:, :2] = np.maximum(own[:, :2], value)
        else:
            own[own[:, 0] > value[0] if value[0] > 0 else own[:, 0] < 0] = value


def change(
    model: Any,
    data: Any,
    c: Contacts,
    number: Array,
    harm: Callable[[Contacts], dict[str, Array]],
    worst: tuple[str, Array, Mapping[str, float]],
    names: Sequence[str],
    calm: Callable[[Any], bool],
) -> tuple[Change | None, dict[str, Array]]:
    """The first option, in its mildest value, that makes all contacts good, or else the one that helps most.

    Also the harm that is left then. `worst` is the pair that is worst, which contacts are its own, and how many times
    of each fault it has; `names` are those of geoms; `calm` says whether a changed model settles as well.
    """
    (pair, part, faults), tried = worst, []
    what = max(faults, key=lambda name: faults[name])
    for option, value in _options(c.only(part)) if faults[what] > 1 else ():
        other, state = copy.copy(model), copy.copy(data)
        apply(other, option, value)
        mujoco.mj_fwdPosition(other, state)
        changed = dataclasses.replace(c, **parameters(other, state, number))
        harms, (now, then) = harm(changed), (_of(each, part, what) for each in (c, changed))
        left = max(float(each.max()) for each in harms.values())
        geoms = [names[g] for g in np.unique(c.geoms) if _differ(model, other, g)]
        tried.append((left, harms, Change(option, value, pair, what, now, then, tuple(geoms)), other))
    cures = [each for each in tried if each[0] <= 1]
    helps = [each for each in tried if 1 < each[0] < faults[what] / 1.4]
    helps.sort(key=lambda each: (each[0], max(1, float(each[1][what].max()))))
    for _, harms, best, other in [*cures, *helps][:CHECKS]:
        if calm(other):
            return best, harms
    return None, harm(c)


def _options(c: Contacts) -> Iterator[tuple[str, tuple[float, ...]]]:
    """Options that may help the contacts of a pair, and their values, the mildest first."""
    largest = 10 if c.pyramidal else 1e4  # edges that are harder still push the pair apart
    for power, digit in itertools.product((10, 100, 1e3, 1e4), (1, 2, 5)):
        if c.impratio < power * digit <= largest:
            yield "impratio", (power * digit,)
    if c.pyramidal:
        yield "cone", (int(mujoco.mjtCone.mjCONE_ELLIPTIC),)
    time, ratio = c.solref[0]
    if time < 0 and ratio == 0:
        yield "solref", (time, -_rounded(2 * math.sqrt(-time)))  # critical
    for share in (0.7, 0.5, 0.35, 0.25, 0.2, 0.15, 0.1):
        if time > 0 and share * time >= 2 * c.timestep:
            yield "solref", (_rounded(share * time), ratio)
        elif time < 0:
            yield "solref", (_rounded(time / share**2), _rounded(ratio / share))
    for impedance in (0.95, 0.98, 0.99, 0.995, 0.998, 0.999):
        if c.solimp[0, 0] < impedance:
            yield "solimp", (impedance, max(impedance, c.solimp[0, 1]))
    for share in (0.7, 0.5, 0.35, 0.2, 0.1):
        yield "timestep", (_rounded(share * c.timestep),)


def _rounded(value: float) -> float:
    return float(f"{value:.2g}")


def _differ(model: Any, other: Any, geom: int) -> bool:
    """Whether a geom's contacts are soft in another way in two models."""
    return any(
        (getattr(model, name)[geom] != getattr(other, name)[geom]).any() for name in ("geom_solref", "geom_solimp")
    )


def _of(c: Contacts, part: Array, quantity: str) -> float:
    """Creep, depth, or largest step of some contacts."""
    return c.only(part).largest_step() if quantity == "largest_step" else float(getattr(c.law(), quantity)[part].max())
