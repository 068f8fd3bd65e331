"""Cases from made-up steps whose case is plain, in one piece or many; events of motions whatever
their sampling."""

import numpy as np
import pytest

import mjsim
from docs.studies.states import HITTING, LANDING
from mjsim import RigidContacts
from mjsim.classify import PERSISTENCE, Classifier, ContactHistory
from model import Case, Parameters

P = Parameters.named("reference")
SETTINGS = RigidContacts()
FAST = 0.1
WEIGHT = P.m * P.g


def made(cases):
    """Steps that show the given cases plainly: loads of the weight, slip of 0.1 m/s, half the
    friction in rolling."""
    letters = np.array([list(case.name) for case in cases])
    closed, slips = letters != "N", letters == "S"
    normal = WEIGHT * closed
    friction = np.array([P.mu, P.eta]) * normal * np.where(slips, 1.0, 0.5)
    return ContactHistory(normal, friction, FAST * slips, 0.01 * ~closed)


def classified(steps, sizes):
    classifier = Classifier(P, SETTINGS.timestep, SETTINGS.midpoint, SETTINGS.dead_band)
    start, count = 0, len(steps.normal)
    for size in sizes:
        stop = min(start + size, count)
        classifier.add(ContactHistory(*(each[start:stop] for each in steps)), stop == count)
        start = stop
    return classifier.cases(np.arange(count)), classifier.events()


@pytest.mark.parametrize("sizes", [[1000], [1] * 1000, [2, 5] * 200])
def test_all_nine_cases_and_their_changes(sizes) -> None:
    cases = [case for case in Case for _ in range(2 * PERSISTENCE)]
    cases_detected, events = classified(made(cases), sizes)
    np.testing.assert_array_equal(cases_detected, cases)
    np.testing.assert_array_equal(events.to_case, list(Case)[1:])
    np.testing.assert_array_equal(events.from_case, list(Case)[:-1])
    # What jumps is located no better than to the steps that a contact takes to stick.
    changes = events.time / SETTINGS.timestep / (2 * PERSISTENCE)
    np.testing.assert_allclose(changes, np.arange(1, 9), rtol=0, atol=1.5 / PERSISTENCE)


@pytest.mark.parametrize("sizes", [[1000], [1] * 1000])
def test_single_steps_change_nothing(sizes) -> None:
    cases = [Case.SS] * 10 + [Case.NS] + [Case.SS] * 4 + [Case.NS, Case.SS] * 10
    cases_detected, events = classified(made(cases), sizes)
    np.testing.assert_array_equal(cases_detected, Case.SS)
    assert len(events) == 0


def test_between_the_bands_a_contact_is_what_it_was() -> None:
    steps = made([Case.RR] * 5 + [Case.SS] * 5 + [Case.SS] * 5)
    band = SETTINGS.dead_band(P.mu * P.g)
    steps.speed[10:] = 2 * band
    assert [Case(c).name for c in classified(steps, [100])[0][[0, 7, 14]]] == ["RR", "SS", "SS"]
    steps.speed[10:, 0] = 0.5 * band
    assert Case(classified(steps, [100])[0][14]).name == "RS"
    # Creep that a rolling contact shares is no slip.
    steps = made([Case.SR] * 5)
    steps.speed[..., 1] = steps.speed[..., 0] / 2
    assert Case(classified(steps, [100])[0][2]).name == "RR"


@pytest.mark.parametrize("motion", [LANDING, HITTING])
def test_cases_and_events_come_from_steps_whatever_the_sampling(motion) -> None:
    """The first contact closes when it should, to a step; then come all cases of theory, in order,
    with some in between that last while a contact settles after an impact."""
    exact = motion.exact.events
    given = motion.p, motion.x0, motion.lasts
    runs = [
        mjsim.simulate(*given, settings=SETTINGS, sample_interval=interval)
        for interval in (1e-3, 7e-3, motion.lasts)
    ]
    for run in runs:
        shown = iter(run.events.to_case)
        assert all(case in shown for case in exact.to_case)
        assert run.events.to_case[-1] == exact.to_case[-1]
        assert abs(run.events.time[0] - exact.time[0]) <= 1.01 * SETTINGS.timestep
        np.testing.assert_array_equal(run.events.time, runs[0].events.time)
    for run in runs[1:]:
        np.testing.assert_array_equal(run.case, runs[0].case[np.rint(run.time / 1e-3).astype(int)])


def test_a_ball_at_rest_is_not_slipping() -> None:
    """From rest it rolls on the floor and, once it is pressed there, may slip on the wall; then it
    rolls, then slips."""
    p = P.replace(omega_0=25.0)
    run = mjsim.simulate(p, np.zeros(8), 3.0, settings=SETTINGS, sample_interval=3.0)
    cases = [run.cases[0].name, *(Case(code).name for code in run.events.to_case)]
    assert set(cases[:-2]) <= {"RS", "RN", "RR"}
    assert cases[-2:] == ["RR", "SS"]
    assert run.events.time[-2:] == pytest.approx([0.52631, 1.41356], abs=5e-4)
