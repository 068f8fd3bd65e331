"""How the law reaches a simulation: MuJoCo's control callback, which every step has.

The law stands between MuJoCo's velocities and its solver, where `mj_step` calls `mjcb_control`. All
ways to step set it and call MuJoCo's own functions, so that errors and callbacks in Python end as
they always do. A callback that was there before is called first.
"""

from __future__ import annotations

import ctypes
import functools
import threading
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from .compiling import address_of, c_address, call, entry, kernel
from .engine import LIBRARY, array_at, datas, models, words
from .memory import Simulation, memories
from .rigid import take_dampers_away
from .step import conclude, keep_forces, law_of_a_step, store

_SLOT = ctypes.c_void_p.in_dll(LIBRARY, "mjcb_control")

TABLE = np.dtype(
    [
        ("previous", np.int64),  # the callback that was there before, by its address
        ("ask", np.int64),  # the function of Python that is told of simulations unknown here
        ("models", np.int64),  # how many models are installed
        ("model_at", np.int64),
        ("simulations", np.int64),  # how many are known, by the address of their mjData
        ("known_at", np.int64),  # where these addresses are, and then those of their memories
    ],
    align=True,
)
"""What the callback looks up. It is never changed, but for `previous`: another one takes its
place."""

table = np.zeros(1, np.int64)
"""The address of the `TABLE` in force."""

_table, _tables = address_of(f"{__package__}.table", table), array_at(TABLE)


@kernel
def memory_of(m: int, d: int) -> int:
    """Address of the memory of a simulation; 0 if it is not under the law."""
    table = _tables(words(_table(), 1)[0], 1)[0]
    known = words(table.known_at, (2, table.simulations))
    place = np.searchsorted(known[0], d)
    if place < table.simulations and known[0, place] == d:
        found = known[1, place]
        if memories(found, 1)[0].model == m:
            return int(found)
    for model in words(table.model_at, table.models):
        if model == m:
            return int(call(table.ask, m, d))
    return 0


@entry
def serve(m: int, d: int) -> None:
    """The callback: apply the law to simulations under it, after what another callback does."""
    previous = _tables(words(_table(), 1)[0], 1)[0].previous
    if previous:
        call(previous, m, d)
    memory = memory_of(m, d)
    if memory and memories(memory, 1)[0].active:
        law_of_a_step(memory)


@entry
def finish(at: int, storing: bool) -> None:
    """Find the forces of the last step, before anybody changes accelerations in mjData.

    If they are for `storing`, put them where a state has them.
    """
    memory = memories(at, 1)[0]
    model, data = models(memory.model, 1)[0], datas(memory.data, 1)[0]
    conclude(model, data, memory)
    take_dampers_away(model, data, memory)
    if storing and not memory.stored:  # what goes on from here does as what is restored
        keep_forces(memory)
        store(model, data, memory)
        memory.stored, memory.ncon = 1, -1


class Callback:
    """Who is under the law: one for the process."""

    def __init__(self) -> None:
        self._lock = threading.RLock()
        self._before: int | None = None  # the callback that was there, by its address
        # by model: how many users it has, whether they are rigid, and its own options
        self._users: dict[int, tuple[int, bool, dict[str, Any]]] = {}
        self._simulations: dict[int, Simulation] = {}
        self._installed: dict[int, Callable[[int], Simulation]] = {}
        self._ask = ctypes.CFUNCTYPE(ctypes.c_int64, ctypes.c_int64, ctypes.c_int64)(self._adopt)
        self._in_force: list[Any] = []
        self._tables = 0
        self._publish()

    def _publish(self) -> None:
        """Put a table of all simulations and models in the place of the one in force.

        Threads may still be reading that one, so the last few are kept. Data may be found to be
        garbage on the way: then a later table is in force already.
        """
        self._tables += 1
        number, simulations = self._tables, dict(self._simulations)
        models = np.array([*self._installed], np.int64)
        addresses = sorted((data, each.address) for data, each in simulations.items())
        known = np.array(addresses, np.int64).reshape(-1, 2).T.copy()
        new: Any = np.zeros(1, TABLE)
        new["previous"] = self._before or 0
        new["ask"] = ctypes.cast(self._ask, ctypes.c_void_p).value
        new["models"], new["model_at"] = len(models), models.ctypes.data
        new["simulations"], new["known_at"] = len(addresses), known.ctypes.data
        kept, address = [*self._in_force[-7:], (new, models, known)], new.ctypes.data
        if number == self._tables:
            self._in_force, table[0] = kept, address

    def _adopt(self, model: int, data: int) -> int:
        """The memory of a simulation that is new to the callback."""
        with self._lock:
            if model not in self._installed:
                return 0
            simulation = self._installed[model](data)
            self.know(data, simulation)
            return simulation.address

    def know(self, data: int, simulation: Simulation) -> None:
        """Tell the callback of a simulation, by the address of its data.

        Raises
        ------
        ValueError
            If another law acts on them just now.
        """
        known = self._simulations.get(data)
        if known is simulation:
            return
        if known and known.active[0]:
            raise ValueError("these data are under the law of another Coulomb, by installed()")
        with self._lock:
            self._simulations[data] = simulation
            self._publish()

    def remove(self, data: int, simulation: Simulation | None) -> None:
        """Forget a simulation."""
        with self._lock:
            if simulation and self._simulations.get(data) is simulation:
                del self._simulations[data]
                self._publish()

    def install(
        self, model: int, adopt: Callable[[int], Simulation], simulations: Mapping[int, Simulation]
    ) -> None:
        """Have all simulations of a model under one law: these, and new ones that `adopt` makes."""
        with self._lock:
            for data, simulation in dict(self._simulations).items():
                if simulation.record["model"][0] == model:
                    self._simulations.pop(data, None)
            self._simulations.update(simulations)
            self._installed[model] = adopt
            self._publish()

    def uninstall(self, model: int) -> bool:
        """Let new simulations of a model be; whether the callback was in force until now."""
        with self._lock:
            del self._installed[model]
            self._publish()
            return bool(_SLOT.value == _served())

    def set(self, model: Any, rigid: bool, wanted: Callable[[], Mapping[str, Any]]) -> None:
        """Set MuJoCo's callback, unless it is set; the first user of a model sets its options.

        Raises
        ------
        ValueError
            If a law of the other kind, soft or rigid, acts on the model just now.
        """
        with self._lock:
            option = model.opt
            users, as_rigid, options = self._users.get(model._address) or (0, rigid, {})
            if as_rigid != rigid:
                kinds = "rigid and soft Coulombs need different options"
                raise ValueError(f"{kinds}: one at a time for a model")
            if not users:
                for name, value in wanted().items():
                    options[name] = getattr(option, name)
                    setattr(option, name, value)
            self._users[model._address] = users + 1, rigid, options
            before = _SLOT.value
            if before != _served():
                if before != self._before:
                    self._before = before
                    self._publish()
                _SLOT.value = _served()

    def unset(self, model: Any) -> None:
        """Put back options after their last user, and the callback, unless another one was set."""
        with self._lock:
            users, rigid, options = self._users.pop(model._address)
            if users > 1:
                self._users[model._address] = users - 1, rigid, options
            else:
                option = model.opt
                for name, value in options.items():
                    setattr(option, name, value)
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
