"""Coulomb's law of friction in a MuJoCo simulation."""

from __future__ import annotations

import contextlib
import functools
import math
import sys
import warnings
import weakref
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import mujoco
import numpy as np
import numpy.typing as npt

from .callback import CALLBACK, finish
from .engine import MARGINS_ADD_UP
from .memory import Simulation, check_state, sizes
from .parameters import CCD_TOLERANCE, DOFS, EARTH, Law

_RK4, _EULER = int(mujoco.mjtIntegrator.mjINT_RK4), int(mujoco.mjtIntegrator.mjINT_EULER)
_INTEGRATORS = {
    *(_RK4, _EULER, int(mujoco.mjtIntegrator.mjINT_IMPLICIT)),
    int(mujoco.mjtIntegrator.mjINT_IMPLICITFAST),
}
_PYRAMID = int(mujoco.mjtConstraint.mjCNSTR_CONTACT_PYRAMIDAL)
_MOST_STEPS, _LARGEST = 2**31 - 1, sys.float_info.max
_ELLIPTIC = int(mujoco.mjtCone.mjCONE_ELLIPTIC)
_PGS, _NEWTON = int(mujoco.mjtSolver.mjSOL_PGS), int(mujoco.mjtSolver.mjSOL_NEWTON)
_NO_ACTUATION = int(mujoco.mjtDisableBit.mjDSBL_ACTUATION)
_NO_DAMPING = int(mujoco.mjtDisableBit.mjDSBL_EULERDAMP)
_OVERRIDE = int(mujoco.mjtEnableBit.mjENBL_OVERRIDE)


class Coulomb:
    """Coulomb's law of friction in a MuJoCo simulation: what sticks does not creep, what slides
    does not lift.

    Parameters
    ----------
    model : any `mujoco.MjModel`, of MuJoCo 3.3.6 or later; condim 1, 3, 4 and 6. Coulomb's law
        has no pyramid: the cone is elliptic while the law acts, and then again what it was. So give
        a model whose forces you read by `mj_contactForce` the elliptic cone, or read them in
        `acting`: MuJoCo would take the rows for a pyramid's. Newton's method stands in for the
        solver PGS while the law acts
    rigid : False: MuJoCo's own contacts, whose depth, bounce and damping `solref` and `solimp` say.
        True: Moreau and Jean's time stepping, in which contacts have no depth to speak of and land
        within one step. Geoms get a `margin` in which contacts are seen ahead, but bear nothing: at
        least the way of a step at the speed of a fall through the scene, or a fifth of their
        radius; less where that reaches too many cells of a heightfield. Margins are for steps up
        to the model's as it is now. Dry friction of joints and tendons is as stiff. While the law
        acts the integrator is Euler's, and dampers are inertia of the same effect, which contacts
        know
    restitution : share of its normal speed with which a rigid contact parts after an impact, 0 … 1;
        or one for each geom, of which two in contact have the larger, as MuJoCo mixes friction
    kinetic : friction of contacts that slide, in units of the friction that keeps them from it,
        0.001 … 1
    servo : Baumgarte stabilisation: time in which soft contacts lose their depth, s; None: they
        sink in as MuJoCo has them. It needs geoms with a `margin`, more than bodies sink in, of
        which an open contact then takes no notice; and it must be slower than the contact, best
        five times the time constant of `solref`
    share : share of gravity to which a step must know beforehand how contacts slip, and what rigid
        ones bear; if it doesn't, it is solved again
    depth : depth that rigid contacts keep at a time step of 2 ms, in units of the smaller radius;
        it falls with the square of the step. 0 is for colliders that see all points within the
        margin, as spheres on planes

    Each `MjData` has a memory of its own. It takes part in the state of the simulation, so save and
    restore both. Contacts of flexes are left as they are; so is all in a soft simulation in which
    nothing touches, but for the solver PGS. A copy, also by pickle, has the memory of the only
    `MjData` that there was; of several none.

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
        restitution: float | Sequence[float] = 0.0,
        kinetic: float = 1.0,
        servo: float | None = None,
        share: float = Law.share,
        depth: float = Law.depth,
    ) -> None:
        if not isinstance(model, mujoco.MjModel):
            raise ValueError(f"model is a {type(model).__name__}; a mujoco.MjModel is needed")
        if not isinstance(rigid, (bool, np.bool_)):
            raise ValueError(f"rigid = {_shown(rigid)} must be True or False")
        bounces = _restitution(model, restitution)
        if bounces and not rigid:
            raise ValueError(
                f"restitution = {_shown(restitution)} needs rigid=True: "
                "solref says how soft contacts bounce"
            )
        if servo is not None:
            _check_number("servo", servo, " s", float(model.opt.timestep), _LARGEST)
            if rigid:
                raise ValueError("servo is for soft contacts: rigid ones have no depth")
        _check_number("kinetic", kinetic, "", 1e-3, 1.0)
        _check_number("share", share, "", 1e-9, 1.0)
        _check_number("depth", depth, "", 0.0, 0.1)
        law = Law(
            rigid=bool(rigid),
            restitution=bounces,
            kinetic=float(kinetic),
            servo=float(servo or 0.0),
            share=float(share),
            depth=float(depth),
        )
        self.__setstate__((model, law, float(model.opt.timestep), None))
        self._check()
        _check_friction(model)
        if rigid:
            _see_ahead(model)

    def __getstate__(self) -> tuple[Any, Law, float, Mapping[str, npt.NDArray[Any]] | None]:
        try:
            state = self.state() if len(self._simulations) == 1 else self._restored
        except ValueError as error:
            raise TypeError(f"a Coulomb can't be copied now: {error}, or reset()") from error
        return self.model, self._law, self._step, state

    def __setstate__(self, given: Any) -> None:
        self.model, self._law, self._step, self._restored = given
        self._simulations: dict[int, Simulation] = {}
        weakref.finalize(self, _remove_all, self._simulations)

    def _check(self) -> None:
        """Raise `ValueError` if the model has an option or a part the law can't be applied with."""
        model, option, rigid = self.model, self.model.opt, self._law.rigid
        kind, h = option.integrator, option.timestep
        if kind not in _INTEGRATORS or (rigid and kind == _RK4):
            name = mujoco.mjtIntegrator(kind).name.removeprefix("mjINT_")
            own = "computes reference accelerations of its own"
            why = "is of another order than impacts" if kind == _RK4 else own
            raise ValueError(
                f"integrator = {name} {why}; Coulomb's law needs Euler, implicit or implicitfast"
            )
        if rigid and h > self._step:
            raise ValueError(
                f"timestep = {h:g} s was {self._step:g} s when Coulomb(…, rigid=True) was made"
            )
        if option.noslip_iterations:
            raise ValueError(
                f"noslip_iterations = {option.noslip_iterations} must be 0: "
                "Coulomb's law is in its place"
            )
        if option.disableflags & _NO_ACTUATION:
            raise ValueError(
                "the model's flag actuation is disabled, and with it the callback by which the law "
                "acts: disable actuators by their groups instead (option actuatorgroupdisable)"
            )
        if rigid and model.nflex:
            raise ValueError(
                f"the model has {model.nflex} flexes; rigid contacts are for bodies alone"
            )

    # -- what is remembered ------------------------------------------------------------------------

    def _simulation(self, data: Any) -> Simulation:
        """The memory of the simulation of these data."""
        if not isinstance(data, mujoco.MjData):
            raise ValueError(f"data is a {type(data).__name__}; a mujoco.MjData is needed")
        address = data._address
        simulation = self._simulations.get(address)
        if simulation is None or simulation.data() is not data:
            if not np.array_equal(sizes(data.model), sizes(self.model)):
                raise ValueError("data belong to another MjModel than this Coulomb")
            if simulation is None or simulation.data() is not None:
                simulation = self._adopt(address)
            simulations = self._simulations
            simulation.data = weakref.ref(data, lambda _: _remove(simulations, address))
        CALLBACK.know(address, simulation)
        return simulation

    def _adopt(self, address: int) -> Simulation:
        """A memory for the data at an address, which go on from a restored state, if any."""
        simulation = self._simulations[address] = self._begun()
        self._restored, simulation.record["data"] = None, address
        simulation.active[0] = CALLBACK.installed(self.model._address)
        return simulation

    def _begun(self) -> Simulation:
        """A memory that goes on from a restored state, if there is any."""
        simulation = Simulation(self.model, self._law)
        if self._restored is not None:
            simulation.restore(self._restored)
        return simulation

    @functools.cached_property
    def _fresh(self) -> Mapping[str, npt.NDArray[Any]]:
        """The state of a simulation that has just begun."""
        return Simulation(self.model, self._law).state()

    def reset(self) -> None:
        """Forget all, as after `mj_resetData`; a jump of `data.time` does so, too."""
        self._restored = None
        for simulation in self._simulations.values():
            simulation.reset()

    def state(self, data: Any = None) -> dict[str, npt.NDArray[Any]]:
        """A copy of the memory, for `restore`: structured and other arrays by name.

        Contacts with their fields (`memory.REMEMBERED`), friction of joints, N or N m, spins of
        free bodies (m, 6), N m s, time and time step, s. `data`: of which simulation, if there are
        several or MuJoCo has stepped it itself.

        Raises
        ------
        ValueError
            If it isn't clear whose memory is asked for, or its data are gone.
        """
        if data is not None:
            simulation = self._simulation(data)
        elif len(self._simulations) > 1:
            raise ValueError("several MjData have been under this law: say of which, state(data)")
        elif self._simulations:
            (simulation,) = self._simulations.values()
        else:
            simulation = self._begun()
        if simulation.knows and simulation.unsettled:
            if simulation.data() is None:
                raise ValueError(
                    "the data whose last forces are asked for are unknown: state(data)"
                )
            finish(simulation.address, True)
        return simulation.state()

    def restore(self, state: Mapping[str, npt.NDArray[Any]], data: Any = None) -> None:
        """Go on from a `state`: these data, or those that step next.

        Raises
        ------
        ValueError
            If it isn't one of this model.
        """
        check_state(state, self._fresh, self.model)
        if data is not None:
            self._simulation(data).restore(state)
            return
        _remove_all(self._simulations)
        self._restored = {name: np.array(values) for name, values in state.items()}

    # -- steps -------------------------------------------------------------------------------------

    def step(self, data: Any, nstep: int = 1) -> None:
        """Advance by `nstep` steps, as `mujoco.mj_step` does.

        Raises
        ------
        ValueError
            If the data belong to another model, an option was changed to one that is refused, or
            `nstep` isn't a whole number.
        """
        whole = isinstance(nstep, (int, np.integer)) and not isinstance(nstep, bool)
        if not whole or not 0 <= nstep <= _MOST_STEPS:
            raise ValueError(
                f"nstep = {_shown(nstep)} must be a whole number from 0 to {_MOST_STEPS}"
            )
        with self.acting(data):
            mujoco.mj_step(self.model, data, nstep)

    def forward(self, data: Any) -> None:
        """Compute forces, accelerations and sensors under the law, as `mujoco.mj_forward` does."""
        with self.acting(data):
            mujoco.mj_forward(self.model, data)

    @property
    def unsolved(self) -> int:
        """How many steps of all `MjData` that there are didn't come to `share`."""
        return sum(int(each.record["unsolved"][0]) for each in self._simulations.values())

    def step1(self, data: Any) -> None:
        """First half of a step, as `mujoco.mj_step1`: then set controls, and call `step2`."""
        self._check_halves(data)
        CALLBACK.set(self.model, self._law.rigid, self._options)
        try:
            mujoco.mj_step1(self.model, data)
        finally:
            CALLBACK.unset(self.model)

    def step2(self, data: Any) -> None:
        """Second half of a step, as `mujoco.mj_step2`."""
        self._check_halves(data)
        if CALLBACK.installed(self.model._address):
            mujoco.mj_step2(self.model, data)
            return
        stage = mujoco.mjtStage
        done = stage.mjSTAGE_NONE if (data.efc_type == _PYRAMID).any() else stage.mjSTAGE_VEL
        with self.acting(data):
            mujoco.mj_forwardSkip(self.model, data, done, 0)
            mujoco.mj_checkAcc(self.model, data)
            euler = self.model.opt.integrator == _EULER
            (mujoco.mj_Euler if euler else mujoco.mj_implicit)(self.model, data)

    def _check_halves(self, data: Any) -> None:
        self._simulation(data)
        self._check()
        if self.model.opt.integrator == _RK4:
            raise ValueError("integrator = RK4 has four stages in a step: use step()")

    def acting(self, data: Any) -> contextlib.AbstractContextManager[None]:
        """Within this MuJoCo's own functions, called with these data, obey the law."""
        return _Acting(self, self._simulation(data))

    def _options(self) -> dict[str, Any]:
        """Options of the model under which the law acts.

        Rigid contacts ask for velocities after a step, so they must know of what brakes:
        `add_dampers` makes it inertia, and Euler's method leaves it alone. MuJoCo's integrators
        take it into account, too, but only after contacts have been solved for.
        """
        option, wanted = self.model.opt, {"cone": _ELLIPTIC}
        if option.solver == _PGS:
            # from no force PGS only tries a normal one, which De Saxcé's shift keeps at none
            wanted["solver"] = _NEWTON
        if self._law.rigid:
            wanted["integrator"], wanted["disableflags"] = _EULER, option.disableflags | _NO_DAMPING
            # what lies on a smooth side rolls off if its point is a micrometre beside it
            wanted["ccd_tolerance"] = min(option.ccd_tolerance, CCD_TOLERANCE)
            wanted["tolerance"] = option.tolerance * max(DOFS / max(self.model.nv, 1), 1.0)
        return wanted

    @contextlib.contextmanager
    def installed(self) -> Iterator[Coulomb]:
        """Within this, `mujoco.mj_step`, `mj_forward` and `mj_step1` with `mj_step2` obey the law
        for this model.

        That is for programs that step by themselves. Other models are left alone. Several may be
        installed at once.

        Raises
        ------
        ValueError
            If the model is installed already, or asks for what the law cannot serve.
        """
        address = self.model._address
        self._check()
        if CALLBACK.installed(address):
            raise ValueError("this model is under installed() already")
        CALLBACK.set(self.model, self._law.rigid, self._options)
        CALLBACK.install(address, self._adopt, self._simulations)
        for simulation in self._simulations.values():
            simulation.active[0] = 1
        acted = True
        try:
            yield self
        finally:
            acted = CALLBACK.uninstall(address)
            CALLBACK.unset(self.model)
            for simulation in self._simulations.values():
                simulation.active[0] = 0
        if not acted:
            warnings.warn(
                "another mjcb_control was set under installed(): the law doesn't act since then",
                RuntimeWarning,
                stacklevel=3,
            )


class _Acting(contextlib.AbstractContextManager[None]):
    """Within this the law acts on a simulation. (A generator would cost a microsecond.)"""

    def __init__(self, law: Coulomb, simulation: Simulation) -> None:
        self._law, self._simulation, self._before = law, simulation, simulation.active[0]

    def __enter__(self) -> None:
        law = self._law
        law._check()
        CALLBACK.set(law.model, law._law.rigid, law._options)
        self._simulation.active[0] = 1

    def __exit__(self, error: Any, *_: Any) -> None:
        if error:  # the step was left in its middle
            self._simulation.reset()
        finish(self._simulation.address, False)
        self._simulation.active[0] = self._before
        CALLBACK.unset(self._law.model)


def _remove(simulations: dict[int, Simulation], address: int) -> None:
    """Forget the simulation of data that are gone."""
    CALLBACK.remove(address, simulations.pop(address, None))


def _remove_all(simulations: dict[int, Simulation]) -> None:
    """Forget all simulations."""
    for address in list(simulations):
        _remove(simulations, address)


def _check_number(name: str, value: float, unit: str, least: float, most: float) -> None:
    """Raise `ValueError`, with name, value, unit and range, unless a number is in the range."""
    number = isinstance(value, (int, float, np.integer, np.floating)) and value is not True
    if not number or isinstance(value, bool) or not least <= value <= most:
        allowed = f"from {least:g} to {most:g}" if most < _LARGEST else f"at least {least:g}"
        given = f"{_shown(value)}{unit if number else ''}"
        raise ValueError(f"{name} = {given} must be {allowed}{unit}")


def _shown(value: Any) -> str:
    """What was given, in a few words of one line."""
    text = " ".join(repr(value).split())
    return text if len(text) <= 40 else f"{text[:40]}…"


def _restitution(model: Any, given: Any) -> tuple[float, ...]:
    """That of each geom, or none if nothing bounces; `ValueError` for others than 0 … 1."""
    if isinstance(given, (list, tuple, np.ndarray)):
        if np.shape(given) != (model.ngeom,):
            raise ValueError(
                f"restitution = {_shown(given)} must be one number, or one for each of "
                f"{model.ngeom} geoms"
            )
        values = list(given)
    else:
        values = [given] * model.ngeom
    for k, value in enumerate(values):
        _check_number("restitution" if value is given else f"restitution[{k}]", value, "", 0.0, 1.0)
    return tuple(map(float, values)) if any(values) else ()


def _check_friction(model: Any) -> None:
    """Raise `ValueError` if a coefficient of friction is not a number."""
    for field in ("geom_friction", "pair_friction"):
        friction = getattr(model, field)
        if not np.isfinite(friction).all():
            number = int(np.argwhere(~np.isfinite(friction))[0, 0])
            raise ValueError(f"{field}[{number}] = {friction[number].tolist()} must be finite")


def _see_ahead(model: Any) -> None:
    """Widen contact margins to what a body that fell through the scene moves in a step, at most a
    fifth of its radius; to a fall of a step where something sticks, as adhesion acts within them,
    and of what crowds a heightfield.

    Colliders take a body that is smaller than the margin for one that overlaps.
    """
    gravity, h = float(np.linalg.norm(model.opt.gravity)) or EARTH, model.opt.timestep
    fall = gravity * h**2
    ahead = fall if _sticks(model) else h * math.sqrt(2 * gravity * model.stat.extent)
    most = model.geom_rbound / 5
    own = np.minimum(np.where(_crowds(model), min(ahead, fall), ahead), most)
    moves = model.body_weldid[model.geom_bodyid] > 0  # what is at rest has that of the smallest
    own = np.where(moves, own, own.min(where=moves & (most > 0), initial=ahead))
    np.maximum(model.geom_margin, own / 2 if MARGINS_ADD_UP else own, out=model.geom_margin)
    # bodies of several geoms are compared by their own margins first
    np.maximum.at(model.body_margin, model.geom_bodyid, model.geom_margin)
    pairs = np.array([model.pair_geom1, model.pair_geom2])
    np.maximum(model.pair_margin, own[pairs].max(axis=0), out=model.pair_margin)
    if model.opt.enableflags & _OVERRIDE:  # one margin for all contacts
        model.opt.o_margin = max(model.opt.o_margin, own.min(initial=ahead))


def _crowds(model: Any) -> npt.NDArray[np.bool_]:
    """Which geoms are wider than four cells of a heightfield: of 50 points that MuJoCo takes of a
    pair, those ahead would leave none to what is below."""
    sizes = 4 * model.hfield_size[:, 0] * model.hfield_size[:, 1]
    cells = sizes / ((model.hfield_ncol - 1) * (model.hfield_nrow - 1))
    return np.asarray(2 * model.geom_rbound > 4 * np.sqrt(cells.min(initial=math.inf)))


def _sticks(model: Any) -> bool:
    """Whether there is adhesion, of bodies by actuators or of geoms and pairs."""
    of_bodies = (model.actuator_trntype == int(mujoco.mjtTrn.mjTRN_BODY)).any()
    since_4 = [getattr(model, name, None) for name in ("geom_adhesion", "pair_adhesion")]
    return bool(of_bodies or any(np.any(values) for values in since_4 if values is not None))
