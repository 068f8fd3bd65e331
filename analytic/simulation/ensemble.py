"""Many runs at once: states at a few times, for many parameter sets and starts."""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from analytic.simulation.motion import Recorder, Rows
from analytic.simulation.settings import Settings, check_duration, sample_times, start_state
from analytic.simulation.simulator import simulator
from model import Flow, InputError, Parameters, State
from model.arrays import Array
from model.errors import check_type
from model.kinematics import TURNING, VARIABLES, full_state
from model.parameters import POSITIVE, Range, check_number

MOST_THREADS = 1024


@dataclass(frozen=True, eq=False)
class Ensemble:
    """States of many runs at the same times, and their landings in between."""

    time: Array
    """Shape (samples,), s; the first is the start."""
    x: Array
    """States in the order of `model.State`, shape (runs, samples, 8)."""
    case: npt.NDArray[np.int8]
    """Codes of the cases, shape (runs, samples)."""
    landings: npt.NDArray[np.int64]
    """Landings on floor or wall since the sample before, faster than sqrt(g R)/1000, shape (runs,
    samples); in event-driven runs by the normal impulse that it takes."""
    end: Array
    """When each run ended, shape (runs,), s: it was quiet, failed, or reached the last time."""
    failure: tuple[str, ...]
    """Why a run failed, empty if it didn't; what it has from there on is nan."""


def simulate_many(
    parameters: Parameters | Sequence[Parameters],
    x0s: npt.ArrayLike,
    t_end: float,
    flow: Flow | Sequence[Flow] | None = None,
    settings: Settings | None = None,
    *,
    sample_interval: float | None = None,
    quiet: float | None = None,
    threads: int | None = None,
) -> Ensemble:
    """Many runs as by `simulate`, on all cores: each is one compiled call.

    Parameters
    ----------
    parameters, flow : one for all, or one for each run; without flow each has its own omega_0
    x0s : starts, shape (runs, 6 or 8), or one for all
    t_end, sample_interval : s; a thousandth of t_end if None
    settings : `Settings` if None; one timestep for all where it is given
    quiet : end a run in which nothing has landed for that long, s; its last state stands for the
        rest
    threads : number of threads, that of the cores if None

    Raises `InputError` if numbers of runs differ, or as `simulate` for a run that can't start."""
    settings = settings or Settings()
    sets = list(parameters) if isinstance(parameters, Sequence) else [parameters]
    starts = np.atleast_2d(full_state(x0s))
    flows = list(flow) if isinstance(flow, Sequence) else [flow]
    check_type("settings", settings, Settings)
    for p in sets:
        check_type("parameters", p, Parameters)
    for one in flows:
        check_type("flow", one, Flow | None)
    count = max(len(sets), len(starts), len(flows))
    if {len(sets), len(starts), len(flows)} - {1, count}:
        raise InputError(
            f"every run needs parameters, a start and a flow: there are {len(sets)} parameter "
            f"sets, {len(starts)} starts and {len(flows)} flows; each must be one, or as many as "
            "the others"
        )
    sets, flows = sets * (count // len(sets)), flows * (count // len(flows))
    starts = np.resize(starts, (count, starts.shape[1]))
    states = [start_state(x, p, settings) for x, p in zip(starts, sets, strict=True)]
    times = sample_times(t_end, sample_interval)
    still = np.inf if quiet is None else check_number("quiet", quiet, "s", POSITIVE)
    if threads is None:
        threads = os.cpu_count() or 1
    workers = int(check_number("threads", threads, "threads", Range(1, MOST_THREADS, whole=True)))

    steady = {p: Flow.steady(p.omega_0) for p in dict.fromkeys(sets)}
    fluids = [flow or steady[p] for p, flow in zip(sets, flows, strict=True)]
    for p, fluid, start in zip(sets, fluids, states, strict=True):
        check_duration(p, fluid, float(times[-1]), start)
    shape, over, by = (count, len(times)), np.zeros(1, bool), simulator(settings)
    x, case = np.full((*shape, 8), np.nan), np.full(shape, -1, np.int8)
    landings = np.zeros(shape, np.int64)

    def carry_out(n: int) -> tuple[float, str]:
        """In a thread: a run, into its rows; when it ended, and why it failed, if it did."""
        run = Rows.filling(times, x[n], case[n], landings[n], still, over)
        try:
            by.carry_out(states[n], 0.0, sets[n], fluids[n], settings, Recorder(run))
        except (ArithmeticError, InterruptedError) as error:
            return float(run.reached[0]), f"stopped at t = {run.reached[0]:g} s: {error}"
        except BaseException:
            over[0] = True  # nobody wants the others any more
            raise
        last = run.taken[0] - 1
        run.x[last:], run.case[last:] = run.x[last], run.case[last]
        return float(times[last]), ""

    with ThreadPoolExecutor(min(workers, count)) as pool:
        try:
            end, failure = zip(*pool.map(carry_out, range(count)), strict=True)
        finally:
            over[0] = True
    return Ensemble(times, x, case, landings, np.array(end), failure)


def random_starts(p: Parameters, count: int, seed: int = 0) -> Array:
    """States (count, 8) at the wall, half on the floor, half up to R above it, speeds to sqrt(g R).

    omega_c is up to twice omega_0 either way, slips as of rolling at that; all evenly spread."""
    check_number("starts", count, "runs", Range(1, whole=True))
    check_number("seed", seed, "1", Range(0, whole=True))
    rng = np.random.default_rng(seed)
    size = 2 * abs(p.omega_0) * np.array([1.0, *[p.R / p.r] * 3])
    x = np.zeros((count, len(VARIABLES)))
    x[:, TURNING] = rng.uniform(-size, size, (count, 4))
    flying = rng.random(count) < 0.5
    y = np.where(flying, rng.uniform(0, p.R, count), 0.0)
    v_y = np.where(flying, rng.uniform(-1, 1, count) * math.sqrt(p.g * p.R), 0.0)
    return State.of(x)._replace(y=y, v_y=v_y).stacked()


def interval(hits: int, of: int) -> tuple[float, float]:
    """95 % confidence interval of a share (Clopper-Pearson); [0, 1] if nothing was tried."""
    from scipy.stats import binomtest  # slow to import

    if of == 0:
        return 0.0, 1.0
    low, high = binomtest(hits, of).proportion_ci(0.95)
    return float(low), float(high)
