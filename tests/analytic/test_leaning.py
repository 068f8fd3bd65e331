"""SR at the border to NR: the modes of a ball that leans on the floor."""

import numpy as np
import pytest
import sympy as sp

from analytic import contact_forces, leaning_modes, simulate, solution
from analytic.mechanics import dynamics
from model import Case, InputError, Parameters, State
from tests.analytic import newton_euler as ne

P = Parameters.named("high-wall-friction")


def test_modes_in_closed_form() -> None:
    """Trace and determinant of the Jacobian of f_SR, by computer algebra from Newton and Euler."""
    p, w, sign, omega_c, slip = ne.PARAMETERS, *sp.symbols("w s omega_c slip")
    x = State(omega_c=omega_c, slip_x=slip)
    rates = dynamics.newton_euler(Case.SR, x, dynamics.FORCES[Case.SR](x, p, w, (sign, 0)), p, w)
    at = {omega_c: w, slip: p.g / (p.j * w * p.r) - w * p.R / p.r}
    J = sp.Matrix([rates.omega_c, rates.slip_x]).jacobian([omega_c, slip]).subs(at)
    trace = -(p.c + p.mu * sign * (p.g / (p.R * w) - (1 + p.j) * w)) / (1 + p.j)
    assert sp.simplify(J.trace() - trace) == 0
    assert sp.simplify(J.det() + p.mu * sign * p.c * w / (1 + p.j)) == 0


@pytest.mark.parametrize("omega_0", [20.0, 25.0, 40.0, -20.0, -30.0])
def test_modes(omega_0: float) -> None:
    """Sum and product as the docstring has them; leaning grows below omega_03; the vectors lead onto the floor."""
    p = P.replace(omega_0=omega_0)
    values, vectors = leaning_modes(p)
    x = solution(p, Case.SR, stable=omega_0**2 > p.g / (p.j * p.R)).state
    drive = p.mu * np.sign(x.slip_x * omega_0) * abs(omega_0)
    total = -(p.c + drive * (p.g / (p.R * omega_0**2) - (1 + p.j))) / (1 + p.j)
    np.testing.assert_allclose(values.sum(), total, rtol=1e-12)
    np.testing.assert_allclose(values.prod(), -drive * p.c / (1 + p.j), rtol=1e-12)
    assert (values[0].real > 0) == (omega_0**2 < p.g / (p.j * p.R))
    for along_omega_c, along_slip_x in 1e-6 * vectors.real:
        near = x._replace(omega_c=x.omega_c + along_omega_c, slip_x=x.slip_x + along_slip_x)
        assert contact_forces(Case.SR, near, p)[0][1] > 0


@pytest.mark.parametrize("omega_0", [20.0, 30.0])
def test_a_leaning_ball_moves_at_that_rate(omega_0: float) -> None:
    """The event-driven simulation from a push of 1e-5 along the vector: the rate is off by the push at most."""
    p = P.replace(omega_0=omega_0)
    values, vectors = leaning_modes(p)
    x = solution(p, Case.SR, stable=omega_0 > 22.5).state
    size = 1e-5 * abs(x.slip_x)
    by_omega_c, by_slip_x = size * vectors[0].real
    start = x._replace(omega_c=x.omega_c + by_omega_c, slip_x=x.slip_x + by_slip_x)
    run = simulate(p, start, 1.0 / abs(values[0]), rtol=1e-12)
    assert set(run.cases) == {Case.SR}
    lean = run.force_A[:, 1]
    assert np.log(lean[-1] / lean[0]) / run.time[-1] == pytest.approx(values[0].real, rel=1e-3)


def test_nothing_to_lean_with() -> None:
    for change in ({"omega_0": 0.0}, {"mu": 0.0}):
        with pytest.raises(InputError, match="SR has no stationary solution that leans"):
            leaning_modes(P.replace(**change))
