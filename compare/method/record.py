"""Measurements as data, the file that keeps them, and a measured number beside a predicted one.

Labels and sentences are made from measurements and never read back. A file holds those of one
protocol as columns, one row a measurement: it opens with ``xarray.open_dataset(path,
engine="h5netcdf").to_dataframe()``."""

from __future__ import annotations

import dataclasses
import functools
import json
import math
from collections import Counter
from collections.abc import Callable, Generator, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple, TypeVar, cast

import numpy as np

from compare.method.conditions import Conditions
from compare.method.quantities import quantity
from compare.method.statistics import COVERAGE, Estimate
from model import Case, Parameters, StorageError
from model.hdf5 import column, dataset, reading, write_columns, writing
from model.kinematics import VARIABLES
from model.versions import current_commit, current_versions

SCHEMA, SCHEMA_VERSION = "dualball-measurements", 1
ANEW = "remove it, and 'dualball validate' measures anew"


@dataclass(frozen=True, kw_only=True)
class Measurement:
    """One measured number, and all that it belongs to."""

    protocol: str  #: the name of the `compare.method.protocol.Protocol` that measured it
    quantity: str  #: a name of `compare.method.quantities`
    value: float
    uncertainty: float  #: standard uncertainty, in the unit of the quantity
    budget: Mapping[str, float] = field(default_factory=dict)
    """What that is made up of: standard uncertainties by cause."""
    engine: str
    set: str  #: name of the parameter set
    parameters: Parameters  #: with the omega_0 at which it was measured
    at: Conditions = field(default_factory=Conditions)  #: what else it depends on
    runs: tuple[str, ...] = ()
    """Keys of its runs; where they are kept, FILE/KEY, relative to the results directory."""

    def __post_init__(self) -> None:
        quantity(self.quantity)
        # whole numbers and numpy's come back from a file as floats
        for name in ("value", "uncertainty"):
            object.__setattr__(self, name, float(getattr(self, name)))

    @property
    def case(self) -> Case:
        """The case among its conditions."""
        return Case[self.at["case"]]

    @property
    def of(self) -> str:
        """The variable, or force, that was measured: see `Quantity.of`."""
        return quantity(self.quantity).of

    @property
    def unit(self) -> str:
        """Unit of value and uncertainty."""
        return quantity(self.quantity).unit

    @property
    def finite(self) -> bool:
        """Whether it is a number with an uncertainty, and neither is nan or infinite."""
        return math.isfinite(self.value) and math.isfinite(self.uncertainty)


def if_found(row: Measurement, why: str) -> Measurement | Missing:
    """The measurement if it has a finite number, however coarse; else a `Missing`."""
    return row if row.finite else Missing(row.protocol, row.set, why)


def state(m: Measurement) -> tuple[float, ...]:
    """The state (8) among the conditions of a measurement, zero where it isn't named."""
    at = cast(Mapping[str, float], m.at)
    return tuple(at.get(name, 0.0) for name in VARIABLES)


class Relation(StrEnum):
    """How a measured value should stand to the predicted one."""

    EQUAL = "="
    AT_MOST = "≤"
    AT_LEAST = "≥"


@dataclass(frozen=True, kw_only=True)
class Check:
    """A measured number beside its prediction."""

    measurement: Measurement
    predicted: float  #: nan where theory knows no such state
    uncertainty: float  #: standard uncertainty of the deviation
    scale: float
    relation: Relation = Relation.EQUAL
    coverage: float = COVERAGE  #: standard uncertainties in its tolerance
    required: float | None = None
    """Its required resolution, where that isn't what its quantity says."""
    criterion: int = 0  #: number of the criterion of its claim that chose it

    @property
    def deviation(self) -> float:
        """Measured less predicted, as far as it goes against the relation."""
        error = self.measurement.value - self.predicted
        if self.relation is Relation.AT_MOST:
            return max(error, 0.0)
        return min(error, 0.0) if self.relation is Relation.AT_LEAST else error

    @property
    def tolerance(self) -> float:
        """Largest deviation that still agrees."""
        return self.coverage * self.uncertainty

    @property
    def share(self) -> float:
        """Deviation divided by tolerance; inf without tolerance, or without such a state."""
        if self.deviation == 0:
            return 0.0
        share = abs(self.deviation / self.tolerance) if self.tolerance else math.inf
        return math.inf if math.isnan(share) else share

    @property
    def resolution(self) -> float:
        """The smallest relative error of the prediction that this check would notice."""
        return self.tolerance / self.scale if self.scale else math.inf

    @property
    def agrees(self) -> bool:
        """Whether the deviation is within the tolerance; not for nan."""
        return abs(self.deviation) <= self.tolerance

    @property
    def conclusive(self) -> bool:
        """Whether the check resolves as much as is required."""
        return self.resolution <= self.required_resolution

    @property
    def required_resolution(self) -> float:
        """The largest relative error of a prediction that it may overlook."""
        usual = quantity(self.measurement.quantity).resolution
        return usual if self.required is None else self.required


@dataclass(frozen=True)
class Missing:
    """What a protocol could not measure, and why, in a sentence for the reader."""

    protocol: str
    set: str
    reason: str
    rows: int = 1
    """Measurements that are left out for it; 0 where there is nothing of the kind to measure."""

    def __str__(self) -> str:
        return f"{self.set}: {self.reason}" + (f" ({self.rows} left out)" if self.rows > 1 else "")


class Planned(NamedTuple):
    """What a protocol has numbers of."""

    protocol: str
    set: str
    quantity: str
    """Empty for a set of which the protocol said nothing: no number, and no reason why."""


@dataclass(frozen=True)
class Records:
    """What has been measured so far."""

    measurements: tuple[Measurement, ...] = ()
    missing: tuple[Missing, ...] = ()
    planned: Counter[Planned] = field(default=None)  # type: ignore[arg-type]  # see below
    """How many numbers there were when they were measured; by default as many as there are."""

    def __post_init__(self) -> None:
        if self.planned is None:
            rows = Counter(Planned(m.protocol, m.set, m.quantity) for m in self.measurements)
            object.__setattr__(self, "planned", rows)

    @cached_property
    def lost(self) -> Counter[Planned]:
        """How many of the planned numbers are gone, or are none: nan or infinite."""
        numbers = (m for m in self.measurements if m.finite)
        return self.planned - Counter(Planned(m.protocol, m.set, m.quantity) for m in numbers)

    @classmethod
    def of(cls, rows: Iterable[Measurement | Missing]) -> Records:
        """Records from what a protocol yields: measurements, and what is missing."""
        kept = list(rows)
        missing = tuple(row for row in kept if isinstance(row, Missing))
        return cls(tuple(row for row in kept if isinstance(row, Measurement)), missing)

    def __add__(self, other: Records) -> Records:
        return Records(
            self.measurements + other.measurements,
            self.missing + other.missing,
            self.planned + other.planned,
        )

    @property
    def rows(self) -> tuple[Measurement | Missing, ...]:
        """The measurements, then what is missing."""
        return (*self.measurements, *self.missing)

    def select(
        self,
        protocol: str,
        quantity: str | None = None,
        where: Callable[[Measurement], bool] = lambda m: True,
    ) -> Iterator[Measurement]:
        """The finite measurements of a protocol and quantity for which `where` holds."""
        for m in self.measurements:
            if m.protocol == protocol and quantity in (None, m.quantity) and m.finite and where(m):
                yield m

    def threshold(self, set: str, quantity: str) -> Estimate | None:
        """The least uncertain measured value of a threshold of a set, or None."""
        measured = self.select("thresholds", quantity, lambda m: m.set == set)
        best = min(measured, key=lambda m: m.uncertainty, default=None)
        return Estimate(best.value, best.uncertainty) if best else None


Sets = Mapping[str, Parameters]  #: what a protocol measures, by name
Measured = Iterator[Measurement | Missing]  #: what it yields
T = TypeVar("T")
Found = Generator[Missing, None, T]
"""What a step of a protocol comes to, as in ``results = yield from carry_out(runner, pairs)``; what
is missing for it is yielded, and so goes to the protocol's rows."""
RecordsByEngine = Mapping[str, Mapping[int, Records]]
"""What each engine measured, the one on trial first; by its time steps in one."""
_OWN = ("protocol", "quantity", "value", "uncertainty", "unit", "engine", "set")
_PARAMETERS = tuple(f.name for f in dataclasses.fields(Parameters))


def save(records: Records, path: Path, about: Mapping[str, Any]) -> None:
    """Write records, whole or not at all; `about` says whose they are (JSON-able, see `Origin`).

    What a row doesn't have is nan, or empty where it is text. Raises `StorageError`."""
    rows = records.measurements
    columns: dict[str, Sequence[Any]] = {"row": range(len(rows))}
    columns |= {name: [getattr(m, name) for m in rows] for name in _OWN}
    columns["runs"] = [" ".join(m.runs) for m in rows]
    columns |= {name: [getattr(m.parameters, name) for m in rows] for name in _PARAMETERS}
    texts = {name: isinstance(value, str) for m in rows for name, value in m.at.items()}
    for name, text in texts.items():
        values = [m.at.get(name, "" if text else np.nan) for m in rows]
        columns[f"at_{name}"] = values if text else np.array(values, float).tolist()
    for cause in dict.fromkeys(cause for m in rows for cause in m.budget):
        columns[f"u_{cause}"] = [float(m.budget.get(cause, math.nan)) for m in rows]
    with writing(path) as file:
        file.attrs.update(
            schema=SCHEMA,
            schema_version=SCHEMA_VERSION,
            about=json.dumps(dict(about)),
            missing=json.dumps([dataclasses.asdict(each) for each in records.missing]),
            planned=json.dumps([[*what, rows] for what, rows in records.planned.items()]),
            versions=json.dumps(dict(current_versions())),
            commit=current_commit(),
        )
        write_columns(file, columns, "row")


@dataclass(frozen=True, kw_only=True)
class Origin:
    """Who measured what a file holds, and by which plan: elsewhere it is refused."""

    protocol: str
    engine: str  #: of whose evidence it is a part
    by: str  #: who measured: another engine where the protocol names one
    step: int  #: time steps in one that a protocol asks for
    level: str
    plan: str  #: digest of engine, step, level, sets, and the sources that measure
    program: str = field(default_factory=lambda: current_versions()["dualball"])


def load(path: Path, **origin: Any) -> Records:
    """Read what `save` wrote; `origin` are fields of the `Origin` that it must have.

    Raises `StorageError`, naming the file, if it is missing, damaged, cut, changed, of another
    version, or of another origin."""
    with reading(path) as file:
        if file.attrs.get("schema") != SCHEMA or file.attrs.get("schema_version") != SCHEMA_VERSION:
            raise StorageError("it does not hold measurements in this program's format")
        about = json.loads(file.attrs["about"])
        for name, expected in origin.items():
            if name not in about:
                raise StorageError(f"it doesn't say of which {name} it is; {ANEW}")
            if about[name] != expected:
                held = f"it holds measurements of {name} {about[name]}, not of {expected}"
                raise StorageError(f"{held}; {ANEW}")
        columns = {name: column(dataset(file, name)).tolist() for name in file}
        parameters = functools.cache(
            lambda *values: Parameters(**dict(zip(_PARAMETERS, values, strict=True)))
        )
        conditions, causes = ([n for n in columns if n.startswith(of)] for of in ("at_", "u_"))
        measurements = []
        for values in zip(*columns.values(), strict=True):
            row = dict(zip(columns, values, strict=True))
            kept = {name: value for name, value in row.items() if value == value and value != ""}
            at = {n.removeprefix("at_"): kept[n] for n in conditions if n in kept}
            m = Measurement(
                **{name: row[name] for name in _OWN if name != "unit"},
                runs=tuple(row["runs"].split()),
                budget={n.removeprefix("u_"): kept[n] for n in causes if n in kept},
                parameters=parameters(*(row[name] for name in _PARAMETERS)),
                at=cast(Conditions, at),
            )
            measurements.append(m)
        planned = json.loads(file.attrs["planned"])
        missing = (Missing(**each) for each in json.loads(file.attrs["missing"]))
        counts = Counter({Planned(*what): count for *what, count in planned})
        return Records(tuple(measurements), tuple(missing), counts)
