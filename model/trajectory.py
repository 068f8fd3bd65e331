"""What every simulator returns."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Any, Self

import numpy as np
import numpy.typing as npt

from model.arrays import Array
from model.cases import Case
from model.errors import InputError
from model.flow import Flow
from model.kinematics import VARIABLES, State, slip_speeds
from model.parameters import Parameters
from model.versions import current_commit, current_versions

if TYPE_CHECKING:
    import pandas
    import xarray

AXES = ("x", "y", "z")
"""The paper's axes: x radially inwards, y upwards, z along the orbit."""
CONVENTIONS = "CF-1.11"
"""Those of climate and forecast metadata, which readers such as xarray know."""
SCHEMA, SCHEMA_VERSION = "dualball-trajectory", 1
"""What a file of one run says of itself."""
AXIS_ATTRIBUTES = {
    "units": "1",
    "long_name": "axes of the co-rotating frame: x inwards, y up, z along",
}


def _column(
    units: str,
    long_name: str,
    equation: str = "",
    shape: tuple[int, ...] = (),
    dtype: Any = np.float64,
    **default: Any,
) -> Any:
    """Declare a field that is a column of the HDF5 file, with its metadata."""
    about = {"units": units, "long_name": long_name, "equation": equation}
    return field(repr=False, metadata=about | {"shape": shape, "dtype": dtype}, **default)


MOST_SAMPLES = 2e6
"""Of a run, which is held in memory until it is written: some kilobyte each."""
_fluid = _column("rad s-1", "angular velocity of the fluid").metadata
FLUID: Mapping[str, Any] = {"name": "omega_0", **_fluid}
"""The column of a file that follows from the flow, and isn't read back."""


@dataclass(frozen=True)
class Header:
    """Where a trajectory comes from: enough to run it again."""

    engine: str
    """Its name: ``event``, ``time-stepping``, ``mujoco``, ..."""
    parameters: Parameters
    flow: Flow
    settings: Mapping[str, Any] = field(default_factory=dict)
    """Numerical settings of the simulator, JSON-able."""
    mjcf: str = ""
    """The exact MJCF that was simulated; empty if none was."""
    failure: str = ""
    """Why the run stopped early; empty for a run that reached its end."""
    versions: Mapping[str, str] = field(default_factory=lambda: dict(current_versions()))
    """Versions of dualball, the engine, numpy and Python."""
    commit: str = field(default_factory=current_commit)
    """The commit of the program, if it ran from a checkout."""
    created: str = field(default_factory=lambda: datetime.now(UTC).isoformat(timespec="seconds"))
    """UTC time."""

    def attributes(self) -> dict[str, Any]:
        """What a file says of itself: each parameter, and all but the MJCF as text or JSON."""
        texts = {f.name: getattr(self, f.name) for f in dataclasses.fields(self)}
        del texts["mjcf"]
        parameters = dataclasses.asdict(self.parameters)
        mappings = {"parameters": parameters, "flow": self.flow.to_mapping()}
        mappings |= {name: dict(texts[name]) for name in ("settings", "versions")}
        title = f"Motion of a dual-point contact ball, simulated by {self.engine}"
        about = {"Conventions": CONVENTIONS, "title": title} | parameters
        return about | texts | {name: json.dumps(mapping) for name, mapping in mappings.items()}


@dataclass(frozen=True, kw_only=True, eq=False)
class Trajectory:
    """A motion of the ball, sampled: n samples and k events, in the axes and symbols of the paper.

    Arrays have shape (n,), forces (n, 3) along `AXES`; `events` are changes of case, `header` says
    what was simulated.

    COLUMNS"""

    header: Header
    time: Array = _column("s", "time")
    theta: Array = _column("rad", "azimuth of the ball's centre, not wrapped")
    y: Array = _column("m", "axial displacement of the centre", "(1)")
    v_y: Array = _column("m s-1", "axial velocity", "(2)")
    omega_c: Array = _column("rad s-1", "angular velocity of the ball's orbit", "(2)")
    slip_x: Array = _column("rad s-1", "radial angular velocity of slipping", "(4)")
    slip_y: Array = _column("rad s-1", "axial angular velocity of slipping", "(4)")
    slip_z: Array = _column("rad s-1", "tangential angular velocity of slipping", "(4)")
    h: Array = _column("m", "displacement of the centre inwards from its orbit at the wall")
    v_h: Array = _column("m s-1", "inward velocity of the centre")
    force_A: Array = _column("N", "contact force of the floor on the ball", "(11)", (3,))
    force_B: Array = _column("N", "contact force of the wall on the ball", "(11)", (3,))
    slip_speed_A: Array = _column("m s-1", "slip speed at the floor", "(7)")
    slip_speed_B: Array = _column("m s-1", "slip speed at the wall", "(7)")
    gap_A: Array = _column("m", "distance between ball and floor, negative where they overlap")
    gap_B: Array = _column("m", "distance between ball and wall, negative where they overlap")
    case: npt.NDArray[np.int8] = _column("1", "kinematic case", "Fig. 2", dtype=np.int8)
    events: Events = field(repr=False)

    def __repr__(self) -> str:
        """Engine, samples, duration, cases and last state, in a line."""
        if not len(self.time):
            return f"Trajectory({self.header.engine}: no samples)"
        phases, last = self.phases(), zip(VARIABLES, self.x[-1], strict=True)
        cases = " ".join(case.name for case, *_ in phases[:8]) + " …" * (len(phases) > 8)
        state = ", ".join(f"{name}={value:.6g}" for name, value in last)
        failed = f"; {self.header.failure}" if self.header.failure else ""
        span = f"{len(self.time)} samples, {self.time[0]:g} to {self.time[-1]:g} s"
        return f"Trajectory({self.header.engine}: {span}; cases {cases}; last {state}{failed})"

    @property
    def omega_0(self) -> Array:
        """The angular velocity of the fluid at each sample, rad s-1."""
        return self.header.flow(self.time)

    @property
    def x(self) -> Array:
        """The states, shape (n, 8), columns in the order of `State`."""
        return State(*(getattr(self, name) for name in VARIABLES)).stacked()

    @property
    def cases(self) -> list[Case]:
        """The case of every sample."""
        return [Case(code) for code in self.case]

    def phases(self) -> list[tuple[Case, float, float]]:
        """The cases in order, with the times of the first and last sample in each, s."""
        starts = np.flatnonzero(np.diff(self.case, prepend=-1))
        ends = np.append(starts, len(self.case))[1:] - 1
        cases, times = map(Case, self.case[starts]), self.time.tolist()
        return [(case, times[a], times[b]) for case, a, b in zip(cases, starts, ends, strict=True)]

    @property
    def complete(self) -> bool:
        """Whether the run reached its end."""
        return not self.header.failure

    def to_xarray(self) -> xarray.Dataset:
        """The trajectory as xarray opens its file: units, cases, events, where it comes from.

        Raises `InputError` if xarray, an optional dependency, isn't installed."""
        try:
            import xarray  # here, because it is optional and takes a second to load
        except ImportError as error:
            raise InputError("to_xarray() needs xarray: pip install xarray h5netcdf") from error
        variables: dict[str, Any] = {
            "axis": ("axis", list(AXES), AXIS_ATTRIBUTES),
            "mjcf": ((), self.header.mjcf),
        }
        for table, time in ((self, "time"), (self.events, "event_time")):
            for name, meta in columns(type(table)).items():
                values = getattr(table, name)
                variables[meta["name"]] = ((time, "axis")[: values.ndim], values, attributes(meta))
        variables["omega_0"] = ("time", self.omega_0, attributes(FLUID))
        schema = {"schema": SCHEMA, "schema_version": SCHEMA_VERSION}
        return xarray.Dataset(variables, attrs=schema | self.header.attributes())

    def table(self) -> dict[str, Array]:
        """All that a sample holds by number, each (n,): forces split along `AXES` (force_Ax …)."""
        return {name: component(self, name) for name in COMPONENTS} | {"omega_0": self.omega_0}

    def to_pandas(self) -> pandas.DataFrame:
        """The samples as a pandas table, one row each, with the time in s as its index.

        Columns have the names and units of a file's; forces are split along `AXES` (force_Ax …),
        cases are categories by name, and `attrs` says where the motion comes from. Raises
        `InputError` if pandas, an optional dependency, isn't installed."""
        try:
            import pandas  # here, because it is optional and takes a second to load
        except ImportError as error:
            raise InputError("to_pandas() needs pandas: pip install pandas") from error
        table: dict[str, Any] = self.table()
        table["case"] = pandas.Categorical.from_codes(self.case, [case.name for case in Case])
        found = pandas.DataFrame(table).set_index("time")
        found.attrs = self.header.attributes()
        return found

    @classmethod
    def from_blocks(
        cls, header: Header, blocks: list[npt.NDArray[np.void]], events: Events
    ) -> Self:
        """Join blocks of samples, structured arrays of dtype `SAMPLE`."""
        blocks = [np.empty(0, SAMPLE), *blocks]
        columns = {name: np.concatenate([block[name] for block in blocks]) for name, _ in _SAMPLED}
        return cls(header=header, events=events, **columns)


_TIMES: dict[str, Any] = {"default_factory": lambda: np.empty(0)}
_CASES: dict[str, Any] = {"dtype": np.int8, "default_factory": lambda: np.empty(0, np.int8)}
_IMPULSES: dict[str, Any] = {"shape": (3,), "default_factory": lambda: np.empty((0, 3))}
_ON_BALL = "on the ball, zero without impact"


@dataclass(frozen=True, kw_only=True, eq=False)
class Events:
    """Changes of case and impacts, arrays of shape (k,) or (k, axis)."""

    time: Array = _column("s", "time of the event, located between time steps", **_TIMES)
    from_case: npt.NDArray[np.int8] = _column("1", "case before the event", **_CASES)
    to_case: npt.NDArray[np.int8] = _column("1", "case after the event", **_CASES)
    impulse_A: Array = _column("N s", f"impulse of the floor {_ON_BALL}", **_IMPULSES)
    impulse_B: Array = _column("N s", f"impulse of the wall {_ON_BALL}", **_IMPULSES)

    def __len__(self) -> int:
        return len(self.time)


Tabular = type[Trajectory] | type[Events]


def columns(of: Tabular) -> dict[str, Mapping[str, Any]]:
    """Metadata of columns, in order: name in a file, units, long_name, equation, shape, dtype."""
    table = "event_" if of is Events else ""
    fields = [f for f in dataclasses.fields(of) if "units" in f.metadata]
    return {f.name: {"name": table + f.name.removesuffix("_case"), **f.metadata} for f in fields}


_SAMPLED = columns(Trajectory).items()
COMPONENTS: dict[str, tuple[str, str]] = {
    name + axis: (name, axis)
    for name, meta in _SAMPLED
    for axis in (AXES if meta["shape"] else ("",))
}
"""What a sample holds, by number: columns, forces along each of the `AXES` (force_Ax …)."""


def component(of: Any, name: str) -> Array:
    """A number by its name, as force_Ax, at each sample of a trajectory or its data set, (n,)."""
    column, axis = COMPONENTS[name]
    values = np.asarray(getattr(of, column))
    return values[:, AXES.index(axis)] if axis else values


_meanings = (f"* {name}: {meta['long_name']}, in {meta['units']}" for name, meta in _SAMPLED)
Trajectory.__doc__ = (Trajectory.__doc__ or "").replace(
    "COLUMNS", "\n    ".join(_meanings).replace(", in 1", "")
)


def attributes(meta: Mapping[str, Any]) -> dict[str, Any]:
    """The attributes of a column in a file and in xarray."""
    attributes = {key: meta[key] for key in ("units", "long_name", "equation") if meta[key]}
    # the CF convention's names of the codes, for readers that drop the HDF5 enum
    if meta["dtype"] is np.int8:
        attributes["flag_values"] = np.array([case.value for case in Case], np.int8)
        attributes["flag_meanings"] = " ".join(case.name for case in Case)
    return attributes


SAMPLE = np.dtype([(name, meta["dtype"], meta["shape"]) for name, meta in _SAMPLED])
"""One sample as a structured dtype; simulators yield blocks of these."""


def samples(time: Array, theta: Array, x: State, p: Parameters) -> npt.NDArray[np.void]:
    """Samples (n,) of dtype `SAMPLE` with gaps and slip speeds; forces and case are for the caller.

    time, theta and the columns of x have shape (n,)."""
    block = np.zeros(len(time), SAMPLE)
    block["time"], block["theta"] = time, theta
    for name, column in x._asdict().items():
        block[name] = column
    block["gap_A"], block["gap_B"] = x.y, x.h
    block["slip_speed_A"], block["slip_speed_B"] = slip_speeds(x, p)
    return block
