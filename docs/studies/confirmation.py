"""The formulas of `mjsim.contact_settings` beside what MuJoCo does."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from docs.studies import states
from docs.studies.states import EPS
from mjsim import ContactSettings, Run, simulate
from model import State

ROLLING = states.SMOOTH.replace(omega_0=10.0)
SLIPPING = states.SLIPPING.p
TOLERANCE = 1e-12
"""Of a solver, to which the formulas are held; that of mjsim/scene.xml is tighter."""
SLIPPING_START = State(omega_c=13.85, slip_x=-4.0, slip_z=10.0)
"""A start close enough to steady slipping to settle within a few seconds."""


@dataclass(frozen=True)
class Row:
    """One formula at one setting."""

    what: str
    unit: str
    predicted: float
    measured: float
    tolerance: float
    """Relative: what the formula leaves out, or the measurement can't resolve."""

    @property
    def error(self) -> float:
        """Relative."""
        return self.measured / self.predicted - 1

    @property
    def agrees(self) -> bool:
        """Whether the formula holds within the tolerance."""
        return abs(self.error) <= self.tolerance


def rows() -> list[Row]:
    """Predicted and measured values of every formula, a few settings each."""
    return [*_depths(), *_creep(), *_hover(), *_decay()]


def table() -> list[list[str]]:
    """The rows as text, with their head."""
    body = [
        [
            r.what,
            r.unit,
            f"{r.predicted:.6g}",
            f"{r.measured:.6g}",
            f"{r.error:+.1e}",
            f"{r.tolerance:.1e}",
        ]
        for r in rows()
    ]
    return [["what", "unit", "predicted", "measured", "relative error", "allowed"], *body]


def _at(timestep: float, solimp: float, damping: float = 0.5, **changes: float) -> ContactSettings:
    """Settings with the given impedance and friction damping b_f h."""
    friction = 2 * timestep / (solimp * damping)
    given = {"solimp": solimp, "solreffriction": friction} | changes
    return ContactSettings.at(timestep, **given)


def _turning(timestep: float) -> float:
    """What steady slipping leaves out: the contact turns within a step, by an angle whose square
    counts."""
    return float(SLIPPING_START.omega_c * timestep) ** 2


def _depths() -> Iterator[Row]:
    """A ball at rest on the floor sinks in by (1 - d) g tc^2, one that slips by less."""
    still, inside = ROLLING.replace(omega_0=0.0), State(h=0.01)
    for timestep, solimp in itertools.product((4e-3, 1e-3), (0.03, 0.3)):
        settings = _at(timestep, solimp)
        setting = f"h = {timestep * 1e3:g} ms, d = {solimp:g}"
        run, depth = simulate(still, inside, 2.0, settings=settings), settings.depth(still.g)
        round_off = EPS * still.R / depth * len(run.time)
        yield Row(f"depth at rest, {setting}", "m", depth, -float(run.gap_A[-1]), round_off)
    for solimp in (0.03, 0.1):
        settings = _at(1e-3, solimp, impratio=30.0)
        last = _steady_slipping(settings)
        for contact, axis, friction in (("A", 1, SLIPPING.mu), ("B", 0, SLIPPING.eta)):
            load = float(last[f"force_{contact}"][axis]) / SLIPPING.m
            hover = settings.hover_number(load, friction, float(last[f"slip_speed_{contact}"]))
            depth = settings.depth(load) * (1 - hover + friction**2 / settings.impratio)
            what = f"depth at {contact} in slipping, d = {solimp:g}"
            yield Row(what, "m", depth, -float(last[f"gap_{contact}"]), _turning(1e-3))


def _steady_slipping(settings: ContactSettings) -> np.void:
    """Last sample of a run that settles in slipping at both points."""
    *_, block = Run(SLIPPING, SLIPPING_START, 10.0, settings=settings)
    last: np.void = block[-1]
    return last


def _creep() -> Iterator[Row]:
    """A rolling contact creeps at R_t f/b_f.

    The solver stops within its tolerance of the least cost, which is quadratic in the force, and
    impratio times as steep in the friction rows."""
    for solimp, impratio in itertools.product((0.03, 0.3), (1e3, 1e5)):
        settings = _at(1e-3, solimp, impratio=impratio)
        run = simulate(ROLLING, (0.0, 0.0, ROLLING.omega_0, 0.0, 0.0, 0.0), 10.0, settings=settings)
        friction = float(np.hypot(run.force_A[-1, 0], run.force_A[-1, 2])) / ROLLING.m
        creep, stops = float(settings.creep_speed(friction)), float(np.sqrt(TOLERANCE * impratio))
        what = f"creep at A in rolling, d = {solimp:g}, impratio = {impratio:g}"
        yield Row(what, "m s-1", creep, float(run.slip_speed_A[-1]), stops)


def _hover() -> Iterator[Row]:
    """The friction damping b_f at which steady slipping has no depth left, on a line through two
    smaller ones.

    There it would begin to hover; near that a contact that is disturbed goes on hovering.
    """
    for solimp in (0.3, 0.5):
        settings = [_at(1e-3, solimp, damping) for damping in (0.1, 0.2)]
        before, last = (_steady_slipping(each) for each in settings)
        first, second = -before["gap_A"], -last["gap_A"]
        load, slip = last["force_A"][1] / SLIPPING.m, float(last["slip_speed_A"])
        softer = settings[1].softness * load * (1 + SLIPPING.mu**2 / settings[1].impratio)
        limit = 0.2 * softer / (SLIPPING.mu * settings[1].b_f * slip)
        what = f"b_f h at which slipping begins to hover, d = {solimp:g}"
        yield Row(what, "1", limit, float(0.1 + 0.1 * first / (first - second)), _turning(1e-3))


def _decay() -> Iterator[Row]:
    """In rolling a slip velocity dies out by the factor 1 - b_f h A/(A + R_t) a step; drag adds c
    h."""
    for damping, impratio in itertools.product((0.2, 0.5), (1e2, 1e5)):
        settings = _at(1e-3, 0.03, damping, impratio=impratio)
        p = ROLLING.replace(omega_0=0.0, mu=1.0, eta=0.0)  # it is away from the wall
        # A spin too slow to reach the cone; a friction row at the floor sees A_t = (1 + 1/j)/m.
        spin = 0.5 * float(settings.creep_speed(p.mu * p.g)) / p.r
        x0 = -settings.depth(p.g), 0, 0, 0, 0, spin, 0.01, 0  # as deep as the floor bears it
        run = simulate(p, x0, 0.02, settings=settings, sample_interval=1e-3)
        share = 1 / (1 + settings.softness / impratio / (1 + 1 / p.j))
        left = float(run.slip_speed_A[3] / run.slip_speed_A[2])
        what = f"slip left after a step of rolling, b_f h = {damping:g}, impratio = {impratio:g}"
        yield Row(what, "1", 1 - damping * share, left, p.c * settings.timestep)
