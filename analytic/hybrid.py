"""Event-driven simulation: each case by its own equations, from one change of case to the next.

Within a case `integrator` follows the coordinates of `charts` (RR is known in closed form) up to the guard that turns
negative first, and `transitions` says how to go on.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass, field, fields, replace
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from analytic import charts, dynamics, rolling_forces, transitions, two_point_rolling
from analytic.integrator import StalledError, Stretch
from analytic.motion import Fluid, Moment, Path
from analytic.records import REPORT_EVERY, Event, Recorder
from analytic.rigid_body import NOTHING, Six
from analytic.settings import Settings
from model import Case, Contact, Flow, Parameters
from model.arrays import Array

MAX_EVENTS_AT_ONCE = 100
"""Changes of case without any progress in time after which a run is given up."""
ANY = "the case changes"
CHATTER = {"RR ends": (10, 1e-4), ANY: (1000, 0.05)}
"""How often within what time, in natural units, is too often. A ball that hops (restitution) may change more often."""


def run(x0: list[float], theta_0: float, p: Parameters, flow: Flow, settings: Settings, recorder: Recorder) -> None:
    """Simulate from state x0 and record; the contract of `simulation.simulate`.

    Raises
    ------
    StalledError, NotConvergedError
        If the integrator, the contact problem or the sequence of cases gets stuck.
    """
    t_end = float(recorder.times[-1])
    knots = [0.0, *(t for t in flow.start.tolist() if 0 < t < t_end), t_end]
    simulator = _Simulator(p, settings, recorder)
    at, case = Moment(0.0, theta_0, x0), None
    for start, end in pairwise(knots):
        fluid = _piece(flow, start, end)
        if case is None or flow(start) != flow(np.nextafter(start, -1.0)):
            before, (case, at, impulse) = case, simulator.settle(at, fluid)
            if (before is not None and before is not case) or impulse is not NOTHING:
                recorder.events.append(Event(start, case if before is None else before, case, impulse))
        case, at = simulator.advance(case, at, end, fluid)


def _piece(flow: Flow, start: float, end: float) -> Fluid:
    """omega_0 between two knots of the flow, where it is linear, on plain floats."""
    a, middle = float(flow(start)), (start + end) / 2
    slope = (float(flow(middle)) - a) / (middle - start)
    if slope == 0:
        return lambda t: a
    return lambda t: a + slope * (t - start)


@dataclass
class _Simulator:
    p: Parameters
    settings: Settings
    recorder: Recorder
    absolute: float = field(init=False)
    shortest: tuple[float, float] = field(init=False)

    def __post_init__(self) -> None:
        self.absolute = self.settings.rtol / 1e3 if self.settings.atol is None else self.settings.atol
        # A hop that lasts T rises by g T^2/8, which must be well above the tolerance of lengths where it is integrated.
        unit = math.sqrt(self.p.R / self.p.g)
        self.shortest = self.settings.rtol * unit, math.sqrt(8 * self.absolute) * unit

    def advance(self, case: Case, at: Moment, until: float, fluid: Fluid) -> tuple[Case, Moment]:
        """Go on through all events before `until`."""
        at_once = 0
        recent = {what: deque([-math.inf] * count, count) for what, (count, _) in CHATTER.items()}
        while at.time < until:
            start = at.time
            guard, at = self._roll(at, until, fluid) if case is Case.RR else self._follow(case, at, until, fluid)
            if guard:
                before = case
                case, at, impulse = self._react(guard, case, at, fluid)
                self.recorder.events.append(Event(at.time, before, case, impulse))
                self._check_pace(recent, guard, at.time)
            at_once = at_once + 1 if at.time - start <= 1e-14 * until else 0
            if at_once > MAX_EVENTS_AT_ONCE:
                raise StalledError(f"no way on from case {case.name} at state {at.x}")
        return case, at

    def _check_pace(self, recent: dict[str, deque[float]], guard: str, now: float) -> None:
        """Raise `StalledError` if slip or lift sets in and dies out again and again, so that a run would not end."""
        for what, times in recent.items():
            if what == guard or (what == ANY and self.settings.restitution == 0):
                times.append(now)
        for what, (count, within) in CHATTER.items():
            lasted = now - recent[what][0]
            if lasted < within * math.sqrt(self.p.R / self.p.g):
                raise StalledError(
                    f"{what} {count} times in {lasted:.3g} s (leave_rolling = {self.settings.leave_rolling!r}): "
                    "slip or lift sets in and dies out at once, again and again"
                )

    def settle(self, at: Moment, fluid: Fluid) -> tuple[Case, Moment, Six]:
        """Collide if the ball moves into something it touches, then find the case."""
        x = at.x
        impulse: Six = NOTHING
        if (x[0] == 0 and x[1] < 0) or (x[6] == 0 and x[7] < 0):
            impact = transitions.collide(at, self.p, fluid(at.time), self.settings.restitution, self.shortest)
            at, impulse = impact.after, impact.impulse
        case, at = transitions.choose(at, self.p, fluid(at.time), self.settings.leave_rolling)
        return case, at, impulse

    def _react(self, guard: str, case: Case, at: Moment, fluid: Fluid) -> tuple[Case, Moment, Six]:
        """What follows when a guard has fired."""
        x = list(at.x)
        at = replace(at, x=x)
        match guard:
            case "A slips":
                A_x, _, A_z = self._forces_at(case, at, fluid)[:3]
                return Case.of(Contact.S, case.B), replace(at, alpha=math.atan2(A_z, -A_x)), NOTHING
            case "B slips":
                _, B_y, B_z = self._forces_at(case, at, fluid)[3:]
                return Case.of(case.A, Contact.S), replace(at, beta=math.atan2(-B_z, B_y)), NOTHING
            case "A lifts":
                return Case.of(Contact.N, case.B), replace(at, alpha=math.nan), NOTHING
            case "B opens":
                return Case.of(case.A, Contact.N), replace(at, beta=math.nan), NOTHING
            case "RR ends":
                return *two_point_rolling.leave(at, self.p, fluid(at.time)), NOTHING
            case "A sticks":
                x[3], x[5] = 0.0, -(x[7] + x[1]) / self.p.r
                if case.B is Contact.S and abs(x[4]) <= self._still:
                    x[4] = 0.0
            case "B sticks":
                x[4] = x[5] = 0.0
                if case.A is Contact.S and abs(x[3]) <= self._still:
                    x[3] = 0.0
            case "A lands":
                x[0] = 0.0
            case "B lands":
                x[6] = 0.0
        return self.settle(at, fluid)

    @property
    def _still(self) -> float:
        """Slip in rad s-1 that counts as zero where the other contact has just stuck."""
        return 10 * self.settings.rtol * math.sqrt(self.p.g * self.p.R) / self.p.r

    def _forces_at(self, case: Case, at: Moment, fluid: Fluid) -> Six:
        path = Path(*(np.array([v]) for v in (at.time, at.theta, at.x, at.alpha, at.beta, at.work)))
        forces = path_forces(case, path, self.p, np.array([fluid(at.time)]))[0]
        A_x, A_y, A_z, B_x, B_y, B_z = forces.tolist()
        return A_x, A_y, A_z, B_x, B_y, B_z

    def _roll(self, at: Moment, until: float, fluid: Fluid) -> tuple[str | None, Moment]:
        """RR up to its end or `until`."""
        p = self.p
        end = two_point_rolling.end(at, until, p, fluid, self.settings.leave_rolling)
        stop = until if end is None else end
        times = self._samples(at.time, stop)
        path = two_point_rolling.path(np.append(times, stop), at, until, p, fluid)
        self._record(Case.RR, path, np.append(np.full(len(times), True), False), fluid)
        return None if end is None else "RR ends", _moment(path, -1)

    def _follow(self, case: Case, at: Moment, until: float, fluid: Fluid) -> tuple[str | None, Moment]:
        """One case up to the first guard or `until`; samples are recorded even if it is interrupted."""
        motion = charts.chart(case, at, self.p, fluid, self.settings.rtol)
        lands, until = motion.landing <= until, min(until, motion.landing)
        times, states = [at.time], [motion.start]
        sampled, guard = [self.recorder.taken == 0], None
        stretch = Stretch(motion, at.time, until, self.recorder.times, self.settings.rtol, self.absolute)
        hop = self._hop(case, at, fluid)
        try:
            for count, step in enumerate(stretch.steps(hop / 20 if hop < until - at.time else None), 1):
                times += [*step.sample_times, step.time]
                states += [*step.samples, step.z]
                sampled += [True] * len(step.samples) + [False]
                guard = step.guard
                if count % REPORT_EVERY == 0:
                    self.recorder.reached(step.time)
        finally:
            path = motion.path(np.array(times), np.array(states).T)
            self._record(case, path, np.array(sampled), fluid)
        return guard or ("A lands" if lands else None), _moment(path, -1)

    def _hop(self, case: Case, at: Moment, fluid: Fluid) -> float:
        """About how long the ball will be off floor or wall if it is just rebounding from it, s; else inf."""
        x = at.x
        if not ((x[0] == 0 < x[1] and case is not Case.NN) or x[6] == 0 < x[7]):
            return math.inf
        dx = dynamics.newton_euler(case, x, self._forces_at(case, at, fluid), self.p, fluid(at.time))
        hops = [2 * v / -a for gap, v, a in ((x[0], x[1], dx[1]), (x[6], x[7], dx[7])) if gap == 0 < v and a < 0]
        return min(hops, default=math.inf)

    def _samples(self, start: float, stop: float) -> Array:
        """Times to sample within (start, stop], and the very first."""
        times = self.recorder.times
        first = int(np.searchsorted(times, start, side="right")) if self.recorder.taken else 0
        return times[first : int(np.searchsorted(times, stop, side="right"))]

    def _record(self, case: Case, path: Path, wanted: npt.NDArray[np.bool_], fluid: Fluid) -> None:
        if not np.any(wanted):
            self.recorder.reached(float(path.time[-1]))
            return
        path = Path(*(getattr(path, f.name)[wanted] for f in fields(Path)))
        omega_0 = np.array([fluid(t) for t in path.time.tolist()])
        forces = path_forces(case, path, self.p, omega_0)
        self.recorder.add(path.time, path.theta, path.x, forces, case, path.work)


def path_forces(case: Case, path: Path, p: Parameters, omega_0: Array) -> Array:
    """Contact forces along a path, shape (n, 6), N; in RR those of least friction utilisation."""
    x = list(path.x.T)
    if case is Case.RR:
        B_y = rolling_forces.least_utilisation(x[2], p, omega_0).B_y
        jammed = rolling_forces.admissible_interval(x[2], p, omega_0)[1]
        f = dynamics.rolling_family(x[2], p, omega_0, np.where(np.isfinite(B_y), B_y, jammed))
    else:
        slip_A = (np.sin(path.alpha), np.cos(path.alpha)) if case.A is Contact.S else None
        slip_B = (np.sin(path.beta), np.cos(path.beta)) if case.B is Contact.S else None
        f = dynamics.forces(case, x, p, omega_0, slip_A, slip_B)
    return np.stack(np.broadcast_arrays(*f, path.time)[:6], axis=-1)


def _moment(path: Path, k: int) -> Moment:
    return Moment(*(getattr(path, f.name)[k].tolist() for f in fields(Path)))
