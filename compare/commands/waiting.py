"""Nothing runs for long without a word: a line for commands without progress of their own."""

from __future__ import annotations

import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

SOON = 3.0
"""Seconds after which a command says that it is at work."""
OFTEN = 0.1
"""Seconds between two looks at how far it is."""


@contextmanager
def told(what: str) -> Iterator[Callable[[float], None]]:
    """A context that says what goes on once it takes long; yields a function to be called with the
    fraction done, by those that know it."""
    ended, done, compiles = threading.Event(), 0.0, _Compiling()

    def tell(fraction: float) -> None:
        nonlocal done
        done = max(done, fraction)

    def watch() -> None:
        for _ in range(round(SOON / OFTEN)):
            compiles.listen()
            if ended.wait(OFTEN):
                return
        from compare.kit import progress  # here, because most commands are done before

        with progress.reporter() as show:
            while not ended.wait(OFTEN):
                compiles.listen()
                if compiles.now:
                    show(f"{what}: compiling, {compiles.now}", 0, 0, 0)
                else:
                    show(what, round(1000 * done), 1000 if done else 0, 0)

    thread = threading.Thread(target=watch, daemon=True)
    thread.start()
    try:
        yield tell
    finally:
        ended.set()
        thread.join()
        compiles.end()


class _Compiling:
    """Whether numba compiles something now; it isn't loaded for that."""

    def __init__(self) -> None:
        self._events: Any = None
        self._heard: Any = None

    def listen(self) -> None:
        """Begin to listen if numba is there."""
        dispatcher = sys.modules.get("numba.core.dispatcher")
        if self._heard is None and hasattr(dispatcher, "Dispatcher"):
            self._events = sys.modules["numba.core.event"]
            self._heard = self._events.RecordingListener()
            self._events.register("numba:compile", self._heard)

    @property
    def now(self) -> str:
        """How often, if more has begun than ended."""
        begun = list[Any]()
        for _, event in tuple(self._heard.buffer) if self._heard else ():
            begun = [*begun, event] if event.is_start else begun[:-1]
        if not begun:
            return ""
        cache = begun[0].data["dispatcher"]._cache
        if isinstance(cache, sys.modules["numba.core.caching"].NullCache):
            return "each time: no place to keep it; NUMBA_CACHE_DIR can name one"
        return "once on this machine"

    def end(self) -> None:
        """Listen no more."""
        if self._heard is not None:
            self._events.unregister("numba:compile", self._heard)
