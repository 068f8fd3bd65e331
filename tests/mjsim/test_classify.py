"""Cases from made-up samples whose case is plain, in one block or many."""

import numpy as np
import pytest

from mjsim import ContactSettings
from mjsim.classify import PERSISTENCE, Classifier
from model import Case, Parameters
from model.trajectory import SAMPLE

P = Parameters.named("reference")
SETTINGS = ContactSettings()
FAST = 0.1
WEIGHT = P.m * P.g


def made(cases):
    """Samples that show the given cases plainly: loads of the weight, slip of 0.1 m/s, half the friction in rolling."""
    block = np.zeros(len(cases), SAMPLE)
    block["time"] = np.arange(len(cases))
    for k, case in enumerate(cases):
        for name, letter, coefficient, normal, tangent in (("A", 0, P.mu, 1, 2), ("B", 1, P.eta, 0, 1)):
            state = case.name[letter]
            if state == "N":
                continue
            block[f"force_{name}"][k, normal] = WEIGHT
            block[f"force_{name}"][k, tangent] = coefficient * WEIGHT * (1.0 if state == "S" else 0.5)
            block[f"slip_speed_{name}"][k] = FAST if state == "S" else 0.0
    return block


def classified(block, sizes):
    classifier = Classifier(P, SETTINGS)
    parts, start = [], 0
    for size in sizes:
        stop = min(start + size, len(block))
        parts.append(classifier.add(block[start:stop], stop == len(block)))
        start = stop
    return np.concatenate(parts)["case"], classifier.events


@pytest.mark.parametrize("sizes", [[1000], [1] * 1000, [2, 5] * 200])
def test_all_nine_cases_and_their_changes(sizes) -> None:
    cases = [case for case in Case for _ in range(2 * PERSISTENCE)]
    cases_detected, events = classified(made(cases), sizes)
    np.testing.assert_array_equal(cases_detected, cases)
    np.testing.assert_array_equal(events.to_case, list(Case)[1:])
    np.testing.assert_array_equal(events.from_case, list(Case)[:-1])
    np.testing.assert_array_equal(events.time, np.arange(1, 9) * 2 * PERSISTENCE)


@pytest.mark.parametrize("sizes", [[1000], [1] * 1000])
def test_single_samples_change_nothing(sizes) -> None:
    cases = [Case.SS] * 10 + [Case.NS] + [Case.SS] * 4 + [Case.NS, Case.SS] * 10
    cases_detected, events = classified(made(cases), sizes)
    np.testing.assert_array_equal(cases_detected, Case.SS)
    assert len(events) == 0


def test_between_the_bands_a_contact_is_what_it_was() -> None:
    block = made([Case.RR] * 5 + [Case.SS] * 5 + [Case.SS] * 5)
    band = SETTINGS.regularisation_speed(P.mu * P.g) * 1e-3
    block["slip_speed_A"][10:] = 2 * band
    block["slip_speed_B"][10:] = 2 * band
    assert [Case(c).name for c in classified(block, [100])[0][[0, 7, 14]]] == ["RR", "SS", "SS"]
    block["slip_speed_A"][10:] = 0.5 * band
    assert Case(classified(block, [100])[0][14]).name == "RS"


def test_creep_that_a_rolling_contact_shares_is_no_slip() -> None:
    block = made([Case.SR] * 5)
    block["slip_speed_B"] = block["slip_speed_A"] / 2
    assert Case(classified(block, [100])[0][2]).name == "RR"
