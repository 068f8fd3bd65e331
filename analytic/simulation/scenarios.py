"""Trajectories that the paper describes but does not compute: a pushed orbit on the wall, and unloading."""

from __future__ import annotations

import math

import numpy as np

from analytic.bifurcation import diagram as bifurcation
from analytic.simulation import simulator as simulation
from analytic.stationary import solutions as stationary
from model import Case, Flow, Parameters, Trajectory

HIGH = 1.0
"""Height of a pushed ball, m: clear of the floor, which Figs. 4 and 5 leave out."""
LOW = 0.02
"""Height of a ball from which the flow is taken, m."""


def slip_perturbation(p: Parameters, slip: float, beta: float, t_end: float) -> Trajectory:
    """The stationary orbit of NR, pushed into NS by a slip of `slip` rad/s along beta: Figs. 4 and 5.

    For omega_0 > sqrt(g/(eta R)) (61) slip dies out and the ball returns to NR (Fig. 4), else it grows (Fig. 5).
    """
    orbit = stationary.solution(p, Case.NR, formal=True).state
    x = orbit._replace(y=HIGH, slip_y=slip * math.sin(beta), slip_z=slip * math.cos(beta))
    return simulation.simulate(p, x, t_end, sample_interval=t_end / 10_000)


def unloading(p: Parameters, hold: float) -> Trajectory:
    """omega_0 lowered in steps through omega_02 with the ball riding the wall: the black dot of Fig. 13 (eta > j).

    NR is left for NS, the ball falls, hits the floor, and ends in RR: the transients and impacts of section 5.3.
    """
    limit = bifurcation.thresholds(p).omega_02
    levels = limit * np.array([1.2, 1.1, 1.02, 0.98])
    riding = stationary.solution(p.replace(omega_0=float(levels[0])), Case.NR).state
    flow = Flow.staircase(levels.tolist(), hold)
    return simulation.simulate(p, riding._replace(y=LOW), hold * len(levels), flow, sample_interval=hold / 4000)
