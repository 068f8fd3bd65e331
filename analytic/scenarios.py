"""Trajectories that the paper tells of but does not compute: slip perturbations, hysteresis, unloading.

Each returns ordinary trajectories, to be stored and drawn.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from analytic import bifurcation, simulation, stationary
from model import Case, Flow, InputError, Parameters, Trajectory
from model.arrays import Array


def slip_perturbation(
    p: Parameters, slip: float = 1.0, beta: float = 0.9, height: float = 1.0, t_end: float = 0.1
) -> Trajectory:
    """The stationary orbit of NR, pushed into NS by a slip of `slip` rad/s along beta: Figs. 4 and 5.

    For omega_0 > sqrt(g/(eta R)) (61) slip dies out and the ball returns to NR (Fig. 4), else it grows (Fig. 5).
    `height` in m keeps it clear of the floor, which Figs. 4 and 5 leave out.
    """
    x = stationary.solution(p, Case.NR, formal=True).x.copy()
    x[0] = height
    x[4], x[5] = slip * math.sin(beta), slip * math.cos(beta)
    return simulation.simulate(p, x, t_end, sample_interval=t_end / 10_000)


def hysteresis(p: Parameters, levels: Sequence[float] | Array | None = None, hold: float = 40.0) -> Trajectory:
    """omega_0 up and down again in steps, each held: the arrows in the left panel of Fig. 13 (eta < j).

    Held levels instead of a ramp, since the fold at omega_04 slows down without bound. By default from below omega_01
    to above omega_04 and back. Raises `InputError` if there is no fold.
    """
    limits = bifurcation.thresholds(p)
    if levels is None:
        if not np.isfinite(limits.omega_04):
            raise InputError(f"eta = {p.eta:g} has no fold: hysteresis of this kind needs eta_cr < eta < j")
        up = np.linspace(0.8 * limits.omega_01, 1.1 * limits.omega_04, 16)
        levels = np.concatenate([up, up[-2::-1]])
    flow = Flow.staircase([float(level) for level in levels], hold)
    start = [0.0, 0.0, float(levels[0]), 0.0, 0.0, 0.0]
    return simulation.simulate(p, start, hold * len(levels), flow, sample_interval=hold / 100)


def unloading(p: Parameters, hold: float = 20.0, height: float = 0.02) -> Trajectory:
    """omega_0 lowered in steps through omega_02 with the ball riding the wall: the black dot of Fig. 13 (eta > j).

    NR is left for NS, the ball falls, hits the floor, and ends in RR: the transients and impacts of section 5.3.
    """
    limit = bifurcation.thresholds(p).omega_02
    levels = limit * np.array([1.2, 1.1, 1.02, 0.98])
    x = stationary.solution(p.replace(omega_0=float(levels[0])), Case.NR).x.copy()
    x[0] = height
    return simulation.simulate(
        p, x, hold * len(levels), Flow.staircase(levels.tolist(), hold), sample_interval=hold / 4000
    )
