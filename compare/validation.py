"""The main job: measure, judge claim by claim, keep the results, write the report."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import replace
from functools import cache, partial
from pathlib import Path
from typing import Any

from compare.catalogue import CLAIMS, PROTOCOLS
from compare.claim import Claim, Outcome, Verdict
from compare.judge import forget, judge, select, verdict
from compare.kit import programme, record
from compare.kit.campaign import Campaign
from compare.kit.drawing import Material
from compare.kit.engines import MUJOCO, Engine
from compare.kit.lab import Lab
from compare.kit.levels import Level
from compare.kit.progress import Show, Whole, nowhere
from compare.kit.record import Records
from compare.kit.workers import Spread, Workers, spread
from compare.report import results
from compare.report.results import Summary
from model import Parameters

Announce = Callable[[Verdict], None]
"""Called with every verdict as soon as it is there."""


def validate(
    output: str | Path = "results",
    *,
    level: Level = Level.DEFAULT,
    claims: Sequence[str] | None = None,
    sets: Mapping[str, Parameters] | None = None,
    engine: Engine = MUJOCO,
    workers: int | Workers = 1,
    limit: float = math.inf,
    progress: Show = nowhere,
    announce: Announce = lambda verdict: None,
    report: bool = True,
) -> list[Verdict]:
    """Measure with an engine and judge claims on what was measured; store runs, measurements, summary and report.

    What the directory holds already is not measured again. A claim is judged as soon as its measurements are there.

    Parameters
    ----------
    claims : ids; all that the level measures for None
    sets : parameter sets by name; those of the level for None

    Raises
    ------
    InputError
        For an unknown claim.
    StorageError
        If the directory can't be written or holds results of another version.
    """
    output, chosen = Path(output), [each for each in select(CLAIMS, claims) if claims or each.level <= level]
    results.open_directory(output)
    names = [protocol.name for protocol in PROTOCOLS] if claims is None else [n for c in chosen for n in c.protocols]
    todo = [protocol for protocol in programme.needed(PROTOCOLS, names) if protocol.level <= level]
    waiting, records, broken = {protocol.name for protocol in todo}, Records(), dict[str, str]()
    judged: dict[str, Future[Verdict]] = {}
    whole = Whole(progress, {protocol.name: protocol.cost for protocol in todo}, len(chosen))

    def judge_what_is_there() -> None:
        for claim in chosen:
            if claim.id not in judged and not waiting & claim.protocols:
                judged[claim.id] = bench.submit(_announced, claim, records, dict(broken), announce)
                judged[claim.id].add_done_callback(lambda _: whole.judged())

    with (
        ThreadPoolExecutor(1) as bench,  # judges while the next protocols' runs are on their way
        Campaign(output / results.RUNS, workers, limit=limit, report=whole.measuring) as campaign,
    ):
        judge_what_is_there()
        for protocol, found in programme.run(todo, Lab(campaign, engine, level), sets, output):
            waiting.remove(protocol.name)
            whole.measured(protocol.name)
            if isinstance(found, Records):
                records += found
            else:  # a protocol that breaks down takes its own claims with it, and no others
                broken[protocol.name] = f"{protocol.name}: {type(found).__name__}: {found}"
            judge_what_is_there()
    verdicts = {name: future.result() for name, future in judged.items()}
    files = [path for each in PROTOCOLS if (path := programme.file(each, output, engine, level, sets)).exists()]
    count = workers if isinstance(workers, int) else workers.count
    with spread(min(count, os.cpu_count() or 1)) as over:
        draw = whole.drawing(over) if report else None
        _write(output, level, files, sum(map(record.load, files), Records()), verdicts, draw)
    return [verdicts[claim.id] for claim in chosen]


def judge_stored(directory: str | Path, claims: Sequence[str] | None = None, workers: int = 0) -> list[Verdict]:
    """Judge the measurements of the last validation in a directory again, and write summary and report anew.

    On so many processes; 0 is this one. Raises `StorageError` if a file is missing, damaged, or was changed;
    `InputError` for an unknown claim.
    """
    directory = Path(directory)
    chosen = {claim.id for claim in select(CLAIMS, claims)}
    summary = results.load(directory)
    stored.cache_clear()
    forget()
    records = stored(directory)  # what can't be read is said before anything is judged
    files = [directory / name for name in summary.measurements]
    with spread(workers) as over:  # the last claims first: they take longest
        found = over(partial(_judged, directory), range(len(CLAIMS) - 1, -1, -1))
        verdicts = {claim.id: Verdict(claim=claim, **each) for claim, each in zip(CLAIMS[::-1], found, strict=True)}
        written = _write(directory, Level[summary.level], files, records, verdicts, over)
    return [v for v in written if v.claim.id in chosen]


def _judged(directory: Path, number: int) -> dict[str, Any]:
    """What there is to say of a claim; claims themselves don't go from process to process."""
    judged = verdict(CLAIMS[number], stored(directory))
    return {name: value for name, value in vars(judged).items() if name != "claim"}


@cache
def stored(directory: Path) -> Records:
    """The measurements of the last validation in a directory, read once in a process."""
    return results.load(directory).records(directory)


def material(directory: Path, verdicts: Sequence[Verdict], records: Records) -> Material:
    """What figures of a results directory are made of."""
    return Material({v.claim.id: v.checks for v in verdicts}, records, directory)


def stored_material(directory: Path) -> Material:
    """The same from what is stored, judged again; of theory alone if nothing is."""
    if not (directory / results.SUMMARY).exists():
        return Material()
    records = results.load(directory).records(directory)
    return material(directory, judge(CLAIMS, records), records)


def _write(
    directory: Path,
    level: Level,
    files: Sequence[Path],
    records: Records,
    known: Mapping[str, Verdict],
    over: Spread | None,
) -> list[Verdict]:
    """Judge what isn't known yet, and write the summary, and the report with what is to draw figures, if anything.

    Return the verdicts on all claims.
    """
    others = {v.claim.id: v for v in judge([claim for claim in CLAIMS if claim.id not in known], records)}
    verdicts = [known.get(claim.id) or others[claim.id] for claim in CLAIMS]
    summary = Summary.of(directory, verdicts, level, files)
    if over:
        from compare.report import report as page  # here, because drawing takes a second to load

        page.write(material(directory, verdicts, records), verdicts, summary, over)
    else:
        results.save(summary, directory)
    return verdicts


def _announced(claim: Claim, records: Records, broken: Mapping[str, str], announce: Announce) -> Verdict:
    """The verdict, or that one of the protocols of its claim broke down."""
    (judged,) = judge([claim], records)
    if errors := [why for name, why in broken.items() if name in claim.protocols]:
        judged = replace(judged, outcome=Outcome.ERROR, error="; ".join(errors))
    announce(judged)
    return judged
