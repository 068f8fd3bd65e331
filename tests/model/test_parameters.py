"""Parameters have the drag, groups and files of their physics, and a bad one is one clear line."""

import dataclasses
import math
import tempfile
import tomllib
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from model import InputError, Parameters, StorageError
from model.drag import LAWS
from model.parameters import ANY, NOT_NEGATIVE, POSITIVE, Range, check_number, parse_number

FIELDS = [f.name for f in Parameters.quantities()]
REFERENCE = Parameters.named("reference")


def zero_or(most):
    return st.just(0.0) | st.floats(1e-9, most)


valid = st.builds(
    Parameters,
    **dict.fromkeys(("m", "r", "R", "g"), st.floats(1e-9, 1e9)),
    j=st.floats(1e-9, 2 / 3),
    mu=zero_or(10),
    eta=zero_or(10),
    c=zero_or(1e3),
    omega_0=zero_or(1e6) | st.floats(-1e6, -1e-9),
    nu_f=st.floats(1e-9, 1e3),
    C_D=st.floats(1e-3, 1e3),
    density_ratio=zero_or(0.999),
    fluid_torque=zero_or(1e3),
    drag=st.sampled_from(LAWS),
)


BALL = "r = 0.01\nR = 0.05\nmu = 0.2\neta = 0.2\n"


@pytest.mark.parametrize("law", LAWS)
def test_a_law_of_drag_beside_a_fluid(tmp_path, law):
    fluid = "[fluid]\nnu_f = 1e-6\nrho_f = 1.0\nrho_b = 4.0"
    (tmp_path / "p.toml").write_text(f'{BALL}drag = "{law}"\n{fluid}')
    p = Parameters.load(tmp_path / "p.toml")
    assert (p.drag, p.nu_f, p.density_ratio, p.C_D) == (law, 1e-6, 0.25, 0.44)
    p.save(tmp_path / "again.toml")
    assert Parameters.load(tmp_path / "again.toml") == p
    names = ("m", "r", "R", "j", "mu", "eta", "g", "c", "omega_0")  # without a law: Stokes'
    assert Parameters.from_mapping({name: getattr(REFERENCE, name) for name in names}) == REFERENCE


def test_drag_and_gravity_follow_from_the_fluid():
    nu, rho_f, rho_b, r = 1e-6, 1000.0, 8000.0, 0.002
    fluid = {"nu_f": nu, "rho_f": rho_f, "gravity": 9.8}
    p = Parameters.from_fluid(rho_b=rho_b, r=r, R=0.02, mu=0.1, eta=0.1, **fluid)
    # Stokes: F = 6 pi rho_f nu r v = m c v.
    assert p.m * p.c == pytest.approx(6 * math.pi * rho_f * nu * r, rel=1e-14)
    # Archimedes: weight less the weight of the displaced fluid.
    assert p.m * p.g == pytest.approx(4 / 3 * math.pi * r**3 * (rho_b - rho_f) * 9.8, rel=1e-14)


@given(valid)
def test_toml_keeps_every_digit(p):
    """In a plain file."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "p.toml"
        p.save(path)
        assert Parameters.load(path) == p
        assert tomllib.loads(path.read_text()) == dataclasses.asdict(p)


@given(valid, st.floats(1e-3, 1e3), st.floats(1e-3, 1e3))
def test_dimensionless_groups_do_not_depend_on_units(p, length, time):
    q = p.replace(R=p.R * length, g=p.g * length / time**2, c=p.c / time, omega_0=p.omega_0 / time)
    assert q.kappa == pytest.approx(p.kappa, rel=1e-12)
    assert q.Omega_0 == pytest.approx(p.Omega_0, rel=1e-12)


def test_nothing_has_no_sign():
    assert str(REFERENCE.replace(omega_0=-0.0).omega_0) == "0.0"


@pytest.mark.parametrize("name", FIELDS)
def test_a_bad_value_is_named_with_unit_and_range(name):
    field = Parameters.__dataclass_fields__[name]
    bad = [-1e-12] * (name != "omega_0") + [0.0] * (name in ("m", "r", "R", "j", "g", "C_D"))
    for value in (*bad, *{"j": [0.67], "density_ratio": [1.0]}.get(name, [])):
        with pytest.raises(InputError) as caught:
            REFERENCE.replace(**{name: value})
        message = str(caught.value)
        assert message.startswith(f"{name} = {value:g} {field.metadata['unit']}".removesuffix(" 1"))
        assert str(field.metadata["allowed"]) in message
        assert "\n" not in message
    for value in (math.nan, math.inf, -math.inf):
        with pytest.raises(InputError, match=rf"^{name} = .*must be finite"):
            REFERENCE.replace(**{name: value})
    for value in ("0.2", None, True, [0.2], 1j):
        with pytest.raises(InputError, match=f"^{name} = .*must be a number"):
            REFERENCE.replace(**{name: value})


@pytest.mark.parametrize(
    ("allowed", "inside", "outside", "words"),
    [
        (ANY, [-1e300, 0], [], "any"),
        (POSITIVE, [5e-324, 1e300], [0, -1], "> 0"),
        (NOT_NEGATIVE, [0, 0.5], [-5e-324], ">= 0"),
        (
            Range(0.1, 2 / 3),
            [0.1, 2 / 3],
            [math.nextafter(0.1, 0), math.nextafter(2 / 3, 1)],
            ">= 0.1 and <= 2/3",
        ),
        (Range(high=1e-7), [-1, 1e-7], [1], "<= 1e-07"),
        (Range(2, whole=True), [2, 3.0], [2.5, 1], "a whole number >= 2"),
        (Range(whole=True), [-3], [0.5], "a whole number"),
    ],
)
def test_ranges(allowed, inside, outside, words):
    assert str(allowed) == words
    for number in inside:
        assert check_number("x", number, "m", allowed) == number
        assert parse_number("x", repr(number), "m", allowed) == number
    for number in outside:
        with pytest.raises(InputError) as caught:
            check_number("x", number, "m", allowed, "length of the rod")
        said = f"x = {number:g} m is out of range: length of the rod must be {words}"
        assert str(caught.value) == said
        with pytest.raises(InputError, match=r"^x = .* m is out of range: must be "):
            parse_number("x", repr(number), "m", allowed)
    with pytest.raises(InputError, match=r"^x = '5 cm' must be a number in m$"):
        parse_number("x", "5 cm", "m")


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("m = 0.03\nmuu = 0.2", "unknown parameter 'muu' (did you mean 'mu'?)"),
        ("m = 0.03", "missing parameter 'r', 'R', 'j'"),
        ("m = ", "is not valid TOML"),
        ("m = 1\nmu = 0,2\n", "line 2, column 7); a number takes a point, not a comma"),
        (f"{BALL}m = 1\n[fluid]\nnu_f = 1e-6\nrho_f = 1.0\nrho_b = 2.0", "m follows"),
        (f"{BALL}[fluid]\nnu = 1e-6", "unknown fluid property 'nu'"),
        (f"{BALL}[fluid]\nnu_f = 1e-6\nrho_f = 2.0\nrho_b = 1.0", "floats"),
        (f"{BALL}[fluid]\nnu_f = -1e-6\nrho_f = 1.0\nrho_b = 2.0", "nu_f = -1e-06"),
        ("fluid = 3", "must be a table"),
        (
            "r = 0.01\nR = '5 cm'\nm = 1\nj = 0.4\nmu = 0.2\neta = 0.2\n"
            "g = 9.8\nc = 1\nomega_0 = 1",
            "R = '5 cm'",
        ),
    ],
)
def test_a_bad_file_is_one_clear_line(tmp_path, text, says):
    path = tmp_path / "mine.toml"
    path.write_text(text)
    with pytest.raises(InputError) as caught:
        Parameters.load(path)
    assert says in str(caught.value)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_file_of_a_million_keys_is_refused_at_once(tmp_path):
    many = tmp_path / "many.toml"
    many.write_text("".join(f"k{n} = 1\n" for n in range(100_000)))
    for path in (many, "/dev/zero"):
        with pytest.raises(StorageError, match=f"cannot read {path}: it has more than 1 MB"):
            Parameters.load(path)


def test_files_that_cannot_be_read_or_written(tmp_path):
    with pytest.raises(StorageError, match="No such file"):
        Parameters.load(tmp_path / "absent.toml")
    (tmp_path / "binary.toml").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(StorageError, match="not valid TOML: it must be text in UTF-8"):
        Parameters.load(tmp_path / "binary.toml")
    with pytest.raises(StorageError, match="cannot write"):
        REFERENCE.save(tmp_path / "absent" / "p.toml")


def test_what_is_no_name_names_no_set():
    for name in (3, None, b"reference"):
        with pytest.raises(InputError, match="no parameter set is named"):
            Parameters.named(name)
