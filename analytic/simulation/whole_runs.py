"""`hybrid.run_through_flow` and all that it calls, compiled with the steps of `solvers`."""

from __future__ import annotations

import sys

from analytic.mechanics import contact_problem, drag, rigid_body
from analytic.simulation import charts, compiling, equations, hybrid, integrator, solvers, transitions
from analytic.simulation.hybrid import Record
from analytic.simulation.integrator import Stretch
from analytic.simulation.motion import Moment


@compiling.in_place_of(hybrid.keep_samples)
def _keep_samples(of: Stretch, at: Moment, taken: int, run: Record) -> float:
    """`hybrid.keep_samples` in a form that numba compiles."""
    near = at.theta
    for row in range(run.taken[0], taken):
        m = hybrid._with_nearest_azimuth(charts.moment(run.times[row], of.samples[row], at, of.k), of.k, near)
        near = m.theta
        hybrid._keep_sample(m, of.k, run)
    return near


compiling.in_place_of(integrator.stretch)(solvers.stretch)
TEXT = ()
go_through = compiling.compiled(
    compiling.register(
        drag, rigid_body, contact_problem, equations, transitions, charts, integrator, solvers, hybrid,
        sys.modules[__name__],
    )
)(hybrid.run_through_flow)  # fmt: skip
