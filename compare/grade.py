"""A score card for contact settings: what a ball that rolls and slips does under them, and what it should do.

The settings run as they are in the study's scene, driven by its drag and wall, but without its corrections. Every
number stands against closed-form theory or the event-driven simulation, and beside what other settings give.
"""

from __future__ import annotations

import dataclasses
import functools
import math
import statistics
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt
from rich import box
from rich.table import Table
from rich.text import Text

import analytic
from compare import page
from compare.native import Native, Touch
from compare.stationary import slowest
from mjsim import ContactSettings, recorder, scene
from mjsim.free import Free
from mjsim.stepping import Single, Stepper
from model import Case, Contact, Parameters
from model.kinematics import full_state, slip_speeds

SLIDES = 0.01
"""Slip speed, in units of sqrt(g R), from which a contact counts as slipping."""
CARRIES = 0.01
"""Normal force, in units of m g, from which it counts as closed."""
AGREES = 0.9
"""Share of samples in the right case from which a case counts as reproduced."""
LASTS = 7.0
"""How long stationary states are held, in units of their slowest time constant: exp(-7) of an error is missing."""
WINDOW = 0.5
"""Time over which stationary states are averaged, s."""
ONSET = (1.02, 1.05, 1.1)
"""omega_0 at which slip is measured, in units of omega_01, to find by extrapolation where it begins."""
DEPARTURE = np.array([0.0, 0.0, 0.5, 3.0, 2.0, -3.0, 0.0, 0.0])
"""How far from steady slipping the transient starts."""
_HUGE = 1e8
_SPLIT = (recorder.NQ, recorder.NQ + recorder.NV)


@dataclass(frozen=True)
class Contender:
    """Settings under test."""

    name: str
    loop: ContactSettings
    """Settings of the loop round the engine."""
    native: Native | None = None
    """Settings of the engine where they are not those of `loop`."""

    def start(self, p: Parameters, x0: npt.ArrayLike) -> Stepper:
        """A simulation from a state."""
        model = self.native.build(p, self.loop) if self.native else scene.build(p, self.loop)
        x = full_state(np.asarray(x0, dtype=float))
        if self.loop.coordinates == "free":
            return Free([model], [p], self.loop, [x], 0.0)
        return Single(model, p, self.loop, recorder.joint_state(x, 0.0, p), p.omega_0)


@dataclass(frozen=True)
class Stationary:
    """A stationary state held by the engine."""

    name: str
    """Case and omega_0."""
    omega_c: float
    """Relative error of omega_c; nan if the run diverged."""
    slip: float
    """Largest error of a component of slip, times r, m s-1."""
    chatter: float
    """Largest share of steps in which a contact that should carry a force carries none."""
    creep: float
    """Largest mean slip speed at a contact that should roll, m s-1; 0 if none should."""


@dataclass(frozen=True)
class Column:
    """Everything measured of one contender."""

    name: str
    timestep: float
    cases: dict[str, float]
    """By case: share of samples in the case in which the event-driven simulation is."""
    stationary: tuple[Stationary, ...]
    creep: float
    """Slip speed of the contacts in steady rolling, m s-1."""
    omega_01: float
    """Relative error of the threshold where rolling is lost; nan if slip doesn't begin near it."""
    transient: float
    """Relative rms error of omega_c over 2 s of approach to steady slipping; nan if the run diverged."""
    cost: float
    """Time of a step over that of our defaults."""
    advice: tuple[str, ...] = field(default=())

    @property
    def reproduced(self) -> list[str]:
        """The cases that are reproduced."""
        return [name for name, share in self.cases.items() if share >= AGREES]

    @property
    def cost_of_a_second(self) -> float:
        """Time of a simulated second over that of our defaults."""
        return self.cost * ContactSettings.timestep / self.timestep

    def to_mapping(self) -> dict[str, Any]:
        """JSON-able data; None for what was not found."""
        plain = {
            **dataclasses.asdict(self), "reproduced": self.reproduced, "cost_of_a_second": self.cost_of_a_second
        }  # fmt: skip
        return {name: _without_nan(value) for name, value in plain.items()}


def _without_nan(value: Any) -> Any:
    if isinstance(value, float):
        return None if math.isnan(value) else value
    if isinstance(value, dict):
        return {name: _without_nan(part) for name, part in value.items()}
    return [_without_nan(part) for part in value] if isinstance(value, (list, tuple)) else value


OURS = Contender("dualball", ContactSettings())
PLAIN = Contender("MuJoCo", Native().loop(), Native())
NEWCOMER = Contender("newcomer", Native().loop(coordinates="free", wall="prism"), Native())
"""What a newcomer might write: MuJoCo's defaults, a free ball, and a wall of flat facets."""


def grade(
    yours: Native | None, others: Sequence[Contender] = (OURS, PLAIN, NEWCOMER),
    progress: Callable[[str, int, int], None] = lambda name, done, total: None,
) -> list[Column]:  # fmt: skip
    """Columns of the score card: the given settings first, with advice, then the others.

    Raises `InputError` if MuJoCo refuses the settings.
    """
    given = [Contender("yours", yours.loop(), yours)] if yours else []
    contenders = [*given, *others]
    costs = _costs(contenders)
    columns = []
    for k, contender in enumerate(contenders):
        progress(contender.name, k, len(contenders))
        columns.append(_measure(contender, costs[k]))
    if yours:
        columns[0] = dataclasses.replace(columns[0], advice=tuple(advice(yours, columns[0])))
    return columns


def _measure(contender: Contender, cost: float) -> Column:
    reference, rough = (Parameters.named(name) for name in ("reference", "high-wall-friction"))
    held = tuple(
        _stationary(contender, p.replace(omega_0=omega_0), case)
        for p, omega_0, case in (
            (reference, 12.0, Case.RR), (reference, 14.5, Case.SS), (reference, 25.0, Case.SS), (rough, 25.0, Case.NR)
        )
    )  # fmt: skip
    return Column(
        name=contender.name, timestep=contender.loop.timestep, cases=_cases(contender), stationary=held,
        creep=held[0].creep, omega_01=_onset(contender, reference), transient=_transient(contender, reference),
        cost=cost,
    )  # fmt: skip


def _run(
    contender: Contender, p: Parameters, x0: npt.ArrayLike, t_end: float, interval: float, skip: float = 0.0
) -> npt.NDArray[np.void]:
    """Samples of dtype `SAMPLE` from about `skip` to `t_end`, every `interval` s, fewer if the run diverges."""
    settings = contender.loop
    stepper = contender.start(p, x0)
    every = max(1, round(interval / settings.timestep))
    before = round(skip / settings.timestep)
    count = max(6, int((t_end - skip) / (every * settings.timestep)) + 1)
    stepper.advance(np.full((before, 1), p.omega_0))
    raw = np.empty((count, 1, recorder.NQ + recorder.NV + recorder.NSENSOR))
    for row in raw:
        stepper.sample(np.full(1, p.omega_0), row)
        stepper.advance(np.full((every - 1, 1), p.omega_0))
    rows = raw[:, 0]
    with np.errstate(invalid="ignore"):
        rows = rows[np.logical_and.accumulate((np.abs(rows) < _HUGE).all(axis=1))]
    at = (before + every * np.arange(len(rows))) * settings.timestep
    qpos, qvel, sensors = (np.asarray(a, dtype=float) for a in np.split(rows, _SPLIT, axis=1))
    return recorder.samples(at.astype(float), qpos, qvel, sensors, p, settings.lead)


def _target(p: Parameters, case: Case) -> Any:
    """The stable stationary solution of a case."""
    return next(s for s in analytic.stationary_solutions(p) if s.case is case and s.exists and s.stable)


def _lasts(target: Any) -> float:
    return LASTS * slowest(target)


def _stationary(contender: Contender, p: Parameters, case: Case) -> Stationary:
    target = _target(p, case)
    x = target.x.copy()
    x[0] = p.R if case is Case.NR else 0.0
    lasts = _lasts(target)
    block = _run(contender, p, x, lasts + WINDOW, contender.loop.timestep, skip=lasts)
    name = f"{case.name} at {p.omega_0:g}"
    if len(block) * contender.loop.timestep < 0.9 * WINDOW:
        return Stationary(name, math.nan, math.nan, math.nan, math.nan)
    contacts = (("A", case.A), ("B", case.B))
    normal = {"A": block["force_A"][:, 1], "B": block["force_B"][:, 0]}
    loaded = [normal[name] for name, contact in contacts if contact is not Contact.N]
    slips = [
        abs(float(np.mean(block[f"slip_{axis}"])) - float(target.x[k])) * p.r
        for k, axis in ((3, "x"), (4, "y"), (5, "z"))
    ]
    return Stationary(
        name=name,
        omega_c=float(np.mean(block["omega_c"])) / float(target.x[2]) - 1,
        slip=max(slips),
        chatter=max(float(np.mean(force <= 0)) for force in loaded),
        creep=max([float(np.mean(block[f"slip_speed_{c}"])) for c, of in contacts if of is Contact.R], default=0.0),
    )


def _scenarios() -> list[tuple[Case, Parameters, list[float]]]:
    """For each case parameters and a state from which the ball is in it for a while."""
    smooth, rough = (Parameters.named(name) for name in ("reference", "high-wall-friction"))
    slow, fast, high = smooth.replace(omega_0=12.0), smooth.replace(omega_0=25.0), rough.replace(omega_0=25.0)
    riding = _target(high, Case.NR).x
    R = smooth.R
    return [
        (Case.RR, slow, [0, 0, 12.0, 0, 0, 0]),
        (Case.RS, slow, [0, 0, 6.0, 0, -30.0, 0]),
        (Case.RN, slow, [0, 0, 4.0, 0, 0, 0, 0.4 * R, 0]),
        (Case.SR, rough, [0, 0, 8.0, -40.0, 0, 0]),
        (Case.SS, fast, _target(fast, Case.SS).x.tolist()),
        (Case.SN, slow, [0, 0, 4.0, 40.0, 0, 40.0, 0.4 * R, 0]),
        (Case.NR, high, [R, *riding[1:].tolist()]),
        (Case.NS, slow, [R, 0, 12.0, 0, 0, -10.0]),
        (Case.NN, slow, [0.5 * R, 0, 4.0, 5.0, 5.0, 5.0, 0.4 * R, 0]),
    ]


@functools.cache
def _phases() -> list[tuple[Case, Parameters, list[float], float, float]]:
    """The scenarios with the times (s) between which the event-driven simulation is in the case, 1 s at most."""
    found = []
    for case, p, x0 in _scenarios():
        truth = analytic.simulate(p, x0, 1.0, sample_interval=1e-3)
        inside = truth.case == case
        first = int(np.argmax(inside))
        last = first + int(np.argmin(inside[first:])) if not inside[first:].all() else len(inside)
        found.append((case, p, x0, float(truth.time[first]), float(truth.time[last - 1])))
    return found


def _cases(contender: Contender) -> dict[str, float]:
    found = {}
    for case, p, x0, begin, end in _phases():
        interval = max(contender.loop.timestep, (end - begin) / 200)
        block = _run(contender, p, x0, end, interval)
        # The first steps press the ball into a soft contact, and the end may come early: a tenth is left out each.
        margin = 0.1 * (end - begin)
        judged = block[(block["time"] >= begin + margin) & (block["time"] < end - margin)]
        reached = len(block) > 0 and float(block["time"][-1]) >= end - margin
        found[case.name] = float(np.mean(_in_case(judged, case, p))) if reached and len(judged) else 0.0
    return found


def _in_case(block: npt.NDArray[np.void], case: Case, p: Parameters) -> npt.NDArray[np.bool_]:
    """Which samples are in a case, by what moves and what carries; a contact that chatters carries its mean."""
    right = np.ones(len(block), dtype=bool)
    for name, axis, contact in (("A", 1, case.A), ("B", 0, case.B)):
        force = block[f"force_{name}"][:, axis]
        mean = np.convolve(force, np.ones(9) / 9, mode="same") if len(force) >= 9 else force
        closed = mean > CARRIES * p.m * p.g
        slips = block[f"slip_speed_{name}"] > SLIDES * math.sqrt(p.g * p.R)
        right &= ~closed if contact is Contact.N else closed & (slips == (contact is Contact.S))
    return right


def _onset(contender: Contender, p: Parameters) -> float:
    """Relative error of omega_01, from slip_z above it, extrapolated to zero along a parabola."""
    omega_01 = analytic.thresholds(p).omega_01
    slips = []
    for factor in ONSET:
        q = p.replace(omega_0=factor * omega_01)
        target = _target(q, Case.SS)
        block = _run(contender, q, target.x, _lasts(target), 0.01, skip=0.9 * _lasts(target))
        slips.append(float(np.mean(block["slip_z"])) if len(block) else math.nan)
        if not abs(slips[-1] / target.x[5] - 1) < 0.5:
            return math.nan
    # omega_0 as a function of slip, at no slip.
    return float(np.polynomial.Polynomial.fit(slips, ONSET, 2)(0.0)) - 1


def _transient(contender: Contender, p: Parameters) -> float:
    p = p.replace(omega_0=25.0)
    x0 = _target(p, Case.SS).x + DEPARTURE
    block = _run(contender, p, x0, 2.0, max(0.01, contender.loop.timestep))
    truth = analytic.simulate(p, x0, 2.0 + 0.02, sample_interval=0.001)
    if block["time"].max(initial=0.0) < 1.9:
        return math.nan
    error = block["omega_c"] - np.interp(block["time"], truth.time, truth.omega_c)
    return float(np.sqrt(np.mean(error**2)) / truth.omega_c[-1])


def _costs(contenders: Sequence[Contender], steps: int = 1500, repeats: int = 5) -> list[float]:
    """Medians of time per step over that of our defaults, measured in turn."""
    p = Parameters.named("reference").replace(omega_0=25.0)
    x0 = _target(p, Case.SS).x
    steppers = [contender.start(p, x0) for contender in (OURS, *contenders)]
    omega_0 = np.full((steps, 1), p.omega_0)
    times: list[list[float]] = [[] for _ in steppers]
    for _ in range(repeats):
        for stepper, found in zip(steppers, times, strict=True):
            begin = time.process_time()
            stepper.advance(omega_0)
            found.append(time.process_time() - begin)
    ours, *others = (statistics.median(found) for found in times)
    return [1.0 if of is OURS else other / ours for of, other in zip(contenders, others, strict=True)]


def advice(native: Native, column: Column) -> list[str]:
    """What to change and why, from the theory of the contact settings; the most harmful first."""
    p = Parameters.named("reference").replace(omega_0=25.0)
    slipping, rolling = _target(p, Case.SS), _target(p.replace(omega_0=12.0), Case.RR)
    said = []
    if native.integrator == "RK4":
        said.append(
            "integrator RK4 freezes the wall within a step, so that its normal lags behind the ball: use Euler or "
            "implicitfast with a shorter step."
        )
    if native.cone == "pyramidal":
        said.append(
            "cone pyramidal: friction is too weak along the pyramid's edges and not opposed to slip, by up to 29 %, "
            "which shows in every sliding state: use cone elliptic."
        )
    speeds = slip_speeds(slipping.x, p)
    for name, touch, load, friction, speed in (
        ("A (floor)", native.A, slipping.force_A[1], p.mu, speeds[0]),
        ("B (wall)", native.B, slipping.force_B[0], p.eta, speeds[1]),
    ):  # fmt: skip
        said += _of_hovering(native, column, name, touch, float(load) / p.m, friction, float(speed))
    theory = native.theory(native.A, p.g)
    friction_A = float(np.hypot(rolling.force_A[0], rolling.force_A[2])) / p.m
    creep = float(theory.creep_speed(friction_A))
    if creep > 1e-6:
        said.append(
            f"creep: a contact that should roll slips at (1 − d)/d f/(m·impratio·b_f) = {creep:.1e} m/s at A for RR "
            f"at 12 (measured, both contacts: {column.creep:.1e}): raise impratio (now {native.impratio:g}; up to 1e5 "
            "holds with cone elliptic), or shift the surface velocity by the last friction force, as dualball does."
        )
    depth = theory.margin(p.g)
    said.append(
        f"depth: under its weight the ball sinks by {1e6 * depth:.3g} µm, and then rolls on a lever shorter by half "
        f"of that, {depth / (2 * p.r):.1e} of its radius: shorten solref (2 steps are the least), or let the pair's "
        "margin follow the gap, as dualball does; moving the floor does not help."
    )
    for name, touch in (("A", native.A), ("B", native.B)):
        if 0 < touch.solref[0] < 2 * native.timestep:
            said.append(
                f"solref of {name}, {touch.solref[0]:g} s, is shorter than two steps: the engine silently takes "
                f"{2 * native.timestep:g} s."
            )
    if native.noslip_iterations:
        said.append("noslip_iterations cure the creep of rolling contacts, not hovering, and cost time in every step.")
    fitting = ContactSettings.for_problem(p, native.timestep)
    said.append(
        f'For this problem and step the theory asks for cone elliptic, solref "{fitting.solref[0]:g} '
        f'{fitting.solref[1]:g}", solreffriction "{fitting.solreffriction:.3g} 1", solimp "{fitting.solimp:.3g} '
        f'{fitting.solimp:.3g} 0.0001 0.5 2", impratio {fitting.impratio:.3g}.'
    )
    return said


def _of_hovering(
    native: Native, column: Column, name: str, touch: Touch, load: float, friction: float, speed: float
) -> list[str]:
    theory = native.theory(touch, load)
    number = theory.hover_number(load, friction, speed)
    if number <= 1:
        return []
    return [
        f"hovering at {name}: in SS at 25 the ball slips at {speed:.2f} m/s, but contact is continuous only up to "
        f"{theory.fastest_slip(load, friction):.2g} m/s (hover number {number:.2g}, must be < 1; measured: "
        f"contact lost in {column.stationary[2].chatter:.0%} of the steps). Soften the friction rows (solreffriction, "
        f"now {theory.solreffriction:.2g} s) and lower the impedance (solimp, now {theory.solimp:.2g}): the limit is "
        "(1 − d)/d · N/(m · friction · b_f)."
    ]


@dataclass(frozen=True)
class Line:
    """One line of the card: what it is, and for each column a text and whether it is good (None: neither)."""

    group: str
    name: str
    cells: tuple[tuple[str, bool | None], ...]


def lines(columns: Sequence[Column]) -> list[Line]:
    """The card as text, without the advice."""
    found = [
        Line(
            "share of time in the case",
            name,
            tuple((_share(c.cases[name]), c.cases[name] >= AGREES) for c in columns),
        )
        for name in columns[0].cases
    ]
    for k, held in enumerate(columns[0].stationary):
        errors = [column.stationary[k] for column in columns]
        found.append(Line("relative error of ω_c", held.name, tuple(_relative(e.omega_c) for e in errors)))
    for k, held in enumerate(columns[0].stationary):
        errors = [column.stationary[k] for column in columns]
        found.append(Line("error of slip (m/s)", held.name, tuple(_speed(e.slip) for e in errors)))
    found += [
        Line("steps that lose contact", held.name, tuple(_chatter(column.stationary[k].chatter) for column in columns))
        for k, held in enumerate(columns[0].stationary)
        if held.name.startswith("SS")
    ]
    found += [
        Line("other errors", "creep in RR at 12 (m/s)", tuple(_speed(column.creep) for column in columns)),
        Line("other errors", "ω₀₁, end of rolling", tuple(_relative(column.omega_01) for column in columns)),
        Line(
            "other errors", "approach to SS at 25, rms", tuple(_relative(column.transient, False) for column in columns)
        ),
        Line("cost", "time step (ms)", tuple((f"{1e3 * column.timestep:g}", None) for column in columns)),
        Line("cost", "a step (dualball 1)", tuple((f"{column.cost:.2f}", None) for column in columns)),
        Line("cost", "a second (dualball 1)", tuple((f"{column.cost_of_a_second:.2f}", None) for column in columns)),
    ]
    return found


def headline(column: Column) -> str:
    """A column in one sentence."""
    errors = [abs(held.omega_c) for held in column.stationary]
    worst = "a stationary state diverges" if np.isnan(errors).any() else f"ω_c is off by up to {max(errors):.1g}"
    onset = "the loss of rolling is not found" if math.isnan(column.omega_01) else "the loss of rolling is found"
    return f"{column.name}: {len(column.reproduced)} of {len(column.cases)} cases reproduced, {worst}, {onset}"


CAPTION = (
    "dualball: the study's settings. MuJoCo: its defaults, in the study's scene. newcomer: its defaults, a free joint, "
    "a wall of flat facets."
)
_GOOD, _GOOD_SPEED = 1e-3, 1e-4
"""Relative error, and error of a speed in m/s, up to which a number is shown as good."""


def _share(share: float) -> str:
    return f"{'✓' if share >= AGREES else '✗'} {math.floor(100 * share)} %"


def _relative(error: float, signed: bool = True) -> tuple[str, bool | None]:
    if math.isnan(error):
        return "not found", False
    return f"{error:{'+' if signed else ''}.1e}", abs(error) <= _GOOD


def _speed(error: float) -> tuple[str, bool | None]:
    return ("diverged", False) if math.isnan(error) else (f"{error:.1e}", error <= _GOOD_SPEED)


def _chatter(share: float) -> tuple[str, bool | None]:
    return ("diverged", False) if math.isnan(share) else (f"{100 * share:.3g} %", share == 0)


def table(columns: Sequence[Column]) -> Table:
    """The card for the terminal."""
    shown = Table(box=box.SIMPLE_HEAD, title="Score card", title_justify="left", title_style="bold")
    shown.add_column("")
    for column in columns:
        shown.add_column(column.name, justify="right")
    last = ""
    for line in lines(columns):
        if line.group != last:
            shown.add_row(Text(line.group, style="dim"))
            last = line.group
        cells = [Text(text, style={True: "green", False: "red", None: ""}[good]) for text, good in line.cells]
        shown.add_row(f"  {line.name}", *cells)
    shown.caption, shown.caption_justify = CAPTION, "left"
    return shown


def html(columns: Sequence[Column], settings: str) -> str:
    """The card as one self-contained page; `settings` says in words what was graded."""
    return page.render(
        "grade.html",
        caption=CAPTION,
        columns=columns,
        lines=lines(columns),
        headline=headline(columns[0]),
        settings=settings,
    )
