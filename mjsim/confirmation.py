"""The theory of `mjsim.contact_settings`, held against what MuJoCo does.

``python -m mjsim.confirmation`` prints the table; given a file, such as docs/mujoco-settings.md, it is put there
between two lines that say so.
"""

from __future__ import annotations

import itertools
import sys
import warnings
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mjsim.contact_settings import ContactSettings
from mjsim.engine import Run, simulate
from model import Flow, InputError, Parameters, Trajectory


@dataclass(frozen=True)
class Row:
    """One formula at one setting."""

    what: str
    unit: str
    predicted: float
    measured: float

    @property
    def ratio(self) -> float:
        """Measured over predicted."""
        return self.measured / self.predicted


ROLLING = Parameters.named("reference").replace(omega_0=10.0)
SLIPPING = Parameters.named("reference").replace(omega_0=25.0)
SLIPPING_START = (0.0, 0.0, 13.85, -4.0, 0.0, 10.0)
"""A start close enough to steady slipping to settle within a few seconds."""


BEGIN, END = "<!-- begin: python -m mjsim.confirmation -->", "<!-- end -->"
"""Lines of a page between which its table stands."""


def rows() -> list[Row]:
    """Predicted and measured values of every formula, a few settings each; takes about half a minute."""
    return [*_depths(), *_margins(), *_creep(), *_hover(), *_decay()]


def table() -> str:
    """The rows as a table in Markdown."""
    lines = ["| what | unit | predicted | measured | ratio |", "|---|---|---|---|---|"]
    lines += [f"| {r.what} | {r.unit} | {r.predicted:.6g} | {r.measured:.6g} | {r.ratio:.4f} |" for r in rows()]
    return "\n".join(lines)


def _steady(p: Parameters, start: tuple[float, ...], settings: ContactSettings, t_end: float) -> Trajectory:
    return simulate(p, start, t_end, settings=settings, sample_interval=t_end / 100)


def _depths() -> list[Row]:
    """Without servo a ball at rest on the floor sinks in by (1 - d) g tc^2, in slipping by less."""
    found = []
    rest = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.01, 0.0)
    for timestep, solimp in itertools.product((4e-3, 1e-3), (0.03, 0.3)):
        settings = _at(timestep, solimp=solimp, servo=0.0)
        run = _steady(ROLLING.replace(omega_0=0.0), rest, settings, 2.0)
        what = f"depth at rest, h = {timestep * 1e3:g} ms, d = {solimp:g}"
        found.append(Row(what, "m", settings.margin(ROLLING.g), -float(run.gap_A[-1])))
        run = _steady(SLIPPING, SLIPPING_START, settings, 10.0)
        load, slip = float(run.force_A[-1, 1]) / SLIPPING.m, float(run.slip_speed_A[-1])
        what = f"depth at A in slipping, h = {timestep * 1e3:g} ms, d = {solimp:g}"
        found.append(Row(what, "m", settings.margin(load, SLIPPING.mu, slip), -float(run.gap_A[-1])))
    return found


def _margins() -> list[Row]:
    """With servo the margin comes to the depth, and the gap to nothing."""
    found = []
    for memory, solimp in itertools.product((True, False), (0.03, 0.1)):
        settings = _at(1e-3, solimp=solimp, memory=memory, impratio=30.0)
        run = Run([SLIPPING], [SLIPPING_START], 10.0, [Flow.steady(25.0)], settings, batched=False)
        last = [blocks[0][-1] for blocks in run][-1]
        for k, (contact, axis, friction) in enumerate((("A", 1, SLIPPING.mu), ("B", 0, SLIPPING.eta))):
            load, slip = last[f"force_{contact}"][axis] / SLIPPING.m, float(last[f"slip_speed_{contact}"])
            what = f"margin at {contact} in slipping, d = {solimp:g}{'' if memory else ', no memory'}"
            found.append(Row(what, "m", settings.margin(load, friction, slip), float(run.margins[0, k])))
    return found


def _creep() -> list[Row]:
    """Without memory a rolling contact creeps at R_t f/b_f."""
    found = []
    for solimp, impratio in itertools.product((0.03, 0.3), (1e3, 1e5)):
        settings = _at(1e-3, solimp=solimp, impratio=impratio, memory=False)
        run = _steady(ROLLING, (0.0, 0.0, 10.0, 0.0, 0.0, 0.0), settings, 10.0)
        friction = float(np.hypot(run.force_A[-1, 0], run.force_A[-1, 2])) / ROLLING.m
        what = f"creep at A in rolling, d = {solimp:g}, impratio = {impratio:g}"
        found.append(Row(what, "m s-1", float(settings.creep_speed(friction)), float(run.slip_speed_A[-1])))
    return found


def _hover() -> list[Row]:
    """The friction damping b_f from which steady slipping loses contact in some step, by bisection."""
    found = []
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="the ball slips")  # that is what is looked for
        for solimp in (0.3, 0.5):
            low, high = 0.01, 1.0
            while high - low > 0.01 * high:
                middle = (low + high) / 2
                run = _every_step(solimp, middle)
                closed = np.all((run.force_A[1000:, 1] > 0) & (run.force_B[1000:, 0] > 0))
                low, high = (middle, high) if closed else (low, middle)
            run, settings = _every_step(solimp, low), _at(1e-3, solimp, low)
            load, slip = float(run.force_A[-1, 1]) / SLIPPING.m, float(run.slip_speed_A[-1])
            limit = low / settings.hover_number(load, SLIPPING.mu, slip)
            found.append(Row(f"b_f h from which slipping hovers, d = {solimp:g}", "1", limit, (low + high) / 2))
    return found


def _every_step(solimp: float, damping: float) -> Trajectory:
    return simulate(SLIPPING, SLIPPING_START, 3.0, settings=_at(1e-3, solimp, damping), sample_interval=1e-3)


def _decay() -> list[Row]:
    """In rolling a slip velocity dies out by the factor 1 - b_f h A/(A + R_t) a step."""
    found = []
    for damping, impratio in itertools.product((0.2, 0.5), (1e2, 1e5)):
        settings = _at(1e-3, 0.03, damping, impratio=impratio, memory=False, order=1)
        p = ROLLING.replace(omega_0=0.0, mu=1.0)
        # A spin too slow to reach the cone; a friction row at the floor sees A_t = (1 + 1/j)/m.
        spin = 0.5 * float(settings.regularisation_speed(p.mu * p.g)) / p.r
        run = simulate(p, (0, 0, 0, 0, 0, spin, 0.01, 0), 0.02, settings=settings, sample_interval=1e-3)
        share = 1 / (1 + settings.softness / impratio / (1 + 1 / p.j))
        measured = float(run.slip_speed_A[3] / run.slip_speed_A[2])
        what = f"slip left after a step of rolling, b_f h = {damping:g}, impratio = {impratio:g}"
        found.append(Row(what, "1", 1 - damping * share, measured))
    return found


def _at(timestep: float, solimp: float, damping: float = 0.5, **changes: float) -> ContactSettings:
    """Settings with the given impedance and friction damping b_f h."""
    return ContactSettings.at(timestep, solimp=solimp, solreffriction=2 * timestep / (solimp * damping), **changes)


def write(page: Path) -> None:
    """Put the table where the page has it; raises `InputError` if it has no place for it."""
    text = page.read_text("utf-8")
    if text.count(BEGIN) != 1 or text.count(END) != 1:
        raise InputError(f"{page} must have the lines {BEGIN!r} and {END!r} once each")
    before, rest = text.split(BEGIN)
    page.write_text(f"{before}{BEGIN}\n{table()}\n{END}{rest.split(END)[1]}", "utf-8")


if __name__ == "__main__":
    if len(sys.argv) > 1:
        write(Path(sys.argv[1]))
    else:
        print(table())
