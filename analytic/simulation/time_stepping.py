"""Moreau-Jean time stepping: the ball as a rigid body under Coulomb's law, without cases.

A step changes the velocities by the smooth forces at the mean of old and new velocity (theta = 1/2) and by the
impulses of the closed contacts, which obey Coulomb's law with the velocities at its end; friction of a contact that
slides on opposes the mean of its old and new slip. Smooth forces and both contacts are iterated together until the
velocities settle. A landing is located within the step: the ball is taken there, collides (Newton's restitution), and
goes on. Slip that begins, dies out or turns within a step, and lift-off, are not located: the scheme is of second
order between such changes, of first order through them.

While the ball is at the wall, velocities are taken along axes that turn with it, so that the wall's normal is
constant within the step and a ball that is held at the wall neither drifts off nor into it; a stationary orbit is
reproduced exactly. Otherwise the axes stand still, so that the vessel's axis is no singular point.

Steps and loops over them are in `stepping`, which numba compiles where it is installed (the extra `fast`).
"""

from __future__ import annotations

from functools import partial

import numpy as np

from analytic.mechanics import drag, rigid_body
from analytic.mechanics.contact_problem import NotConvergedError
from analytic.mechanics.rigid_body import NOTHING, Forces
from analytic.simulation import stepping
from analytic.simulation.motion import Event, Recorder
from analytic.simulation.settings import Settings, fitting_step
from model import Case, Flow, Parameters, State, time_scales
from model.arrays import Array

BLOCK = 256
"""Samples kept before they are handed over."""
AT_ONCE = 10_000
"""Most steps between two looks at progress and keyboard."""
EVENTS = 1000
"""Most events between them."""


def run(x0: State, theta_0: float, p: Parameters, flow: Flow, settings: Settings, recorder: Recorder) -> None:
    """Step from state x0 and record samples and changes of case; the contract of `simulation.simulate`.

    The first sample, before any step, carries the forces and the case of the first step. Raises
    `NotConvergedError`.
    """
    now, stretches, fluid, given = prepared(x0, theta_0, p, flow, settings, recorder.times)
    dt = float(stretches.dt[0])
    first = stepping.step(now, dt, float(flow(dt / 2)), given)
    now = now._replace(case=first.case)
    samples = [(0.0, now._replace(P=first.P), dt)]
    events = np.empty((EVENTS, 9))
    try:
        for start, dt, count, sampled in zip(*(column.tolist() for column in stretches), strict=True):
            taken = 0
            while taken < count:
                steps = stepping.Steps(start, dt, taken, min(count, taken + AT_ONCE))
                parts, taken, noted = stepping.advance(now, steps, fluid, given, events)
                now = stepping.ball_from_parts(parts)
                for time, before, after, *impulse in events[:noted].tolist():
                    recorder.events.append(Event(time, Case(int(before)), Case(int(after)), Forces(*impulse)))
                recorder.reached(start + taken * dt)
                if now.residual != 0:
                    raise NotConvergedError(
                        f"velocities still change by {now.residual:g} m s-1; a shorter step than {dt:g} s may help"
                    )
            if sampled:
                samples.append((start + count * dt, now, dt))
            if len(samples) >= BLOCK:
                _record_samples(samples, p, recorder)
                samples = []
    finally:
        if samples:
            _record_samples(samples, p, recorder)


def prepared(
    x: State, theta: float, p: Parameters, flow: Flow, settings: Settings, times: Array
) -> tuple[stepping.Ball, stepping.Stretches, stepping.FlowArrays, stepping.Constants]:
    """What the compiled loops take: the ball in a state that no step has led to, its steps, the flow, and constants.

    Raises `InputError` if the time step is too large for the problem.
    """
    t_end = float(times[-1])
    timestep = settings.timestep or fitting_step(500, p, flow, t_end)
    time_scales.check_timestep(timestep, p, flow, t_end, partial(drag.coefficient, p=p))
    knots = np.union1d(times, flow.knots(t_end))
    length = np.diff(knots)
    steps = np.ceil(length / timestep * (1 - 1e-12)).astype(np.int64)
    at = stepping.BallState(theta, x.y, x.h, rigid_body.velocities(x, p))
    given = p.m, p.r, p.R, p.j, p.mu, p.eta, p.g, settings.restitution, p.fluid_torque
    return (
        stepping.Ball(at, NOTHING, NOTHING, int(Case.NN), 0.0, 0, 0.0),
        stepping.Stretches(knots[:-1], length / steps, steps, np.isin(knots[1:], times)),
        stepping.FlowArrays(flow.start, flow.value, flow.slope, flow.waves),
        stepping.Constants(drag.law(p), *map(float, given)),  # an integer would be compiled for itself
    )


def _record_samples(samples: list[tuple[float, stepping.Ball, float]], p: Parameters, recorder: Recorder) -> None:
    times, balls, steps = zip(*samples, strict=True)
    theta, case, work = (np.array(each) for each in zip(*((b.at.theta, b.case, b.work) for b in balls), strict=True))
    states = np.array([rigid_body.state(ball.at.y, ball.at.h, ball.at.u, p) for ball in balls])
    forces = np.array([ball.P for ball in balls]) / np.array(steps)[:, None]
    recorder.add(np.array(times), theta, states, forces, case, work)
