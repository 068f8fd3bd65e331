"""What settings are refused, and those that fit a problem."""

import pytest

from mjsim import ContactSettings
from model import InputError, Parameters

P = Parameters.named("reference")


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"timestep": 0.0}, r"timestep = 0 s is out of range: must be > 0"),
        ({"timestep": 2e-3}, r"timestep = 0.002 s is too large for the contact settings: .* at most 0.001 s"),
        ({"solimp": 1.0}, r"solimp = 1 1 is out of range"),
        ({"impratio": 1e9}, r"impratio = 1e\+09"),
        ({"solref": (0.1,)}, r"solref = .* must be two numbers"),
        ({"cone": "eliptic"}, r"cone = 'eliptic' must be one of .*did you mean 'elliptic'"),
        ({"integrator": "RK4"}, r"integrator = 'RK4' must be one of"),
        ({"cone": "pyramidal"}, r"memory needs the elliptic cone, not cone = 'pyramidal'"),
        ({"order": 3}, r"order = 3 must be 1 or 2"),
        ({"servo": float("nan")}, r"servo = nan s must be finite"),
    ],
)
def test_refused(changes, words) -> None:
    with pytest.raises(InputError, match=words):
        ContactSettings(**changes)


def test_mapping_round_trip_and_unknown_names() -> None:
    settings = ContactSettings.at(4e-3, impratio=50.0)
    assert ContactSettings.from_mapping(settings.to_mapping()) == settings
    with pytest.raises(InputError, match=r"unknown contact setting 'solimpp' .did you mean 'solimp'"):
        ContactSettings.at(1e-3, solimpp=0.1)


@pytest.mark.parametrize("timestep", [1e-4, 1e-3, 4e-3])
@pytest.mark.parametrize("name", Parameters.names())
def test_for_problem_keeps_slipping_continuous(timestep, name) -> None:
    p = Parameters.named(name).replace(omega_0=60.0)
    settings = ContactSettings.for_problem(p, timestep)
    for friction in (p.mu, p.eta):
        assert settings.hover_number(p.g, friction, p.R * p.omega_0) <= 0.5
        assert settings.fastest_slip(p.g, friction) >= 2 * p.R * p.omega_0
    assert settings.largest_timestep >= timestep * (1 - 1e-12)
