"""Stationary solutions of every case: Propositions 1-6, with forces, existence and stability.

A solution of a case's equations (31) is listed whether or not its forces are admissible;
`StationarySolution.exists` says so. Stability within the case comes from the eigenvalues of the
exact Jacobian, taken by complex steps through the vector field itself. For omega_0 < 0 everything
is the mirror image of omega_0 > 0. The law of drag shifts SS and the speed at which the ball sinks
in NS; all else goes round with the fluid, whatever the law."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace
from enum import Enum

import numpy as np

from analytic.mechanics import drag, dynamics, rolling_forces
from analytic.slipping import slip_stability
from analytic.slipping.slip_stability import SlipStability
from analytic.stationary import slipping_branch
from model import Case, InputError, Parameters, State
from model.arrays import Array, Complex
from model.drag import QUADRATIC, STOKES
from model.errors import check_type

_MIRROR = State(1.0, 1.0, -1.0, -1.0, -1.0, 1.0, 1.0, 1.0)
_MIRROR_FORCE = np.array([1.0, 1.0, -1.0])
"""Signs of state and forces of the other sense of rotation."""
_LEAST_REAL_PART = 1e-9
"""Real part divided by modulus below which an eigenvalue is imaginary, as the pair of NS is."""


class Stability(Enum):
    """Stability within the case's own state space."""

    ASYMPTOTIC = "asymptotically stable"
    ALGEBRAIC = "asymptotically stable, but approached more slowly than exponentially"
    """With the fluid under the quadratic law, whose drag has no part linear in the lag."""
    NEUTRAL = "neutrally stable"
    UNSTABLE = "unstable"


@dataclass(frozen=True)
class StationarySolution:
    """One stationary solution of one case."""

    case: Case
    x: Array
    """State, shape (8,); of a family one member: y = 0, slip_y = 1 rad s-1 where it must slip,
    omega_c = omega_0."""
    force_A: Array
    """Force of the floor, N, shape (3,); in RR the member of least friction utilisation."""
    force_B: Array
    """Force of the wall, N, shape (3,)."""
    eigenvalues: Complex
    """Of the Jacobian in the active variables (in NS without y), rad s-1, rightmost first."""
    exists: bool
    """Whether the contact forces obey (12) and (13)."""
    stability: Stability
    """Within the case, by the eigenvalues."""
    slip_stability: SlipStability
    """With respect to slipping of what rolls (Definitions 1-3); STABLE if nothing rolls."""
    family: tuple[str, ...] = ()
    """Variables that are free: the solution is a member of a family."""
    alpha: float = np.nan
    """Slip direction at A, rad, in SS."""

    @property
    def state(self) -> State:
        """The state `x` by the names of its variables."""
        return State(*self.x.tolist())

    @property
    def stable(self) -> bool:
        """Whether disturbances within the case don't grow (asymptotic or neutral)."""
        return self.stability is not Stability.UNSTABLE

    @property
    def slip_stable(self) -> bool:
        """Whether no direction of slipping grows from it (Definition 1 or 3)."""
        return self.slip_stability is not SlipStability.UNSTABLE

    @property
    def moves(self) -> bool:
        """Whether the ball sinks along the wall, stationary but for y (NS, Proposition 6)."""
        return bool(self.state.v_y != 0)


def stationary_solutions(
    p: Parameters, cases: Collection[Case] = tuple(Case)
) -> list[StationarySolution]:
    """Stationary solutions at p.omega_0, or those of some cases, in the order of `Case`, |alpha|.

    Solutions with inadmissible forces are listed with ``exists`` False. For omega_0 = 0 there are
    RR, RS and NS; for c = 0 RR, SR and NR, with omega_c undetermined in RR; SS needs mu, c > 0 and
    eta < j."""
    check_type("p", p, Parameters)
    if p.omega_0 < 0:
        return [
            replace(
                s,
                x=np.multiply(_MIRROR, s.x) + 0.0,
                force_A=_MIRROR_FORCE * s.force_A + 0.0,
                force_B=_MIRROR_FORCE * s.force_B + 0.0,
                alpha=-s.alpha,
            )
            for s in stationary_solutions(p.replace(omega_0=-p.omega_0), cases)
        ]
    solvers = {Case.RR: _rr, Case.RS: _rs, Case.SR: _sr, Case.SS: _ss, Case.NR: _nr, Case.NS: _ns}
    return [s for case, solve in solvers.items() if case in map(Case, cases) for s in solve(p)]


def solution(
    p: Parameters, case: Case, *, stable: bool = True, formal: bool = False
) -> StationarySolution:
    """The stable stationary solution of a case at p.omega_0, or the unstable one.

    `formal` takes it even if its forces are inadmissible: NR below omega_02, SR with A_y < 0.

    A case may be given by its name. Raises `InputError` if there is none, or more than one (two are
    unstable between the Hopf points of a very rough floor)."""
    case = Case(case)
    listed = [s for s in stationary_solutions(p, (case,)) if formal or s.exists]
    those = [s for s in listed if s.stable == stable]
    if len(those) != 1:
        raise InputError(
            f"case {case.name} has {len(those) or 'no'} {'stable' if stable else 'unstable'} "
            f"stationary solution{'s' if those else ''} at omega_0 = {p.omega_0:g} rad s-1 "
            f"(mu = {p.mu:g}, eta = {p.eta:g}, j = {p.j:g}, c = {p.c:g} s-1, R = {p.R:g} m, "
            f"g = {p.g:g} m s-2)"
        )
    return those[0]


def stable_solutions(p: Parameters, sinking: bool = False) -> list[StationarySolution]:
    """Solutions that a disturbed ball returns to; not NS, which only sinks, unless `sinking`."""
    those = [s for s in stationary_solutions(p) if s.exists and s.stable]
    return [s for s in those if (sinking if s.moves else s.slip_stable)]


def slowest_time_constant(of: StationarySolution) -> float:
    """Slowest time constant, s, of what dies out within the case; inf if nothing exponentially."""
    check_type("of", of, StationarySolution)
    if of.stability is Stability.ALGEBRAIC:
        return np.inf
    rates = -of.eigenvalues.real
    decaying = rates[rates > _LEAST_REAL_PART * np.abs(of.eigenvalues).max()]
    return float(1 / decaying.min()) if decaying.size else np.inf


def time_taken_along(p: Parameters, omega_c: float) -> float:
    """Time constant in s with which the fluid takes along a ball near an orbit: (1 + 2 j)/c, with
    the c of its lag and no less than Stokes'; inf without drag."""
    c = max(p.c, drag.coefficient(abs(p.omega_0 - omega_c) * p.R, p))
    return (1 + 2 * p.j) / c if c else np.inf


def time_constant(p: Parameters, of: StationarySolution) -> float:
    """Time constant in s with which a ball that starts anywhere comes to a stationary state."""
    taken = time_taken_along(p, float(of.state.omega_c))
    within = slowest_time_constant(of)
    return max(taken, within) if np.isfinite(within) else taken


def _solution(
    case: Case,
    p: Parameters,
    x: State,
    exists: bool,
    family: tuple[str, ...] = (),
    values: Complex | None = None,
) -> StationarySolution:
    """The stationary solution at a state x; eigenvalues by the Jacobian unless given."""
    if p.c == 0:  # nothing pulls omega_c to omega_0
        family = (*family, "omega_c")
    force = dynamics.forces(case, x, p, p.omega_0)
    zeros = len(family)
    if case is Case.NS:  # the reduced field (48), without y
        values, zeros = dynamics.eigenvalues(dynamics.jacobian(case, x, p)[1:, 1:]), zeros - 1
    elif values is None:
        values = dynamics.eigenvalues(dynamics.jacobian(case, x, p))
    stability = _stability(values, zeros, bool(family) or case is Case.NS)
    if p.drag == QUADRATIC and p.c > 0 and case not in (Case.SS, Case.NS):
        # No lag, so no drag to first order: any small linear drag decides the eigenvalues that are
        # left at zero.
        damped = dynamics.eigenvalues(dynamics.jacobian(case, x, p.replace(drag=STOKES)))
        stability = _stability(damped, zeros, bool(family))
        stability = Stability.ALGEBRAIC if stability is Stability.ASYMPTOTIC else stability
    return StationarySolution(
        case=case,
        x=np.array(x),
        force_A=np.array(force[:3]),
        force_B=np.array(force[3:]),
        eigenvalues=values,
        exists=bool(exists),
        stability=stability,
        slip_stability=slip_stability.stability(case, p, x.omega_c),
        family=family,
    )


def _stability(values: Complex, zeros: int, neutral: bool) -> Stability:
    """Stability by the rightmost eigenvalue, but for the `zeros` of a family's free variables."""
    rest = values[np.argsort(np.abs(values))][zeros:]
    if np.any(rest.real > _LEAST_REAL_PART * np.abs(rest)):
        return Stability.UNSTABLE
    return Stability.NEUTRAL if neutral else Stability.ASYMPTOTIC


def _rr(p: Parameters) -> list[StationarySolution]:
    """Proposition 1: the ball rolls with the fluid. Without drag every omega_c is stationary."""
    best = rolling_forces.least_utilisation(p.omega_0, p)
    exists = bool(best.utilisation <= 1 and not np.isnan(best.B_y))
    return [_solution(Case.RR, p, State(omega_c=p.omega_0), exists)]


def _rs(p: Parameters) -> list[StationarySolution]:
    """Proposition 2: spinning on the spot, if the fluid rests or has no drag; or a smooth wall."""
    if p.eta > 0 and p.c > 0 and p.omega_0 != 0:
        return []
    omega_c = p.omega_0 if p.eta == 0 else 0.0
    exists = p.j * p.R * omega_c**2 <= p.mu * p.g
    return [_solution(Case.RS, p, State(omega_c=omega_c, slip_y=1.0), exists, ("slip_y",))]


def _sr(p: Parameters) -> list[StationarySolution]:
    """Proposition 3, for the formal field: A_y = 0 puts the solution on the border to NR.

    On a smooth floor any slip_x is stationary; that without spin about the radius is given."""
    if p.omega_0 == 0:
        return []
    if p.mu == 0:
        x = State(omega_c=p.omega_0, slip_x=-p.omega_0 * p.R / p.r)
        return [_solution(Case.SR, p, x, True, family=("slip_x",))]
    x = State(omega_c=p.omega_0, slip_x=_lifting_spin(p))
    return [_solution(Case.SR, p, x, _wall_carries(p))] if x.slip_x else []


def _ss(p: Parameters) -> list[StationarySolution]:
    """Proposition 4, by roots along the branch. On a smooth wall slip_y is free, and given as 0."""
    smooth = ("slip_y",) if p.eta == 0 else ()
    if p.mu == p.eta == 0 and p.omega_0 != 0:
        x = State(omega_c=p.omega_0, slip_x=-p.omega_0 * p.R / p.r, slip_y=1.0)
        return [_solution(Case.SS, p, x, True, family=smooth)]
    solutions = []
    for s in slipping_branch.points_at(p):
        x, values = State.of(slipping_branch.states(s, p)[0]), slipping_branch.eigenvalues_at(s, p)
        found = _solution(Case.SS, p, x, True, smooth, values)
        solutions.append(replace(found, alpha=-float(np.arctan(np.exp(s)))))
    return solutions


def _nr(p: Parameters) -> list[StationarySolution]:
    """Proposition 5: the wall alone carries the ball."""
    if p.omega_0 == 0:
        return []
    x = State(omega_c=p.omega_0, slip_x=_lifting_spin(p))
    return [_solution(Case.NR, p, x, _wall_carries(p), ("y",))]


def _ns(p: Parameters) -> list[StationarySolution]:
    """Proposition 6: sinking along the wall at a constant speed, which drag alone limits."""
    sink = p.g - p.eta * p.R * p.omega_0**2
    if p.c == 0 or sink <= 0:
        return []
    v_y, slip_x = -float(drag.speed_of(sink, p)), (p.eta - p.j) / p.j * p.omega_0 * p.R / p.r
    x = State(v_y=v_y, omega_c=p.omega_0, slip_x=slip_x, slip_z=-v_y / p.r)
    return [_solution(Case.NS, p, x, True, family=("y", "slip_y") if p.eta == 0 else ("y",))]


def _lifting_spin(p: Parameters) -> float:
    """slip_x of (35) and (46), at which the gyroscopic moment carries the weight."""
    return p.g / (p.j * p.omega_0 * p.r) - p.omega_0 * p.R / p.r


def _wall_carries(p: Parameters) -> bool:
    """Whether friction at the wall carries the weight: (35), whose sign is misprinted, and (46)."""
    return p.eta * p.Omega_0**2 >= 1


def eigenmodes_SR(p: Parameters) -> tuple[Complex, Complex]:
    """Eigenvalues (2,), rad s-1, of f_SR at its stationary solution; unit vectors as rows (2, 2).

    There A_y = 0, the border to NR (Proposition 3): the eigenvalues show on the side A_y > 0 only,
    where the ball leans on the floor; on the other it lifts off. The first mode is that of the
    load, which decays for omega_0 > omega_03 and grows below; the second that of the orbit, the one
    closer to -c/(1+j). Vectors are over (omega_c, slip_x) and lead to A_y > 0. With s the sign of
    slip_x the sum of the two is -(c + mu s (g/(R omega_0) - (1+j) omega_0))/(1+j), their product
    -mu s c omega_0/(1+j), where c is that of a vanishing lag.

    Raises `InputError` if SR has no stationary solution that leans: for mu = 0, omega_0 = 0, and at
    omega_03, where slip_x = 0."""
    states = [s.state for s in stationary_solutions(p, (Case.SR,)) if p.mu > 0]
    if not states:
        raise InputError(
            f"omega_0 = {p.omega_0:g} rad s-1, mu = {p.mu:g}: SR has no stationary solution that "
            f"leans on the floor"
        )
    (x,) = states
    values, vectors = np.linalg.eig(dynamics.jacobian(Case.SR, x, p).astype(complex))
    first = int(np.argmax(np.abs(values + drag.coefficient(0.0, p) / (1 + p.j))))
    order = [first, 1 - first]
    # How A_y falls with omega_c and slip_x.
    falls = np.array([2 * p.R * x.omega_c + p.r * x.slip_x, p.r * x.omega_c])
    rows = vectors.T[order]
    return values[order], rows * np.where((rows @ falls).real > 0, -1.0, 1.0)[:, None]
