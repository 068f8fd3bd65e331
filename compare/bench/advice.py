"""What to change in a settled model: the option that helps, and the law where none does."""

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

from compare.bench.contact_law import Array, Moment, SoftContacts, geom_names, parameters
from compare.bench.settled import Rest, Tell
from mjsim import Coulomb
from model.errors import few

UNNAMED = {"solref": (0.02, 1.0), "solimp": (0.9, 0.95)}
"""MuJoCo's own values, which a geom has that says nothing of its own."""
CHECKS = 3  # of the changes that help, so many are tried, after which there is no advice
MENTIONED = 8  # most geoms that are named in what is to be pasted
FAULTS = {
    "creep": ("creep", 1e6, "µm/s"),
    "depth": ("depth", 1e6, "µm"),
    "largest_step": ("largest step", 1e3, "ms"),
}
"""What may be wrong with a pair, in words, its unit, and the factor from SI to it."""


@dataclass(frozen=True)
class Change:
    """The one option of a model to change, and what that does to the worst pair of geoms."""

    option: str
    value: tuple[float, ...]
    pair: str
    quantity: str
    before: float
    after: float  # predicted
    own: tuple[str, ...] = ()
    """Geoms to be changed that have a value of their own, which no default reaches."""
    found: float = math.nan  # measured, if it was tried

    @property
    def written(self) -> str:
        """The option and its value as an attribute in MJCF."""
        numbers = " ".join(f"{v:g}" for v in self.value)
        return f'{self.option}="{"elliptic" if self.option == "cone" else numbers}"'

    @property
    def mjcf(self) -> str:
        """What to paste: elements for within ``<mujoco>``."""
        if self.option not in UNNAMED:
            return f"<option {self.written}/>"
        default = f"<default><geom {self.written}/><pair {self.written}/></default>"
        if not self.own:
            return default
        names = few(self.own, MENTIONED).replace("--", "- -")
        return f"{default}\n<!-- and where it is set now, at {names} -->"


def remedy_code(model: Any) -> str:
    """Lines of Python that hold contacts which no option holds, and step `data`."""
    lines = []
    if model.opt.integrator == mujoco.mjtIntegrator.mjINT_DISCRETE:
        lines.append("model.opt.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST")
    if model.opt.noslip_iterations:
        lines.append("model.opt.noslip_iterations = 0")
    lines.append("coulomb = mjsim.Coulomb(model)")
    lines.append("coulomb.step(data)  # in the place of mujoco.mj_step(model, data)")
    return "\n".join(lines)


def remedied(model: Any, data: Any) -> tuple[Any, Any, Callable[[Any, Any, int], None]]:
    """A copy of a model and its data, and a function that steps them as `remedy_code` does."""
    twin = copy.copy(model)
    if twin.opt.integrator == mujoco.mjtIntegrator.mjINT_DISCRETE:
        twin.opt.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    twin.opt.noslip_iterations = 0
    twin.opt.enableflags &= ~int(mujoco.mjtEnableBit.mjENBL_SLEEP)
    state = mujoco.MjData(twin)
    mujoco.mj_copyData(state, twin, data)
    remedy = Coulomb(twin)
    return twin, state, lambda _, own, nstep: remedy.step(own, nstep)


def apply(model: Any, option: str, value: Sequence[float]) -> None:
    """Set one option of a model; solref and solimp only of what is softer than the value."""
    if option in ("impratio", "cone", "timestep"):
        setattr(model.opt, option, value[0])
    kinds = ("geom", "pair") if option in ("solref", "solimp") else ()
    for own in (getattr(model, f"{kind}_{option}") for kind in kinds):
        if option == "solimp":
            own[:, :2] = np.maximum(own[:, :2], value)
        else:
            own[own[:, 0] > value[0] if value[0] > 0 else own[:, 0] < 0] = value


@dataclass(frozen=True)
class AtRest:
    """A settled model, its contacts, and what was measured of them."""

    model: Any
    data: Any
    settled: Rest
    contacts: SoftContacts
    moments: Sequence[Moment]  # of the contacts, in their order
    radius: Array  # of the smaller body of each, m
    moves: Array
    found: Mapping[str, Array]
    flexible: int  # contacts of flexible bodies, which are left out
    creep: float  # what passes for good, m/s
    depth: Array | float  # what passes for good, of each, m

    @np.errstate(over="ignore")
    def harm(self, c: SoftContacts) -> dict[str, Array]:
        """How bad each contact is, (n,), by each of `FAULTS`: 1 passes for good."""
        law = c.law()
        speed = np.nan_to_num(np.fmax(law.creep, law.turning * self.radius))
        pair = np.unique(c.geoms, axis=0, return_inverse=True)[1].ravel()
        # as a whole, if one of its contacts does
        slides = np.isin(pair, pair[law.slides & ~self.moves])
        return {
            "creep": np.where(self.moves | slides, 0, speed / self.creep),
            "depth": np.where(self.moves, 0, law.depth / self.depth),
            "largest_step": np.full(len(speed), 0.0 if c.stable(c.timestep) else 2.0),
        }


def best_change(
    scene: AtRest,
    pair: str,
    members: Sequence[int],
    harm: Mapping[str, float],
    calm: Callable[[Any], bool],
    tell: Tell,
) -> tuple[Change | None, dict[str, Array]]:
    """The first option, in its mildest value, that makes all contacts good, or helps most.

    Also the harm that is left then. `pair` is the worst one, `members` are its contacts, `harm` is
    its own; `calm` says whether a changed model settles as well."""
    c, what, tried = scene.contacts, max(harm, key=lambda fault: harm[fault]), []
    part = np.isin(np.arange(len(scene.radius)), members)
    now = _worst(c, part, what)
    options = list(_options(c.subset(part))) if harm[what] > 1 else []
    for k, (option, value) in enumerate(options):
        tell(k / len(options))
        other = copy.copy(scene.model)
        apply(other, option, value)
        states = [Moment(copy.copy(each.data), each.number) for each in scene.moments]
        for each in states:
            mujoco.mj_fwdPosition(other, each.data)
        changed = dataclasses.replace(c, **parameters(other, states))
        harms, then = scene.harm(changed), _worst(changed, part, what)
        left = max(float(each.max()) for each in harms.values())
        own = tuple(_changed_by_name(scene.model, other, option))
        tried.append((left, harms, Change(option, value, pair, what, now, then, own), other))
    cures = [each for each in tried if each[0] <= 1]
    helps = [each for each in tried if 1 < each[0] < harm[what] / 1.4]
    helps.sort(key=lambda each: (each[0], max(1, float(each[1][what].max()))))
    for _, harms, best, other in [*cures, *helps][:CHECKS]:
        if calm(other):
            return best, harms
    return None, scene.harm(c)


def _changed_by_name(model: Any, changed: Any, option: str) -> Iterator[str]:
    """Geoms that name solref or solimp themselves, or by their class, and have it changed."""
    if option in UNNAMED:
        now, then = (getattr(each, f"geom_{option}") for each in (model, changed))
        named = (now[:, :2] != UNNAMED[option]).any(1) & (now != then).any(1)
        yield from itertools.compress(geom_names(model), named)


def _options(c: SoftContacts) -> Iterator[tuple[str, tuple[float, ...]]]:
    """Options that may help the contacts of a pair, and their values, the mildest first."""
    largest = 10 if c.pyramidal else 1e4  # edges that are harder still push the pair apart
    for power, digit in itertools.product((10, 100, 1e3, 1e4), (1, 2, 5)):
        if c.impratio < power * digit <= largest:
            yield "impratio", (power * digit,)
    if c.pyramidal:
        yield "cone", (int(mujoco.mjtCone.mjCONE_ELLIPTIC),)
    time, ratio = c.solref[0]
    if time < 0 and ratio == 0:
        yield "solref", (time, -_two_digits(2 * math.sqrt(-time)))  # critical
    for share in (0.7, 0.5, 0.35, 0.25, 0.2, 0.15, 0.1):
        if time > 0 and share * time >= 2 * c.timestep:
            yield "solref", (_two_digits(share * time), ratio)
        elif time < 0:
            yield "solref", (_two_digits(time / share**2), _two_digits(ratio / share))
    for impedance in (0.95, 0.98, 0.99, 0.995, 0.998, 0.999):
        if c.solimp[0, 0] < impedance:
            yield "solimp", (impedance, max(impedance, c.solimp[0, 1]))
    for share in (0.7, 0.5, 0.35, 0.2, 0.1):
        yield "timestep", (_two_digits(share * c.timestep),)


def _two_digits(value: float) -> float:
    return float(f"{value:.2g}")


def _worst(c: SoftContacts, part: Array, quantity: str) -> float:
    """The worst creep, m/s, or depth, m, or the largest stable step, s, of some contacts."""
    if quantity == "largest_step":
        return c.subset(part).largest_step()
    return float(getattr(c.law(), quantity)[part].max())
