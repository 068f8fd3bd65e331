"""The doors through which Coulomb's law reaches a simulation: its own steps, halves of steps,
MuJoCo's callback."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Iterator, Mapping
from typing import Any

import mujoco
import numpy as np
import numpy.typing as npt

from . import compiled
from .law import WIDTH, Array, Law, free_bodies

_INTEGRATORS = ("EULER", "RK4", "IMPLICIT", "IMPLICITFAST")


class Coulomb:
    """Coulomb's law of friction in a MuJoCo simulation: contacts that stick do not creep, those
    that slide do not lift.

    Parameters
    ----------
    model : any `mujoco.MjModel`, of MuJoCo 3.3 or later; both cones, condim 1, 3, 4 and 6
    rigid : False: MuJoCo's own contacts, whose depth, bounce and damping `solref` and `solimp` say.
        True: Moreau and Jean's time stepping, in which contacts have no depth to speak of and land
        within one step. Geoms get a `margin` in which contacts are seen ahead, but bear nothing: at
        least the way of a step at the speed of a fall through the scene, or a fifth of their
        radius. Dampers become inertia, of the same effect, which contacts know: the integrator is
        Euler's from then on. Margins are for steps up to the model's as it is now, dampers for that
        one.
    restitution : share of its normal speed with which a rigid contact parts after a blow, 0 … 1
    servo : time in which soft contacts lose their depth, s; None: they sink in as MuJoCo has them.
        It needs geoms with a `margin`, more than bodies sink in, of which an open contact then
        takes no notice; and it must be slower than the contact, best five times the time constant
        of `solref`.
    share : share of gravity to which a step must know beforehand how contacts slip, and what rigid
        ones bear; if it doesn't, it is solved again

    What is remembered belongs to one simulation: make one for each `MjData` (under `installed` that
    is done for you). It takes part in the state of the simulation, so save and restore both.
    Contacts of flexes are left as they are.

    Raises
    ------
    ValueError
        If a parameter is out of its range, or the model asks for what the law cannot serve.
    """

    def __init__(
        self,
        model: Any,
        *,
        rigid: bool = False,
        restitution: float = 0.0,
        servo: float | None = None,
        share: float = Law.share,
    ) -> None:
        if not isinstance(model, mujoco.MjModel):
            raise ValueError(f"model is a {type(model).__name__}; a mujoco.MjModel is needed")
        _check_number("restitution", restitution, "", 0.0, 1.0)
        if restitution and not rigid:
            raise ValueError(
                f"restitution = {restitution} needs rigid=True: solref says how soft contacts "
                f"bounce"
            )
        if servo is not None:
            _check_number("servo", servo, " s", float(model.opt.timestep), math.inf)
            if rigid:
                raise ValueError("servo is for soft contacts: rigid ones have no depth")
        _check_number("share", share, "", 1e-9, 1.0)
        self.model, self._law = model, Law(rigid, float(restitution), servo or 0.0, float(share))
        self._step, self._damped = float(model.opt.timestep), False
        self._check()
        if rigid:
            _see_ahead(model)
            self._damped = _damp_at_the_end(model)
        self._own = compiled.Simulation(model, self._law)
        self._adopted: dict[int, Any] | None = None

    def _check(self) -> None:
        """Raise `ValueError` if the model has an option or a part with which the law can't be
        applied."""
        model, option = self.model, self.model.opt
        name = mujoco.mjtIntegrator(option.integrator).name.removeprefix("mjINT_")
        if name not in _INTEGRATORS or (name == "RK4" and self._law.rigid):
            why = (
                "is of another order than blows"
                if name == "RK4"
                else "computes reference accelerations of its own"
            )
            raise ValueError(
                f"integrator = {name} {why}; Coulomb's law needs Euler, implicit or implicitfast"
            )
        if self._law.rigid and (
            option.timestep > self._step or (self._damped and option.timestep != self._step)
        ):
            raise ValueError(
                f"timestep = {option.timestep:g} s was {self._step:g} s when Coulomb(…, "
                f"rigid=True) was made"
            )
        if option.noslip_iterations:
            raise ValueError(
                f"noslip_iterations = {option.noslip_iterations} must be 0: Coulomb's law is in "
                f"its place"
            )
        for field in ("geom_friction", "pair_friction"):
            friction = getattr(model, field)
            if not np.isfinite(friction).all():
                number = int(np.argwhere(~np.isfinite(friction))[0, 0])
                raise ValueError(f"{field}[{number}] = {friction[number].tolist()} must be finite")
        if self._law.rigid and model.nflex:
            raise ValueError(
                f"the model has {model.nflex} flexes; rigid contacts are for bodies alone"
            )

    def reset(self) -> None:
        """Forget all, as after `mj_resetData`; a jump of `data.time` does so, too."""
        for simulation in (self._own, *(self._adopted or {}).values()):
            simulation.reset()

    def state(self) -> dict[str, Array]:
        """A copy of the memory, for `restore`: arrays by name.

        Contacts, (n, `law.WIDTH`), friction of joints, spins of free bodies, (m, 6), time and time
        step, s."""
        return self._own.state()

    def restore(self, state: Mapping[str, npt.ArrayLike]) -> None:
        """Go on from a `state`.

        Raises
        ------
        ValueError
            If it isn't one.
        """
        try:
            values = {
                name: np.array(state[name], float)
                for name in ("contacts", "joints", "spins", "time")
            }
        except (KeyError, TypeError) as error:
            raise ValueError(f"not a state of Coulomb: {error}") from None
        free = len(free_bodies(self.model)) if self._law.rigid else 0
        shapes = {
            "contacts": (values["contacts"].size // WIDTH, WIDTH),
            "spins": (free, 6),
            "time": (2,),
        }
        for name, shape in shapes.items():
            if values[name].shape != shape:
                raise ValueError(
                    f"not a state of Coulomb: {name} of shape {values[name].shape}, not {shape}"
                )
        self._own.restore(**values)

    # -- steps of its own ----------------------------------------------------------------------------------------------

    def step(self, data: Any, nstep: int = 1) -> None:
        """Advance by `nstep` steps, as `mujoco.mj_step` does.

        Raises
        ------
        ValueError
            If the data belong to another model, or an option was changed to one that is refused.
        """
        if not self._begin(data):
            mujoco.mj_step(self.model, data, nstep)
            return
        self._own.advance(self.model, data, nstep)

    def addresses(self, data: Any) -> tuple[int, int, int]:
        """Addresses of model, data and memory, for compiled loops that take steps by
        `compiled.step_of`."""
        self._begin(data)
        return self.model._address, data._address, self._own.serve(data._address)

    def step1(self, data: Any) -> None:
        """First half of a step, as `mujoco.mj_step1`: then set controls, and call `step2`."""
        self._begin(data)
        mujoco.mj_step1(self.model, data)

    def step2(self, data: Any) -> None:
        """Second half of a step, as `mujoco.mj_step2`."""
        if self._begin(data):
            self._own.control(self.model, data)
            mujoco.mj_step2(self.model, data)
            self._own.retain(self.model, data)
        else:
            mujoco.mj_step2(self.model, data)

    def _begin(self, data: Any) -> bool:
        """Check model and data before a step; whether this object applies the law, and not the
        installed callback."""
        if data.model is not self.model:
            raise ValueError("data belong to another MjModel than this Coulomb")
        self._check()
        if self.model._address in _INSTALLED:
            return False
        if self.model.opt.integrator == mujoco.mjtIntegrator.mjINT_RK4:
            raise ValueError(
                "integrator = RK4 has four stages in a step: use mj_step under "
                "Coulomb(model).installed()"
            )
        return True

    # -- MuJoCo's callback ---------------------------------------------------------------------------------------------

    @contextlib.contextmanager
    def installed(self) -> Iterator[Coulomb]:
        """Within this, `mujoco.mj_step`, `mj_forward` and `mj_step1` with `mj_step2` obey the law
        for this model.

        It is MuJoCo's control callback, for programs that step by themselves. Each `MjData` of the
        model has a memory of its own; other models are left alone. Several may be installed at
        once. Without numba MuJoCo builds no model within this, as under any callback in Python.

        Raises
        ------
        ValueError If the callback is somebody else's, the model is installed already, or disables
            its controls and so the callback.
        """
        model, taken = self.model, mujoco.get_mjcb_control()
        self._check()
        if taken is not None and not _INSTALLED:
            raise ValueError(
                f"mjcb_control is taken by {getattr(taken, '__qualname__', taken)!r}: use step() "
                f"instead"
            )
        if model._address in _INSTALLED:
            raise ValueError("this model is under installed() already")
        if model.opt.disableflags & mujoco.mjtDisableBit.mjDSBL_ACTUATION:
            raise ValueError(
                "the model's flag actuation is disabled, and with it the callback: use step() "
                "instead"
            )
        self._adopted = {}
        _INSTALLED[model._address] = self
        compiled.forget_all()
        mujoco.set_mjcb_control(compiled.callback(_simulation))
        try:
            yield self
        finally:
            del _INSTALLED[model._address]
            compiled.forget_all()
            self._adopted = None
            if not _INSTALLED:
                mujoco.set_mjcb_control(None)


_INSTALLED: dict[int, Coulomb] = {}
"""By the address of their models."""


def _simulation(model: int, data: int) -> Any:
    """Address of what is remembered of a simulation that is new to the callback; 0 if it isn't
    under the law."""
    coulomb = _INSTALLED.get(model)
    if coulomb is None or coulomb._adopted is None:
        compiled.remember(model, data, 0)
        return 0
    known = coulomb._adopted
    if data not in known:
        known[data] = compiled.Simulation(coulomb.model, coulomb._law) if known else coulomb._own
    head = known[data].serve(data)
    compiled.remember(model, data, head)
    return head


def _check_number(name: str, value: float, unit: str, least: float, most: float) -> None:
    """Raise `ValueError`, with name, value, unit and range, unless a value is a number in the
    range."""
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not least <= value <= most:
        allowed = f"from {least:g} to {most:g}" if most < math.inf else f"at least {least:g}"
        raise ValueError(
            f"{name} = {value!r}{unit if isinstance(value, (int, float)) else ''} must be "
            f"{allowed}{unit}"
        )


def _see_ahead(model: Any) -> None:
    """Widen contact margins to what a body that fell through the scene moves in a step, at most a
    fifth of its radius.

    Colliders take a body that is smaller than the margin for one that overlaps.
    """
    ahead = model.opt.timestep * math.sqrt(
        2 * np.linalg.norm(model.opt.gravity) * model.stat.extent
    )
    most = model.geom_rbound / 5
    np.maximum(model.geom_margin, np.minimum(ahead, most), out=model.geom_margin)
    pairs = [model.pair_geom1, model.pair_geom2]
    np.maximum(
        model.pair_margin,
        np.minimum(ahead, most[np.array(pairs)].max(axis=0)),
        out=model.pair_margin,
    )


def _damp_at_the_end(model: Any) -> bool:
    """Replace dampers at the speed after a step by inertia, h times their damping; the integrator
    becomes Euler's.

    Returns whether there are any.

    That is what MuJoCo's integrators do, but only after contacts have been solved for, so that
    velocities are not those which contacts asked for. Of implicit integrators the dampers of
    joints, tendons and servos on them are kept."""
    option, euler, h = model.opt, mujoco.mjtIntegrator.mjINT_EULER, model.opt.timestep
    implicit, joints = option.integrator != euler, np.zeros(model.nv)
    tendons = h * implicit * model.tendon_damping
    if implicit or not option.disableflags & mujoco.mjtDisableBit.mjDSBL_EULERDAMP:
        joints += h * model.dof_damping
    option.integrator = euler
    option.disableflags |= mujoco.mjtDisableBit.mjDSBL_EULERDAMP
    servos = model.actuator_biastype == int(mujoco.mjtBias.mjBIAS_AFFINE)
    for k in np.flatnonzero(servos & implicit).tolist():
        servo = -h * model.actuator_biasprm[k, 2] * model.actuator_gear[k, 0] ** 2
        kind, target = mujoco.mjtTrn(model.actuator_trntype[k]), model.actuator_trnid[k, 0]
        if kind == mujoco.mjtTrn.mjTRN_TENDON:
            tendons[target] += servo
        elif kind == mujoco.mjtTrn.mjTRN_JOINT and model.jnt_type[target] >= int(
            mujoco.mjtJoint.mjJNT_SLIDE
        ):
            joints[model.jnt_dofadr[target]] += servo
    model.dof_armature += joints
    if hasattr(model, "tendon_armature"):  # MuJoCo 3.3.0 has none
        model.tendon_armature += tendons
    return bool(joints.any() or tendons.any())
