"""The physical parameters of the ball, the vessel and the fluid (Table 1)."""

import dataclasses
import functools
import math
import re
import tomllib
from collections.abc import Collection, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any, Self

import tomli_w

from model import drag as laws
from model.errors import MOST_NAMES, InputError, StorageError, few, suggestion
from model.files import write_text

LARGEST = 1_000_000
"""Bytes of a TOML file that is read: of more Python makes nothing for seconds."""
_SETS = Path(__file__).parent / "parameter_sets"


@dataclass(frozen=True)
class Range:
    """From `low` to `high`: without `low` if `open`, without `high` if `below`; perhaps `whole`."""

    low: float = -math.inf
    high: float = math.inf
    open: bool = False
    below: bool = False
    whole: bool = False

    def __contains__(self, number: float) -> bool:
        above = self.low < number if self.open else self.low <= number
        under = number < self.high if self.below else number <= self.high
        return above and under and (not self.whole or number == round(number))

    def __str__(self) -> str:
        """As a person reads it: ``> 0 and <= 2/3``."""
        ends = ((">" if self.open else ">=", self.low), ("<" if self.below else "<=", self.high))
        finite = (f"{sign} {_exact_text(end)}" for sign, end in ends if math.isfinite(end))
        limits = " and ".join(finite)
        return f"{'a whole number' * self.whole} {limits}".strip() or "any"


ANY = Range()
POSITIVE = Range(0.0, open=True)
NOT_NEGATIVE = Range(0.0)
SIZES = Range(1e-20, 1e20)
"""Of parameters that aren't 0: what is computed from them stays finite."""
REACH = Range(-1e12, 1e12)
"""Of flows and states, for the same reason."""


def check_number(
    name: str, value: Any, unit: str, allowed: Range = ANY, meaning: str = ""
) -> float:
    """Return `value` as a float; `InputError` unless it is a finite number in the allowed range."""
    try:
        if isinstance(value, bool | str) or not hasattr(value, "__float__"):
            raise TypeError
        number = float(value)
    except (TypeError, ValueError, OverflowError) as error:
        of = f" in {unit}" * (unit != "1")
        raise InputError(f"{name} = {value!r} must be a number{of}") from error
    of = f" {unit}" * (unit != "1")
    if not math.isfinite(number):
        raise InputError(f"{name} = {number}{of} must be finite")
    if number not in allowed:
        must = f"{meaning} must".strip()
        raise InputError(f"{name} = {number:g}{of} is out of range: {must} be {allowed}")
    return number


def parse_number(name: str, text: str, unit: str, allowed: Range = ANY) -> float:
    """Convert a text to a number; `InputError` if it is none, or as for `check_number`."""
    number: float | str = text
    with suppress(ValueError):
        number = float(text)
    return check_number(name, number, unit, allowed)


def check_choice(name: str, value: Any, known: Sequence[Any]) -> None:
    """`InputError` if `value` is none of the known ones."""
    if value not in known:
        names = [str(each) for each in known]
        one = f"{', '.join(names)}{suggestion(str(value), names)}"
        raise InputError(f"{name} = {value!r} must be one of {one}")


def check_names(
    given: Collection[str], known: Sequence[str], kind: str, needed: Iterable[str] = ()
) -> None:
    """`InputError` if a given name is none of the known ones, or a needed one is not given."""
    for name in given:
        if name not in known:
            known_ones = f"{suggestion(name, known)}; known: {few(known, MOST_NAMES)}"
            raise InputError(f"unknown {kind} {name!r}{known_ones}")
    if missing := [name for name in needed if name not in given]:
        raise InputError(f"missing {kind} {few(map(repr, missing), MOST_NAMES)}")


def _exact_text(number: float) -> str:
    """A number as text, short and exact where that can be: 0.1, 2/3."""
    short, fraction = f"{number:g}", Fraction(number).limit_denominator(9)
    return short if float(short) == number or float(fraction) != number else str(fraction)


def _quantity(symbol: str, unit: str, meaning: str, allowed: Range, **default: Any) -> Any:
    """Declare a parameter of the model, with what a reader and the range check need."""
    return dataclasses.field(
        metadata={"symbol": symbol, "unit": unit, "meaning": meaning, "allowed": allowed}, **default
    )


@dataclass(frozen=True, kw_only=True)
class Parameters:
    """All the model depends on, in SI units: Table 1 of the paper, and the law of drag.

    QUANTITIES

    Raises
    ------
    InputError
        If a value is not a finite number in its range, or the law of drag lacks the fluid's
        viscosity; the message names field, value, unit and range."""

    m: float = _quantity("m", "kg", "mass of the ball", POSITIVE)
    r: float = _quantity("r", "m", "radius of the ball", POSITIVE)
    R: float = _quantity(
        "R", "m", "radius of the centre's orbit; the vessel's radius is R + r", POSITIVE
    )
    j: float = _quantity(
        "j", "1", "dimensionless moment of inertia", Range(0.0, 2.0 / 3.0, open=True)
    )
    mu: float = _quantity("μ", "1", "friction coefficient between ball and floor (A)", NOT_NEGATIVE)
    eta: float = _quantity("η", "1", "friction coefficient between ball and wall (B)", NOT_NEGATIVE)
    g: float = _quantity("g", "m s-2", "gravitational acceleration reduced by buoyancy", POSITIVE)
    c: float = _quantity("c", "s-1", "viscous drag coefficient divided by mass", NOT_NEGATIVE)
    omega_0: float = _quantity("ω₀", "rad s-1", "angular velocity of the fluid", ANY)
    nu_f: float = _quantity(
        "ν_f", "m2 s-1", "kinematic viscosity of the fluid (0: not known)", NOT_NEGATIVE, default=0
    )
    C_D: float = _quantity(
        "C_D", "1", "drag coefficient of the quadratic law", POSITIVE, default=0.44
    )
    density_ratio: float = _quantity(
        "ρ_f/ρ_b",
        "1",
        "density of the fluid divided by that of the ball (0: not known; from 1 on it floats)",
        Range(0.0, 1.0, below=True),
        default=0.0,
    )
    fluid_torque: float = _quantity(
        "k",
        "s-1",
        "rate at which the fluid's torque alone would stop the spin (0: left out, as in the paper)",
        NOT_NEGATIVE,
        default=0.0,
    )
    """Time stepping and MuJoCo take it; closed forms and the event-driven simulation don't."""
    drag: str = laws.STOKES
    """The law of drag, one of `model.drag.LAWS`."""

    def __post_init__(self) -> None:
        for field in self.quantities():
            unit, allowed, meaning = (field.metadata[key] for key in ("unit", "allowed", "meaning"))
            value = check_number(field.name, getattr(self, field.name), unit, allowed, meaning)
            if value:
                check_number(field.name, abs(value), unit, SIZES, "the size of what isn't 0")
            object.__setattr__(self, field.name, value + 0.0)  # without the sign of -0
        check_choice("drag", self.drag, laws.LAWS)
        if self.drag != laws.STOKES and self.nu_f == 0:
            needs = "needs the Reynolds number: nu_f in m2 s-1 must be given"
            raise InputError(f"drag = {self.drag!r} {needs}")

    @classmethod
    @functools.cache
    def quantities(cls) -> tuple[dataclasses.Field[float], ...]:
        """The parameters that are numbers: all but the law of drag."""
        return tuple(field for field in dataclasses.fields(cls) if field.metadata)

    @property
    def kappa(self) -> float:
        """Dimensionless drag, c sqrt(R/g)."""
        return self.c * math.sqrt(self.R / self.g)

    @property
    def Omega_0(self) -> float:
        """Dimensionless angular velocity of the fluid, omega_0 sqrt(R/g)."""
        return self.omega_0 * math.sqrt(self.R / self.g)

    def replace(self, **changes: Any) -> Self:
        """Return a copy with some values changed; an unknown name is an `InputError`."""
        check_names(changes, [f.name for f in dataclasses.fields(self)], "parameter")
        return dataclasses.replace(self, **changes)

    @classmethod
    def from_fluid(
        cls,
        *,
        nu_f: float,
        rho_f: float,
        rho_b: float,
        r: float,
        gravity: float = 9.81,
        j: float = 0.4,
        **rest: Any,
    ) -> Self:
        """A uniform ball in a fluid: mass, Stokes drag by (10), gravity less buoyancy.

        Parameters
        ----------
        nu_f : kinematic viscosity of the fluid, m2 s-1, > 0
        rho_f, rho_b : densities of fluid and ball, kg m-3; the ball must be the denser
        gravity : gravitational acceleration in vacuum, m s-2
        r, j, rest : R, mu, eta and omega_0 (0 if not given), drag and C_D, as in `Parameters`"""
        given = ("nu_f", nu_f, "m2 s-1"), ("rho_f", rho_f, "kg m-3")
        for each in (*given, ("r", r, "m"), ("gravity", gravity, "m s-2")):
            check_number(*each, POSITIVE)
            check_number(*each, SIZES)
        floats = "a ball not denser than the fluid floats; it"
        check_number("rho_b", rho_b, "kg m-3", Range(rho_f, open=True), floats)
        m, c = 4 / 3 * math.pi * r**3 * rho_b, 9 * nu_f / (2 * r**2) * rho_f / rho_b
        g, fluid = gravity * (1 - rho_f / rho_b), {"nu_f": nu_f, "density_ratio": rho_f / rho_b}
        return cls(m=m, r=r, j=j, g=g, c=c, **{"omega_0": 0.0} | rest | fluid)

    @classmethod
    def from_mapping(cls, values: Mapping[str, Any]) -> Self:
        """From a mapping of parameters, or of arguments of `from_fluid` with a ``fluid`` table.

        The table ``fluid`` holds nu_f, rho_f, rho_b and optionally gravity; m, g, c and
        density_ratio then follow from it and may not be given. Raises `InputError` for an unknown,
        missing or contradictory key."""
        names = [f.name for f in dataclasses.fields(cls)]
        if "fluid" not in values:
            required = (f.name for f in dataclasses.fields(cls) if f.default is dataclasses.MISSING)
            check_names(values, [*names, "fluid"], "parameter", required)
            return cls(**values)
        fluid = values["fluid"]
        if not isinstance(fluid, Mapping):
            raise InputError(f"fluid = {fluid!r} must be a table with nu_f, rho_f and rho_b")
        rest = {k: v for k, v in values.items() if k != "fluid"}
        for name in ("m", "g", "c", "nu_f", "density_ratio"):
            if name in rest:
                where = "from the [fluid] table and may not be given beside it"
                raise InputError(f"{name} follows {where}")
        check_names(rest, names, "parameter", ("r", "R", "mu", "eta"))
        needed = ("nu_f", "rho_f", "rho_b")
        check_names(fluid, (*needed, "gravity"), "fluid property", needed)
        return cls.from_fluid(**rest, **fluid)

    @classmethod
    def named(cls, name: str) -> Self:
        """Return the named set (`names` lists them)."""
        if name not in cls.names():
            known = f"{suggestion(name, cls.names())}; there are {', '.join(cls.names())}"
            raise InputError(f"no parameter set is named {name!r}{known}")
        return cls.from_mapping(tomllib.loads((_SETS / f"{name}.toml").read_text("utf-8")))

    @staticmethod
    def names() -> list[str]:
        """Names of the sets that come with the package."""
        return sorted(path.stem for path in _SETS.glob("*.toml"))

    @classmethod
    def load(cls, path: str | Path) -> Self:
        """Read a TOML file; `StorageError` if it can't be read, `InputError` for what it says."""
        values = read_toml(path)
        try:
            return cls.from_mapping(values)
        except InputError as error:
            raise InputError(f"{path}: {error}") from error

    def save(self, path: str | Path) -> None:
        """Write the values as TOML, exactly; raises `StorageError`."""
        write_text(Path(path), tomli_w.dumps(dataclasses.asdict(self)))


_table = ["Parameters", "----------"]
for _field in Parameters.quantities():
    _usual = "" if _field.default is dataclasses.MISSING else f", default {_field.default:g}"
    _said = "{name} : {meaning}, in {unit}, {allowed}{usual}".format(
        name=_field.name, usual=_usual, **_field.metadata
    )
    _table.append(_said.replace(", in 1", "").replace(", any", ""))
_table.append(f"drag : one of {', '.join(laws.LAWS)}")
Parameters.__doc__ = (Parameters.__doc__ or "").replace("QUANTITIES", "\n    ".join(_table))


def read_toml(path: str | Path) -> dict[str, Any]:
    """What a TOML file holds; raises `StorageError` if it can't be read."""
    try:
        with Path(path).open("rb") as file:
            content = file.read(LARGEST + 1)
        if len(content) > LARGEST:
            raise StorageError(f"cannot read {path}: it has more than {LARGEST / 1e6:g} MB")
        text = content.decode("utf-8-sig").replace("\r\n", "\n")
        return tomllib.loads(text)
    except OSError as error:
        raise StorageError(f"cannot read {path}: {error.strerror}") from error
    except UnicodeDecodeError as error:
        raise StorageError(f"{path} is not valid TOML: it must be text in UTF-8") from error
    except tomllib.TOMLDecodeError as error:
        line = re.search(r"at line (\d+)", str(error))
        comma = line and re.search(r"=\s*[-+]?\d+,\d", text.splitlines()[int(line[1]) - 1])
        hint = "; a number takes a point, not a comma" if comma else ""
        raise StorageError(f"{path} is not valid TOML: {error}{hint}") from error
