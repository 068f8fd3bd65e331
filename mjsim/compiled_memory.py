"""`mjsim.memory.recall` and `retain` as loops over contacts, compiled with numba, which the extra `fast` installs."""

from __future__ import annotations

import math

import numba
import numpy as np
import numpy.typing as npt

from mjsim import memory
from model.arrays import Array

_KEPT = memory.KEPT
compiled = numba.njit(cache=True, nogil=True, error_model="numpy", fastmath={"reassoc", "contract"})


@compiled  # type: ignore[untyped-decorator]
def recall(
    kept: tuple[Array, Array, Array], geom: Array, pos: Array, frame: Array, dim: Array, address: Array,
    friction: Array, xpos: Array, xmat: Array, damping: Array, softness: Array, reference: Array, elliptic: bool,
) -> tuple[npt.NDArray[np.intp], Array]:  # fmt: skip
    """As `mjsim.memory.recall`."""
    used, count = np.empty(len(dim), np.intp), 0
    for i in range(len(dim)):
        if address[i] >= 0 and dim[i] > 1 and geom[i, 0] >= 0 and geom[i, 1] >= 0 and damping[address[i] + 1, 1] > 0:
            used[count] = i
            count += 1
    used = used[:count]
    place = np.empty((count, 8))
    for k in range(count):
        i = used[k]
        for side in range(2):
            g = geom[i, side]
            place[k, side] = g
            for axis in range(3):
                total = 0.0
                for j in range(3):
                    total += xmat[g, 3 * j + axis] * (pos[i, j] - xpos[g, j])
                place[k, 2 + 3 * side + axis] = total

    force, load = np.zeros((count, 5)), np.zeros(count)
    world, first, begin = np.empty((3, 2)), 0, 0
    before, forces, loads = kept
    for m in range(len(before)):
        nearest, least, begin = -1, math.inf, first
        for turn in range(count):  # contacts of a pair are together, mostly where they were
            k = (begin + turn) % count
            if place[k, 0] == before[m, 0] and place[k, 1] == before[m, 1]:
                if nearest < 0:
                    first = k
                distance = 0.0
                for j in range(2, 8):
                    distance += (place[k, j] - before[m, j]) ** 2
                if distance < least:
                    nearest, least = k, distance
            elif nearest >= 0:
                break
        if nearest < 0:
            continue
        i = used[nearest]
        kinds = 1 if dim[i] == 3 else 2
        for j in range(3):
            for kind in range(kinds):
                world[j, kind] = 0.0
                for side in range(2):
                    for axis in range(3):
                        world[j, kind] += xmat[geom[i, side], 3 * j + axis] * forces[m, side, axis, kind] / 2
        for j in range(3):
            force[nearest, 0] += frame[i, 3 + j] * world[j, 0]
            force[nearest, 1] += frame[i, 6 + j] * world[j, 0]
            for row in range(3 * kinds - 3):
                force[nearest, 2 + row] += frame[i, 3 * row + j] * world[j, 1]
        load[nearest] += loads[m]

    needed = np.empty(5)
    for k in range(count):
        a, rows, mu = address[used[k]], dim[used[k]] - 1, friction[used[k]]
        if elliptic:
            for j in range(rows):
                reference[a + 1 + j] += softness[a + 1 + j] * force[k, j]
            continue
        total = 0.0
        for j in range(rows):
            needed[j] = abs(force[k, j]) / mu[j]
            total += needed[j]
        scale = min(1.0, load[k] / max(total, 1e-300))
        rest, level = load[k], load[k] / rows
        for j in range(rows - 1):  # the largest first
            for other in range(j + 1, rows):
                if needed[other] > needed[j]:
                    needed[j], needed[other] = needed[other], needed[j]
            rest -= scale * needed[j]
            level = min(level, rest / (rows - 1 - j))
        for j in range(rows):
            lean, mean = scale * force[k, j] / mu[j], load[k] / (2 * rows)
            pair = max(abs(lean), level)
            reference[a + 2 * j] += softness[a + 2 * j] * ((pair + lean) / 2 - mean)
            reference[a + 2 * j + 1] += softness[a + 2 * j + 1] * ((pair - lean) / 2 - mean)
    return used, place


@compiled  # type: ignore[untyped-decorator]
def retain(
    used: npt.NDArray[np.intp], geom: Array, frame: Array, dim: Array, address: Array, friction: Array, xmat: Array,
    softness: Array, reference: Array, acceleration: Array, forces: Array, elliptic: bool,
) -> tuple[Array, Array]:  # fmt: skip
    """As `mjsim.memory.retain`."""
    result, load, force, world = np.zeros((len(used), 2, 3, 2)), np.zeros(len(used)), np.empty(5), np.empty((3, 2))
    for k in range(len(used)):
        i = used[k]
        a, mu, asked = address[i], friction[i], 0.0
        force[:] = 0.0
        for j in range(dim[i] - 1):
            if elliptic:
                r = a + 1 + j
                force[j] = forces[r]
                asked += ((reference[r] - acceleration[r]) / softness[r] / mu[j]) ** 2
            else:
                r = a + 2 * j
                load[k] += forces[r] + forces[r + 1]
                force[j] = mu[j] * (forces[r] - forces[r + 1])
                asked += abs(
                    (reference[r] - acceleration[r]) / softness[r]
                    - (reference[r + 1] - acceleration[r + 1]) / softness[r + 1]
                )
        if elliptic:
            load[k], asked = forces[a], math.sqrt(asked)
        kinds = 1 if dim[i] == 3 else 2
        share = min(max(2 - asked / max(_KEPT * load[k], 1e-300), 0.0), 1.0)
        for j in range(3):
            world[j, 0] = share * (frame[i, 3 + j] * force[0] + frame[i, 6 + j] * force[1])
            world[j, 1] = share * (frame[i, j] * force[2] + frame[i, 3 + j] * force[3] + frame[i, 6 + j] * force[4])
        for side in range(2):
            for axis in range(3):
                for kind in range(kinds):
                    total = 0.0
                    for j in range(3):
                        total += xmat[geom[i, side], 3 * j + axis] * world[j, kind]
                    result[k, side, axis, kind] = total
    return result, load
