"""Cases told and the ladder of settings: what is left out, what is counted, and what each rung adds."""

import dataclasses
import math

import numpy as np

import analytic
from compare import ablation, confusion, frontier
from compare.campaign import Campaign
from compare.claims import Lab, Level
from compare.tasks import Task
from mjsim import ContactSettings
from model import Case


def test_motions_visit_all_nine_cases():
    visited = set()
    for p, x0 in confusion.MOTIONS:
        run = analytic.simulate(p, x0, confusion.LASTS, sample_interval=1e-3)
        visited |= {int(run.case[0]), *run.events.from_case.tolist(), *run.events.to_case.tolist()}
    assert visited == {int(case) for case in Case}


def test_dead_times_lie_on_both_sides_of_a_change():
    p, x0 = confusion.MOTIONS[0]
    run = analytic.simulate(p, x0, 0.1, sample_interval=confusion.STEP)
    landing = run.events.time[run.events.impulse_A[:, 1] > 0][0]
    reach, alive = confusion.DEAD * confusion.STEP, confusion.alive(run)
    assert not alive[np.abs(run.time - landing) < reach].any()
    before = landing - reach - run.time
    assert alive[(before > 0) & (before < 5 * confusion.STEP)].all()


def test_a_motion_agrees_with_itself():
    p, x0 = confusion.MOTIONS[1]
    motion = analytic.simulate(p, x0, confusion.LASTS, sample_interval=confusion.STEP)
    piece = confusion.Piece(0, 0, confusion.pieces([motion], 4)[0].task)
    counts = confusion.confusion([motion], [piece], [motion])
    assert counts.sum() == np.trace(counts) == confusion.alive(motion)[confusion.DEAD : -1].sum()


def test_the_ladder_ends_at_the_defaults():
    *_, last = ablation.LADDER.values()
    assert last == ContactSettings()
    for low, high in zip(list(ablation.LADDER.values())[4:], list(ablation.LADDER.values())[5:], strict=False):
        changed = [f.name for f in dataclasses.fields(low) if getattr(low, f.name) != getattr(high, f.name)]
        assert len(changed) == 1


def scored(*numbers: tuple[float, float]) -> list[frontier.Score]:
    """Scores with the given errors and shares of closed samples."""
    task = Task(engine="event", parameters=frontier.REFERENCE, x0=(0.0,) * 6, t_end=0.1)
    return [frontier.Score(f"state {k}", error, closed, task) for k, (error, closed) in enumerate(numbers)]


def test_a_step_of_the_ladder_is_in_vain_unless_it_halves_a_number():
    before = scored((1e-2, 0.6), (1e-3, 1.0))
    assert not ablation._gain(before, before)
    assert not ablation._gain(before, scored((6e-3, 0.7), (9e-4, 1.0)))
    assert ablation._gain(before, scored((2e-2, 0.5), (4e-4, 1.0)))
    assert ablation._gain(before, scored((2e-2, 0.9), (2e-3, 1.0)))
    assert not ablation._gain(before, scored((math.nan, 0.6), (math.nan, 1.0)))


def test_a_cost_is_measured_once(tmp_path):
    (score,) = scored((0.0, 1.0))
    with Campaign(tmp_path, workers=0) as campaign:
        lab = Lab(campaign, Level.QUICK)
        first = frontier.cost(lab, score.task)
        assert first > 0
        assert frontier.cost(lab, score.task) == first
