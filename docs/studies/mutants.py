"""The page on what the verdicts notice, docs/mutants.md, written by ``python -m tests.mutants ...
--page FILE``."""

from __future__ import annotations

import importlib
import inspect
import itertools
import pkgutil
import statistics
import sys
from collections import Counter, defaultdict
from collections.abc import Callable, Container, Mapping, Sequence
from pathlib import Path
from types import CodeType
from typing import TypeVar

import analytic
from compare.catalogue import CLAIMS
from compare.claim import Outcome
from compare.judge import judge
from compare.kit import pages
from compare.kit.quantities import QUANTITIES
from tests.mutants import trial
from tests.mutants.theories import FOR_TESTS, THEORIES
from tests.mutants.trial import KINDS, PATIENCE, Judged, Trial

SUBJECTS = {
    "C_D of the quadratic law": "the quadratic law's C_D is always 0.44",
    "the law of the fluid's torque": "the fluid's torque as in creeping flow",
    "restitution": "rebounds with nine tenths of the restitution",
    "ramps that begin later": "ramps begin with the run",
    "stationary states at ω₀ < 0": "in a flow the other way round the ball spins as before",
    "slow pulsation that falls to rest": "a slow pulsation never falls to rest",
    "fast pulsation with both cones full": "a fast pulsation never fills both cones",
    "RR in the case map for η > j": "regions in which RR never ends for η > j",
    "η_cr of the quadratic law": "η_cr of the quadratic law as under Stokes' drag",
    "η_cr for equal friction": "for equal friction the fold is born at η_cr of the set",
    "RN and ω̃_z": "row of ω̃_z of RN 2 % large",
    "jamming at μ > 1": "rolling lasts while forces can jam it",
    "choice at μ > 1": "rolling goes on while forces allow it",
    "SR on a smooth floor": "on a smooth floor the ball lags by 1 %",
    "leaning direction's sign": "leaning mirrored",
    "leaning direction's factor": "leaning at half the slope",
    "landings on the wall": "landings on the wall with 5 % more friction",
    "added mass": "the fluid adds all of the displaced mass",
    "1 + j of RS": "the wall of RS doesn't turn the spin axis",
    "RS on a smooth wall": "RS on a smooth wall takes friction as if j were 1",
    "SS beyond the fold below ω₀₂": "regions with SS beyond the fold from ω₀₁ on",
    "how fast a ball lifts": "a ball lifts twice as fast",
    "normal forces as slip sets in": "normal forces of floor and wall exchanged",
    "Lyapunov exponents": "exponents to the base of ten",
    "the time of a fall": "a fall ends as if nothing braked it",
    "Reynolds' number": "Reynolds' number by the radius",
    "a design's tolerances": "tolerances are whole widths",
    "a design's margin": "a design's margin without its tolerances",
    "a design's sensitivities": "sensitivities 2 % large",
    "the balance of energy": "energy without the spin about the vertical",
    "rolling off the wall": "the lowest point slips as if the centre didn't move inwards",
    "the spin as a case is chosen": "as a case is chosen the axes turn the spin the other way",
    "1/j of the fluid's torque": "the fluid's torque as if j were 1",
}
"""What wrong theories of others were about that nobody noticed at first, and a wrong theory here
that is about it."""
BY_HAND = {
    "SS whose wall never opens": "analytic/test_hybrid::test_a_case_ends_where_its_forces_do",
    "a floor without load that is never lost": "analytic/test_hybrid::test_a_case_ends_where_its_forces_do",
    "NR that slips by B_y alone": "analytic/test_hybrid::test_a_case_ends_where_its_forces_do",
    "RN's slip limit 5 % late": "analytic/test_hybrid::test_a_case_ends_where_its_forces_do",
    "onset of slip that isn't mirrored": "analytic/test_choice::test_never_beyond_what_forces_can_hold_and_continuous_"
    "where_it_ends",
    "the fluid's spin with the wrong sign of ω₀": "analytic/test_real_fluid::test_rolling_with_the_torque_obeys_newton_"
    "and_euler",
    "shares of starts by the normal distribution": "compare/test_basins::test_intervals_of_shares",
    "a return map without its section": "analytic/test_orbits::test_newton_closes_the_orbit",
    "a pinch at 0.95 of the friction": "compare/test_cases::test_rest_needs_the_share_of_friction_that_is_said",
    "the wall's correction of friction's direction 20 % weak in y": "test_drag::test_slipping_converges_with_the_"
    "square_of_the_step",
}
"""Faults in compiled code, in methods and in MuJoCo's corrections, put in by hand, and the test
that saw each."""
Resolved = tuple[float, str, str]
"""The relative error of a theory that a check notices, its set, and its claim."""
R = TypeVar("R")
PAGE = Path(__file__).with_name("mutants.md")
"""What the page says around its tables."""


def watched(act: Callable[[], R]) -> tuple[R, set[CodeType]]:
    """What a function returns, and the code of all Python functions that were called till then."""
    called = set[CodeType]()
    sys.setprofile(lambda frame, event, of: called.add(frame.f_code) if event == "call" else None)
    try:
        return act(), called
    finally:
        sys.setprofile(None)


def untried(called: Container[CodeType]) -> list[str]:
    """Public functions of `analytic`, as ``module.function``, that were not called and that no
    wrong theory changes."""
    changed, names = {f"{wrong.module}.{wrong.function}" for wrong in THEORIES}, []
    for module in pkgutil.walk_packages(analytic.__path__, "analytic."):
        for name, value in vars(importlib.import_module(module.name)).items():
            if (
                name.startswith("_") or not callable(value) or hasattr(value, "py_func")
            ):  # private, or numba's
                continue
            function = inspect.unwrap(value)
            own = inspect.isfunction(function) and function.__module__ == module.name
            if own and function.__code__ not in called and f"{module.name}.{name}" not in changed:
                names.append(f"{module.name}.{name}".removeprefix("analytic."))
    return sorted(names)


def _resolving(directory: Path) -> tuple[dict[str, list[Resolved]], list[str]]:
    """By quantity what the checks of a results directory resolve, the coarsest first; and what
    nothing tries."""
    power, records = defaultdict[str, list[Resolved]](list), trial.measured(directory)
    verdicts, called = watched(lambda: judge(CLAIMS, records))
    for each in verdicts:
        if each.outcome is Outcome.CONFIRMED:
            for check in each.checks:
                power[check.measurement.quantity].append(
                    (check.resolves, check.measurement.set, each.claim.id)
                )
    return {quantity: sorted(rows)[::-1] for quantity, rows in power.items()}, untried(called)


def page(levels: Sequence[Judged], measured: Sequence[Trial], alone: Sequence[Judged] = ()) -> str:
    """The page that says which claim notices what, in Markdown, with the trials of wrong engines.

    And what witnesses `alone` notice.
    """
    powers, untried_at = zip(*(_resolving(level.directory) for level in levels), strict=True)
    columns = [
        f"{level.name}: {what}" for level in levels for what in ("largest", "median", "a tenth")
    ]
    rows = [["quantity", "ceiling", *columns, "where"]]
    for name, quantity in QUANTITIES.items():
        if quantity.resolution and name in powers[-1]:
            cells = [
                _power([each[0] for each in power.get(name, ())], quantity.resolution)
                for power in powers
            ]
            where = "{1}, {2}".format(*powers[-1][name][0])
            rows.append(
                [quantity.symbol, f"{quantity.resolution:.2g}", *itertools.chain(*cells), where]
            )
    tables = _table("theories", {each.name: each.trials for each in (*levels, *alone)})
    tables += _table("engines", {"quick": measured}) if measured else ""
    names, partly = (
        " and ".join(level.name for level in each)
        for each in (levels, [e for e in levels if not e.whole])
    )
    until = f" (at {partly} until a claim notices it, the quickest first)" if partly else ""
    tried = [trial for trial in levels[0].trials if trial.tried]
    kinds = Counter(trial.kind for trial in tried)
    words = {"first": levels[0].name, "tried": len(tried), **{name: kinds[name] for name in KINDS}}
    words |= {"levels": names, "until": until, "patience": PATIENCE, "level": levels[-1].name}
    lists = {"untried": _by_module(untried_at[-1]), "powers": pages.markdown(rows)}
    lists |= {"subjects": pages.markdown(_subjects(levels[0].trials))}
    return PAGE.read_text("utf-8").format(trials=tables, **words, **lists)


def _subjects(trials: Sequence[Trial]) -> list[list[str]]:
    """Who notices wrong theories about each of `SUBJECTS`, and the faults `BY_HAND`."""
    measured, tests = (
        {trial.what: trial.by for trial in trials},
        {wrong.what: wrong.test for wrong in FOR_TESTS},
    )
    rows = [["subject", "wrong theory", "noticed by a claim", "by a unit test"]]
    for subject, what in SUBJECTS.items():
        test = f"`analytic/test_{tests[what]}`" if what in tests else "–"
        rows.append([subject, what, measured.get(what, "–"), test])
    return rows + [
        [subject, "by hand", "not tried", f"`{test}`"] for subject, test in BY_HAND.items()
    ]


def _by_module(names: Sequence[str]) -> str:
    """Functions as a list in Markdown, an item a module."""
    parts = (name.rpartition(".") for name in names)
    modules = itertools.groupby(parts, lambda part: part[0])
    return "\n".join(
        f"* `{module}`: {', '.join(f'`{name}`' for *_, name in own)}" for module, own in modules
    )


def _power(values: Sequence[float], ceiling: float) -> tuple[str, ...]:
    if not values:
        return ("not measured",) * 3
    sharp = sum(value <= ceiling / 10 for value in values) / len(values)
    return f"{max(values):.2g}", f"{statistics.median(values):.2g}", f"{sharp:.0%}"


def _table(what: str, tried: Mapping[str, Sequence[Trial]]) -> str:
    noticed = ", ".join(
        f"{sum(bool(trial.noticed) for trial in trials)} at {level}"
        for level, trials in tried.items()
    )
    hung = ", ".join(
        f"{sum(bool(trial.hung) for trial in trials)} at {level}" for level, trials in tried.items()
    )
    rows = [
        [trials[0].what, *(trial.by for trial in trials)]
        for trials in zip(*tried.values(), strict=True)
    ]
    table = pages.markdown([["fault", *tried], *rows])
    return f"\n## Wrong {what}, {len(rows)}: noticed {noticed}\n\nFaults that hang a claim: {hung}.\n\n{table}\n"
