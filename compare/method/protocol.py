"""How protocols are carried out, and where their measurements are kept.

A protocol is a function of a runner, the parameter sets, and what was measured before it; it yields
measurements, and what it could not measure. To add one, write such a function, and add a line to
the `PROTOCOLS` of its subject and one to `compare.plan.PLAN`."""

import hashlib
import json
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import Future
from dataclasses import asdict, dataclass, replace
from functools import cached_property
from graphlib import TopologicalSorter
from pathlib import Path

from compare.campaign.tasks import sources
from compare.campaign.workers import first_done, threads
from compare.engines.study import Engine, Role
from compare.method import record
from compare.method.record import Measured, Measurement, Missing, Origin, Planned, Records, Sets
from compare.method.runner import Runner, coarse_step
from compare.plan import LAWLESS, PLAN, Level, planned
from model import Parameters, StorageError
from model.files import make_directory

DIRECTORY = "measurements"
UNDAMPED = "without drag (c = 0 s-1) no motion settles, and nothing can be measured"
LONGEST_WAIT = 3e4
"""Coarse time steps in 1/c up to which a protocol waits for motions to settle: 40/c or more at a
time. Contact forces are solved to 1e-12 in each step; what adds up in 1/c is as much as `omega_c`
may be off in a state that counts as settled."""
SOURCES = "compare.engines.study", "compare.campaign", "compare.plan", "compare.method"
"""What all measurements are made by; those of an older program are not taken for new ones."""
Measure = Callable[[Runner, Sets, Records], Measured]


@dataclass(frozen=True)
class Protocol:
    """One way to measure."""

    name: str
    measure: Measure
    needs: tuple[str, ...] = ()  #: protocols whose measurements it goes out from
    drawn: Callable[[Measurement], bool] = lambda m: False
    """Whether figures draw the runs of a measurement: all others are dropped."""


@dataclass(frozen=True)
class Job:
    """A protocol, and by whom, on which sets, and where it is carried out."""

    protocol: Protocol
    runner: Runner
    results: Path  #: the results directory
    chosen: Mapping[str, Parameters] | None = None  #: sets in the place of the protocol's own

    @property
    def name(self) -> str:
        """The name of the protocol, and of an engine and step that aren't those on trial."""
        return self.beside(self.protocol.name) if self.runner.has_own_steps else self.protocol.name

    def beside(self, protocol: str) -> str:
        """The name of another protocol by the same engine with the same step."""
        return f"{protocol} by {self.runner.engine.name}, step/{self.runner.divisor}"

    @property
    def sets(self) -> Mapping[str, Parameters]:
        """What is measured, by name."""
        if self.chosen is not None:
            return self.chosen
        by = self.runner
        return planned(self.protocol.name, by.engine, by.divisor, by.level)

    @property
    def by(self) -> Engine:
        """Who measures."""
        return PLAN[self.protocol.name].by or self.runner.engine

    @property
    def cost(self) -> float:
        """About its processor time at the quick level on some machine, s."""
        entry, engine, divisor = PLAN[self.protocol.name], self.runner.engine, self.runner.divisor
        if not self.runner.has_own_steps:
            return entry.seconds
        share = len(planned(self.protocol.name, engine, divisor, Level.QUICK)) / len(entry.trial)
        pace = LAWLESS if engine.role is Role.IN_THE_LIMIT else 1.0
        return entry.seconds * share * divisor * pace

    @cached_property
    def origin(self) -> Origin:
        """Who measures, and by which plan."""
        subject, measure, _ = self.protocol.measure.__module__.partition(".measure")
        code = sources(*self.by.sources, *SOURCES, *([subject + measure] if measure else []))
        step, level = self.runner.divisor, self.runner.level.name
        sets = {name: asdict(p) for name, p in self.sets.items()}
        plan = [self.by.name, step, level, sets, code]
        return Origin(
            protocol=self.protocol.name,
            engine=self.runner.engine.name,
            by=self.by.name,
            step=step,
            level=level,
            plan=hashlib.sha256(json.dumps(plan).encode()).hexdigest()[:16],
        )

    @property
    def file(self) -> Path:
        """Where its measurements are kept: elsewhere for each plan."""
        return self.results / DIRECTORY / self.origin.plan / f"{self.protocol.name}.h5"


def with_needed(protocols: Sequence[Protocol], names: Iterable[str]) -> list[Protocol]:
    """The protocols of these names and all that they need, as `PLAN` orders them; of all
    `protocols`, each of which goes out only from those before it."""
    wanted = set(names)
    for protocol in reversed(protocols):
        wanted.update(protocol.needs if protocol.name in wanted else ())
    known = {protocol.name: protocol for protocol in protocols}
    return [known[name] for name in PLAN if name in wanted]


def run(jobs: Sequence[Job]) -> Iterator[tuple[Job, Records | Exception]]:
    """Carry out protocols, some at once if they need nothing of each other, those in front first;
    yield each as it ends, with its records, or with the exception by which it broke down.

    So do those that need it: what they measured without it would be kept, and taken for whole the
    next time. Raises `StorageError` where files can't be read or written."""
    if not jobs:
        return
    known = {job.name: job for job in jobs}
    needs = dict[str, list[str]]()
    for name, job in known.items():
        others = [n if n in known else job.beside(n) for n in job.protocol.needs]
        if PLAN[job.protocol.name].seeded and name != job.protocol.name:
            others.append(job.protocol.name)
        needs[name] = [other for other in others if other in known]
    order = TopologicalSorter(needs)
    order.prepare()
    found: dict[str, Records] = {}
    broken: dict[str, Exception] = {}
    running: dict[Future[Records], str] = {}
    workers = jobs[0].runner.campaign.fleet
    # Two jobs more than workers at once, as some wait for a single long run.
    with threads(workers.count + 2 if workers.count > 1 else 1) as pool:
        try:
            while order.is_active():
                ready = {*order.get_ready()}
                for job in (each for each in jobs if each.name in ready):
                    if lost := [broken[other] for other in needs[job.name] if other in broken]:
                        future = Future[Records]()
                        future.set_exception(lost[0])
                    else:
                        before = sum((found[other] for other in needs[job.name]), Records())
                        future = pool.submit(carry_out, job, before)
                    running[future] = job.name
                for future in first_done(running):
                    name, error = running.pop(future), future.exception()
                    order.done(name)
                    if error is None:
                        found[name] = future.result()
                        yield known[name], future.result()
                    elif isinstance(error, StorageError) or not isinstance(error, Exception):
                        # a full disk, or a file that was touched, is for the user to mend
                        raise error
                    else:
                        broken[name] = error
                        yield known[name], error
        except BaseException:
            # else the threads would wait for runs that nobody wants any more
            workers.close(at_once=True)
            raise


def lacking(job: Job, rows: Sequence[Measurement | Missing]) -> Counter[Planned]:
    """How many planned numbers a protocol lacks without a word: of a set of which it says nothing
    at least one; of the sets of the quick level those up to `Entry.numbers`."""
    name, entry, counts = job.protocol.name, PLAN[job.protocol.name], Counter[str]()
    for row in rows:
        counts[row.set] += max(row.rows, 1) if isinstance(row, Missing) else 1
    by = job.runner
    whole = job.chosen is None and by.level is Level.QUICK and not by.has_own_steps
    least = entry.numbers if whole else 1
    if entry.only:  # it may have sets of its own
        ours = [each for each in entry.trial if each in job.sets]
        return +Counter({Planned(name, each, ""): least - counts.total() for each in ours})
    if not whole and not counts.keys() <= job.sets.keys():
        return Counter()
    return +Counter({Planned(name, each, ""): least - counts[each] for each in job.sets})


def carry_out(job: Job, before: Records) -> Records:
    """What a protocol measures after others; what is kept is not measured again.

    In the end only the runs that a figure draws are kept. Raises `StorageError` where measurements
    can't be read or written, or are another engine's."""
    path, protocol, entry = job.file, job.protocol, PLAN[job.protocol.name]
    label = f"{protocol.name}-{path.parent.name}"
    campaign = job.runner.campaign.part(label, job.name)
    if not path.exists():
        runner = replace(job.runner, engine=job.by, campaign=campaign, protocol=protocol.name)
        strong, rows = dict(job.sets), list[Measurement | Missing]()
        for name, p in job.sets.items():
            weak = UNDAMPED if p.c == 0 else ""
            if p.c and entry.settles and (steps := 1 / (p.c * coarse_step(p))) > LONGEST_WAIT:
                weak = f"drag is so weak (1/c = {1 / p.c:.3g} s, {steps:.2g} time steps)"
                weak += " that motions take too long to settle"
            if weak:
                rows.append(Missing(protocol.name, name, weak))
                del strong[name]
        if entry.only and "reference" not in strong:
            rows.insert(0, Missing(protocol.name, next(iter(strong), ""), entry.only, 0))
        else:
            rows = [*protocol.measure(runner, strong, before), *rows]
        make_directory(path.parent)
        place = f"{campaign.directory.name}/{label}.h5"
        for k, row in enumerate(rows):
            if isinstance(row, Measurement) and protocol.drawn(row) and not runner.has_own_steps:
                rows[k] = replace(row, runs=tuple(f"{place}/{key}" for key in row.runs))
        records = Records.of(rows)
        records = replace(records, planned=records.planned + lacking(job, rows))
        drawn = (run for m in records.measurements for run in m.runs if "/" in run)
        campaign.keep({run.rpartition("/")[2] for run in drawn})
        record.save(records, path, asdict(job.origin))
    campaign.reduce()
    return record.load(path, **asdict(job.origin))
