"""The results directory: run files, the summary of the verdicts, the report."""

from __future__ import annotations

import dataclasses
import json
import os
import platform
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from compare.claims import Verdict
from model.errors import StorageError
from model.files import write_text
from model.trajectory import current_commit, current_versions

SUMMARY = "summary.json"
REPORT = "report.html"
RUNS = "runs"
FIGURES = "figures"
SCHEMA = "dualball-summary"
SCHEMA_VERSION = 2


@dataclass(frozen=True)
class Summary:
    """Everything the report needs apart from the run files, as JSON-able data."""

    level: str = "QUICK"
    verdicts: dict[str, dict[str, Any]] = field(default_factory=dict)
    """By claim id: the claim's texts, the outcome, whether it was to be expected, and the checks."""
    provenance: dict[str, Any] = field(default_factory=dict)

    def with_verdicts(self, level: str, verdicts: Iterable[Verdict]) -> Summary:
        """A copy with verdicts added or replaced, and the provenance of now."""
        added = {verdict.claim.id: describe(verdict) for verdict in verdicts}
        return Summary(level, {**self.verdicts, **added}, _provenance())


def describe(verdict: Verdict) -> dict[str, Any]:
    """A verdict as JSON-able data."""
    claim = {f.name: getattr(verdict.claim, f.name) for f in dataclasses.fields(verdict.claim) if f.name != "study"}
    checks = [{**dataclasses.asdict(check), "error": check.error, "passed": check.passed} for check in verdict.checks]
    return {
        **claim,
        "outcome": verdict.outcome,
        "passed": verdict.passed,
        "error": verdict.error,
        "seconds": verdict.seconds,
        "checks": checks,
    }


def open_directory(directory: Path) -> Summary:
    """Make sure that results may be written here, and return what is there already.

    Raises `StorageError` if the directory can't be written or holds results of another version of the program.
    """
    try:
        (directory / RUNS).mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise StorageError(f"cannot write to {directory}: {error.strerror}") from error
    if not os.access(directory, os.W_OK | os.X_OK):
        raise StorageError(f"cannot write to {directory}: Permission denied")
    if not (directory / SUMMARY).exists():
        return Summary()
    return load(directory)


def load(directory: Path) -> Summary:
    """Read the summary; raises `StorageError` if there is none or it is of another version."""
    path = directory / SUMMARY
    try:
        content = json.loads(path.read_text("utf-8"))
    except OSError as error:
        raise StorageError(f"cannot read {path}: {error.strerror}; run 'dualball validate -o {directory}'") from error
    except ValueError as error:
        raise StorageError(f"{path} is not JSON: {error}") from error
    if not isinstance(content, Mapping) or content.get("schema") != SCHEMA:
        raise StorageError(f"{path} is not a {SCHEMA}")
    found, ours = content.get("provenance", {}).get("versions", {}).get("dualball"), current_versions()["dualball"]
    if content.get("schema_version") != SCHEMA_VERSION:
        raise StorageError(f"{path} is in another format than this program's: choose another directory with --output")
    if found != ours:
        raise StorageError(
            f"{directory} holds results of dualball {found}, this is {ours}: choose another directory with --output"
        )
    return Summary(content["level"], content["verdicts"], content["provenance"])


def save(summary: Summary, directory: Path) -> None:
    """Write the summary, whole or not at all."""
    content = {"schema": SCHEMA, "schema_version": SCHEMA_VERSION, **dataclasses.asdict(summary)}
    write_text(directory / SUMMARY, json.dumps(content, indent=1, ensure_ascii=False, allow_nan=True))


def _provenance() -> dict[str, Any]:
    return {
        "versions": dict(current_versions()),
        "commit": current_commit(),
        "machine": f"{platform.system()} {platform.machine()}, {os.cpu_count()} processors",
        "created": datetime.now(UTC).isoformat(timespec="seconds"),
    }
