"""The results directory: runs, measurements, the summary of verdicts, figures, report."""

from __future__ import annotations

import dataclasses
import json
import os
import platform
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from compare.method import record
from compare.method.record import Records, RecordsByEngine
from compare.method.statistics import plain
from compare.plan import Level
from compare.verification.claim import Verdict
from model.errors import StorageError
from model.files import check_ours, make_directory, reading_json, write_text
from model.versions import current_commit, current_versions

SUMMARY, REPORT, RUNS = "summary.json", "report.html", "runs"
SCHEMA, SCHEMA_VERSION = "dualball-summary", 6

Files = Mapping[str, Mapping[int, Sequence[str]]]
"""Files of measurements, relative to the results directory: by engine, the one on trial first, and
time steps in one that a protocol asks for."""


@dataclass(frozen=True)
class Summary:
    """What a validation came to, as JSON-able data."""

    level: str = Level.QUICK.name
    measurements: Files = field(default_factory=dict)
    """Those that were judged."""
    verdicts: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    """By claim id: outcome, number of checks, resolving power."""
    provenance: Mapping[str, Any] = field(default_factory=dict)

    @classmethod
    def of(cls, verdicts: Iterable[Verdict], level: Level, measured: Files) -> Summary:
        """The summary of verdicts that were reached now, on measurements in files."""
        provenance = {
            "versions": dict(current_versions()),
            "commit": current_commit(),
            "machine": f"{platform.system()} {platform.machine()}, {os.cpu_count()} processors",
            "created": datetime.now(UTC).isoformat(timespec="seconds"),
        }
        outcomes = {verdict.claim.id: _outcome(verdict) for verdict in verdicts}
        return cls(level.name, measured, outcomes, provenance)


def load_measurements(
    directory: Path, level: str, files: Files, read: Mapping[str, Records]
) -> RecordsByEngine:
    """The measurements in files of a directory, at the level of that name; some are `read`, by
    their names.

    Raises `StorageError` for a file that is not whole, or holds what another engine measured,
    another protocol, or by another plan than its place says."""

    def load(name: str, engine: str, step: int) -> Records:
        if name in read:
            return read[name]
        path = directory / name
        return record.load(
            path,
            protocol=path.stem,
            engine=engine,
            step=step,
            level=level,
            program=current_versions()["dualball"],
            plan=path.parent.name,
        )

    return {
        engine: {
            n: sum((load(name, engine, n) for name in names), Records())
            for n, names in steps.items()
        }
        for engine, steps in files.items()
    }


def described(verdict: Verdict) -> dict[str, Any]:
    """A verdict with all its checks as JSON-able data; a number that is not finite is null."""
    claim = verdict.claim
    texts = {
        name: getattr(claim, name) for name in ("section", "source", "statement", "text", "reason")
    }
    of_measurement = "protocol quantity unit engine set uncertainty budget runs".split()
    numbers = "relation predicted deviation tolerance scale resolution agrees conclusive".split()
    checks = []
    for check in verdict.checks:
        m = check.measurement
        about = {name: getattr(m, name) for name in of_measurement}
        about |= {name: getattr(check, name) for name in numbers} | {"conditions": m.at}
        checks.append(about | {"parameters": dataclasses.asdict(m.parameters), "measured": m.value})
    return _outcome(verdict) | texts | {"checks": plain(checks)}


def _outcome(verdict: Verdict) -> dict[str, Any]:
    """A verdict in numbers, without its checks, and what engines say; JSON-able."""
    about = {"id": verdict.claim.id, "verdict": verdict.outcome, "passed": verdict.passed}
    counts = {"checks": len(verdict.checks), "agrees": sum(each.agrees for each in verdict.checks)}
    counts |= {"conclusive": verdict.told, "left_out": verdict.left_out}
    counts |= {"planned": verdict.planned}
    power = {"resolving_power": verdict.resolving_power, "worst": verdict.worst}
    less = {"expected": verdict.claim.expected, "missing": [*map(str, verdict.missing)]}
    about["engines"] = {
        each.engine: {
            name: getattr(each, name) for name in ("outcome", "reason", "order", "left_out")
        }
        | {"checks": len(each.checks), "worst": each.worst, "resolving_power": each.resolving_power}
        | {"deviation_at_2ms": {"typical": each.typical, "worst": each.farthest}}
        for each in verdict.engines
    }
    told: dict[str, Any] = plain(about | counts | power | less | {"error": verdict.error})
    return told


def open_directory(directory: Path) -> None:
    """Make a directory for results, and check that they may be written there. Raises `StorageError`
    if the directory can't be written or holds results of another version of the program."""
    make_directory(directory)
    check_ours(directory / REPORT, beside=directory / SUMMARY)
    make_directory(directory / RUNS)
    if (directory / SUMMARY).exists():
        load(directory)


def load(directory: Path) -> Summary:
    """Read the summary; raises `StorageError` if there is none or it is of another version."""
    path = directory / SUMMARY
    if not path.exists():
        raise StorageError(
            f"cannot read {path}: No such file or directory; run 'dualball validate -o {directory}'"
        )
    with reading_json(path, "summary that this program reads") as content:
        if content["schema"] != SCHEMA or content["schema_version"] != SCHEMA_VERSION:
            raise ValueError("it is in another format; choose another directory with --output")
        Level[content["level"]]
        files = {
            engine: {int(n): [*map(str, names)] for n, names in steps.items()}
            for engine, steps in content["measurements"].items()
        }
        summary = Summary(
            content["level"], files, *(dict(content[name]) for name in ("verdicts", "provenance"))
        )
        version, ours = summary.provenance["versions"]["dualball"], current_versions()["dualball"]
    if version != ours:
        held = f"{directory} holds results of dualball {version}, this is {ours}"
        raise StorageError(f"{held}: choose another directory with --output")
    return summary


def save(summary: Summary, directory: Path) -> None:
    content = {"schema": SCHEMA, "schema_version": SCHEMA_VERSION, **vars(summary)}
    write_text(directory / SUMMARY, json.dumps(content, ensure_ascii=False, allow_nan=False))
