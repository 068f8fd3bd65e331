"""A design keeps the response asked for, compares materials, and its readings are those of stable
solutions."""

import math
from functools import partial

import numpy as np
import pytest

from analytic import operating_range, solution, stable_solutions, thresholds
from analytic.flowmeter import design
from model import Case, InputError, Parameters

WATER = partial(Parameters.from_fluid, nu_f=1.004e-6, rho_f=998.2, gravity=9.81)
P = Parameters.named("reference")


@pytest.mark.parametrize("law", ["stokes", "schiller-naumann", "quadratic"])
@pytest.mark.parametrize("eta", [0.02, 0.2, 0.6])
def test_readings_are_those_of_the_stable_solutions(law, eta):
    """Between omega_02 and omega_04 two: slip while the flow rises, the wall while it falls."""
    p = P.replace(eta=eta, drag=law, nu_f=1e-4)
    t = thresholds(p)
    marks = np.sort([w for w in (t.omega_01, t.omega_02, t.omega_03, t.omega_04) if np.isfinite(w)])
    flows = np.array([marks[0] * 0.5, *(marks[1:] + marks[:-1]) / 2, marks[-1] * 1.1])
    low, high = design.readings(p, flows)
    for k, omega_0 in enumerate(flows):
        orbits = [s.state.omega_c for s in stable_solutions(p.replace(omega_0=float(omega_0)))]
        assert [low[k], high[k]] == pytest.approx([min(orbits), max(orbits)], rel=1e-11)
    assert np.all(np.isnan(design.readings(P.replace(c=0.0), flows)))
    assert design.readings(P.replace(mu=0.0), flows)[0].tolist() == flows.tolist()


def test_a_response_to_keep():
    """The time constant (1 + 2j)/c goes with r^2 rho_b: the response limits the density of a ball
    of one size."""
    exact = {"r": 0.004, "R": 0.03, "mu": 0.2, "eta": 0.2}
    bounds = {name: (value, value) for name, value in exact.items()} | {"rho_b": (1100, 8000)}
    free = design.best(WATER, bounds, {}, 10.0)
    assert free.values["rho_b"] == pytest.approx(8000, rel=1e-3)
    wanted = free.response / 2
    kept = design.best(WATER, bounds, {}, 10.0, wanted)
    assert kept.response == pytest.approx(wanted, rel=1e-3)
    assert kept.values["rho_b"] == pytest.approx(4000, rel=1e-3)
    assert kept.margin < free.margin
    says = r"response = 1 s excludes everything: .* time constant of 7\.0\d s"
    with pytest.raises(InputError, match=says):
        design.best(WATER, bounds, {}, 10.0, 1.0)

    rolling = solution(P.replace(omega_0=5.0), Case.RR)
    assert design.response_time(P) == pytest.approx(-1 / rolling.eigenvalues[0].real)
    quadratic = P.replace(nu_f=1e-6, drag="quadratic")
    assert design.response_time(quadratic) == math.inf


def test_materials_are_compared_and_those_that_float_refused():
    """On a wall with eta < j the best ball is the densest, in the smallest vessel, for omega_01 ~
    sqrt(g/R)."""
    bounds = {"r": (0.005, 0.005), "R": (0.02, 0.03), "mu": (0.2, 0.2), "eta": (0.1, 0.2)}
    densities = {"cork": 200.0, "glass": 2500.0, "steel": 7850.0}
    request = design.Request(
        fluid={"nu_f": 1e-6, "rho_f": 998.2, "gravity": 9.81},
        slowest=2.0,
        fastest=15.0,
        bounds={name: bounds | {"rho_b": (rho_b, rho_b)} for name, rho_b in densities.items()},
        tolerances={"eta": 0.1},
    )
    made = design.design(request)
    assert list(made.choices) == ["glass", "steel"]
    assert made.material == "steel"
    assert made.choice.values["R"] == pytest.approx(0.02, rel=1e-4)
    why = "rho_b = 200 kg m-3 is out of range: a ball not denser than the fluid floats"
    assert why in made.refused["cork"]
    assert made.choice.worst.omega_0 == pytest.approx(made.spread["omega_01"][0])
    assert made.spread["omega_01"][0] < made.thresholds.omega_01 < made.spread["omega_01"][1]
    # The fluid's inertia, for which (1 - s) m, j/(1 - s), g/(1 - s) take the place of m, j, g.
    p, rest = made.choice.p.replace(eta=0.9 * made.choice.p.eta), 1 - 998.2 / 7850
    like = p.replace(j=p.j / rest, g=p.g / rest)
    assert made.with_inertia == pytest.approx(operating_range(like))
    band, meant = made.curve.band, made.curve.meant
    assert np.all((band[0] <= meant[0]) & (meant[0] <= meant[1]) & (meant[1] <= band[1]))
    exact = made.curve.omega_0 < made.choice.worst.omega_0
    assert band[0][exact].tolist() == band[1][exact].tolist() == made.curve.omega_0[exact].tolist()
