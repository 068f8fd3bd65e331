"""MuJoCo's memory by MuJoCo's names, and its functions, for compiled code.

`mujoco.introspect` says what `mjModel`, `mjData` and `mjContact` are made of; numpy's structured
types of them lie over the engine's own memory, so that nothing is copied. Compiled code is handed
addresses: an array would cost five microseconds, as much as a step of a small scene.
"""

from __future__ import annotations

import ctypes
import zlib
from pathlib import Path
from typing import Any

import mujoco
import numba
import numpy as np
from mujoco.introspect import ast_nodes, structs
from numba import types
from numba.extending import intrinsic
from numba.np.arrayobj import np_cfarray

from .compiling import c_function

# -- structures ------------------------------------------------------------------------------------

_SCALARS = {
    **{"int": np.int32, "mjtNum": np.float64, "float": np.float32, "unsigned char": np.uint8},
    **{"mjtByte": np.uint8, "mjtBool": np.bool_},
    **dict.fromkeys(("mjtSize", "size_t", "uintptr_t", "uint64_t"), np.int64),
}
_OLDER = {"efc_diagA": "efc_diagApprox"}
"""Names that MuJoCo has for the same before 3.10."""


def structure(name: str) -> np.dtype[Any]:
    """One of MuJoCo's structures, aligned as C aligns it; pointers are integers."""

    def kind(declared: Any) -> Any:
        if isinstance(declared, ast_nodes.PointerType):
            return np.int64
        if isinstance(declared, ast_nodes.ArrayType):
            return kind(declared.inner_type), tuple(declared.extents)
        if isinstance(declared, ast_nodes.ValueType):
            return _SCALARS.get(declared.name) or structure(declared.name)
        return fields(declared.fields)

    def fields(declared: Any) -> np.dtype[Any]:
        named: Any = [(field.name, kind(field.type)) for field in declared]
        whole: np.dtype[Any] = np.dtype(named, align=True)
        return whole

    whole: Any = structs.STRUCTS[name]
    return fields(whole.fields)


def _only(whole: np.dtype[Any], *names: str, **parts: np.dtype[Any]) -> np.dtype[Any]:
    """A structure with some of its fields, at their places; `parts` of structures within it."""
    assert whole.fields is not None
    places, formats, offsets = dict(whole.fields), [], []
    for name in (*names, *parts):
        known = name if name in places else _OLDER.get(name, name)
        if known not in places:
            version = mujoco.__version__
            raise ImportError(f"Coulomb's law doesn't know MuJoCo {version}, which has no {name}")
        formats.append(parts.get(name, places[known][0]))
        offsets.append(places[known][1])
    layout = {"names": [*names, *parts], "formats": formats, "offsets": offsets}
    kind: Any = {**layout, "itemsize": whole.itemsize}
    part: np.dtype[Any] = np.dtype(kind)
    return part


MJ_CONTACT = _only(
    structure("mjContact"),
    *("dist", "pos", "frame", "includemargin", "friction", "mu"),
    *("dim", "geom", "exclude", "efc_address"),
)
MJ_OPTION = _only(structure("mjOption"), "timestep", "gravity", "cone", "solver")
MJ_MODEL = _only(
    structure("mjModel"),
    *("nv", "nbody", "njnt", "ngeom", "geom_rbound", "geom_bodyid"),
    *("geom_type", "geom_aabb", "geom_dataid", "body_rootid", "body_weldid", "body_mocapid"),
    *("nhfield", "hfield_size", "hfield_nrow", "hfield_ncol", "hfield_adr", "hfield_data"),
    *("nu", "jnt_type", "jnt_dofadr"),
    *("nC", "nD", "dof_parentid", "M_rownnz", "M_rowadr", "M_colind", "mapD2M"),
    opt=MJ_OPTION,
)
MJ_DATA = _only(
    structure("mjData"),
    *("time", "ncon", "nefc", "ne", "nf", "nisland"),
    *("contact", "geom_xpos", "geom_xmat"),
    *("qvel", "qacc", "qacc_warmstart", "qfrc_bias", "xpos", "xmat", "crb", "cvel", "subtree_com"),
    *("efc_J", "efc_J_rownnz", "efc_J_rowadr", "efc_J_colind", "efc_KBIP", "efc_R", "efc_D"),
    *("efc_diagA", "efc_vel", "efc_aref", "efc_frictionloss"),
    *("efc_type", "map_efc2iefc", "iefc_R", "iefc_D", "M", "qDeriv", "qfrc_smooth", "qacc_smooth"),
)
MOST_POINTS = 50
"""Points that a collider finds of a pair at most; they begin with distance, place and normal."""
POINT = structure("mjPreContact" if "mjPreContact" in structs.STRUCTS else "mjContact").itemsize
HEIGHTFIELD, CYLINDER, BOX, MESH = (
    int(getattr(mujoco.mjtGeom, f"mjGEOM_{kind}")) for kind in ("HFIELD", "CYLINDER", "BOX", "MESH")
)


# -- addresses in compiled code --------------------------------------------------------------------


def array_at(item: Any) -> Any:
    """A compiled function: the array of a shape at an address, of a structured or numba type."""
    kind = numba.from_dtype(item) if isinstance(item, np.dtype) else item
    if isinstance(item, np.dtype):  # its own name has all fields, and is in those of all functions
        kind.name = f"Record{zlib.crc32(kind.name.encode())}"

    @intrinsic  # type: ignore[untyped-decorator]
    def array(context: Any, address: Any, shape: Any) -> Any:
        whole = types.Array(kind, getattr(shape, "count", 1), "C")

        def code(context: Any, builder: Any, call: Any, args: Any) -> Any:
            pointer = types.CPointer(kind)
            first = builder.inttoptr(args[0], context.get_value_type(pointer))
            view = whole(pointer, call.args[1])
            return np_cfarray(context, builder, view, (first, args[1]))

        return whole(types.int64, shape), code

    return array


models, datas, engine_contacts = array_at(MJ_MODEL), array_at(MJ_DATA), array_at(MJ_CONTACT)
reals, singles = array_at(types.float64), array_at(types.float32)
integers, words = array_at(types.int32), array_at(types.int64)


# -- functions -------------------------------------------------------------------------------------


def _library() -> Any:
    folder = Path(mujoco.__file__).parent
    names = [path for path in folder.iterdir() if path.name.startswith("libmujoco.")]
    return ctypes.CDLL(str(min([*names, *folder.glob("mujoco.dll")])))


LIBRARY = _library()


def _function(name: str, returns: Any = types.void, arguments: int = 2) -> Any:
    address = ctypes.cast(getattr(LIBRARY, name), ctypes.c_void_p).value
    return c_function(name, address or 0, returns, *[types.intp] * arguments)


def _collider(name: str, one: int, other: int) -> Any:
    """What finds the points of two kinds of geoms, within a margin."""
    kinds = int(mujoco.mjtGeom.mjNGEOMTYPES)
    address = (ctypes.c_void_p * kinds * kinds).in_dll(LIBRARY, "mjCOLLISIONFUNC")[one][other]
    arguments = *[types.intp] * 3, types.int32, types.int32, types.float64
    return c_function(name, address or 0, types.int32, *arguments)


mj_step = _function("mj_step")
mj_fwdActuation, mj_fwdAcceleration = _function("mj_fwdActuation"), _function("mj_fwdAcceleration")
mj_fwdConstraint, mj_fwdVelocity = _function("mj_fwdConstraint"), _function("mj_fwdVelocity")
mj_makeConstraint, mj_island = _function("mj_makeConstraint"), _function("mj_island")
mj_projectConstraint, mj_factorM = _function("mj_projectConstraint"), _function("mj_factorM")
mj_isSparse = _function("mj_isSparse", types.int32, 1)
mj_addContact = _function("mj_addContact", types.int32, 3)
mjd_smooth_vel = _function("mjd_smooth_vel", arguments=3)
mjc_Convex = _collider("mjc_Convex", CYLINDER, BOX)


# -- does it lie in memory as it is said? ----------------------------------------------------------


def _at(address: int, kind: np.dtype[Any]) -> Any:
    """A structure at an address."""
    memory: Any = (ctypes.c_char * kind.itemsize).from_address(address)
    return np.frombuffer(memory, kind)[0]


def _differs(there: Any, owner: Any) -> bool:
    """Whether any number of a structure, or address of an array, isn't what an object of MuJoCo has
    by the same name."""
    for name in there.dtype.names:
        value, found = getattr(owner, name, None), there[name]
        if isinstance(found, np.void):
            if _differs(found, value):
                return True
        elif isinstance(value, np.ndarray) and found.ndim == 0:
            if found != value.ctypes.data:
                return True
        elif isinstance(value, (int, float, np.ndarray)) and not np.array_equal(found, value):
            return True
    return False


def _check() -> bool:
    """Raise `ImportError` unless a small model lies in memory as `mujoco.introspect` says; whether
    the margins of two geoms add up there."""
    model = mujoco.MjModel.from_xml_string(
        '<mujoco><option timestep="0.0078125" gravity="0 0 -7"/>'
        '<asset><hfield name="hill" nrow="2" ncol="3" size="1 1 1 1"/></asset>'
        '<worldbody><geom type="hfield" hfield="hill" pos="9 9 0"/>'
        '<geom type="plane" size="1 1 1" margin=".01"/><body pos="0 0 .09"><freejoint/>'
        '<geom size=".1" margin=".01" condim="4" friction=".7 .03 .01"/></body>'
        "</worldbody></mujoco>"
    )
    data = mujoco.MjData(model)
    data.time = 3.0
    mujoco.mj_forward(model, data)
    first = data.contact.dist.ctypes.data  # dist is the first field
    if (
        _differs(_at(model._address, MJ_MODEL), model)
        or _differs(_at(data._address, MJ_DATA), data)
        or _differs(_at(first, MJ_CONTACT), data.contact[0])
    ):
        version = mujoco.__version__
        raise ImportError(f"MuJoCo {version} doesn't lie in memory as its mujoco.introspect says")
    return bool(data.contact.includemargin[0] > 0.015)


MARGINS_ADD_UP = _check()
"""Whether a pair of geoms has the sum of their margins, as since MuJoCo 4, or the larger one."""
