"""What a trajectory holds, for a person: as data, and as a table."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

from rich.table import Table

from compare.kit import pages
from model import Case, Flow, Parameters, storage
from model.kinematics import UNITS, VARIABLES

LISTED = 20
"""Most phases, and most events, that are listed."""
PART = 10_000
"""Samples read at a time, so that a file may be larger than memory."""


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
    return {
        **{name: getattr(header, name) for name in ("engine", "failure", "commit", "created")},
        "complete": last.complete,
        "parameters": dataclasses.asdict(header.parameters),
        "flow": header.flow.to_mapping(),
        "settings": header.settings,
        "versions": header.versions,
        "samples": samples,
        "duration": float(last.time[-1]) if samples else 0.0,
        "cases": [{"case": case.name, "from": start, "to": end} for case, start, end in stretches],
        "events": [
            {"time": t, "from": Case(a).name, "to": Case(b).name}
            for t, a, b in zip(events.time, events.from_case, events.to_case, strict=True)
        ],
        "last": dict(zip(VARIABLES, last.x[-1], strict=True)) if samples else {},
    }


def table(about: dict[str, Any]) -> Table:
    """What `describe` returned as a table of two columns."""

    def listed(items: list[str]) -> str:
        more = [f"… and {len(items) - LISTED} more"] if len(items) > LISTED else []
        return "\n".join(items[:LISTED] + more) or "none"

    def short(value: Any) -> str:
        if isinstance(value, list):
            return f"[{', '.join(map(short, value))}]"
        return f"{value:g}" if isinstance(value, float) else str(value)

    parameters, flow = about["parameters"], Flow.from_mapping(about["flow"])
    units = {field.name: pages.readable(field.metadata["unit"]) for field in Parameters.quantities()}
    told = f"{flow.kind}, ω₀ from {flow.value[0]:g} to {flow.value[-1]:g} rad/s within {flow.start[-1]:g} s"
    if flow.is_steady:
        told = f"steady, ω₀ = {flow.value[0]:g} rad/s"
    elif len(flow.waves):
        waves = ", ".join(f"{amplitude:g} rad/s at {frequency:g} Hz" for amplitude, frequency, _ in flow.waves)
        told = f"{flow.kind}, ω₀ = {flow.value[0]:g} rad/s with waves of {waves}"
    last = zip(VARIABLES, UNITS, strict=True) if about["last"] else ()
    rows = {
        "engine": f"{about['engine']} ({', '.join(f'{k} {v}' for k, v in about['versions'].items())})",
        "made": f"{about['created']} {about['commit'][:12]}".strip(),
        "parameters": ", ".join(f"{name} = {parameters[name]:g} {unit}".strip() for name, unit in units.items()),
        "drag": parameters["drag"],
        "flow": told,
        "settings": ", ".join(f"{k} = {short(v)}" for k, v in about["settings"].items()),
        "samples": f"{about['samples']} over {about['duration']:g} s",
        "cases": listed([f"{p['case']} {p['from']:.6g}…{p['to']:.6g} s" for p in about["cases"]]),
        "events": listed([f"{e['time']:.9g} s  {e['from']} → {e['to']}" for e in about["events"]]),
        "last state": "\n".join(f"{n} = {about['last'][n]:.9g} {pages.readable(u)}" for n, u in last),
    }
    return pages.pairs(rows | ({"failure": about["failure"]} if about["failure"] else {}))
