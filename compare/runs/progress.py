"""How far a campaign is: one live line on a terminal, plain lines elsewhere, nothing when quiet."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

PLAIN_INTERVAL = 10.0
"""Seconds between plain lines."""

Show = Callable[[str, int, int, int], None]
"""Called with what is being done, runs done, runs in all, runs failed."""


@contextmanager
def shown(quiet: bool = False) -> Iterator[Show]:
    """A function to report progress to, on standard error."""
    if quiet:
        yield lambda what, done, total, failed: None
    elif not sys.stderr.isatty():
        yield _plain()
    else:
        counts = BarColumn(), MofNCompleteColumn(), TextColumn("{task.fields[failed]}")
        times = TimeElapsedColumn(), TextColumn("ETA"), TimeRemainingColumn()
        with Progress(TextColumn("{task.description}"), *counts, *times, console=Console(stderr=True)) as bar:
            line = bar.add_task("", total=None, failed="")

            def show(what: str, done: int, total: int, failed: int) -> None:
                failures = f"[red]{failed} failed" if failed else ""
                bar.update(line, description=what, completed=done, total=total, failed=failures)

            yield show


def _plain() -> Show:
    doing, start, first, last = "", 0.0, 0, 0.0

    def show(what: str, done: int, total: int, failed: int) -> None:
        nonlocal doing, start, first, last
        now = time.monotonic()
        if what != doing:  # the rate is that of what is being done now, and of this session
            doing, start, first, last = what, now, done, now
            print(what, file=sys.stderr)
            return
        if now - last < PLAIN_INTERVAL:  # many short campaigns make up one thing that is being done
            return
        last = now
        eta = f", about {(now - start) / (done - first) * (total - done):.0f} s to go" if first < done < total else ""
        print(f"{what}: {done}/{total} runs{f', {failed} failed' if failed else ''}{eta}", file=sys.stderr)

    return show
