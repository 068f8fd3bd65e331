"""Nothing runs for long without a word: a line for commands without progress of their own."""

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from compare.campaign import compiling
from compare.campaign.compiling import OFTEN, SOON


@contextmanager
def told(what: str) -> Iterator[Callable[[float], None]]:
    """A context that says what goes on once it takes long; yields a function to be called with the
    fraction done, by those that know it."""
    done = 0.0

    def tell(fraction: float) -> None:
        nonlocal done
        done = max(done, fraction)

    def watch(ended: threading.Event) -> None:
        for _ in range(round(SOON / OFTEN)):
            compiling.listen()
            if ended.wait(OFTEN):
                return
        from compare.campaign import progress  # here, because most commands are done before

        with progress.reporter() as show:
            while not ended.wait(OFTEN):
                show(what, round(1000 * done), 1000 if done else 0, 0)

    with compiling.watched(watch):
        yield tell
