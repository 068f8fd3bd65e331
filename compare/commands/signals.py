"""What ends a program ends a command with one line; what is done is kept."""

from __future__ import annotations

import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from types import FrameType
from typing import NoReturn

from compare.campaign.stops import SIGNALS
from model.files import leave

_SEND_AGAIN = 2.0
"""Of what is to stop by itself, s."""
_WAITS = 200
"""How often a signal waits for an import, .01 s at a time: one may never end."""


class Interrupted(KeyboardInterrupt):
    """A signal, with the exit code that it asks for."""

    def __init__(self, number: int) -> None:
        super().__init__()
        self.code = 128 + number


@contextmanager
def on_first_signal(
    answer: Callable[[int, FrameType | None], object],
) -> Iterator[Callable[[], None]]:
    """A context in which the first signal calls `answer` with its number and frame; later ones act
    as they did before.

    Yields how to listen again. Signals that are ignored stay so, as in what a shell runs in the
    background; and all in a thread, which gets none."""
    here = SIGNALS if threading.current_thread() is threading.main_thread() else ()
    before = {
        each: handler for each in here if (handler := signal.getsignal(each)) is not signal.SIG_IGN
    }

    def restore() -> None:
        for each, handler in before.items():
            signal.signal(each, handler)

    def on_signal(number: int, frame: FrameType | None) -> None:
        restore()
        answer(number, frame)

    def listen() -> None:
        for each in before:
            signal.signal(each, on_signal)

    listen()
    try:
        yield listen
    finally:
        restore()


@contextmanager
def noted() -> Iterator[list[int]]:
    """A context in which the first signal is noted in a list; it is sent again later."""
    heard, sent = list[int](), list[threading.Timer]()

    def note(number: int, frame: FrameType | None) -> None:
        heard.append(number)
        sent.append(_send_later(number, _SEND_AGAIN))

    with on_first_signal(note):
        try:
            yield heard
        finally:
            for each in sent:
                each.cancel()


def _send_later(number: int, seconds: float) -> threading.Timer:
    timer = threading.Timer(seconds, os.kill, (os.getpid(), number))
    timer.daemon = True
    timer.start()
    return timer


@contextmanager
def raised() -> Iterator[None]:
    """A context in which the first signal raises `Interrupted`, also where a library makes another
    error of it.

    It comes again a little later while something is imported, since half an import would spoil the
    next ones; and where Python lost what it raised, as when an object ends. At the end of the
    context it waits no longer."""
    heard, sent, usual = list[int](), list[threading.Timer](), sys.unraisablehook

    def send_again(number: int) -> None:
        listen()
        sent.append(_send_later(number, 0.01))

    def interrupt(number: int, frame: FrameType | None) -> None:
        """Raise `Interrupted`, or send the signal again later if something is being imported."""
        heard.append(number)
        while frame and not frame.f_code.co_filename.startswith("<frozen importlib"):
            frame = frame.f_back
        if frame and len(sent) < _WAITS:
            send_again(number)
        else:
            raise Interrupted(number)

    def on_unraisable(what: sys.UnraisableHookArgs) -> None:
        if isinstance(what.exc_value, Interrupted):
            send_again(heard[-1])
        else:
            usual(what)

    try:
        with on_first_signal(interrupt) as listen:
            sys.unraisablehook = on_unraisable
            yield
            if any(each.is_alive() for each in sent):
                raise Interrupted(heard[-1])
    except Exception as error:
        if heard:
            raise Interrupted(heard[0]) from error
        raise
    finally:
        sys.unraisablehook = usual
        for each in sent:
            each.cancel()


def end(number: int, frame: FrameType | None) -> NoReturn:
    with suppress(OSError):  # standard error may be closed
        os.write(2, b"dualball: interrupted\n")
    leave(128 + number)
