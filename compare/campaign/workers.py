"""Where tasks run: processes of this machine, or the workers of a Dask scheduler.

Both are executors of `concurrent.futures`, and `Workers` says what else a campaign must know."""

import logging
import os
import signal
import sys
import threading
from collections.abc import Callable, Collection, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, CancelledError, Executor, Future, wait
from concurrent.futures.process import BrokenProcessPool, ProcessPoolExecutor
from concurrent.futures.thread import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing import get_context, parent_process, resource_tracker
from multiprocessing.connection import Connection
from typing import Any, Self, TypeVar

from compare.campaign import compiling
from compare.campaign.stops import SIGNALS
from model import InputError, StorageError
from model.files import leave
from model.parameters import Range, check_number

T = TypeVar("T")
Spread = Callable[[Callable[[Any], Any], Iterable[Any]], Iterator[Any]]
"""A function that is called like `map`."""
JUDGING = 30.0
"""Processor time that judging a claim or drawing a figure may take, s: thirty times what the
longest takes at the quick level. What files say may be nonsense that takes years."""
SCHEDULER_TIMEOUT = 10.0  #: how long a scheduler has to answer, s
ASLEEP = 1.0  #: how long a thread that waits sleeps at a stretch, s


@dataclass(eq=False)
class Workers:
    """An executor, started when needed, anew when its workers died; threads may share it."""

    count: int  #: tasks at once
    start: Callable[[], Executor]
    stop: Callable[[Executor, bool], None]
    """Called with the executor and whether to give up what is under way."""
    lost: tuple[type[BaseException], ...]  #: errors of a future that mean: the worker died

    def __post_init__(self) -> None:
        self._running: Executor | None = None
        self._closed, self._lock = False, threading.Lock()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, *error: object) -> None:
        self.close(at_once=kind is not None)

    def submit(self, *call: Any) -> Future[Any]:
        """Give a call to the workers; raises `CancelledError` once there is to be no more work."""
        with self._lock:
            for _ in range(2):
                if self._closed:
                    raise CancelledError("the campaign was given up")
                try:
                    self._running = self._running or self.start()
                    return self._running.submit(*call)
                except self.lost:
                    assert self._running
                    self.stop(self._running, True)
                    self._running = None
                except OSError as error:  # the machine has no more of what they need
                    why = f"workers can't be started: {error.strerror or error}"
                    raise StorageError(f"{why}; --workers 0 does without") from error
        raise StorageError("workers die as soon as they are started")

    def map(self, one: Callable[[Any], Any], items: Iterable[Any]) -> Iterator[Any]:
        """Python's `map` by the workers, in order; what one that died had to do is done here."""
        if self.count < 2:
            yield from map(one, items)
            return
        for item, future in [(item, self.submit(one, item)) for item in items]:
            try:
                yield first_done([future])[0].result()
            except self.lost:
                yield one(item)

    def close(self, at_once: bool) -> None:
        """Let the workers go, `at_once` and for good, or after what is under way."""
        with self._lock:
            running, self._running, self._closed = self._running, None, at_once
            if running is not None:
                self.stop(running, at_once)


def processes(count: int) -> Workers:
    """`count` processes, one BLAS thread each; for 0 this one. May raise `InputError`."""
    check_number("workers", count, "processes", Range(0, whole=True))
    if count == 0:
        return Workers(1, _Here, lambda executor, at_once: None, ())

    def start() -> Executor:
        # inherited by the workers; numpy reads it when they import it
        for library in ("OMP", "OPENBLAS", "MKL"):
            os.environ.setdefault(f"{library}_NUM_THREADS", "1")
        with _without_signals():
            resource_tracker.ensure_running()  # it lets Ctrl-C and SIGTERM through
        with _without_signals():  # a semaphore that is half made would be left
            return _Pool(count)

    def stop(executor: Executor, at_once: bool) -> None:
        assert isinstance(executor, _Pool)
        if at_once:
            executor.leash.close()
        executor.shutdown(wait=True, cancel_futures=True)

    return Workers(count, start, stop, (BrokenProcessPool,))


class _Pool(ProcessPoolExecutor):
    """Processes that end when the other end of a pipe is closed, by us or our death."""

    def __init__(self, count: int) -> None:
        context = get_context("spawn")
        # ours must stay open until all workers have started
        self._end, self.leash = context.Pipe(duplex=False)
        self._heard, told = context.Pipe(duplex=False)
        compiling.workers.add(self._heard)
        ends = self._end, told
        super().__init__(count, mp_context=context, initializer=_follow_parent, initargs=ends)

    def submit(self, fn: Callable[..., T], /, *args: Any, **kwargs: Any) -> Future[T]:
        # Workers that it may start inherit this: they have no handlers before they have imported
        # much.
        with _without_signals():
            return super().submit(_call_in_worker, fn, *args, **kwargs)


@contextmanager
def _without_signals() -> Iterator[None]:
    """A context in which signals that end a program wait, and whose new processes never get them.

    The main thread handles those that another gets, blocked or not: they are sent again."""
    if sys.platform == "win32":
        yield
        return
    came: list[int] = []
    here = SIGNALS if threading.current_thread() is threading.main_thread() else ()
    mask = signal.pthread_sigmask(signal.SIG_BLOCK, SIGNALS)
    before = {each: handler for each in here if callable(handler := signal.getsignal(each))}
    for each in before:
        signal.signal(each, lambda number, frame: came.append(number))
    try:
        yield
    finally:
        for each, handler in before.items():
            signal.signal(each, handler)
        signal.pthread_sigmask(signal.SIG_SETMASK, mask)
        for number in came[:1]:
            signal.raise_signal(number)


_between = threading.Lock()
"""Held by a worker between tasks: half of a result would keep the parent waiting."""


def _call_in_worker(fn: Callable[..., T], *args: Any, **kwargs: Any) -> T:
    """In a worker: call a function, during which the parent may end the worker."""
    if _between.locked():
        _between.release()
    try:
        return fn(*args, **kwargs)
    finally:
        _between.acquire()


def _follow_parent(end: Connection, told: Connection) -> None:
    """In a worker: leave signals to the parent, tell of compiling, end with it or at its word."""

    def wait_for_parent() -> None:
        end.poll(None)
        parent = parent_process()
        if parent and parent.is_alive():
            _between.acquire()
        leave(1)

    for number in SIGNALS:
        signal.signal(number, signal.SIG_IGN)
    # by the pool, where another worker died
    signal.signal(signal.SIGTERM, lambda number, frame: leave(1))
    if sys.platform != "win32":
        signal.pthread_sigmask(signal.SIG_UNBLOCK, SIGNALS)
    threading.Thread(target=wait_for_parent, daemon=True).start()
    compiling.tell(told)


class _Here(Executor):
    """An executor that calls each function at once, in this process; errors reach the caller."""

    def submit(self, fn: Callable[..., T], /, *args: Any, **kwargs: Any) -> Future[T]:
        done: Future[T] = Future()
        done.set_result(fn(*args, **kwargs))
        return done


def dask(address: str) -> Workers:
    """The workers of a Dask scheduler, which must see the campaign's directory under the same path.

    Raises `InputError` if Dask isn't installed or no scheduler with workers answers."""
    try:
        from distributed import Client, KilledWorker
    except ImportError as error:
        raise InputError("--scheduler needs Dask: pip install distributed") from error
    # What they log with a traceback, also of what nobody waits for any more, we say in a line.
    for name in ("distributed", "distributed.client", "tornado.application", "asyncio"):
        logging.getLogger(name).setLevel(logging.CRITICAL)
    try:
        # not the default of whatever else asks Dask, who might go on asking it once it is gone
        client: Any = Client(  # type: ignore[no-untyped-call]
            address, timeout=SCHEDULER_TIMEOUT, set_as_default=False
        )
    except (OSError, ValueError, TypeError) as error:
        raise InputError(f"no Dask scheduler answers at {address}: {error}") from error
    count = sum(client.nthreads().values())
    if count == 0:
        client.close()
        raise InputError(f"the Dask scheduler at {address} has no workers")

    def stop(executor: Executor, at_once: bool) -> None:
        executor.shutdown(wait=not at_once)
        client.close()

    return Workers(count, lambda: client.get_executor(pure=False), stop, (KilledWorker,))


@contextmanager
def threads(count: int) -> Iterator[ThreadPoolExecutor]:
    """A context with threads for which an error doesn't wait: they end by themselves."""
    pool = ThreadPoolExecutor(count)
    try:
        yield pool
    except BaseException:
        pool.shutdown(wait=False, cancel_futures=True)
        raise
    pool.shutdown()


def first_done(futures: Collection[Future[T]]) -> list[Future[T]]:
    """Wait for some futures; those that are done or cancelled, as soon as there is one.

    The main thread looks up now and then, as a signal that another thread gets, or that comes as
    it falls asleep, doesn't wake it. And nobody tells `wait` of what is cancelled."""
    while not (done := [each for each in futures if each.done()]):
        wait(futures, ASLEEP, FIRST_COMPLETED)
    return done


class LateError(BaseException):
    """What takes too long; no `Exception`, which a judge would take for a breakdown."""


@contextmanager
def at_most(limit: float) -> Iterator[None]:
    """Raise `LateError` once more than `limit` s of processor time have passed in which nothing was
    compiled; in the main thread, where signals arrive, and not on Windows."""
    if sys.platform == "win32" or threading.current_thread() is not threading.main_thread():
        yield
        return
    heard = compiling.listen(), compiling.here()

    def raise_late(*_: object) -> None:
        nonlocal heard
        last, heard = heard, (compiling.listen(), compiling.here())
        if heard == last and not heard[1]:
            raise LateError(f"it took longer than {limit:g} s")
        signal.setitimer(signal.ITIMER_VIRTUAL, limit)

    before = signal.signal(signal.SIGVTALRM, raise_late)
    signal.setitimer(signal.ITIMER_VIRTUAL, limit)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_VIRTUAL, 0.0)
        signal.signal(signal.SIGVTALRM, before)
