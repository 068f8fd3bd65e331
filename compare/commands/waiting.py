"""Nothing runs for long without a word: a line on standard error for a command that shows no
progress of its own."""

from __future__ import annotations

import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

SOON, LATER = 3.0, 10.0
"""Seconds after which a command says that it is at work: on a terminal, and elsewhere."""


@contextmanager
def told(what: str) -> Iterator[Callable[[float], None]]:
    """A context that says what goes on once it takes long; yields a function to be called with the
    fraction done, by those that know it."""
    ended, done = threading.Event(), 0.0

    def tell(fraction: float) -> None:
        nonlocal done
        done = fraction

    def watch() -> None:
        if ended.wait(SOON if sys.stderr.isatty() else LATER):
            return
        from compare.kit import progress  # here, because most commands are done before

        with progress.reporter() as show:
            while not ended.wait(0.2):
                show(what, round(1000 * done), 1000, 0)

    thread = threading.Thread(target=watch, daemon=True)
    thread.start()
    try:
        yield tell
    finally:
        ended.set()
        thread.join()
