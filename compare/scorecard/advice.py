"""What to change in contact settings and why, from the theory of the settings; the most harmful first."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from compare.scorecard.native import Native, Touch
from compare.scorecard.trials import ROLLING, SLIPPING
from mjsim import ContactSettings
from model.kinematics import slip_speeds


def advice(native: Native, creep: float, chatter: float) -> Iterator[str]:
    """Sentences; `creep` (m s-1) was measured in rolling, `chatter`, the share of open steps, in fast slipping."""
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
    for name, touch, force, friction, speed in (
        ("A (floor)", native.A, slipping.force_A[1], p.mu, speeds[0]),
        ("B (wall)", native.B, slipping.force_B[0], p.eta, speeds[1]),
    ):
        yield from _of_hovering(native, chatter, name, touch, float(force) / p.m, friction, float(speed))
    yield from _of_softness(native, creep)
    for name, touch in (("A", native.A), ("B", native.B)):
        if 0 < touch.solref[0] < 2 * native.timestep:
            yield (
                f"solref of {name}, {touch.solref[0]:g} s, is shorter than two steps: the engine silently takes "
                f"{2 * native.timestep:g} s."
            )
    if native.noslip_iterations:
        yield "noslip_iterations cure the creep of rolling contacts, not hovering, and cost time in every step."
    fitting = ContactSettings.for_problem(p, native.timestep)
    yield (
        f'For this problem and step the theory asks for cone elliptic, solref "{fitting.solref[0]:g} '
        f'{fitting.solref[1]:g}", solreffriction "{fitting.solreffriction:.3g} 1", solimp "{fitting.solimp:.3g} '
        f'{fitting.solimp:.3g} 0.0001 0.5 2", impratio {fitting.impratio:.3g}.'
    )


def _of_hovering(
    native: Native, chatter: float, name: str, touch: Touch, load: float, friction: float, speed: float
) -> Iterator[str]:
    theory = native.theory(touch, load)
    number = theory.hover_number(load, friction, speed)
    if number > 1:
        yield (
            f"hovering at {name}: in {SLIPPING.name} the ball slips at {speed:.2f} m/s, but contact is continuous only "
            f"up to {theory.fastest_slip(load, friction):.2g} m/s (hover number {number:.2g}, must be < 1; measured: "
            f"contact lost in {chatter:.0%} of the steps). Soften the friction rows (solreffriction, "
            f"now {theory.solreffriction:.2g} s) and lower the impedance (solimp, now {theory.solimp:.2g}): the limit "
            "is (1 − d)/d · N/(m · friction · b_f)."
        )


def _of_softness(native: Native, creep: float) -> Iterator[str]:
    """Creep of rolling contacts, and how deep the ball sinks in."""
    p, theory = ROLLING.p, native.theory(native.A, ROLLING.p.g)
    friction_A = float(np.hypot(*ROLLING.solution.force_A[[0, 2]])) / p.m
    predicted = float(theory.creep_speed(friction_A))
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
