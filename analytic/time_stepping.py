"""Moreau-Jean time stepping: the ball as a rigid body that knows Coulomb's law and nothing of cases.

A step of length dt changes the velocities ``u = (v_h, v_y, v_k, o_x, o_y, o_z)`` (see `contact_problem`) by the smooth
forces at the mean of old and new velocity (theta = 1/2) and by the impulses of the contacts that the middle of the
step predicts to be closed. Newton's restitution applies: v_n+ >= -e v_n-. Smooth forces and both contacts are
iterated together until the impulses settle.

While the wall is in reach, velocities are taken along axes that turn with the ball, so that the wall's normal is
constant within the step and a ball that is held at the wall neither drifts off nor into it; a stationary orbit is
reproduced exactly. Otherwise the axes stand still, and the vessel's axis is a place like any other.

The scheme is of first order in dt.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from analytic import contact_problem, rigid_body
from analytic.contact_problem import Closed, Continuation, NotConvergedError
from analytic.records import REPORT_EVERY, Event, Recorder
from analytic.rigid_body import NOTHING, Place, Six
from analytic.settings import Settings
from model import Case, Contact, Flow, Parameters

BLOCK = 256
"""Samples kept before they are handed over."""

TOLERANCE = 1e-13
"""Change of the impulses in an iteration at which it stops, as a velocity of the ball relative to sqrt(g R)."""
MAX_ITERATIONS = 2000
ZERO_SLIP = 1e-9
"""Sliding speed relative to sqrt(g R) up to which a contact is called rolling: well above what the iteration leaves."""


@dataclass(frozen=True)
class Ball:
    """The ball at the end of a step."""

    theta: float
    y: float
    h: float
    u: Six
    """Velocities, see `rigid_body`."""
    P: Six = NOTHING
    """Impulses of the step, N s."""
    case: Case = Case.NN
    """What the solution says of the contacts."""
    work: float = 0.0
    """Work of drag and contacts since the start, J."""


def run(x0: list[float], theta_0: float, p: Parameters, flow: Flow, settings: Settings, recorder: Recorder) -> None:
    """Step from state x0 and record samples and changes of case; the contract of `simulation.simulate`.

    The first sample, before any step, carries the forces and the case of the first step. Raises
    `NotConvergedError`.
    """
    longest = settings.step or math.sqrt(p.R / p.g) / 500
    times = recorder.times
    knots = np.union1d(times, flow.start[(flow.start > 0) & (flow.start < times[-1])])
    ball = Ball(theta_0, x0[0], x0[6], rigid_body.velocities(x0, p))
    samples: list[tuple[float, Ball, float]] = []
    taken = 0
    try:
        for start, end in pairwise(knots.tolist()):
            count = math.ceil((end - start) / longest * (1 - 1e-12))
            dt = (end - start) / count
            for k in range(count):
                time = start + (k + 0.5) * dt
                after = step(ball, dt, float(flow(time)), p, settings.restitution)
                if time == dt / 2:
                    ball = replace(ball, P=after.P, case=after.case)
                    samples.append((0.0, ball, dt))
                elif after.case is not ball.case:
                    recorder.events.append(Event(start + (k + 1) * dt, ball.case, after.case, _impact(ball, after)))
                ball, taken = after, taken + 1
                if taken % REPORT_EVERY == 0:
                    recorder.reached(start + (k + 1) * dt)
            if end in times:
                samples.append((end, ball, dt))
            if len(samples) >= BLOCK:
                _record(samples, p, recorder)
                samples = []
    finally:
        if samples:
            _record(samples, p, recorder)


def _impact(before: Ball, after: Ball) -> Six:
    """Impulses of a step in which the ball hit floor or wall, else none."""
    landed = (after.P[1] > 0 and before.u[1] < 0) or (after.P[3] > 0 and before.u[0] < 0)
    return after.P if landed else NOTHING


def _record(samples: list[tuple[float, Ball, float]], p: Parameters, recorder: Recorder) -> None:
    times, balls, steps = zip(*samples, strict=True)
    recorder.add(
        np.array(times), np.array([ball.theta for ball in balls]),
        np.array([rigid_body.state(ball.y, ball.h, ball.u, p) for ball in balls]),
        np.array([ball.P for ball in balls]) / np.array(steps)[:, None],
        np.array([ball.case for ball in balls]), np.array([ball.work for ball in balls]),
    )  # fmt: skip


def step(ball: Ball, dt: float, omega_0: float, p: Parameters, restitution: float) -> Ball:
    """The ball a step of dt later, with omega_0 from the middle of the step.

    Raises `NotConvergedError` if the impulses don't settle within `MAX_ITERATIONS`.
    """
    old = ball.u
    A = Closed(max(0.0, -restitution * old[1])) if ball.y + dt / 2 * old[1] <= 0 else None
    B = Closed(max(0.0, -restitution * old[0])) if ball.h + dt / 2 * old[0] <= 0 else None
    try:
        new, P, middle = _solve(ball, dt, omega_0, A, B, p)
    except NotConvergedError as error:
        if not (A and B):
            raise
        A = B = contact_problem.unlocked(error, p)
        new, P, middle = _solve(ball, dt, omega_0, A, B, p)
    u = rigid_body.mean(old, new)
    work = ball.work + dt * rigid_body.drag_power(u, middle, omega_0, p) + rigid_body.contact_work(u, P, p)
    # A loaded contact has met its target and, if that is rest, is closed; round-off must not open it again.
    new = (
        B.target if B and P[3] > 0 else new[0],
        A.target if A and P[1] > 0 else new[1],
        new[2], new[3], new[4], new[5],
    )  # fmt: skip
    y, case = _gap(ball.y + dt * u[1], A, P[1]), _case(A, B, new, P, p)
    if B:
        h = _gap(ball.h + dt * u[0], B, P[3])
        return Ball(ball.theta + dt * middle.spin, y, h, new, P, case, work)
    x_i, x_k = -(p.R - ball.h) + dt * u[0], dt * u[2]
    angle = math.atan2(x_k, -x_i)
    return Ball(ball.theta + angle, y, p.R - math.hypot(x_i, x_k), rigid_body.turned(new, angle), P, case, work)


def _solve(
    ball: Ball, dt: float, omega_0: float, A: Closed | None, B: Closed | None, p: Parameters
) -> tuple[Six, Six, Place]:
    """Velocities after the step, impulses in it, and where its middle is."""
    enough = TOLERANCE * math.sqrt(p.g * p.R) * p.m
    A_x, A_y, A_z, B_x, B_y, B_z = ball.P
    P = (*((A_x, A_y, A_z) if A else (0.0, 0.0, 0.0)), *((B_x, B_y, B_z) if B else (0.0, 0.0, 0.0)))
    new, change = ball.u, math.inf
    pace = Continuation(A, B, p) if A and B else None
    for _ in range(MAX_ITERATIONS):
        u = rigid_body.mean(ball.u, new)
        x_i = -(p.R - ball.h) + dt / 2 * u[0]
        middle = Place(x_i, 0.0, -u[2] / x_i) if B else Place(x_i, dt / 2 * u[2], 0.0)
        free = rigid_body.plus(ball.u, dt, rigid_body.smooth_rates(u, middle, omega_0, p))
        (after, P_after), (v_h, v_y, v_k, *_) = contact_problem.sweep(rigid_body.apply(free, P, p), P, A, B, p), new
        change = max(
            p.m * abs(after[0] - v_h), p.m * abs(after[1] - v_y), p.m * abs(after[2] - v_k),
            *(abs(a - b) for a, b in zip(P_after, P, strict=True)),
        )  # fmt: skip
        if change <= enough:
            return after, P_after, middle
        new, P = after, pace.next(after, P, P_after, change) if pace else P_after
    raise NotConvergedError(
        f"the contact impulses still change by {change:g} N s, asked for {enough:g} N s; "
        f"a shorter step than {dt:g} s may help"
    )


def _gap(gap: float, contact: Closed | None, load: float) -> float:
    """A contact that has come to rest is closed; a ball that rebounds keeps its place, early or late by half a step."""
    return 0.0 if contact and load > 0 and contact.target == 0 else gap


def _case(A: Closed | None, B: Closed | None, u: Six, P: Six, p: Parameters) -> Case:
    """What the solution says of the contacts: open if it leaves with a velocity, rolling if nothing slides."""
    still = ZERO_SLIP * math.sqrt(p.g * p.R)
    in_A = A is not None and (P[1] > 0 or u[1] <= 0)
    in_B = B is not None and (P[3] > 0 or u[0] <= 0)
    roll_A, roll_B = math.hypot(*rigid_body.slip_at_A(u, p)) <= still, math.hypot(*rigid_body.slip_at_B(u, p)) <= still
    return Case.of(
        (Contact.R if roll_A else Contact.S) if in_A else Contact.N,
        (Contact.R if roll_B else Contact.S) if in_B else Contact.N,
    )
