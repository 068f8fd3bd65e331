"""Which confirmations does an engine lose that loses numbers? ``python -m tests.thinned DIR``

What the judge was given is thinned, as by an engine that drops rows or makes them worthless, and
claims are judged anew. Prints how many each engine still confirms, and which."""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

from compare import validation
from compare.assessment import full_verdict
from compare.catalogue import CLAIMS
from compare.claim import Claim, Outcome
from compare.kit.record import Measurement, Records, RecordsByEngine

Thin = Callable[[Sequence[Measurement]], Sequence[Measurement]]
"""What is left of the measurements of a protocol and a quantity."""


def every_second(change: Callable[[Measurement], Measurement]) -> Thin:
    """Every second measurement is changed, beginning with the second."""
    return lambda rows: [change(m) if k % 2 else m for k, m in enumerate(rows)]


WAYS: dict[str, Thin] = {
    "one number of each quantity kept": lambda rows: rows[:1],
    "every second gone": lambda rows: rows[::2],
    "every second without a value": every_second(lambda m: replace(m, value=float("nan"))),
    "every second worthless": every_second(lambda m: replace(m, uncertainty=1e9)),
    "the reference gone": lambda rows: [m for m in rows if m.set != "reference"],
}


def thinned(records: Records, thin: Thin) -> Records:
    """Records of which measurements are thinned, while their plan stays."""
    kinds: dict[tuple[str, str], list[Measurement]] = {}
    for m in records.measurements:
        kinds.setdefault((m.protocol, m.quantity), []).append(m)
    left = tuple(m for rows in kinds.values() for m in thin(rows))
    return replace(records, measurements=left)


def without_criterion(claim: Claim, records: Records) -> Records:
    """Records without what bears on the last criterion of a claim."""
    last = claim.criteria[-1]
    gone = {id(m) for m in records.select(last.protocol, last.quantity, last.when)}
    left = tuple(m for m in records.measurements if id(m) not in gone)
    return replace(records, measurements=left)


def outcomes(claim: Claim, records: RecordsByEngine) -> dict[str, Outcome]:
    """What each engine says of a claim."""
    return {each.engine: each.outcome for each in full_verdict(claim, records).engines}


def changed(records: RecordsByEngine, change: Callable[[Records], Records]) -> RecordsByEngine:
    """What every engine measured, changed."""
    return {name: {n: change(own) for n, own in steps.items()} for name, steps in records.items()}


def main(directory: str) -> None:
    """Print the confirmations that are left by each way of thinning."""
    records = validation.stored(Path(directory))
    confirmed = {
        (claim.id, name)
        for claim in CLAIMS
        for name, outcome in outcomes(claim, records).items()
        if outcome is Outcome.CONFIRMED
    }
    asked = [claim for claim in CLAIMS if any(claim.id == of for of, _ in confirmed)]
    print("as measured:", dict(Counter(name for _, name in confirmed)))
    for way, thin in WAYS.items():
        left = changed(records, lambda records, thin=thin: thinned(records, thin))
        report(way, confirmed, {claim.id: outcomes(claim, left) for claim in asked})
    criterion = {
        claim.id: outcomes(claim, changed(records, lambda r, of=claim: without_criterion(of, r)))
        for claim in asked
    }
    report("the last criterion of each claim gone", confirmed, criterion)


def report(way: str, confirmed: set[tuple[str, str]], after: dict[str, dict[str, Outcome]]) -> int:
    """Print which confirmations are left after a way of thinning; how many."""
    left = [(of, name) for of, name in sorted(confirmed) if after[of][name] is Outcome.CONFIRMED]
    print(f"{way}: {dict(Counter(name for _, name in left))}")
    print("   ", ", ".join(f"{of} ({name})" for of, name in left) or "none", flush=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
