"""What an adapter brings, its engine's library, settings and a ball that takes steps; and the loop round them.

The loop adds the fluid's drag, samples, cases, and what becomes of a run that breaks down.

An engine shows itself as a `Scene` of a ball, a floor and a wall, in one of two kinds of coordinates:

* ``joints``: the ball hangs on an azimuth hinge, an inward and an upward slide, and a ball joint. Before each step the
  scene turns its azimuth and the ball's orientation back to zero, so that the wall is one fixed plane. A stationary
  orbit is then a fixed point of the step. Engines that take gyroscopic moments at the beginning of the step spin a
  ball up by omega_c^2 h/2 a second where nothing rubs against its spin. Place: (angle, h, y) in rad and m; velocity:
  (omega_c, v_h, v_y, spin about the scene's axes against the joints).
* ``free``: a free ball in world axes, in a vessel of fixed walls. Place and velocity with spin in m, m s-1 and rad s-1.

The engine is driven by -m c(|w|) w (9) alone, with the velocity w relative to the fluid at the beginning of each step.
"""

from __future__ import annotations

import importlib
import importlib.util
import math
from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import asdict, dataclass
from typing import Any, ClassVar, NamedTuple, Protocol

import numpy as np
import numpy.typing as npt

from mjsim import limits, recorder
from mjsim.classify import Classifier, Contacts
from mjsim.contact_settings import ContactSettings
from mjsim.corrections import Ball, resistance
from mjsim.engine import EVENT_TIMES
from model import Flow, Header, InputError, Parameters, State, Trajectory
from model.arrays import Array
from model.kinematics import Motion, frame, from_world, to_world
from model.parameters import POSITIVE, check_choice, check_number
from model.trajectory import samples
from model.versions import current_versions, version

Floats = Sequence[float]
_HUGE = 1e8
"""A coordinate, velocity or force beyond this, in SI units, has diverged."""
NOTED = 1024
"""Steps of which the cases are told at once."""
_WIDTH = 1 + 3 + 6 + 2 * 5
"""A row: azimuth, place, velocity, and for each contact whether it touches, force (3,), gap."""
_SPIN = np.eye(6)
_SPIN[3:, 3:] = frame(0.0).T
"""Turns the spin from the paper's axes to those of a scene on joints."""


@dataclass(frozen=True)
class Library:
    """What an engine comes in: here a Python package of the extra ``engines``."""

    name: str
    """What it is called where it is installed."""
    module: str = ""
    """The module to import."""

    @property
    def missing(self) -> str:
        """Why it can't be used here, and what to do about it; empty if it can."""
        there = importlib.util.find_spec(self.module.split(".")[0])
        return "" if there else f"{self.name} is not installed: pip install {self.name}"

    @property
    def version(self) -> str:
        """Or that it isn't installed."""
        return version(self.name)

    def load(self) -> Any:
        """What a scene is built with; `InputError` if it is missing."""
        try:
            return importlib.import_module(self.module)
        except ImportError as error:
            raise InputError(self.missing or f"{self.name} can't be imported: {error}") from error


@dataclass(frozen=True, kw_only=True)
class Settings:
    """What the settings of all engines have."""

    timestep: float = 1e-3
    """s"""
    coordinates: str = "joints"
    """``joints``, or ``free`` for a free ball."""

    rolls: ClassVar[float] = 3.0
    """Share of `regularisation_speed` below which a contact rolls: how exact that speed is isn't known."""
    midpoint: ClassVar[float] = 0.0
    """Forces are those at the beginning of a step."""

    def __post_init__(self) -> None:
        check_number("timestep", self.timestep, "s", POSITIVE)
        check_choice("coordinates", self.coordinates, ("joints", "free"))

    @property
    def resolution(self) -> float:
        """The least slip speed that the engine tells from rolling, m s-1."""
        return 0.0

    def regularisation_speed(self, load: npt.ArrayLike) -> Array:
        """The resolution, and for round-off at least 1e-9 m s-1."""
        return np.full(np.shape(load), max(self.resolution, 1e-9))


class Touch(NamedTuple):
    """What a contact point of the engine carried in the last step."""

    contact: int
    """0 for the floor (A), 1 for the wall (B)."""
    force: Array
    """On the ball, in the axes of the scene, shape (3,), N."""
    gap: float
    """m"""


class Scene(Protocol):
    """A ball in an engine. Its axes are the world's; on joints, those in which the azimuth is zero."""

    def start(self, place: Floats, velocity: Floats) -> None:
        """Put the ball somewhere: what the three and six numbers are, the module says."""

    def advance(self, force: Floats) -> tuple[Floats, Floats]:
        """Take a step under a (generalised) force of three components; return place and velocity after it.

        On joints the azimuth in `place` is that of this step alone. Raises `BreakdownError`.
        """

    def touches(self) -> list[Touch]:
        """The contact points of the last step."""

    def close(self) -> None:
        """Release what the engine holds."""


class BreakdownError(RuntimeError):
    """The engine can't take the next step."""


def simulate(
    engine: str,
    library: Library,
    build: Callable[[Any, Parameters, Any], Scene],
    p: Parameters,
    x0: npt.ArrayLike,
    t_end: float,
    flow: Flow,
    settings: Settings,
    sample_interval: float | None,
    progress: Callable[[float], None],
) -> Trajectory:
    """One run of an engine with the scene that `build` makes of what its library loads, and from rest of the azimuth.

    Where it breaks down, the header says why.

    Forces of a sample are those of the step that begins there, gaps of touching contacts the engine's own.

    Raises
    ------
    InputError
        If the library is not installed, an argument out of range, or the time step too large for the problem.
    """
    every, count = limits.sampling(t_end, settings.timestep, sample_interval)
    limits.check_timestep(settings.timestep, p, flow, t_end)
    if p.fluid_torque:
        raise InputError(f"fluid_torque = {p.fluid_torque:g} s-1: {engine} doesn't take it; mujoco, time-stepping do")
    x, joints = State.one(x0), settings.coordinates == "joints"
    limits.check_place(x, p, p.r / 10)
    ball = Ball.of(p, ContactSettings())  # for its drag, which has nothing to do with MuJoCo's settings
    total = (count - 1) * every + 1  # of the last sample only forces are needed
    done, told, failure, theta = 0, 0, "", 0.0
    rows, kept, classifier = np.empty((NOTED, _WIDTH)), list[npt.NDArray[np.void]](), Classifier([p], settings)

    def keep(first: int, last: bool) -> None:
        """Tell the cases of the steps in `rows`, and keep the samples among them."""
        steps = np.arange(first, done)
        block = _samples(np.asarray(steps * settings.timestep, dtype=float), rows[: len(steps)], joints, p)
        classifier.add(_contacts(block), last)
        kept.append(block[steps % every == 0])

    with closing(build(library.load(), p, settings)) as scene:
        place: Floats
        velocity: Floats
        if joints:
            qpos, qvel = recorder.joint_state(x, 0.0, p)
            place, velocity = qpos[:3].tolist(), (qvel @ _SPIN.T).tolist()
        else:
            motion = to_world(x, 0.0, p)
            place, velocity = motion.position.tolist(), [*motion.velocity.tolist(), *motion.spin.tolist()]
        scene.start(place, velocity)
        try:
            while done < total:
                number = done % NOTED
                if number == 0:
                    fluid = flow((done + np.arange(NOTED) + 0.5) * settings.timestep).tolist()
                row = rows[number]
                row[:10], row[10:] = [theta, *place, *velocity], 0.0
                place, velocity = scene.advance(_drag(place, velocity, fluid[number], ball, joints))
                if joints and place[1] >= p.R:
                    raise BreakdownError("reached the vessel's axis, where polar coordinates end,")
                azimuth = math.remainder(math.atan2(place[1], place[0]) - theta, math.tau)
                theta += place[0] if joints else azimuth
                for contact, force, gap in scene.touches():
                    of = row[10 + 5 * contact :][:5]
                    of[4] = min(gap, of[4]) if of[0] else gap
                    of[0], of[1:4] = 1.0, of[1:4] + force
                if not np.abs(row).max() < _HUGE:
                    raise BreakdownError("diverged")
                done += 1
                if done % NOTED == 0 and done < total:
                    keep(done - NOTED, last=False)
                    told = done
                    progress(done / total)
        except (BreakdownError, InterruptedError) as error:
            failure = f"{error} by t = {done * settings.timestep:g} s"
    keep(told, last=True)
    given = {"t_end": float(t_end), "sample_interval": every * settings.timestep, "x0": list(x), "theta_0": 0.0}
    given |= {"event_times": EVENT_TIMES}
    versions = {**current_versions(), library.name: library.version}
    header = Header(engine, p, flow, asdict(settings) | given, failure=failure, versions=versions)
    block = np.concatenate(kept)
    block["case"] = classifier.cases(0, np.arange(len(block)) * every)
    return Trajectory.from_blocks(header, [block], classifier.events(0))


def _contacts(block: npt.NDArray[np.void]) -> Contacts:
    """What the contacts do in successive steps, of samples (n,)."""
    A, B = block["force_A"], block["force_B"]
    each = (
        (A[:, 1], B[:, 0]),
        (np.hypot(A[:, 0], A[:, 2]), np.hypot(B[:, 1], B[:, 2])),
        (block["slip_speed_A"], block["slip_speed_B"]),
        (block["gap_A"], block["gap_B"]),
    )
    return Contacts(*(np.stack(pair, axis=-1)[:, None] for pair in each))


def _drag(place: Floats, velocity: Floats, omega_0: float, ball: Ball, joints: bool) -> Floats:
    """The (generalised) force of the fluid."""
    if joints:
        rho, (omega_c, v_h, v_y, *_) = ball.R - place[1], velocity
        along = rho * (omega_c - omega_0)
        mc = resistance(along, v_h, v_y, ball)
        return -mc * rho * along, -mc * v_h, -mc * v_y
    (x, y, _), (v_x, v_y, v_z, *_) = place, velocity
    w_x, w_y = v_x + omega_0 * y, v_y - omega_0 * x
    mc = resistance(w_x, w_y, v_z, ball)
    return -mc * w_x, -mc * w_y, -mc * v_z


def _samples(time: Array, rows: Array, joints: bool, p: Parameters) -> npt.NDArray[np.void]:
    """Samples of dtype `SAMPLE`, shape (n,), all but the case."""
    theta, place, velocity, *contacts = np.split(rows, [1, 4, 10, 15], axis=1)
    if joints:
        upright = np.broadcast_to([1.0, 0.0, 0.0, 0.0], (len(rows), 4))
        state = recorder.state(np.concatenate([place, upright], axis=1), velocity @ _SPIN, p)
    else:
        state, _ = from_world(Motion(place, velocity[:, :3], velocity[:, 3:]), p)
    block = samples(time, theta[:, 0], state, p)
    axes = frame(np.zeros(len(rows)) if joints else theta[:, 0])
    for name, own in zip("AB", contacts, strict=True):
        block[f"force_{name}"] = np.einsum("nab,nb->na", axes, own[:, 1:4])
        block[f"gap_{name}"] = np.where(own[:, 0] > 0, own[:, 4], block[f"gap_{name}"])
    return block
