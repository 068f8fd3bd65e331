"""The engines on trial and the simulators beside them, one record each: all that the rest of the
program knows of them.

To add an engine, add a record. It is named in tasks and files by `Engine.name`; nothing else
compares names."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields, replace
from enum import Enum, auto
from functools import cache, cached_property, partial
from typing import Any

import numpy as np

import analytic
import mjsim
from compare.adapters import KNOWN, siconos, vessel
from compare.adapters.free import Library
from mjsim import ContactSettings
from model import InputError, Parameters, SimulationError, Trajectory
from model.arrays import Array
from model.errors import suggestion
from model.versions import version


class Role(Enum):
    """How an engine is heard of a claim, and which sets it measures, see `compare.kit.plan`."""

    ON_TRIAL = auto()
    IN_THE_LIMIT = auto()
    """Of no time step, beside the one on trial."""
    AS_IT_COMES = auto()
    """With its own settings and step, beside the one on trial."""


AnySettings = ContactSettings | analytic.Settings | vessel.Settings
"""Numerical settings of any engine."""
Simulate = Callable[[Any, Callable[[float], None]], Trajectory]
"""One whole run of a `compare.kit.tasks.Task`; the function is called with the fraction done, from
time to time."""
Stream = Callable[..., mjsim.Run]
"""Runs that hand out their samples as they come; called as `mjsim.Run`."""


@dataclass(frozen=True, kw_only=True)
class Engine:
    """A simulator: how it is run and set, what its results depend on, and its mark in figures.

    One of `simulate` and `stream` is given.
    """

    name: str
    settings: type[AnySettings]
    options: tuple[str, ...]
    """Options of the command line that `configure` takes."""
    configure: Callable[[Mapping[str, float], Parameters], AnySettings]
    """Settings of a user's run from such options; those not given have their defaults."""
    study: Callable[[float, Parameters], AnySettings] | None = None
    """Settings of a study for a time step in s, where they differ from those of a user's run."""
    simulate: Simulate | None = None
    stream: Stream | None = None
    sources: tuple[str, ...]
    """Packages whose sources determine the results."""
    stands_on: tuple[str, ...]
    """Packages whose versions do."""
    torque: bool = False
    """Whether it takes `Parameters.fluid_torque`."""
    needs: Library | None = None
    """An optional library that it needs; the version of that is one of `versions`."""
    title: str = ""
    """What it is, in a few words."""
    about: str = ""
    """What makes it so, as the report's first screen says it."""
    role: Role = Role.ON_TRIAL
    refine: tuple[int, ...] = (1,)
    """Time steps in one that a protocol asks for; with several, claims are judged in the limit of
    no step."""
    relative_tolerance: float = 0.0
    """Share of its scale by which a number may be off, chosen before anything was measured so; 0
    where each measurement has a tolerance of its own."""
    mark: str
    """Marker of matplotlib."""

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
        """Settings of a study for a time step in s; engines without a step ignore it."""
        if step is None or "timestep" not in self.options:
            return self.configure({}, p)
        return self.study(step, p) if self.study else self.configure({"timestep": step}, p)


STUDY_SLIP = 2.0
"""Slip speed in m/s for which contact in the studies' settings is continuous, under the load of
gravity, at mu = 1."""


@cache
def _rough(step: float) -> ContactSettings:
    """Contact settings that suit a ball on the roughest floor."""
    return ContactSettings.for_problem(
        Parameters.named("reference").replace(mu=1.0, eta=0.0), step, STUDY_SLIP
    )


def plain(step: float) -> ContactSettings:
    """The studies' settings for a step in s, and none of the corrections between the steps.

    The implicit integrator damps the swinging of a spinning ball on the wall; with Euler's it grows
    at steps of 2 ms."""
    return replace(_rough(step), servo=0.0, memory=False, order=1, integrator="implicit")


def newcomer(step: float) -> ContactSettings:
    """MuJoCo's own contact parameters on the joints of this study, and none of the corrections
    between the steps."""
    contacts = ContactSettings(
        timestep=step, solref=(0.02, 1.0), solreffriction=0.02, solimp=0.9, impratio=1.0
    )
    return replace(contacts, servo=0.0, memory=False, order=1)


def _unwarned(*given: Any, **more: Any) -> mjsim.Run:
    """`mjsim.Run` without its warnings."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # that contacts may chatter with these settings is on trial
        return mjsim.Run(*given, **more)


def _theory(method: str, task: Any, progress: Callable[[float], None]) -> Trajectory:
    """A run by a method of theory, as far as it came."""
    run, settings = (
        (task.parameters, task.x0, task.t_end, task.fluid),
        replace(task.settings, method=method),
    )
    try:
        return analytic.simulate(
            *run, settings, sample_interval=task.sample_interval, progress=progress
        )
    except SimulationError as error:
        there: Trajectory = error.trajectory
        return there


def _adapted(library: Library, marks: str) -> list[Engine]:
    """The `Engine` of an adapter in its best settings and, if there is a second mark, that in the
    engine's own."""
    name = library.module.rpartition(".")[2]
    best = Engine(
        name=name,
        settings=vessel.Settings,
        options=("timestep",),
        configure=lambda given, p: vessel.Settings(**given),
        simulate=partial(vessel.simulate, library, "best"),
        sources=("model", "mjsim", "compare.adapters"),
        stands_on=("numpy",),
        needs=library,
        refine=(1, 2, 4),  # a free body's errors are of first or second order in the step
        mark=marks[0],
    )
    theirs = partial(vessel.simulate, library, "defaults")
    return [
        best,
        *(replace(best, name=f"{name}-defaults", simulate=theirs, mark=mark) for mark in marks[1:]),
    ]


MUJOCO = Engine(
    name="mujoco",
    settings=ContactSettings,
    options=("timestep",),
    configure=lambda given, p: ContactSettings.at(
        given.get("timestep", ContactSettings.timestep)
    ).suited(p),
    study=lambda step, p: _rough(step).suited(p),
    stream=mjsim.Run,
    sources=("model", "mjsim"),
    stands_on=("numpy", "mujoco"),
    torque=True,
    title="MuJoCo with corrections between its steps",
    about="they make rigid stationary states exact by construction; measured at two time steps of "
    "at most 4 and 2 ms",
    mark="o",
)
PLAIN = replace(
    MUJOCO,
    name="mujoco-plain",
    configure=lambda given, p: plain(given.get("timestep", ContactSettings.timestep)).suited(p),
    study=lambda step, p: plain(step).suited(p),
    stream=_unwarned,
    title="MuJoCo without corrections, in the limit of no time step",
    about="the same joints and contact settings, nothing between the steps but drag and the wall's "
    "tangent plane",
    role=Role.IN_THE_LIMIT,
    refine=(1, 2, 3, 4),
    mark="P",
)
COULOMB = replace(
    PLAIN,
    name="mujoco-coulomb",
    configure=lambda given, p: ContactSettings.rigid_at(
        given.get("timestep", ContactSettings.timestep)
    ),
    study=None,
    stream=mjsim.Run,
    title="MuJoCo under a law of friction for any model, in the limit of no time step",
    about="a free ball in the vessel, its wall a plane that goes with it; contacts by "
    "mjsim.Coulomb, for any model",
    refine=(
        2,
        4,
        8,
        16,
    ),  # (1, 2, 4) was tried, too: at 4 ms the onset of slip isn't yet where powers of the step tell
    mark="X",
)
EVENT = Engine(
    name="event",
    settings=analytic.Settings,
    options=("rtol", "restitution"),
    configure=lambda given, p: analytic.Settings(**given),  # type: ignore[arg-type]
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
    configure=lambda given, p: analytic.Settings(method="time-stepping", **given),  # type: ignore[arg-type]
    simulate=partial(_theory, "time-stepping"),
    mark="^",
)
_PACKAGES = {
    name: Library(KNOWN[name].partition(" ")[0], f"compare.adapters.{name}") for name in KNOWN
}
NEWCOMER = replace(
    _adapted(_PACKAGES["mujoco_free"], "ox")[1],
    name="mujoco-defaults",
    title="MuJoCo as it comes",
    about="a free ball in flat facets, MuJoCo's own parameters, 2 ms; confirmed is what is off by "
    "no more than 5 %",
    role=Role.AS_IT_COMES,
    refine=(2,),
    relative_tolerance=0.05,
    configure=lambda given, p: vessel.Settings(**{"timestep": 2e-3, **given}),
)
_OTHERS = (
    *_adapted(siconos.LIBRARY, "p"),
    *_adapted(_PACKAGES["pybullet"], "v1"),
    *_adapted(_PACKAGES["drake"], "D+"),
    *_adapted(_PACKAGES["dart"], "<3"),
    *_adapted(_PACKAGES["rapier"], ">4"),
    *_adapted(_PACKAGES["sapien"], "hH"),
)
USUAL_ENGINES = (MUJOCO, PLAIN, NEWCOMER)
"""Who is heard of a claim where no engine is named: the one on trial, and two beside it."""
ENGINES: dict[str, Engine] = {
    each.name: each for each in (*USUAL_ENGINES, COULOMB, EVENT, MOREAU, *_OTHERS)
}
"""Every engine by name."""


def engine(name: str) -> Engine:
    """The engine of a name, or of its alias `analytic`; `InputError` with a suggestion if there is
    none."""
    name = "event" if name == "analytic" else name
    if name not in ENGINES:
        raise InputError(
            f"no engine is called {name!r}{suggestion(name, ENGINES)}; there are "
            f"{', '.join(ENGINES)}"
        )
    return ENGINES[name]


def sliding_speeds(run: Trajectory) -> tuple[Array, Array]:
    """Slip speeds (n,) at A and B, m s-1, less the creep of an engine whose friction yields to any
    force.

    A contact that rolls creeps at a speed proportional to its friction force, with a factor that
    the settings give; a hundredth more than that is creep, too, since it lags behind a force that
    still changes. A ball that rolls on both moves its load from one contact to the other, so that
    one may be at the limit of friction while the other holds: where one of two contacts creeps, the
    other slips no faster than it. Of two rigid contacts either may creep as the larger of both
    forces lets it."""
    m = run.header.parameters.m
    if ENGINES[run.header.engine].settings is not ContactSettings:
        return run.slip_speed_A, run.slip_speed_B
    kept = run.header.settings
    settings = ContactSettings.from_mapping(
        {f.name: kept[f.name] for f in fields(ContactSettings) if f.name in kept}
    )
    friction = (
        np.hypot(run.force_A[:, 0], run.force_A[:, 2]),
        np.hypot(run.force_B[:, 1], run.force_B[:, 2]),
    )
    both = (run.force_A[:, 1] > 0) & (run.force_B[:, 0] > 0)
    shared = both & settings.rigid
    creep = (
        1.01 * settings.creep_speed(np.where(shared, np.maximum(*friction), force) / m)
        for force in friction
    )
    A, B = (
        np.maximum(v - c, 0.0)
        for v, c in zip((run.slip_speed_A, run.slip_speed_B), creep, strict=True)
    )
    both &= not (settings.memory or settings.rigid)
    return np.where(both, np.minimum(A, B), A), np.where(both, np.minimum(A, B), B)
