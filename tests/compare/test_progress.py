"""What is announced of the time that is left is true on machines of any pace."""

import time
from types import SimpleNamespace

import pytest

from compare.campaign import progress

COSTS = {f"protocol {k}": 10.0 for k in range(30)}
"""Seconds on a machine that is free."""


@pytest.fixture
def clock(monkeypatch):
    """What progress takes for the time."""
    clock = SimpleNamespace(now=0.0)
    monkeypatch.setattr(progress.time, "monotonic", lambda: clock.now)
    return clock


@pytest.mark.parametrize("pace", [0.5, 1.0, 2.0])
@pytest.mark.parametrize("workers", [1, 4])
def test_the_time_left_is_right_within_a_factor_of_two_after_twenty_seconds(pace, workers, clock):
    said = []
    far = progress.ValidationProgress(lambda *told: said.append(told), 30, workers, COSTS)
    lasts = pace * sum(COSTS.values()) / workers
    at_once = 1 if workers == 1 else workers + 2  # each in many rounds of runs of its own
    for k in range(0, len(COSTS), at_once):
        names = list(COSTS)[k : k + at_once]
        for part in range(5 * at_once):
            clock.now = now = (k + part / 5) / len(COSTS) * lasts
            far.measuring(names[part % at_once], part % 3, 3, 0)
            done = said[-1][1] / said[-1][2]
            if now >= 20 and lasts - now > 0.2 * lasts:
                extrapolated = now * (1 - done) / done  # as the reporter does
                assert 0.5 < extrapolated / (lasts - now) < 2, (now, lasts)
        clock.now = (k + at_once) / len(COSTS) * lasts
        for name in names:
            far.measured(name)
    assert far.left() == pytest.approx(progress.DRAWING * lasts)


def test_what_is_stored_tells_nothing_of_the_pace(clock):
    costs = COSTS | {"protocol 0": 0.0}  # it is there already
    far = progress.ValidationProgress(progress.show_nothing, 30, 1, costs)
    before = far.left()
    far.measured("protocol 0")
    assert far.left() == before


def test_a_word_comes_before_anything_is_known(monkeypatch, capsys):
    monkeypatch.setattr(progress, "INTERVAL", 0.01)
    with progress.reporter():
        time.sleep(0.2)
    assert "0 s: getting ready" in capsys.readouterr().err


def test_silence_between_two_parts_is_no_sign_that_they_are_slow(clock):
    pace = progress._Pace()
    for done in range(5):
        clock.now = 10.0 * done
        pace.note(done, 10)
    clock.now += 9.0
    pace.note(4, 10)  # nothing new
    assert pace.left() == pytest.approx(100.0 - clock.now)


def test_another_part_has_a_pace_of_its_own(clock):
    pace = progress._Pace()
    for total, takes in ((10, 1.0), (20, 5.0)):
        for done in range(5):
            pace.note(done, total)
            clock.now += takes
    assert pace.left() == pytest.approx(16 * 5.0 - 5.0)


@pytest.mark.parametrize("meanwhile", [0, 10])
def test_compiling_counts_where_others_went_on(monkeypatch, meanwhile):
    """For 40 s, after 10 s of work; 10 s more at a part a second."""
    now = 0.0
    monkeypatch.setattr(progress.time, "monotonic", lambda: now)
    monkeypatch.setattr(progress.compiling, "now", lambda: "compiling" * (11 <= now < 51))
    pace, told = progress._Pace(), {0: 0, 10: 9, 49: 9 + meanwhile, 60: 20 + meanwhile}
    for second in range(61):
        now = float(second)
        pace.look()
        if second in told:
            pace.note(told[second], 60)
    a_part = 60 / 30 if meanwhile else 20 / 20
    assert pace.left() == pytest.approx(a_part * (60 - told[60]))


def test_what_is_shown_is_what_is_being_measured_on_a_short_line():
    said = []
    far = progress.ValidationProgress(lambda what, *_: said.append(what), 30)
    for k in range(5):
        far.measuring(f"protocol {k}", 1, 2, 0)
    assert said[-1] == (
        "0 of 30 claims judged; measuring protocol 0 1/2, protocol 1 1/2, protocol 2 1/2 and 2 more"
    )
    for k in range(5):
        far.measuring(f"protocol {k}", 2, 2, 0)
    assert said[-1] == "0 of 30 claims judged"
