"""A swing that lasts although nothing settles, and what strong drag and rough floors do, on sets of their own.

* A ball that swings for ever beside a Hopf point: it slips at both points, and goes round now faster and now slower. It
  is left alone until its turning points repeat.
* Balls in strong drag, followed until drag has had its time: do they go on hopping?
* Floors so rough (mu > 1) that rolling and slipping are both consistent with the forces: rolling on for as long as
  forces allow would lead to a cycle of sticking and slipping that never settles.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping

import numpy as np
from scipy.stats import qmc

from compare.measure.field import constrained
from compare.measure.lab import Lab, coarse_step, time_unit
from compare.measure.record import Measurement, Missing, Records, measurement, state_of
from compare.measure.settling import settle
from compare.measure.trials import Start, Trial, carry_out, finer, left_alone
from compare.statistics import Measured, peaks, top
from model import Case, Parameters, State, Trajectory

SWINGS, SWUNG = 24.0, 4.0
"""Duration of the swing, and the last part of it that is measured, s."""
STRONG_DRAG = {"mu": (0.05, 1.0), "eta": (0.05, 1.0), "j": (0.2, 0.6), "kappa": (2.0, 8.0), "Omega_0": (0.5, 6.0)}
"""The box that the sets with strong drag fill evenly; the rest is as in the reference."""
ROUGH = {
    "rough-floor-1": (1.7222, 0.0388, 0.482, 0.292, 0.1099, 2.635),
    "rough-floor-2": (1.2277, 0.1721, 0.611, 0.154, 0.1198, 2.099),
}
"""mu, eta, j, r/R, kappa, omega_0 sqrt(R/g)."""


def swing(lab: Lab, sets: Mapping[str, Parameters], records: Records) -> Iterator[Measurement | Missing]:
    """Period, mean and size of the swing of omega_c, on a very rough floor.

    With other steps than these the contact of the floor, which carries a hundredth of the weight, comes and goes.
    """
    p = sets["reference"].replace(mu=2.5, eta=0.38, c=1.0, omega_0=24.648)
    x0 = State(omega_c=22.39, slip_x=-0.03, slip_z=0.26).stacked()
    trial = Trial("reference", p, "swing", x0, SWINGS, (60, 80), 12_000)
    (result,) = carry_out(lab, "swing", [trial])
    end = SWINGS - SWUNG
    if isinstance(result, Missing):
        yield result
    elif any(np.any(run.case[run.time > end] != Case.SS) for run in (result.coarse, result.fine)):
        yield Missing("swing", "reference", "the ball does not slip at both points for ever")
    else:
        parts = (result.coarse, end), (result.fine, end), (result.fine, end - SWUNG)
        coarse, fine, before = (_swung(run, since) for run, since in parts)
        conditions = {**state_of(constrained(Case.SS, result.fine.x[-1], p)), "period": fine["swing_period"]}
        for name, value in fine.items():
            sure = finer(Measured(coarse[name], 0.0), Measured(value, abs(value - before[name])))
            yield result.row(lab, name, sure, **conditions)


def _swung(run: Trajectory, start: float) -> dict[str, float]:
    """From the turning points of omega_c in `SWUNG` s after a time."""
    inside = (run.time > start) & (run.time <= start + SWUNG)
    time, omega_c = run.time[inside], run.omega_c[inside]
    (k, late), (low, lower) = peaks(omega_c), peaks(-omega_c)
    at = time[k] + late * (time[1] - time[0])
    size = np.mean(top(omega_c, k, late)) - np.mean(top(omega_c, low, lower))
    theta = np.interp(at[[0, -1]], run.time, run.theta)
    return {
        "swing_period": float((at[-1] - at[0]) / (len(at) - 1)),
        "swing_omega_c": float((theta[1] - theta[0]) / (at[-1] - at[0])),
        "swing_size": float(size),
    }


def calm(lab: Lab, sets: Mapping[str, Parameters], records: Records) -> Iterator[Measurement | Missing]:
    """Whether balls still hop after 60/c of the weakest drag: three of each of 16 sets."""
    reference, rng = sets["reference"], np.random.default_rng(5)
    unit, tasks = time_unit(reference), []
    low, high = zip(*STRONG_DRAG.values(), strict=True)
    for mu, eta, j, kappa, Omega_0 in qmc.scale(qmc.Sobol(len(low), rng=5).random(16), low, high).tolist():
        p = reference.replace(mu=mu, eta=eta, j=j, c=kappa / unit, omega_0=Omega_0 / unit)
        for _ in range(3):
            slips = p.omega_0 * p.R / p.r * rng.uniform(-2, 2, 3)
            x = State(rng.uniform(0, p.R), 0.0, p.omega_0 * rng.uniform(-0.5, 2), *slips)
            tasks.append(lab.task(p, x, 60.0 * unit / STRONG_DRAG["kappa"][0], coarse_step(p) / 4, samples=2000))
    yield from left_alone(lab, "calm", "strong drag", tasks)


def choice(lab: Lab, sets: Mapping[str, Parameters], records: Records) -> Iterator[Measurement | Missing]:
    """Case and omega_c of what a ball settles to from rest, in a flow above omega_01."""
    reference, starts = sets["reference"], []
    unit = math.sqrt(reference.g / reference.R)
    for name, (mu, eta, j, ratio, kappa, Omega_0) in list(ROUGH.items())[: lab.effort("choice.sets")]:
        p = reference.replace(mu=mu, eta=eta, j=j, r=ratio * reference.R, c=kappa * unit, omega_0=Omega_0 * unit)
        starts.append(Start(name, p, "rest", np.zeros(8)))
    for start, settled in zip(starts, settle(lab, starts), strict=True):
        if settled.failure:
            yield Missing("choice", start.set, settled.failure)
            continue
        for quantity, value in (("case", settled.case), ("omega_c", settled.values["omega_c"])):
            yield measurement(lab, "choice", start.set, start.p, quantity, value, [settled.task])
