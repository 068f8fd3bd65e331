"""An argument of another type is one clear line, before anything is computed with it."""

import pytest

import analytic
import compare
import mjsim
from model import Flow, InputError, Parameters, State

P, AT_REST, WORDS = Parameters.named("reference"), [0] * 6, {"mu": 0.2}


@pytest.mark.parametrize(
    ("call", "says"),
    [
        (lambda: analytic.simulate(WORDS, AT_REST, 1.0), "p must be Parameters, not dict"),
        (lambda: analytic.simulate(P, "rest", 1.0), "a state must be numbers, not 'rest'"),
        (lambda: analytic.simulate(P, AT_REST, 1.0, 25.0), "flow must be Flow, not float"),
        (lambda: analytic.simulate(P, AT_REST, 1.0, settings="fast"), "settings must be Settings, not str"),
        (lambda: analytic.simulate_many([P, WORDS], AT_REST, 1.0), "parameters must be Parameters, not dict"),
        (lambda: analytic.simulate_many(P, AT_REST, 1.0, [25.0]), "flow must be Flow, not float"),
        (lambda: analytic.attractors(WORDS), "p must be Parameters, not dict"),
        (lambda: analytic.attractors(P, "many"), "a state must be numbers, not 'many'"),
        (lambda: analytic.thresholds(WORDS), "p must be Parameters, not dict"),
        (lambda: analytic.stationary_solutions(0.2), "p must be Parameters, not float"),
        (lambda: analytic.operating_range(WORDS), "p must be Parameters, not dict"),
        (lambda: analytic.vector_field("RR", State(), WORDS), "p must be Parameters, not dict"),
        (lambda: mjsim.simulate(WORDS, AT_REST, 1.0), "p must be Parameters, not dict"),
        (lambda: mjsim.simulate(P, "rest", 1.0), "a state must be numbers, not 'rest'"),
        (lambda: mjsim.simulate(P, AT_REST, 1.0, 25.0), "flow must be Flow, not float"),
        (lambda: mjsim.simulate(P, AT_REST, 1.0, settings=""), "settings must be ContactSettings, not str"),
        (lambda: mjsim.simulate_many(P, [AT_REST], 1.0), "parameters must be Sequence, not Parameters"),
        (lambda: mjsim.simulate_many([WORDS], [AT_REST], 1.0), "p must be Parameters, not dict"),
        (lambda: mjsim.simulate_many([P], [AT_REST], 1.0, [0.0]), "flow must be Flow, not float"),
        (lambda: compare.validate("nowhere", sets={"mine": WORDS}), "sets must be Parameters, not dict"),
        (lambda: Flow.steady("fast"), "omega_0 of flow sample 0 = 'fast' must be a number in rad s-1"),
    ],
)
def test_an_argument_of_another_type(call, says):
    with pytest.raises(InputError) as caught:
        call()
    assert str(caught.value) == says
