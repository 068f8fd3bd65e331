"""Design of a flowmeter: sensitivity of limits to data, reading with tolerances, best choice.

Everything rests on `thresholds`, `operating_range` and the branch of SS, whatever the law of drag.
A meter is given as a function `make` that takes values by name and returns `Parameters`:
`p.replace`, or `Parameters.from_fluid` with some arguments filled in."""

from __future__ import annotations

import dataclasses
import itertools
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from analytic.bifurcation import diagram as bifurcation
from analytic.bifurcation.diagram import Thresholds
from analytic.flowmeter import characteristic as flowmeter
from analytic.flowmeter import real_fluid
from analytic.flowmeter.characteristic import OperatingLimit
from analytic.mechanics import roots
from analytic.stationary import slipping_branch
from model import InputError, Parameters, drag
from model.arrays import Array

Make: TypeAlias = Callable[..., Parameters]
"""Parameters of a meter from values by name."""
Values: TypeAlias = Mapping[str, float]
Interval: TypeAlias = tuple[float, float]
"""Lowest and highest value."""

INEXACT = ("mu", "eta", "r", "R")
"""What may have a tolerance: friction and size."""
THRESHOLDS = ("omega_01", "omega_02", "omega_03", "omega_04")
_LOG_STEP = 1e-3
"""Of the differences, in the logarithm of a value."""
_TIE = 1e-3
"""Weight of the logarithm of the response time: it decides between equal margins."""


@dataclass(frozen=True)
class Sensitivity:
    """d ln omega_0k / d ln of a value: by how many per cent a threshold changes if the value does
    by one."""

    value: float
    """nan where the threshold doesn't exist, or the value isn't allowed, on both sides."""
    error: float
    """Estimated from differences of two widths."""


def sensitivities(make: Make, at: Values) -> dict[str, dict[str, Sensitivity]]:
    """Sensitivity of each threshold to each of the values `at`.

    By central differences in the logarithm, extrapolated from two widths (Richardson). omega_01 to
    omega_03 have closed forms (docs/design.md), with which tests compare; the differences serve any
    law of drag, and the fold."""

    def log_thresholds(name: str, step: float) -> Array:
        try:
            t = bifurcation.thresholds(make(**{**at, name: at[name] * math.exp(step)}))
        except InputError:  # beyond what the value may be: no derivative there
            return np.full(len(THRESHOLDS), np.nan)
        with np.errstate(divide="ignore"):
            return np.log([getattr(t, key) for key in THRESHOLDS])

    found: dict[str, dict[str, Sensitivity]] = {key: {} for key in THRESHOLDS}
    for name in at:
        with np.errstate(invalid="ignore"):
            wide, narrow = (
                (log_thresholds(name, h) - log_thresholds(name, -h)) / (2 * h)
                for h in (_LOG_STEP, _LOG_STEP / 2)
            )
            values, errors = (4 * narrow - wide) / 3, np.abs(narrow - wide) / 3
        for key, value, error in zip(THRESHOLDS, values.tolist(), errors.tolist(), strict=True):
            found[key][name] = Sensitivity(value, error)
    return found


def corners(make: Make, at: Values, tolerances: Values) -> Iterator[Parameters]:
    """The meter with every value at an end of its relative tolerance: x (1 - t) or x (1 + t).

    Limits and readings are monotonic in friction and size, but for a ridge of the operating limit
    at eta = j; so their extremes within the tolerances are at corners."""
    wide = {name: t for name, t in tolerances.items() if t > 0}
    inexact = {name: (at[name] * (1 - t), at[name] * (1 + t)) for name, t in wide.items()}
    for values in itertools.product(*inexact.values()):
        yield make(**{**at, **dict(zip(inexact, values, strict=True))})


def threshold_spread(meters: Sequence[Parameters]) -> dict[str, Interval]:
    """Lowest and highest value of each threshold over some meters, rad s-1; nan if one lacks it."""
    each = np.array([[getattr(bifurcation.thresholds(p), k) for k in THRESHOLDS] for p in meters])
    ends = each.min(axis=0).tolist(), each.max(axis=0).tolist()
    return {key: (low, high) for key, low, high in zip(THRESHOLDS, *ends, strict=True)}


def readings(p: Parameters, omega_0: npt.ArrayLike) -> tuple[Array, Array]:
    """Lowest and highest omega_c of the stationary motions that attract, at flows >= 0, rad s-1.

    They differ where the reading depends on the past (Fig. 13): the lowest is read while the flow
    rises slowly from rest, the highest while it falls. Only SS lags behind the flow, up to its
    fold; whether it swings there, as it may for mu > 1.7, is left out. nan without drag."""
    flows = np.asarray(omega_0, dtype=float) * (1.0 if p.c else np.nan)
    if p.mu == 0 or p.eta >= p.j or p.c == 0:
        return flows, flows
    t, turn, unit = bifurcation.thresholds(p), slipping_branch.fold(p), np.sqrt(p.g / p.R)
    end, ends_in_fold = (slipping_branch.END, False) if np.isnan(turn) else (float(turn), True)
    branch = partial(slipping_branch.branch, p=p)
    s = roots.sign_change(lambda s: branch(s).Omega_0 * unit - flows, -slipping_branch.END, end)
    lagging = np.where(np.isnan(s), flows, branch(s).Omega_c * unit)
    slips = (flows > t.omega_01) & ~(flows > (t.omega_04 if ends_in_fold else t.omega_02))
    return np.where(slips, lagging, flows), np.where(slips & ~(flows > t.omega_02), lagging, flows)


def response_time(p: Parameters) -> float:
    """Time constant (1 + 2j)/c, s, with which a rolling ball follows the flow (docs/theory.md, 9).

    inf for the quadratic law, whose drag has no part linear in the lag."""
    return math.inf if p.drag == drag.QUADRATIC or p.c == 0 else (1 + 2 * p.j) / p.c


@dataclass(frozen=True)
class Choice:
    """A meter with its limits and response, judged for flows up to a given one."""

    values: dict[str, float]
    """What `make` needs to make it."""
    p: Parameters
    limit: OperatingLimit
    """As it is meant to be."""
    worst: OperatingLimit
    """At the corner of the tolerances where the operating range is the shortest."""
    margin: float
    """The worst limit divided by the fastest flow: covered if >= 1."""
    response: float
    """Time constant, s."""


def choice(make: Make, values: Values, tolerances: Values, fastest: float) -> Choice:
    """Limits, margin and response of a meter for flows up to `fastest`, rad s-1."""
    p = make(**values)
    limit = flowmeter.operating_limit(p)
    others = (flowmeter.operating_limit(q) for q in corners(make, values, tolerances))
    worst = min((limit, *others), key=lambda each: each.omega_0)
    return Choice(dict(values), p, limit, worst, worst.omega_0 / fastest, response_time(p))


def best(
    make: Make,
    bounds: Mapping[str, Interval],
    tolerances: Values,
    fastest: float,
    slowest_response: float = math.inf,
    seed: int = 0,
    tell: Callable[[float], object] = float,
) -> Choice:
    """The meter within the bounds whose range exceeds the fastest flow by the largest factor.

    Among all that answer within `slowest_response`, s, the one with the largest margin at the worst
    corner of the tolerances; among equals the quickest. Differential evolution (scipy), as the
    margin has a ridge at eta = j; the seed determines the result. `tell` is called with the
    fraction done: of the decades by which the meters that compete are still to come together.

    Raises `InputError` if no meter within the bounds answers so fast, and says how fast one can."""
    # here, because `predict` shall not wait for it
    from scipy.optimize import Bounds, differential_evolution

    open_names = [name for name, (low, high) in bounds.items() if low < high]
    ends = np.array([bounds[name] for name in open_names]).reshape(-1, 2)
    exact = {name: low for name, (low, _) in bounds.items()}

    def meter_at(unit: npt.ArrayLike) -> Choice:
        chosen = (ends[:, 0] + np.asarray(unit) * (ends[:, 1] - ends[:, 0])).tolist()
        values = {**exact, **dict(zip(open_names, chosen, strict=True))}
        return choice(make, values, tolerances, fastest)

    def cost(unit: Array) -> float:
        c = meter_at(unit)
        delay = math.log(c.response) if math.isfinite(c.response) else 0.0
        late = c.response > slowest_response
        return 100 + delay if late else _TIE * delay - c.margin

    first = 0.0

    def come_together(x: Any, convergence: Any) -> None:  # as scipy calls it
        nonlocal first
        first = first or min(convergence, 1 / math.e)
        if convergence > 0:
            tell(min(1.0, max(0.0, 1 - math.log(convergence) / math.log(first))))

    if open_names:
        each = 4 + 12 // len(ends)  # times the number of values: how many meters compete
        cube = Bounds(np.zeros(len(ends)), np.ones(len(ends)))
        how: dict[str, Any] = {"rng": seed, "popsize": each, "tol": 1e-5, "polish": False}
        result = differential_evolution(cost, cube, callback=come_together, **how)
        at_bounds = np.where(np.abs(result.x - 0.5) > 0.49, np.round(result.x), result.x)
        chosen = meter_at(min(at_bounds, result.x, key=cost))
    else:
        chosen = meter_at([])
    if chosen.response > slowest_response:
        raise InputError(
            f"response = {slowest_response:g} s excludes everything: within the bounds the "
            f"quickest ball has a time constant of {chosen.response:.3g} s"
        )
    return chosen


@dataclass(frozen=True, kw_only=True)
class Request:
    """Requirements on a meter: flows, fluid, materials, tolerances and response."""

    fluid: Mapping[str, Any]
    """Arguments of `Parameters.from_fluid`: nu_f, rho_f, gravity, and perhaps drag and C_D."""
    slowest: float
    """The range of flows to measure: omega_0, rad s-1."""
    fastest: float
    bounds: Mapping[str, Mapping[str, Interval]]
    """For each material the bounds on r, R, rho_b, mu, eta and j."""
    tolerances: Values
    """Relative, of any of `INEXACT`."""
    response: float = math.inf
    """Longest time constant, s."""

    @property
    def make(self) -> Make:
        """A function that makes a meter with this fluid from all other values."""
        return partial(Parameters.from_fluid, **self.fluid)


@dataclass(frozen=True)
class Curve:
    """Characteristic: lowest and highest reading at each flow, rad s-1, arrays of one shape."""

    omega_0: Array
    meant: tuple[Array, Array]
    """Of the meter as it is meant to be."""
    band: tuple[Array, Array]
    """Over all corners of the tolerances."""


@dataclass(frozen=True)
class Design:
    """The best meter for a request, and what to know of it."""

    request: Request
    material: str
    choices: dict[str, Choice]
    """The best meter of each material that can be used."""
    refused: dict[str, str]
    """Why the others can't."""
    thresholds: Thresholds
    spread: dict[str, Interval]
    """Of the thresholds over the corners of the tolerances."""
    sensitivities: dict[str, dict[str, Sensitivity]]
    curve: Curve
    with_inertia: float
    """The worst limit, rad s-1, if the fluid had inertia, which the model leaves out: see
    `bifurcation.thresholds_with_inertia`."""
    model_error: float
    """The larger of `real_fluid.model_error` at the slowest and the fastest flow."""

    @property
    def choice(self) -> Choice:
        """The chosen meter."""
        return self.choices[self.material]


def design(request: Request, seed: int = 0, tell: Callable[[float], object] = float) -> Design:
    """Choose the material and the meter with the largest margin; `tell` is called with the fraction
    done. Raises `InputError` if no material can be used."""
    choices, refused, wanted = {}, {}, (request.tolerances, request.fastest, request.response, seed)
    for k, (material, bounds) in enumerate(request.bounds.items()):

        def told(done: float, k: int = k) -> None:
            tell((k + done) / len(request.bounds))

        try:
            for ends in zip(*bounds.values(), strict=True):
                request.make(**dict(zip(bounds, ends, strict=True)))  # does the lightest ball sink?
            choices[material] = best(request.make, bounds, *wanted, told)
        except InputError as reason:
            refused[material] = str(reason)
    if not choices:
        raise InputError("; ".join(f"{material}: {why}" for material, why in refused.items()))
    material = max(choices, key=lambda name: choices[name].margin)
    chosen = choices[material]
    meters = [chosen.p, *corners(request.make, chosen.values, request.tolerances)]
    at = {name: x for name, x in {**request.fluid, **chosen.values}.items() if name != "drag"}
    with_inertia = map(bifurcation.thresholds_with_inertia, meters)
    return Design(
        request=request,
        material=material,
        choices=choices,
        refused=refused,
        thresholds=bifurcation.thresholds(chosen.p),
        spread=threshold_spread(meters),
        sensitivities=sensitivities(request.make, at),
        curve=characteristic(meters, 1.5 * max(request.fastest, chosen.limit.omega_0)),
        model_error=max(
            real_fluid.model_error(chosen.p.replace(omega_0=flow))
            for flow in (request.slowest, request.fastest)
        ),
        with_inertia=min(
            t["omega_02"] if math.isnan(t["omega_01"]) else t["omega_01"] for t in with_inertia
        ),
    )


def characteristic(meters: Sequence[Parameters], top: float) -> Curve:
    """The curve of the first meter up to the flow `top`, rad s-1, with a band over all of them."""
    t = dataclasses.astuple(bifurcation.thresholds(meters[0]))[: len(THRESHOLDS)]
    sides = np.outer(t, (1 - 1e-6, 1 + 1e-6)).ravel()  # of the jumps
    flows = np.union1d(np.linspace(0.0, top, 61)[1:], sides[sides < top])
    each = [readings(p, flows) for p in meters]
    band = np.min([low for low, _ in each], axis=0), np.max([high for _, high in each], axis=0)
    return Curve(flows, each[0], band)
