"""How the law reaches a simulation: MuJoCo's control callback, which every step has.

The law stands between MuJoCo's velocities and its solver, where `mj_step` calls `mjcb_control`. All
doors set it and call MuJoCo's own functions, so that errors and callbacks in Python end as they
always do. A callback that was there before is called first.
"""

from __future__ import annotations

import ctypes
import functools
import threading
from collections.abc import Callable
from typing import Any

import numpy as np

from .compiling import c_address
from .engine import LIBRARY
from .memory import Simulation
from .step import TABLE, serve, table

_SLOT = ctypes.c_void_p.in_dll(LIBRARY, "mjcb_control")


class Callback:
    """Who is under the law: one for the process."""

    def __init__(self) -> None:
        self._lock, self._users = threading.RLock(), 0
        self._before: int | None = None  # the callback that was there, by its address
        self._simulations: dict[int, Simulation] = {}
        self._installed: dict[int, Callable[[int], Simulation]] = {}
        self._ask = ctypes.CFUNCTYPE(ctypes.c_int64, ctypes.c_int64, ctypes.c_int64)(self._adopt)
        self._in_force: list[Any] = []
        self._publish()

    def _publish(self) -> None:
        """Put a table of all simulations and models in the place of the one in force.

        Threads may still be reading that one, so the last few are kept.
        """
        known = sorted(self._simulations)
        arrays = [
            np.array(each, np.int64)
            for each in ([*self._installed], known, [self._simulations[k].address for k in known])
        ]
        new: Any = np.zeros(1, TABLE)
        new["ask"] = ctypes.cast(self._ask, ctypes.c_void_p).value
        new["models"], new["simulations"] = len(arrays[0]), len(known)
        for name, array in zip(("model_at", "data_at", "memory_at"), arrays, strict=True):
            new[name] = array.ctypes.data
        new["previous"] = self._before or 0
        self._in_force = [*self._in_force[-7:], (new, arrays)]
        table[0] = new.ctypes.data

    def _adopt(self, model: int, data: int) -> int:
        """The memory of a simulation that is new to the callback."""
        with self._lock:
            if model not in self._installed:
                return 0
            simulation = self._installed[model](data)
            self.know(data, simulation)
            return simulation.address

    def know(self, data: int, simulation: Simulation) -> None:
        """Tell the callback of a simulation, by the address of its data."""
        if self._simulations.get(data) is not simulation:
            with self._lock:
                self._simulations[data] = simulation
                self._publish()

    def remove(self, data: int) -> None:
        """Forget a simulation."""
        with self._lock:
            if self._simulations.pop(data, None):
                self._publish()

    def install(self, model: int, adopt: Callable[[int], Simulation] | None) -> None:
        """Let `adopt` make the memory of all simulations of a model that are new, by their data."""
        with self._lock:
            self._installed.pop(model, None)
            if adopt:
                self._installed[model] = adopt
            self._publish()

    def set(self) -> None:
        """Set MuJoCo's callback, if this is its first user."""
        with self._lock:
            if not self._users:
                before = _SLOT.value
                if before != self._before:
                    self._before = before
                    self._publish()
                _SLOT.value = _served()
            self._users += 1

    def unset(self) -> None:
        """Put the callback before back, if this is the last user, unless another one was set."""
        with self._lock:
            self._users -= 1
            if not self._users and _SLOT.value == _served():
                _SLOT.value = self._before

    def installed(self, model: int) -> bool:
        """Whether a model is installed."""
        return model in self._installed


@functools.cache
def _served() -> int:
    """The address of the compiled callback."""
    return c_address(serve)


CALLBACK = Callback()
