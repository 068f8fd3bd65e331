"""`hybrid.go_through` and all that it calls, compiled with the steps of `solvers`."""

from __future__ import annotations

import sys

from analytic.mechanics import contact_problem, drag, rigid_body
from analytic.simulation import charts, compiling, equations, hybrid, integrator, solvers, transitions
from analytic.simulation.hybrid import Kept
from analytic.simulation.integrator import Stretch
from analytic.simulation.motion import Moment


@compiling.in_place_of(hybrid.keep)
def _keep(of: Stretch, at: Moment, taken: int, run: Kept) -> float:
    near = at.theta
    for row in range(run.taken[0], taken):
        m = hybrid._turned(charts.moment(run.times[row], of.samples[row], at, of.k), of.k, near)
        near = m.theta
        hybrid._sample(m, of.k, run)
    return near


compiling.in_place_of(integrator.stretch)(solvers.stretch)
TEXT = ()
go_through = compiling.compiled(
    compiling.read(
        drag, rigid_body, contact_problem, equations, transitions, charts, integrator, solvers, hybrid,
        sys.modules[__name__],
    )
)(hybrid.go_through)  # fmt: skip
