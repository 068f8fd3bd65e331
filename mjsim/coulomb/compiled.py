"""The law as loops over contacts, compiled with numba, which the extra `fast` installs, or as they
stand.

A step of a small scene takes 10 µs, and handing over its arrays would cost as much. So the loops
read and write `mjData` where the engine keeps it: `mujoco.introspect` tells the offsets, and the
engine's functions are called by their addresses. What a simulation remembers lies in blocks of
memory, whose addresses and sizes are its `head`."""

from __future__ import annotations

import contextlib
import ctypes
import dataclasses
import functools
import math
import weakref
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import numpy.typing as npt
from mujoco.introspect import ast_nodes, structs

from . import law
from .law import Array

try:
    import llvmlite.binding
    import numba
    from llvmlite import ir
    from numba import types
    from numba.core import cgutils
    from numba.experimental.function_type import _get_wrapper_address
    from numba.extending import intrinsic
except ImportError:
    numba = None
COMPILES = numba is not None and not numba.config.DISABLE_JIT
"""Whether the loops are compiled."""

# -- where things are in the engine's memory ---------------------------------------------------------------------------


def _layout(struct: str) -> type[ctypes.Structure]:
    """The memory layout of a structure of MuJoCo, as a ctypes structure."""
    scalars = {
        "int": ctypes.c_int,
        "mjtNum": ctypes.c_double,
        "float": ctypes.c_float,
    } | dict.fromkeys(("mjtSize", "size_t", "uintptr_t", "uint64_t"), ctypes.c_uint64)
    scalars |= {
        "mjtBool": ctypes.c_bool,
        "mjtByte": ctypes.c_uint8,
        "unsigned char": ctypes.c_uint8,
    }

    def kind(declared: Any) -> Any:
        if isinstance(declared, ast_nodes.PointerType):
            return ctypes.c_void_p
        if isinstance(declared, ast_nodes.ArrayType):
            return kind(declared.inner_type) * math.prod(declared.extents)
        if isinstance(declared, ast_nodes.ValueType):
            return scalars.get(declared.name) or _layout(declared.name)
        return _fields(declared.fields)

    def _fields(fields: Any) -> type[ctypes.Structure]:
        return type(
            struct,
            (ctypes.Structure,),
            {"_fields_": [(field.name, kind(field.type)) for field in fields]},
        )

    return _fields(structs.STRUCTS[struct].fields)


_DATA = (
    "time", "ncon", "nefc", "ne", "nf", "warning", "geom_xpos", "geom_xmat", "contact", "efc_KBIP", "efc_R", "efc_D",
    "efc_diagA", "efc_vel", "efc_aref", "efc_frictionloss", "efc_J", "efc_J_rownnz", "efc_J_rowadr",
    "efc_J_colind", "qacc", "qacc_warmstart", "nisland", "map_efc2iefc", "iefc_R", "iefc_D", "qvel", "xpos", "xmat",
    "crb", "cvel", "subtree_com", "qfrc_bias",
)  # fmt: skip
(
    TIME, NCON, NEFC, NE, NF, WARNING, XPOS, XMAT, CONTACT, KBIP, R, D, DIAG, VEL, AREF, LOSS, J, ROWNNZ,
    ROWADR, COLIND, QACC, START, NISLAND, ISLAND_PLACE, ISLAND_R, ISLAND_D, QVEL, ORIGIN, AXES_OF,
    INERTIA, SPIN, CENTRE, BIAS,
) = range(len(_DATA))  # fmt: skip
_CONTACT = ("dist", "pos", "frame", "friction", "mu", "dim", "geom", "efc_address", "includemargin")
DIST, POS, FRAME, FRICTION, MU, DIM, GEOM, ADDRESS, INCLUDE = range(
    len(_DATA), len(_DATA) + len(_CONTACT)
)
SIZE = len(_DATA) + len(_CONTACT)
_MODEL = ("nv", "ngeom", "geom_rbound", "geom_bodyid")
DOFS, NGEOM, RBOUND, BODY_OF = range(SIZE + 1, SIZE + 1 + len(_MODEL))
_OPTION = ("timestep", "gravity", "cone", "solver")
STEP, GRAVITY, CONE, SOLVER = range(DOFS + len(_MODEL), DOFS + len(_MODEL) + len(_OPTION))

_OLD = {"efc_diagA": "efc_diagApprox"}
"""Names that MuJoCo 3.3 has."""
_LATER = {"map_efc2iefc", "iefc_R", "iefc_D"}
"""What it has not."""


def _offset(layout: Any, name: str) -> int:
    """Offset in bytes of a member of a structure; -1 for one that this MuJoCo may lack."""
    member = getattr(layout, name, None) or getattr(layout, _OLD.get(name, name), None)
    if member is None and name not in _LATER:
        raise ImportError(
            f"Coulomb's law doesn't know MuJoCo {mujoco.__version__}, which has no {name}"
        )
    return int(member.offset) if member else -1


_data, _contact, _model, _option = (
    _layout(struct) for struct in ("mjData", "mjContact", "mjModel", "mjOption")
)
_offsets: npt.NDArray[np.int64] = np.array(
    [_offset(_data, name) for name in _DATA]
    + [_offset(_contact, name) for name in _CONTACT]
    + [ctypes.sizeof(_contact)]
    + [_offset(_model, name) for name in _MODEL]
    + [_offset(_model, "opt") + _offset(_option, name) for name in _OPTION],
    np.int64,
)
_offsets[WARNING] += int(mujoco.mjtWarning.mjWARN_BADQPOS) * ctypes.sizeof(_layout("mjWarningStat"))


def _lies_as_said() -> bool:
    """Whether a model and its data lie in memory as `mujoco.introspect` says: tried on a small
    one."""
    model = mujoco.MjModel.from_xml_string(
        '<mujoco><option timestep="0.0078125" gravity="0 0 -7"/><worldbody><geom type="plane" '
        'size="1 1 1"/>'
        '<body pos="0 0 .09"><freejoint/><geom size=".1" condim="4" friction=".7 .03 '
        '.01"/></body></worldbody></mujoco>'
    )
    data = mujoco.MjData(model)
    data.time = 3.0
    mujoco.mj_forward(model, data)
    seen, known, contact = (
        _data.from_address(data._address),
        _model.from_address(model._address),
        data.contact,
    )
    if not seen.contact:
        return False
    point = _contact.from_address(seen.contact)
    return bool(
        (seen.time, seen.ncon, seen.nefc, known.nv, known.ngeom) == (3.0, 1, data.nefc, 6, 2)
        and (known.opt.timestep, known.opt.gravity[2], known.opt.cone)
        == (0.0078125, -7.0, model.opt.cone)
        and (point.dist, point.dim, point.efc_address, point.friction[2])
        == (contact.dist[0], 4, 0, contact.friction[0, 2])
        and (point.geom[0], point.geom[1], point.mu) == (0, 1, contact.mu[0])
        and np.array_equal(
            np.ctypeslib.as_array((ctypes.c_double * data.nefc).from_address(seen.efc_aref)),
            data.efc_aref,
        )
        and np.array_equal(
            np.ctypeslib.as_array((ctypes.c_double * 6).from_address(seen.qacc)), data.qacc
        )
    )


if not _lies_as_said():
    raise ImportError(
        f"MuJoCo {mujoco.__version__} doesn't lie in memory as its own mujoco.introspect says"
    )

_library = next(
    path
    for path in sorted(Path(mujoco.__file__).parent.iterdir())
    if path.name.startswith(("libmujoco.so", "libmujoco.")) or path.name == "mujoco.dll"
)
_engine = ctypes.CDLL(str(_library))
_simulations = np.zeros(3 * 4096, np.int64)
"""Simulations under `installed`: how many, the address of `adopt`, 0; then model, data and head of
each, by address."""
SIMULATIONS = len(_simulations) // 3 - 1


def _library_function(
    name: str, source: Any = _engine, arguments: int = 2, returns: Any = None
) -> Any:
    """A function of the engine's library, or another, for compiled code to call, or for Python if
    none is compiled."""
    function = getattr(source, name)
    if COMPILES:
        llvmlite.binding.add_symbol(f"coulomb_{name}", ctypes.cast(function, ctypes.c_void_p).value)
        return _called_by_address(
            name, arguments, {None: types.void, ctypes.c_int: types.int32}.get(returns, types.intp)
        )
    function.argtypes, function.restype = [ctypes.c_void_p] * arguments, returns
    return function


def _called_by_address(name: str, arguments: int, returns: Any) -> Any:
    """Declare to numba a function whose address the linker knows by name, so that compiled code can
    call it."""
    return types.ExternalFunction(f"coulomb_{name}", returns(*[types.intp] * arguments))


mj_step, mj_step1, mj_step2 = (
    _library_function("mj_step"),
    _library_function("mj_step1"),
    _library_function("mj_step2"),
)
mj_fwdActuation, mj_fwdAcceleration = (
    _library_function("mj_fwdActuation"),
    _library_function("mj_fwdAcceleration"),
)
mj_fwdConstraint, mj_fwdVelocity = (
    _library_function("mj_fwdConstraint"),
    _library_function("mj_fwdVelocity"),
)
mj_makeConstraint, mj_island = (
    _library_function("mj_makeConstraint"),
    _library_function("mj_island"),
)
mj_projectConstraint = _library_function("mj_projectConstraint")
mj_isSparse = _library_function("mj_isSparse", arguments=1, returns=ctypes.c_int)
mj_addContact = _library_function("mj_addContact", arguments=3, returns=ctypes.c_int)
realloc = _library_function("PyMem_RawRealloc", ctypes.pythonapi, returns=ctypes.c_void_p)


def _address_of_array(name: str, values: npt.NDArray[np.int64]) -> Any:
    """A function that returns an array's address in this process, also in code that another process
    has compiled."""
    where = values.ctypes.data
    if not COMPILES:
        return lambda: where
    llvmlite.binding.add_symbol(f"coulomb_{name}", where)

    @intrinsic  # type: ignore[untyped-decorator]
    def address(typing: Any) -> Any:
        def code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            known, symbol = builder.module.globals, f"coulomb_{name}"
            found = known.get(symbol) or cgutils.add_global_variable(
                builder.module, ir.IntType(64), symbol
            )
            return builder.ptrtoint(found, ir.IntType(64))

        return types.intp(), code

    return address


_offsets_address, _simulations_address = (
    _address_of_array("offsets", _offsets),
    _address_of_array("simulations", _simulations),
)


def _pointer(kind: Any) -> Any:
    """A function that turns an address into a pointer to numbers of a C type."""
    if not COMPILES:
        pointer_to = ctypes.POINTER(kind)
        return lambda address: pointer_to.from_buffer(ctypes.c_void_p(address))
    item = {
        ctypes.c_int32: types.int32,
        ctypes.c_int64: types.int64,
        ctypes.c_double: types.float64,
    }[kind]

    @intrinsic  # type: ignore[untyped-decorator]
    def pointer(typing: Any, address: Any) -> Any:
        def code(context: Any, builder: Any, call: Any, args: Any) -> Any:
            return builder.inttoptr(args[0], context.get_value_type(call.return_type))

        return types.CPointer(item)(types.intp), code

    return pointer


_int32, _int64, _real = (
    _pointer(kind) for kind in (ctypes.c_int32, ctypes.c_int64, ctypes.c_double)
)


def compiled(function: Any) -> Any:
    """A decorator: compile a function by numba, once whatever constants it is called with.

    One whose name begins with an underscore can be called by compiled functions only.
    """
    if not COMPILES:
        return function
    options: dict[str, Any] = {
        "nogil": True,
        "error_model": "numpy",
        "fastmath": {"reassoc", "contract"},
    }
    options["_nrt"] = False  # there are no arrays whose references would be counted
    if function.__name__.startswith("_"):
        options |= {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}
    try:
        dispatcher = numba.njit(cache=True, **options)(function)
    except RuntimeError:  # no place for a cache
        dispatcher = numba.njit(**options)(function)
    template = dispatcher.get_call_template
    dispatcher.get_call_template = lambda given, named: template(
        tuple(map(types.unliteral, given)), named
    )
    return dispatcher


@contextlib.contextmanager
def alone(function: Any) -> Iterator[None]:
    """Within this no other process compiles a function: those that wait then take what this one
    keeps on disk."""
    with contextlib.ExitStack() as stack:
        with contextlib.suppress(
            ImportError, OSError, TypeError
        ):  # no such locks here, or no place for a cache
            import fcntl

            file = stack.enter_context((Path(function.stats.cache_path) / "compiling").open("w"))
            fcntl.flock(file, fcntl.LOCK_EX)
        yield


@compiled
def _at(name: int) -> int:
    """Offset in bytes of a member of one of MuJoCo's structures, by its number here."""
    return int(_int64(_offsets_address())[name])


@compiled
def _reals(struct: int, name: int) -> Any:
    """Pointer to an array of reals of the `mjData` or `mjModel` at address `struct`."""
    return _real(_int64(struct + _at(name))[0])


@compiled
def _integers(struct: int, name: int) -> Any:
    """Pointer to an array of integers of the `mjData` or `mjModel` at address `struct`."""
    return _int32(_int64(struct + _at(name))[0])


@compiled
def _integer(struct: int, name: int) -> int:
    """Read an integer field of the `mjData` or `mjModel` at address `struct`."""
    return int(_int32(struct + _at(name))[0])


@compiled
def _scalar(struct: int, name: int) -> float:
    """Read a real field of the `mjData` or `mjModel` at address `struct`."""
    return float(_real(struct + _at(name))[0])


# -- what a simulation remembers ---------------------------------------------------------------------------------------

(
    KEPT,
    BEFORE,
    AXES,
    PLACES,
    ROWS,
    JACOBIAN,
    COLUMN,
    DRY,
    POSES,
    NOW,
    SCRATCH,
    CHAINS,
    FREE,
    SPINS,
) = range(0, 28, 2)
"""Blocks of memory in a `head`, address and size of each: contacts now and before (`law.WIDTH`
numbers each); their axes in those of both bodies, friction and regular friction (24); their places
(4); rows (`ROW`); Jacobians and their columns; what dry friction bore; poses at which these were
taken, and those now (`_store_poses`); a contact; contacts by their geoms (`_chain_contacts`);
bodies that nothing joins to others (`law.free_bodies`), and of each how much angular momentum other
moments than gyroscopic ones gave it in the last step, in world axes, and the one that it would have
without them now, in its own, N m s."""
(
    COUNT, COUNT_BEFORE, COUNT_ROWS, COUNT_DRY, DRY_BEFORE, COUNT_FOUND, COUNT_ALL, COUNT_FREE, TURNED, PENDING, RESETS,
    SOLVES,
) = range(28, 40)  # fmt: skip
"""Counts: contacts now and before, rows, dry rows now and before, contacts and rows of the engine,
free bodies; whether contacts have their forces in the axes of bodies; whether forces are still to
be found; resets by the engine; solutions. """
MOMENT, LASTED, LEAST, CALLED = range(40, 44)
"""Time and time step of the step under way, s; distance by which contacts must move for points to
be put back, m; time of the last call, s."""
RIGID, RESTITUTION, SERVO, SHARE, MOST, SOFTNESS, PUSH, DEPTH, CALM, NEAR, FIXED, FAST = range(
    44, 56
)
"""The numbers of a `law.Law`, in its order."""
HEAD, POSE = 56, 16
INDEX, FIRST, LENGTH, AT = range(4)
"""Of a contact: its number in `mjData`, its first row there, how many it has, the first of them in
`ROWS`."""
SOFT, REFERENCE, MEMORY, HELD, RESIDUAL, FOUND, BEGIN, NONZEROS, ADDRESS_OF, LIMIT, ROW = range(11)
"""Of a row: R, its reference acceleration without memory and slip, the force remembered, J qacc
less the reference, the force found; where its Jacobian begins and how long it is; what dry friction
bears at most; its number in `mjData`."""
W = law.WIDTH


@compiled
def _grown(head: int, block: int, numbers: int) -> Any:
    """A block of the simulation's memory, grown to so many reals if it is smaller."""
    blocks = _int64(head)
    if blocks[block + 1] < numbers:
        blocks[block + 1] = numbers + numbers // 2 + 64
        blocks[block] = realloc(blocks[block], 8 * blocks[block + 1])
    return _real(blocks[block])


@compiled
def grow(head: int, block: int, numbers: int) -> None:
    """Grow a block of the simulation's memory to so many reals if it is smaller."""
    _grown(head, block, numbers)


@compiled
def _grown_integers(head: int, block: int, numbers: int) -> Any:
    """A block of the simulation's memory as integers, grown to so many if it is smaller."""
    _grown(head, block, numbers)
    return _int64(_int64(head)[block])


@compiled
def _block(head: int, block: int) -> Any:
    """A block of the simulation's memory as reals."""
    return _real(_int64(head)[block])


@compiled
def _elliptic(m: int) -> bool:
    """Whether the model's friction cone is elliptic."""
    return bool(_integer(m, CONE) == 1)


@compiled
def _gravity(m: int) -> float:
    """The size of the model's gravity, m s-2; the earth's if it has none."""
    g = _real(m + _at(GRAVITY))
    size = math.sqrt(g[0] ** 2 + g[1] ** 2 + g[2] ** 2)
    return size if size > 0 else 9.81


# -- the law -----------------------------------------------------------------------------------------------------------


@compiled
def control(m: int, d: int, head: int) -> None:
    """Apply Coulomb's law in the middle of a step: velocities are known, and the engine hasn't
    found the forces yet."""
    counts, numbers = _int64(head), _real(head)
    time, warnings = _scalar(d, TIME), _int32(d + _at(WARNING))
    resets = int(warnings[1] + warnings[3] + warnings[5])  # by the engine, since the state was bad
    elapsed, since = time - numbers[MOMENT], time - numbers[CALLED]
    known = 0 <= elapsed <= 1.5 * numbers[LASTED] and counts[RESETS] in (resets, -1)
    over = (
        elapsed > 0.75 * numbers[LASTED]
    )  # not in the stages of a Runge-Kutta step, nor in a second call
    source = FOUND if over else MEMORY
    if known and over:
        retain(m, d, head)
    if over or not known:
        numbers[MOMENT], numbers[LASTED], counts[RESETS] = time, _scalar(m, STEP), resets
    numbers[CALLED] = time
    start, last = _reals(d, START), _reals(d, QACC)
    for i in range(_integer(m, DOFS)):
        last[i] = (
            start[i] if counts[COUNT_FOUND] < 0 else last[i]
        )  # of restored states MuJoCo keeps but that
        start[i] = start[i] if abs(start[i]) >= numbers[CALM] else 0.0
    if known and over:
        _turn_accelerations(m, d, head)
    still = known and _nothing_moved(m, d, head)
    if still:
        rows = _block(head, ROWS)
        for r in range(0, ROW * (counts[COUNT_ROWS] + counts[COUNT_DRY]), ROW):
            rows[r + MEMORY] = rows[r + source]
    else:
        _remember_last_step(m, d, head, source, known)
        _find_contacts(m, d, head)
        if _match_contacts(m, d, head) > numbers[LEAST] and _put_points_back(m, d, head):
            _find_contacts(m, d, head)
            _match_contacts(m, d, head)
        _copy_jacobians(m, d, head)
    if counts[COUNT_FREE]:
        _add_gyroscopic_forces(m, d, head, known, over)
    if counts[COUNT] + counts[COUNT_DRY] == 0:
        counts[PENDING] = 0
        return
    _multiply_rows(m, head, _reals(d, QACC))
    if numbers[RIGID]:
        _stiffen(m, d, head)
    elif numbers[SERVO]:
        _take_depth_away(m, d, head)
    if since > 0 and known and not still:
        _add_turning(m, d, head, since)
    _set_rows(m, d, head)
    enough = numbers[SHARE] * _gravity(m)
    if _foresee_slip(m, d, head, enough) or not known:
        _solve(m, d, head, enough)
    elif numbers[RIGID]:
        _oppose_slip_at_mid_step(m, d, head)
    _write_references(m, d, head)
    counts[PENDING] = 1


@compiled
def _solve(m: int, d: int, head: int, enough: float) -> None:
    """Let the engine solve for the accelerations until contacts slip as was foreseen, to `enough`,
    m s-2."""
    counts, numbers = _int64(head), _real(head)
    kept, start, last = _block(head, KEPT), _reals(d, START), math.inf
    mj_fwdActuation(m, d)
    mj_fwdAcceleration(m, d)
    rows, rigid = _block(head, ROWS), numbers[RIGID] > 0
    slides = rigid
    for _ in range(int(numbers[MOST])):
        for i in range(counts[COUNT]):  # what a blow does says nothing of the next step
            kept[W * i + law.GUESS] = -1.0
        _write_references(m, d, head)
        mj_fwdConstraint(m, d)
        counts[SOLVES] += 1
        qacc = _reals(d, QACC)
        for i in range(_integer(m, DOFS)):
            start[i] = qacc[i]
        worst = _find_forces(m, d, head)
        for i in range(counts[COUNT]):  # what was found is foreseen next
            kept[W * i + law.SLIP] = kept[W * i + law.SEEN]
        for r in range(0, ROW * counts[COUNT_ROWS] if rigid else 0, ROW):
            rows[r + HELD] = rows[r + MEMORY] = rows[r + FOUND]
        if worst <= 1e-6 * enough or (worst <= enough and (not rigid or worst > 0.1 * last)):
            if not slides:
                break
            _multiply_rows(m, head, qacc)
            _subtract_references(head)
            if not _oppose_slip_at_mid_step(m, d, head):
                break
            slides, worst = False, math.inf
        last = worst


@compiled
def _store_poses(m: int, d: int, head: int, block: int) -> int:
    """Store where geoms and contacts are, on which axes and Jacobians depend; return how many
    numbers that is."""
    ngeom, ncon, contact, size = (
        _integer(m, NGEOM),
        _integer(d, NCON),
        _int64(d + _at(CONTACT))[0],
        _at(SIZE),
    )
    xpos, xmat, poses = (
        _reals(d, XPOS),
        _reals(d, XMAT),
        _grown(head, block, 12 * ngeom + POSE * ncon),
    )
    for i in range(3 * ngeom):
        poses[i] = xpos[i]
    for i in range(9 * ngeom):
        poses[3 * ngeom + i] = xmat[i]
    at = _at(POS), _at(FRAME), _at(FRICTION), _at(GEOM), _at(DIM), _at(ADDRESS)
    for i in range(ncon):
        c, first = contact + i * size, 12 * ngeom + POSE * i
        pos, frame, friction, geom = (
            _real(c + at[0]),
            _real(c + at[1]),
            _real(c + at[2]),
            _int32(c + at[3]),
        )
        for j in range(3):  # points of flush faces shift by µm
            poses[first + j], poses[first + 9 + j] = 1e-3 * pos[j], friction[j]
        for j in range(6):
            poses[first + 3 + j] = frame[j]
        poses[first + 12], poses[first + 13] = geom[0], geom[1]
        poses[first + 14], poses[first + 15] = _int32(c + at[4])[0], _int32(c + at[5])[0]
    return int(12 * ngeom + POSE * ncon)


@compiled
def _nothing_moved(m: int, d: int, head: int) -> bool:
    """Whether geoms and contacts are where they were as their axes and Jacobians were stored."""
    counts, kept, contact = _int64(head), _block(head, KEPT), _int64(d + _at(CONTACT))[0]
    if counts[COUNT_FOUND] != _integer(d, NCON) or counts[COUNT_ALL] != _integer(d, NEFC):
        return False
    if counts[COUNT_DRY] != _integer(d, NF):
        return False
    count = _store_poses(m, d, head, NOW)
    now, then, places = _block(head, NOW), _block(head, POSES), _int64(counts[PLACES])
    for i in range(count):
        if not abs(now[i] - then[i]) < law.STILL:
            return False
    for i in range(counts[COUNT]):
        kept[W * i + law.GAP] = _scalar(contact + places[4 * i + INDEX] * _at(SIZE), DIST)
    return True


@compiled
def _remember_last_step(m: int, d: int, head: int, source: int, known: bool) -> None:
    """Make the contacts of the last step, with the forces that they bore, those that are
    remembered."""
    counts = _int64(head)
    if known and not counts[TURNED]:
        store_forces(m, head, source)
        store_slip(m, d, head)
    counts[TURNED] = 0
    if not known:
        counts[COUNT_BEFORE] = counts[DRY_BEFORE] = 0
        return
    for i in range(2):
        counts[KEPT + i], counts[BEFORE + i] = counts[BEFORE + i], counts[KEPT + i]
    counts[COUNT_BEFORE], counts[DRY_BEFORE] = counts[COUNT], counts[COUNT_DRY]


@compiled
def store_forces(m: int, head: int, source: int) -> None:
    """Store what each contact bears, from the forces of its constraint rows; friction turns with
    both bodies."""
    counts, elliptic = _int64(head), _elliptic(m)
    kept, axes, places, rows = (
        _block(head, KEPT),
        _block(head, AXES),
        _int64(counts[PLACES]),
        _block(head, ROWS),
    )
    for i in range(counts[COUNT]):
        k, a, r, length = W * i, 24 * i, ROW * places[4 * i + AT] + source, places[4 * i + LENGTH]
        load = k + law.LOAD
        for j in range(load, k + W):
            kept[j] = 0.0
        kept[load] = rows[r]
        for t in range(length - 1 if elliptic else length // 2):
            if elliptic:
                force = rows[r + ROW * (t + 1)]
            else:
                plus, minus = rows[r + 2 * ROW * t], rows[r + 2 * ROW * t + ROW]
                kept[load + t], force = plus + minus, axes[a + 18 + t] * (plus - minus)
            other, kind = a + _axis_of(t), 1 if t >= 2 else 0
            for j in range(6):
                kept[k + law.FORCE + 2 * j + kind] += axes[other + 3 * j] * force
    dry = _grown(head, DRY, counts[COUNT_DRY])
    for i in range(counts[COUNT_DRY]):
        dry[i] = rows[ROW * (counts[COUNT_ROWS] + i) + source]


@compiled
def store_slip(m: int, d: int, head: int) -> None:
    """Store the velocity at which each contact slips, by the Jacobian of the last step and the
    speeds now."""
    counts, edges, ngeom, speeds = (
        _int64(head),
        not _elliptic(m),
        _integer(m, NGEOM),
        _reals(d, QVEL),
    )
    kept, axes, poses, places = (
        _block(head, KEPT),
        _block(head, AXES),
        _block(head, POSES),
        _int64(counts[PLACES]),
    )
    for i in range(counts[COUNT]):
        k, r, at = (
            W * i + law.SPEED,
            ROW * places[4 * i + AT],
            12 * ngeom + POSE * places[4 * i + INDEX] + 3,
        )
        for j in range(3):
            kept[k + j] = 0.0
        for t in range(2 if places[4 * i + LENGTH] > 1 else 0):
            speed = _tangential(head, r, t, edges, axes[24 * i + 18 + t], speeds)
            for j in range(3):
                one, two = (j + 1) % 3, (j + 2) % 3
                across = (
                    poses[at + one] * poses[at + 3 + two] - poses[at + two] * poses[at + 3 + one]
                )
                kept[k + j] += speed * (across if t else poses[at + 3 + j])


@compiled
def _tangential(head: int, r: int, t: int, edges: bool, friction: float, vector: Any) -> float:
    """Velocity of a contact along its tangent t, from speeds of all degrees of freedom; its rows
    begin at `r`."""
    rows = _block(head, ROWS)
    if edges:
        edge = r + 2 * ROW * t
        return float(
            (_row_times(head, rows, edge, vector) - _row_times(head, rows, edge + ROW, vector))
            / (2 * friction)
        )
    return float(_row_times(head, rows, r + ROW * (t + 1), vector))


@compiled
def _add_turning(m: int, d: int, head: int, elapsed: float) -> None:
    """Let contacts that stick turn along with their bodies: the rows leave out that Jacobians
    change.

    What is added is -dJ/dt v; for rigid contacts, which lose the velocity that the turning shows,
    half of it."""
    counts, edges, rigid = _int64(head), not _elliptic(m), _real(head)[RIGID] > 0
    kept, axes, places = _block(head, KEPT), _block(head, AXES), _int64(counts[PLACES])
    contact, reference, speeds = _int64(d + _at(CONTACT))[0], _reals(d, AREF), _reals(d, QVEL)
    for i in range(counts[COUNT]):
        k, a, r = W * i, places[4 * i + FIRST], ROW * places[4 * i + AT]
        if kept[k + law.SPEED] > 1e300 or places[4 * i + LENGTH] == 1:
            continue
        if not rigid and kept[k + law.STATE] != law.STICKS:
            continue
        frame = _real(contact + places[4 * i + INDEX] * _at(SIZE) + _at(FRAME))
        for t in range(2):
            friction, before = axes[24 * i + 18 + t], 0.0
            for j in range(3):
                before += frame[3 * t + 3 + j] * kept[k + law.SPEED + j]
            change = (_tangential(head, r, t, edges, friction, speeds) - before) * (
                (0.5 if rigid else 1.0) / elapsed
            )
            if edges:
                reference[a + 2 * t] -= friction * change
                reference[a + 2 * t + 1] += friction * change
            else:
                reference[a + 1 + t] -= change


@compiled
def _find_contacts(m: int, d: int, head: int) -> None:
    """Find the contacts of a step, their places on both bodies, and their constraint rows."""
    counts, elliptic, rigid = _int64(head), _elliptic(m), _real(head)[RIGID] > 0
    xpos, xmat, contact, kbip = (
        _reals(d, XPOS),
        _reals(d, XMAT),
        _int64(d + _at(CONTACT))[0],
        _reals(d, KBIP),
    )
    ncon, count, rows, size = _integer(d, NCON), 0, 0, _at(SIZE)
    kept, axes, places = (
        _grown(head, KEPT, ncon * W),
        _grown(head, AXES, 24 * ncon),
        _grown_integers(head, PLACES, 4 * ncon),
    )
    _store_poses(m, d, head, POSES)
    at = _at(POS), _at(FRAME), _at(FRICTION), _at(GEOM), _at(DIM), _at(ADDRESS), _at(DIST), _at(MU)
    for i in range(ncon):
        c = contact + i * size
        pos, frame, friction = _real(c + at[0]), _real(c + at[1]), _real(c + at[2])
        geom, dim, address = _int32(c + at[3]), _int32(c + at[4])[0], _int32(c + at[5])[0]
        if address < 0 or geom[0] < 0 or geom[1] < 0:
            continue
        if not rigid and (dim == 1 or kbip[4 * (address + 1) + 1] <= 0):
            continue
        k, a, p = W * count, 24 * count, 4 * count
        for j in range(W):
            kept[k + j] = 0.0
        for side in range(2):
            g = geom[side]
            kept[k + law.GEOMS + side] = g
            x, y, z = pos[0] - xpos[3 * g], pos[1] - xpos[3 * g + 1], pos[2] - xpos[3 * g + 2]
            for axis in range(3):
                u, v, w = xmat[9 * g + axis], xmat[9 * g + 3 + axis], xmat[9 * g + 6 + axis]
                kept[k + law.PLACE + 3 * side + axis] = u * x + v * y + w * z
                for other in range(3):
                    axes[a + 9 * side + 3 * axis + other] = (
                        u * frame[3 * other] + v * frame[3 * other + 1] + w * frame[3 * other + 2]
                    )
        for axis in range(3):
            kept[k + law.NORMAL + axis] = axes[a + 3 * axis]
        kept[k + law.GAP], kept[k + law.SPEED] = _real(c + at[6])[0], math.inf
        for j in range(5):
            axes[a + 18 + j] = friction[j]
        axes[a + 23] = _real(c + at[7])[0]
        length = 1 if dim == 1 else dim if elliptic else 2 * (dim - 1)
        places[p + INDEX], places[p + FIRST], places[p + LENGTH], places[p + AT] = (
            i,
            address,
            length,
            rows,
        )
        count += 1
        rows += length
    counts[COUNT], counts[COUNT_ROWS], counts[COUNT_DRY] = count, rows, _integer(d, NF)
    counts[COUNT_FOUND], counts[COUNT_ALL] = ncon, _integer(d, NEFC)
    _grown(head, ROWS, ROW * (rows + counts[COUNT_DRY]))


@compiled
def _square_apart(one: Any, k: int, other: Any, m: int) -> float:
    """Square of how far apart two contacts are on their bodies, m^2; infinite if their geoms are
    others."""
    if one[k] != other[m] or one[k + 1] != other[m + 1]:
        return math.inf
    square = 0.0
    for j in range(law.PLACE, law.PLACE + 6):
        square += (one[k + j] - other[m + j]) ** 2
    return square


@compiled
def _smaller_radius(bound: Any, contacts: Any, k: int) -> float:
    """The smaller radius of the two geoms in contact, m; planes have none."""
    one, other = bound[int(contacts[k])], bound[int(contacts[k + 1])]
    return float(min(one, other) or max(one, other))


@compiled
def _axis_of(t: int) -> int:
    """Number of the axis that belongs to a kind of friction: tangents 1 and 2, spin about 0,
    rolling about 1 and 2."""
    return t + 1 if t < 2 else t - 2


@compiled
def _chain_contacts(head: int) -> int:
    """List the contacts of each pair of geoms, so that they are found at once; return the number of
    lists.

    `CHAINS` has the first at `_chain_start`, and the next of each that far on; -1: no more. Others
    may be between."""
    counts, kept, links = _int64(head), _block(head, KEPT), 16
    while links < 2 * counts[COUNT]:
        links *= 2
    chains = _grown_integers(head, CHAINS, links + counts[COUNT])
    for i in range(links):
        chains[i] = -1
    for i in range(counts[COUNT] - 1, -1, -1):
        link = _chain_start(kept, W * i, links)
        chains[links + i], chains[link] = chains[link], i
    return links


@compiled
def _chain_start(contacts: Any, k: int, links: int) -> int:
    """Index in `CHAINS` of the first contact of a pair of geoms."""
    return (int(contacts[k]) * 2654435761 + int(contacts[k + 1]) * 40503) >> 3 & (links - 1)


@compiled
def _match_contacts(m: int, d: int, head: int) -> float:
    """Give remembered forces to the nearest contact of the same geoms; how far one has moved, if
    some are gone, m.

    What was before gets the square of that way as its `law.SEEN`, m^2."""
    counts, elliptic = _int64(head), _elliptic(m)
    count, kept, before = counts[COUNT], _block(head, KEPT), _block(head, BEFORE)
    axes, places, rows = _block(head, AXES), _int64(counts[PLACES]), _block(head, ROWS)
    numbers, bound, moved, fewer = _real(head), _reals(m, RBOUND), 0.0, False
    bodies, spins = _integers(m, BODY_OF), _reals(d, SPIN)
    links = _chain_contacts(head)
    chains = _int64(counts[CHAINS])
    for i in range(counts[COUNT_BEFORE]):
        b, nearest, least = W * i, -1, math.inf
        if i < count and _square_apart(kept, W * i, before, b) < law.UNMOVED**2:
            nearest, least = i, 0.0
        k = chains[_chain_start(before, b, links)] if nearest < 0 else -1
        while k >= 0:
            distance = _square_apart(kept, W * k, before, b)
            if distance < least:
                nearest, least = k, distance
            k = chains[links + k]
        before[b + law.SEEN] = least
        if nearest < 0:
            continue
        k = W * nearest
        alone = kept[k + law.STATE] == law.NEW
        moved, fewer = max(moved, least), fewer or not alone
        kept[k + law.STATE] = max(kept[k + law.STATE], before[b + law.STATE])
        kept[k + law.ERROR] = max(kept[k + law.ERROR], before[b + law.ERROR])
        kept[k + law.LIFT] = max(kept[k + law.LIFT], before[b + law.LIFT])
        kept[k + law.BORE] = max(kept[k + law.BORE], before[b + law.BORE])
        creep, turning = 0.0, 0.0
        for j in range(3 if before[b + law.STATE] == law.STICKS else 0):
            creep += before[b + law.SPEED + j] ** 2
        for side in range(2):
            spin = 6 * bodies[int(before[b + side])]
            turning = max(turning, spins[spin] ** 2 + spins[spin + 1] ** 2 + spins[spin + 2] ** 2)
        turned = numbers[FIXED] * math.sqrt(turning) * _smaller_radius(bound, before, b)
        fixed = alone and least <= 2 * (_scalar(m, STEP) * (turned + math.sqrt(creep))) ** 2
        kept[k + law.MISS] = before[b + law.MISS] if alone else 0.0
        for j in range(
            3
        ):  # a contact that wanders over its bodies, or is made of several, has none
            kept[k + law.SPEED + j] = before[b + law.SPEED + j] if fixed else math.inf
        for j in range(5):
            kept[k + law.LOAD + j] += before[b + law.LOAD + j]
        for side in range(2):
            for axis in range(3):
                for other in range(3):
                    turned = axes[24 * nearest + 9 * side + 3 * axis + other] / 2
                    for kind in range(2):
                        kept[k + law.FORCE + 2 * other + kind] += (
                            turned * before[b + law.FORCE + 6 * side + 2 * axis + kind]
                        )
    for i in range(count):
        k, p, mu = W * i, 4 * i, 24 * i + 18
        length, r = places[p + LENGTH], ROW * places[p + AT] + MEMORY
        if elliptic or length == 1:
            rows[r] = kept[k + law.LOAD]
            for t in range(length - 1):
                rows[r + ROW * (t + 1)] = kept[k + law.FORCE + 2 * _axis_of(t) + (t >= 2)]
            continue
        for t in range(length // 2):
            lean = kept[k + law.FORCE + 2 * _axis_of(t) + (t >= 2)] / axes[mu + t]
            pair = max(kept[k + law.LOAD + t], abs(lean))
            rows[r + 2 * ROW * t], rows[r + 2 * ROW * t + ROW] = (
                (pair + lean) / 2,
                (pair - lean) / 2,
            )
    for i in range(counts[COUNT_DRY]):
        remembered = counts[DRY_BEFORE] == counts[COUNT_DRY]
        rows[ROW * (counts[COUNT_ROWS] + i) + MEMORY] = _block(head, DRY)[i] if remembered else 0.0
    return math.sqrt(moved / 2) if fewer else 0.0


@compiled
def _cross(a: Any, b: Any) -> Any:
    """The cross product of two vectors."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@compiled
def _dot(a: Any, b: Any) -> float:
    """The scalar product of two vectors."""
    return float(a[0] * b[0] + a[1] * b[1] + a[2] * b[2])


@compiled
def _add_multiple(a: Any, x: float, b: Any) -> Any:
    """The vector a + x b."""
    return a[0] + x * b[0], a[1] + x * b[1], a[2] + x * b[2]


@compiled
def _rotated(a: Any, turn: Any) -> Any:
    """A vector turned about an axis, by an angle as long as the axis, rad."""
    square, across = _dot(turn, turn) + 1e-300, _cross(turn, a)
    angle = math.sqrt(square)
    return _add_multiple(
        _add_multiple(a, math.sin(angle) / angle, across),
        (1 - math.cos(angle)) / square,
        _cross(turn, across),
    )


@compiled
def _turn_accelerations(m: int, d: int, head: int) -> None:
    """Turn the angular accelerations of the last step along with the bodies, in whose axes MuJoCo
    has them."""
    counts, h, speeds = _int64(head), _scalar(m, STEP), _reals(d, QVEL)
    free = _int64(counts[FREE])
    for i in range(counts[COUNT_FREE]):
        a = free[2 * i + 1] + 3
        back = -h * speeds[a], -h * speeds[a + 1], -h * speeds[a + 2]
        for accelerations in (_reals(d, QACC), _reals(d, START)):
            turned = _rotated((accelerations[a], accelerations[a + 1], accelerations[a + 2]), back)
            for j in range(3):
                accelerations[a + j] = turned[j]


@compiled
def _add_gyroscopic_forces(m: int, d: int, head: int, known: bool, over: bool) -> None:
    """Gyroscopic forces on free bodies by the implicit midpoint rule, under the moments of the step
    before.

    A body that turns freely keeps its energy and the size of its angular momentum; and its centre
    of mass keeps its velocity where it is not the body's origin."""
    counts, h, bias = _int64(head), _scalar(m, STEP), _reals(d, BIAS)
    free, spins = _int64(counts[FREE]), _block(head, SPINS)
    inertias, speeds, centres = _reals(d, INERTIA), _reals(d, SPIN), _reals(d, CENTRE)
    origins, axes = _reals(d, ORIGIN), _reals(d, AXES_OF)
    for i in range(counts[COUNT_FREE]):
        body, dof, twist, coasting = free[2 * i], free[2 * i + 1], 6 * i, 6 * i + 3
        b, c, o = 10 * body, 3 * body, 9 * body
        mass, spin = inertias[b + 9], (speeds[6 * body], speeds[6 * body + 1], speeds[6 * body + 2])
        arm = (
            centres[c] - origins[c],
            centres[c + 1] - origins[c + 1],
            centres[c + 2] - origins[c + 2],
        )
        x = inertias[b], inertias[b + 3], inertias[b + 4]
        y = inertias[b + 3], inertias[b + 1], inertias[b + 5]
        z = inertias[b + 4], inertias[b + 5], inertias[b + 2]
        volume, one, two, three = _dot(x, _cross(y, z)), _cross(y, z), _cross(z, x), _cross(x, y)
        momentum = _dot(x, spin), _dot(y, spin), _dot(z, spin)
        pushed = spins[twist], spins[twist + 1], spins[twist + 2]
        if not known:
            pushed = 0.0, 0.0, 0.0
        elif over:
            was = spins[coasting], spins[coasting + 1], spins[coasting + 2]
            u = axes[o], axes[o + 1], axes[o + 2]
            v = axes[o + 3], axes[o + 4], axes[o + 5]
            w = axes[o + 6], axes[o + 7], axes[o + 8]
            gained = _add_multiple(momentum, -1.0, (_dot(u, was), _dot(v, was), _dot(w, was)))
            pushed = _rotated(gained, _add_multiple((0.0, 0.0, 0.0), -h, spin))
        half, middle, change = _add_multiple(momentum, 0.5, pushed), spin, pushed
        for _ in range(law.ITERATIONS):
            turn = _add_multiple((0.0, 0.0, 0.0), h / 2, middle)
            size = _dot(turn, turn)
            change = _add_multiple(_add_multiple(_cross(half, turn), 0.5, pushed), -size, momentum)
            change = _add_multiple(
                (0.0, 0.0, 0.0), 1 / (1 + size), _add_multiple(change, _dot(turn, half), turn)
            )
            last, middle = (
                middle,
                _add_multiple(
                    spin, 1 / volume, (_dot(one, change), _dot(two, change), _dot(three, change))
                ),
            )
            moved = _add_multiple(middle, -1.0, last)
            if _dot(moved, moved) <= 1e-32 * _dot(middle, middle):  # soon of a body that is round
                break
        change = _add_multiple(change, 1.0, _add_multiple(change, -1.0, pushed))
        coasts, after = (
            _add_multiple(momentum, 1.0, change),
            _add_multiple(middle, 1.0, _add_multiple(middle, -1.0, spin)),
        )
        across = _cross(after, arm)
        swung = _add_multiple(
            _rotated(across, _add_multiple((0.0, 0.0, 0.0), h, after)), -1.0, across
        )
        force = _add_multiple(
            _add_multiple((0.0, 0.0, 0.0), mass / h, swung), -mass, _cross(spin, _cross(spin, arm))
        )
        moment = _add_multiple(
            _add_multiple(_cross(arm, force), -1 / h, change), -1.0, _cross(spin, momentum)
        )
        for j in range(3):
            bias[dof + j] += force[j]
            spins[twist + j], spins[coasting + j] = pushed[j], 0.0
            for k in range(3):
                bias[dof + 3 + j] += axes[o + 3 * k + j] * moment[k]
                spins[coasting + j] += axes[o + 3 * k + j] * coasts[k]


@compiled
def _stiffen(m: int, d: int, head: int) -> None:
    """Make rigid contacts stiff, and let them ask for the velocities of Moreau and Jean's time
    stepping."""
    counts, numbers, elliptic, h = _int64(head), _real(head), _elliptic(m), _scalar(m, STEP)
    kept, places, rows = _block(head, KEPT), _int64(counts[PLACES]), _block(head, ROWS)
    softness, stiffness, diagonal = _reals(d, R), _reals(d, D), _reals(d, DIAG)
    velocity, reference, bound = _reals(d, VEL), _reals(d, AREF), _reals(m, RBOUND)
    islands = (
        _at(ISLAND_R) >= 0 and _integer(d, NISLAND) > 0
    )  # they have copies, but not in MuJoCo 3.3.0
    place = _integers(d, ISLAND_PLACE if islands else COLIND)
    island_softness, island_stiffness = (
        _reals(d, ISLAND_R if islands else R),
        _reals(d, ISLAND_D if islands else D),
    )
    slow, depth = h * _gravity(m), numbers[DEPTH] * (h / law.USUAL) ** 2
    for i in range(counts[COUNT]):
        a, length, gap = places[4 * i + FIRST], places[4 * i + LENGTH], kept[W * i + law.GAP]
        edges = length > 1 and not elliptic
        speed = (velocity[a] + velocity[a + 1]) / 2 if edges else velocity[a]
        held = ROW * places[4 * i + AT] + MEMORY
        load = rows[held] + rows[held + ROW] if edges else rows[held]
        lasting = min(load, kept[W * i + law.BORE])  # not the force of a blow
        kept[W * i + law.BORE] = load
        deep = max(-gap - depth * _smaller_radius(bound, kept, W * i), 0.0)
        goal = (
            -gap / h
            if gap > 0
            else min(numbers[PUSH] * deep / h, max(slow, h * diagonal[a] * lasting))
        )
        r, above = ROW * places[4 * i + AT] + RESIDUAL, max(gap, 0.0)
        fall = h * max(-(rows[r] + rows[r + ROW]) / 2 if edges else -rows[r], 0.0)
        if numbers[RESTITUTION] > 0 and gap + h * (speed - fall) < 0 and speed < -2 * slow:
            # Euler's method keeps v²/2 + gz - hgv/2 in flight
            energy = speed * (speed - fall) / 2 + fall / h * above
            square = fall**2 / 4 + 2 * (numbers[RESTITUTION] ** 2 * energy - fall / h * above)
            goal = max(goal, math.sqrt(max(square, 0.0)) - fall / 2)
        factor = numbers[SOFTNESS] * diagonal[a] / softness[a]
        for r in range(a, a + length):
            softness[r] *= factor
            stiffness[r] = 1 / softness[r]
            reference[r] = ((goal if edges or r == a else 0.0) - velocity[r]) / h
            if islands:
                island_softness[place[r]], island_stiffness[place[r]] = softness[r], stiffness[r]
    if _integer(m, SOLVER) == 0:  # PGS has it in its matrix
        mj_projectConstraint(m, d)


@compiled
def _take_depth_away(m: int, d: int, head: int) -> None:
    """Move the distance that a soft contact holds, step by step, until under its load it has no
    depth."""
    counts, numbers, elliptic = _int64(head), _real(head), _elliptic(m)
    kept, places, kbip, reference = (
        _block(head, KEPT),
        _int64(counts[PLACES]),
        _reals(d, KBIP),
        _reals(d, AREF),
    )
    contact = _int64(d + _at(CONTACT))[0]
    for i in range(counts[COUNT]):
        k, a, length = W * i, places[4 * i + FIRST], places[4 * i + LENGTH]
        margin, gap = (
            _scalar(contact + places[4 * i + INDEX] * _at(SIZE), INCLUDE),
            kept[k + law.GAP],
        )
        lift = min(max(kept[k + law.LIFT] - _scalar(m, STEP) / numbers[SERVO] * gap, 0.0), margin)
        kept[k + law.LIFT] = lift
        spring = (
            kbip[4 * a] * kbip[4 * a + 2] * (margin - lift) if lift > 0 or gap <= 0 else law.APART
        )
        for r in range(a, a + (1 if elliptic else length)):
            reference[r] -= spring


@compiled
def _copy_jacobians(m: int, d: int, head: int) -> None:
    """Copy the Jacobians of all rows: the engine's own are gone when the next step asks what forces
    there were."""
    counts, nv, sparse = _int64(head), _integer(m, DOFS), mj_isSparse(m)
    places, rows, count = _int64(counts[PLACES]), _block(head, ROWS), ROW * counts[COUNT_ROWS]
    for i in range(counts[COUNT]):
        for r in range(places[4 * i + LENGTH]):
            rows[ROW * (places[4 * i + AT] + r) + ADDRESS_OF] = places[4 * i + FIRST] + r
    ne, loss = _integer(d, NE), _reals(d, LOSS)
    for i in range(counts[COUNT_DRY]):
        rows[count + ROW * i + ADDRESS_OF], rows[count + ROW * i + LIMIT] = ne + i, loss[ne + i]
    total, length = 0, _integers(d, ROWNNZ)
    count += ROW * counts[COUNT_DRY]
    for r in range(0, count, ROW):
        rows[r + BEGIN], rows[r + NONZEROS] = (
            total,
            length[int(rows[r + ADDRESS_OF])] if sparse else nv,
        )
        total += int(rows[r + NONZEROS])
    jacobian, columns = _grown(head, JACOBIAN, total), _grown_integers(head, COLUMN, total)
    given, column, begin = _reals(d, J), _integers(d, COLIND), _integers(d, ROWADR)
    for r in range(0, count, ROW):
        address, to = int(rows[r + ADDRESS_OF]), int(rows[r + BEGIN])
        source = begin[address] if sparse else address * nv
        for n in range(int(rows[r + NONZEROS])):
            jacobian[to + n] = given[source + n]
            columns[to + n] = column[source + n] if sparse else n


@compiled
def _set_rows(m: int, d: int, head: int) -> None:
    """Set softness, reference acceleration and remembered force of all rows; of soft contacts, of
    friction alone."""
    counts, elliptic, rigid = _int64(head), _elliptic(m), _real(head)[RIGID] > 0
    places, rows, softness, reference = (
        _int64(counts[PLACES]),
        _block(head, ROWS),
        _reals(d, R),
        _reals(d, AREF),
    )
    for r in range(0, ROW * (counts[COUNT_ROWS] + counts[COUNT_DRY]), ROW):
        address = int(rows[r + ADDRESS_OF])
        rows[r + SOFT], rows[r + REFERENCE], rows[r + HELD] = (
            softness[address],
            reference[address],
            rows[r + MEMORY],
        )
    for i in range(0 if rigid else counts[COUNT]):
        r, length, mean = ROW * places[4 * i + AT], places[4 * i + LENGTH], 0.0
        if elliptic:
            rows[r + HELD] = 0.0
            continue
        for e in range(r, r + ROW * length, ROW):
            mean += rows[e + MEMORY] / length
        for e in range(r, r + ROW * length, ROW):
            rows[e + HELD] -= mean


@compiled
def _multiply_rows(m: int, head: int, vector: Any) -> None:
    """Set `RESIDUAL` of all rows to the Jacobian times a vector of all degrees of freedom."""
    counts, rows, moves = _int64(head), _block(head, ROWS), False
    for i in range(_integer(m, DOFS)):
        moves |= vector[i] != 0
    for r in range(0, ROW * (counts[COUNT_ROWS] + counts[COUNT_DRY]), ROW):
        rows[r + RESIDUAL] = _row_times(head, rows, r, vector) if moves else 0.0


@compiled
def _row_times(head: int, rows: Any, r: int, vector: Any) -> float:
    """One row of the Jacobian times a vector of all degrees of freedom."""
    jacobian, columns, total, begin = (
        _block(head, JACOBIAN),
        _int64(_int64(head)[COLUMN]),
        0.0,
        int(rows[r + BEGIN]),
    )
    for n in range(begin, begin + int(rows[r + NONZEROS])):
        total += jacobian[n] * vector[columns[n]]
    return total


@compiled
def _lift_by_slip(rows: Any, r: int, length: int, elliptic: bool, axes: Any, mu: int) -> float:
    """By how much slip would lift a contact, since the engine's law is convex, m s-2 (De Saxce's
    correction)."""
    square, most = 0.0, 0.0
    if elliptic:
        for t in range(length - 1):
            n = r + ROW * (t + 1)
            square += (axes[mu + t] * (rows[n + RESIDUAL] + rows[n + SOFT] * rows[n + FOUND])) ** 2
        return math.sqrt(square)
    for e in range(r, r + ROW * (length - 1), 2 * ROW):
        plus, minus = (
            rows[e + RESIDUAL] + rows[e + SOFT] * rows[e + FOUND],
            rows[e + ROW + RESIDUAL] + rows[e + ROW + SOFT] * rows[e + ROW + FOUND],
        )
        most = max(most, abs(plus - minus) / 2)
    return most


@compiled
def _subtract_references(head: int) -> None:
    """Subtract the reference accelerations of all contact rows from `RESIDUAL`."""
    counts, rows = _int64(head), _block(head, ROWS)
    for r in range(0, ROW * counts[COUNT_ROWS], ROW):
        rows[r + RESIDUAL] -= rows[r + REFERENCE]
        rows[r + FOUND] = 0.0


@compiled
def _foresee_slip(m: int, d: int, head: int, enough: float) -> bool:
    """Foresee how contacts slip, as if accelerations stayed those of the last step; whether that is
    in doubt."""
    counts, elliptic, rigid, gravity = (
        _int64(head),
        _elliptic(m),
        _real(head)[RIGID] > 0,
        _gravity(m),
    )
    kept, axes, places, rows = (
        _block(head, KEPT),
        _block(head, AXES),
        _int64(counts[PLACES]),
        _block(head, ROWS),
    )
    diagonal, doubt = _reals(d, DIAG), False
    _subtract_references(head)
    for i in range(counts[COUNT]):
        k, r, length, state = (
            W * i,
            ROW * places[4 * i + AT],
            places[4 * i + LENGTH],
            kept[W * i + law.STATE],
        )
        slip = _lift_by_slip(rows, r, length, elliptic, axes, 24 * i + 18)
        edges = length > 1 and not elliptic
        normal = (
            (rows[r + RESIDUAL] + rows[r + ROW + RESIDUAL]) / 2 if edges else rows[r + RESIDUAL]
        )
        error = kept[k + law.ERROR] > enough
        kept[k + law.SLIP], kept[k + law.GUESS] = slip, -1.0
        if state == law.NEW or state == law.OPEN:
            doubt |= normal < 0 and (rigid or slip > enough)
            continue
        ahead = 0.0  # of friction and slip: it stops
        if edges:
            for e in range(r, r + ROW * length, 2 * ROW):
                ahead += (rows[e + MEMORY] - rows[e + ROW + MEMORY]) * (
                    rows[e + RESIDUAL] - rows[e + ROW + RESIDUAL]
                )
        else:
            for e in range(r + ROW, r + ROW * length, ROW):
                ahead += rows[e + MEMORY] * rows[e + RESIDUAL]
        if state == law.STICKS or ahead >= 0:
            kept[k + law.SLIP] = 0.0
            doubt |= slip > enough and not _would_hold(
                rows, r, length, edges, axes, 24 * i + 18, diagonal
            )
        else:
            kept[k + law.GUESS], kept[k + law.SLIP] = slip, max(slip + kept[k + law.MISS], 0.0)
            doubt |= error
        # the force of a rigid contact will change by a weight
        doubt |= rigid and (abs(normal) > gravity or (kept[k + law.SLIP] == 0 and slip > gravity))
    return doubt


@compiled
def _oppose_slip_at_mid_step(m: int, d: int, head: int) -> bool:
    """Let friction of contacts that slide fast oppose their slip at mid step, not at its end;
    whether there are any."""
    counts, elliptic, h = _int64(head), _elliptic(m), _scalar(m, STEP)
    kept, axes, places, rows = (
        _block(head, KEPT),
        _block(head, AXES),
        _int64(counts[PLACES]),
        _block(head, ROWS),
    )
    velocity, some = _reals(d, VEL), False
    for i in range(counts[COUNT]):
        k, a, r, length = (
            W * i,
            places[4 * i + FIRST],
            ROW * places[4 * i + AT],
            places[4 * i + LENGTH],
        )
        if kept[k + law.STATE] != law.SLIDES or kept[k + law.SLIP] == 0:
            continue
        edges, mu, speed, change = length > 1 and not elliptic, 24 * i + 18, 0.0, 0.0
        for t in range(length // 2 if edges else length - 1):
            e, own = (2 * t, 0.5) if edges else (t + 1, axes[mu + t])
            slip, rate = (
                velocity[a + e],
                rows[r + ROW * e + RESIDUAL] + rows[r + ROW * e + REFERENCE],
            )
            if edges:
                slip -= velocity[a + e + 1]
                rate -= rows[r + ROW * (e + 1) + RESIDUAL] + rows[r + ROW * (e + 1) + REFERENCE]
            speed, change = speed + (own * slip) ** 2, change + (own * rate) ** 2
        if speed <= (_real(head)[FAST] * h) ** 2 * change:
            continue
        normal = (velocity[a] + velocity[a + 1]) / 2 if edges else 0.0
        for e in range(0 if edges else 1, length):
            more = (velocity[a + e] - normal) / h
            rows[r + ROW * e + REFERENCE] -= more
            rows[r + ROW * e + RESIDUAL] += more
        kept[k + law.GUESS] = _lift_by_slip(rows, r, length, elliptic, axes, mu)
        kept[k + law.SLIP], some = max(kept[k + law.GUESS] + kept[k + law.MISS], 0.0), True
    return some


@compiled
def _would_hold(
    rows: Any, r: int, length: int, edges: bool, axes: Any, mu: int, diagonal: Any
) -> bool:
    """Whether a contact would stick: the forces that this takes, from it alone, are within the
    friction cone."""
    square, load = 0.0, 0.0
    for e in range(r, r + ROW * length, ROW):
        lacks = rows[e + RESIDUAL] + rows[e + SOFT] * (rows[e + MEMORY] - rows[e + HELD])
        force = rows[e + MEMORY] - lacks / (diagonal[int(rows[e + ADDRESS_OF])] + rows[e + SOFT])
        if edges and force < 0:
            return False
        if e == r:
            load = force
        elif not edges:
            square += (force / axes[mu + (e - r) // ROW - 1]) ** 2
    return edges or (load > 0 and square <= load**2)


@compiled
def _write_references(m: int, d: int, head: int) -> None:
    """Tell the engine reference accelerations that hold remembered forces, and don't let slip lift
    contacts."""
    counts, elliptic, reference = _int64(head), _elliptic(m), _reals(d, AREF)
    kept, places, rows = _block(head, KEPT), _int64(counts[PLACES]), _block(head, ROWS)
    for r in range(0, ROW * (counts[COUNT_ROWS] + counts[COUNT_DRY]), ROW):
        reference[int(rows[r + ADDRESS_OF])] = rows[r + REFERENCE] + rows[r + SOFT] * rows[r + HELD]
    for i in range(counts[COUNT]):
        a = places[4 * i + FIRST]
        for r in range(a, a + (1 if elliptic else places[4 * i + LENGTH])):
            reference[r] -= kept[W * i + law.SLIP]


@compiled
def _find_forces(m: int, d: int, head: int) -> float:
    """Find the contacts' forces, states and slip from the accelerations; how wrong what was
    foreseen was, m s-2."""
    counts, elliptic, rigid = _int64(head), _elliptic(m), _real(head)[RIGID] > 0
    kept, axes, places, rows = (
        _block(head, KEPT),
        _block(head, AXES),
        _int64(counts[PLACES]),
        _block(head, ROWS),
    )
    _multiply_rows(m, head, _reals(d, QACC))
    for r in range(0, ROW * (counts[COUNT_ROWS] + counts[COUNT_DRY]), ROW):
        rows[r + RESIDUAL] -= rows[r + REFERENCE] + rows[r + SOFT] * rows[r + HELD]
    most = 0.0
    for i in range(counts[COUNT]):
        k, r, length, a = W * i, ROW * places[4 * i + AT], places[4 * i + LENGTH], 24 * i + 18
        edges, foreseen = length > 1 and not elliptic, kept[k + law.SLIP]
        for e in range(r, r + ROW * (length if edges else 1), ROW):
            rows[e + RESIDUAL] += foreseen
        state, error = _contact_forces(rows, r, length, edges, axes, a), 0.0
        slip = _lift_by_slip(rows, r, length, elliptic, axes, a) if state != law.STICKS else 0.0
        if state == law.OPEN:  # its slip matters if without it the contact would have closed
            approach = rows[r + RESIDUAL] + rows[r + SOFT] * rows[r + HELD] - foreseen
            if edges:
                approach += (
                    rows[r + ROW + RESIDUAL]
                    + rows[r + ROW + SOFT] * rows[r + ROW + HELD]
                    - foreseen
                )
            error = abs(slip - foreseen) if approach < 0 else 0.0
        else:
            error = abs(slip - foreseen)
        for e in range(r, r + ROW * length if rigid else r, ROW):
            error = max(error, abs(rows[e + SOFT] * (rows[e + FOUND] - rows[e + MEMORY])))
        kept[k + law.STATE], kept[k + law.ERROR], kept[k + law.SEEN] = state, error, slip
        guessed = rigid and state == law.SLIDES and kept[k + law.GUESS] >= 0
        kept[k + law.MISS] = (
            (kept[k + law.MISS] + slip - kept[k + law.GUESS]) / 2 if guessed else 0.0
        )
        most = max(most, error)
    first = ROW * counts[COUNT_ROWS]
    for r in range(first, first + ROW * counts[COUNT_DRY], ROW):
        rows[r + FOUND] = min(
            max(-rows[r + RESIDUAL] / rows[r + SOFT], -rows[r + LIMIT]), rows[r + LIMIT]
        )
    return most


@compiled
def _contact_forces(rows: Any, r: int, length: int, edges: bool, axes: Any, a: int) -> int:
    """Set the forces of a contact as the engine's solver has them; return whether it is open,
    sticks or slides."""
    if edges or length == 1:
        idle = 0
        for e in range(r, r + ROW * length, ROW):
            rows[e + FOUND] = max(-rows[e + RESIDUAL] / rows[e + SOFT], 0.0)
            idle += rows[e + FOUND] == 0
        return law.STICKS if idle == 0 else law.OPEN if idle == length else law.SLIDES
    mu, square = axes[a + 5], 0.0
    normal = mu * rows[r + RESIDUAL]
    for t in range(length - 1):
        square += (axes[a + t] * rows[r + ROW * (t + 1) + RESIDUAL]) ** 2
    tangent = math.sqrt(square)
    if normal >= mu * tangent:
        for e in range(r, r + ROW * length, ROW):
            rows[e + FOUND] = 0.0
        return law.OPEN
    if mu * normal + tangent <= 0:
        for e in range(r, r + ROW * length, ROW):
            rows[e + FOUND] = -rows[e + RESIDUAL] / rows[e + SOFT]
        return law.STICKS
    load = (mu * tangent - normal) / (rows[r + SOFT] * mu * (1 + mu * mu))
    rows[r + FOUND] = load
    for t in range(length - 1):
        e = r + ROW * (t + 1)
        rows[e + FOUND] = -load / tangent * axes[a + t] ** 2 * rows[e + RESIDUAL]
    return law.SLIDES


@compiled
def retain(m: int, d: int, head: int) -> None:
    """Find the contact forces at the end of a step, for the next one to remember."""
    counts = _int64(head)
    if counts[PENDING]:
        counts[PENDING] = 0
        _find_forces(m, d, head)


@compiled
def _put_points_back(m: int, d: int, head: int) -> bool:
    """Put back corners of flat contacts which the collider has dropped while they overlap; whether
    there were any."""
    counts, share, rigid = _int64(head), _real(head)[NEAR], _real(head)[RIGID] > 0
    ncon, size, contact = _integer(d, NCON), _at(SIZE), _int64(d + _at(CONTACT))[0]
    xpos, xmat, bound = _reals(d, XPOS), _reals(d, XMAT), _reals(m, RBOUND)
    before, count = _block(head, BEFORE), counts[COUNT_BEFORE]
    point, added = _grown_integers(head, SCRATCH, size // 8 + 12 + ncon), 0
    address = counts[SCRATCH]
    normal, across, along = (
        _real(address + size),
        _real(address + size + 24),
        _real(address + size + 48),
    )
    middle, angle = _real(address + size + 72), _real(address + size + 96)
    for i in range(count):
        b = W * i
        gap, g = before[b + law.GAP], (int(before[b + law.GEOMS]), int(before[b + law.GEOMS + 1]))
        near = share * max(bound[g[0]], bound[g[1]])
        if not 1.99 * near**2 < before[b + law.SEEN] < math.inf:
            continue
        opened, apart = 0.0, 0.0
        for j in range(3):
            normal[j], middle[j], along[j] = 0.0, 0.0, 0.0
            for axis in range(3):
                normal[j] += xmat[9 * g[0] + 3 * j + axis] * before[b + law.NORMAL + axis]
            for side in range(2):
                place = xpos[3 * g[side] + j]
                for axis in range(3):
                    place += (
                        xmat[9 * g[side] + 3 * j + axis] * before[b + law.PLACE + 3 * side + axis]
                    )
                middle[j] += place / 2
                along[j] += place if side else -place
            opened += normal[j] * along[j]
        for j in range(3):
            apart += (along[j] - opened * normal[j]) ** 2
        if gap + opened >= 0 or apart >= (near / 10) ** 2:
            continue
        had, left, alone, same = 0, 0, True, -1
        for n in range(count):
            had += before[W * n] == g[0] and before[W * n + 1] == g[1]
        for n in range(ncon):
            geom = _int32(contact + n * size + _at(GEOM))
            if geom[0] != g[0] or geom[1] != g[1]:
                continue
            left, same, place = left + 1, n, _real(contact + n * size + _at(POS))
            square = 0.0
            for j in range(3):
                square += (place[j] - middle[j]) ** 2
            alone = alone and square > near**2
        if not (
            0 < left < had + rigid and alone
        ):  # a heightfield has one point at a time, by turns
            continue
        thin = 0  # the axis that is farthest from the normal
        for j in range(1, 3):
            thin = j if abs(normal[j]) < abs(normal[thin]) else thin
        for j in range(3):
            one, two = (j + 1) % 3, (j + 2) % 3
            across[j] = normal[one] * (two == thin) - normal[two] * (one == thin)
        length = math.sqrt(across[0] ** 2 + across[1] ** 2 + across[2] ** 2)
        for j in range(3):
            across[j] /= length
        for j in range(3):
            one, two = (j + 1) % 3, (j + 2) % 3
            along[j] = normal[one] * across[two] - normal[two] * across[one]
        seen = 0
        for n in range(ncon):
            geom = _int32(contact + n * size + _at(GEOM))
            if geom[0] == g[0] and geom[1] == g[1]:
                place, x, y = _real(contact + n * size + _at(POS)), 0.0, 0.0
                for j in range(3):
                    x, y = (
                        x + across[j] * (place[j] - middle[j]),
                        y + along[j] * (place[j] - middle[j]),
                    )
                angle[seen] = math.atan2(y, x)
                seen += 1
        for n in range(1, seen):
            for k in range(n, 0, -1):
                angle[k - 1], angle[k] = min(angle[k - 1], angle[k]), max(angle[k - 1], angle[k])
        widest = angle[0] + 2 * math.pi - angle[seen - 1]
        for n in range(1, seen):
            widest = max(widest, angle[n] - angle[n - 1])
        if widest <= law.CORNER:
            continue
        template = _int64(contact + same * size)
        for n in range(size // 8):
            point[n] = template[n]
        _real(address + _at(DIST))[0] = gap + opened
        place, frame = _real(address + _at(POS)), _real(address + _at(FRAME))
        for j in range(3):
            place[j], frame[j], frame[3 + j], frame[6 + j] = (
                middle[j],
                normal[j],
                across[j],
                along[j],
            )
        mj_addContact(m, d, address)
        added += 1
    if added:
        mj_makeConstraint(m, d)
        mj_island(m, d)
        mj_projectConstraint(m, d)
        mj_fwdVelocity(m, d)
    return added > 0


# -- doors -------------------------------------------------------------------------------------------------------------


@functools.cache
def link() -> None:
    """Compile `control` and `retain` once, and give the linker their addresses, by which compiled
    code calls them."""
    for function in (control, retain) if COMPILES else ():
        with alone(function):
            function.compile((types.intp,) * 3)
        (signature,) = function.nopython_signatures
        llvmlite.binding.add_symbol(
            f"coulomb_{function.__name__}", _get_wrapper_address(function, signature)
        )


control_linked, retain_linked = control, retain
if COMPILES:
    control_linked, retain_linked = (
        _called_by_address(name, 3, types.void) for name in ("control", "retain")
    )


@compiled
def advance(m: int, d: int, head: int, nstep: int) -> None:
    """Take so many of MuJoCo's steps under the law."""
    for _ in range(nstep):
        mj_step1(m, d)
        control_linked(m, d, head)
        mj_step2(m, d)
        retain_linked(m, d, head)


@compiled
def step_of(m: int, d: int, head: int, duration: float, anew: bool) -> None:
    """Take a step of so many seconds, with what is remembered of the last one, or `anew` without
    it."""
    _real(m + _at(STEP))[0] = duration
    if anew:
        _real(head)[MOMENT], _int64(head)[PENDING], _int64(head)[TURNED] = math.nan, 0, 0
    advance(m, d, head, 1)


_FIND = ctypes.CFUNCTYPE(ctypes.c_int64, ctypes.c_int64, ctypes.c_int64)


def _ask_python(function: int, m: int, d: int) -> int:
    """Call a Python function of two integers by its address."""
    return int(_FIND(function)(m, d))


if COMPILES:

    @intrinsic  # type: ignore[untyped-decorator]
    def _ask_python(typing: Any, function: Any, m: Any, d: Any) -> Any:
        def code(context: Any, builder: Any, call: Any, args: Any) -> Any:
            integer = ir.IntType(64)
            pointer = builder.inttoptr(
                args[0], ir.FunctionType(integer, [integer, integer]).as_pointer()
            )
            return builder.call(pointer, args[1:])

        return types.intp(types.intp, types.intp, types.intp), code


@compiled
def _serve(m: int, d: int) -> None:
    """Apply `control` to a simulation whose model is under `doors.Coulomb.installed`; leave others
    alone."""
    table = _int64(_simulations_address())
    for i in range(3, 3 + 3 * table[0], 3):
        if table[i] == m and table[i + 1] == d:
            head = table[i + 2]
            break
    else:
        head = _ask_python(table[1], m, d)
    if head:
        control_linked(m, d, head)


@functools.cache
def callback(find: Callable[[int, int], int]) -> Any:
    """The control callback for MuJoCo that applies the law; `find` tells it of a simulation that is
    new to it.

    `find` is a Python function of the addresses of model and data.
    """
    ask = _FIND(find)
    _simulations[1] = ctypes.cast(ask, ctypes.c_void_p).value or 0
    _kept.append(ask)
    if not COMPILES:
        return lambda model, data: _serve(model._address, data._address)
    signature, serve = types.void(types.intp, types.intp), _serve.py_func
    try:
        return numba.cfunc(signature, cache=True, nopython=True)(serve).ctypes
    except RuntimeError:  # no place for a cache
        return numba.cfunc(signature, nopython=True)(serve).ctypes


_kept: list[Any] = []
"""Callbacks into Python, which live as long as the program."""


def remember(m: int, d: int, head: int) -> None:
    """Tell the callback, while there is room, where the memory of a simulation is: `head`, 0 if it
    has no law."""
    count = int(_simulations[0])
    if count < SIMULATIONS:
        _simulations[3 + 3 * count : 6 + 3 * count] = m, d, head
        _simulations[0] = count + 1


def forget_all() -> None:
    """Forget all simulations of the callback, so that it asks for each again."""
    _simulations[0] = 0


class Simulation:
    """What one simulation remembers, in memory that the compiled loops read and write."""

    def __init__(self, model: Any, numbers: law.Law) -> None:
        link()
        self._model, self._head, self._data = model, np.zeros(HEAD, np.int64), 0
        self._real = self._head.view(float)
        self.address = self._head.ctypes.data
        self._real[RIGID:HEAD] = [float(value) for value in dataclasses.astuple(numbers)]
        self._real[LEAST] = numbers.near * model.geom_rbound.min(
            where=model.geom_rbound > 0, initial=1e9
        )
        free = law.free_bodies(model) if numbers.rigid else np.empty((0, 2))
        grow(self.address, FREE, free.size)
        self._head[COUNT_FREE] = len(free)
        self._array(FREE, free.size).view(np.int64)[:] = free.ravel()
        grow(self.address, SPINS, 6 * len(free))
        self.reset()
        weakref.finalize(self, _free, self._head)

    @property
    def solves(self) -> int:
        """How often the engine has solved a step again for the law, since the beginning."""
        return int(self._head[SOLVES])

    def reset(self) -> None:
        """Forget all contacts, as at the start."""
        self._real[MOMENT], self._head[PENDING], self._head[TURNED] = math.nan, 0, 0

    def serve(self, data: int) -> int:
        """Serve the simulation whose data are at an address; return that of what is remembered of
        it."""
        self._data = data
        return int(self.address)

    def control(self, model: Any, data: Any) -> None:
        """Apply the law between the engine's reference accelerations and its solver: `control` of
        this simulation."""
        self._alive, self._data = data, data._address
        control(model._address, data._address, self.address)

    def retain(self, model: Any, data: Any) -> None:
        """Store the contact forces that the last step came to."""
        retain(model._address, data._address, self.address)

    def advance(self, model: Any, data: Any, nstep: int) -> None:
        """Take `nstep` of MuJoCo's steps under the law."""
        self._alive, self._data = data, data._address
        advance(model._address, data._address, self.address, nstep)

    def _array(self, block: int, numbers: int) -> Array:
        """A view of so many reals of a block of memory."""
        pointer = ctypes.cast(int(self._head[block]), ctypes.POINTER(ctypes.c_double))
        return np.ctypeslib.as_array(pointer, (numbers,)) if numbers else np.empty(0)

    def state(self) -> dict[str, Array]:
        """Copies of all that the law remembers from one step to the next, as `restore` takes
        them."""
        if math.isnan(self._real[MOMENT]):
            spins = np.zeros((self._head[COUNT_FREE], 6))
            return {
                "contacts": np.empty((0, W)),
                "joints": np.empty(0),
                "spins": spins,
                "time": np.full(2, math.nan),
            }
        if self._head[PENDING]:
            retain(self._model._address, self._data, self.address)
        if not self._head[TURNED]:  # what goes on from here does as what is restored
            store_forces(self._model._address, self.address, FOUND)
            store_slip(self._model._address, self._data, self.address)
            self._head[TURNED], self._head[COUNT_FOUND] = 1, -1
        contacts = self._array(KEPT, W * self._head[COUNT]).reshape(-1, W)
        dry = self._array(DRY, self._head[COUNT_DRY])
        spins, time = (
            self._array(SPINS, 6 * self._head[COUNT_FREE]).reshape(-1, 6),
            self._real[[MOMENT, LASTED]],
        )
        return {
            "contacts": contacts.copy(),
            "joints": dry.copy(),
            "spins": spins.copy(),
            "time": time,
        }

    def restore(self, contacts: Array, joints: Array, spins: Array, time: Array) -> None:
        """Go on from what `state` returned."""
        self._array(SPINS, spins.size)[:] = spins.ravel()
        for block, count, values in ((KEPT, COUNT, contacts), (DRY, COUNT_DRY, joints)):
            grow(self.address, block, values.size)
            self._array(block, values.size)[:] = values.ravel()
            self._head[count] = len(values)
        self._real[[MOMENT, LASTED]] = time
        self._real[CALLED] = time[0]
        self._head[[PENDING, TURNED, COUNT_FOUND, RESETS]] = 0, 1, -1, -1


def _free(head: npt.NDArray[np.int64]) -> None:
    """Release all memory of a simulation."""
    release = ctypes.pythonapi.PyMem_RawFree
    release.argtypes = [ctypes.c_void_p]
    for block in range(KEPT, COUNT, 2):
        release(int(head[block]) or None)
