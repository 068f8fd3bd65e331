"""Coordinates in which each case is regular, and what can end it; rates are in `equations`.

At the wall these are the active variables of the case (Table 4), except that each slip is given by
its speed q and its direction (alpha at A, beta at B): friction depends on the direction alone, so
that the rates have limits as the slip vanishes and q simply crosses zero. The slip of RS or SR
keeps to one line, and needs no direction. In SS both pairs are kept, although they share slip_z =
q_A cos alpha = q_B cos beta; deviations from that relation by integration errors are damped.

Away from the wall (RN, SN, NN) the frame rests, so that the vessel's axis is no singular point. The
horizontal motion is kept in complex numbers: position Z = rho e^(i theta), and (a, b) along the
paper's i, k becomes e^(i theta)(-a + i b); coordinates are their real and imaginary parts. The spin
about the vertical never changes.

The first is the azimuth, or Z, the last the work of drag and friction, J. Compiled."""

import cmath
import math
from typing import Any

import numpy as np

from analytic.mechanics import drag, rigid_body
from analytic.simulation import equations
from analytic.simulation.equations import AWAY, NN, NS, RN, RS, SLIPS, SN, SR, SS, Fall, System
from analytic.simulation.motion import HybridState
from model import State

MOST = 8
"""Most coordinates of a case."""
TURNING = ((0, 0), (0, 0), (0, 0), (0, 0), (2, 6), (4, 6), (0, 0), (5, 7), (0, 0))
"""Of each case where among the coordinates slips that turn begin and end, directions between."""


def count_guards(k: System) -> int:
    """How many guards the motion has; the landing of a fall that is known needs none."""
    if k.case == NN:
        return 1 if k.fall.landing < math.inf else 2
    return equations.COUNT_OF_ENDS[k.case]


def begin(case: int, at: HybridState, k: System, z: Any, scale: Any) -> tuple[System, int]:
    """Begin a case: write coordinates z and their sizes; return its constants and their number."""
    if case % 3 == AWAY:
        return _begin_off_wall(case, at, k, z, scale)
    return _begin_on_wall(case, at, k, z, scale)


def _begin_on_wall(case: int, at: HybridState, k: System, z: Any, scale: Any) -> tuple[System, int]:
    """As `begin`: z = (theta; omega_c, off the floor y, v_y, omega_c, slip_x; size and direction of
    slips; work)."""
    x, turns, side, n = at.x, case in (SS, NS), 0.0, 2
    z[0], scale[0] = at.theta, 1.0
    if case // 3 == AWAY:
        z[1], z[2], z[3], z[4], n = x.y, x.v_y, x.omega_c, x.slip_x, 5
        scale[1], scale[2], scale[3], scale[4] = k.R, k.R / k.unit, 1 / k.unit, k.spin
    else:
        z[1], scale[1] = x.omega_c, 1 / k.unit
    for slips, size, direction in (
        (case // 3 == SLIPS, math.hypot(x.slip_x, x.slip_z), at.alpha),
        (case % 3 == SLIPS, math.hypot(x.slip_y, x.slip_z), at.beta),
    ):
        if not slips:
            continue
        z[n], scale[n], side = size, k.spin, math.copysign(1.0, math.sin(direction))
        n += 1
        if turns:
            z[n], scale[n] = direction, 1.0
            n += 1
    z[n], scale[n] = at.work, k.m * k.g * k.R
    return equations.in_case(k, case, side, k.line, equations.NO_FALL), n + 1


def _begin_off_wall(
    case: int, at: HybridState, k: System, z: Any, scale: Any
) -> tuple[System, int]:
    """z = (Z, dZ/dt; in SN speed, direction of the lowest point at rest; in NN y, v_y; work).

    In RN the spin follows; in NN all of it rests, and with Stokes' drag the fall is known
    (`drag.fall`). With another law c depends on all components of the velocity."""
    turn = cmath.exp(1j * at.theta)
    u, speed = rigid_body.velocities(at.x, k), k.R / k.unit
    n, fall = 4, equations.NO_FALL
    place, moves = (k.R - at.x.h) * turn, turn * complex(-u.v_h, u.v_k)
    z[0], z[1], z[2], z[3] = place.real, place.imag, moves.real, moves.imag
    scale[0], scale[1], scale[2], scale[3] = k.R, k.R, speed, speed
    if case == SN:  # at the onset the speed is zero and only alpha tells its direction
        z[4] = abs(moves + 1j * k.r * (turn * complex(-u.o_x, u.o_z)))
        z[5] = cmath.phase(turn * complex(-math.cos(at.alpha), -math.sin(at.alpha)))
        scale[4], scale[5], n = speed, 1.0, 6
    elif case == NN and k.stokes:
        fall = Fall(at.time, at.x.v_y, at.time + drag.fall_time(at.x.y, at.x.v_y, k))
    elif case == NN:
        z[4], z[5], scale[4], scale[5], n = at.x.y, at.x.v_y, k.R, speed, 6
    z[n], scale[n] = at.work, k.m * k.g * k.R
    return equations.in_case(k, case, 0.0, k.line, fall), n + 1


def hybrid_state(t: Any, z: Any, at: HybridState, k: System) -> HybridState:
    """The state with azimuth and work at a time t, from coordinates z of a case begun at `at`.

    An azimuth off the wall is given up to whole turns."""
    if k.case % 3 == AWAY:
        return _hybrid_state_off_wall(t, z, at, k)
    y, v_y, omega_c, w_x, w_y, w_z, alpha, beta = 0.0, 0.0, z[1], 0.0, 0.0, 0.0, math.nan, math.nan
    if k.case // 3 == AWAY:
        y, v_y, omega_c, w_x = z[1], z[2], z[3], z[4]
    if k.case == SR:
        w_x, alpha = k.side * z[2], at.alpha
    elif k.case == RS:
        w_y, beta = k.side * z[2], at.beta
    elif k.case == SS:
        alpha, beta = z[3], z[5]
        w_x, w_y, w_z = z[2] * np.sin(alpha), z[4] * np.sin(beta), z[2] * np.cos(alpha)
    elif k.case == NS:
        beta = z[6]
        w_y, w_z = z[5] * np.sin(beta), z[5] * np.cos(beta)
    return HybridState(t, z[0], State(y, v_y, omega_c, w_x, w_y, w_z, 0.0, 0.0), alpha, beta, z[-1])


def _hybrid_state_off_wall(t: Any, z: Any, at: HybridState, k: System) -> HybridState:
    """As `hybrid_state`, for a ball away from the wall."""
    turn, u = cmath.exp(1j * at.theta), rigid_body.velocities(at.x, k)
    place, moves, y, v_y, alpha, slide = z[0] + 1j * z[1], z[2] + 1j * z[3], 0.0, 0.0, math.nan, 0j
    rho = np.abs(place)
    back = np.conj(place) / rho
    if k.case == NN:
        turned = turn * complex(-u.o_x, u.o_z) * back
        if k.fall.landing < math.inf:
            y, v_y = drag.fall(t - at.time, at.x.y, at.x.v_y, k)
        else:
            y, v_y = z[4], z[5]
    else:
        if k.case == SN:
            slide = z[4] * np.exp(1j * z[5])
            # e^(i theta)(-a + i b) with a, b along the cosine and minus the sine of alpha (6), (8).
            alpha = np.arctan2(-(slide * back).imag, -(slide * back).real)
        turned = (slide - moves) / (1j * k.r) * back
    v = moves * back
    v_h, v_k, o_x, o_z = -v.real, v.imag, -turned.real, turned.imag
    w_x, w_z = o_x - v_k / k.r, o_z - v_y / k.r
    if k.case == RN:  # slip_x = 0 and v_h + r slip_z = 0 hold exactly
        w_x, w_z = 0.0, -v_h / k.r
    # rho = R - h to the last digit
    x = State(y, v_y, v_k / rho, w_x, u.o_y + v_k / k.r, w_z, k.R - rho, v_h)
    return HybridState(t, np.arctan2(place.imag, place.real), x, alpha, math.nan, z[-1])


def least_slip(z: Any, scale: Any, case: int) -> float:
    """The smallest slip whose direction may turn, in natural units; inf if there is none."""
    least = math.inf
    for i in range(TURNING[case][0], TURNING[case][1], 2):
        least = min(least, z[i] / scale[i])
    return least


def rebound_time(at: HybridState, z: Any, k: System, rate: Any) -> float:
    """How long a rebound that begins here lasts by the accelerations now, s; inf if none does."""
    x, lasts = at.x, math.inf
    equations.rates(at.time, z, k, rate)
    if x.y == 0 < x.v_y and k.fall.landing == math.inf:
        rise = rate[5] if k.case == NN else rate[2]
        lasts = 2 * x.v_y / -rise if rise < 0 else lasts
    if x.h == 0 < x.v_h:
        out = -(z[0] * rate[2] + z[1] * rate[3]) / k.R - k.R * x.omega_c**2
        lasts = min(lasts, 2 * x.v_h / -out) if out < 0 else lasts
    return lasts


def arm_guards(values: Any, k: System, arm: Any, level: Any) -> bool:
    """Set values above which guards are armed, and at which they fire; whether a gap begins at 0.

    A guard that starts at zero, where round-off mustn't end the case, has to rise above the
    absolute tolerance first, or to fall below -`rtol`; a gap is armed by any height."""
    opens = False
    for guard in range(len(level)):
        end = equations.ENDS[k.case][guard]
        gap = end == equations.A_LANDS or end == equations.B_LANDS
        arm[guard] = 0.0 if gap else k.rtol / equations.FINER
        level[guard] = 0.0 if values[guard] > arm[guard] else -k.rtol
        opens = opens or (gap and values[guard] == 0)
    return opens
