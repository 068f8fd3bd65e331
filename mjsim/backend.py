"""MuJoCo as the loop sees it: one simulation or a batch, and whether quantities are floats or arrays."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
import numpy.typing as npt
from mujoco.batch import MODEL_FIELDS, Batch

from model.arrays import Array


@dataclass(frozen=True)
class Form:
    """How quantities are written: as floats of one run, or as arrays with an entry for each run."""

    lean: Callable[[Array], Array]
    """The view of an array (n, runs) or (runs,) that `read` takes: for floats without the axis of the runs."""
    read: Callable[[Array], Any]
    """The rows of such a view as quantities, which stay as they are when the array changes."""
    some: Callable[[Any], Any]
    """Whether a condition holds in some run."""
    cos: Any
    sin: Any


FLOATS = Form(lambda rows: rows[..., 0], np.ndarray.tolist, bool, math.cos, math.sin)
ARRAYS = Form(lambda rows: rows, np.ndarray.copy, np.ndarray.any, np.cos, np.sin)


@dataclass(frozen=True)
class Backend:
    """The engine itself."""

    data: Any
    """The `mujoco.MjData` of one simulation; None for a batch."""
    array: Callable[[str], Array]
    """A field of the data or the model, as a view of shape (n, runs). In a batch it costs to have one of the model."""
    set_timestep: Callable[[Array], Any]
    """Give each run a time step, shape (runs,), s."""
    step_all: Callable[[], Any]
    """`mj_step` for all runs."""
    step: Callable[[npt.NDArray[np.intp]], Any]
    forward: Callable[[npt.NDArray[np.intp]], Any]
    """`mj_step` and `mj_forward` for the given runs."""


def single(model: Any) -> Backend:
    """One simulation."""
    data = mujoco.MjData(model)
    return Backend(
        data,
        lambda name: np.asarray(getattr(data if hasattr(data, name) else model, name)).reshape(-1, 1),
        lambda steps: setattr(model.opt, "timestep", steps.item()),
        functools.partial(mujoco.mj_step, model, data),
        lambda runs: mujoco.mj_step(model, data),
        lambda runs: mujoco.mj_forward(model, data),
    )


def batch(models: Sequence[Any]) -> Backend:
    """A batch, each simulation with its own value of every model field in which the models differ."""
    made = Batch(models[0], nsim=len(models), nthread=1)
    for name in MODEL_FIELDS:
        owner, _, field = name.rpartition(".")
        values = [np.asarray(getattr(getattr(model, owner) if owner else model, field)) for model in models]
        if len({value.tobytes() for value in values}) > 1:
            made.expand(name)[:] = np.stack(values)

    def array(name: str) -> Array:
        values: Array = made.expand(name) if name in MODEL_FIELDS else made.bind(name)
        values = values[:, 0] if name == "mocap_quat" else values  # there is one mocap body
        return values.reshape(len(models), -1).T

    def set_timestep(steps: Array) -> None:
        made.expand("opt.timestep")[:] = steps

    return Backend(None, array, set_timestep, made.step, made.step, made.forward)


@functools.cache
def compiled() -> Callable[..., bool] | None:
    """`mjsim.compiled.drive`, if numba is installed."""
    try:
        from mjsim.compiled import drive
    except ImportError:
        return None
    return drive  # type: ignore[no-any-return]
