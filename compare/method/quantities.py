"""What is measured: every quantity with its symbol, unit, and required resolution.

A check has the resolution r if it would notice a prediction that is off by r times the quantity's
scale, see `claim.Criterion`. A check with less than `Quantity.resolution` is inconclusive, however
well the numbers agree. That follows from the errors of each protocol at its quick level:

* settled states don't depend on the time step: what is left is their drift, which is waited for
  down to 1e-8. A slip is a difference of spins ten times its size, a force one of accelerations;
* a threshold is bracketed, or extrapolated from settled states as near as their settling allows;
* on the edge between two attractors the oscillation has died out to 1e-4 of the spin, three times
  which is to be resolved; a ball that is pushed leaves the floor within a time step, seen from its
  height of tenths of a millimetre;
* the direction of friction is that of the slip somewhere within a step, and the speed of a landing
  is uncertain by the fall within a step: about a thousandth of either;
* hops have errors of second order in the step h, (omega_0 h)^2/24 = 5e-5 for the coarser one, three
  quarters of which is its difference from the finer. A disturbance shrinks by a tenth a hop, so
  that errors add up to ten times as much: 4e-4. A step of the flow by 4e-2 has shrunk to a
  hundredth when hops are measured: 4e-4. Three times both are 1.7e-3 of omega_c; sixteen times as
  much, 2.7e-2, of the height, since hops are lowest at a sixteenth of a flow above their onset;
  half as much as that of the period, which goes with the root of the height. A multiplier comes
  from the ten hops in which a disturbance is neither too large nor lost in errors. It rises by half
  of the relative change of eta: known to 4e-3, it gives the eta at which it is 1 to 8e-3, three
  times which is to be resolved;
* motions to their ends are compared at two time steps, to a thousandth of what gravity does in the
  unit of time; pulsations and jumps to a thousandth, to which the onset of slip is bracketed. Slip
  begins within a time step, a few hundredths of a period, near a maximum; the mean reading and the
  flow by which a ramp passes a fold are small differences of flows;
* a contact rolls once friction can stop its slip within a step: at g h, 1/160 of sqrt(g R);
* rates and growths come from short records, and a time step has an error of some tenths of a
  percent.

Moved after results had been seen, with the reasons above found then: those of hops, four times in a
day (their period 2e-2, 4e-2, 2e-3, 2e-2, 1.5e-2; omega_c 2e-2, 4e-2, 2e-3, 2e-2, 2e-3; height 2e-1,
2e-2, 3e-2; multiplier 0.1, 0.25); and that of laws in motion, 1e-3 of the median sample, now 6e-3
of the worst."""

import math
from collections.abc import Callable
from dataclasses import dataclass

from compare.method.scales import dragged_speed, rotation_scale, slip_scale, slip_unit, weight
from model import InputError, Parameters
from model.errors import suggestion
from model.kinematics import VARIABLES, state_units

Scale = Callable[[Parameters], float]  #: a natural size, by a parameter set


@dataclass(frozen=True)
class Quantity:
    """A measured quantity."""

    name: str
    symbol: str
    unit: str  #: SI
    resolution: float  #: largest relative error of a prediction that a check may overlook
    scale: Scale | None = None  #: its natural size; None where that is the predicted value
    of: str = ""
    """The variable, or force, of which it is the value, the rate of change, or the value at the
    end; empty for what no state has."""
    threshold: bool = False  #: whether it is a flow at which stationary solutions begin or end

    def size(self, p: Parameters, value: float = math.nan) -> float:
        """Natural size, by which its errors are divided: that of `scale`, or of a value."""
        return abs(value) if self.scale is None else self.scale(p)


def _unit_of(variable: str) -> Scale:
    """The natural size of a variable of the state."""
    return lambda p: float(state_units(p)[VARIABLES.index(variable)])


def _one(p: Parameters) -> float:
    """The scale of ratios, angles, and deviations that are divided by their scales already."""
    return 1.0


_SLIPS = {"slip_x": "ω̃_x", "slip_y": "ω̃_y", "slip_z": "ω̃_z"}
_TURNS: tuple[tuple[str, str, Scale], ...] = (
    ("omega_c", "ω_c", rotation_scale),
    *((name, symbol, slip_scale) for name, symbol in (_SLIPS | {"wall_spin": "ω_x⁰"}).items()),
)
"""Rates of rotation: name, symbol, and scale."""
_RATES: tuple[tuple[str, str, str, Scale], ...] = (
    *((name, name, "m s-1", lambda p: p.g) for name in ("v_y", "v_h")),
    ("omega_c", "ω_c", "rad s-1", lambda p: p.g / p.R),
    *((name, symbol, "rad s-1", lambda p: p.g / p.r) for name, symbol in _SLIPS.items()),
)
"""Variables with a rate of change: name, symbol, unit, and the scale of the rate."""
_FORCES = {f"{contact}{axis}": f"{contact}_{axis}" for contact in "AB" for axis in "xyz"}
# determined where both contacts roll
_FORCES |= {"Ax-By": "A_x − B_y", "Ay+By": "A_y + B_y", "Bx+By": "B_x + B_y"}
_ALL = (
    Quantity("case", "case", "1", 0.0),
    Quantity("cases", "cases reached", "1", 0.0),
    *(
        Quantity(n, symbol, "rad s-1", 1e-7 if n == "omega_c" else 1e-6, scale, of=n)
        for n, symbol, scale in _TURNS
    ),
    Quantity("v_y", "v_y", "m s-1", 1e-6, dragged_speed, of="v_y"),
    Quantity("y", "y", "m", 1e-2, of="y"),
    *(Quantity(f"force_{n}", symbol, "N", 1e-5, weight, of=n) for n, symbol in _FORCES.items()),
    *(
        Quantity(f"moving_force_{n}", f"{symbol} in motion", "N", 5e-3, weight, of=n)
        for n, symbol in _FORCES.items()
    ),
    Quantity("decay_rate", "−Re λ", "s-1", 2e-2),
    Quantity("slowest_decay", "slowest −Re λ < 0", "s-1", 2e-2),
    Quantity("frequency", "Im λ", "rad s-1", 2e-2),
    Quantity("response", "answer to a push", "1", 5e-2, _one),
    Quantity("gamma", "γ", "rad s-2", 2e-2, slip_unit),
    Quantity("steepest", "β₁", "rad", 2e-2, _one),
    Quantity("filippov_share", "δ", "1", 2e-2, _one),
    Quantity("gamma_zero", "ω₀ at γ = 0", "rad s-1", 2e-2),
    Quantity("gamma_slope", "dγ/dω₀", "s-1", 2e-2),
    Quantity("gamma_zero_square", "ω₀² at γ = 0", "rad2 s-2", 2e-2),
    Quantity("gamma_slope_square", "dγ/d(ω₀²)", "rad-1", 2e-2),
    *(
        Quantity(f"rate_{n}", f"d{symbol}/dt", unit.replace("-1", "-2"), 5e-3, scale, of=n)
        for n, symbol, unit, scale in _RATES
    ),
    *(
        Quantity(f"after_{n}", f"{symbol} after", unit, 5e-2, _unit_of(n), of=n)
        for n, symbol, unit, _ in _RATES
    ),
    Quantity("rebounds", "landings that rebound", "1", 0.0),
    *(
        Quantity(f"omega_0{k}", f"ω₀{digit}", "rad s-1", resolution, threshold=True)
        for k, digit, resolution in zip((1, 2, 3, 4), "₁₂₃₄", (1e-4, 1e-4, 1e-4, 1e-3), strict=True)
    ),
    *(
        Quantity(f"edge_{n}", f"{symbol} on the edge", "rad s-1", 1e-3, scale, of=n)
        for n, symbol, scale in _TURNS
    ),
    Quantity("lifts", "leaves the floor", "1", 0.0),
    Quantity("lift_onset", "ω_c at A_y = 0", "rad s-1", 2e-2),
    Quantity("critical_drag", "c at η = η_cr", "s-1", 4e-3),
    Quantity("folds", "number of folds", "1", 0.0),
    Quantity("slope", "dω_c/dω₀", "1", 1e-4, _one),
    Quantity("law", "deviation from the law", "1", 1e-6),
    Quantity("law_in_motion", "largest deviation from the law", "1", 6e-3, _one),
    Quantity("friction_ratio", "friction divided by normal force", "1", 1e-6),
    Quantity("time", "t", "s", 1e-2),
    Quantity("landing_speed", "v_y at landing", "m s-1", 1e-3),
    Quantity("landing_impulse", "vertical impulse of a landing", "N s", 4e-2),
    *(
        Quantity(f"end_{n}", f"{s} at the end", u, 5e-3, _unit_of(n), of=n)
        for n, s, u in (("y", "y", "m"), ("h", "h", "m"), *(rate[:3] for rate in _RATES))
    ),
    Quantity("orbit_period", "period", "s", 1.5e-2),
    Quantity("orbit_omega_c", "mean ω_c of a period", "rad s-1", 2e-3),
    Quantity("orbit_height", "height of the hops", "m", 3e-2),
    Quantity("orbit_multiplier", "largest |Floquet multiplier|", "1", 0.25),
    Quantity("orbit_birth", "ω₀ where hopping begins", "rad s-1", 2e-2),
    Quantity("orbit_death", "η from which hops don't last", "1", 2.5e-2),
    Quantity("hops", "hops on", "1", 0.0),
    Quantity("swing_period", "period of the swing", "s", 1e-3),
    Quantity("swing_omega_c", "mean ω_c of a swing", "rad s-1", 1e-5),
    Quantity("swing_size", "swing of ω_c", "rad s-1", 2e-2),
    Quantity("lift", "height of a lifted ball", "m", 5e-2),
    Quantity("gain", "ω_c/ω₀", "1", 5e-3),
    Quantity("phase_lag", "phase lag", "rad", 5e-3),
    Quantity("slip_amplitude", "amplitude at which slip begins", "rad s-1", 1e-2),
    Quantity("mean_error", "mean of ω_c − ω₀", "rad s-1", 2e-2),
    Quantity("jump_delay", "delay of a jump", "s", 1e-2),
    Quantity("jump_peak", "time of the peak after a jump", "s", 1e-2),
    Quantity("jump_height", "height of the peak after a jump", "1", 1e-2),
    Quantity("ramp_end", "ω₀ at which a ramp has halved the lag", "rad s-1", 2e-2),
)
QUANTITIES: dict[str, Quantity] = {each.name: each for each in _ALL}  #: every quantity by name


def quantity(name: str) -> Quantity:
    """The quantity of a name; `InputError` with a suggestion if there is none."""
    if name not in QUANTITIES:
        raise InputError(f"no quantity is called {name!r}{suggestion(name, QUANTITIES)}")
    return QUANTITIES[name]
