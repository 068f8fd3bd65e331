"""The thresholds of the bifurcation diagram, measured with MuJoCo alone.

Nothing here knows where the thresholds should be. A grid of held omega_0, approached from rest and from above, shows
between which values the case of the settled motion changes; bisection narrows each change down; and an order parameter
that vanishes at the threshold, measured in settled runs on one side of it, is extrapolated to zero:

* omega_01, end of rolling on both (RR) towards slipping: slip_z of the slipping states above it;
* omega_02, start of the state without floor contact (NR): the friction it leaves unused, eta B_x - B_y, above it;
* omega_03, end of RR by lift-off: A_x + A_y below it, the force of the floor that is the same however the two contacts
  share the load (by the balances of moment about B and of vertical force, it is what gravity leaves);
* omega_04, fold of the slipping branch: the branch's omega_0 as a function of slip_x has its maximum there.

Stationary states don't depend on the time step (docs/mujoco-settings.md), so the runs can take large ones.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mjsim.contact_settings import ContactSettings
from mjsim.engine import simulate_many
from mjsim.measurement import Measured, window_mean
from model import Case, InputError, Parameters, Trajectory
from model.arrays import Array

_GRID = 33
_ROUND = 9
"""Values of omega_0 in the grid, and in each round of bisection."""
_NARROW = 3e-3
"""Relative width to which a change of case is bracketed before extrapolating."""
_POINTS: Array = np.geomspace(1e-3, 6.4e-2, 7)
"""Relative distances from the bracket at which order parameters are measured."""
_ABSENT = Measured(math.nan, math.nan)


@dataclass(frozen=True)
class Thresholds:
    """Measured thresholds, rad s-1; nan where the change of case was not found."""

    omega_01: Measured
    omega_02: Measured
    omega_03: Measured
    omega_04: Measured


@dataclass(frozen=True)
class Hold:
    """How long, and with what step, each omega_0 is held."""

    p: Parameters
    time: float
    """s."""
    settings: ContactSettings

    def run(self, omegas: Sequence[float] | Array, starts: Sequence[Array]) -> list[Trajectory]:
        """Runs at constant omega_0, all of them at once."""
        sets = [self.p.replace(omega_0=float(omega)) for omega in omegas]
        return simulate_many(sets, starts, self.time, settings=self.settings, sample_interval=self.time / 400)


def measure(p: Parameters, omega_max: float, hold: float | None = None, timestep: float | None = None) -> Thresholds:
    """Measure all thresholds below `omega_max` (rad s-1).

    `hold` is how long each omega_0 is held, s, 100/c if None; `timestep` s, sqrt(R/g)/25 if None. Raises `InputError`
    if c = 0, where nothing settles.
    """
    if p.c == 0:
        raise InputError("c = 0 s-1: without drag no motion settles, and no threshold can be measured")
    settings = ContactSettings.for_problem(p.replace(omega_0=omega_max), timestep or math.sqrt(p.R / p.g) / 25)
    holder = Hold(p, hold or 100 / p.c, settings)
    grid = np.linspace(omega_max / _GRID, omega_max, _GRID)
    rising = holder.run(grid, [np.zeros(8)] * _GRID)
    cases = [_case(run) for run in rising]
    omega_01, omega_03, omega_04 = _ABSENT, _ABSENT, _ABSENT
    for k in range(_GRID - 1):
        before, after = cases[k], cases[k + 1]
        if before == after:
            continue
        low, high = _bracket(holder, grid[k], grid[k + 1], before)
        if before is Case.RR and after is Case.SS:
            omega_01 = _onset(holder, high)
        elif before is Case.RR:
            omega_03 = _lift_off(holder, low)
        elif before is Case.SS and after is Case.NR:
            omega_04 = _fold(holder, low)
    return Thresholds(omega_01, _end_of_wall_rolling(holder, grid, rising), omega_03, omega_04)


def _case(run: Trajectory) -> Case:
    """The settled case, that of most of the last tenth; SR at its own limit is NR."""
    tail = run.case[-len(run.case) // 10 :]
    case = Case(int(np.bincount(tail).argmax()))
    return Case.NR if case is Case.SR else case


def _bracket(hold: Hold, low: float, high: float, before: Case) -> tuple[float, float]:
    """Narrow down where the settled case, from rest, stops being `before`."""
    while high - low > _NARROW * high:
        omegas = np.linspace(low, high, _ROUND + 2)[1:-1]
        runs = hold.run(omegas, [np.zeros(8)] * _ROUND)
        same = [_case(run) is before for run in runs]
        last = same.index(False) if False in same else _ROUND
        low, high = ([low, *omegas, high][last], [low, *omegas, high][last + 1])
    return float(low), float(high)


def _settled(hold: Hold, omegas: Array, starts: Sequence[Array]) -> list[Trajectory]:
    """Last tenths of runs that are continued once, so that slow modes near a threshold die out."""
    first = hold.run(omegas, starts)
    return hold.run(omegas, [run.x[-1] for run in first])


def _onset(hold: Hold, above: float) -> Measured:
    omegas = above * (1 + _POINTS)
    runs = _settled(hold, omegas, [np.zeros(8)] * len(omegas))
    return _root(omegas, [_tail(run, run.slip_z) for run in runs])


def _lift_off(hold: Hold, below: float) -> Measured:
    omegas = below * (1 - _POINTS)
    runs = _settled(hold, omegas, [np.zeros(8)] * len(omegas))
    return _root(omegas, [_tail(run, run.force_A[:, 0] + run.force_A[:, 1]) for run in runs])


def _end_of_wall_rolling(hold: Hold, grid: Array, rising: Sequence[Trajectory]) -> Measured:
    """From NR states that slower and slower fluid still holds, high over a floor that would catch a ball that bobs."""
    found = [k for k, run in enumerate(rising) if _case(run) is Case.NR]
    if not found:
        return _ABSENT
    lowest, x = float(grid[found[0]]), rising[found[0]].x[-1]
    x[0] = hold.p.R
    brief = dataclasses.replace(hold, time=hold.time / 4)
    while True:
        # Down by a hundredth at a time, from a state at rest: a larger jump would make the wall slip.
        lower = lowest * 0.99
        run = brief.run([lower], [_at(x, lower)])[0]
        if _case(run) is not Case.NR:
            break
        lowest, x = lower, run.x[-1]
    omegas = lowest * (1 + _POINTS)
    runs = _settled(hold, omegas, [_at(x, omega) for omega in omegas])
    eta = hold.p.eta
    return _root(omegas, [_tail(run, eta * run.force_B[:, 0] - run.force_B[:, 1]) for run in runs])


def _at(x: Array, omega: float) -> Array:
    moved = x.copy()
    moved[2] = omega
    return moved


def _fold(hold: Hold, below: float) -> Measured:
    omegas = below * (1 - _POINTS)
    runs = _settled(hold, omegas, [np.zeros(8)] * len(omegas))
    slips = np.array([_tail(run, run.slip_x).value for run in runs])
    scale = np.abs(slips).max()
    return _best([_maximum(slips[:n] / scale, omegas[:n], n - 2) for n in range(5, len(omegas) + 1)])


def _maximum(x: Array, omegas: Array, degree: int) -> float:
    """Maximum of the polynomial through omega_0(x), nearest to the first point."""
    fit = np.polynomial.Polynomial.fit(x, omegas, degree)
    roots = [root.real for root in fit.deriv().roots() if abs(root.imag) < 1e-9]
    return float(fit(min(roots, key=lambda root: abs(root - x[0])))) if roots else math.nan


def _tail(run: Trajectory, values: Array) -> Measured:
    first = -len(run.time) // 10
    return window_mean(run.time[first:], values[first:])


def _root(omegas: Array, parameter: Sequence[Measured]) -> Measured:
    """Where the order parameter, as polynomials in omega_0 of rising degree, vanishes nearest to the first point."""
    values = np.array([m.value for m in parameter])
    noise = parameter[0].uncertainty * abs(float(omegas[1] - omegas[0]) / float(values[1] - values[0]))
    best = _best([_nearest_root(omegas[:n], values[:n], n - 2) for n in range(3, len(omegas) + 1)])
    return dataclasses.replace(best, uncertainty=math.hypot(best.uncertainty, noise))


def _nearest_root(omegas: Array, values: Array, degree: int) -> float:
    fit = np.polynomial.Polynomial.fit(omegas, values, degree)
    roots = fit.roots()
    real = roots.real[np.abs(roots.imag) <= 1e-9 * np.abs(roots)]
    return float(real[np.argmin(np.abs(real - omegas[0]))]) if len(real) else math.nan


def _best(estimates: Sequence[float]) -> Measured:
    """Of estimates of rising order the one that differs least from the one before.

    That difference and the smaller of those beside it say how certain it is: too low an order may be far off.
    """
    changes = np.abs(np.diff(estimates))
    if np.all(np.isnan(changes)):
        return _ABSENT
    k = int(np.nanargmin(changes))
    beside = np.concatenate([changes[max(0, k - 1) : k], changes[k + 1 : k + 2]])
    return Measured(float(estimates[k + 1]), float(changes[k] + np.fmin.reduce(beside, initial=np.inf)))
