"""A score card for contact settings: what a ball that rolls and slips does under them, and what it should do.

MuJoCo's settings run as they are in the study's scene, driven by its drag and wall but without its corrections; another
engine runs in its own loop. Every number stands against closed-form theory or the event-driven simulation, and beside
what other settings give.
"""

from __future__ import annotations

import dataclasses
import functools
import itertools
import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from rich.table import Table
from rich.text import Text

from compare.bench import league, trials
from compare.bench.league import Contestant
from compare.bench.native import Native
from compare.bench.trials import AGREES, APPROACH, ROLLING, SLIPPING, STATES, Asked, Held, Stationary
from compare.kit import pages
from compare.kit.engines import ENGINES, MUJOCO, NEWCOMER
from compare.kit.progress import Show
from compare.kit.statistics import plain
from compare.kit.tasks import carry_out
from mjsim import ContactSettings
from model import Case, Trajectory
from model.kinematics import slip_speeds

GOOD, GOOD_SPEED = 1e-3, 1e-4
"""Relative error, and error of a speed in m/s, up to which a number is shown as good."""
FINE = 10_000
"""Samples of a run into a stationary state: enough of them at its end to see how often contact is lost."""
TIMED = 10 * APPROACH.lasts
"""How long a run lasts whose cost is measured, s."""
CAPTION = (
    "dualball: the study's settings. MuJoCo: its defaults, in the study's scene. newcomer: its defaults, a free joint, "
    "a wall of flat facets."
)
Cell = tuple[str, bool | None]
"""A text, and whether what it says is good; None: neither."""
Row = tuple[str, str, list[Cell]]
"""One line of the card: its group, what it is, and a cell for each column."""


def contestant(name: str, native: Native, **loop: Any) -> Contestant:
    """MuJoCo with settings of its own, in the study's loop without corrections, whose other settings are `loop`."""
    assert NEWCOMER.stream
    stream = functools.partial(NEWCOMER.stream, build=native.build)
    engine = dataclasses.replace(NEWCOMER, name=name, stream=stream)
    return Contestant(name, engine, native.timestep, native.loop(**loop))


OURS = Contestant("dualball", MUJOCO, ContactSettings.timestep, ContactSettings())
PLAIN = contestant("MuJoCo", Native())
FREE = contestant("newcomer", Native(), coordinates="free", wall="prism")
"""What a newcomer might write: MuJoCo's defaults, a free ball, and a wall of flat facets."""


@dataclass(frozen=True)
class Column:
    """Everything measured of one contestant."""

    name: str
    timestep: float
    cases: dict[str, float]
    """By case: share of samples in the case in which the event-driven simulation is."""
    stationary: tuple[Held, ...]
    omega_01: float
    """Relative error of the threshold where rolling is lost; nan if slip doesn't begin near it."""
    transient: float
    """Relative rms error of omega_c over the transient; nan if the run diverged."""
    cost: float
    """Time of a step, divided by that of our defaults."""
    advice: tuple[str, ...] = ()

    @property
    def reproduced(self) -> list[str]:
        """The cases that are reproduced."""
        return [name for name, share in self.cases.items() if share >= AGREES]

    @property
    def cost_of_a_second(self) -> float:
        """Time of a simulated second, divided by that of our defaults."""
        return self.cost * ContactSettings.timestep / self.timestep

    def of(self, state: Stationary) -> Held:
        """What was measured of a state."""
        return next(each for each in self.stationary if each.name == state.name)

    def to_mapping(self) -> dict[str, Any]:
        """JSON-able data; None for what is missing."""
        more = {"reproduced": self.reproduced, "cost_of_a_second": self.cost_of_a_second}
        return dict(plain(dataclasses.asdict(self) | more))


def grade(
    yours: Native | None,
    others: Sequence[Contestant] = (OURS, PLAIN, FREE),
    show: Show = lambda what, done, total, failed: None,
) -> list[Column]:
    """Columns of the score card: the given settings first, with advice, then the others.

    Raises `InputError` if MuJoCo refuses the settings.
    """
    those = [*([contestant("yours", yours)] if yours else []), *others]
    added = {each.name: each.engine for each in those if each.engine.name not in ENGINES}
    ENGINES.update(added)  # tasks name their engines
    try:
        spent, columns = _cost(OURS), []
        for k, each in enumerate(those):
            show(f"grade {each.name}", k, len(those), 0)
            columns.append(_column(each, spent))
    finally:
        for name in added:
            del ENGINES[name]
    if yours:
        ours = columns[0]
        said = advice(yours, ours.of(ROLLING).creep, ours.of(SLIPPING).open)
        columns[0] = dataclasses.replace(ours, advice=tuple(said))
    return columns


def _cost(each: Contestant) -> float:
    """Processor time of a step, in s times the length of a step."""
    return league.cost(each.task((APPROACH.p, APPROACH.x0, TIMED, TIMED / 100))) * (each.step or math.nan)


def _column(each: Contestant, ours: float) -> Column:
    """What is measured of a contestant, with its cost in units of ours."""

    def run(asked: Asked) -> Trajectory:
        (carried_out,) = carry_out([each.task(asked)])
        return carried_out

    passing = run(APPROACH.run)
    return Column(
        name=each.name,
        timestep=each.step or math.nan,
        cases={case.name: trials.share(run(trials.scenario(case)), case) for case in Case},
        stationary=tuple(state.held(run((*state.run[:3], state.settles / FINE))) for state in STATES),
        omega_01=trials.onset([run(state.run) for state in trials.beyond_rolling()]),
        transient=APPROACH.errors(passing.time, passing.x)[0] if passing.complete else math.nan,
        cost=1.0 if each is OURS else _cost(each) / ours,
    )


def advice(native: Native, creep: float, chatter: float) -> Iterator[str]:
    """What to change in contact settings and why, from the theory of the settings; the most harmful first.

    `creep` (m s-1) was measured in rolling, `chatter`, the share of open steps, in fast slipping.
    """
    p, slipping = SLIPPING.p, SLIPPING.solution
    if native.integrator == "RK4":
        yield (
            "integrator RK4 freezes the wall within a step, so that its normal lags behind the ball: use Euler or "
            "implicitfast with a shorter step."
        )
    if native.cone == "pyramidal":
        yield (
            "cone pyramidal: friction is too weak along the pyramid's edges and not opposed to slip, by up to 29 %, "
            "which shows in every sliding state: use cone elliptic."
        )
    speeds = slip_speeds(slipping.x, p)
    for name, pair, force, friction, speed in (
        ("A (floor)", native.A, slipping.force_A[1], p.mu, speeds[0]),
        ("B (wall)", native.B, slipping.force_B[0], p.eta, speeds[1]),
    ):
        load = float(force) / p.m
        theory = native.theory(pair, load)
        number = theory.hover_number(load, friction, float(speed))
        if number > 1:
            yield (
                f"hovering at {name}: in {SLIPPING.name} the ball slips at {speed:.2f} m/s, but contact is continuous "
                f"only up to {theory.fastest_slip(load, friction):.2g} m/s (hover number {number:.2g}, must be < 1; "
                f"measured: contact lost in {chatter:.0%} of the steps). Soften the friction rows (solreffriction, "
                f"now {theory.solreffriction:.2g} s) and lower the impedance (solimp, now {theory.solimp:.2g}): the "
                "limit is (1 − d)/d · N/(m · friction · b_f)."
            )
    p, theory = ROLLING.p, native.theory(native.A, ROLLING.p.g)
    predicted = float(theory.creep_speed(float(np.hypot(*ROLLING.solution.force_A[[0, 2]])) / p.m))
    if predicted > 1e-6:
        yield (
            f"creep: a contact that should roll slips at (1 − d)/d f/(m·impratio·b_f) = {predicted:.1e} m/s at A for "
            f"{ROLLING.name} (measured, both contacts: {creep:.1e}): raise impratio (now {native.impratio:g}; up to "
            "1e5 holds with cone elliptic), or shift the surface velocity by the last friction force, as dualball does."
        )
    depth = theory.margin(p.g)
    yield (
        f"depth: under its weight the ball sinks by {1e6 * depth:.3g} µm, and then rolls on a lever shorter by half "
        f"of that, {depth / (2 * p.r):.1e} of its radius: shorten solref (2 steps are the least), or let the pair's "
        "margin follow the gap, as dualball does; moving the floor does not help."
    )
    for name, pair in (("A", native.A), ("B", native.B)):
        if 0 < pair.solref[0] < 2 * native.timestep:
            yield (
                f"solref of {name}, {pair.solref[0]:g} s, is shorter than two steps: the engine silently takes "
                f"{2 * native.timestep:g} s."
            )
    if native.noslip_iterations:
        yield "noslip_iterations cure the creep of rolling contacts, not hovering, and cost time in every step."
    fitting = ContactSettings.for_problem(SLIPPING.p, native.timestep)
    yield (
        f'For this problem and step the theory asks for cone elliptic, solref "{fitting.solref[0]:g} '
        f'{fitting.solref[1]:g}", solreffriction "{fitting.solreffriction:.3g} 1", solimp "{fitting.solimp:.3g} '
        f'{fitting.solimp:.3g} 0.0001 0.5 2", impratio {fitting.impratio:.3g}.'
    )


def lines(columns: Sequence[Column]) -> list[Row]:
    """The card as text, without the advice."""

    def line(
        group: str,
        name: str,
        values: Iterable[float],
        good: float | None = None,
        form: str = "{:.1e}",
        nan: str = "diverged",
    ) -> Row:
        """Numbers that are good up to a size, if it is given."""
        cells: list[Cell] = []
        for v in values:
            fine = None if good is None else abs(v) <= good
            cells.append((nan, False) if math.isnan(v) else (form.format(v), fine))
        return group, name, cells

    shares: list[Row] = []
    for case in columns[0].cases:
        held = [(column.cases[case], column.cases[case] >= AGREES) for column in columns]
        cells = [(f"{'✓' if good else '✗'} {math.floor(100 * share)} %", good) for share, good in held]
        shares.append(("share of time in the case", case, [*cells]))
    of = {state.name: [column.of(state) for column in columns] for state in STATES}
    slipping = [state.name for state in STATES if state.case is Case.SS]
    sign, missing, off = "{:+.1e}", "missing", "relative error of ω_c"
    return [
        *shares,
        *(line(off, name, [h.omega_c for h in own], GOOD, sign, missing) for name, own in of.items()),
        *(line("error of slip (m/s)", name, [h.slip for h in own], GOOD_SPEED) for name, own in of.items()),
        *(line("steps that lose contact", name, [100 * h.open for h in of[name]], 0, "{:.3g} %") for name in slipping),
        line("other errors", f"creep in {ROLLING.name} (m/s)", [h.creep for h in of[ROLLING.name]], GOOD_SPEED),
        line("other errors", "ω₀₁, end of rolling", [c.omega_01 for c in columns], GOOD, sign, missing),
        line("other errors", f"{APPROACH.name}, rms", [c.transient for c in columns], GOOD, nan=missing),
        line("cost", "time step (ms)", [1e3 * c.timestep for c in columns], form="{:g}"),
        line("cost", f"a step ({OURS.name} 1)", [c.cost for c in columns], form="{:.2f}"),
        line("cost", f"a second ({OURS.name} 1)", [c.cost_of_a_second for c in columns], form="{:.2f}"),
    ]


def headline(column: Column) -> str:
    """A column in one sentence."""
    errors = [abs(held.omega_c) for held in column.stationary]
    worst = "a stationary state diverges" if np.isnan(errors).any() else f"ω_c is off by up to {max(errors):.1g}"
    onset = "the loss of rolling does not show" if math.isnan(column.omega_01) else "the loss of rolling shows"
    return f"{column.name}: {len(column.reproduced)} of {len(column.cases)} cases reproduced, {worst}, {onset}"


def table(columns: Sequence[Column]) -> Table:
    """The card for the terminal."""
    colours = {True: "green", False: "red", None: ""}
    rows: list[list[str | Text]] = [["", *(column.name for column in columns)]]
    for group, own in itertools.groupby(lines(columns), key=lambda line: line[0]):
        rows.append([Text(group, "dim")])
        rows += [[f"  {name}", *(Text(text, colours[good]) for text, good in cells)] for _, name, cells in own]
    return pages.table("Score card", rows, caption=CAPTION)


def html(columns: Sequence[Column], settings: str) -> str:
    """The card as one self-contained page; `settings` says in words what was graded."""
    shown = {"caption": CAPTION, "columns": columns, "lines": lines(columns), "headline": headline(columns[0])}
    return pages.render("compare.bench", "grade.html", **shown, settings=settings, good=GOOD, good_speed=GOOD_SPEED)
