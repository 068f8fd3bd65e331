"""The main job: run the claims, keep the results, write the report."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

from compare import results
from compare.campaign import Campaign, Progress
from compare.catalogue import CLAIMS
from compare.claims import Lab, Level, Verdict, judge, select
from compare.executors import Workers
from compare.progress import Show


def validate(
    output: str | Path = "results", *, level: Level = Level.DEFAULT, claims: Sequence[str] | None = None,
    workers: int | Workers = 1, limit: float = math.inf, progress: Show = lambda what, done, total, failed: None,
) -> list[Verdict]:  # fmt: skip
    """Judge claims, all that belong to the level if None, and store runs, summary and report in a directory.

    What the directory holds already is not computed again. The summary is written after every claim, the report at
    the end, whatever the verdicts.

    Raises
    ------
    InputError
        For an unknown claim.
    StorageError
        If the directory can't be written or holds results of another version.
    """
    from compare import report  # here, because it draws: workers that import this package never need matplotlib

    output = Path(output)
    chosen = select(CLAIMS, claims) if claims else [claim for claim in CLAIMS if claim.level <= level]
    summary = results.open_directory(output)
    verdicts: list[Verdict] = []
    with Campaign(output / results.RUNS, workers, limit=limit) as campaign:
        for k, claim in enumerate(chosen, start=1):
            what = f"claim {k}/{len(chosen)} {claim.id}"

            def tell(now: Progress, what: str = what) -> None:
                progress(what, now.done, now.total, now.failed)

            campaign.report = tell
            verdicts.append(judge(claim, Lab(campaign, level)))
            summary = summary.with_verdicts(level.name, verdicts[-1:])
            results.save(summary, output)
    report.write(output)
    return verdicts
