"""A score card for contact settings: what they make of every exact case, beside what other settings do.

MuJoCo's settings run on free bodies and, for the ball in the vessel, in the study's scene on joints, driven by its drag
and wall but without its corrections; another engine runs as in the league.
"""

from __future__ import annotations

import dataclasses
import functools
import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from rich.table import Table
from rich.text import Text

import analytic
from compare.bench import league
from compare.bench.adapters import mujoco_free
from compare.bench.adapters.simulators import Simulated
from compare.bench.case import TOLERANCE
from compare.bench.exact import SMOOTH, cases
from compare.bench.native import Native
from compare.bench.runner import Result, run_all
from compare.kit import pages
from compare.kit.engines import ENGINES, NEWCOMER, Engine
from compare.kit.progress import Show, nowhere
from mjsim import ContactSettings
from model import Case as Kinds
from model.kinematics import slip_speeds

GOOD_SPEED = 1e-4
"""Creep up to which a number is shown as good, m/s."""
CAPTION = (
    "dualball: free bodies, rigid contacts under Coulomb's law. "
    "MuJoCo: its defaults, the ball in the vessel in the study's scene. "
    "mujoco-defaults: as it comes, a free ball in a wall of flat facets."
)
Cell = tuple[str, bool | None]
"""A text, and whether what it says is good; None: neither."""
Row = tuple[str, str, list[Cell]]
"""One line of the card: its group, what it is, and a cell for each column."""


class Graded(Simulated):
    """MuJoCo with settings of its own: the ball in the vessel on the study's joints, other bodies free."""

    def __init__(self, native: Native) -> None:
        super().__init__(NEWCOMER.name, mujoco_free.Bodies(NEWCOMER.name, "", tune=native.tune))
        self._native = native

    def engine(self, timestep: float) -> Engine:
        """The study's loop without corrections round a scene with these settings."""
        native = dataclasses.replace(self._native, timestep=timestep)
        assert NEWCOMER.stream
        stream = functools.partial(NEWCOMER.stream, build=native.build)
        made = dataclasses.replace(
            NEWCOMER, name="graded", stream=stream, configure=lambda given, p: native.loop(), study=None
        )
        ENGINES[made.name] = made  # tasks name their engines; this process has no other
        return made


@dataclass(frozen=True)
class Column:
    """Everything measured of one contestant."""

    name: str
    timestep: float
    results: tuple[Result, ...]
    """Of the exact cases, in their order."""
    advice: tuple[str, ...] = ()

    @property
    def passed(self) -> list[str]:
        """The cases that are passed."""
        return [result.case for result in self.results if result.passed]

    @property
    def cost(self) -> float:
        """Processor time divided by simulated time, the median over the cases."""
        return float(np.median([result.cost for result in self.results if math.isfinite(result.cost)] or [math.nan]))

    def of(self, case: str) -> Result:
        """What was measured in a case."""
        return next(result for result in self.results if result.case == case)


OTHERS: dict[str, tuple[Any, float]] = {
    "dualball": (mujoco_free.best, ContactSettings.timestep),
    "MuJoCo": (Graded(Native()), Native.timestep),
    "mujoco-defaults": (mujoco_free, Native.timestep),
}
"""Engines beside a person's settings, each with its time step."""


def grade(yours: Native | None, others: Mapping[str, tuple[Any, float]] = OTHERS, show: Show = nowhere) -> list[Column]:
    """Columns of the score card: the given settings first, with advice, then others, engines with a time step each.

    Raises `InputError` if MuJoCo refuses the settings.
    """
    those = dict(others)
    if yours:
        yours.build(SMOOTH, yours.loop())
        those = {"yours": (Graded(yours), yours.timestep)} | those
    columns: list[Column] = []
    for name, (engine, step) in those.items():
        found = []
        for result in run_all(cases(), engine, [step]):
            found.append(result)
            show(f"grade {name}", len(columns) * len(cases()) + len(found), len(those) * len(cases()), 0)
        columns.append(Column(name, step, tuple(found)))
    if yours:
        own = columns[0]
        said = advice(yours, own.of("rolls-on-both").creep, own.of("slips-on-both").lost)
        columns[0] = dataclasses.replace(own, advice=tuple(said))
    return columns


def advice(native: Native, creep: float, chatter: float) -> Iterator[str]:
    """What to change in contact settings and why, from the theory of the settings; the most harmful first.

    `creep` (m s-1) was measured in rolling, `chatter`, the share of open steps, in fast slipping.
    """
    p = SMOOTH.replace(omega_0=25.0)
    slipping = analytic.solution(p, Kinds.SS)
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
                f"hovering at {name}: in SS at 25 rad/s the ball slips at {speed:.2f} m/s, but contact is continuous "
                f"only up to {theory.fastest_slip(load, friction):.2g} m/s (hover number {number:.2g}, must be < 1; "
                f"measured: contact lost in {chatter:.0%} of the steps). Soften the friction rows (solreffriction, "
                f"now {theory.solreffriction:.2g} s) and lower the impedance (solimp, now {theory.solimp:.2g}): the "
                "limit is (1 − d)/d · N/(m · friction · b_f)."
            )
    p = SMOOTH
    theory, rolling = native.theory(native.A, p.g), analytic.solution(p, Kinds.RR)
    predicted = float(theory.creep_speed(float(np.hypot(*rolling.force_A[[0, 2]])) / p.m))
    if predicted > 1e-6:
        yield (
            f"creep: a contact that should roll slips at (1 − d)/d f/(m·impratio·b_f) = {predicted:.1e} m/s at A for "
            f"RR at 12 rad/s (measured, both contacts: {creep:.1e}): raise impratio (now {native.impratio:g}; up to "
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
    fitting = ContactSettings.for_problem(SMOOTH.replace(omega_0=25.0), native.timestep)
    yield (
        f'For this problem and step the theory asks for cone elliptic, solref "{fitting.solref[0]:g} '
        f'{fitting.solref[1]:g}", solreffriction "{fitting.solreffriction:.3g} 1", solimp "{fitting.solimp:.3g} '
        f'{fitting.solimp:.3g} 0.0001 0.5 2", impratio {fitting.impratio:.3g}. That is for a ball: so soft '
        "an impedance keeps what slips fast from hovering, but blocks, which rest on several points, lose contact with "
        "it (block-rests, block-slides, box-stops). For any other scene: dualball forecast."
    )


def lines(columns: Sequence[Column]) -> list[Row]:
    """The card as text, without the advice."""
    found: list[Row] = []
    for group in league.KINDS:
        for k, case in enumerate(cases()):
            if case.kind == group:
                results = [column.results[k] for column in columns]
                cells = [(league.cell(r), None if r.skipped else r.passed) for r in results]
                found.append((f"error, {group}", case.name, [*cells]))
    for name, text in (("block-rests", "a block on a slope"), ("rolls-on-both", "a ball on floor and wall")):
        speeds = [column.of(name).creep for column in columns]
        found.append(("creep (m/s)", text, [(f"{v:.1e}", v <= GOOD_SPEED) for v in speeds]))
    shares = [max((r.lost for r in column.results if math.isfinite(r.lost)), default=math.nan) for column in columns]
    found.append(("contact lost", "largest share of a case's time", [(f"{v:.0%}", v == 0) for v in shares]))
    found.append(("cost", "time step (ms)", [(f"{1e3 * column.timestep:g}", None) for column in columns]))
    costs = [column.cost for column in columns]
    found.append(("cost", "processor time divided by simulated time", [(f"{v:.2g}", None) for v in costs]))
    return found


def headline(column: Column) -> str:
    """A column in one sentence."""
    tried = [result for result in column.results if not result.skipped]
    found = league.worst(tried)
    said = f"; worst is {found.case}, off by {league.cell(found)} of its scale" if found else ""
    return f"{column.name}: {len(column.passed)} of {len(tried)} exact cases passed{said}"


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
    return pages.render(
        "compare.bench", "grade.html", **shown, settings=settings, good=TOLERANCE, good_speed=GOOD_SPEED
    )
