"""The league: installed engines on exact cases, as they come and in the best settings known."""

from __future__ import annotations

import itertools
import math
import statistics
import threading
import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from compare.bench.case import TOLERANCE, VERSION
from compare.bench.exact import cases
from compare.bench.runner import FLOORS, Result, run_all
from compare.campaign.progress import Show
from compare.campaign.workers import threads
from compare.engines.adapters import STUDIED
from compare.figures.pages import Rows
from compare.method.statistics import plain

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_OWN = "compare.engines.adapters"


_AS_IT_COMES = "-defaults"
_NEWTON = ("kamino", "xpbd", "xpbd-defaults", "semiimplicit-defaults", "vbd-defaults")
ENTRIES = {
    "mujoco-free": f"{_OWN}.mujoco_free:best",
    "mujoco-plain": "compare.bench.joints:on_joints",
    "mujoco-defaults": f"{_OWN}.mujoco_free:defaults",
    "siconos": f"{_OWN}.siconos:best",
    **{
        f"{name}{kind}": f"{_OWN}.{name.replace('-', '_')}:{kind[1:] or 'best'}"
        for name in (*STUDIED, "mujoco-warp")
        for kind in ("", _AS_IT_COMES)
    },
    **{f"newton-{name}": f"{_OWN}.newton:{name.replace('-', '_')}" for name in _NEWTON},
}
"""Engines in the best settings known or, NAME-defaults, as they come: where Python imports
them from, package.module:member."""
_UNDER_THE_LAW = (
    "mujoco-free is MuJoCo with free bodies under Coulomb's law; MuJoCo's own contacts are those "
    "of mujoco-plain and mujoco-defaults."
)
"""What is to be quoted with its number."""
KINDS = ("sticking", "rolling", "sliding", "landing")
QUICK = (2e-3,)
FEW = 4
"""Cases whose times don't tell yet how long the others take."""
LEAST = 1e-8  # smaller errors are drawn here
ENTRY_MARKS = "osv^DPX*<>phd"
ENTRY_COLOURS = "#005A96 #C04000 #00966C #C7699D #B78000 #2994D4 #000000 #703A30".split()


def measure(
    engines: Mapping[str, Any], steps: Sequence[float] | None, workers: int, show: Show
) -> dict[str, list[Result]]:
    """Results by engine, one for each case; engines that can't be used say why."""
    asked, over = cases(), threading.Event()
    progress = Progress(show, engines, {case.name: float(case.times[-1]) for case in asked})

    def results_of(name: str) -> list[Result]:
        found = []
        still = itertools.takewhile(lambda _: not over.is_set(), asked)
        for result in run_all(still, engines[name], steps):
            found.append(result)
            progress.note(name, result)
        progress.over(name)
        return found

    with threads(max(workers, 1)) as pool:
        try:
            return dict(zip(engines, pool.map(results_of, engines), strict=True))
        finally:
            over.set()


class Progress:
    """How far engines are on the cases. What is shown as done is a share of time.

    That is known once each engine is over or has been on a few cases, since engines differ by any
    factor. The rest of the cases then takes each as long a simulated second as the median of its
    own until then: in some an engine compiles."""

    def __init__(self, show: Show, engines: Iterable[str], lasting: Mapping[str, float]) -> None:
        """`lasting` are the simulated times of the cases, s, in their order."""
        self._show, self._lasting, self._lock = show, lasting, threading.Lock()
        self._begun = math.nan
        """When the time that is left became known, s."""
        self._last = dict.fromkeys(engines, time.monotonic())
        """When each engine had its last result, s."""
        self._ends = dict.fromkeys(engines, math.inf)
        """When each is expected to be over, s; inf where nobody knows."""
        self._paces: dict[str, list[float]] = {}
        """Of engines under way: real seconds for a simulated one, of each case."""

    def note(self, name: str, result: Result) -> None:
        """Note a result of an engine."""
        now, names = time.monotonic(), list(self._lasting)
        with self._lock:
            passed, self._last[name] = now - self._last[name], now
            if result.skipped:
                return
            paces = self._paces.setdefault(name, [])
            paces.append(passed / self._lasting[result.case])
            if len(paces) > FEW:
                rest = names[names.index(result.case) + 1 :]
                takes = statistics.median(paces[1:])  # before the first it loads
                self._ends[name] = now + takes * sum(self._lasting[case] for case in rest)
            self._tell(f"{name}: {result.case}")

    def over(self, name: str) -> None:
        """Note that an engine is over."""
        with self._lock:
            self._ends[name] = -math.inf
            self._paces.pop(name, None)

    def _tell(self, what: str) -> None:
        now, end = time.monotonic(), max(self._ends.values())
        if end == math.inf:
            self._show(", ".join(self._paces), 0, 0, 0)
            return
        self._begun = now if math.isnan(self._begun) else self._begun
        passed, left = now - self._begun, max(end - now, 1e-3)
        self._show(what, round(1000 * passed / (passed + left)), 1000, 0)


def summary(league: Mapping[str, Sequence[Result]]) -> Rows:
    """A row for each engine tried: cases passed, median error by kind, order, cost."""
    kinds = {case.name: case.kind for case in cases()}
    table = [["engine", "precision", "passed", *KINDS, "order", "cost"]]
    for name, results in ranked(league).items():
        own = [result for result in results if not result.skipped]
        precision, passed = own[0].engine.precision, sum(r.passed for r in own)
        medians = []
        for kind in KINDS:
            errors = (r.error for r in own if kinds[r.case] == kind)
            median = _median(e if math.isfinite(e) else math.inf for e in errors)
            medians.append(number(median, FLOORS[precision]))
        order = _median(r.order for r in own if math.isfinite(r.order))
        cost = _median(r.cost for r in own if math.isfinite(r.cost))
        shown = [name, precision, f"{passed} of {len(own)}", *medians]
        shown.append("" if math.isnan(order) else f"{order:.1f}")
        table.append([*shown, "" if math.isnan(cost) else f"{cost:.2g}"])
    return table


def rows(league: Mapping[str, Sequence[Result]]) -> Rows:
    """A row for each case, a column for each engine that was tried: errors at the shortest step."""
    those = ranked(league)
    table = [["case", *those]]
    for k, case in enumerate(cases()):
        table.append([case.name, *(cell(results[k]) for results in those.values())])
    return table


def caption(league: Mapping[str, Sequence[Result]]) -> str:
    """What the numbers are."""
    engines: dict[float, list[str]] = {}
    for name, results in ranked(league).items():
        for step in {result.steps[-1] for result in results if result.steps}:
            engines.setdefault(step, []).append(name)
    steps = [
        f"{1e3 * step:g} ms" + (f" ({', '.join(names)})" if len(engines) > 1 else "")
        for step, names in sorted(engines.items())
    ]
    law = f" {_UNDER_THE_LAW}" if "mujoco-free" in league else ""
    return (
        "Errors at the shortest step in units of each case's scales; up to "
        f"{TOLERANCE:g} an engine passes, ✗ marks more. Order: power of the step with which errors "
        "fall, the median over the cases. Cost: processor time divided by simulated time at the "
        f"shortest step, the median. The shortest step is {' or '.join(steps)}. A dash: the engine "
        f"can't express the case, and was not tried.{law}"
    )


def ranked(league: Mapping[str, Sequence[Result]]) -> dict[str, Sequence[Result]]:
    """Engines that were tried; the best first, as they come behind all others."""

    def place(name: str) -> tuple[bool, float]:
        passed = statistics.mean(r.passed for r in league[name] if not r.skipped)
        return name.endswith(_AS_IT_COMES), -passed

    tried = [name for name, results in league.items() if any(not r.skipped for r in results)]
    return {name: league[name] for name in sorted(tried, key=place)}


def cell(result: Result) -> str:
    """The cell of a result: its error, or why there is none; marked if too much."""
    if result.skipped:
        return "–"
    floor = FLOORS[result.engine.precision]
    told = number(result.error, floor) if math.isfinite(result.error) else "lost"
    return told if result.passed else f"{told} ✗"


def number(value: float, floor: float) -> str:
    """An error to two digits; round-off is shown as such."""
    if math.isnan(value):
        return "–"
    if math.isinf(value):
        return "lost"
    mantissa, exponent = (f"< {floor:.0e}" if value < floor else f"{value:.1e}").split("e")
    return f"{mantissa}e{int(exponent)}"


def declarations(league: Mapping[str, Sequence[Result]]) -> Rows:
    """What each engine that was tried declares, its worst case, and what its adapter says that it
    does worst; `notes` say why others were not tried."""
    table = [["engine", "version", "declared", "worst case", "known to do worst"]]
    for name, results in league.items():
        if tried := [result for result in results if not result.skipped]:
            worst = max(tried, key=lambda r: r.error if math.isfinite(r.error) else math.inf)
            engine, case = worst.engine, f"{worst.case}, {cell(worst)}"
            case += f": {worst.failure}" if worst.failure else ""
            table.append([name, engine.version, engine.declared, case, engine.note])
    return table


def notes(league: Mapping[str, Sequence[Result]]) -> Iterator[tuple[str, list[str], str]]:
    """Engines, their cases that failed or were not tried, none for all, and why; one a reason."""
    for name, results in league.items():
        reasons: dict[str, list[str]] = {}
        for result in results:
            if reason := result.failure or result.skipped:
                reasons.setdefault(reason, []).append(result.case)
        for reason, those in reasons.items():
            yield name, [] if len(those) == len(results) else those, reason


def to_mapping(league: Mapping[str, Sequence[Result]]) -> dict[str, Any]:
    """All results of the league as JSON-able data."""
    entries = {
        name: [vars(each) | {"order": each.order, "passed": each.passed} for each in results]
        for name, results in league.items()
    }
    return dict(plain({"version": VERSION, "tolerance": TOLERANCE, "engines": entries}))


def _median(values: Iterable[float]) -> float:
    known = list(values)
    return statistics.median(known) if known else math.nan


def draw(league: Mapping[str, Sequence[Result]]) -> Figure:
    """A figure of median errors over median costs, a panel for each kind of case."""
    from matplotlib.ticker import NullFormatter  # here, because drawing takes a second to load

    from compare.figures import style

    kinds = {case.name: case.kind for case in cases()}
    finite = {
        name: [r for r in results if np.isfinite(r.errors).any()]
        for name, results in ranked(league).items()
    }
    shown = {name: results for name, results in finite.items() if results}
    engines = list(dict.fromkeys(name.removesuffix(_AS_IT_COMES) for name in shown))
    figure, panels = style.panels(9.0, 4.4 + 0.19 * len(shown), 2, 2, sharex=True, sharey=True)
    for axes, each in zip(panels.ravel(), KINDS, strict=True):
        for name, results in shown.items():
            own = np.array([[r.costs, r.errors] for r in results if kinds[r.case] == each])
            if not len(own):
                continue
            known = np.isfinite(own[:, 1]).mean(0) > 0.5  # where the median is
            finite_ones = np.where(np.isfinite(own[:, 1:]), own, np.nan)[..., known]
            cost, error = np.nanmedian(finite_ones, axis=0)
            number = engines.index(name.removesuffix(_AS_IT_COMES))
            mark, colour = (of[number % len(of)] for of in (ENTRY_MARKS, ENTRY_COLOURS))
            look = {"marker": mark, "color": colour, "ms": 5.5, "lw": 1}
            look |= {"mfc": "white", "ls": ":"} if name.endswith(_AS_IT_COMES) else {}
            axes.plot(cost, np.maximum(error, LEAST), label=name, **look)
        axes.axhline(TOLERANCE, color="0.5", lw=0.8)
        axes.set(xscale="log", yscale="log", title=each)
        axes.grid(alpha=0.3)
    shared = panels[0, 0]
    for axis, limit in ((shared.xaxis, shared.set_xlim), (shared.yaxis, shared.set_ylim)):
        low, high = np.log10(axis.get_view_interval())
        limit(10 ** np.floor(low), 10 ** np.ceil(high))  # whole decades, each with its number
        axis.set_minor_formatter(NullFormatter())
    figure.supylabel("error, in units of the case's scales", size="medium")
    for axes in panels[1]:
        axes.set_xlabel("processor time divided by simulated time")
    style.legend(figure, loc="outside lower center", ncols=4)
    return figure
