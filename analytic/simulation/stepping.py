"""Moreau-Jean steps and the loops over them, compiled: plain floats in named tuples."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from analytic.mechanics import drag, rigid_body
from analytic.mechanics.contact_problem import (
    NO_IMPULSE,
    Friction,
    Impulse,
    Slips,
    impulses,
    needs,
    project,
    solve_pair,
)
from analytic.mechanics.rigid_body import NOTHING, Forces, Velocities, mean
from analytic.simulation import compiling
from analytic.simulation.equations import AWAY, ROLLS, SLIPS
from analytic.simulation.motion import Rows, count_landings, keep_event, keep_sample
from analytic.simulation.settings import LANDED
from model.arrays import Array

TOLERANCE, BARELY = 1e-14, 1e-11
"""Change of an impulse per mass at which sweeps stop, relative to sqrt(g R) or the fastest
velocity; and where friction only just holds a rolling ball: two solutions meet there, which can be
found to the root of round-off only."""
MAX_ITERATIONS = 100
ROUGH = 1e-4
"""How well an iteration solves the contacts, relative to the last change of velocities."""
LOCATING = 10
"""Most solutions of a stretch to locate its landing: the parabola triples the digits with each."""
LANDINGS = 20
"""Most landings that are located within a step; later ones are put at its end."""
SLIDES = 4.0
"""A contact slides through a step if to stop it takes more than this many times the step's load."""
ZERO_SLIP = 1e-9
"""Sliding speed relative to sqrt(g R) up to which a contact rolls: above what iterations leave."""


class Constants(NamedTuple):
    """Parameters and settings of a step."""

    law: drag.DragLaw
    m: float
    r: float
    R: float
    j: float
    mu: float
    eta: float
    g: float
    e: float
    """Coefficient of restitution."""
    k: float
    """Rate of the fluid's torque."""


class FlowArrays(NamedTuple):
    """Arrays of a `model.Flow`."""

    start: Array
    value: Array
    slope: Array
    waves: Array


class BallState(NamedTuple):
    """Where the ball is, and its velocities along the axes there."""

    theta: float
    y: float
    h: float
    u: Velocities


class Ball(NamedTuple):
    """The ball at the end of a step."""

    at: BallState
    P: Forces
    """Impulses of the step, N s."""
    impact: Forces
    """Those among them of landings, N s."""
    case: int
    """What the solution says of the contacts, see `model.cases.Case`."""
    work: float
    """Work of drag and contacts since the start, J."""
    landings: int
    """Landings since the start faster than `LANDED`."""
    residual: float
    """0, or by how much the velocities of a step that did not converge still changed, m s-1."""


def _in_parts(ball: Ball) -> Any:
    """The ball in plain tuples: a signal would be answered while numba makes named ones, which
    doesn't look whether it has got them."""
    return (ball.at[:3], ball.at.u[:]), ball.P[:], ball.impact[:], ball[3:]


def ball_from_parts(parts: Any) -> Ball:
    """The ball from the plain tuples that `follow` returns."""
    (place, u), P, impact, rest = parts
    return Ball(BallState._make([*place, Velocities(*u)]), Forces(*P), Forces(*impact), *rest)


Progress = tuple[int, int]
"""How far a run is: stretch, and steps taken of it."""


class Touching(NamedTuple):
    """Which contacts touch, and the normal velocities at which they aim, m s-1."""

    A: bool
    B: bool
    to_A: float
    to_B: float


class Stretches(NamedTuple):
    """Equal steps from each sample or knot of the flow to the next, arrays (n,); and the flow."""

    start: Array
    dt: Array
    steps: npt.NDArray[np.int64]
    sampled: npt.NDArray[np.bool_]
    """Whether the end is a sample."""
    flow: FlowArrays


class StepSolution(NamedTuple):
    """Velocities after a step or an impact, and the impulses and work that made them."""

    new: Velocities
    P: Forces
    work: float
    """Work of drag and contacts, J."""
    spin: float
    """How fast the axes turned about j, rad s-1."""
    residual: float


class Middle(NamedTuple):
    """The middle of a step, by the velocities before and after it."""

    u: Velocities
    """The mean of both."""
    x_i: float
    """Where the ball is, along the axes of the beginning, m."""
    x_k: float
    spin: float
    """How fast the axes turn about j, rad s-1."""
    c: float
    """Rate of drag, s-1."""
    omega_0: float
    """Of the flow, rad s-1."""


def solve(
    at: BallState, dt: float, omega_0: float, touching: Touching, start: Forces, p: Constants
) -> StepSolution:
    """Velocities after dt, 0 for an impact, with closed contacts.

    Smooth forces, at the mean velocity, and contacts are iterated; `start` guesses the impulses."""
    u, slips = at.u, _old_slip(at, dt, p)
    fastest = max(abs(u.v_h), abs(u.v_y), abs(u.v_k), p.r * max(abs(u.o_x), abs(u.o_y), abs(u.o_z)))
    for tolerance in (TOLERANCE, BARELY):
        enough = tolerance * max(math.sqrt(p.g * p.R), fastest)
        # What such changes of two impulses, in two iterations, add up to.
        still = (4 + 8 / p.j) * enough
        A, B = _first_guess(touching, start, p.m)
        new, last, change = u, 0.0, p.g * dt
        for _ in range(MAX_ITERATIONS):
            middle = _middle(at, new, dt, omega_0, touching.B, p)
            free = _free(u, middle, A.t, dt, p)
            aim = max(enough, ROUGH * change)
            A, B, residual = _impulses(free, slips, touching, B, aim, p)
            before, new = new, _pushed(free, A, B, p)
            change = _change(before, new, p.r)
            # Changes shrink at a steady rate: what is left is this one times the rate.
            nearly = change < last / 4 and change * change <= last * still / 50
            settled = dt == 0 or change <= still or nearly
            converged = settled and residual <= enough
            if converged or not residual <= aim:
                break
            last = change
        if converged:
            break
    work = _work(mean(u, new), middle, A, B, dt, p)
    # A loaded contact has met its target, and round-off must not open it again.
    v_h = touching.to_B if B.n > 0 else new.v_h
    v_y = touching.to_A if A.n > 0 else new.v_y
    new = Velocities(v_h, v_y, new.v_k, new.o_x, new.o_y, new.o_z)
    left = 0.0 if converged else _larger_or_nan(change, residual)
    return StepSolution(new, impulses(A, B, p.m), work, middle.spin, left)


def _middle(
    at: BallState, new: Velocities, dt: float, omega_0: float, on_wall: bool, p: Constants
) -> Middle:
    """The middle of a step that ends with velocities `new`."""
    u = mean(at.u, new)
    x_i = at.h - p.R + dt / 2 * u.v_h
    x_k, spin = (0.0, -u.v_k / x_i) if on_wall else (dt / 2 * u.v_k, 0.0)
    c = p.law.linear
    if p.law.blunt > 0:
        c = drag.rate(drag.speed(u.v_h - omega_0 * x_k, u.v_y, u.v_k + omega_0 * x_i), p.law)
    return Middle(u, x_i, x_k, spin, c, omega_0)


def _free(old: Velocities, middle: Middle, A_t: float, dt: float, p: Constants) -> Velocities:
    """Velocities after dt without contacts, (20) with (9).

    But o_z takes the new o_x, with the impulse A_t, which saves two iterations of seven."""
    (u, x_i, x_k, spin, c, omega_0), k = middle, p.k
    w_h, w_k = u.v_h - omega_0 * x_k, u.v_k + omega_0 * x_i
    v_h = old.v_h - dt * (spin * u.v_k + c * w_h)
    v_y = old.v_y - dt * (p.g + c * u.v_y)
    v_k = old.v_k + dt * (spin * u.v_h - c * w_k)
    o_x = old.o_x - dt * (spin * u.o_z + k * u.o_x)
    o_y = old.o_y - dt * k * (u.o_y - omega_0)
    o_z = old.o_z + dt * (spin * (old.o_x + o_x - A_t / (p.j * p.r)) / 2 - k * u.o_z)
    return Velocities(v_h, v_y, v_k, o_x, o_y, o_z)


def _impulses(
    free: Velocities, slips: Slips, touching: Touching, B: Impulse, aim: float, p: Constants
) -> tuple[Impulse, Impulse, float]:
    """Impulses per mass by Coulomb's law to a tolerance `aim`, near a guess at B; their change."""
    a, b = needs(free, touching.to_A, touching.to_B, slips, p)
    on_A, on_B = Friction(p.mu, 0.0, 0.0), Friction(p.eta, 0.0, 0.0)
    if touching.A and touching.B:
        return solve_pair(a, b, B, on_A, on_B, p.j, aim)
    at_A = project(a, on_A) if touching.A else NO_IMPULSE
    return at_A, project(b, on_B) if touching.B else NO_IMPULSE, 0.0


def _pushed(free: Velocities, A: Impulse, B: Impulse, p: Constants) -> Velocities:
    """Velocities with the impulses of both contacts, per mass."""
    jr = p.j * p.r
    return Velocities(
        free.v_h + A.s + B.n,
        free.v_y + A.n + B.s,
        free.v_k + A.t + B.t,
        free.o_x - A.t / jr,
        free.o_y + B.t / jr,
        free.o_z + (A.s - B.s) / jr,
    )


def _change(before: Velocities, new: Velocities, r: float) -> float:
    """By how much velocities differ, m s-1: a sum, since max overlooks nan."""
    v_h, v_y, v_k = new.v_h - before.v_h, new.v_y - before.v_y, new.v_k - before.v_k
    o_x, o_y, o_z = new.o_x - before.o_x, new.o_y - before.o_y, new.o_z - before.o_z
    change: float = abs(v_h) + abs(v_y) + abs(v_k) + r * (abs(o_x) + abs(o_y) + abs(o_z))
    return change


def _work(u: Velocities, middle: Middle, A: Impulse, B: Impulse, dt: float, p: Constants) -> float:
    """Work of contacts and drag in a step with mean velocities u, J."""
    (_, x_i, x_k, _, c, omega_0), r = middle, p.r
    power = u.v_h * (u.v_h - omega_0 * x_k) + u.v_y * u.v_y + u.v_k * (u.v_k + omega_0 * x_i)
    at_A = A.s * (u.v_h + r * u.o_z) + A.n * u.v_y + A.t * (u.v_k - r * u.o_x)
    at_B = B.n * u.v_h + B.s * (u.v_y - r * u.o_z) + B.t * (u.v_k + r * u.o_y)
    turned = p.j * r * r * p.k * (u.o_x * u.o_x + u.o_y * (u.o_y - omega_0) + u.o_z * u.o_z)
    work: float = p.m * (at_A + at_B - dt * (c * power + turned))
    return work


def _old_slip(at: BallState, dt: float, p: Constants) -> Slips:
    """Slip velocities of A and B before the step, m s-1; zero where slip may stop within it.

    It is added to the new one, since friction opposes the mean of both where a contact slides on;
    where it may stop, friction opposes the final slip, so that it can't reverse."""
    u, share, none = at.u, p.j / (1 + p.j), (0.0, 0.0)
    A, B = rigid_body.slip_at_A(u, p), rigid_body.slip_at_B(u, p)
    on_wall = max(u.v_k * u.v_k / (p.R - at.h) * dt - u.v_h, 0.0)
    load = SLIDES * (max(p.g * dt - u.v_y, 0.0) + on_wall)
    slides_A = dt > 0 and share * _length(A[0], A[1]) > p.mu * load
    slides_B = dt > 0 and share * _length(B[0], B[1]) > p.eta * load
    return A if slides_A else none, B if slides_B else none


def _first_guess(touching: Touching, start: Forces, m: float) -> tuple[Impulse, Impulse]:
    """Impulses divided by the mass with which the solver starts; zero at an open contact."""
    A = Impulse(start.A_y / m, start.A_x / m, start.A_z / m) if touching.A else NO_IMPULSE
    B = Impulse(start.B_x / m, start.B_y / m, start.B_z / m) if touching.B else NO_IMPULSE
    return A, B


def _length(x: float, y: float) -> float:
    return math.sqrt(x * x + y * y)  # several times as fast as math.hypot


def _sum(a: Forces, b: Forces) -> Forces:
    return Forces(
        a.A_x + b.A_x, a.A_y + b.A_y, a.A_z + b.A_z, a.B_x + b.B_x, a.B_y + b.B_y, a.B_z + b.B_z
    )


def _moved(at: BallState, dt: float, s: StepSolution, touching: Touching, R: float) -> BallState:
    """The ball's place after dt; a contact that carries load is set to a gap of exactly zero."""
    u, new = mean(at.u, s.new), s.new
    y = 0.0 if touching.A and s.P.A_y > 0 else at.y + dt * u.v_y
    if touching.B:
        return BallState(at.theta + dt * s.spin, y, 0.0 if s.P.B_x > 0 else at.h + dt * u.v_h, new)
    x_i, x_k = at.h - R + dt * u.v_h, dt * u.v_k
    rho = _length(x_i, x_k)
    cos, sin = -x_i / rho, x_k / rho
    v_h, v_k = new.v_h * cos - new.v_k * sin, new.v_k * cos + new.v_h * sin
    o_x, o_z = new.o_x * cos - new.o_z * sin, new.o_z * cos + new.o_x * sin
    turned = Velocities(v_h, new.v_y, v_k, o_x, new.o_y, o_z)
    return BallState(at.theta + math.atan2(x_k, -x_i), y, R - rho, turned)


def _crossing(gap: float, rate: float, end: float, dt: float) -> float:
    """When within dt a gap passes zero, by the parabola of its value and rate, and its `end`."""
    bend = 2 * (end - gap - rate * dt) / (dt * dt)
    root = math.sqrt(max(0.0, rate * rate - 2 * bend * gap))
    time = 2 * gap / (root - rate) if rate < 0 else (rate + root) / -bend
    return min(max(time, 0.0), dt)


def _step_to_landing(
    at: BallState, dt: float, omega_0: float, touching: Touching, start: Forces, p: Constants
) -> tuple[BallState, StepSolution, float]:
    """The ball after dt, or at its first landing on floor or wall; and the time of that."""
    time = dt
    s = solve(at, dt, omega_0, touching, start, p)
    after = _moved(at, dt, s, touching, p.R)
    to_floor = to_wall = math.inf
    if not touching.A and after.y < 0:
        to_floor = _crossing(at.y, at.u.v_y, after.y, dt)
    if not touching.B and after.h < 0:
        to_wall = _crossing(at.h, at.u.v_h, after.h, dt)
    floor, better = to_floor <= to_wall, min(to_floor, to_wall)
    if better == math.inf or s.residual != 0:
        return after, s, dt
    for _ in range(LOCATING):
        time = better
        s = solve(at, time, omega_0, touching, start, p)
        after = _moved(at, time, s, touching, p.R)
        if time == 0:
            break
        gap, rate, end = (at.y, at.u.v_y, after.y) if floor else (at.h, at.u.v_h, after.h)
        better = _crossing(gap, rate, end, time)
        if abs(better - time) <= 1e-12 * dt:
            break
    y, h = (0.0, after.h) if floor else (after.y, 0.0)
    return BallState(after.theta, y, h, after.u), s, time


def step(ball: Ball, dt: float, omega_0: float, p: Constants) -> Ball:
    """The ball a step of dt later, with omega_0 from the middle of the step."""
    at, case, work, landings = ball.at, ball.case, ball.work, ball.landings
    P, impact, residual = NOTHING, NOTHING, 0.0
    q, b = ball.P, ball.impact  # first guess: the impulses of the last step but those of landings
    start = Forces(
        q.A_x - b.A_x, q.A_y - b.A_y, q.A_z - b.A_z, q.B_x - b.B_x, q.B_y - b.B_y, q.B_z - b.B_z
    )
    left, count = dt, 0
    while left > 0 and residual == 0:
        in_A, in_B = at.y <= 0 and at.u.v_y <= 0, at.h <= 0 and at.u.v_h <= 0
        speed = max(-at.u.v_y if in_A else 0.0, -at.u.v_h if in_B else 0.0)
        if speed > 0:
            hit = _impact(at, dt, in_A, in_B, p)
            at = BallState(at.theta, at.y, at.h, hit.new)
            P, impact = _sum(P, hit.P), _sum(impact, hit.P)
            work, residual = work + hit.work, _larger_or_nan(hit.residual, residual)
            landings += speed > LANDED * math.sqrt(p.g * p.R)
            in_A, in_B = in_A and at.u.v_y <= 0, in_B and at.u.v_h <= 0
        touching = Touching(in_A, in_B, 0.0, 0.0)
        if count < LANDINGS:
            at, s, time = _step_to_landing(at, left, omega_0, touching, start, p)
        else:
            after = _moved(at, left, solve(at, left, omega_0, touching, start, p), touching, p.R)
            time = left
            touching = Touching(in_A or after.y < 0, in_B or after.h < 0, 0.0, 0.0)
            s = solve(at, left, omega_0, touching, start, p)
            after = _moved(at, left, s, touching, p.R)
            at = BallState(after.theta, max(after.y, 0.0), max(after.h, 0.0), after.u)
        P, work, residual = _sum(P, s.P), work + s.work, _larger_or_nan(s.residual, residual)
        left, count, case = left - time, count + 1, _case_of(s, touching, p)
    return Ball(at, P, impact, case, work, landings, residual)


def _impact(at: BallState, dt: float, in_A: bool, in_B: bool, p: Constants) -> StepSolution:
    """An impact, with Newton's restitution; a rebound below a hundredth of a step is none."""
    to_A = -p.e * at.u.v_y if in_A and -p.e * at.u.v_y > p.g * dt / 200 else 0.0
    to_B = -p.e * at.u.v_h if in_B and -p.e * at.u.v_h > p.g * dt / 200 else 0.0
    hit = solve(at, 0.0, 0.0, Touching(in_A, in_B, to_A, to_B), NOTHING, p)
    # friction may lock the ball in the corner: no rebound
    if hit.residual != 0 and p.mu >= 1 and p.eta >= 1:
        hit = solve(at, 0.0, 0.0, Touching(in_A, in_B, 0.0, 0.0), NOTHING, p)
    return hit


def _case_of(s: StepSolution, touching: Touching, p: Constants) -> int:
    """The case by velocities and impulses: a contact that leaves is open, one at rest rolls."""
    A, B, still = AWAY, AWAY, ZERO_SLIP * math.sqrt(p.g * p.R)
    slip_A, slip_B = rigid_body.slip_at_A(s.new, p), rigid_body.slip_at_B(s.new, p)
    if touching.A and (s.P.A_y > 0 or s.new.v_y <= 0):
        A = ROLLS if _length(slip_A[0], slip_A[1]) <= still else SLIPS
    if touching.B and (s.P.B_x > 0 or s.new.v_h <= 0):
        B = ROLLS if _length(slip_B[0], slip_B[1]) <= still else SLIPS
    return 3 * A + B


def _larger_or_nan(new: float, residual: float) -> float:
    """The larger of two numbers; nan if either is."""
    return new if new > residual or math.isnan(new) else residual


def _flow_at(flow: FlowArrays, time: float) -> float:
    """omega_0 of a flow at a time, rad s-1."""
    k = 0
    if len(flow.start) > 1:
        k = max(int(np.searchsorted(flow.start, time, side="right")) - 1, 0)
    omega_0 = flow.value[k] + flow.slope[k] * max(time - flow.start[k], 0.0)
    for n in range(len(flow.waves)):
        wave = flow.waves[n]
        omega_0 += wave[0] * math.sin(2 * math.pi * wave[1] * time + wave[2])
    return float(omega_0)


def _keep_sample(ball: Ball, P: Forces, dt: float, p: Constants, run: Rows) -> None:
    """Store a ball after a step of length dt with impulses P as the next sample."""
    row = keep_sample(rigid_body.state(ball.at.y, ball.at.h, ball.at.u, p), ball.case, run)
    if len(run.path) > 0:
        path = run.path[row]
        path[0], path[1] = ball.at.theta, ball.work
        for i in range(6):
            path[2 + i] = P[i] / dt


@compiling.compiled
def follow(
    ball: Ball, place: Progress, stretches: Stretches, p: Constants, run: Rows, most: int
) -> tuple[Any, Progress]:
    """Follow a run to its end, a step that doesn't converge, or for so many: ball and place.

    The ball is in parts (`ball_from_parts`). The first sample, before any step, carries the forces
    and the case of the first step. A run that has been quiet for long ends at that sample; the
    place is then behind the last stretch, as at any end."""
    (starts, dts, counts, sampled, flow), (s, k) = stretches, place
    if run.taken[0] == 0:
        dt = dts[0]
        first = step(ball, dt, _flow_at(flow, starts[0] + 0.5 * dt), p)
        ball = Ball(ball.at, ball.P, ball.impact, first.case, 0.0, 0, 0.0)
        _keep_sample(ball, first.P, dt, p, run)
    while s < len(starts):
        start, dt = starts[s], dts[s]
        while k < counts[s]:
            if most == 0 or run.over[0]:
                return _in_parts(ball), (s, k)
            most -= 1
            case, known = ball.case, ball.landings
            ball = step(ball, dt, _flow_at(flow, start + (k + 0.5) * dt), p)
            k += 1
            now = start + k * dt
            run.reached[0] = now
            if ball.residual != 0:
                return _in_parts(ball), (s, k)
            if ball.landings > known:
                count_landings(now, ball.landings - known, run)
            if ball.case != case or ball.impact.A_y > 0 or ball.impact.B_x > 0:
                keep_event(now, case, ball.case, ball.impact, run)
        if sampled[s]:
            _keep_sample(ball, ball.P, dt, p, run)
            if run.times[run.taken[0] - 1] >= run.reached[1]:
                s = len(starts)
        s, k = s + 1, 0
    return _in_parts(ball), (s, k)
