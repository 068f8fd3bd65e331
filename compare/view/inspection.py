"""What a trajectory holds, for a person: in words, as a table, as a plot."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

from rich.table import Table

from compare import pages
from model import Case, Flow, Parameters, storage
from model.kinematics import UNITS, VARIABLES

LISTED = 20
"""Most phases, and most events, that are listed."""
PART = 10_000
"""Samples that are read at a time, so that a file may be larger than memory."""


def describe(path: Path) -> dict[str, Any]:
    """Parameters, versions, cases over time, events and last state of a stored run, JSON-able.

    Raises `StorageError` for a file that isn't a trajectory or isn't whole.
    """
    samples = 0
    stretches: list[tuple[Case, float, float]] = []
    for last in storage.parts(path, PART):
        samples += len(last.time)
        for case, start, end in last.phases():
            if stretches and stretches[-1][0] is case:
                start = stretches.pop()[1]
            stretches.append((case, start, end))
    header, events = last.header, last.events
    about = {name: getattr(header, name) for name in ("engine", "failure", "commit", "created")}
    return about | {
        "complete": last.complete,
        "parameters": dataclasses.asdict(header.parameters),
        "flow": header.flow.to_mapping(),
        "settings": dict(header.settings),
        "versions": dict(header.versions),
        "samples": samples,
        "duration": float(last.time[-1]) if samples else 0.0,
        "cases": [{"case": case.name, "from": start, "to": end} for case, start, end in stretches],
        "events": [
            {"time": float(t), "from": Case(a).name, "to": Case(b).name}
            for t, a, b in zip(events.time, events.from_case, events.to_case, strict=True)
        ],
        "last": dict(zip(VARIABLES, last.x[-1].tolist(), strict=True)) if samples else {},
    }


def table(about: dict[str, Any]) -> Table:
    """What `describe` returned as a table of two columns."""
    units = {f.name: "" if f.metadata["unit"] == "1" else f.metadata["unit"] for f in Parameters.quantities()}
    parameters = (f"{name} = {about['parameters'][name]:g} {unit}".strip() for name, unit in units.items())
    last = (f"{n} = {about['last'][n]:.9g} {u}" for n, u in zip(VARIABLES, UNITS, strict=True) if about["last"])
    rows = {
        "engine": f"{about['engine']} ({', '.join(f'{k} {v}' for k, v in about['versions'].items())})",
        "made": f"{about['created']} {about['commit'][:12]}".strip(),
        "parameters": ", ".join(parameters),
        "drag": about["parameters"]["drag"],
        "flow": _flow(Flow.from_mapping(about["flow"])),
        "settings": ", ".join(f"{k} = {_short(v)}" for k, v in about["settings"].items()),
        "samples": f"{about['samples']} over {about['duration']:g} s",
        "cases": _listed([f"{p['case']} {p['from']:.6g}…{p['to']:.6g} s" for p in about["cases"]]),
        "events": _listed([f"{e['time']:.9g} s  {e['from']} → {e['to']}" for e in about["events"]]),
        "last state": "\n".join(last),
    }
    return pages.pairs(rows | ({"[red]failure": about["failure"]} if about["failure"] else {}))


def _flow(flow: Flow) -> str:
    if flow.is_steady:
        return f"steady, omega_0 = {flow.value[0]:g} rad/s"
    if len(flow.waves):
        waves = (f"{amplitude:g} rad/s at {frequency:g} Hz" for amplitude, frequency, _ in flow.waves)
        return f"{flow.kind}, omega_0 = {flow.value[0]:g} rad/s with waves of {', '.join(waves)}"
    return f"{flow.kind}, omega_0 from {flow.value[0]:g} to {flow.value[-1]:g} rad/s within {flow.start[-1]:g} s"


def _short(value: Any) -> str:
    if isinstance(value, list):
        return "[" + ", ".join(_short(v) for v in value) + "]"
    return f"{value:g}" if isinstance(value, float) else str(value)


def _listed(items: list[str]) -> str:
    more = f"\n… and {len(items) - LISTED} more" if len(items) > LISTED else ""
    return ("\n".join(items[:LISTED]) + more) or "none"
