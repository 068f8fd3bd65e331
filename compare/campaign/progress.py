"""How far a program is: one live line on a terminal, a plain line every ten seconds elsewhere,
nothing when quiet."""

import sys
import threading
import time
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeElapsedColumn

from compare.campaign import compiling
from compare.campaign.compiling import OFTEN, SOON
from compare.campaign.workers import Spread
from model.errors import few

INTERVAL = 10.0  #: seconds between plain lines
SURE = 1.0
"""Seconds of work by which it isn't told yet how long the rest takes: first parts are short."""
READY = "getting ready"
DRAWING = 0.1  #: share of a validation's time that drawing its figures takes, about
BY_THE_TABLE = 60.0
"""Processor time, s, of which a validation's pace is taken to be that of the table of costs."""
LATE = 0.1  #: share of its cost that a protocol still takes, at least, however long it has taken
Show = Callable[[str, int, int, int], None]
"""Called with what is being done, how much of it is done, of how much, and how much failed."""


def show_nothing(what: str, done: int, total: int, failed: int) -> None:
    """A progress function that shows nothing."""


def part(tell: Callable[[float], object], begin: float, end: float) -> Callable[[float], object]:
    """Tells the fraction done of a part of a work, between two fractions of the whole."""
    return lambda done: tell(begin + (end - begin) * done)


class _Pace:
    """How fast something goes, by what was last said of it."""

    def __init__(self, timed: bool = False) -> None:
        """`timed` if what is said to be done is a share of time, that of compiling, too."""
        self._timed, self._compiling, self._lost = timed, (0.0, -1), 0.0
        self._first = self._said = time.monotonic()
        self._at_first, self._done, self._total = -1, 0, 0

    def _clock(self) -> float:
        """Time in which something may have been done, s."""
        return time.monotonic() - self._lost

    def note(self, done: int, total: int) -> bool:
        """Note how much is done; return whether that is the first to go by.

        What an earlier session did, getting ready, or another part, of which there are more or
        fewer, is no measure of how fast this is."""
        self.look()
        first = self._at_first < 0 or not total or total != self._total
        if (done, total) != (self._done, self._total):
            self._said, self._done, self._total = self._clock(), done, total
        if first:
            self._first, self._at_first = self._clock(), done
            if self._compiling[1] >= 0:
                self._compiling = time.monotonic(), done
        return first

    def look(self) -> str:
        """What is said of compiling, now and then: time in which nothing else was done is lost."""
        said, (since, done) = compiling.now(), self._compiling
        if said and done < 0:
            self._compiling = time.monotonic(), self._done
        elif done >= 0 and not said:
            self._compiling = 0.0, -1
            if done == self._done and not self._timed:
                self._lost += time.monotonic() - since
        return said

    def left(self) -> float:
        """Seconds that are left; 0 where nobody knows.

        While nothing is said, that is no sign that it is slow."""
        if not self._done > self._at_first >= 0 or self._said - self._first < SURE:
            return 0.0
        a_part = (self._said - self._first) / (self._done - self._at_first)
        left = a_part * (self._total - self._done) - (self._clock() - self._said)
        return max(left, 0.0)

    def __str__(self) -> str:
        left = self.left()
        return self.look() or (f"about {left:.0f} s to go" if left else "")


@contextmanager
def reporter(quiet: bool = False, counted: bool = False, timed: bool = False) -> Iterator[Show]:
    """Yield a function that shows progress on standard error, which is never silent for longer than
    `INTERVAL`, and at first than `SOON`; nor of compiling.

    `counted` if what is done are runs, whose number is to be shown, too. As long as the total is 0
    nothing is said of the time that is left."""
    if quiet:
        yield show_nothing
    elif counted:
        with reporter() as show:
            yield lambda what, done, total, failed: show(
                f"{what}: {done} of {total} runs" if total else what, done, total, failed
            )
    elif sys.stderr.isatty():
        left = TextColumn("{task.fields[pace]}")  # a new text whenever it is looked at
        columns = TextColumn("{task.description}"), BarColumn(), TaskProgressColumn()
        with Progress(*columns, TimeElapsedColumn(), left, console=Console(stderr=True)) as bar:
            pace = _Pace(timed)
            line = bar.add_task(READY, total=None, pace=pace)

            def show(what: str, done: int, total: int, failed: int) -> None:
                pace.note(done, total)
                failures = f" [red]{failed} failed[/]" if failed else ""
                bar.update(line, description=what + failures, completed=done, total=total or None)

            yield show
    else:  # what is being done at once, and how far it is every `INTERVAL`, whatever happens
        began = time.monotonic()
        pace, last = _Pace(timed), (READY, 0, 0, 0)

        def remember(what: str, done: int, total: int, failed: int) -> None:
            nonlocal last
            if pace.note(done, total) and what != last[0]:
                print(", ".join(filter(None, [what, pace.look()])), file=sys.stderr, flush=True)
            last = what, done, total, failed

        def print_progress(ended: threading.Event) -> None:
            due = min(SOON, INTERVAL)
            while not ended.wait(OFTEN):
                pace.look()
                if (passed := time.monotonic() - began) < due:
                    continue
                due = passed + INTERVAL
                what, done, total, failed = last
                said = f"{passed:.0f} s: {what}"
                said += f", {done / total:.0%}" if total else ""
                said += f", {failed} failed" if failed else ""
                said += f", {pace}" if str(pace) else ""
                print(said, file=sys.stderr, flush=True)

        with compiling.watched(print_progress):
            yield remember


@dataclass
class ValidationProgress:
    """How far a validation is: claims judged, protocols measured, runs of those under way.

    What is shown as done is a share of time, so that its pace tells the time that is left."""

    show: Show
    claims: int
    workers: int = 1
    costs: Mapping[str, float] = field(default_factory=dict)
    """Processor time of each protocol that isn't stored yet, s, on some machine."""
    began: float = field(default_factory=lambda: time.monotonic())
    _under_way: dict[str, tuple[int, int, int]] = field(default_factory=dict)
    _spent: dict[str, float] = field(default_factory=lambda: defaultdict(float))
    """Processor time of each protocol until now, s, if those under way share the workers evenly."""
    _measured: set[str] = field(default_factory=set)
    _judged: int = 0
    _lock: threading.Lock = field(default_factory=threading.Lock)

    def __post_init__(self) -> None:
        self._noted = self.began

    def measuring(self, protocol: str, done: int, total: int, failed: int) -> None:
        """Note how many runs of a protocol are done, known so far, and failed."""
        with self._noting():
            self._under_way[protocol] = done, total, failed

    def measured(self, protocol: str) -> None:
        """Note that a protocol is done."""
        with self._noting():
            self._under_way.pop(protocol, None)
            self._measured.add(protocol)

    def judged(self) -> None:
        """Note that one more claim is judged."""
        with self._noting():
            self._judged += 1

    def drawing(self, over: Spread) -> Spread:
        """A `map` for figures that shows how many are drawn."""
        whole = DRAWING * (time.monotonic() - self.began)

        def counted(one: Callable[[Any], Any], items: Iterable[Any]) -> Iterator[Any]:
            todo = list(items)
            for n, result in enumerate(over(one, todo), start=1):
                self._show(f"drawing figures: {n} of {len(todo)}", whole * (1 - n / len(todo)))
                yield result

        self._show("drawing figures", whole)
        return counted

    def left(self) -> float:
        """Seconds that are left of measuring and drawing: what isn't done yet, at the pace of the
        protocols that are or should be, which counts for little at first."""
        todo = [name for name in self.costs if name not in self._measured]
        late = {name for name in todo if self._spent[name] > self.costs[name]}
        done = [name for name in self.costs if name in self._measured | late]
        spent, cost = (sum(of[name] for name in done) for of in (self._spent, self.costs))
        pace = (spent + BY_THE_TABLE) / (cost + BY_THE_TABLE)
        takes = {name: pace * self.costs[name] for name in todo}
        rest = sum(max(takes[name] - self._spent[name], LATE * takes[name]) for name in todo)
        left = rest / self.workers
        return left + DRAWING * (time.monotonic() - self.began + left)

    @contextmanager
    def _noting(self) -> Iterator[None]:
        """A context to note something in: the time since the last note is shared out among the
        protocols under way, and in the end it is shown how far all is."""
        with self._lock:
            passed, self._noted = time.monotonic() - self._noted, time.monotonic()
            for name in self._under_way:
                self._spent[name] += passed * self.workers / max(len(self._under_way), self.workers)
            yield
            now = self._under_way.items()
            runs = [f"{name} {done}/{total}" for name, (done, total, _) in now if done < total]
            what = f"{self._judged} of {self.claims} claims judged"
            measuring = f"; measuring {few(runs)}" if runs else ""
            self._show(what + measuring, self.left(), sum(bad for _, (*_, bad) in now))

    def _show(self, what: str, left: float, failed: int = 0) -> None:
        passed = time.monotonic() - self.began
        self.show(what, round(1000 * passed / max(passed + left, 1e-9)), 1000, failed)
