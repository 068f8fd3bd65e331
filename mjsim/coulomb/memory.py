"""What a simulation remembers from one step to the next, field by field.

Compiled code reads and writes it through the address of its `MEMORY`, which has the addresses of
the arrays; those belong to a `Simulation`, which makes larger ones when it is asked to.

The way of a contact's force: from step to step it is `load` and `friction`, in the axes of both
geoms, which turn along. `carried` is the friction in the axes of this step's contact. Rows have it
as `remembered`, and the part of it that gives way no more as `held`. `force` is what the step comes
to, and is stored as `load` and `friction` when the next step looks for its contacts.
"""

from __future__ import annotations

import ctypes
import math
import weakref
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import numpy.typing as npt
from numba import types

from .compiling import c_function, view
from .engine import MJ_CONTACT, MOST_POINTS, POINT, array_at, integers, reals
from .parameters import LAW, Law

NEW, OPEN, STICKS, SLIDES = range(4)
"""State of a contact."""
FORCE, MOMENT = range(2)
"""Kind of friction: along an axis, of sliding; about it, of spin and rolling."""
MOST_ROWS = 6
"""Of a contact."""

_f8, _i4, _i8 = np.float64, np.int32, np.int64

CONTACT = np.dtype(
    [
        ("geoms", _i4, 2),
        ("state", _i4),
        ("weakened", _i4),  # whether its friction is kinetic
        # where it is: on each body in the axes of its geom, m; the normal in those of the first
        ("place", _f8, (2, 3)),
        ("normal", _f8, 3),
        ("gap", _f8),  # m; negative where bodies overlap
        ("load", _f8),  # normal force, N
        # friction in the axes of both geoms: geom, axis, force (N) or moment (N m)
        ("friction", _f8, (2, 3, 2)),
        ("velocity", _f8, 3),  # relative, by the last Jacobian and present velocities, m s-1
        ("turned", _f8, 3),  # what its rows leave out, by axis, as its Jacobian turns, m s-2
        ("belt", _f8),  # how fast its surfaces move on their bodies at most, m s-1
        ("lift", _f8),  # distance that Baumgarte stabilisation holds, m
        # De Saxcé's shift, the coefficient of friction times the slip, m s-2
        ("predicted", _f8),  # before the step; then what it came to
        ("extrapolated", _f8),  # as if accelerations stayed those of the last step; -1: not known
        ("shortfall", _f8),  # by how much that was too little in the last step
        ("bias", _f8),  # what to add to it: half of that and half of what was added, at most that
        ("error", _f8),  # by how much the prediction was wrong
        # -- of one step alone --
        ("index", _i4),  # its number in mjData
        ("address", _i4),  # its first constraint row
        ("dim", _i4),  # how many rows it has
        ("margin", _f8),  # gap below which it is a contact, m
        ("pos", _f8, 3),  # between both bodies, in world axes, m
        ("frame", _f8, (3, 3)),  # normal and two tangents, in world axes
        ("axes", _f8, (2, 3, 3)),  # the same in axes of both geoms: geom, its axis, axis of frame
        ("carried", _f8, (3, 2)),  # friction remembered along the frame: axis, force or moment
        ("mu", _f8, 5),  # coefficients of friction: two of sliding, of spin, two of rolling, m
        ("cone", _f8),  # MuJoCo's regular coefficient, of the cone in scaled forces
        ("moved", _f8),  # square of how far it has moved on its bodies, m2
        # in Newton's method: whether it counts as closed, whether its island is to be solved, and
        # whether that was solved in this step
        *((name, _i4) for name in ("closed", "due", "solved")),
        ("piece", _i4),  # which of its geoms is at rest, if the other one isn't; else -1
        ("next", _i4),  # the next one of the other geom with what is at rest; -1: it is the last
        ("steeper", _i4),  # whether it is steeper than all cells around of a heightfield
        ("share", _f8),  # part of friction without a limit that it has
    ],
    align=True,
)
"""A contact; friction turns with its bodies, most with the one that turns less."""

_names: Any = CONTACT.names
REMEMBERED = _names[: _names.index("index")]
"""What the state of a simulation has of it."""
REMEMBERED_CONTACT = np.dtype([(name, CONTACT[name]) for name in REMEMBERED])

EQUALITY, DRY, ONE_SIDED, CONTACT_ROW, IDLE = range(5)
"""Kind of a row: both ways; dry friction; limits and MuJoCo's own normals; a contact under the law;
friction of MuJoCo's own contacts, which a solution leaves out."""

ROW = np.dtype(
    [
        ("kind", _i4),
        ("first", _i4),  # where its Jacobian begins, and how long that is without zeros
        ("length", _i4),
        # if it is the first of a unit of Newton's method: how many rows that has, else 0; its
        # contact, or -1; the next unit of its island
        *((name, _i4) for name in ("dim", "contact", "next")),
        ("surface", _f8),  # velocity that surfaces have on their bodies, m s-1
        ("velocity", _f8),  # as MuJoCo has it, m s-1
        ("estimate", _f8),  # of the inverse mass that it moves, MuJoCo's, kg-1
        # what mjData had before, and what it was told
        *((name, _f8) for name in ("given_R", "given_reference", "told")),
        ("R", _f8),  # regularisation: acceleration per force, kg-1
        ("reference", _f8),  # acceleration it asks for without memory and shift, m s-2
        ("remembered", _f8),  # force of the step before, or of the last solution of this one, N
        ("held", _f8),  # the part of it that it keeps without giving way, N
        ("residual", _f8),  # by `find_residuals`, m s-2
        ("force", _f8),  # as found, N
        # minus its derivatives by the residuals of the rows of its unit, kg, in Newton's method
        ("stiffness", _f8, MOST_ROWS),
        ("limit", _f8),  # the most that a dry joint bears, N or N m
    ],
    align=True,
)
"""A constraint row, of the same number as in mjData."""
_ROW_SIZE = ROW.itemsize

DOF = np.dtype(
    [
        ("label", _i4),  # the first one of its island
        ("next", _i4),  # the next one of its island; -1: it is the last
        ("unit", _i4),  # of the first one: the first unit of the island
        ("due", _i4),  # of the first one: whether the island is to be solved
        ("tree", _i4),  # the first one of its kinematic tree
        ("level", _i4),  # of that one: how many units it is from where numbers of the island begin
        ("place", _i4),  # its number in its island
        ("dof", _i4),  # which one has this number in the island that is solved
        ("envelope", _i4),  # where the row of this number begins in the derivative
        ("reach", _i4),  # where it ends in U
    ]
)
"""A degree of freedom, in Newton's method."""

PAIR = np.dtype([("geoms", _i8), ("contact", _i8)])
"""A contact by its pair of geoms, one number for both."""

FREE_BODY = np.dtype(
    [
        ("body", _i8),
        ("dof", _i8),
        # angular momentum that other moments than gyroscopic ones gave it in the last step, in
        # world axes, and the one it would have without them now, in its own, N m s
        ("pushed", _f8, 3),
        ("coasting", _f8, 3),
    ],
    align=True,
)
"""A body that nothing joins to others."""

MEMORY = np.dtype(
    [
        ("law", LAW),
        *((name, _i8) for name in ("address", "model", "data")),  # of this, mjModel and mjData
        ("nv", _i8),
        *((name, _f8) for name in ("time", "timestep", "called")),  # of the last step, call; s
        ("known", _i8),  # whether as that step began the one before it was known
        ("bounces", _i8),  # how many geoms have a restitution: all or none
        ("least", _f8),  # distance by which contacts move at least where points are put back, m
        # counts: contacts now and before; rows; those of dry friction, now and before; bodies
        *((name, _i8) for name in ("contacts", "contacts_before", "rows", "dry", "dry_before")),
        ("first_dry", _i8),
        ("free_bodies", _i8),
        ("ncon", _i8),  # contacts of mjData when they were found; -1 after a state was restored
        ("pending", _i8),  # whether forces are still to be found
        ("stored", _i8),  # whether contacts have their forces in the axes of bodies
        ("solves", _i8),  # steps that were solved
        ("unsolved", _i8),  # those of them that didn't come to `share`
        ("active", _i8),  # whether the law applies
        ("gravity", _f8),  # its size, m s-2
        ("enough", _f8),  # `share` of it: to which a step must know how contacts slip, m s-2
        ("told", _i8),  # whether mjData was told its rows
        ("braked", _i8),  # the last number of M that it has changed, -1: none; what that is now
        ("braked_is", _f8),
        *((f"room_{name}", _i8) for name in ("contacts", "rows", "jacobian")),
        *((f"{name}_at", _i8) for name in ("contact", "before", "row", "jacobian", "column")),
        *((f"{name}_at", _i8) for name in ("dry", "pose", "pair", "xpos", "xmat", "body")),
        *((f"{name}_at", _i8) for name in ("point", "patch", "restitution", "dof")),
        ("first_at", _i8),  # of each geom, the first of those contacts with what is at rest
        # the island that is solved: how many degrees of freedom and units it has; by their numbers
        # in it, accelerations, first ones, those tried, a step to these, what is left of the
        # equations
        ("size", _i8),
        ("units", _i8),
        *((f"{name}_at", _i8) for name in ("unit", "island", "begin", "tried")),
        *((f"{name}_at", _i8) for name in ("step", "residual")),
        ("local_at", _i8),  # a number for each row of a unit
        *((f"{name}_at", _i8) for name in ("matrix", "place")),
        ("inertia_at", _i8),  # M without what brakes, nC
    ],
    align=True,
)
"""All that a simulation remembers; arrays by their addresses."""

memories, contacts_at, rows_at = array_at(MEMORY), array_at(CONTACT), array_at(ROW)
pairs_at, bodies_at, dofs_at = array_at(PAIR), array_at(FREE_BODY), array_at(DOF)


@view
def contacts_of(memory: Any) -> Any:
    """The contacts of this step."""
    return contacts_at(memory.contact_at, memory.contacts)


@view
def rows_of(memory: Any) -> Any:
    """All constraint rows."""
    return rows_at(memory.row_at, memory.rows)


@view
def some_rows(memory: Any, first: int, count: int) -> Any:
    """So many rows, one after the other."""
    return rows_at(memory.row_at + _ROW_SIZE * first, count)


@view
def rows_of_contact(memory: Any, contact: Any) -> Any:
    """The rows of a contact: of its normal force, then of its friction."""
    return some_rows(memory, contact.address, contact.dim)


@view
def rows_of_unit(memory: Any, first: int) -> Any:
    """The rows of a unit that begins with this one."""
    return some_rows(memory, first, rows_of(memory)[first].dim)


@view
def dry_rows_of(memory: Any) -> Any:
    """The rows of dry friction."""
    return some_rows(memory, memory.first_dry, memory.dry)


@view
def dofs_of(memory: Any) -> Any:
    """All degrees of freedom, of a rigid simulation."""
    return dofs_at(memory.dof_at, memory.nv)


@view
def columns_of(memory: Any, row: Any) -> Any:
    """The degrees of freedom that a row moves."""
    return integers(memory.column_at + 4 * row.first, row.length)


@view
def places_of(memory: Any, row: Any) -> Any:
    """The numbers that these have in their island; all rows of a unit have the same."""
    return integers(memory.place_at + 4 * row.first, row.length)


@view
def units_of(memory: Any) -> Any:
    """The units of the island that is solved, by their first rows."""
    return integers(memory.unit_at, memory.units)


@view
def jacobian_of(memory: Any, row: Any) -> Any:
    """The Jacobian of a row, of those degrees of freedom."""
    return reals(memory.jacobian_at + 8 * row.first, row.length)


@view
def jacobians_of(memory: Any, unit: Any) -> Any:
    """The Jacobians of all rows of a unit, of the same degrees of freedom."""
    return reals(memory.jacobian_at + 8 * unit.first, (unit.dim, unit.length))


@view
def dry_of(memory: Any, count: int) -> Any:
    """Forces of dry friction that are remembered, N or N m."""
    return reals(memory.dry_at, count)


# -- the arrays, which Python owns -----------------------------------------------------------------


_SIZES = ("nq", "nv", "nu", "na", "nbody", "njnt", "ngeom", "ntendon", "neq", "nsensordata")
_NAMES = ", ".join(_SIZES)


def sizes(model: Any) -> npt.NDArray[np.int64]:
    """By what a model is known: its signature is gone once it was pickled; MuJoCo 3.3 has none."""
    return np.array([getattr(model, name) for name in _SIZES], np.int64)


def free_bodies(model: Any) -> npt.NDArray[np.void]:
    """Bodies that nothing joins to others, as items of `FREE_BODY`."""
    last = model.jnt_dofadr[model.jnt_type == 0] + 5
    last = last[~np.isin(last, model.dof_parentid)]
    bodies = np.zeros(len(last), FREE_BODY)
    bodies["body"], bodies["dof"] = model.dof_bodyid[last], last - 5
    return bodies


class Simulation:
    """The memory of one simulation, and its arrays."""

    def __init__(self, model: Any, law: Law) -> None:
        self.record: Any = np.zeros(1, MEMORY)
        self.address = int(self.record.ctypes.data)
        self._arrays: dict[int, npt.NDArray[Any]] = {}  # by their addresses
        record, radius = self.record, model.geom_rbound
        record["braked"] = -1
        record["law"], record["address"] = law.record(), self.address
        record["model"] = model._address
        self._sizes = sizes(model)
        record["least"] = law.near * radius.min(where=radius > 0, initial=1e9)
        self.bodies = self._own("body", free_bodies(model) if law.rigid else np.zeros(0, FREE_BODY))
        record["free_bodies"] = len(self.bodies)
        self._own("point", np.zeros(MJ_CONTACT.itemsize // 8, np.int64))
        self._own("patch", np.zeros(MOST_POINTS * POINT // 8))
        self._own("first", np.zeros(model.ngeom, np.int32))
        record["bounces"] = len(law.restitution)
        self._own("restitution", np.array(law.restitution, np.float64))
        record["nv"] = nv = model.nv if law.rigid else 0
        self._own("dof", np.zeros(nv, DOF))
        for name in ("island", "begin", "tried", "step", "residual"):
            self._own(name, np.zeros(nv))
        self._own("local", np.zeros(MOST_ROWS))
        self._own("matrix", np.zeros((nv, nv)))
        self._own("inertia", np.zeros(model.nC))
        self._own("xpos", np.zeros((model.nbody, 3)))
        self._own("xmat", np.zeros((model.nbody, 9)))
        self.make_room(16, 64, 64 * min(model.nv, 16))
        self.active = record["active"]
        self.data: Callable[[], Any] = lambda: None
        self.reset()
        _SIMULATIONS[self.address] = self

    def _own(self, name: str, array: npt.NDArray[Any]) -> npt.NDArray[Any]:
        """Keep an array, and tell its address."""
        address = array.ctypes.data
        self._arrays.pop(int(self.record[f"{name}_at"][0]), None)
        self._arrays[address], self.record[f"{name}_at"] = array, address
        return array

    def make_room(self, contacts: int, rows: int, jacobian: int) -> None:
        """Make the arrays at least so long; what they hold stays."""
        wanted = {"contacts": contacts, "rows": rows, "jacobian": jacobian}
        kinds: dict[str, dict[str, Any]] = {
            "contacts": {"contact": CONTACT, "before": CONTACT, "pose": MJ_CONTACT, "pair": PAIR},
            "rows": {"row": ROW, "dry": np.float64, "unit": np.int32},
            "jacobian": {"jacobian": np.float64, "column": np.int32, "place": np.int32},
        }
        for room, count in wanted.items():
            if self.record[f"room_{room}"][0] >= count:
                continue
            count += count // 2
            self.record[f"room_{room}"] = count
            for name, kind in kinds[room].items():
                longer, old = np.zeros(count, kind), self._array(name)
                longer[: len(old)] = old
                self._own(name, longer)

    def _array(self, name: str) -> npt.NDArray[Any]:
        """The array whose address the record has: steps exchange contacts and those before."""
        return self._arrays.get(int(self.record[f"{name}_at"][0]), np.zeros(0))

    def reset(self) -> None:
        """Forget all, as at the start."""
        self.record["time"], self.record["pending"], self.record["stored"] = math.nan, 0, 0

    @property
    def knows(self) -> bool:
        """Whether there is anything to remember."""
        return not math.isnan(self.record["time"][0])

    @property
    def unsettled(self) -> bool:
        """Whether forces of the last step are still to be found or stored."""
        return bool(self.record["pending"][0] or not self.record["stored"][0])

    def state(self) -> dict[str, npt.NDArray[Any]]:
        """Copies of all that is remembered; forces are stored in the axes of bodies."""
        record = self.record[0]
        contacts = self._array("contact")[: record["contacts"] if self.knows else 0]
        dry = self._array("dry")[: record["dry"] if self.knows else 0]
        spins = np.hstack((self.bodies["pushed"], self.bodies["coasting"]))
        return {
            "contacts": contacts[list(REMEMBERED)].astype(REMEMBERED_CONTACT),
            "joints": dry.copy(),
            "spins": spins if self.knows else np.zeros_like(spins),
            "time": np.array([record["time"], record["timestep"]]),
            "sizes": self._sizes,
        }

    def restore(self, state: Mapping[str, npt.NDArray[Any]]) -> None:
        """Go on from what `state` returned."""
        contacts, joints = state["contacts"], state["joints"]
        self.make_room(len(contacts), len(joints), 0)
        for name in REMEMBERED:
            self._array("contact")[name][: len(contacts)] = contacts[name]
        self._array("dry")[: len(joints)] = joints
        self.bodies["pushed"], self.bodies["coasting"] = np.hsplit(state["spins"], 2)
        record = self.record
        record["contacts"], record["dry"] = len(contacts), len(joints)
        record["time"], record["timestep"] = state["time"]
        record["called"], record["known"] = state["time"][0], 1
        record["pending"], record["stored"], record["ncon"] = 0, 1, -1


def check_state(
    state: Mapping[str, npt.NDArray[Any]], fresh: Mapping[str, npt.NDArray[Any]], model: Any
) -> None:
    """Raise `ValueError` unless it is a state of a simulation of this model, like a fresh one."""
    for name, like in fresh.items():
        try:
            values: Any = np.asarray(state[name])
        except (KeyError, TypeError, IndexError, ValueError) as error:
            raise ValueError(f"not a state of Coulomb: it has no array {name}") from error
        if values.dtype != like.dtype:
            given = values.dtype if values.dtype.names is None else "a structure"
            raise ValueError(f"not a state of Coulomb: {name} of type {given}")
        of_any_length = name in ("contacts", "joints") and values.ndim == 1
        if values.shape != like.shape and not of_any_length:
            raise ValueError(f"not a state of Coulomb: {name} of shape {values.shape}")
        fields = values.dtype.names or ()
        for each in [values[field] for field in fields if field != "velocity"] or [values]:
            if name != "time" and not np.isfinite(each).all():
                raise ValueError(f"not a state of Coulomb: {name} must be finite")
    if np.isnan(state["contacts"]["velocity"]).any():  # infinite ones aren't known
        raise ValueError("not a state of Coulomb: velocity in contacts must be a number")
    if not np.array_equal(state["sizes"], sizes(model)):
        raise ValueError(
            f"not a state of this model, whose {_NAMES} are {sizes(model).tolist()}, "
            f"but of one with {np.asarray(state['sizes']).tolist()}"
        )
    geoms = state["contacts"]["geoms"]
    if geoms.size and not 0 <= geoms.min() <= geoms.max() < model.ngeom:
        raise ValueError(
            f"not a state of this model: contacts of geoms {geoms.min()} to {geoms.max()}, "
            f"and there are 0 to {model.ngeom - 1}"
        )


_SIMULATIONS: weakref.WeakValueDictionary[int, Simulation] = weakref.WeakValueDictionary()
"""By the addresses of their records."""


@ctypes.CFUNCTYPE(None, *[ctypes.c_int64] * 4)  # type: ignore[untyped-decorator]
def _make_room(memory: int, contacts: int, rows: int, jacobian: int) -> None:
    _SIMULATIONS[memory].make_room(contacts, rows, jacobian)


make_room = c_function(
    f"{__package__}.make_room",
    ctypes.cast(_make_room, ctypes.c_void_p).value or 0,
    types.void,
    *[types.int64] * 4,
)
