"""What runs at held flows say: whether a ball goes on as it began, settles, or leaves floor or
wall."""

from __future__ import annotations

import math
from enum import StrEnum

import numpy as np

from compare.kit.brackets import Answer, Bracket
from compare.kit.engines import sliding_speeds
from compare.kit.settling import PRESSES, physical_case
from compare.kit.statistics import settled_case, tail
from model import Case, Contact, Trajectory
from model.arrays import Array

SLIPPING_SPEED = 3e-8
"""Slip speed, divided by sqrt(g R), that counts as slip: contacts are solved to 1e-12, and a ball
whose friction falls short by a millionth reaches it within a run."""
LAGS = 1e-3
"""Relative lag behind the fluid from which on a ball that has slipped may have to slip again."""
CREEPS = 100.0
"""Slip, in units of that, at which a ball may creep while it comes to rest jammed between floor and
wall."""


class Passage(StrEnum):
    """A flow up to which, or from which on, a ball moves in some case."""

    RR_ENDS = "rolling"
    NS_ENDS = "sinking"
    SS_ENDS = "slipping"
    NR_BEGINS = "riding"
    RR_RETURNS = "leaning"
    FOLD = "fold"


def lifts(end: Bracket) -> bool:
    """Whether rolling at both points ends by lifting off the floor, not by slip, from the runs at
    its end.

    Just below omega_03 the floor carries as little, but rolling may end there by slip at both
    contacts, which is as fast at one as at the other, and lasts. A ball that lifts off slips on the
    floor alone before, or rolls on the wall in the end."""
    if (run := end.runs[1]) is None:
        return False
    p = run.header.parameters
    unloaded = bool(run.force_A[tail(run), 1].mean() < PRESSES * p.m * p.g)
    lifted = [case.A is Contact.N for case in run.cases]
    on = slice(0, lifted.index(True) if any(lifted) else None)
    floor, wall = sliding_speeds(run)
    return unloaded and bool(
        slip(wall, run) < 1 or wall[on].max(initial=0.0) <= floor[on].max(initial=0.0) / 2
    )


def slip(speeds: Array, run: Trajectory, share: float = 0.1) -> float:
    """Largest of the slip speeds (n,) in the last part of a run, in units of `SLIPPING_SPEED`
    sqrt(g R)."""
    p = run.header.parameters
    return float(speeds[tail(run, share)].max() / (SLIPPING_SPEED * math.sqrt(p.g * p.R)))


def stays_rolling(run: Trajectory) -> bool | None:
    """Whether a ball that rolls on both neither slips on the floor nor leaves it; None while slip
    still dies out.

    None, too, while a ball that has slipped lags behind the fluid: it rolls more slowly than it is
    asked about; and while it touches the floor now and then: where friction alone could hold it, it
    may come to rest there. Slip dies out that has fallen below 0.6 of what it was in the second
    half (moved from 0.9 after results had been seen); slip below a hundredth of what counts is
    none. On a floor that carries next to nothing slip up to `CREEPS` shows nothing (chosen after a
    set with mu eta = 0.8 had crept so below its threshold)."""
    if not presses(run):
        return None if np.any(run.force_A[tail(run), 1] > 0) else False
    speeds, _ = sliding_speeds(run)
    last, before = slip(speeds, run), slip(speeds[len(speeds) // 2 :], run, share=1.0)
    if last >= 1:
        m, g = run.header.parameters.m, run.header.parameters.g
        creeps = last < CREEPS and run.force_A[tail(run), 1].mean() < PRESSES * m * g
        return False if last > 0.6 * before and not creeps else None
    lag = 1 - run.omega_c[-1] / run.omega_0[-1]
    caught_up = lag < LAGS or slip(speeds, run, share=1.0) < 1
    return True if last < 1e-2 and caught_up else None


def may_settle(run: Trajectory) -> bool | None:
    """Whether a ball settles on the floor, judged after 10/c (None if not clear yet) or after 40/c
    (True if not clear).

    Other motions still die out in a short run: with the usual share of change a ball just above a
    fold seemed to settle on some sets. (A tenth of it was chosen after that had been seen; a
    hundredth gives the same brackets.)"""
    brief = run.time[-1] * run.header.parameters.c < 20
    return settles(run, 0.02) if brief else settles(run) is not False


def presses(run: Trajectory) -> bool:
    """Whether the floor carries something all the time in the end."""
    return bool(np.all(run.force_A[tail(run), 1] > 0))


def settles(run: Trajectory, slowed: float = 0.2) -> bool | None:
    """Whether a ball that slips on the floor comes to rest there, however slowly; None where the
    run is too short.

    In the last tenth its speed must change by less than a share `slowed` of what it does in the
    tenth before the middle. On the way past a fold that it has missed the change falls at most like
    1/time^2, from one to the other to 0.22; after that it rises."""
    if settled_case(run).A is Contact.N or settled_case(run) is Case.SR or not presses(run):
        return False
    middle, last = (abs(float(run.omega_c[k] - run.omega_c[k - 10])) for k in (-51, -1))
    # round-off: at rest
    slowing = last / middle if last > 1e-11 * abs(float(run.omega_c[-1])) and middle > 0 else 0.0
    return False if slowing > 1 else True if slowing < slowed else None


ASKED: dict[Passage, tuple[float, Answer]] = {
    Passage.RR_ENDS: (5, stays_rolling),
    Passage.NS_ENDS: (20, lambda run: physical_case(settled_case(run)) is not Case.NR),
    Passage.SS_ENDS: (10, may_settle),
    Passage.NR_BEGINS: (5, lambda run: slip(sliding_speeds(run)[1], run) > 1),
    Passage.RR_RETURNS: (20, lambda run: presses(run) and settled_case(run) is Case.RR),
    Passage.FOLD: (1.4, settles),
}
"""How long a run takes, in units of 1/c, and what is asked of it: yes below a threshold, no above.

The ball still rolls; the wall doesn't hold it; it settles on the floor, or may; it begins to slip
on the wall; pressed to the floor it rolls on both again; it settles on the floor."""
