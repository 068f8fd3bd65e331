"""The ball in its vessel, by the adapter of any engine: the loop that makes a trajectory of it.

The engine has the scene of a free ball between a plane and a cylinder, and is driven by -m c(|w|) w
(9) alone, with the velocity w relative to the fluid at the beginning of each step. The loop adds
samples, cases, and what becomes of a run that breaks down."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import closing
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from compare.engines.adapters.free import BreakdownError, Free, Library
from compare.engines.adapters.scene import Body, Scene, Surface, Vector
from mjsim.classify import Classifier, ContactHistory
from mjsim.engine import EVENT_TIMES, check_timestep, sampling
from mjsim.mid_step import BallConstants, resistance
from model import Flow, Header, InputError, Parameters, State, Trajectory
from model.kinematics import Motion, check_place, frame, from_world, to_world
from model.parameters import POSITIVE, check_number
from model.trajectory import samples
from model.versions import current_versions

_HUGE = 1e8  # a coordinate, velocity or force beyond this, in SI units, has diverged
_REACH = 1e-3  # gap, in radii, up to which a contact is closed by what is seen of the motion alone
_ROLLS = 3.0
"""Slip speed, in units of the least that an engine tells from rolling, up to which a contact rolls:
how exact that is isn't known."""
NOTED = 1024  # steps of which the cases are told at once


@dataclass(frozen=True, kw_only=True)
class Settings:
    """Settings of a run by another engine: the time step; its adapter declares all else."""

    timestep: float = 1e-3  # s

    def __post_init__(self) -> None:
        check_number("timestep", self.timestep, "s", POSITIVE)


def scene_fields(p: Parameters, x: State) -> dict[str, Any]:
    """Fields of the `Scene` of a ball in the study's vessel, at azimuth zero."""
    place, velocity, spin = (part.tolist() for part in to_world(x, 0.0, p))
    body = Body((*place,), (*velocity,), (*spin,), "sphere", (p.r,), p.m, (p.j * p.m * p.r**2,) * 3)
    return {
        "body": body,
        "surfaces": (Surface("floor", p.mu), Surface("wall", p.eta, radius=p.R + p.r)),
        "g": p.g,
    }


@dataclass(frozen=True, kw_only=True)
class Vessel(Scene):
    """A ball in the study's vessel, with its law of drag and its flow."""

    ball: BallConstants
    fluid: Flow

    @classmethod
    def of(cls, p: Parameters, x: State, flow: Flow) -> Vessel:
        """The scene of a ball with these parameters, which starts at azimuth zero."""
        return cls(name="vessel", **scene_fields(p, x), ball=BallConstants.of(p), fluid=flow)

    @property
    def forced(self) -> bool:
        return True

    def force(self, t: float, position: Any, velocity: Any) -> Vector:
        (x, y, _), (v_x, v_y, v_z) = position, velocity
        omega_0 = float(self.fluid(t))
        w_x, w_y = v_x + omega_0 * y, v_y - omega_0 * x
        mc = resistance(w_x, w_y, v_z, self.ball)
        return float(-mc * w_x), float(-mc * w_y), float(-mc * v_z)


def check_run(task: Any) -> tuple[int, int]:
    """`InputError` for a task that can't begin; else steps between samples, and their number."""
    check_timestep(task.settings.timestep, task.parameters, task.fluid, task.t_end, task.x0)
    check_place(task.x0, task.parameters, task.parameters.r / 10)
    return sampling(task.t_end, task.settings.timestep, task.sample_interval)


def simulate(
    library: Library, member: str, task: Any, progress: Callable[[float], None]
) -> Trajectory:
    """One run, a `compare.campaign.tasks.Task`, with one of the adapters of an engine's library.

    Where it breaks down, the header says why. Where its adapter doesn't tell what contacts carry,
    forces are nan, and cases are told by gaps and slip alone.

    Forces of a sample are those of the step that begins there, gaps the engine's own.

    Raises
    ------
    InputError
        If the library is not installed, an argument out of range, or the time step too large
        for the problem."""
    p, flow, t_end, h = task.parameters, task.fluid, task.t_end, task.settings.timestep
    x: State = task.x0
    every, count = check_run(task)
    total, failure = (count - 1) * every + 1, ""  # of the last sample only forces are needed
    with closing(library.load(member)) as engine:
        try:
            engine.build(Vessel.of(p, x, flow), h)
        except (RuntimeError, ValueError) as error:
            raise InputError(
                f"{task.engine} can't build the vessel: {' '.join(str(error).split())[:80]}"
            ) from error
        # A wall that moves along for a step is a cylinder to (Omega h)^2.
        fastest = max(abs(x.omega_c), float(np.abs(flow(np.linspace(0.0, t_end, NOTED))).max()))
        steps = _Steps(engine, h, p, every, p.R * fastest * (fastest * h) ** 2 / 4)
        try:
            while steps.done < total:
                steps.take()
                if steps.done % NOTED == 0 and steps.done < total:
                    steps.tell(last=False)
                    progress(steps.done / total)
        except (RuntimeError, InterruptedError) as error:
            # what engines raise where they can't go on
            known = isinstance(error, (BreakdownError, InterruptedError))
            said = f"{error}" if known else f"could not go on ({' '.join(str(error).split())[:80]})"
            failure = f"{said} by t = {steps.done * h:g} s"
        steps.tell(last=True)
        declared, told_by = engine.DECLARED, "contact forces" if engine.TELLS else "gaps and slip"
    given = {"timestep": h, "declared": declared, "cases_by": told_by}
    given |= {"t_end": float(t_end), "sample_interval": every * h}
    given |= {"x0": list(x), "theta_0": 0.0, "event_times": EVENT_TIMES}
    versions = {**current_versions(), library.name: library.version}
    header = Header(task.engine, p, flow, given, failure=failure, versions=versions)
    block = np.concatenate(steps.kept)
    block["case"] = steps.classifier.cases(np.arange(len(block)) * every)
    return Trajectory.from_blocks(header, [block], steps.classifier.events())


class _Steps:
    """The steps of a run: noted, then turned into samples and cases in blocks."""

    def __init__(
        self, engine: Free, timestep: float, p: Parameters, every: int, along: float
    ) -> None:
        """One of `every` steps is a sample; `along`: how fast the wall's plane slips, m s-1."""
        self.engine, self.timestep, self.p, self.every, self.done = engine, timestep, p, every, 0
        self.band = band = _ROLLS * (engine.RESOLUTION + along)
        self.classifier = Classifier(
            p, timestep, engine.ahead / timestep, lambda load: np.full(np.shape(load), band)
        )
        self.kept = list[npt.NDArray[np.void]]()
        self._told, self._theta = 0, 0.0
        self._motions, self._forces = np.empty((NOTED, 3, 3)), np.empty((NOTED, 2, 3))
        self._gaps = np.empty((NOTED, 2))  # nan where the engine has no contact

    def take(self) -> None:
        """Take a step, and note the state before it and what contacts carried in it."""
        engine, k = self.engine, self.done % NOTED
        self._motions[k] = engine.state()
        engine.step(1)
        if not np.abs(engine.look()).max() < _HUGE:
            raise BreakdownError("diverged")
        self._forces[k], self._gaps[k] = 0.0 if engine.TELLS else np.nan, np.nan
        for contact, force, gap in engine.touches() if engine.TELLS else ():
            self._forces[k, contact] += force
            self._gaps[k, contact] = np.fmin(gap, self._gaps[k, contact])
        self.done += 1

    def tell(self, last: bool) -> None:
        """Classify the steps noted since the last call, and keep the samples among them."""
        steps, self._told, p = np.arange(self._told, self.done), self.done, self.p
        motion = Motion(*self._motions[: len(steps)].transpose(1, 0, 2))
        state, azimuth = from_world(motion, p)
        theta = np.unwrap(np.append(self._theta, azimuth))
        self._theta = float(theta[-1])
        block = samples(np.asarray(steps * self.timestep, float), theta[1:], state, p)
        # Forces are along the axes of where the ball was when they were found.
        x, y, _ = (motion.position + self.engine.ahead * motion.velocity).T
        axes = frame(np.arctan2(y, x))
        for k, name in enumerate("AB"):
            force, gap = self._forces[: len(steps), k], self._gaps[: len(steps), k]
            block[f"force_{name}"] = np.einsum("nab,nb->na", axes, force)
            block[f"gap_{name}"] = np.where(np.isnan(gap), block[f"gap_{name}"], gap)
        slips, gaps = (
            np.stack([block[f"{what}_{k}"] for k in "AB"], axis=-1)
            for what in ("slip_speed", "gap")
        )
        A, B = block["force_A"], block["force_B"]
        loads = np.stack([A[:, 1], B[:, 0]], axis=-1)
        used = np.stack([np.hypot(A[:, 0], A[:, 2]), np.hypot(B[:, 1], B[:, 2])], axis=-1)
        # a closed contact bears 1 N, and uses all of its friction if it slips
        if np.isnan(A).any():
            loads = (gaps < _REACH * p.r) * 1.0
            used = np.array([p.mu, p.eta]) * loads * (slips > 3 * self.band)
        self.classifier.add(ContactHistory(loads, used, slips, gaps), last)
        self.kept.append(block[steps % self.every == 0])
