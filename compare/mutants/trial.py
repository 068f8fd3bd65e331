"""Trying the verdicts: which claims notice a wrong theory, and which a wrong engine?

``python -m compare.mutants DIR`` judges the stored measurements of a validation by every wrong theory; with
``--engines`` it also measures with every wrong engine. It exits with 1 if one of them goes unnoticed.
"""

from __future__ import annotations

import functools
from collections.abc import Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path

from compare import validation
from compare.claims.catalogue import CLAIMS
from compare.claims.claim import Outcome, Verdict
from compare.claims.judge import judge
from compare.measure.lab import Level
from compare.measure.record import Records
from compare.mutants import engines
from compare.mutants.engines import WRONG_ENGINES
from compare.mutants.exchange import believed
from compare.mutants.theories import THEORIES
from compare.report import results

Outcomes = Mapping[str, Outcome]


@dataclass(frozen=True)
class Trial:
    """What became of the verdicts under one fault."""

    what: str
    noticed: tuple[tuple[str, Outcome], ...]
    """Claims whose verdict is another than without the fault, and what it is."""


def theories(directory: Path, processes: int = 2) -> list[Trial]:
    """Every wrong theory, judged on the measurements stored in a results directory."""
    with ProcessPoolExecutor(processes, mp_context=get_context("spawn")) as pool:
        return list(pool.map(functools.partial(_theory, directory), range(len(THEORIES))))


def wrong_engines(directory: Path, processes: int = 2) -> list[Trial]:
    """Every wrong engine, measured anew at the quick level; runs are kept in the directory, each engine's apart."""
    with ProcessPoolExecutor(processes, mp_context=get_context("spawn")) as pool:
        return list(pool.map(functools.partial(_engine, directory), range(len(WRONG_ENGINES))))


def page(tried: Sequence[Trial], measured: Sequence[Trial]) -> str:
    """The page that says which claim notices what, in Markdown."""
    lines = [
        "# What the verdicts notice",
        "",
        "Every verdict must be able to be lost. Here the theory is replaced by slightly wrong ones, one at a time,",
        "and the stored measurements of the quick level are judged again; then MuJoCo is replaced by slightly wrong",
        "engines that measure anew. A fault is noticed if the verdict on a claim changes. Written by `make mutants`.",
    ]
    for title, trials in (("Wrong theories", tried), ("Wrong engines", measured)):
        if trials:
            seen = sum(bool(trial.noticed) for trial in trials)
            lines += ["", f"## {title}: {seen} of {len(trials)} noticed", "", "| fault | noticed by |", "|---|---|"]
            lines += [f"| {trial.what} | {_told(trial)} |" for trial in trials]
    return "\n".join(lines) + "\n"


def _told(trial: Trial) -> str:
    claims = [name if outcome is Outcome.REFUTED else f"{name} ({outcome})" for name, outcome in trial.noticed]
    return ", ".join(claims) or "**nobody**"


@functools.cache
def _stored(directory: Path) -> tuple[Records, Outcomes]:
    """Measurements, and the outcomes of the right theory."""
    records = results.load(directory).records(directory)
    return records, _outcomes(judge(CLAIMS, records))


def _theory(directory: Path, number: int) -> Trial:
    records, right = _stored(directory)
    with believed(THEORIES[number]):
        found = _outcomes(judge(CLAIMS, records))
    return Trial(THEORIES[number].what, _changed(right, found))


def _engine(directory: Path, number: int) -> Trial:
    engines.register()
    wrong = WRONG_ENGINES[number]
    _, right = _stored(directory)
    apart = directory / "wrong-engines" / f"{number}"
    verdicts = validation.validate(apart, level=Level.QUICK, engine=wrong, workers=0, report=False)
    return Trial(wrong.name, _changed(right, _outcomes(verdicts)))


def _outcomes(verdicts: Sequence[Verdict]) -> Outcomes:
    return {verdict.claim.id: verdict.outcome for verdict in verdicts}


def _changed(right: Outcomes, found: Outcomes) -> tuple[tuple[str, Outcome], ...]:
    return tuple((name, outcome) for name, outcome in found.items() if outcome is not right[name])
