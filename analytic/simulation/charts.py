"""Coordinates in which the motion of each case is regular, its equations in them, and what can end it.

At the wall these are the active variables of the case (Table 4), except that each slip is given by its speed q and its
direction (alpha at A, beta at B): friction depends on the direction alone, so that the rates have limits as the slip
vanishes and q simply crosses zero. The slip of RS or SR keeps to one line, and needs no direction. In SS both pairs are
kept, although they share slip_z = q_A cos alpha = q_B cos beta; deviations from that relation by integration errors are
damped.

Away from the wall (RN, SN, NN) the frame rests, so that the vessel's axis is no singular point. The horizontal motion
is kept in complex numbers: position Z = rho e^(i theta), and (a, b) along the paper's i, k becomes
e^(i theta)(-a + i b); coordinates are their real and imaginary parts. The spin about the vertical never changes.

The first coordinate is the azimuth, or Z, the last one the work of drag and friction, J. `equations` has their rates.
"""

from __future__ import annotations

import cmath
import math

import numpy as np

from analytic.mechanics import drag
from analytic.mechanics.rigid_body import Velocities, state, velocities
from analytic.simulation.equations import FEASIBILITY, STABILITY, Motion
from analytic.simulation.motion import Chart, Fluid, Moment, Path, natural_units
from model import Case, Contact, Parameters, State
from model.arrays import Array
from model.drag import STOKES
from model.kinematics import SLIP_XYZ

ENDS = {
    Case.RR: ("RR ends",),
    Case.RS: ("B sticks", "A slips"),
    Case.SR: ("A sticks", "B slips", "A lifts"),
    Case.SS: ("A sticks", "B sticks", "A lifts", "B opens"),
    Case.NR: ("A lands", "B slips"),
    Case.NS: ("A lands", "B sticks"),
    Case.RN: ("A slips", "B lands"),
    Case.SN: ("A sticks", "B lands"),
    Case.NN: ("B lands", "A lands"),
}
"""What can end each case; at the wall what the coordinates show first, then what forces do."""
LEAVES = {"slip-stability": STABILITY, "infeasible": FEASIBILITY}


def chart(case: Case, at: Moment, p: Parameters, omega_0: Fluid, floor: float, leave_rolling: str) -> Chart:
    """The chart of a case that starts at a moment; when RR ends is for `leave_rolling` to say, as in `Settings`.

    `floor` is the slip in natural units below which the turning rate of its direction is capped: the rate is inverse to
    the slip, and directions settle before the slip vanishes.
    """
    if case.B is Contact.N:
        return _away_from_wall(case, at, p, omega_0, floor)
    return _at_wall(case, at, p, omega_0, floor, leave_rolling)


def _motion(
    case: Case, p: Parameters, omega_0: Fluid, floor: float, *, side: float = 0.0, leaves: str = "slip-stability",
    falls: bool = False, since: float = 0.0, v_y: float = 0.0,
) -> Motion:  # fmt: skip
    """What the rates depend on, as plain numbers."""
    ball = {name: float(getattr(p, name)) for name in ("m", "r", "R", "j", "mu", "eta", "g")}
    line = {name: float(getattr(omega_0, name)) for name in ("start", "value", "slope")}
    unit, _, spin, _ = natural_units(p)
    return Motion(
        int(case), **ball, law=drag.Law(*map(float, drag.law(p))), **line, waves=omega_0.waves, floor=floor, side=side,
        leaves=LEAVES[leaves], falls=falls, since=since, v_y=v_y, unit=unit, spin=spin,
    )  # fmt: skip


def _at_wall(case: Case, at: Moment, p: Parameters, omega_0: Fluid, floor: float, leave_rolling: str) -> Chart:
    """(theta; omega_c, off the floor y, v_y, omega_c, slip_x; speed and direction of each slip; work)."""
    T, v, w, E = natural_units(p)
    turns, free = case in (Case.SS, Case.NS), slice(0, 4) if case.A is Contact.N else slice(2, 3)
    start, scale = [at.theta, *at.x[free]], [1.0, *[p.R, v, 1 / T, w][free]]
    first = len(start)
    points = (case.A, SLIP_XYZ.start, at.alpha), (case.B, SLIP_XYZ.start + 1, at.beta)
    slips = [(k, angle) for contact, k, angle in points if contact is Contact.S]
    for k, angle in slips:
        start += [math.hypot(at.x[k], at.x.slip_z)] + [angle] * turns
        scale += [w] + [1.0] * turns
    side = math.copysign(1.0, math.sin(slips[0][1])) if slips and not turns else 0.0

    def path(t: Array, z: Array) -> Path:
        x = [np.zeros_like(t)] * len(State._fields)
        x[free], speeds = list(z[1:first]), z[first:-1]
        angles = [np.full_like(t, angle) for _, angle in slips]
        if turns:
            speeds, angles = speeds[::2], list(z[first + 1 : -1 : 2])
            x[SLIP_XYZ.stop - 1] = speeds[0] * np.cos(angles[0])
        for (k, _), q, angle in zip(slips, speeds, angles, strict=True):
            x[k] = q * (np.sin(angle) if turns else side)
        own = {k: angle for (k, _), angle in zip(slips, angles, strict=True)}
        alpha, beta = (own.get(k, np.full_like(t, math.nan)) for _, k, _ in points)
        return Path(t, z[0], State(*x).stacked(), alpha, beta, z[-1])

    own = tuple(range(first, len(start), 2)) if turns else ()
    motion = _motion(case, p, omega_0, floor, side=side, leaves=leave_rolling)
    return Chart([*start, at.work], [*scale, E], motion, ENDS[case], path, slips=own)


def _away_from_wall(case: Case, at: Moment, p: Parameters, omega_0: Fluid, floor: float) -> Chart:
    """(Z, dZ/dt; in SN speed of the lowest point and its direction in the resting frame; in NN y, v_y; work).

    In RN the spin follows; in NN all of it rests, and with Stokes' drag the fall is known (`drag.fall`). With another
    law c depends on all components of the velocity.
    """
    _, v, _, E = natural_units(p)
    turn, u = cmath.exp(1j * at.theta), velocities(at.x, p)
    Z_0, V_0, spin = (p.R - at.x.h) * turn, turn * complex(-u.v_h, u.v_k), turn * complex(-u.o_x, u.o_z)
    start, scale = [Z_0.real, Z_0.imag, V_0.real, V_0.imag], [p.R, p.R, v, v]
    falls, ends, landing = case is Case.NN and p.drag == STOKES, ENDS[case], math.inf
    if case is Case.SN:  # at the onset the speed is zero and only alpha tells its direction
        phase = cmath.phase(turn * complex(-math.cos(at.alpha), -math.sin(at.alpha)))
        start, scale = [*start, abs(V_0 + 1j * p.r * spin), phase], [*scale, v, 1.0]
    elif falls:
        ends, landing = ends[:1], at.time + drag.fall_time(at.x.y, at.x.v_y, p)
    elif case is Case.NN:
        start, scale = [*start, at.x.y, at.x.v_y], [*scale, p.R, v]

    def path(t: Array, z: Array) -> Path:
        Z, V, more = z[0] + 1j * z[1], z[2] + 1j * z[3], z[4:-1]
        rho, back, none = np.abs(Z), np.conj(Z) / np.abs(Z), np.full_like(t, math.nan)
        y, v_y = more if case is Case.NN and not falls else np.zeros((2, len(t)))
        if falls:
            y, v_y = drag.fall(t - at.time, at.x.y, at.x.v_y, p)
        slide = more[0] * np.exp(1j * more[1]) if case is Case.SN else 0.0
        turned = np.full(len(t), spin) if case is Case.NN else (slide - V) / (1j * p.r)
        V, turned = V * back, turned * back
        u_t = Velocities(-V.real, v_y, V.imag, -turned.real, u.o_y, turned.imag)
        x = state(y, p.R - rho, u_t, p)._replace(omega_c=V.imag / rho)  # rho = R - h to the last digit
        if case is Case.RN:  # slip_x = 0 and v_h + r slip_z = 0 hold exactly
            x = x._replace(slip_x=0.0, slip_z=-x.v_h / p.r)
        # e^(i theta)(-a + i b) with a, b along the cosine and minus the sine of alpha (6), (8).
        alpha = np.arctan2(-(slide * back).imag, -(slide * back).real) if case is Case.SN else none
        theta = np.unwrap(np.append(at.theta, np.angle(Z)))[1:]
        return Path(t, theta, x.stacked(), alpha, none, z[-1])

    own = (4,) if case is Case.SN else ()
    motion = _motion(case, p, omega_0, floor, falls=falls, since=at.time, v_y=float(at.x.v_y))
    return Chart([*start, at.work], [*scale, E], motion, ends, path, landing, own)
