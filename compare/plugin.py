"""The plugin for pytest: exact cases as tests of an engine, fixtures for one's own scene.

``pytest --dualball-engine mypkg.adapter`` runs the cases, and nothing else unless files are named.
An entry point loads this in every run of pytest where dualball is installed: nothing but pytest is
imported until it is used."""

from __future__ import annotations

import functools
import math
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

_ROW = "dualball"
"""The property of a test's report that holds a row of the summary, with pytest-xdist, too."""


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the options of the plugin to pytest."""
    group = parser.getgroup("dualball", "exact contact cases")
    form = "a module with build, step and state, or MODULE:OBJECT"
    engine = f"test an engine on the exact cases: {form}"
    group.addoption("--dualball-engine", metavar="MODULE", help=engine)
    known = "cases that are known to fail, one a line: the name, then the reason"
    group.addoption("--dualball-known", metavar="FILE", type=Path, help=known)


def pytest_configure(config: pytest.Config) -> None:
    """With an engine, but without files named, collect nothing else."""
    if config.getoption("dualball_engine"):
        sys.path.append(str(config.invocation_params.dir))
        if config.args_source is not pytest.Config.ArgsSource.ARGS:
            config.args = []


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(
    session: pytest.Session, config: pytest.Config, items: list[pytest.Item]
) -> None:
    """Add the cases, before ``-k`` and ``-m`` choose."""
    if engine := config.getoption("dualball_engine"):
        from compare.bench import cases, runner  # here, because no other run needs it

        own, path = {case.name: case for case in cases()}, config.getoption("dualball_known")
        try:
            lines = path.read_text("utf-8").splitlines() if path else []
        except (OSError, UnicodeDecodeError) as error:
            raise pytest.UsageError(f"--dualball-known: cannot read {path}: {error}") from error
        rows = [line.partition("#")[0].split(None, 1) for line in lines]
        known = {row[0]: row[1].strip() if len(row) > 1 else "known to fail" for row in rows if row}
        for name in (each for each in known if each not in own):
            there = ", ".join(own)
            raise pytest.UsageError(f"{path}: no case is called {name!r}; there are {there}")

        @functools.cache
        def trial() -> runner.EngineProcess:  # begins with the first case asked for
            begun = runner.EngineProcess(engine)
            config.add_cleanup(begun.close)
            return begun

        for name, case in own.items():
            what = {"name": name, "nodeid": f"{engine}::{name}", "case": case, "trial": trial}
            item = ExactCase.from_parent(session, **what)
            if name in known:
                item.add_marker(pytest.mark.xfail(reason=known[name]))
            items.append(item)


class ExactCase(pytest.Item):
    """A case as a test: passed if the engine's error at its shortest step is small enough."""

    def __init__(self, *, case: Any, trial: Any, **more: Any) -> None:
        super().__init__(**more)
        self.case, self.trial = case, trial

    def runtest(self) -> None:
        """Run the case, and keep a row of the summary."""
        from compare.bench.case import TOLERANCE  # here, because no other run needs it

        found = self.trial().result(self.case)
        if found.engine.missing:
            self.session.shouldfail = found.engine.missing
            pytest.fail(found.engine.missing, pytrace=False)
        if found.skipped:
            pytest.skip(found.skipped)
        row = (found.error, found.order, found.creep, found.lost, found.cost)
        cells = ["" if math.isnan(value) else f"{value:.2g}" for value in row]
        self.user_properties.append((_ROW, [self.name, *cells]))
        if not found.passed:
            steps = zip(found.errors, found.steps, strict=True)
            at = ", ".join(f"{error:.2g} at {1e3 * h:g} ms" for error, h in steps)
            errors = f"{self.case.about}: errors, in units of its scales, are {at}"
            said = found.failure or f"{errors}; allowed is {TOLERANCE:g}"
            pytest.fail(said, pytrace=False)

    def reportinfo(self) -> tuple[Path, None, str]:
        """What pytest prints before the dots."""
        return self.path, None, self.nodeid


def pytest_terminal_summary(terminalreporter: Any) -> None:
    """A table of all cases that ran."""
    rows = [["case", "error", "order", "creep (m/s)", "lost", "cost", ""]]
    for verdict in ("passed", "failed", "xfailed", "xpassed"):
        for report in terminalreporter.stats.get(verdict, []):
            properties = getattr(report, "user_properties", [])
            rows += [[*row, verdict] for name, row in properties if name == _ROW]
    if len(rows) > 1:
        what = "error at the shortest step in units of the case's scales"
        terminalreporter.section(f"exact cases: {what}")
        widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
        for first, *row in rows:
            cells = (cell.rjust(width) for cell, width in zip(row, widths[1:], strict=True))
            terminalreporter.write_line("  ".join([first.ljust(widths[0]), *cells]))


@pytest.fixture(scope="session")
def dualball_theory() -> Callable[..., Any]:
    """``theory(p, t_end, x0=(0,) * 6)``: the event-driven motion, computed once."""
    import analytic  # here, because no other run needs it

    @functools.cache
    def theory(p: Any, t_end: float, x0: tuple[float, ...] = (0.0,) * 6) -> Any:
        return analytic.simulate(p, x0, t_end)

    return theory


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    """A test that takes ``dualball_case`` runs once for each exact case."""
    if "dualball_case" in metafunc.fixturenames:
        from compare import bench

        metafunc.parametrize("dualball_case", bench.cases(), ids=lambda case: case.name)
