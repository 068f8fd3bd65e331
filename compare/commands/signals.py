"""Ctrl-C, and SIGTERM as clusters send it: both end a command with one line, and what is done is kept."""

from __future__ import annotations

import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from types import FrameType
from typing import NoReturn

from model.files import leave

_BOTH = (signal.SIGINT, signal.SIGTERM)


class Interrupted(KeyboardInterrupt):
    """A signal, with the exit code that it asks for."""

    def __init__(self, number: int) -> None:
        super().__init__()
        self.code = 128 + number


@contextmanager
def answered(answer: Callable[[int], None]) -> Iterator[Callable[[], None]]:
    """The first signal calls a function with its number, the next ones do what they did before.

    Yields how to listen again. Signals that are ignored stay so, as in what a shell runs in the background; and all in
    a thread, which gets none.
    """
    here = _BOTH if threading.current_thread() is threading.main_thread() else ()
    before = {each: handler for each in here if (handler := signal.getsignal(each)) is not signal.SIG_IGN}

    def restore() -> None:
        for each, handler in before.items():
            signal.signal(each, handler)

    def press(number: int, frame: FrameType | None) -> None:
        restore()
        answer(number)

    def listen() -> None:
        for each in before:
            signal.signal(each, press)

    listen()
    try:
        yield listen
    finally:
        restore()


@contextmanager
def raised() -> Iterator[None]:
    """The first signal raises `Interrupted`, also where another error is made of it, as by an import that it ends.

    Python loses what is raised in its callbacks, as when an import or an object ends: then it is raised again.
    """
    heard, usual = list[int](), sys.unraisablehook

    def interrupt(number: int) -> NoReturn:
        heard.append(number)
        raise Interrupted(number)

    def lost(what: sys.UnraisableHookArgs) -> None:
        if not isinstance(what.exc_value, Interrupted):
            usual(what)
            return
        listen()
        again = threading.Timer(0.01, os.kill, (os.getpid(), heard[-1]))
        again.daemon = True
        again.start()

    try:
        with answered(interrupt) as listen:
            sys.unraisablehook = lost
            yield
    except Exception as error:
        if heard:
            raise Interrupted(heard[0]) from error
        raise
    finally:
        sys.unraisablehook = usual


def end(number: int) -> NoReturn:
    """End the process at once."""
    with suppress(OSError):  # standard error may be closed
        os.write(2, b"dualball: interrupted\n")
    leave(128 + number)
