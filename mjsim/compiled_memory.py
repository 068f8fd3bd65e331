"""`mjsim.memory.recall` and `retain` as loops over contacts, compiled with numba, which the extra `fast` installs.

A step at rest takes some 40 µs, and to hand over ten arrays of `MjData` some 5. So the loops read them in the engine's
own memory, where `mujoco.introspect` says that they are.
"""

from __future__ import annotations

import ctypes
import math
from typing import Any

import mujoco
import numba
import numpy as np
from mujoco.introspect import ast_nodes, structs
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

from mjsim import memory
from model.arrays import Array

_KEPT, _INSIDE, _CALM, _WIDTH = memory.KEPT, memory.INSIDE, memory.CALM, memory.WIDTH
_UNMOVED = 1e-6
"""Distance below which a contact is the one of the same number in the last step, m."""
compiled = numba.njit(cache=True, nogil=True, error_model="numpy", fastmath={"reassoc", "contract"})


def _layout(struct: str) -> type[ctypes.Structure]:
    """A structure of MuJoCo as ctypes knows it."""
    scalars = {"int": ctypes.c_int, "mjtNum": ctypes.c_double, "mjtBool": ctypes.c_bool} | dict.fromkeys(
        ("mjtSize", "size_t", "uintptr_t", "uint64_t"), ctypes.c_uint64
    )

    def kind(declared: Any) -> Any:
        if isinstance(declared, ast_nodes.PointerType):
            return ctypes.c_void_p
        if isinstance(declared, ast_nodes.ArrayType):
            return kind(declared.inner_type) * math.prod(declared.extents)
        return scalars.get(declared.name) or _layout(declared.name)

    fields = [(field.name, kind(field.type)) for field in structs.STRUCTS[struct].fields]
    return type(struct, (ctypes.Structure,), {"_fields_": fields})


_data, _contact = _layout("mjData"), _layout("mjContact")
_FIELDS = (
    "ncon", "geom_xpos", "geom_xmat", "contact", "efc_KBIP", "efc_R", "efc_aref", "efc_force", "qacc", "efc_J",
    "efc_J_rownnz", "efc_J_rowadr", "efc_J_colind", "qacc_warmstart",
)  # fmt: skip
_NCON, _XPOS, _XMAT, _CONTACT, _KBIP, _R, _AREF, _FORCE, _QACC, _J, _ROWNNZ, _ROWADR, _COLIND, _START = range(14)
_SIZE, _DIST, _POS, _FRAME, _FRICTION, _DIM, _GEOM, _ADDRESS = range(14, 22)
_AT = np.array(
    [getattr(_data, name).offset for name in _FIELDS]
    + [ctypes.sizeof(_contact)]
    + [getattr(_contact, name).offset for name in ("dist", "pos", "frame", "friction", "dim", "geom", "efc_address")]
)
"""Bytes from the beginning of `mjData`, the size of a contact, and bytes from its beginning."""
_empty = mujoco.MjData(mujoco.MjModel.from_xml_string("<mujoco/>"))
if _data.from_address(_empty._address).signature != _empty.signature:  # what `mjData` ends with
    raise ImportError("MuJoCo's structures are not laid out as mujoco.introspect says: formulas on arrays must serve")


@intrinsic  # type: ignore[untyped-decorator]
def _pointer(typing: Any, address: Any) -> Any:
    """The address as a pointer."""
    return types.voidptr(types.intp), lambda context, builder, call, args: builder.inttoptr(args[0], cgutils.voidptr_t)


@compiled  # type: ignore[untyped-decorator]
def _whole(address: int) -> Any:
    return numba.carray(_pointer(address), 1 << 40, np.int32)


@compiled  # type: ignore[untyped-decorator]
def _real(address: int) -> Any:
    return numba.carray(_pointer(address), 1 << 40, np.float64)


@compiled  # type: ignore[untyped-decorator]
def _array(data: int, offset: int) -> int:
    """Address of an array of `mjData`."""
    return int(numba.carray(_pointer(data + offset), 1, np.int64)[0])


@compiled  # type: ignore[untyped-decorator]
def _apart(one: Array, other: Array) -> float:
    """Square of the distance of two contacts, by their places on both bodies, m^2; of other geoms: infinite."""
    if one[0] != other[0] or one[1] != other[1]:
        return math.inf
    square = 0.0
    for j in range(2, 8):
        square += (one[j] - other[j]) ** 2
    return square


@compiled  # type: ignore[untyped-decorator]
def _recall(data: int, at: Array, before: Array, elliptic: bool, scattered: bool) -> tuple[Array, Array, float]:
    xpos, xmat, contact = _real(_array(data, at[_XPOS])), _real(_array(data, at[_XMAT])), _array(data, at[_CONTACT])
    damping, softness = _real(_array(data, at[_KBIP])), _real(_array(data, at[_R]))
    reference, ncon = _real(_array(data, at[_AREF])), _whole(data + at[_NCON])[0]
    kept, used, count = np.zeros((ncon, _WIDTH)), np.empty(ncon, np.intp), 0
    for i in range(ncon):
        c = contact + i * at[_SIZE]
        geom, dim, address = _whole(c + at[_GEOM]), _whole(c + at[_DIM])[0], _whole(c + at[_ADDRESS])[0]
        if address < 0 or dim == 1 or geom[0] < 0 or geom[1] < 0 or damping[4 * (address + 1) + 1] <= 0:
            continue
        used[count], kept[count, 28] = i, _real(c + at[_DIST])[0]
        pos, frame = _real(c + at[_POS]), _real(c + at[_FRAME])
        for side in range(2):
            g = geom[side]
            kept[count, side] = g
            x, y, z = pos[0] - xpos[3 * g], pos[1] - xpos[3 * g + 1], pos[2] - xpos[3 * g + 2]
            for axis in range(3):
                m = 9 * g + axis
                kept[count, 2 + 3 * side + axis] = xmat[m] * x + xmat[m + 3] * y + xmat[m + 6] * z
                if side == 0:
                    kept[count, 25 + axis] = xmat[m] * frame[0] + xmat[m + 3] * frame[1] + xmat[m + 6] * frame[2]
        count += 1
    kept, used = kept[:count], used[:count]

    force, pairs = np.zeros((count, 5)), np.zeros((count, 5))
    world, first, moved, heir, fewer = np.empty((3, 2)), 0, 0.0, np.zeros(count, np.bool_), False
    for m in range(len(before)):
        nearest, least, begin = -1, math.inf, first
        if m < count and _apart(kept[m], before[m]) < _UNMOVED**2:
            nearest, least = m, 0.0
        for turn in range(0 if nearest == m else count):  # contacts of a pair are together, mostly where they were
            k = begin + turn
            if k >= count:
                k -= count
            distance = _apart(kept[k], before[m])
            if distance < math.inf:
                if nearest < 0:
                    first = k
                if distance < least:
                    nearest, least = k, distance
            elif nearest >= 0 and not scattered:
                break
        if nearest < 0:
            continue
        moved, fewer, heir[nearest] = max(moved, least), fewer or heir[nearest], True
        c = contact + used[nearest] * at[_SIZE]
        frame, kinds = _real(c + at[_FRAME]), 1 if _whole(c + at[_DIM])[0] == 3 else 2
        world[:] = 0.0
        for side in range(2):
            g = int(kept[nearest, side])
            for j in range(3):
                for axis in range(3):
                    turned = xmat[9 * g + 3 * j + axis] / 2
                    for kind in range(kinds):
                        world[j, kind] += turned * before[m, 8 + 6 * side + 2 * axis + kind]
        for j in range(3):
            force[nearest, 0] += frame[3 + j] * world[j, 0]
            force[nearest, 1] += frame[6 + j] * world[j, 0]
            for row in range(3 * kinds - 3):
                force[nearest, 2 + row] += frame[3 * row + j] * world[j, 1]
        for j in range(5):
            pairs[nearest, j] += before[m, 20 + j]

    for k in range(count):
        c, mean = contact + used[k] * at[_SIZE], 0.0
        a, rows, mu = _whole(c + at[_ADDRESS])[0], _whole(c + at[_DIM])[0] - 1, _real(c + at[_FRICTION])
        for j in range(rows):
            if elliptic:
                reference[a + 1 + j] += softness[a + 1 + j] * force[k, j]
            else:
                force[k, j] /= mu[j]
                pairs[k, j] = max(pairs[k, j], abs(force[k, j]))
                mean += pairs[k, j] / rows
        for j in range(0 if elliptic else rows):
            level = pairs[k, j] - mean
            reference[a + 2 * j] += softness[a + 2 * j] * (level + force[k, j]) / 2
            reference[a + 2 * j + 1] += softness[a + 2 * j + 1] * (level - force[k, j]) / 2
    return kept, used, math.sqrt(moved / 2) if fewer else 0.0


@compiled  # type: ignore[untyped-decorator]
def _retain(data: int, at: Array, kept: Array, used: Array, elliptic: bool, nv: int, sparse: bool) -> None:
    xmat, contact = _real(_array(data, at[_XMAT])), _array(data, at[_CONTACT])
    softness, reference = _real(_array(data, at[_R])), _real(_array(data, at[_AREF]))
    forces, qacc, jacobian = (
        _real(_array(data, at[_FORCE])),
        _real(_array(data, at[_QACC])),
        _real(_array(data, at[_J])),
    )
    column, begin = _whole(_array(data, at[_COLIND])), _whole(_array(data, at[_ROWADR]))
    length = _whole(_array(data, at[_ROWNNZ]))
    world, force, held = np.empty((3, 2)), np.empty(5), np.empty(10)
    for k in range(len(kept)):
        c = contact + used[k] * at[_SIZE]
        a, dim, geom = _whole(c + at[_ADDRESS])[0], _whole(c + at[_DIM])[0], _whole(c + at[_GEOM])
        mu, frame = _real(c + at[_FRICTION]), _real(c + at[_FRAME])
        rows, first, load, lean = 2 * (dim - 1), a, 0.0, 0.0
        force[:] = 0.0
        if elliptic:
            rows, first, load = dim - 1, a + 1, forces[a]
            for j in range(rows):
                force[j] = forces[first + j]
                lean += (force[j] / mu[j]) ** 2
        else:
            for j in range(dim - 1):
                plus, minus = forces[a + 2 * j], forces[a + 2 * j + 1]
                load += plus + minus
                force[j] = mu[j] * (plus - minus)
        asked, sticks = 0.0, elliptic and lean < (_INSIDE * load) ** 2  # a row that isn't limited has what it asks for
        for j in range(rows if load > 0 and not sticks else 0):
            r = first + j
            held[j] = forces[r]
            if elliptic or held[j] == 0:
                total = 0.0
                if sparse:
                    for n in range(begin[r], begin[r] + length[r]):
                        total += jacobian[n] * qacc[column[n]]
                else:
                    for n in range(nv):
                        total += jacobian[r * nv + n] * qacc[n]
                held[j] = (reference[r] - total) / softness[r]
            if elliptic:
                asked += (held[j] / mu[j]) ** 2
            elif j % 2:
                asked += abs(held[j - 1] - held[j])
        asked = math.sqrt(asked) if elliptic else asked
        share = min(max(2 - asked / max(_KEPT * load, 1e-300), 0.0), 1.0)
        for j in range(3):
            world[j, 0] = share * (frame[3 + j] * force[0] + frame[6 + j] * force[1])
            world[j, 1] = share * (frame[j] * force[2] + frame[3 + j] * force[3] + frame[6 + j] * force[4])
        for side in range(2):
            for axis in range(3):
                for kind in range(1 if dim == 3 else 2):
                    m = 9 * geom[side] + axis
                    kept[k, 8 + 6 * side + 2 * axis + kind] = (
                        xmat[m] * world[0, kind] + xmat[m + 3] * world[1, kind] + xmat[m + 6] * world[2, kind]
                    )
        for j in range(0 if elliptic else dim - 1):
            kept[k, 20 + j] = share * (forces[a + 2 * j] + forces[a + 2 * j + 1])
    start = _real(_array(data, at[_START]))
    for n in range(nv):
        start[n] = start[n] if abs(start[n]) >= _CALM else 0.0


def recall(model: Any, data: Any, before: Array, elliptic: bool, scattered: bool) -> tuple[Array, Array, float]:
    """As `mjsim.memory.recall`."""
    return _recall(data._address, _AT, before, elliptic, scattered)  # type: ignore[no-any-return]


def retain(model: Any, data: Any, kept: Array, used: Array, elliptic: bool) -> None:
    """As `mjsim.memory.retain`."""
    _retain(data._address, _AT, kept, used, elliptic, model.nv, mujoco.mj_isSparse(model))
