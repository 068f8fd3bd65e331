"""Whether numba compiles now, here or in a worker: nobody should wait a minute without a word."""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING, Any
from weakref import WeakSet

if TYPE_CHECKING:
    from multiprocessing.connection import Connection

SOON = 3.0  #: seconds after which whatever is at work says so
OFTEN = 0.1  #: seconds between two looks at whether it still is
FORGOTTEN = 1.0  #: seconds after which a worker that said it compiles no longer does
KEPT = "compiling, up to a minute, once on this machine"
NOT_KEPT = "compiling, each time: no place to keep it; NUMBA_CACHE_DIR can name one"
workers: WeakSet[Connection] = WeakSet()  #: the ends of pipes at which workers are heard


@contextmanager
def watched(watch: Callable[[threading.Event], None]) -> Iterator[None]:
    """A context beside which a thread watches, until the event that it is given is set."""
    ended = threading.Event()
    thread = threading.Thread(target=watch, args=[ended], daemon=True)
    thread.start()
    try:
        yield
    finally:
        ended.set()
        thread.join()


class _Heard:
    """What is known of compiling."""

    def __init__(self) -> None:
        self.times = -1
        """How often compiling has begun; -1 before numba is there."""
        self.here: list[str] = []
        """In words, what has begun in this process and not ended, the outermost first."""
        self.elsewhere, self.at = "", -FORGOTTEN
        """The last word of a worker, and when it came, s."""
        self.lock = threading.Lock()


_heard = _Heard()


def listen() -> int:
    """Listen in this process as soon as numba is there, which isn't loaded for that; return how
    often compiling has begun, -1 before."""
    dispatcher = sys.modules.get("numba.core.dispatcher")
    if _heard.times < 0 and hasattr(dispatcher, "Dispatcher"):
        event, caching = (sys.modules[f"numba.core.{name}"] for name in ("event", "caching"))

        class Listener(event.Listener):  # type: ignore[misc, name-defined]
            def on_start(self, event: Any) -> None:
                kept = not isinstance(event.data["dispatcher"]._cache, caching.NullCache)
                _heard.here.append(KEPT if kept else NOT_KEPT)
                _heard.times += 1

            def on_end(self, event: Any) -> None:
                del _heard.here[-1:]

        event.register("numba:compile", Listener())
        _heard.times = 0
    return _heard.times


def here() -> str:
    """What is said of compiling while it goes on in this process, else nothing."""
    return next(iter(_heard.here), "")


def now() -> str:
    """What is said of compiling while it goes on, else nothing."""
    listen()
    with _heard.lock:
        for pipe in tuple(workers):
            while pipe.poll():
                _heard.elsewhere, _heard.at = pipe.recv(), time.monotonic()
        fresh = 0 <= time.monotonic() - _heard.at < FORGOTTEN
    return here() or (_heard.elsewhere if fresh else "")


def tell(parent: Connection) -> None:
    """In a worker: tell its parent of compiling from now on, as long as it goes on."""

    def watch() -> None:
        with suppress(OSError):  # the parent is gone
            while True:
                if said := now():
                    parent.send(said)
                time.sleep(OFTEN)

    threading.Thread(target=watch, daemon=True).start()
