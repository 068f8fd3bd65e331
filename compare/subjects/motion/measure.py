"""The equations of motion in all nine cases, the laws of contact and friction, changes of case,
landings, and whole motions to their ends."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import replace
from itertools import product
from typing import NamedTuple

import numpy as np

from compare.campaign.tasks import Task
from compare.method.conditions import Conditions, state_of
from compare.method.conditions import FluidConditions as Fluid
from compare.method.protocol import Protocol
from compare.method.record import Measured, Records, Sets
from compare.method.runner import Runner, coarse_step
from compare.method.scales import time_unit
from compare.method.settling import PRESSES, forces, settled_readings
from compare.method.statistics import Estimate, estimate, uniform
from compare.method.step_pairs import (
    HALF_WINDOW,
    STEP_RATIO,
    SURER,
    Start,
    StepPair,
    StepPairResult,
    carry_out,
    constrained,
    lag_error,
    of_three_steps,
    polynomials,
    random_state,
    unlike,
)
from compare.method.together import Procedure, stepped, together
from model import Case, Contact, Flow, Parameters, State, Trajectory
from model.arrays import Array
from model.cases import TRAITS
from model.drag import QUADRATIC, SCHILLER_NAUMANN, STOKES
from model.kinematics import SLIP_XYZ, TURNING, VARIABLES, slip_velocities, state_units

RUN_LENGTH = 768  # length of a run in coarse steps, which is about 40 sqrt(R/g), and its samples
ROUNDING = 100 * float(np.finfo(float).eps)
FLUIDS: Mapping[str, Fluid] = {
    "steel-in-water": Fluid(nu_f=1.004e-6, rho_f=998.2, rho_b=7850.0, r=5e-3, gravity=9.81),
    "steel-in-air": Fluid(nu_f=1.516e-5, rho_f=1.204, rho_b=7850.0, r=5e-3, gravity=9.81),
    "glass-in-glycerine": Fluid(nu_f=1.18e-3, rho_f=1260.0, rho_b=2500.0, r=8e-3, gravity=9.81),
}
"""Balls that fall in a fluid, SI."""


class ContactLaw(NamedTuple):
    """A law of a contact, by the quantity that shows how far it is off."""

    quantity: str
    law: str
    contact: str


LOADS_FOUND = 1e-7
"""Part of a weight, or of gravity, to which a law of rigid contacts finds what they bear in a
motion: a tenth of its share. (Chosen after a measurement.)"""


def laws(runner: Runner, sets: Sets, records: Records) -> Measured:
    """How far each law of contact is off at its worst, and the speed at which balls sink.

    Contacts roll and rub as Table 3 and (14)-(17) say, while balls go through the cases of Fig. 2
    and the flow rises and falls: the worst of all samples of a set but those next to a change of
    case, when friction takes a few steps to build up. (12) and (13) are not measured: what solves
    for forces in a friction cone can't violate them."""
    yield from _contact_laws(runner, sets)
    yield from _sinking(runner)


def _contact_laws(runner: Runner, sets: Sets) -> Measured:
    """How far each law of contact is off at its worst."""
    pairs, divisors = [], runner.sampling.laws_divisors
    for name, p in sets.items():
        t_end, fast = RUN_LENGTH * coarse_step(p), 3.0 / time_unit(p)
        up = Flow.sampled([0.0, 0.3 * t_end, 0.7 * t_end], [0.0, fast / 3, fast])
        down = Flow.sampled([0.0, 0.2 * t_end, 0.6 * t_end], [fast, fast, fast / 4])
        half = Flow.steady(fast / 2)
        x0, on_wall = State().stacked(), State(y=2 * p.R, omega_c=fast).stacked()
        on_floor = State(omega_c=fast / 3, h=p.R / 2).stacked()
        pair = StepPair(name, p, "laws", x0, t_end, divisors, RUN_LENGTH, deviations, up)
        others = replace(pair, x0=on_wall, flow=down), replace(pair, x0=on_floor, flow=half)
        pairs.append(replace(pair, together=(pair, *others)))
    for result in (yield from carry_out(runner, pairs)):
        coarse, fine = result.coarse, result.fine
        for law, value in fine.items():
            if math.isnan(value) or math.isnan(coarse[law]):
                why = f"no sample at {law.contact} to test: {law.law}"
                yield runner.missing(result.pair.set, why, 0)
                continue
            # Halving the step may by chance change little: the larger change of the two contacts
            # counts.
            changes = [abs(fine[k] - coarse[k]) for k in fine if k[:2] == law[:2]]
            solver = uniform(LOADS_FOUND) if law.quantity == "law_in_motion" else 0.0
            step = float(np.nanmax(changes))
            sure = estimate(value, time_step=step, solver=solver, rounding=ROUNDING)
            yield result.row(law.quantity, sure, law=law.law, contact=law.contact)


def _sinking(runner: Runner) -> Measured:
    """The speed at which balls sink in the middle of still fluid, off floor and wall."""
    pairs, divisors = [], runner.sampling.laws_divisors
    for name, fluid in FLUIDS.items():
        p = Parameters.from_fluid(**fluid, R=5 * fluid["r"], mu=0.2, eta=0.2)
        t_end, rest = 64 * coarse_step(p), State(y=100 * p.R, h=p.R / 2)
        falling = rest._replace(v_y=-math.sqrt(p.g * p.R)).stacked()
        pair = StepPair(name, p, "sinks", rest.stacked(), t_end, divisors, 64, _sinking_speed)
        pairs.append(replace(pair, together=(pair, replace(pair, x0=falling))))
    for result in (yield from carry_out(runner, pairs)):
        name, (before, _), (speed, lasts) = result.pair.set, result.coarse, result.fine
        # What is left of a fall that has only just begun is a difference of speeds, each of them
        # rounded in every step.
        rounding = ROUNDING * abs(speed) / (result.pair.p.c * lasts)
        sinking = estimate(speed, time_step=abs(speed - before), rounding=rounding)
        yield result.row("v_y", sinking, case="NN", by=name, **FLUIDS[name])


def deviations(*runs: Trajectory) -> dict[ContactLaw, float]:
    """How far runs are from every law, dimensionless; nan where no sample can show it."""

    def largest(values: Array, off: float) -> float:
        return float(values[np.argmax(np.abs(values - off))]) if len(values) else math.nan

    worst: dict[ContactLaw, float] = {}
    for contact in "AB":
        rows = [_rows(run, contact) for run in runs]
        normal, friction, against, speed, gap, letter = (
            np.concatenate(row) for row in zip(*rows, strict=True)
        )
        # A contact that slips so fast must have the friction of slipping, whatever case is
        # detected.
        slides = (speed > 0.02) & (normal > PRESSES) & (letter != "")
        for law, values in (
            ("where it rolls it doesn't slip", speed[letter == "R"]),
            ("where it is closed there is no gap", np.abs(gap[(letter == "R") | (letter == "S")])),
            ("(14), (15): friction opposes the slip", against[slides]),
        ):
            worst[ContactLaw("law_in_motion", law, contact)] = largest(values, 0.0)
        ratios = friction[slides] / normal[slides]
        usual = float(np.median(ratios)) if len(ratios) else 0.0
        worst[ContactLaw("friction_ratio", "friction over normal force", contact)] = largest(
            ratios, usual
        )
    return worst


def _rows(run: Trajectory, contact: str) -> tuple[Array, ...]:
    """Normal force, friction, its difference from that against the slip, in weights.

    Of the difference only what exceeds the turn of the slip from one sample to the next. Then slip
    speed divided by sqrt(g R), gap divided by R and the contact's letter, empty within 5 samples of
    a change of case, each (n,)."""
    p, k = run.header.parameters, "AB".index(contact)
    across, along = ((1, [0, 2]), (0, [1, 2]))[k]
    force, slip = (run.force_A, run.force_B)[k], slip_velocities(run.x, p)[k][:, along]
    normal, tangent, speed = force[:, across], force[:, along], np.hypot(*slip.T)
    friction = np.hypot(*tangent.T)
    direction = slip / np.maximum(speed, np.finfo(float).tiny)[:, None]
    turns = np.hypot(*np.diff(direction, axis=0, prepend=direction[:1]).T)
    against = np.maximum(
        np.hypot(*(tangent + friction[:, None] * direction).T) - friction * turns, 0.0
    )
    changes = np.flatnonzero(np.diff(run.case))[:, None] + np.arange(-4, 6)
    letters = np.array([case.name[k] for case in run.cases])
    letters[np.clip(changes, 0, len(letters) - 1)] = ""
    forces = (each / (p.m * p.g) for each in (normal, friction, against))
    return *forces, speed / math.sqrt(p.g * p.R), (run.gap_A, run.gap_B)[k] / p.R, letters


def _sinking_speed(slow: Trajectory, fast: Trajectory) -> tuple[float, float]:
    """v_y, m/s, at which gravity and drag balance, from two falls; and their duration, s.

    With a drag proportional to speed, v' = (v_end - v)/T: the fall from rest gains (1 - q) v_end
    while the difference of the two shrinks to q of what it was."""
    gap = fast.v_y - slow.v_y
    lost = (gap[0] - gap[-1]) / gap[0]
    return float(slow.v_y[0] + (slow.v_y[-1] - slow.v_y[0]) / lost), float(fast.time[-1])


STATES_SEED = 53  # of the random states of the field of motion
WINDOW_CENTRES = (16, 40, 64)
"""Of the windows in which equations of motion are looked at; in steps of the coarser run."""
AROUND_WINDOW = 4  # steps in which the case doesn't change, either: friction has built up
FIELD_DEGREES = 7, 5
"""Of the polynomials through a window; the lower one shows what the degree changes. (They were 5
and 3: without the errors of the step, degree 5 was off by more than it differs from 3.)"""
MOST_TURN = 0.5
"""Largest change of a slip, and of that which friction alone would make, divided by the slip: where
slip is about to vanish, or very small, friction turns too fast."""
MOVING = {
    case: [k for k, name in enumerate(VARIABLES) if name in {*TRAITS[case].active} - {"y", "h"}]
    for case in Case
}
"""The variables whose rates of change are measured."""


def field(runner: Runner, sets: Sets, records: Records) -> Measured:
    """Rates of change and contact forces, each with the state they belong to.

    Balls start at random states of every case and move freely for a few hundredths of a second. In
    short windows during which the case does not change, polynomials through the samples give all
    of them at the centre of the window."""
    divisors = tuple(STEP_RATIO * times for times in runner.sampling.field_steps)
    pairs = []
    for name, p in sets.items():
        rng = np.random.default_rng([STATES_SEED, *name.encode()])
        for case, k in product(Case, range(runner.sampling.field_starts)):
            x, unit = random_state(case, p, rng), time_unit(p)
            if case is Case.RR:  # friction at two rolling contacts can balance only a slight lag
                omega_0 = State.of(x).omega_c * rng.uniform(0.8, 1.2)
            else:
                omega_0 = rng.uniform(0.3, 2.5) / unit
            q = p.replace(omega_0=omega_0)
            t_end = (WINDOW_CENTRES[-1] + HALF_WINDOW + AROUND_WINDOW) * coarse_step(q) / STEP_RATIO
            pairs.append(StepPair(name, q, f"from {case.name}", x, t_end, divisors, rows=0))
            # Reynolds numbers as in water
            if p.drag != STOKES and case in (Case.NN, Case.SN, Case.NS) and k < 2:
                _, v_y, omega_c, *_, h, v_h = x
                speed, Re = math.hypot(v_h, v_y, (p.R - h) * (omega_c - omega_0)), (3e3, 3e4)[k]
                fast = q.replace(nu_f=2 * p.r * speed / Re, c=24 / (p.C_D * Re * unit))
                pairs.append(replace(pairs[-1], p=fast))
    results = yield from carry_out(runner, pairs)
    kept = Counter[tuple[str, float, Case]]()
    for centre, result in product(WINDOW_CENTRES, results):
        case = Case(int(result.coarse.case[centre * runner.sampling.field_steps[1]]))
        alike = result.pair.set, result.pair.p.nu_f, case
        enough = kept[alike] >= runner.sampling.field_kept
        if not enough and (amid := _values(case, result, centre)):
            kept[alike] += 1
            x, values = amid
            for what, value in values.items():
                yield result.row(what, value, **(Conditions(case=case.name) | state_of(x)))
    for name, case in product(sets, Case):
        if lacking := runner.sampling.field_kept - kept[name, sets[name].nu_f, case]:
            why = f"too few random starts moved smoothly in case {case.name} for "
            why += f"{2 * HALF_WINDOW} steps"
            rows = len(MOVING[case]) + len(_determined(case))
            yield runner.missing(name, why, lacking * rows)


def _values(
    case: Case, result: StepPairResult, centre: int
) -> tuple[Array, dict[str, Estimate]] | None:
    """State (8,), rates and forces amid a window; None if it changes case, or `turns_or_hovers`.

    They are extrapolated to a vanishing step, see `of_three_steps`, and uncertain by what that may
    leave, and by what the degree of the polynomials changes of the limit, see `unlike`."""
    p, runner = result.pair.p, result.runner
    reads = [
        _amid(case, runner, run, centre * times, times)
        for run, times in zip(result.reads, runner.sampling.field_steps, strict=True)
    ]
    found = [read for read in reads if read is not None]
    if len(found) < len(reads):
        return None
    (limit, other), (lower, _) = (of_three_steps(of) for of in np.stack(found, axis=1))
    rows = np.stack([limit, other, lower])
    speed, spin, weight = math.sqrt(p.g * p.R), p.g / p.r, p.m * p.g
    scales = np.array([speed, p.g, p.g / p.R, spin, spin, spin, speed, p.g])
    held = forces(rows[:, 16:19].T, rows[:, 19:].T)
    rates = {f"rate_{VARIABLES[k]}": k for k in MOVING[case]}
    read_off = {name: (rows[:, 8 + k], float(scales[k])) for name, k in rates.items()}
    read_off |= {f"moving_force_{name}": (held[name], weight) for name in _determined(case)}
    best, other, lower = np.transpose([of / size for of, size in read_off.values()])
    steps, degrees = unlike(best - other, SURER), unlike(best - lower, SURER)
    # A contact that rolls is held by friction of a moment ago: its slip should not change at all,
    # and what it changes comes from the rates of other variables.
    slips = range(8)[SLIP_XYZ]
    held_slips = [k for k in slips if VARIABLES[k] in TRAITS[case].constraints]
    rolling = float(np.abs(rows[0, 8:16] / scales)[held_slips].max(initial=0.0))
    # friction of a load that is wrong changes slip so much more than speed
    by_friction = max(1.0, max(p.mu, p.eta) * (1 + 1 / p.j))
    values = {}
    for k, (name, (of, size)) in enumerate(read_off.items()):
        causes = {"rolling": uniform(rolling)} if name in rates else {}
        more = by_friction if rates.get(name) in slips else 1.0
        causes |= {
            "time_step": uniform(float(steps[k])),
            "degree": uniform(float(degrees[k])),
            "solver": uniform(LOADS_FOUND * more),
        }
        values[name] = estimate(of[0], size, **causes)
    return constrained(case, rows[0, :8], p), values


def _amid(case: Case, runner: Runner, run: Trajectory, middle: int, times: int) -> Array | None:
    """State, rates, and forces at A and B amid a window, (2, 22), by polynomials of both degrees;
    None if the case changes, or `turns_or_hovers`. A window has `times` as many steps as usual."""
    half, around = times * HALF_WINDOW, times * (HALF_WINDOW + AROUND_WINDOW)
    window = slice(middle - half, middle + half + 1)
    changes = np.any(run.case[middle - around : middle + around + 1] != case)
    if changes or turns_or_hovers(case, run, window):
        return None
    time, at = run.time[window], float(run.time[middle])
    # The forces of a sample act from then on for a step: they belong to the middle of it.
    acting = time + (time[1] - time[0]) / runner.divisor / 2
    both = np.concatenate([run.force_A, run.force_B], axis=1)[window]
    loads, _ = polynomials(acting, both, FIELD_DEGREES, at)
    motion = polynomials(time, run.x[window], FIELD_DEGREES, at)
    return np.concatenate([*motion, loads], axis=1)


def turns_or_hovers(case: Case, run: Trajectory, window: slice) -> bool:
    """Whether a slipping contact carries almost nothing, or its slip changes too much."""
    p, time = run.header.parameters, float(np.ptp(run.time[window]))
    loads = (p.mu, run.force_A[window, 1]), (p.eta, run.force_B[window, 0])
    slips = slip_velocities(run.x[window], p)
    for v, contact, (friction, load) in zip(slips, (case.A, case.B), loads, strict=True):
        by_friction = friction * load.max() * (1 + p.j) / (p.j * p.m) * time
        change = max(float(np.linalg.norm(v[-1] - v[0])), by_friction)
        turns = change > MOST_TURN * np.linalg.norm(v, axis=1).min()
        if contact is Contact.S and (turns or load.min() < PRESSES * p.m * p.g):
            return True
    return False


def _determined(case: Case) -> list[str]:
    """Names of the forces that the motion determines, of the contacts that are closed."""
    if case is Case.RR:  # the contacts share the load in ways that Newton's laws don't tell apart
        return ["Ax-By", "Ay+By", "Bx+By", "Az", "Bz"]
    closed = [name for name, side in (("A", case.A), ("B", case.B)) if side is not Contact.N]
    return [f"{contact}{axis}" for contact in closed for axis in "xyz"]


STARTS: tuple[tuple[float, tuple[float, ...]], ...] = (
    # Falls from mid-air onto the floor, slides, rolls outwards to the wall, hops, slips at both
    # points, sticks.
    (0.86, (0.44, 0.06, 2.36, 0.68, 0.15, 0.03, 0.6, 0.25)),
    # Slides on the floor, rolls, rides the wall without slip, and comes down through SS and SR.
    (1.03, (0.0, 0.0, -1.62, -0.005, 0.47, -0.14, 0.3, -0.12)),
    # Long stays in the other cases.
    (1.43, (0.0,) * 8),
    (1.80, (0.0, 0.0, 1.02, -0.02, 0.03, 0.12, 0.0, 0.0)),
    (1.07, (0.0, 0.0, 1.07, 0.34, 0.0, 0.0, 0.0, 0.0)),
    (1.80, (10.0, 0.0, 1.80, 0.0, 0.17, 0.17, 0.0, 0.0)),
    (0.60, (0.0, 0.0, 0.60, 0.0, 0.1, 0.0, 0.3, 0.0)),
    (1.20, (0.0, 0.0, 0.40, 0.6, 0.1, -0.5, 0.5, 0.0)),
)
"""omega_0 and the state, each in units of R, sqrt(R/g), and for slip sqrt(g R)/r."""
PIECE = 40  # of a motion, in samples
TURNS = len(VARIABLES[TURNING])  # measurements at the end of a piece, beside the case
APART = 10
"""Samples between the ends of a piece and any change of case: three until a force has built up,
three until the case is taken to have changed, and a few by which a change comes too early or
late."""


def motions(runner: Runner, sets: Sets, records: Records) -> Measured:
    """The case at the end of every piece of a motion, and how the ball turns there.

    Motions begin at fixed starts. Each piece is short, and begins and ends away from changes of
    case, at which friction builds up or dies out."""
    begun = [_start(*each, *start, "a motion") for each, start in product(sets.items(), STARTS)]
    ended = yield from together(runner, (_cut(runner, start) for start in begun))
    for name in sets:
        own = (cases for start, cases in zip(begun, ended, strict=True) if start.set == name)
        if unseen := [case.name for case in sorted(set(Case).difference(*own))]:
            yield runner.missing(name, f"no piece of a motion ended in {', '.join(unseen)}", 0)


def _cut(runner: Runner, start: Start) -> Procedure[set[Case]]:
    """The pieces of one motion, and the cases in which they end."""
    p, count, step = start.p, runner.sampling.motions_pieces, coarse_step(start.p) / STEP_RATIO
    t_end, rows = round(6.0 * time_unit(p) / step) * step, count * (1 + TURNS)
    whole = StepPair(**vars(start), t_end=t_end, divisors=(STEP_RATIO,), rows=rows)
    again, seen = list[StepPair](), set[Case]()
    for motion in (yield from stepped(whole)):
        run = motion.fine
        chosen = pieces(run, count)
        if lacking := count - len(chosen):
            why = (
                "at ends of pieces the case changes, or a contact hovers, creeps, slips by a trace"
            )
            yield runner.missing(start.set, why, lacking * (1 + TURNS))
        for first in chosen:
            last = first + PIECE
            case = Case(int(run.case[last]))
            seen.add(case)
            x = constrained(Case(int(run.case[first])), run.x[first], p)
            time = float(run.time[last] - run.time[first])
            at = Conditions(case=case.name, time=time) | state_of(x)
            yield motion.row("case", case, **at)
            divisors = STEP_RATIO // 2, STEP_RATIO, 2 * STEP_RATIO
            again.append(StepPair(start.set, p, case.name, x, time, divisors, at=at, rows=TURNS))
    for piece in (yield from stepped(*again)):
        yield from _turns_at_end(piece)
    return seen


def _turns_at_end(piece: StepPairResult) -> Measured:
    """How the ball turns at the end of a piece that is run anew with all steps."""
    pair = piece.pair
    if {pair.name} != {Case(int(run.case[-1])).name for run in piece.reads}:
        why = f"a piece that ended in {pair.name} does not with other steps or forces at first"
        yield piece.missing(why)
        return
    late = closing_error(piece.runner, pair.p) if closes(piece.fine) else 0.0
    least = lag_error(piece.runner, pair.p, 2) if changes(piece.fine) else 0.0
    for name, value, unit, off in list(zip(VARIABLES, *_ends(piece), strict=True))[TURNING]:
        read = estimate(value, unit, time_step=max(off, least), closing=late)
        yield piece.row(f"end_{name}", read)


def _ends(piece: StepPairResult) -> tuple[list[float], ...]:
    """Of each variable at the end of a motion: its limit of a vanishing step, its natural unit, and
    its standard uncertainty, in that.

    Errors of a long motion exceed what three steps change more often than those of a window: read
    as a bound, 12 of 1587 numbers of six other sets were off by more than three uncertainties."""
    units = state_units(piece.pair.p)
    limits, others = of_three_steps(np.stack([run.x[-1] for run in piece.reads]) / units)
    off = unlike(limits - others, SURER).tolist()
    return (limits * units).tolist(), units.tolist(), off


def changes(run: Trajectory) -> bool:
    """Whether the case changes in a run, or the ball leaves at once the floor on which it begins,
    or its law of drag has a corner: forces then lag behind, and steps may by chance agree."""
    leaves = run.y[0] == 0 and Case(int(run.case[0])).A is Contact.N
    corner = run.header.parameters.drag == SCHILLER_NAUMANN
    return bool(np.ptp(run.case) or leaves or corner)


def closes(run: Trajectory) -> bool:
    """Whether a contact closes in a run."""
    opens = np.array([[side is Contact.N for side in (case.A, case.B)] for case in Case])[run.case]
    return bool((opens[:-1] & ~opens[1:]).any())


def closing_error(runner: Runner, p: Parameters) -> float:
    """Standard uncertainty, in natural units, of what follows when a contact closes: at a whole
    step, or part of one, so up to one late, and until then weight and friction differ.

    That steps of two lengths change little may be by chance. (Pieces of motions have this since two
    rounds played blind refuted a claim without it.)"""
    step = coarse_step(p) / STEP_RATIO / runner.divisor * runner.engine.lands_within
    return uniform(step / time_unit(p) / 2)


def pieces(run: Trajectory, count: int) -> list[int]:
    """Samples at which pieces of a run begin, evenly spread, away from changes of case.

    There the gap of an open contact exceeds 1e-4 R, for an unloaded one may hover; a slipping one
    slips by more than weight causes in the two steps by which landings may be late; a rolling one
    needs 1 % less friction than it may, for else it creeps."""
    p, A, B = run.header.parameters, run.force_A.T, run.force_B.T
    plain = np.full(len(run.time), True)
    for side, gap, speed, friction, limit in (
        ("A", run.y, run.slip_speed_A, np.hypot(A[0], A[2]), p.mu * A[1]),
        ("B", run.h, run.slip_speed_B, np.hypot(B[1], B[2]), p.eta * B[0]),
    ):
        contact = np.array([getattr(case, side).name for case in Case])[run.case]
        plain &= (contact != "R") | (friction <= 0.99 * limit)
        plain &= (contact != "N") | (gap > 1e-4 * p.R)
        plain &= (contact != "S") | (speed > 2 * p.g * coarse_step(p) / STEP_RATIO)
    changes = np.flatnonzero(np.diff(run.case)) + 1
    firsts = np.arange(APART, len(run.time) - PIECE - APART)
    for end in (0, PIECE):
        near = np.min(np.abs((firsts + end)[:, None] - changes), axis=1, initial=len(run.time))
        firsts = firsts[(near >= APART) & plain[firsts + end]]
    # As many pieces with a change of case in them as without, as far as there are.
    inside = np.any((changes > firsts[:, None]) & (changes < firsts[:, None] + PIECE), axis=1)
    chosen: set[int] = set()
    for some in (firsts[inside], firsts[~inside]):
        if len(some):
            places = np.linspace(0, len(some) - 1, count // 2).round().astype(int)
            chosen |= set(some[places].tolist())
    return sorted(chosen)


def _start(
    name: str, p: Parameters, Omega_0: float, state: tuple[float, ...], how: str = ""
) -> Start:
    """A start from natural units: a flow, and a state (8)."""
    x = State.of(np.array(state) * state_units(p))
    if x.y == x.v_y == x.slip_x == 0 and x.h > 0:  # it rolls on the floor
        x = x._replace(slip_z=-x.v_h / p.r)
    return Start(name, p.replace(omega_0=Omega_0 / time_unit(p)), how, x.stacked())


LANDINGS: dict[str, tuple[float, ...]] = {
    "floor, with slip": (0.05, -0.5, 0.5, 0.6, 0.2, -0.9, 0.4, 0.0),
    "floor, no slip": (0.05, -0.5, 0.3, 0.0, 0.1, 0.5, 0.5, 0.0),
    "floor, at a slant": (0.04, -0.4, 0.8, -0.3, 0.3, 0.2, 0.6, -0.5),
    "wall, with slip": (0.5, 0.2, 0.6, 0.3, 0.8, -0.7, 0.04, -0.5),
    "wall, no slip": (0.4, 0.0, 0.5, 0.2, 0.0, 0.0, 0.04, -0.5),
    "wall, at a slant": (0.6, -0.5, 0.9, -0.4, -0.2, 0.1, 0.05, -0.3),
}
"""States in the units of `STARTS`."""
LANDED = ("v_y", "omega_c", "slip_x", "slip_y", "slip_z", "v_h")  # variables that a landing changes


def impacts(runner: Runner, sets: Sets, records: Records) -> Measured:
    """The state six coarse steps after every landing, and in how many runs the contact opens again.
    It does so where its gap, once it has stopped to shrink, grows by more than 1e-2 R: the starts
    are 4 to 5 times that high, and of a plastic landing nothing is left but the fall within a step.
    """
    return together(runner, (_land(runner, name, p) for name, p in sets.items()))


def _land(runner: Runner, name: str, p: Parameters) -> Procedure[None]:
    """The landings of a set."""
    p = p.replace(omega_0=0.8 / time_unit(p))
    unit, step, units = time_unit(p), coarse_step(p) / STEP_RATIO, state_units(p)
    pairs = []
    for how, state in LANDINGS.items():
        start = _start(name, p, 0.8, state, how)
        at, t_end = Conditions(start=how) | state_of(start.x0), round(0.4 * unit / step) * step
        divisors = STEP_RATIO, 2 * STEP_RATIO
        pair = StepPair(**vars(start), t_end=t_end, divisors=divisors, at=at, rows=len(LANDED))
        pairs.append(pair)
    rebounds, tasks, landed = 0, list[Task](), list[tuple[StepPairResult, int, float]]()
    for landing in (yield from stepped(*pairs)):
        tasks += landing.tasks
        for run in landing.reads:
            gap = run.y if _meets_floor(landing.pair) else run.h
            low = int(np.argmax(np.append(np.diff(gap) >= 0, True)))
            rebounds += bool(gap[low:].max() > gap[low] + 1e-2 * p.R)
        if found := _after_landing(landing):
            landed.append((landing, *found))
        else:
            why = f"{landing.pair.name}: the contact did not close for good within 0.4 sqrt(R/g)"
            yield landing.missing(why)
    # By chance a contact may close alike with both steps: what others show counts, too.
    usual = math.sqrt(sum(change**2 for *_, change in landed) / max(len(landed), 1))
    for landing, at_sample, change in landed:
        off, late = uniform(math.hypot(change, usual)), closing_error(runner, p)
        time = float(landing.coarse.time[at_sample])
        for variable in LANDED:
            k = VARIABLES.index(variable)
            x, size = landing.fine.x[2 * at_sample, k], float(units[k])
            value = estimate(x, size, time_step=off, closing=late)
            yield landing.row(f"after_{variable}", value, time=time)
    yield runner.measurement(name, p, "rebounds", rebounds, tasks)


def _meets_floor(pair: StepPair) -> bool:
    """Whether a ball lands on the floor, which is nearer at first, and not on the wall."""
    x = State.of(pair.x0)
    return bool(x.y < x.h)


def _after_landing(landing: StepPairResult) -> tuple[int, float] | None:
    """The sample six coarse steps after a landing, and the largest change of what it changes, in
    natural units, with half the step; None where the contact doesn't stay closed."""
    pair, coarse, fine = landing.pair, landing.coarse, landing.fine
    contact = [case.A if _meets_floor(pair) else case.B for case in coarse.cases]
    at = next((k for k, each in enumerate(contact) if each is not Contact.N), len(contact)) + 6
    if at >= len(contact) or coarse.case[at] != fine.case[2 * at]:
        return None
    changes = np.abs(fine.x[2 * at] - coarse.x[at]) / state_units(pair.p)
    return at, float(changes[[VARIABLES.index(name) for name in LANDED]].max())


THROWN: dict[str, tuple[float, float, tuple[float, ...]]] = {
    "thrown": (0.4, 3.0, (60.0, 1.0, 0.5, 0.6, -0.8, 0.4, 0.6, 0.1)),
    "thrown up": (1.2, 2.0, (60.0, 5.0, -0.6, 0.3, 0.5, -0.9, 0.5, -0.05)),
}
"""omega_0, how long, and the state, each in units of R, sqrt(R/g), and for slip sqrt(g R)/r."""
PULLED_OFF = {
    "pulled off, at rest": (0.3, 0.4, (0.0, 0.0, 0.0, 0.0, 0.0, -1.5, 0.0, 0.0)),
    "pulled off, going round": (0.3, 0.4, (0.0, 0.0, 0.15, 0.2, 0.3, -1.5, 0.0, 0.0)),
}
SLIDING = {
    "slips at the floor": (1.2, 0.5, (0.0, 0.0, 1.3, -0.9, 0.0, 0.0, 0.0, 0.0)),
    "slips at the wall": (0.6, 0.5, (0.0, 0.0, 0.4, 0.0, 1.5, 0.0, 0.0, 0.0)),
    "slips at both": (1.5, 0.5, (0.0, 0.0, 1.2, 0.8, 0.6, 1.0, 0.0, 0.0)),
    "slips off the wall": (0.8, 0.5, (0.0, 0.0, 0.4, 1.2, 0.3, 0.7, 0.5, -0.1)),
    "rolls off the wall": (1.5, 1.0, (0.0, 0.0, 0.3, 0.0, 0.2, 0.2, 0.5, -0.2)),
    "sinks along the wall": (1.0, 1.0, (5.0, -0.3, 0.7, 0.5, 0.6, 0.8, 0.0, 0.0)),
}
BLUNTER = "thrown, blunter"
IN_RAMPS = {"rolls while the flow rises": 0.2, "rolls while the flow falls": -0.2}
"""Rates of the flow, in units of g/R."""
SMOOTH_WALL, ROUGH_FLOOR = AT_A_BORDER = "smooth wall", "rough floor"
"""Starts next to a change of case, of which only case and orbit are measured."""


def late_ramp(p: Parameters, rate: float, time: float) -> Flow:
    """A flow that is steady for half of a time in s, and then changes at a rate in rad/s^2."""
    return Flow.ramp(p.omega_0, p.omega_0 + rate * time / 2, time / 2, time / 2)


def torque(runner: Runner, sets: Sets, records: Records) -> Measured:
    """Case and omega_c from rest of a ball whose spin the fluid brakes."""
    starts = []
    for name, p in sets.items():
        q = p.replace(mu=1.0, eta=1.0, fluid_torque=0.5 * p.c, omega_0=0.6 / time_unit(p))
        starts.append(Start(name, q, "rest", np.zeros(8)))
    yield from settled_readings(runner, starts)


def whole_runs(runner: Runner, sets: Sets, records: Records) -> Measured:
    """Where each start ends: its state; on smooth walls, rough floors case and orbit.

    What the step changes is the uncertainty. Thrown: the ball flies past the axis of the vessel
    without touching anything, long enough for drag to show. Pulled off: beside the wall, with a
    slip on the floor that drives it away; its wall contact carries nothing, or almost nothing, and
    opens. Slips, rolls, sinks: for a while, through whatever cases follow; also in a flow that is
    steady at first, and then rises or falls. Smooth wall: the ball goes round with the fluid, rolls
    on the floor and spins against a wall without friction, in faster and faster flows. Does the
    floor hold it? Rough floor, mu > 1: the ball rolls at both points but for a slight slip. It may
    jam between floor and wall, or the slip may last."""
    pairs = [pair for name, p in sets.items() for pair in _pairs(name, p)]
    for run in (yield from carry_out(runner, pairs)):
        p, how, coarse, fine = run.pair.p, run.pair.name, run.coarse, run.fine
        time = float(fine.time[-1])
        if coarse.case[-1] != fine.case[-1]:
            yield run.missing(f"{how}: with half the time step the ball ends in another case")
        elif how == ROUGH_FLOOR and fine.force_A[:, 1].mean() < PRESSES * p.m * p.g:
            yield run.missing(f"{how}: the contact force is so small that the ball may hover")
        else:
            if at_border := how in AT_A_BORDER:
                yield run.row("case", float(fine.case[-1]), time=time)
            least = lag_error(run.runner, p) if at_border or changes(fine) else 0.0
            for variable, value, size, off in zip(VARIABLES, *_ends(run), strict=True):
                if variable == "omega_c" or not at_border:
                    row = estimate(value, size, time_step=max(off, least))
                    yield run.row(f"end_{variable}", row, time=time)


def _pairs(name: str, p: Parameters) -> Iterator[StepPair]:
    """Step pairs of a set from all starts."""
    unit = time_unit(p)

    def pair(
        how: str, p: Parameters, x: State, lasts: float, rate: float | None = None
    ) -> StepPair:
        count, x0, flow = round(lasts * unit / coarse_step(p)), x.stacked(), None
        t_end, at = count * coarse_step(p), Conditions(start=how) | state_of(x0)
        if rate is not None:
            flow, at = late_ramp(p, rate, t_end), at | Conditions(rate=rate)
        rows = 2 if how in AT_A_BORDER else len(VARIABLES)
        return StepPair(name, p, how, x0, t_end, (4, 8, 16), count, flow=flow, at=at, rows=rows)

    for how, (flow, lasts, x) in (THROWN | PULLED_OFF | SLIDING).items():
        start, q = State(*(np.array(x) * state_units(p))), p.replace(omega_0=flow / unit)
        yield pair(how, q, start, lasts)
        if how == "thrown" and p.drag == QUADRATIC:
            yield pair(BLUNTER, q.replace(C_D=1.1), start, lasts)  # as blunt as a disk
    for how, rate in IN_RAMPS.items():
        q = p.replace(omega_0=0.5 / unit)
        yield pair(how, q, State(omega_c=q.omega_0), 2.0, rate / unit**2)
    for flow in (0.5, 0.7, 0.9, 1.1, 1.3):
        going = State(omega_c=flow / unit, slip_y=math.sqrt(p.g * p.R) / p.r)
        yield pair(SMOOTH_WALL, p.replace(omega_0=flow / unit, eta=0.0), going, 1.0)
    for flow in (1.5, 1.7, 1.8, 2.0, 2.2):
        spin = flow / unit * p.R / p.r
        slight = State(omega_c=flow / unit, slip_x=-5e-4 * spin, slip_z=5e-3 * spin)
        yield pair(ROUGH_FLOOR, p.replace(omega_0=flow / unit, mu=1.7), slight, 1.0)


PROTOCOLS = (
    Protocol("laws", laws),
    Protocol("field", field),
    Protocol("motions", motions),
    Protocol("runs", whole_runs),
    Protocol("torque", torque),
    Protocol("impacts", impacts),
)
