"""The main job: measure, judge claim by claim, keep the results, write the report."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future
from dataclasses import dataclass, replace
from functools import cache, partial
from pathlib import Path
from typing import Any

from compare.catalogue import CLAIMS, PROTOCOLS
from compare.claim import Claim, Outcome, Verdict
from compare.judge import forget, select
from compare.kit import programme
from compare.kit.campaign import Campaign
from compare.kit.drawing import Evidence
from compare.kit.engines import WITNESSES, Engine
from compare.kit.lab import Lab
from compare.kit.levels import Level
from compare.kit.programme import Job
from compare.kit.progress import Show, ValidationProgress, show_nothing
from compare.kit.record import Missing, Records, RecordsByEngine
from compare.kit.workers import JUDGING, LateError, Spread, Workers, at_most, processes, threads
from compare.report import results
from compare.report.results import Summary
from compare.witnesses import full_verdict
from model import Parameters
from model.errors import check_type

Announce = Callable[[Verdict], None]
"""Called with every verdict as soon as it is there."""


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
    """Measure with an engine and judge claims on what was measured; store runs, measurements,
    summary and report.

    What the directory holds already is not measured again. A claim is judged as soon as its
    measurements are there.

    Parameters
    ----------
    output : directory of the results
    level : how much is measured
    claims : ids; all that the level measures for None
    sets : parameter sets by name; those of the level for None
    engine : the engine on trial, alone; MuJoCo and the witnesses beside it for None
    workers : number of processes, or `Workers` of another kind
    limit : longest real time a run may take, s
    progress, announce : called with how far it is, and with every verdict
    report : whether to write the page with its figures

    Raises
    ------
    InputError
        For an unknown claim, sets that are no `Parameters`, or an engine that can't run here.
    StorageError
        If the directory can't be written or holds results of another version.
    """
    for p in (sets or {}).values():
        check_type("sets", p, Parameters)
    if engine:
        engine.check()
    forget()
    output, chosen = (
        Path(output),
        [each for each in select(CLAIMS, claims) if claims or each.level <= level],
    )
    results.open_directory(output)
    names = (
        [protocol.name for protocol in PROTOCOLS]
        if claims is None
        else [n for c in chosen for n in c.protocols]
    )
    todo = [
        protocol
        for protocol in programme.with_needed(PROTOCOLS, names)
        if protocol.assignment.level <= level
    ]
    engines = [engine] if engine else [*WITNESSES]
    far = ValidationProgress(progress, {}, len(chosen))
    with (
        threads(1) as bench,  # judges while the next protocols' runs are on their way
        Campaign(
            output / results.RUNS, workers, limit=limit, report=far.measuring, passing=True
        ) as campaign,
    ):
        labs = [Lab(campaign, each, level, refine) for each in engines for refine in each.refine]
        known = [
            Job(each, lab, output, sets) for lab in labs for each in PROTOCOLS if each.measures(lab)
        ]
        jobs = [job for job in known if job.protocol in todo]
        far.costs = {job.name: job.cost for job in jobs}
        judging = _Judging(
            chosen, engines, lambda *of: bench.submit(_announced, announce, *of), far.judged
        )
        judging.judge(jobs)
        for job, found in programme.run(tuple(jobs)):
            jobs.remove(job)
            far.measured(job.name)
            judging.take(job, found)
            judging.judge(jobs)
    verdicts = {name: future.result() for name, future in judging.judged.items()}
    files: dict[str, dict[int, list[str]]] = {
        each.name: {n: [] for n in each.refine} for each in engines
    }
    for job in known:
        if job.file.exists():
            files[job.lab.engine.name][job.lab.refine].append(
                job.file.relative_to(output).as_posix()
            )
    count = workers if isinstance(workers, int) else workers.count
    with processes(min(count, os.cpu_count() or 1)) as work:
        draw = far.drawing(work.map) if report else None
        measured = results.load_measurements(output, level.name, files)
        _write(output, level, files, measured, verdicts, draw)
    return [verdicts[claim.id] for claim in chosen]


@dataclass
class _Judging:
    """Claims that are judged as soon as all that they need is measured."""

    claims: Sequence[Claim]
    engines: Sequence[Engine]
    """The one on trial first."""
    submit: Callable[..., Future[Verdict]]
    done: Callable[[], None]

    def __post_init__(self) -> None:
        self.measured = {each.name: dict.fromkeys(each.refine, Records()) for each in self.engines}
        self.broken, self.judged = dict[str, str](), dict[str, Future[Verdict]]()

    def take(self, job: Job, found: Records | Exception) -> None:
        """Take in what a protocol has measured, or its error, which takes its own claims with it,
        and no others."""
        if isinstance(found, Exception):
            why = f"{type(found).__name__}: {found}"
            name = job.protocol.name
            if job.lab.engine is self.engines[0]:
                self.broken[name] = f"{name}: {why}"
                return
            found = Records(
                missing=tuple(Missing(name, each, f"{job.name}: {why}") for each in job.sets)
            )
        self.measured[job.lab.engine.name][job.lab.refine] += found

    def judge(self, jobs: Sequence[Job]) -> None:
        """Begin to judge all claims that wait for none of these protocols."""
        waiting = {job.protocol.name for job in jobs}
        for claim in self.claims:
            # Next to a threshold a settled state has no limit: see `witnesses.MARGIN`.
            needed = claim.protocols | ({"thresholds"} if "settled" in claim.protocols else set())
            if claim.id not in self.judged and not waiting & needed:
                heard = {name: dict(steps) for name, steps in self.measured.items()}
                self.judged[claim.id] = self.submit(claim, heard, dict(self.broken))
                self.judged[claim.id].add_done_callback(lambda _: self.done())


def judge_stored(
    directory: str | Path, claims: Sequence[str] | None = None, workers: int = 0
) -> list[Verdict]:
    """Judge the measurements of the last validation in a directory again, and write summary and
    report anew.

    On so many processes; 0 is this one. Raises `StorageError` if a file is missing, damaged, or was
    changed; `InputError` for an unknown claim."""
    directory = Path(directory)
    chosen = {claim.id for claim in select(CLAIMS, claims)}
    summary = results.load(directory)
    stored.cache_clear()
    forget()
    testimony = stored(directory)  # what can't be read is said before anything is judged
    with processes(workers) as work:  # the last claims first: they take longest
        found = work.map(partial(_judged, directory), range(len(CLAIMS) - 1, -1, -1))
        verdicts = {
            claim.id: Verdict(claim=claim, **each)
            for claim, each in zip(CLAIMS[::-1], found, strict=True)
        }
        written = _write(
            directory, Level[summary.level], summary.measurements, testimony, verdicts, work.map
        )
    return [v for v in written if v.claim.id in chosen]


def _judged(directory: Path, number: int) -> dict[str, Any]:
    """In a worker: judge a claim by its number; the verdict's fields, since claims can't be sent
    between processes."""
    judged = _in_time(CLAIMS[number], stored(directory))
    return {name: value for name, value in vars(judged).items() if name != "claim"}


def _in_time(claim: Claim, testimony: RecordsByEngine) -> Verdict:
    """The verdict on a claim; if judging it takes too long, one that says so."""
    try:
        with at_most(JUDGING):
            return full_verdict(claim, testimony)
    except LateError as error:
        return Verdict(claim=claim, outcome=Outcome.ERROR, error=str(error))


@cache
def stored(directory: Path) -> RecordsByEngine:
    """The measurements of the last validation in a directory, read once in a process."""
    summary = results.load(directory)
    return results.load_measurements(directory, summary.level, summary.measurements)


def evidence(directory: Path, verdicts: Sequence[Verdict], testimony: RecordsByEngine) -> Evidence:
    """Collect what figures draw: checks by claim, and each engine's measurements, at half the usual
    step if there."""
    checks = {
        v.claim.id: (*v.checks, *(c for w in v.witnesses[1:] for c in w.checks)) for v in verdicts
    }
    first, *others = [steps.get(2, steps[min(steps)]) for steps in testimony.values()] or [
        Records()
    ]
    return Evidence(checks, first, directory, sum(others, Records()))


def stored_evidence(directory: Path) -> Evidence:
    """As `evidence`, of a stored validation, which is judged again; empty if the directory holds
    none."""
    if not (directory / results.SUMMARY).exists():
        return Evidence()
    testimony = stored(directory)
    return evidence(directory, [_in_time(claim, testimony) for claim in CLAIMS], testimony)


def _write(
    directory: Path,
    level: Level,
    files: results.Files,
    testimony: RecordsByEngine,
    known: Mapping[str, Verdict],
    over: Spread | None,
) -> list[Verdict]:
    """Judge what isn't known yet, and write the summary, and the report with what is to draw
    figures, if anything.

    Return the verdicts on all claims.
    """
    verdicts = [known.get(claim.id) or full_verdict(claim, testimony) for claim in CLAIMS]
    summary = Summary.of(verdicts, level, files)
    if over:
        from compare.report import report as page  # here, because drawing takes a second to load

        page.write(evidence(directory, verdicts, testimony), verdicts, summary, over)
    else:
        results.save(summary, directory)
    return verdicts


def _announced(
    announce: Announce, claim: Claim, testimony: RecordsByEngine, broken: Mapping[str, str]
) -> Verdict:
    """Judge a claim, an error if one of its protocols broke down, and hand the verdict to whoever
    wants to know."""
    judged = full_verdict(claim, testimony)
    if errors := [why for name, why in broken.items() if name in claim.protocols]:
        judged = replace(judged, outcome=Outcome.ERROR, error="; ".join(errors))
    announce(judged)
    return judged
