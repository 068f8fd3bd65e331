"""What MuJoCo reaches with this project's settings, and what it can't do: the tables of docs/mujoco-settings.md.

Each function runs what it needs in a `Lab` and answers with the rows of one table; `compare.document` writes them.
"""

from __future__ import annotations

import dataclasses
import json
import math
from typing import Any

import numpy as np
from scipy.stats import qmc

import analytic
from analytic import StationarySolution, rolling_forces
from compare import frontier
from compare.claims import Lab
from compare.frontier import mujoco_defaults, scores
from compare.stationary import HEIGHT, OFFSET, TIME_CONSTANTS, attractors, slowest
from compare.studies import last_part
from compare.tasks import Task
from mjsim import ContactSettings, thresholds
from model import Case, Contact, Parameters, SimulationError, Trajectory
from model.arrays import Array
from model.files import write_text

Rows = list[list[str]]
"""A table: its head, then its rows."""
REFERENCE, ROUGH = Parameters.named("reference"), Parameters.named("high-wall-friction")
STEPS = (1e-3, 4e-3)
"""Time steps of stationary states, s."""
STATES = (
    *((REFERENCE, Case.RR, omega_0) for omega_0 in (8.0, 12.0)),
    *((REFERENCE, Case.SS, omega_0) for omega_0 in (14.5, 20.0, 25.0, 30.0)),
    (ROUGH, Case.NR, 25.0),
)
"""Stationary states that are approached from 2 % off and from rest."""
RANDOM, SEED = 32, 5
"""Random parameter sets, and the seed of their design."""
LOW = {"R": 0.01, "r/R": 0.05, "j": 0.1, "mu": 0.05, "eta": 0.05, "g": 1.0, "kappa": 0.03, "Omega_0": 0.3}
HIGH = {"R": 0.5, "r/R": 0.6, "j": 0.66, "mu": 0.9, "eta": 0.6, "g": 15.0, "kappa": 0.3, "Omega_0": 3.0}
"""Their ranges; R, kappa and Omega_0 are spread over them as logarithms."""
AWAY, LONGEST = 0.03, 200.0
"""Least relative distance of omega_0 from a threshold, and longest run (s) of a random set: near a threshold nothing
settles."""
FINE = (4e-3, 2e-3, 1e-3, 4e-4, 2e-4, 1e-4)
"""Time steps of the transient, s; from the last three it is extrapolated."""
MOTIONS = {
    "slides down the wall, lands, slips at both points, sticks": (0.02, -0.2, 12.0, 30.0, -10.0, 20.0, 0.0, 0.0),
    "slides on the floor, hits the wall, is lifted, lands, sticks": (0.0, 0.0, 10.0, 1.0, 2.0, 3.0, 0.002, -0.3),
}
"""Starts of motions through landings, slip, stick and lift-off, of the reference set."""
LASTS = 0.7
"""Their duration, s."""


def reached(lab: Lab) -> Rows:
    """Errors of stationary states, the worse of the two starts."""
    head = ["state", "ω_c, 1 ms", "ω_c, 4 ms", "slip, 1 ms", "slip, 4 ms", "creep, 1 ms", "creep, 4 ms", "open"]
    rows = [head]
    for base, case, omega_0 in STATES:
        p = base.replace(omega_0=omega_0)
        (target,) = (s for s in attractors(p) if s.case is case)
        runs = [lab.run(_approaches(p, target, ContactSettings.at(step))) for step in STEPS]
        found = [np.max([_error(run, target, p) for run in pair], axis=0) for pair in runs]
        numbers = [f"{found[k][i]:.0e}" for i in (0, 1, 2) for k in range(len(STEPS))]
        if all(Contact.R is not contact for contact in (case.A, case.B)):
            numbers[4:6] = ["–", "–"]
        rows.append([f"{case.name}, η = {p.eta:g}, ω₀ = {omega_0:g}", *numbers, f"{max(f[3] for f in found):.1%}"])
    return rows


def random_sets(lab: Lab) -> Rows:
    """Errors of the attracting states of random parameter sets at a step of 1 ms, by case; SR at y = 0 is NR."""
    targets = [(p, target) for p in _random(RANDOM) for target in attractors(p) if target.case is not Case.SR]
    tasks = [_approaches(p, target, ContactSettings.for_problem(p))[0] for p, target in targets]
    found: dict[Case, list[Array]] = {}
    for (p, target), run in zip(targets, lab.run(tasks), strict=True):
        found.setdefault(target.case, []).append(_error(run, target, p))
    rows = [["case", "states", "ω_c, median", "ω_c, largest", "slip, median", "slip, largest", "open, largest"]]
    for case, errors in sorted(found.items()):
        table = np.array(errors)
        middle, most = np.median(table, axis=0), table.max(axis=0)
        numbers = [middle[0], most[0], middle[1], most[1]]
        rows.append([case.name, str(len(errors)), *(f"{v:.0e}" for v in numbers), f"{most[3]:.1%}"])
    return rows


def _random(count: int) -> list[Parameters]:
    """Parameter sets off the thresholds, with states that settle in time."""
    found: list[Parameters] = []
    design = qmc.Halton(len(LOW), seed=SEED)
    while len(found) < count:
        (u,) = design.random(1)
        v: dict[str, float] = {}
        for share, (name, low) in zip(u.tolist(), LOW.items(), strict=True):
            high = HIGH[name]
            even = name not in ("R", "kappa", "Omega_0")
            v[name] = low + share * (high - low) if even else low * (high / low) ** share
        unit = math.sqrt(v["g"] / v["R"])
        p = REFERENCE.replace(
            R=v["R"], r=v["r/R"] * v["R"], j=v["j"], mu=v["mu"], eta=v["eta"], g=v["g"], c=v["kappa"] * unit,
            omega_0=v["Omega_0"] * unit,
        )  # fmt: skip
        limits = np.array(dataclasses.astuple(analytic.thresholds(p))[:4])
        if np.any(np.abs(limits / p.omega_0 - 1) < AWAY) or not attractors(p):
            continue
        if max(_settles(target) for target in attractors(p)) <= LONGEST:
            found.append(p)
    return found


def _settles(target: StationarySolution) -> float:
    return TIME_CONSTANTS * slowest(target)


def _approaches(p: Parameters, target: StationarySolution, settings: ContactSettings) -> list[Task]:
    """Runs towards a state, from 2 % off and from rest."""
    near, rest = target.x.copy(), np.zeros(8)
    near[2] *= OFFSET
    near[0] = HEIGHT * p.R if target.case is Case.NR else 0.0
    lasts = math.ceil(_settles(target) + 4 / p.c)
    return [
        Task(engine="mujoco", parameters=p, x0=tuple(x.tolist()), t_end=lasts, settings=settings) for x in (near, rest)
    ]


def _error(run: Trajectory, target: StationarySolution, p: Parameters) -> Array:
    """Relative errors of omega_c and slip, mean slip speed (m/s) where it should roll, and share of open samples."""
    last = last_part(run)
    omega_c = abs(float(run.omega_c[last].mean()) / float(target.x[2]) - 1)
    scale = max(float(np.abs(target.x[3:6]).max()), abs(float(target.x[2])) * p.R / p.r)
    slips = np.array([getattr(run, name)[last].mean() for name in ("slip_x", "slip_y", "slip_z")])
    contacts = (
        (target.case.A, run.slip_speed_A, run.force_A[:, 1]), (target.case.B, run.slip_speed_B, run.force_B[:, 0])
    )  # fmt: skip
    creep = max([float(speed[last].mean()) for of, speed, _ in contacts if of is Contact.R], default=0.0)
    empty = max(float(np.mean(force[last] <= 0)) for of, _, force in contacts if of is not Contact.N)
    return np.array([omega_c, float(np.abs(slips - target.x[3:6]).max()) / scale, creep, empty])


def transient(lab: Lab) -> Rows:
    """Rms errors of a transient with the step, the order from one step to the next, and the extrapolation."""
    (exact,) = lab.run([frontier.transient("event", analytic.Settings(rtol=1e-12))])
    runs = lab.run([frontier.transient("mujoco", ContactSettings.at(step)) for step in FINE])
    rows = [["h", "ω_c", "order", "slip", "order"]]
    before: tuple[float, Array] | None = None
    for step, run in zip(FINE, runs, strict=True):
        errors = _rms(run.x - exact.x, exact)
        orders = ["", ""]
        if before:
            orders = [f"{v:.1f}" for v in np.log(before[1] / errors) / math.log(before[0] / step)]
        rows.append([f"{1e3 * step:g} ms", f"{errors[0]:.1e}", orders[0], f"{errors[1]:.1e}", orders[1]])
        before = step, errors
    # The terms of second and third order, from the last three steps.
    A = np.array([[1.0, h**2, h**3] for h in FINE[-3:]])
    limit = np.linalg.solve(A, np.reshape([run.x for run in runs[-3:]], (3, -1)))[0].reshape(exact.x.shape)
    errors = _rms(limit - exact.x, exact)
    return [*rows, ["extrapolated from the last three", f"{errors[0]:.1e}", "", f"{errors[1]:.1e}", ""]]


def _rms(d: Array, exact: Trajectory) -> Array:
    """Relative rms of omega_c, and of the slip in units of its largest component."""
    slip = np.sqrt(np.mean(np.sum(d[:, 3:6] ** 2, axis=-1))) / np.abs(exact.x[:, 3:6]).max()
    return np.array([np.sqrt(np.mean((d[:, 2] / exact.omega_c) ** 2)), slip])


def event_times(lab: Lab) -> Rows:
    """Largest error of the times at which the case changes."""
    rows = [["motion", "h", "changes", "largest error", "in steps"]]
    for name, x0 in MOTIONS.items():
        (exact,) = lab.run([Task(engine="event", parameters=REFERENCE, x0=x0, t_end=LASTS)])
        for step in (1e-3, 5e-4, 2.5e-4, 1e-4):
            settings = ContactSettings.at(step)
            task = Task(
                engine="mujoco", parameters=REFERENCE, x0=x0, t_end=LASTS, settings=settings, sample_interval=step
            )
            (run,) = lab.run([task])
            same = run.events.to_case.tolist() == exact.events.to_case.tolist()
            error = float(np.abs(run.events.time - exact.events.time).max()) if same else math.nan
            told = [f"{1e3 * error:.2g} ms", f"{error / step:.1f}"] if same else ["others are told", ""]
            rows.append([name, f"{1e3 * step:g} ms", str(len(exact.events)), *told])
    return rows


def measured_thresholds(lab: Lab) -> Rows:
    """Thresholds from MuJoCo alone, beside the closed form."""
    rows = [["", "parameter set", "measured (rad/s)", "stated uncertainty", "error", "relative error"]]
    for name, top in (("reference", 46.0), ("high-wall-friction", 34.0)):
        p = Parameters.named(name)
        exact = analytic.thresholds(p)
        for threshold, (value, uncertainty) in _thresholds(lab, p, top).items():
            if math.isfinite(value):
                error = value - float(getattr(exact, threshold))
                rows.append(
                    [
                        threshold.replace("omega_0", "ω_0"), name, f"{value:.12g}", f"{uncertainty:.0e}",
                        f"{error:+.0e}", f"{abs(error) / value:.0e}",
                    ]
                )  # fmt: skip
    return rows


def _thresholds(lab: Lab, p: Parameters, top: float) -> dict[str, list[float]]:
    """Values and uncertainties of `mjsim.thresholds.measure`, kept in the directory of the runs."""
    name = Task(engine="mujoco", parameters=p.replace(omega_0=top), x0=(0.0,) * 6, t_end=1.0).key
    path = lab.campaign.directory / f"{name}.thresholds.json"
    if not path.exists():
        found = thresholds.measure(p, top)
        values = {f.name: getattr(found, f.name) for f in dataclasses.fields(found)}
        write_text(path, json.dumps({name: [m.value, m.uncertainty] for name, m in values.items()}))
    kept: dict[str, list[float]] = json.loads(path.read_text("utf-8"))
    return kept


def force_split(lab: Lab) -> Rows:
    """B_y in two-point rolling, where it may lie anywhere in an interval."""
    head = ["ω₀ (rad/s)", "admissible B_y (N)", "no memory", "memory, from 12 % off", "memory, from rest"]
    rows = [head]
    for omega_0 in (6.0, 10.0, 13.0):
        p = REFERENCE.replace(omega_0=omega_0)
        least, greatest = (float(end) for end in rolling_forces.admissible_interval(omega_0, p))
        off = (0.0, 0.0, 0.88 * omega_0, 0.0, 0.0, 0.0)
        plain = ContactSettings(memory=False, order=1)
        starts: list[tuple[ContactSettings, tuple[float, ...]]] = [
            (plain, off), (ContactSettings(), off), (ContactSettings(), (0.0,) * 6)
        ]  # fmt: skip
        tasks = [Task(engine="mujoco", parameters=p, x0=x0, t_end=60.0, settings=s) for s, x0 in starts]
        chosen = [f"{float(run.force_B[last_part(run), 1].mean()):.4f}" for run in lab.run(tasks)]
        rows.append([f"{omega_0:g}", f"{least:.4f} … {greatest:.4f}", *chosen])
    return rows


def _soft(solimp: float, **changes: Any) -> ContactSettings:
    """Settings at 1 ms with another impedance and the same friction damping."""
    return ContactSettings.at(1e-3, solimp=solimp, solreffriction=2e-3 / solimp, **changes)


VARIANTS: dict[str, ContactSettings] = {
    "pyramidal cone, MuJoCo's defaults": mujoco_defaults(1e-3, cone="pyramidal"),
    "pyramidal cone, d = 0.1, b_f h = 1": _soft(0.1, cone="pyramidal", memory=False, order=1),
    "integrator implicit": ContactSettings.at(1e-3, integrator="implicit"),
    "integrator implicitfast": ContactSettings.at(1e-3, integrator="implicitfast"),
    "integrator discrete, d = 0.1": _soft(0.1, integrator="discrete"),
    "integrator discrete": ContactSettings.at(1e-3, integrator="discrete"),
    "noslip (10 iterations) for memory": ContactSettings.at(1e-3, memory=False, noslip_iterations=10),
    "neither": ContactSettings.at(1e-3, memory=False),
    "ours": ContactSettings.at(1e-3),
}
"""Other ways to set MuJoCo, at a step of 1 ms."""


def variants(lab: Lab) -> Rows:
    """Errors of omega_c as in the ablation."""
    names = [*frontier.STATES, frontier.TRANSIENT]
    rows = [["variant", *names, "open"]]
    for name, settings in VARIANTS.items():
        try:
            (row,) = scores(lab, "mujoco", [settings])
        except SimulationError:
            rows.append([name, *["diverges"] * len(names), ""])
        else:
            rows.append([name, *(number(s.error) for s in row), f"{1 - min(s.closed for s in row):.0%}"])
    return rows


def number(value: float) -> str:
    """An error for a table: what is round-off need not be told apart."""
    return "< 1e-14" if value < 1e-14 else f"{value:.1e}"
