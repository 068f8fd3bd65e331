"""Which protocols there are, in what order they measure, and where their measurements are kept.

A protocol is a function of a lab, the parameter sets, and what was measured before it; it yields measurements, and what
it could not measure. To add one, write a module and add a record here.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterable, Mapping
from dataclasses import asdict, dataclass
from functools import cache
from pathlib import Path

from compare.measure import record
from compare.measure.lab import Lab, Level
from compare.measure.record import Measurement, Missing, Records
from compare.runs.engines import Engine
from compare.runs.tasks import sources
from model import Parameters
from model.files import make_directory

DIRECTORY = "measurements"
Measure = Callable[[Lab, Mapping[str, Parameters], Records], Iterable[Measurement | Missing]]


@dataclass(frozen=True)
class Protocol:
    """One way to measure."""

    name: str
    measure: Measure
    needs: tuple[str, ...] = ()
    """Protocols whose measurements it goes out from."""
    level: Level = Level.QUICK
    """The least level of which it is a part."""


def directory(results: Path, engine: Engine, level: Level, sets: Mapping[str, Parameters]) -> Path:
    """Where measurements of one engine, level and choice of sets are kept: others, and other programs', are apart."""
    identity = [engine.name, level.name, {name: asdict(p) for name, p in sets.items()}, _program(engine)]
    return results / DIRECTORY / hashlib.sha256(json.dumps(identity).encode()).hexdigest()[:16]


@cache
def _program(engine: Engine) -> str:
    return sources(*engine.sources, "compare", "compare.measure")


def needed(protocols: Iterable[Protocol], names: Iterable[str]) -> list[Protocol]:
    """The protocols of these names and those they go out from, in order."""
    known = {protocol.name: protocol for protocol in protocols}
    wanted, todo = set[str](), list(names)
    while todo:
        name = todo.pop()
        if name not in wanted:
            wanted.add(name)
            todo += known[name].needs
    return [protocol for name, protocol in known.items() if name in wanted]


def carry_out(protocol: Protocol, lab: Lab, sets: Mapping[str, Parameters], before: Records, kept: Path) -> Records:
    """What a protocol measures after others; what `kept` holds already is read, not measured again.

    Raises `StorageError` where measurements can't be read or written; a run that breaks down raises
    `SimulationError`, as far as the protocol can't go on without it.
    """
    path = kept / f"{protocol.name}.h5"
    if not path.exists():
        settling = {name: p for name, p in sets.items() if p.c > 0}
        rows = [
            *protocol.measure(lab, settling, before),
            *(Missing(protocol.name, name, UNDAMPED) for name in sets if name not in settling),
        ]
        make_directory(kept)
        about = {"protocol": protocol.name, "engine": lab.engine.name, "level": lab.level.name}
        record.save(Records.of(rows), path, about)
    return record.load(path)


UNDAMPED = "without drag (c = 0 s-1) no motion settles, and nothing can be measured"
