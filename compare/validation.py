"""The main job: measure, judge claim by claim, keep the results, write the report."""

import math
import os
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache, partial
from pathlib import Path
from typing import Any

from compare.campaign.campaign import Campaign
from compare.campaign.progress import Show, ValidationProgress, show_nothing
from compare.campaign.workers import JUDGING, LateError, Spread, Workers, at_most, processes
from compare.engines.study import FREE, USUAL_ENGINES, Engine, Role
from compare.figures.drawing import Evidence
from compare.method.protocol import Job, Protocol, run, with_needed
from compare.method.record import Missing, Records, RecordsByEngine
from compare.method.runner import Runner
from compare.plan import Level, planned
from compare.report import results
from compare.report.results import Summary
from compare.subjects.catalogue import CLAIMS, PROTOCOLS
from compare.verification.assessment import full_verdict
from compare.verification.claim import Claim, Outcome, Verdict
from compare.verification.judge import forget, select
from model import Parameters
from model.errors import check_type

CLAIMS_SHARE = 2 / 3
"""Share of judging again's time that the claims take, about; the report takes the rest."""
Announce = Callable[[Verdict], None]


def validate(
    output: str | Path = "results",
    *,
    level: Level = Level.DEFAULT,
    claims: Sequence[str] | None = None,
    sets: Mapping[str, Parameters] | None = None,
    engine: Engine | None = None,
    workers: int | Workers = 1,
    limit: float = math.inf,
    progress: Show = show_nothing,
    announce: Announce = lambda verdict: None,
    report: bool = True,
) -> list[Verdict]:
    """Measure with an engine and judge claims; store runs, measurements, summary, report.

    What the directory holds already is not measured again.

    Parameters
    ----------
    output : directory of the results
    level : how much is measured
    claims : ids; all that the level measures for None
    sets : parameter sets by name; those of the level for None
    engine : the engine on trial, alone; the usual ones, MuJoCo on trial, for None
    workers : number of processes, or `Workers` of another kind
    limit : longest real time a run may take, s
    progress, announce : called with how far it is, and with every verdict as soon as it is there
    report : whether to write the page with its figures

    Raises
    ------
    InputError
        For an unknown claim, sets that are no `Parameters`, or an engine that can't run here.
    StorageError
        If the directory can't be written or holds results of another version."""
    forget()
    study = plan(Path(output), level, claims, sets, engine)
    count = min(workers if isinstance(workers, int) else workers.count, os.cpu_count() or 1)
    far = ValidationProgress(progress, len(study.claims), max(count, 1))
    runs = study.output / results.RUNS
    with Campaign(runs, workers, limit=limit, report=far.measuring, passing=True) as campaign:
        found: dict[str, Records] = {}
        verdicts = judge(study.claims, measure(study, campaign, far, found), announce, far)
        files = study.files(campaign)
        kept = results.load_measurements(study.output, level.name, files, found)
        here = campaign.fleet if isinstance(workers, int) else processes(count)
        with here as work:  # those of a scheduler may not see our files
            draw = far.drawing(work.map) if report else None
            write(study.output, level, files, kept, verdicts, draw)
    return [verdicts[claim.id] for claim in study.claims]


@dataclass(frozen=True)
class Study:
    """What a validation is to do."""

    output: Path
    level: Level
    engines: Sequence[Engine]  #: the one on trial first
    claims: Sequence[Claim]  #: those that are to be judged
    protocols: Sequence[Protocol]  #: those that they need, in the order in which they begin
    sets: Mapping[str, Parameters] | None  #: in the place of those that are planned

    def jobs(self, campaign: Campaign, protocols: Sequence[Protocol] | None = None) -> list[Job]:
        """Every protocol by every engine with every step that is planned."""
        return [
            Job(protocol, Runner(campaign, each, self.level, divisor), self.output, self.sets)
            for each in self.engines
            for divisor in each.divisors
            for protocol in protocols or self.protocols
            if planned(protocol.name, each, divisor, self.level)
        ]

    def files(self, campaign: Campaign) -> results.Files:
        """The files of all that is measured by this plan, now or before."""
        files: dict[str, dict[int, list[str]]] = {
            each.name: {n: [] for n in each.divisors} for each in self.engines
        }
        for job in self.jobs(campaign, PROTOCOLS):
            if job.file.exists():
                files[job.runner.engine.name][job.runner.divisor].append(self.place(job))
        return files

    def place(self, job: Job) -> str:
        """Where a protocol's measurements are in the results."""
        return job.file.relative_to(self.output).as_posix()


def plan(
    output: Path,
    level: Level,
    claims: Sequence[str] | None,
    sets: Mapping[str, Parameters] | None,
    engine: Engine | None,
) -> Study:
    """Check what is asked for, see `validate`, and open the directory of the results."""
    check_type("level", level, Level)
    check_type("sets", sets, Mapping | None)
    check_type("engine", engine, Engine | None)
    for p in (sets or {}).values():
        check_type("sets", p, Parameters)
    if engine:
        engine.check()
    chosen = [each for each in select(CLAIMS, claims) if claims or each.level <= level]
    asked = {name for each in chosen for name in each.protocols}
    every = {protocol.name for protocol in PROTOCOLS}
    needed = with_needed(PROTOCOLS, every if claims is None else asked)
    results.open_directory(output)
    free = [replace(FREE, role=Role.FREE_BODY)] if level > Level.QUICK else []
    engines = [engine] if engine else [*USUAL_ENGINES, *free]
    return Study(output, level, engines, chosen, needed, sets)


@dataclass
class SoFar:
    """What has been measured so far."""

    records: dict[str, dict[int, Records]]  #: by engine, the one on trial first, and step divisor
    waiting: Counter[str]  #: how often a protocol is still to be carried out
    broken: dict[str, str] = field(default_factory=dict)
    """Errors of protocols of the engine on trial: each takes its own claims with it."""

    def take(self, job: Job, found: Records | Exception) -> None:
        """Take in what a protocol has measured, or its error."""
        name, engine = job.protocol.name, job.runner.engine.name
        self.waiting[name] -= 1
        if not isinstance(found, Exception):
            self.records[engine][job.runner.divisor] += found
            return
        why = f"{type(found).__name__}: {found}"
        if engine == next(iter(self.records)):
            self.broken[name] = f"{name}: {why}"
        else:
            rows = (Missing(name, each, f"{job.name}: {why}") for each in job.sets)
            self.records[engine][job.runner.divisor] += Records(missing=tuple(rows))

    def verdict(self, claim: Claim) -> Verdict:
        """The verdict on a claim, an error if one of its protocols broke down."""
        judged = full_verdict(claim, self.records)
        errors = [why for name, why in self.broken.items() if name in claim.protocols]
        return replace(judged, outcome=Outcome.ERROR, error="; ".join(errors)) if errors else judged


def measure(
    study: Study, campaign: Campaign, far: ValidationProgress, kept: dict[str, Records]
) -> Iterator[SoFar]:
    """Carry out what is planned; yield all that is measured, at first and after each protocol; put
    what is then in files into `kept`, by their places."""
    jobs = study.jobs(campaign)
    far.costs = {job.name: 0.0 if job.file.exists() else job.cost for job in jobs}
    records = {each.name: dict.fromkeys(each.divisors, Records()) for each in study.engines}
    measured = SoFar(records, Counter(job.protocol.name for job in jobs))
    yield measured
    for job, found in run(jobs):
        far.measured(job.name)
        measured.take(job, found)
        if isinstance(found, Records):
            kept[study.place(job)] = found
        yield measured


def judge(
    claims: Sequence[Claim], measured: Iterable[SoFar], announce: Announce, far: ValidationProgress
) -> dict[str, Verdict]:
    """The verdicts by claim, each as soon as all that it needs is measured."""
    verdicts: dict[str, Verdict] = {}
    for so_far in measured:
        for claim in claims:
            # Next to a threshold a settled state has no limit: see `convergence.MARGIN`.
            needed = claim.protocols | ({"thresholds"} if "settled" in claim.protocols else set())
            if claim.id not in verdicts and not any(so_far.waiting[name] for name in needed):
                verdicts[claim.id] = so_far.verdict(claim)
                announce(verdicts[claim.id])
                far.judged()
    return verdicts


def judge_stored(
    directory: str | Path,
    claims: Sequence[str] | None = None,
    workers: int = 0,
    tell: Callable[[float], object] = lambda done: None,
) -> list[Verdict]:
    """Judge the measurements of a directory again, and write summary and report anew.

    On so many processes; 0 is this one. `tell` is called with the fraction done. Raises
    `StorageError` if a file is missing, damaged, or was changed; `InputError` for an unknown
    claim."""
    directory = Path(directory)
    chosen = {claim.id for claim in select(CLAIMS, claims)}
    summary = results.load(directory)
    stored.cache_clear()
    forget()
    records = stored(directory)  # what can't be read is said before anything is judged
    with processes(workers) as work:
        last_first = range(len(CLAIMS) - 1, -1, -1)  # they take longest
        found = zip(last_first, work.map(partial(_judged, directory), last_first), strict=True)
        verdicts = dict[str, Verdict]()
        for n, each in found:
            verdicts[CLAIMS[n].id] = Verdict(claim=CLAIMS[n], **each)
            tell(CLAIMS_SHARE * len(verdicts) / len(CLAIMS))
        level, files = Level[summary.level], summary.measurements
        written = write(directory, level, files, records, verdicts, work.map)
    return [v for v in written if v.claim.id in chosen]


def _judged(directory: Path, number: int) -> dict[str, Any]:
    """In a worker: judge a claim; the verdict's fields, since claims can't be sent."""
    judged = _in_time(CLAIMS[number], stored(directory))
    return {name: value for name, value in vars(judged).items() if name != "claim"}


def _in_time(claim: Claim, records: RecordsByEngine) -> Verdict:
    """The verdict on a claim; if judging it takes too long, one that says so."""
    try:
        with at_most(JUDGING):
            return full_verdict(claim, records)
    except LateError as error:
        return Verdict(claim=claim, outcome=Outcome.ERROR, error=str(error))


@cache
def stored(directory: Path) -> RecordsByEngine:
    """The measurements of the last validation in a directory, read once in a process."""
    summary = results.load(directory)
    return results.load_measurements(directory, summary.level, summary.measurements, {})


def evidence(directory: Path, verdicts: Sequence[Verdict], records: RecordsByEngine) -> Evidence:
    """Collect what figures draw: checks by claim, measurements at half the usual step."""
    checks = {
        v.claim.id: (*v.checks, *(c for w in v.engines[1:] for c in w.checks)) for v in verdicts
    }
    first, *others = [steps.get(2, steps[min(steps)]) for steps in records.values()] or [Records()]
    return Evidence(checks, first, directory, sum(others, Records()))


def told(name: str, directory: Path) -> tuple[Claim, Verdict | None, Summary]:
    """A claim, the verdict on the measurements that a directory holds of it, None where it holds
    no validation, and their summary. Raises as `judge_stored`."""
    (claim,) = select(CLAIMS, [name])
    if not (directory / results.SUMMARY).exists():
        return claim, None, Summary()
    return claim, _in_time(claim, stored(directory)), results.load(directory)


def stored_evidence(directory: Path) -> Evidence:
    """As `evidence`, of a stored validation, judged again; empty if there is none."""
    if not (directory / results.SUMMARY).exists():
        return Evidence()
    records = stored(directory)
    return evidence(directory, [_in_time(claim, records) for claim in CLAIMS], records)


def write(
    directory: Path,
    level: Level,
    files: results.Files,
    records: RecordsByEngine,
    known: Mapping[str, Verdict],
    over: Spread | None,
) -> list[Verdict]:
    """Judge what isn't known yet; write the summary, and the report if there is a `map` for its
    figures; return the verdicts on all claims."""
    verdicts = [known.get(claim.id) or full_verdict(claim, records) for claim in CLAIMS]
    summary = Summary.of(verdicts, level, files)
    if over:
        from compare.report import report as page  # here, because drawing takes a second to load

        page.write(evidence(directory, verdicts, records), verdicts, summary, over)
    else:
        results.save(summary, directory)
    return verdicts
