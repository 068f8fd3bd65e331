"""The engines on trial and simulators beside them: all that the rest of the program knows.

To add an engine, add a record. It is named by `Engine.name`; nothing compares names."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields, replace
from enum import Enum, auto
from functools import cache, cached_property, partial
from typing import Any

import numpy as np

import analytic
import mjsim
from compare.engines.adapters import KNOWN, STUDIED, siconos, vessel
from compare.engines.adapters.free import Library
from mjsim import ContactSettings, RigidContacts
from mjsim.contact_settings import LANDING_PARTS, ContactModel
from model import InputError, Parameters, SimulationError, Trajectory
from model.arrays import Array
from model.errors import MOST_NAMES, few, suggestion
from model.versions import version


class Role(Enum):
    """How an engine is asked of a claim, and which sets it measures, see `compare.plan`."""

    ON_TRIAL = auto()
    IN_THE_LIMIT = auto()  # in the zero-step limit, beside the one on trial
    AS_IT_COMES = auto()  # with its own settings and step, beside the one on trial
    FREE_BODY = auto()  # the ball as a free body, beside the one on trial: are its joints to blame?


AnySettings = RigidContacts | ContactSettings | analytic.Settings | vessel.Settings
"""Numerical settings of any engine."""
Simulate = Callable[[Any, Callable[[float], None]], Trajectory]
"""One run of a `compare.campaign.tasks.Task`; the function is told the fraction done."""
Stream = Callable[..., mjsim.Run]
"""Runs that hand out their samples as they come; called as `mjsim.Run`."""


@dataclass(frozen=True, kw_only=True)
class Engine:
    """A simulator: how it is run and set, what its results depend on, and its mark in figures.

    One of `simulate` and `stream` is given."""

    name: str
    settings: type[AnySettings]
    options: tuple[str, ...]  # options of the command line that `configure` takes
    configure: Callable[[Mapping[str, float], Parameters], AnySettings]
    """Settings of a user's run from such options; those not given have their defaults."""
    check_run: Callable[[Any], object]
    """`InputError` for a `campaign.tasks.Task` that can't begin, before it is carried out."""
    simulate: Simulate | None = None
    stream: Stream | None = None
    sources: tuple[str, ...]  # packages whose sources determine the results
    stands_on: tuple[str, ...]  # packages whose versions do
    torque: bool = False  # whether it takes `Parameters.fluid_torque`
    lands_within: float = 1.0  # part of a time step within which it finds when a contact closes
    lag: float = 3.0
    """Time steps by which a contact force lags behind its load: of a ball set on floor and wall
    MuJoCo's own contacts find it in the fourth step."""
    needs: Library | None = None
    """An optional library that it needs; the version of that is one of `versions`."""
    title: str = ""  # what it is, in a few words
    about: str = ""  # what makes it so, as the report's first screen says it
    role: Role = Role.ON_TRIAL
    divisors: tuple[int, ...] = (1,)
    """Time steps in one that a protocol asks for; several: judged in the zero-step limit."""
    relative_tolerance: float = 0.0
    """Share of its scale by which a number may be off, chosen before anything was measured so; 0
    where each measurement has a tolerance of its own."""
    mark: str  # marker of matplotlib

    @property
    def missing(self) -> str:
        """Why the engine can't run on this machine; empty if it can."""
        return self.needs.missing if self.needs else ""

    def check_set(self, p: Parameters) -> None:
        """`InputError` for a set with what the engine leaves out."""
        if p.fluid_torque and not self.torque:
            those = ", ".join(name for name, each in ENGINES.items() if each.torque)
            raise InputError(
                f"fluid_torque = {p.fluid_torque:g} s-1: {self.name} leaves it out; {those} don't"
            )

    def check(self) -> None:
        """`InputError` if the engine can't run on this machine."""
        if self.needs:
            self.needs.load("best")

    @cached_property
    def versions(self) -> dict[str, str]:
        """Versions of all packages that determine its results, by name."""
        needed = {self.needs.name: self.needs.version} if self.needs else {}
        return {name: version(name) for name in self.stands_on} | needed

    def at(self, step: float | None, p: Parameters) -> AnySettings:
        """Settings of a study for a time step in s, or what the engine has in place of one."""
        return self.configure({} if step is None else {"timestep": step}, p)


FINEST_RTOL = 1e-11
"""Least tolerance of the event-driven simulation in studies: round-off stops some at 2e-12."""
STUDY_SLIP = 2.0
"""Slip speed, m/s, for which MuJoCo's contacts are continuous in studies, at mu = 1."""


@cache
def plain(step: float) -> ContactSettings:
    """MuJoCo's own contacts for a step in s, as they suit a ball that slides on the roughest floor.

    The implicit integrator damps the swinging on the wall; with Euler's it grows at 2 ms."""
    rough = Parameters.named("reference").replace(mu=1.0, eta=0.0)
    return ContactSettings.for_problem(rough, step, STUDY_SLIP, integrator="implicit")


def _unwarned(*given: Any, **more: Any) -> mjsim.Run:
    """`mjsim.Run` without its warnings."""
    with warnings.catch_warnings(action="ignore"):  # that contacts may chatter so is on trial
        return mjsim.Run(*given, **more)


def _check_stream(task: Any) -> None:
    with warnings.catch_warnings(action="ignore"):  # the run itself warns, once
        mjsim.engine.check_run(
            task.parameters, task.x0, task.t_end, task.fluid, task.settings, task.sample_interval
        )


def _check_theory(task: Any) -> None:
    run = task.parameters, task.fluid, task.t_end, task.x0
    analytic.simulation.settings.check_run(*run, task.settings)


def _event_settings(given: Mapping[str, float], p: Parameters) -> analytic.Settings:
    """Settings of the event-driven simulation, whose tolerance is in place of a time step.

    It falls as the square of the step, as the error of a method of second order does: then a pair
    of steps shows this engine's error, too. A ball that goes on from another run may come with
    round-off into a closed contact."""
    if "timestep" not in given:
        return analytic.Settings(**given)  # type: ignore[arg-type]
    rtol = max(FINEST_RTOL, (given["timestep"] / math.sqrt(p.R / p.g)) ** 2 * 1e-5)
    return analytic.Settings(rtol=rtol, initial_impact=True)


def _theory(method: str, task: Any, progress: Callable[[float], None]) -> Trajectory:
    """A run by a method of theory, as far as it came."""
    settings, interval = replace(task.settings, method=method), task.sample_interval
    run = task.parameters, task.x0, task.t_end, task.fluid, settings
    try:
        return analytic.simulate(*run, sample_interval=interval, progress=progress)
    except SimulationError as error:
        there: Trajectory = error.trajectory
        return there


def _adapted(library: Library, marks: str) -> list[Engine]:
    """The `Engine` of an adapter in its best settings; with a second mark, as it comes, too."""
    name = library.module.rpartition(".")[2]
    best = Engine(
        name=name,
        settings=vessel.Settings,
        options=("timestep",),
        configure=lambda given, p: vessel.Settings(**given),
        check_run=vessel.check_run,
        simulate=partial(vessel.simulate, library, "best"),
        sources=("model", "mjsim", "compare.engines.adapters"),
        stands_on=("numpy",),
        needs=library,
        divisors=(1, 2, 4),  # a free body's errors are of first or second order in the step
        mark=marks[0],
    )
    theirs = partial(vessel.simulate, library, "defaults")
    return [
        best,
        *(replace(best, name=f"{name}-defaults", simulate=theirs, mark=mark) for mark in marks[1:]),
    ]


MUJOCO = Engine(
    name="mujoco",
    settings=RigidContacts,
    options=("timestep",),
    configure=lambda given, p: RigidContacts(**given),
    check_run=_check_stream,
    stream=mjsim.Run,
    sources=("model", "mjsim"),
    stands_on=("numpy", "mujoco"),
    torque=True,
    lands_within=1 / LANDING_PARTS,
    lag=1.0,  # rigid contacts find it in the first step
    title="MuJoCo under Coulomb's law",
    about="rigid contacts by mjsim.Coulomb, which any model can have; two time steps, of at most 4 "
    "and 2 ms",
    mark="o",
)
PLAIN = replace(
    MUJOCO,
    name="mujoco-plain",
    settings=ContactSettings,
    configure=lambda given, p: plain(given.get("timestep", ContactSettings.timestep)).suited(p),
    stream=_unwarned,
    lands_within=1.0,
    lag=3.0,
    title="MuJoCo without Coulomb's law",
    about="the same scene with MuJoCo's own contacts, well set, as time steps tend to zero",
    role=Role.IN_THE_LIMIT,
    divisors=(1, 2, 3, 4),
    mark="P",
)
EVENT = Engine(
    name="event",
    settings=analytic.Settings,
    options=("rtol", "restitution"),
    configure=_event_settings,
    check_run=_check_theory,
    simulate=partial(_theory, "event"),
    sources=("model", "analytic"),
    stands_on=("numpy", "scipy"),
    mark="s",
)
MOREAU = replace(
    EVENT,
    name="time-stepping",
    options=("timestep", "rtol", "restitution"),
    torque=True,
    configure=lambda given, p: analytic.Settings(
        method="time-stepping",
        **given,  # type: ignore[arg-type]
    ),
    simulate=partial(_theory, "time-stepping"),
    mark="^",
)
_PACKAGES = {
    name: Library(KNOWN[name].partition(" ")[0], f"compare.engines.adapters.{name}")
    for name in KNOWN
}
_FREE, _AS_IT_COMES = _adapted(_PACKAGES["mujoco_free"], "Xx")
FREE = replace(
    _FREE,
    name="mujoco-free",
    title="MuJoCo under Coulomb's law with a free ball",
    about="a free body in the place of joints along the paper's coordinates, rigid contacts by "
    "mjsim.Coulomb",
)
DEFAULTS = replace(
    _AS_IT_COMES,
    name="mujoco-defaults",
    title="MuJoCo as it comes",
    about="default settings at 2 ms, a free ball, a wall of flat pieces; 5 % off counts as right",
    role=Role.AS_IT_COMES,
    divisors=(2,),
    relative_tolerance=0.05,
    configure=lambda given, p: vessel.Settings(**{"timestep": 2e-3, **given}),
)
_OTHERS = (
    *_adapted(siconos.LIBRARY, "p"),
    *(each for name, marks in STUDIED.items() for each in _adapted(_PACKAGES[name], marks)),
)
USUAL_ENGINES = (MUJOCO, PLAIN, DEFAULTS)
"""Who is asked of a claim where no engine is named: the one on trial, and two beside it."""
ENGINES: dict[str, Engine] = {
    each.name: each for each in (*USUAL_ENGINES, FREE, EVENT, MOREAU, *_OTHERS)
}
"""Every engine by name."""


def engine(name: str) -> Engine:
    """The engine of a name; `InputError` if there is none."""
    if name not in ENGINES:
        hint, known = suggestion(name, ENGINES), few(ENGINES, MOST_NAMES)
        raise InputError(f"no engine is called {name!r}{hint}; there are {known}")
    return ENGINES[name]


def sliding_speeds(run: Trajectory) -> tuple[Array, Array]:
    """Slip speeds (n,) at A and B, m s-1, less what contacts of MuJoCo show of it while they roll.

    That is proportional to their friction force, with a factor that the settings give, and a
    hundredth more, since it lags behind a force that still changes. A ball that rolls on both moves
    its load from one contact to the other, so that one may be at the limit of friction, and yield,
    while the other holds: where both bear something, neither slips faster than the other."""
    if ENGINES[run.header.engine].settings not in (RigidContacts, ContactSettings):
        return run.slip_speed_A, run.slip_speed_B
    m, kept = run.header.parameters.m, run.header.settings
    settings: ContactModel = RigidContacts(timestep=kept["timestep"])
    if "solref" in kept:
        own = {f.name: kept[f.name] for f in fields(ContactSettings)}
        settings = ContactSettings.from_mapping(own)
    friction_A = np.hypot(run.force_A[:, 0], run.force_A[:, 2])
    friction_B = np.hypot(run.force_B[:, 1], run.force_B[:, 2])
    A = np.maximum(run.slip_speed_A - 1.01 * settings.creep_speed(friction_A / m), 0.0)
    B = np.maximum(run.slip_speed_B - 1.01 * settings.creep_speed(friction_B / m), 0.0)
    both = (run.force_A[:, 1] > 0) & (run.force_B[:, 0] > 0)
    return np.where(both, np.minimum(A, B), A), np.where(both, np.minimum(A, B), B)
