"""Which protocols there are, in what order they measure, and where their measurements are kept.

A protocol is a function of a lab, the parameter sets, and what was measured before it; it yields measurements, and what
it could not measure. To add one, write such a function and add a line to `PROTOCOLS`.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterable, Mapping
from dataclasses import KW_ONLY, asdict, dataclass, replace
from functools import cache
from pathlib import Path

from compare.measure import (
    attractors,
    bounds,
    characteristic,
    edge,
    field,
    growth,
    hopping,
    laws,
    lift,
    motions,
    plane,
    pulsation,
    rates,
    record,
    settled,
    thresholds,
    unloading,
    unsteady,
)
from compare.measure.lab import Lab, coarse_step
from compare.measure.levels import Level
from compare.measure.record import Measurement, Missing, Records
from compare.runs.engines import MOREAU, Engine
from compare.runs.tasks import sources
from model import Parameters
from model.files import make_directory

DIRECTORY = "measurements"
UNDAMPED = "without drag (c = 0 s-1) no motion settles, and nothing can be measured"
MOST = 3e4
"""Coarse time steps in 1/c up to which a protocol waits for motions to settle. It waits for 40/c or more at a time; and
contact forces are solved to 1e-12 in each step, so that all that adds up in 1/c is three times that: as much as
`omega_c` may be off in a state that counts as settled."""
HOPS = "hops that last are those of the set hopping"
Measure = Callable[[Lab, Mapping[str, Parameters], Records], Iterable[Measurement | Missing]]


@dataclass(frozen=True)
class Protocol:
    """One way to measure."""

    name: str
    measure: Measure
    needs: tuple[str, ...] = ()
    """Protocols whose measurements it goes out from."""
    _: KW_ONLY
    level: Level = Level.QUICK
    """The least level of which it is a part."""
    waits: bool = True
    """Whether it waits for motions to settle."""
    reference: str = ""
    """Why it needs the set `reference`, and no other; empty if it takes all sets."""
    engine: Engine | None = None
    """Who measures, where it isn't the engine on trial."""


PROTOCOLS = (
    Protocol("settled", settled.measure),
    Protocol("newcomer", settled.newcomer, reference="the engine's own settings are measured on reference only"),
    Protocol("plane", plane.measure, reference="the planes of Figs. 7 and 8 are those of reference only"),
    Protocol("hysteresis", characteristic.hysteresis, ("settled",)),
    Protocol("rates", rates.measure, ("settled",)),
    Protocol("laws", laws.measure, waits=False),
    Protocol("thresholds", thresholds.measure),
    Protocol("edge", edge.measure, ("thresholds",)),
    Protocol("birth", thresholds.birth, ("thresholds",)),
    Protocol("unloading", unloading.measure, ("thresholds",)),
    Protocol("field", field.measure, waits=False),
    Protocol("growth", growth.measure, waits=False),
    Protocol("steepest", growth.steepest, waits=False),
    Protocol("lift", lift.measure, waits=False),
    Protocol("bounds", bounds.measure, ("thresholds",)),
    Protocol("motions", motions.measure, waits=False),
    Protocol("impacts", motions.impacts, waits=False),
    Protocol("recurrent", hopping.hopping, reference=HOPS),
    Protocol("stepped", hopping.stepped, engine=MOREAU, reference=HOPS),
    Protocol("followed", hopping.followed, level=Level.DEFAULT, reference=HOPS),
    Protocol(
        "swing",
        attractors.swing,
        level=Level.DEFAULT,
        reference="swings that last are those of reference on a very rough floor",
    ),
    Protocol("calm", attractors.calm, level=Level.DEFAULT, reference="strong drag is tried on sets of its own"),
    Protocol("choice", attractors.choice, reference="the choice is that of sets of its own with mu > 1"),
    Protocol("pulsation", pulsation.measure, ("thresholds",)),
    Protocol("unsteady", unsteady.measure, ("thresholds",)),
    Protocol("slope", characteristic.slope, ("settled", "thresholds")),
)
"""Every protocol there is, in the order in which they measure; each goes out only from those before it."""


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
    path, lab = kept / f"{protocol.name}.h5", replace(lab, engine=protocol.engine or lab.engine)
    if not path.exists():
        weak = {name: why for name, p in sets.items() if (why := _too_weak(p, protocol))}
        strong = {name: p for name, p in sets.items() if name not in weak}
        rows: list[Measurement | Missing] = [Missing(protocol.name, name, why) for name, why in weak.items()]
        if protocol.reference and "reference" not in strong:
            rows.insert(0, Missing(protocol.name, next(iter(strong), ""), protocol.reference))
        else:
            rows = [*protocol.measure(lab, strong, before), *rows]
        make_directory(kept)
        about = {"protocol": protocol.name, "engine": lab.engine.name, "level": lab.level.name}
        record.save(Records.of(rows), path, about)
    return record.load(path)


def _too_weak(p: Parameters, protocol: Protocol) -> str:
    """Why drag is too weak for a protocol; empty if it isn't."""
    if p.c == 0:
        return UNDAMPED
    steps = 1 / (p.c * coarse_step(p))
    weak = f"drag is so weak (1/c = {1 / p.c:.3g} s, {steps:.2g} time steps) that motions take too long to settle"
    return weak if protocol.waits and steps > MOST else ""
