"""The law of MuJoCo's contacts in any settled model: depth, creep, hovering, small motions.

Formulas and their derivation: docs/forecast.md. The engine says where contacts are, what they
carry, and how it estimates their inverse mass; the rest is computed from parameters, so that it can
be computed for other ones, too."""

from __future__ import annotations

import copy
import dataclasses
import math
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import mujoco
import numpy as np
import numpy.typing as npt
import scipy.linalg
import scipy.sparse

Array = npt.NDArray[Any]  # of floats, or of marks and numbers that choose contacts
LARGEST, CONE = 1.0, 0.999
"""Steps are tried up to this, s; from this share of the cone on a contact slides."""
IDLE = 0.01  # friction that uses no more than this share of Coulomb's cone is given no direction
FAINT = 1e-3
"""A load that could speed up the lighter body by less than this share of g counts as none."""
SOLREF = (0.02, 1.0)
"""What the engine takes for a solref of which one number is positive and the other is not."""


@dataclass(frozen=True, kw_only=True)
class SoftContacts:
    """The n contacts of a settled model: options, their parameters, and their loads."""

    timestep: float
    impratio: float
    pyramidal: bool
    integrator: int
    noslip: bool
    refsafe: bool
    solref: Array  # shape (n, 2); also that of `solreffriction`, in which zeros mean: as `solref`
    solreffriction: Array
    solimp: Array  # shape (n, 5)
    geoms: Array
    dim: Array
    friction: Array  # shape (n, 5): two of slipping, spinning, two of rolling; m for the last three
    inverse_mass: Array  # what a normal row sees by the engine's estimate, 1/kg
    margin: Array
    force: Array  # shape (n, 6): along the normal and the directions of `friction`, N and N m
    slip: Array  # shape (n, 5): as found, m/s and rad/s
    rows: Array
    """Jacobian, shape (n, 6, nv), in units in which the mass matrix is one; zeros beyond `dim`."""

    @property
    def discrete(self) -> bool:
        """Whether the integrator takes springs and dampers at the end of a step."""
        return bool(self.integrator == mujoco.mjtIntegrator.mjINT_DISCRETE)

    @property
    @np.errstate(invalid="ignore")  # a contact that bears nothing
    def cone(self) -> Array:
        """Share of the friction cone, or pyramid, in use."""
        used = self._scaled_friction
        share: Array = used.sum(1) if self.pyramidal else np.hypot.reduce(used, 1)
        return share / self.force[:, 0]

    def lacking(self, slides: Array) -> float:
        """Share of Coulomb's friction that the pyramid lacks in all contacts; `slides` says which
        slip. Nan for an elliptic cone, and where next to no friction acts.

        With u_i = f_i/mu_i Coulomb's law holds up to |u| = N, the pyramid up to sum |u_i| = N.
        Against a slip v Coulomb's force has u_i ~ mu_i v_i."""
        load, u = self.force[:, 0], self._scaled_friction
        if not self.pyramidal or np.hypot.reduce(u, 1).sum() <= IDLE * load.sum():
            return math.nan
        against = self.friction * np.abs(self.slip) * self._frictional
        u = np.where(slides[:, None], against * (load / against.sum(1))[:, None], u)
        return float(1 - np.hypot.reduce(u, 1).sum() / u.sum())

    @property
    def _frictional(self) -> Array:
        """Whether a contact has each of the five frictions, (n, 5)."""
        return np.arange(1, 6) < self.dim[:, None]

    @property
    def parts(self) -> bool:
        """Whether any joint can move a body along a contact normal, so that they may part."""
        return bool((abs(self.rows[:, 0]) > 1e-9 * abs(self.rows).max(initial=1e-300)).any())

    @property
    def regularisation(self) -> Array:
        """R d/(1 - d) of rows or edges, 1/kg, with their impedance d."""
        if not self.pyramidal:
            return self.inverse_mass
        mu2 = self.friction[:, 0] ** 2
        edges = np.where(self.dim > 1, 2 * mu2 * (1 + mu2) / self.impratio, 1)
        return np.asarray(self.inverse_mass * edges)

    @np.errstate(all="ignore")  # what is not chosen divides by zero
    def reference(self, solref: Array) -> tuple[Array, Array]:
        """Stiffness for an impedance of one, s-2, and damping, s-1, of rows."""
        high = np.clip(self.solimp[:, 1], mujoco.mjMINIMP, mujoco.mjMAXIMP)
        time, ratio = np.where(((solref > 0).sum(1) == 1)[:, None], SOLREF, solref).T
        if self.refsafe and self.discrete:
            least = self.timestep / (np.sqrt(high) * ratio)
            shortest = np.where(time * ratio < self.timestep, least, time)
            time = np.where(time > 0, shortest, time)
        elif self.refsafe:
            time = np.where(time > 0, np.maximum(time, 2 * self.timestep), time)
        positive = time > 0
        stiffness = np.where(positive, 1 / (high * time * ratio) ** 2, -time / high**2)
        return stiffness, np.where(positive, 2 / (high * time), -ratio / high)

    @cached_property
    def _springs(self) -> tuple[Array, Array, Array]:
        """Stiffness for an impedance of one, s-2, damping of normal rows and of friction, s-1."""
        spring, b = self.reference(self.solref)
        own = self.solreffriction.any(1) & (not self.pyramidal)
        return spring, b, np.where(own, self.reference(self.solreffriction)[1], b)

    @cached_property
    def _scaled_friction(self) -> Array:
        """Friction divided by its coefficient, (n, 5), N or N m."""
        return np.where(self._frictional, np.abs(self.force[:, 1:]) / self.friction, 0)

    def _rows(self, depth: Array) -> tuple[Array, Array, Array]:
        """R of a row, its stiffness, and the damping of friction in steady motion."""
        (spring, b, b_f), h = self._springs, self.timestep
        low, high, middle = np.clip(self.solimp[:, [0, 1, 3]], mujoco.mjMINIMP, mujoco.mjMAXIMP).T
        width, power = np.maximum(self.solimp[:, 2], 1e-15), np.maximum(self.solimp[:, 4], 1)
        x = np.minimum(depth / width, 1)
        rising = x**power / middle ** (power - 1)
        falling = (1 - x) ** power / (1 - middle) ** (power - 1)
        d = low + (high - low) * np.where(x <= middle, rising, 1 - falling)  # the impedance
        R, k = (1 - d) / d * self.regularisation, spring * d
        if not self.discrete:
            return R, k, b_f
        if self.pyramidal:
            return R, k, b + k * h
        return R, k, b_f * (1 + b * h + k * h**2) / (1 + b_f * h)

    def _depth(self, slides: Array) -> Array:
        """Depth below the margin at which contacts bear their loads, by bisection, m."""
        load = self.force[:, 0]
        low, kept = np.zeros(len(load)), self.friction[:, 0] ** 2 / self.impratio * load
        R, k, _ = self._rows(low)
        high = 1.01 * R * load / k
        for _ in range(100):
            middle = (low + high) / 2
            R, k, damping = self._rows(middle)
            x, damped = k * middle / R, damping[:, None] * self.friction * np.abs(self.slip)
            sliding = damped / R[:, None] * self._frictional
            if self.pyramidal:
                edge = np.where(slides[:, None], x[:, None] + sliding, self._scaled_friction)
                edges = (np.maximum(2 * x[:, None], edge) * self._frictional).sum(1)
                borne = np.where(self.dim > 1, edges, x)
            else:
                borne = x + np.where(slides, np.maximum(np.hypot.reduce(sliding, 1) - kept, 0), 0)
            low, high = np.where(borne > load, low, middle), np.where(borne > load, middle, high)
        return np.asarray((low + high) / 2)

    @np.errstate(all="ignore")  # a contact without stiffness or friction divides by zero
    def law(self) -> ContactResponse:
        """What the contacts do under their loads."""
        load = self.force[:, 0]
        mu, frictional, slides = self.friction, self._frictional, self.cone >= CONE
        _, b, b_f = self._springs
        depth = self._depth(slides)
        R, k, damping = self._rows(depth)
        first, _, first_damping = self._rows(np.zeros(len(load)))
        if self.pyramidal:
            x, wanted = (k * depth / R)[:, None], self._scaled_friction
            pushed = np.where(wanted <= 2 * x, wanted / 2, wanted - x)
            creep = R[:, None] * pushed / (mu * damping[:, None])
            hover = first * load / (first_damping * np.hypot(mu[:, 0], mu[:, 1]))
            sideways = 2 * mu**2 / R[:, None]
        else:
            soft = R[:, None] / self.impratio * (mu[:, :1] / mu) ** 2
            creep = soft * np.abs(self.force[:, 1:]) / damping[:, None]
            apart = (1 + mu[:, 0] ** 2 / self.impratio) * first * load
            hover = apart / (mu[:, :2].max(1) * first_damping)
            sideways = 1 / soft
        shift = 1e-6 * depth
        low, high = depth - shift, depth + shift
        (softer, k_less, _), (harder, k_more, _) = self._rows(low), self._rows(high)
        slope = R * (k_more * high / harder - k_less * low / softer) / (2 * shift)
        # it corrects friction alone, after normal forces were found beside friction at no creep
        if self.noslip:
            creep, sticks = np.zeros_like(creep), frictional & ~slides[:, None]
            along, soft = self.rows[:, 1:][sticks], 1 / sideways[sticks]
            seen, asked = along @ along.T + np.diag(soft), soft * self.force[:, 1:][sticks]
            lacking = np.linalg.solve(seen, asked)
            depth = depth - self.rows[:, 0] @ (along.T @ lacking) / k
        creep = np.where(frictional, creep, 0)
        # one row, or all edges of a pyramid
        criterion = np.where((self.dim > 1) & self.pyramidal, 2 * self.dim - 2, 1)
        sideways = np.where(frictional & ~slides[:, None], sideways, 0)
        return ContactResponse(
            depth=depth - self.margin,
            creep=np.where(slides | (self.dim == 1), np.nan, np.hypot(creep[:, 0], creep[:, 1])),
            turning=np.where(slides | (self.dim <= 3), np.nan, np.hypot.reduce(creep[:, 2:], 1)),
            hover=np.where(self.dim > 1, hover, np.inf),
            slides=slides,
            weight=np.column_stack([criterion / R, sideways]),
            stiffness=slope,
            damping=np.column_stack([b, *[b_f] * 5]),
        )

    def subset(self, which: Array) -> SoftContacts:
        """The contacts `which` alone, with their Jacobian in the coordinates that they move."""
        n = len(self.dim)
        chosen = {
            f.name: v[which]
            for f in dataclasses.fields(self)
            if np.ndim(v := getattr(self, f.name)) and len(v) == n
        }
        flat = chosen["rows"].reshape(6 * len(chosen["dim"]), self.rows.shape[2])
        _, sizes, directions = np.linalg.svd(flat, full_matrices=False)
        chosen["rows"] = chosen["rows"] @ directions[sizes > 1e-9 * sizes.max(initial=0)].T
        return dataclasses.replace(self, **chosen)

    @classmethod
    def joined(cls, parts: Sequence[SoftContacts]) -> SoftContacts:
        """Contacts of several moments as if they were of one."""
        arrays = [f.name for f in dataclasses.fields(cls) if np.ndim(getattr(parts[0], f.name))]
        values: dict[str, Any]
        values = {name: np.concatenate([getattr(each, name) for each in parts]) for name in arrays}
        return dataclasses.replace(parts[0], **values)

    def matrices(self) -> tuple[Array, Array, Array]:
        """Mass, damping and stiffness (n, n) of small motions: m a + d v + k x = 0."""
        law, flat = self.law(), self.rows.reshape(6 * len(self.dim), self.rows.shape[2])
        weight = law.weight * (np.arange(6) < self.dim[:, None])
        values = weight, weight * law.damping, weight * law.stiffness[:, None] * (np.arange(6) == 0)
        mass, damping, stiffness = ((flat.T * np.nan_to_num(v).ravel()) @ flat for v in values)
        return np.eye(len(mass)) + mass, damping, stiffness

    def stable(self, timestep: float) -> bool:
        """Whether small motions die out: the first that doesn't changes sign every step."""
        if self.discrete:
            return True
        mass, damping, stiffness = dataclasses.replace(self, timestep=timestep).matrices()
        damping, stiffness = timestep * damping, timestep**2 * stiffness
        forms = [4 * mass - 2 * damping - stiffness]
        # its region ends at -2.785 and 2.83 i
        if self.integrator == mujoco.mjtIntegrator.mjINT_RK4:
            forms = [2.785**2 * mass - 2.785 * damping + stiffness, 8 * mass - stiffness]
        return all((np.linalg.eigvalsh(form) > 0).all() for form in forms)

    def largest_step(self, below: float = LARGEST) -> float:
        """Largest stable time step, s, to 1 %; inf if there is none up to `below`."""
        if self.stable(below):
            return math.inf
        low, high = math.log(1e-6), math.log(below)
        while high - low > 0.01:
            middle = (low + high) / 2
            low, high = (middle, high) if self.stable(math.exp(middle)) else (low, middle)
        return math.exp(low)


@dataclass(frozen=True)
class ContactResponse:
    """What n contacts do under their loads, nan where one slides or lacks that friction."""

    depth: Array
    creep: Array
    turning: Array
    hover: Array
    slides: Array
    weight: Array  # force per acceleration of each row, kg
    stiffness: Array  # of small motions: impedance grows with depth
    damping: Array


@dataclass(frozen=True)
class Moment:
    """A state, and those contacts of it that are looked at."""

    data: Any
    number: Array  # of each, by which `data` has them


def contacts(
    model: Any, data: Any, pairs: Collection[tuple[int, int]]
) -> tuple[SoftContacts, Moment]:
    """The contacts of these pairs of geoms that carry more than a faint load at a state."""
    # in it each row is a direction of a contact, whatever the cone and the integrator
    twin = copy.copy(model)
    twin.opt.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    twin.opt.integrator = mujoco.mjtIntegrator.mjINT_EULER
    twin.opt.jacobian = mujoco.mjtJacobian.mjJAC_SPARSE
    state = mujoco.MjData(twin)
    mujoco.mj_copyData(state, twin, data)
    mujoco.mj_forward(twin, state)
    mujoco.mj_forward(model, data)
    found, mass = data.contact, np.zeros((model.nv, model.nv))
    there = (state.contact.efc_address >= 0) & (found.exclude == 0)
    among = np.array([pair in pairs for pair in map(tuple, found.geom.tolist())], bool)
    number = np.flatnonzero(there & among)
    force = np.zeros((len(number), 6))
    for k, each in enumerate(number):
        mujoco.mj_contactForce(model, data, each, force[k])
    # of each body with all that is welded to it, N; inf if no joint moves it, 0 without gravity
    welded = np.bincount(model.body_weldid, model.body_mass, model.nbody)[model.body_weldid]
    weightless = model.opt.disableflags & mujoco.mjtDisableBit.mjDSBL_GRAVITY
    g = 0.0 if weightless else np.hypot.reduce(model.opt.gravity)
    weights = np.where(model.body_dofnum[model.body_weldid] > 0, g * welded, np.inf if g else 0)
    bears = force[:, 0] > FAINT * weights[model.geom_bodyid[found.geom[number]]].min(1)
    number, force = number[bears], force[bears]
    first, dim = state.contact.efc_address[number], found.dim[number]
    row = np.minimum(first[:, None] + np.arange(6), max(state.nefc - 1, 0))
    there = np.arange(6) < dim[:, None]
    rows = np.zeros((len(number), 6, model.nv))
    if len(number):
        mujoco.mj_fullM(model, data, mass)
        sparse = state.efc_J, state.efc_J_colind, np.append(state.efc_J_rowadr, state.nJ)
        jacobian = scipy.sparse.csr_array(sparse, (state.nefc, model.nv)).toarray()
        whitened = scipy.linalg.solve_triangular(np.linalg.cholesky(mass), jacobian.T, lower=True).T
        rows = whitened[row] * there[..., None]
    moment = Moment(data, number)
    described = SoftContacts(
        inverse_mass=state.efc_diagA[first],
        margin=state.efc_margin[first],
        force=force,
        slip=np.where(there, state.efc_vel[row] if state.nefc else 0, 0)[:, 1:],
        rows=rows,
        geoms=found.geom[number],
        dim=dim,
        **parameters(model, [moment]),
    )
    return described, moment


def parameters(model: Any, moments: Sequence[Moment]) -> dict[str, Any]:
    """What options of a model decide for these contacts, by the names in `SoftContacts`."""
    option, own = model.opt, ("solref", "solreffriction", "solimp", "friction")
    values = {
        name: np.concatenate([getattr(each.data.contact, name)[each.number] for each in moments])
        for name in own
    }
    return values | {
        "timestep": option.timestep,
        "impratio": option.impratio,
        "pyramidal": option.cone == mujoco.mjtCone.mjCONE_PYRAMIDAL,
        "integrator": option.integrator,
        "noslip": option.noslip_iterations > 0,
        "refsafe": not option.disableflags & mujoco.mjtDisableBit.mjDSBL_REFSAFE,
    }


def replacements(model: Any, c: SoftContacts, names: Sequence[str]) -> Iterator[tuple[str, str]]:
    """Parameters of a pair in whose place the engine takes others: the kind, and how."""
    asked, imp, limits = c.solref[0], c.solimp[0], (mujoco.mjMINIMP, mujoco.mjMAXIMP)
    if (asked > 0).sum() == 1:
        how = f"{asked[0]:g} {asked[1]:g}: {SOLREF[0]:g} {SOLREF[1]:g} is taken"
        yield "solref of neither format", how
    for name in ("solref", "solreffriction"):
        ref = getattr(c, name)
        if (ref[0] > 0).all():
            taken = 2 / (c.reference(ref)[1][0] * np.clip(imp[1], *limits))
            if taken > 1.000001 * ref[0, 0]:
                how = f"{ref[0, 0]:g} s: {taken:.3g} s is taken (refsafe)"
                yield f"{name} too short for the time step", how
    if c.solreffriction.any() and c.pyramidal:
        yield "solreffriction", "the pyramidal cone ignores it"
    if (clipped := np.clip(imp[:2], *limits) != imp[:2]).any():
        how = f"{imp[:2][clipped][0]:g}: the limit is taken, {limits[0]:g} or {limits[1]:g}"
        yield "impedance out of range", how
    pairs = np.sort(np.column_stack([model.pair_geom1, model.pair_geom2]))
    if (np.sort(c.geoms[0]) == pairs).all(1).any():
        return  # parameters of the geoms count for nothing
    for name, mixed in (("solref", asked), ("solimp", imp), ("friction", c.friction[0, [0, 2, 3]])):
        own = getattr(model, f"geom_{name}")[c.geoms[0]]
        if not np.allclose(own[0], own[1]):
            first, second, taken = (" ".join(f"{v:g}" for v in each) for each in (*own, mixed))
            one, other = (names[geom] for geom in c.geoms[0])
            how = f"{first} ({one}) and {second} ({other}): {taken} is taken"
            yield f"{name} of two geoms", how


def geom_names(model: Any) -> list[str]:
    """The names of all geoms; one without a name has that of its body, and its number."""
    bodies = (model.body(body).name for body in model.geom_bodyid)
    return [model.geom(g).name or f"{body}#{g}" for g, body in enumerate(bodies)]
