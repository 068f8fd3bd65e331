"""Event-driven simulation: each case by its own equations, from one change of case to the next.

Within a case `integrator` follows the coordinates of `charts` up to the guard that turns negative first (with Stokes'
drag RR is known in closed form), and `transitions` says how to go on.
"""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from analytic.mechanics import dynamics
from analytic.mechanics.rigid_body import NOTHING, Forces
from analytic.simulation import charts, transitions, two_point_rolling
from analytic.simulation.integrator import StalledError, Stretch
from analytic.simulation.motion import REPORT_EVERY, Event, Fluid, Moment, Path, Recorder
from analytic.simulation.settings import Settings
from model import Case, Contact, Flow, Parameters, State
from model.arrays import Array, Real
from model.drag import STOKES

_LEAST_JUMP = 1e-12
"""Change of the flow at a knot, relative to the largest flow, above which it is a jump."""
MAX_EVENTS_AT_ONCE = 100
"""Changes of case without any progress in time after which a run is given up."""


def run(x0: State, theta_0: float, p: Parameters, flow: Flow, settings: Settings, recorder: Recorder) -> None:
    """Simulate from state x0 and record; the contract of `simulation.simulate`.

    Raises `StalledError`, `NotConvergedError` if the integrator, the contact problem or the sequence of cases gets
    stuck.
    """
    simulator = _Simulator(p, settings, recorder)
    try:
        simulator.run(Moment(0.0, theta_0, x0), flow)
    finally:
        simulator.hand_over()


class _Simulator:
    def __init__(self, p: Parameters, settings: Settings, recorder: Recorder) -> None:
        self.p, self.settings, self.recorder, self.steps = p, settings, recorder, 0
        self.sampled: list[tuple[Case, Path, Array]] = []
        """Stretches of samples: the case, the path, and omega_0 along it."""
        self.taken = 0
        self.still = 10 * settings.rtol * math.sqrt(p.g * p.R) / p.r
        """Slip in rad s-1 that counts as zero where the other contact has just stuck."""

    def run(self, at: Moment, flow: Flow) -> None:
        """From a moment to the last sample."""
        t_end, events = float(self.recorder.times[-1]), self.recorder.events
        case, at_once = None, 0
        for start, end in pairwise([0.0, *flow.knots(t_end).tolist(), t_end]):
            fluid = Fluid.of(flow, start)
            step = abs(float(flow.line(start) - flow.line(np.nextafter(start, -1.0))))
            if case is None or step > _LEAST_JUMP * np.abs(flow.value).max():
                before, (case, at, impulse) = case, self.settle(at, fluid)
                if (before is not None and before is not case) or impulse is not NOTHING:
                    events.append(Event(start, case if before is None else before, case, impulse))
            while at.time < end:
                since, (guard, at) = at.time, self.follow(case, at, end, fluid)
                if guard:
                    before, (case, at, impulse) = case, self.react(guard, case, at, fluid)
                    events.append(Event(at.time, before, case, impulse))
                at_once = at_once + 1 if at.time - since <= 1e-14 * end else 0
                if at_once > MAX_EVENTS_AT_ONCE:
                    raise StalledError(f"no way on from case {case.name} at state {at.x}")

    def settle(self, at: Moment, fluid: Fluid) -> tuple[Case, Moment, Forces]:
        """Collide if the ball moves into something it touches, then find the case."""
        x, omega_0, impulse = at.x, fluid(at.time), NOTHING
        if (x.y == 0 and x.v_y < 0) or (x.h == 0 and x.v_h < 0):
            at, impulse = transitions.collide(at, self.p, omega_0, self.settings.restitution, self.settings.rtol)
        return *transitions.choose(at, self.p, omega_0, self.settings.leave_rolling), impulse

    def react(self, guard: str, case: Case, at: Moment, fluid: Fluid) -> tuple[Case, Moment, Forces]:
        """What follows when a guard has fired."""
        x = at.x
        match guard:
            case "A slips":
                f = self._forces_at(case, at, fluid)
                return Case.of(Contact.S, case.B), at._replace(alpha=math.atan2(f.A_z, -f.A_x)), NOTHING
            case "B slips":
                f = self._forces_at(case, at, fluid)
                return Case.of(case.A, Contact.S), at._replace(beta=math.atan2(-f.B_z, f.B_y)), NOTHING
            case "A lifts":
                return Case.of(Contact.N, case.B), at._replace(alpha=math.nan), NOTHING
            case "B opens":
                return Case.of(case.A, Contact.N), at._replace(beta=math.nan), NOTHING
            case "RR ends":
                return *transitions.leave(at, self.p, fluid(at.time)), NOTHING
            case "A sticks":
                x = x._replace(slip_x=0.0, slip_z=-(x.v_h + x.v_y) / self.p.r)
                if case.B is Contact.S and abs(x.slip_y) <= self.still:
                    x = x._replace(slip_y=0.0)
            case "B sticks":
                x = x._replace(slip_y=0.0, slip_z=0.0)
                if case.A is Contact.S and abs(x.slip_x) <= self.still:
                    x = x._replace(slip_x=0.0)
            case "A lands":
                x = x._replace(y=0.0)
            case "B lands":
                x = x._replace(h=0.0)
        return self.settle(at._replace(x=x), fluid)

    def _forces_at(self, case: Case, at: Moment, fluid: Fluid) -> Forces:
        return Forces(*path_forces(case, at, self.p, fluid(at.time)).tolist())

    def follow(self, case: Case, at: Moment, until: float, fluid: Fluid) -> tuple[str | None, Moment]:
        """One case up to the first guard or `until`; samples are recorded even if it is interrupted."""
        p, wanted = self.p, self.recorder.times
        if case is Case.RR and p.drag == STOKES:
            end = two_point_rolling.end(at, until, p, fluid, self.settings.leave_rolling)
            stop, first = until if end is None else end, not self.taken
            times = wanted[slice(*np.searchsorted(wanted, [-1.0 if first else at.time, stop], side="right"))]
            path = two_point_rolling.path(np.append(times, stop), at, p, fluid)
            self._keep(case, path, np.arange(len(times) + 1) < len(times), fluid)
            return None if end is None else "RR ends", _last(path)
        motion = charts.chart(case, at, p, fluid, self.settings.rtol, self.settings.leave_rolling)
        lands, until = motion.landing <= until, min(until, motion.landing)
        moments: list[Array | list[float]] = [[at.time]]
        states: list[Array | list[list[float]]] = [[motion.start]]
        sampled, guard = [self.taken == 0], None
        stretch = Stretch(motion, at.time, until, wanted, self.settings.rtol, not (fluid.slope or fluid.waves))
        x, hop = at.x, math.inf
        if (x.y == 0 < x.v_y and motion.landing == math.inf) or x.h == 0 < x.v_h:  # it is just rebounding
            dx = dynamics.newton_euler(case, x, self._forces_at(case, at, fluid), p, fluid(at.time))
            hops = ((x.y, x.v_y, dx.v_y), (x.h, x.v_h, dx.v_h))
            hop = min((2 * v / -a for gap, v, a in hops if gap == 0 < v and a < 0), default=math.inf)
        try:
            for step in stretch.steps(hop / 20 if hop < until - at.time else None):
                if len(step.samples):
                    moments.append(step.sample_times)
                    states.append(step.samples)
                moments.append([step.time])
                states.append([step.z])
                sampled += [True] * len(step.samples) + [False]
                guard = step.guard
                self.steps += step.stands_for
                if self.steps >= REPORT_EVERY:
                    self.steps = 0
                    self.recorder.reached(step.time)
        finally:
            path = motion.path(np.concatenate(moments), np.concatenate(states).T)
            self._keep(case, path, np.array(sampled), fluid)
        return guard or ("A lands" if lands else None), _last(path)

    def _keep(self, case: Case, path: Path, wanted: npt.NDArray[np.bool_], fluid: Fluid) -> None:
        if np.any(wanted):
            kept = Path(*(column[wanted] for column in path))
            self.sampled.append((case, kept, np.asarray(fluid(kept.time))))
            self.taken += len(kept.time)
        self.recorder.reached(float(path.time[-1]))

    def hand_over(self) -> None:
        """Record all samples: forces of one case after the other, since that is quicker than of one path."""
        if not self.sampled:
            return
        cases, paths, fluids = zip(*self.sampled, strict=True)
        path, omega_0 = Path(*map(np.concatenate, zip(*paths, strict=True))), np.concatenate(fluids)
        case, forces = np.repeat(cases, [len(each.time) for each in paths]), np.empty((len(omega_0), 6))
        for each in set(cases):
            here = case == each
            forces[here] = path_forces(each, Path(*(column[here] for column in path)), self.p, omega_0[here])
        self.recorder.add(path.time, path.theta, path.x, forces, case, path.work)


def path_forces(case: Case, path: Path | Moment, p: Parameters, omega_0: Real) -> Array:
    """Contact forces along a path, shape (n, 6), or at a moment, (6,), N; in RR those of least utilisation."""
    slip_A = (np.sin(path.alpha), np.cos(path.alpha)) if case.A is Contact.S else None
    slip_B = (np.sin(path.beta), np.cos(path.beta)) if case.B is Contact.S else None
    f = dynamics.forces(case, State.of(path.x), p, omega_0, slip_A, slip_B)
    return np.stack(np.broadcast_arrays(*f, path.time)[:6], axis=-1)


def _last(path: Path) -> Moment:
    at = Moment(*(column[-1].tolist() for column in path))
    return at._replace(x=State(*at.x))
