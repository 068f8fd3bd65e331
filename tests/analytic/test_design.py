"""Design of a flowmeter, against closed forms, differences of other widths, sampling and brute force."""

import itertools
import math
from functools import partial

import numpy as np
import pytest

from analytic import operating_range, solution, stable_solutions, thresholds
from analytic.bifurcation import diagram as bifurcation
from analytic.flowmeter import design
from model import Case, InputError, Parameters

WATER = partial(Parameters.from_fluid, nu_f=1.004e-6, rho_f=998.2, gravity=9.81)
STEEL = {"r": 0.005, "R": 0.025, "rho_b": 7850.0, "mu": 0.2, "eta": 0.2, "j": 0.4}
TOLERANCES = {"mu": 0.2, "eta": 0.2, "r": 0.02, "R": 0.01}
P = Parameters.named("reference")


@pytest.mark.parametrize("trial", range(5))
def test_sensitivities_have_these_closed_forms(trial: int) -> None:
    """Logarithmic derivatives of (84)-(86), of g = gravity (1 - rho_f/rho_b) and of c ~ nu_f rho_f/(rho_b r^2)."""
    rng = np.random.default_rng(trial)
    mu, j, rho_b = rng.uniform(0.05, 1.5), rng.uniform(0.2, 0.6), rng.uniform(1200, 9000)
    eta = j * rng.uniform(0.1, 0.9)
    at = STEEL | {"mu": mu, "eta": eta, "j": j, "rho_b": rho_b} | {"nu_f": 1e-6, "rho_f": 1000.0, "gravity": 9.8}
    by = design.sensitivities(Parameters.from_fluid, at)
    buoyancy = 1000.0 / (rho_b - 1000.0) / 2
    common = {"R": -0.5, "gravity": 0.5, "rho_b": buoyancy, "rho_f": -buoyancy, "r": 0, "nu_f": 0}
    divisor = mu * eta * (1 + j) + j - eta
    expected = {
        "omega_01": {
            "mu": (j - eta) / (2 * divisor),
            "eta": eta * (1 + j) * (1 - mu) / (2 * (1 + eta) * divisor),
            "j": -j * (1 + mu * eta) / (2 * divisor),
        },
        "omega_02": {"mu": 0, "eta": -0.5, "j": 0},
        "omega_03": {"mu": 0, "eta": 0, "j": -0.5},
    }
    for name, own in expected.items():
        for key, value in (common | own).items():
            s = by[name][key]
            assert s.value == pytest.approx(value, abs=1e-9)
            assert abs(s.value - value) <= s.error + 1e-9


@pytest.mark.parametrize("law", ["stokes", "schiller-naumann", "quadratic"])
@pytest.mark.parametrize("eta", [0.02, 0.2, 0.6])
def test_readings_are_those_of_the_stable_solutions(law: str, eta: float) -> None:
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


@pytest.mark.parametrize("tolerances", [{}, {"mu": 0.2, "eta": 0.2}])
def test_best_against_brute_force(tolerances: dict[str, float]) -> None:
    """No point of a grid is better, and the nearest to the optimum is almost as good."""
    bounds = {"r": (0.003, 0.006), "R": (0.02, 0.03), "rho_b": (2500, 8000), "mu": (0.1, 0.3), "eta": (0.1, 0.6)}
    best = design.best(WATER, bounds, tolerances, fastest=15.0)
    grids = [np.linspace(*ends, n) for ends, n in zip(bounds.values(), (2, 2, 2, 2, 21), strict=True)]
    margins = []
    for values in itertools.product(*grids):
        c = design.choice(WATER, dict(zip(bounds, map(float, values), strict=True)), tolerances, 15.0)
        margins.append(c.margin)
    step = 0.5 / 20 / 0.4  # of ln eta on the grid, near the optimum; no |d ln omega_0k/d ln eta| reaches 1 here
    assert max(margins) <= best.margin * (1 + 1e-5)
    assert max(margins) >= best.margin * (1 - step)
    assert best.values["r"] == pytest.approx(0.003, rel=1e-2)  # it doesn't change the limit, but the response
    assert all(low <= best.values[name] <= high for name, (low, high) in bounds.items())
    assert best == design.best(WATER, bounds, tolerances, fastest=15.0)


def test_the_best_wall_is_as_rough_as_the_ball_is_inert() -> None:
    """For mu < 1 omega_01 rises with eta up to sqrt(g/(jR)) at eta = j, whatever mu; beyond, omega_02 falls."""
    c = design.best(P.replace, {"eta": (0.1, 0.6)}, {}, 10.0)
    assert c.values["eta"] == pytest.approx(P.j, rel=1e-4)
    assert c.limit == c.worst
    assert c.worst.omega_0 == pytest.approx(thresholds(P).omega_03, rel=1e-4)
    assert c.margin == c.worst.omega_0 / 10.0
    for mu in (0.05, 0.5, 0.95):
        t = bifurcation.thresholds(P.replace(mu=mu, eta=P.j * (1 - 1e-9)))
        assert t.omega_01 == pytest.approx(t.omega_03, rel=1e-6)


def test_a_response_to_keep() -> None:
    """The time constant (1 + 2j)/c goes with r^2 rho_b: the response limits the density of a ball of one size."""
    bounds = {"r": (0.004, 0.004), "R": (0.03, 0.03), "rho_b": (1100, 8000), "mu": (0.2, 0.2), "eta": (0.2, 0.2)}
    free = design.best(WATER, bounds, {}, 10.0)
    assert free.values["rho_b"] == pytest.approx(8000, rel=1e-3)
    wanted = free.response / 2
    kept = design.best(WATER, bounds, {}, 10.0, wanted)
    assert kept.response == pytest.approx(wanted, rel=1e-3)
    assert kept.values["rho_b"] == pytest.approx(4000, rel=1e-3)
    assert kept.margin < free.margin
    with pytest.raises(InputError, match=r"response = 1 s excludes everything: .* time constant of 7\.0\d s"):
        design.best(WATER, bounds, {}, 10.0, 1.0)

    rolling = solution(P.replace(omega_0=5.0), Case.RR)
    assert design.response_time(P) == pytest.approx(-1 / rolling.eigenvalues[0].real)
    quadratic = P.replace(nu_f=1e-6, drag="quadratic")
    assert design.response_time(quadratic) == math.inf


def test_everything_fixed() -> None:
    c = design.best(WATER, {name: (x, x) for name, x in STEEL.items()}, {"eta": 0.1}, 10.0)
    assert c.values == STEEL
    assert c.worst.omega_0 < operating_range(c.p) == c.limit.omega_0


def test_materials_are_compared_and_those_that_float_refused() -> None:
    """On a wall with eta < j the best ball is the densest, in the smallest vessel, for omega_01 ~ sqrt(g/R)."""
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
    assert "rho_b = 200 kg m-3 is out of range: a ball not denser than the fluid floats" in made.refused["cork"]
    assert made.choice.worst.omega_0 == pytest.approx(made.spread["omega_01"][0])
    assert made.spread["omega_01"][0] < made.thresholds.omega_01 < made.spread["omega_01"][1]
    # The fluid's inertia, for which (1 - s) m, j/(1 - s), g/(1 - s) take the place of m, j, g.
    p, rest = made.choice.p.replace(eta=0.9 * made.choice.p.eta), 1 - 998.2 / 7850
    assert made.with_inertia == pytest.approx(operating_range(p.replace(j=p.j / rest, g=p.g / rest)))
    band, meant = made.curve.band, made.curve.meant
    assert np.all((band[0] <= meant[0]) & (meant[0] <= meant[1]) & (meant[1] <= band[1]))
    exact = made.curve.omega_0 < made.choice.worst.omega_0
    assert band[0][exact].tolist() == band[1][exact].tolist() == made.curve.omega_0[exact].tolist()
