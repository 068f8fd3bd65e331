"""Moreau-Jean time stepping: the ball as a rigid body under Coulomb's law, without cases.

A step changes the velocities by the smooth forces at the mean of old and new velocity (theta = 1/2)
and by the impulses of the closed contacts, which obey Coulomb's law with the velocities at its end;
friction of a contact that slides on opposes the mean of its old and new slip. Smooth forces and
both contacts are iterated together until the velocities settle. A landing is located within the
step: the ball is taken there, collides (Newton's restitution), and goes on. Slip that begins, dies
out or turns within a step, and lift-off, are not located: the scheme is of second order between
such changes, of first order through them.

While the ball is at the wall, velocities are taken along axes that turn with it, so that the wall's
normal is constant within the step and a ball that is held at the wall neither drifts off nor into
it; a stationary orbit is reproduced exactly. Otherwise the axes stand still, so that the vessel's
axis is no singular point.

Steps and the loop over them are in `stepping`, which is compiled."""

from __future__ import annotations

import math
from functools import partial

import numpy as np

from analytic.mechanics import drag, rigid_body
from analytic.mechanics.contact_problem import NotConvergedError
from analytic.mechanics.rigid_body import NOTHING
from analytic.simulation import stepping
from analytic.simulation.motion import AT_ONCE, Recorder, Rows
from analytic.simulation.settings import Settings
from model import Case, Flow, Parameters, State, time_scales
from model.arrays import Array
from model.parameters import Range, check_number

MAX_STEPS = 1e9
"""Of a run, an hour or so."""


def carry_out(
    x0: State, theta_0: float, p: Parameters, flow: Flow, settings: Settings, recorder: Recorder
) -> None:
    """Simulate a run, by time stepping, from state x0 and azimuth theta_0.

    Raises `NotConvergedError`."""
    run, place = recorder.begin(), (0, 0)
    ball, stretches, given = prepared(x0, theta_0, p, flow, settings, run.times)
    while place[0] < len(stretches.start):
        parts, place = stepping.follow(ball, place, stretches, given, run, AT_ONCE)
        ball = stepping.ball_from_parts(parts)
        recorder.look()
        if ball.residual != 0:
            raise NotConvergedError(
                f"velocities still change by {ball.residual:g} m s-1; a shorter step than "
                f"{stretches.dt[place[0]]:g} s may help"
            )
        if run.over[0]:
            raise InterruptedError("nobody wants the run any more")


def sample_forces(run: Rows, p: Parameters) -> Array:
    """Forces of the samples (n, 6), N."""
    return run.path[: run.taken[0], 2:]


def prepared(
    x: State, theta: float, p: Parameters, flow: Flow, settings: Settings, times: Array
) -> tuple[stepping.Ball, stepping.Stretches, stepping.Constants]:
    """What the compiled loop takes: the ball before any step, steps in the flow, and constants.

    Raises `InputError` if the time step is too large for the problem."""
    t_end = float(times[-1])
    problem = p, flow, t_end, partial(drag.coefficient, p=p), x
    fastest = time_scales.shortest_time(*problem).rate
    timestep = settings.timestep or min(math.sqrt(p.R / p.g) / 500, 0.5 / fastest)
    time_scales.check_timestep(timestep, *problem)
    meaning = f"for at most {MAX_STEPS:g} steps it"
    check_number("t_end", t_end, "s", Range(high=MAX_STEPS * timestep), meaning)
    knots = np.union1d(times, flow.knots(t_end))
    length = np.diff(knots)
    steps = np.ceil(length / timestep * (1 - 1e-12)).astype(np.int64)
    at = stepping.BallState(theta, x.y, x.h, rigid_body.velocities(x, p))
    # an integer would be compiled for itself
    e = float(settings.restitution)
    fluid = stepping.FlowArrays(flow.start, flow.value, flow.slope, flow.waves)
    return (
        stepping.Ball(at, NOTHING, NOTHING, int(Case.NN), 0.0, 0, 0.0),
        stepping.Stretches(knots[:-1], length / steps, steps, np.isin(knots[1:], times), fluid),
        stepping.Constants(drag.law(p), p.m, p.r, p.R, p.j, p.mu, p.eta, p.g, e, p.fluid_torque),
    )
