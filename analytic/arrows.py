"""Every arrow of Fig. 6 at the stationary solutions: does a slight slip grow along it, does the ball lift off?"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from analytic import slip_stability, stationary
from model import Case, Parameters, State
from model.arrays import Array

_ALONG = {(Case.RR, Case.RS): "slip_y", (Case.RR, Case.SR): "slip_x"}
"""The direction of slip; slip_z along the other arrows, where slip begins at the thresholds: (58), (80)."""


@dataclass(frozen=True)
class Arrow:
    """One arrow of Fig. 6 and one direction along it, at a stationary solution of the case it starts from."""

    inner: Case
    outer: Case
    x: Array
    """The stationary solution, shape (8,)."""
    n: Array
    """Unit vector over the eight variables along which the ball leaves: a slip, or v_y where it lifts."""
    growth: float
    """gamma (53): rad s-2 of slip, or m s-2 of lift. Slip or lift along n grows if it is positive, dies out if not."""
    closed: bool
    """Whether floor and wall, where they still touch, press (12); if not, the ball can't slip that way."""

    @property
    def lifts(self) -> bool:
        """Whether this is a dotted arrow: the ball leaves the floor."""
        return (self.inner, self.outer) in slip_stability.LIFT_ARROWS


def stability_along(p: Parameters) -> list[Arrow]:
    """The arrows at p.omega_0 from each stationary solution, its own forces admissible or not, in the order of `Case`.

    Slip: either way along the direction in which it begins. Out of RR these are (67), (74), (82) and (83), out of NR
    (60); out of SR slip along slip_z > 0 grows below omega_02, too. Lift: v_y' of the case without the floor, which is
    0 in SR, the border to NR.
    """
    leaving = []
    for s in stationary.stationary_solutions(p):
        for inner, outer in slip_stability.SLIP_ARROWS:
            if inner is s.case:
                leaving += [_slip(inner, outer, s.x, side, p) for side in (1.0, -1.0)]
        for inner, outer in slip_stability.LIFT_ARROWS:
            if inner is s.case:
                rise = slip_stability.lift_acceleration(inner, outer, s.x, p)
                leaving.append(Arrow(inner, outer, s.x, np.array(State(v_y=1.0)), rise, True))
    return leaving


def _slip(inner: Case, outer: Case, x: Array, side: float, p: Parameters) -> Arrow:
    n = State(**{_ALONG.get((inner, outer), "slip_z"): side})
    within = [getattr(n, name) for name in slip_stability.normals(inner, outer)]
    _, A_y, B_x = slip_stability.slip_rates(inner, outer, x, within, p)
    growth = slip_stability.gamma(inner, outer, x, within, p)
    return Arrow(inner, outer, x, np.array(n), float(growth), bool(A_y >= 0 and B_x >= 0))
