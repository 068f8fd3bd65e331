"""What the verdicts notice: docs/mutants.md and the whole list beside it, docs/mutants.csv, written
by ``python -m tests.mutants ... --page FILE``."""

import csv
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path

from compare.figures import pages
from model.files import write_text
from tests.mutants.theories import FOR_TESTS, THEORIES
from tests.mutants.trial import KINDS, LONGEST, SLOWER, Trial, name_of

_ENDS = "analytic/test_hybrid::test_a_case_ends_where_its_forces_do"
BY_HAND = {
    "SS whose wall never opens": _ENDS,
    "a floor without load that is never lost": _ENDS,
    "NR that slips by B_y alone": _ENDS,
    "RN's slip limit 5 % late": _ENDS,
    "onset of slip that isn't mirrored": (
        "analytic/test_choice::test_never_beyond_what_forces_can_hold_and_continuous_where_it_ends"
    ),
    "the fluid's spin with the wrong sign of ω₀": (
        "analytic/test_real_fluid::test_rolling_with_the_torque_obeys_newton_and_euler"
    ),
    "shares of starts by the normal distribution": "compare/test_basins::test_intervals_of_shares",
    "a return map without its section": "analytic/test_orbits::test_newton_closes_the_orbit",
    "a pinch at 0.95 of the friction": (
        "compare/test_cases::test_rest_needs_the_share_of_friction_that_is_said"
    ),
}
"""Faults in compiled code and in methods, put in by hand, and the test that saw each."""
OTHERS = (
    ("by others, held out", 171, 152, 1, 5, 13),
    ("by others, new", 55, 29, 1, 1, 24),
    ("by a referee, `tests/mutants/referee.py` of aa5b007", 80, 67, 0, 1, 12),
    ("by a second one, `tests/mutants/umpire.py` of ca3cac1", 80, 63, 0, 3, 14),
    ("by a third one, `tests/mutants/arbiter.py` of cf300bf, 60 first", 60, 56, 0, 0, 4),
    ("by a third one, subtler, the same file", 73, 55, 0, 2, 16),
)
"""Lists of wrong theories that others wrote, each judged once, at quick, before anything was
changed for it: faults, and how many were noticed in which way of `KINDS`."""


Tried = Mapping[str, Sequence[Trial]]
"""Trials of wrong theories by who judged them: measurements of a level, all or of an engine."""


def write(path: Path, tried: Tried, engines: Sequence[Trial]) -> None:
    """Write the page, and the whole list as CSV beside it; also the trials of wrong engines."""
    write_text(path, page(tried, engines))
    with path.with_suffix(".csv").open("w", encoding="utf-8", newline="") as file:
        csv.writer(file, lineterminator="\n").writerows(rows(tried, engines))


def page(tried: Tried, engines: Sequence[Trial]) -> str:
    """The page, in Markdown."""
    counts = [[f"theories, by {name}", *_counts(trials)] for name, trials in tried.items()]
    if engines:
        counts.append(["engines, measured anew", *_counts(engines)])
    others = [[f"theories, {who}, judged once", *map(str, of)] for who, *of in OTHERS]
    head = ["wrong", "tried", "noticed by numbers", "by an error", "by hanging", "missed"]
    return f"""# What the verdicts notice

Every verdict must be able to be lost: theory is replaced by slightly wrong ones, one at a time, and
MuJoCo by slightly wrong engines, which measure anew. A fault is noticed if the verdict on a claim
changes; a prediction that takes {SLOWER:g} times as long as by the right theory, at most
{LONGEST:g} s, is given up. Lists that others wrote say more than ours, which was written beside
the claims: each was judged once, at quick, before anything was changed for it. Who notices which
fault, and the unit test that sees what no measurement can show, is in [mutants.csv](mutants.csv).
`make mutants` writes all of it in two hours;
`python -m tests.mutants results --page docs/mutants.md` takes two minutes and leaves out what is
measured anew.

{pages.markdown([head, *counts, *others])}
"""


def _counts(trials: Sequence[Trial]) -> list[str]:
    tried = [trial for trial in trials if trial.tried]
    kinds = Counter(trial.kind for trial in tried)
    return [str(len(tried)), *(str(kinds[kind]) for kind in KINDS)]


def rows(tried: Tried, engines: Sequence[Trial]) -> list[tuple[str, ...]]:
    """All faults, a row each: what is wrong, by whom it is noticed, and the unit test that sees
    it."""
    none = ("",) * len(tried)
    found = [("wrong", "fault", "function", *tried, "unit test")]
    for wrong, *trials in zip(THEORIES, *tried.values(), strict=True):
        found.append(("theory", wrong.what, name_of(wrong), *(each.by for each in trials), ""))
    for wrong in FOR_TESTS:
        test = f"analytic/test_{wrong.test}"
        found.append(("theory", wrong.what, name_of(wrong), *none, test))
    found += [("code", what, "by hand", *none, test) for what, test in BY_HAND.items()]
    found += [("engine", each.what, "mjsim", each.by, *none[1:], "") for each in engines]
    return found
