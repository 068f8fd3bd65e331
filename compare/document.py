"""Write the measured tables of docs/mujoco-settings.md: ``python -m compare.document docs/mujoco-settings.md``.

Each table stands between two lines ``<!-- begin: NAME -->`` and ``<!-- end: NAME -->``. Runs are kept in a results
directory and not computed again; `mjsim.confirmation` writes the table of the formulas.
"""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

from compare import ablation, accuracy, confusion, frontier, progress, results
from compare.accuracy import Rows, number
from compare.campaign import Campaign
from compare.claims import Check, Claim, Lab, Level
from mjsim import confirmation
from model import Case, InputError
from model.files import write_text


def write(page: Path, name: str, rows: Rows) -> None:
    """Put a table where a page has its name; raises `InputError` if it has no place for it."""
    text = page.read_text("utf-8")
    begin, end = f"<!-- begin: {name} -->", f"<!-- end: {name} -->"
    if text.count(begin) != 1 or text.count(end) != 1:
        raise InputError(f"{page} must have the lines {begin!r} and {end!r} once each")
    before, rest = text.split(begin)
    write_text(page, f"{before}{begin}\n{markdown(rows)}\n{end}{rest.split(end)[1]}")


def markdown(rows: Rows) -> str:
    """A table with its head."""
    head, *body = (f"| {' | '.join(row)} |" for row in rows)
    return "\n".join([head, f"|{'---|' * len(rows[0])}", *body])


def _checks(lab: Lab, claims: Sequence[Claim]) -> list[Check]:
    return [check for claim in claims for check in claim.study(lab)]


def _ladder(lab: Lab) -> Rows:
    """What each of the settings takes away."""
    values = {(c.condition, c.quantity): c.measured for c in _checks(lab, ablation.CLAIMS)}
    names = [*frontier.STATES, frontier.TRANSIENT]
    rows = [["settings", *names, "open in SS 25"]]
    for settings in ablation.LADDER:
        errors = [number(values[settings, name]) for name in names]
        rows.append([settings, *errors, f"{values[settings, 'open in SS 25']:.0%}"])
    return rows


def _frontier(lab: Lab) -> Rows:
    """Error and cost, by method and step."""
    found: dict[str, dict[str, float]] = {}
    for check in _checks(lab, frontier.CLAIMS):
        found.setdefault(check.condition, {})[check.quantity] = check.measured
    names = [*frontier.STATES, frontier.TRANSIENT]
    rows = [["method", "h", *names, frontier.COST]]
    for condition, values in found.items():
        method, step = condition.split("; h = ")
        h = float(step.removesuffix(" s"))
        told = f"{1e3 * h:g} ms" if h else "as it needs"
        rows.append([method, told, *(number(values[n]) for n in names), f"{values[frontier.COST]:.3f}"])
    for method, values_at in frontier.ELSEWHERE.items():
        state, passing = values_at["SS 25"], values_at[frontier.TRANSIENT]
        rows.append(
            [
                f"{method} (measured once, elsewhere)", f"{1e3 * state[1]:g} ms; transient {1e3 * passing[1]:g} ms",
                *(number(values_at[n][0]) for n in names), f"{state[2] / state[1]:.3f}; {passing[2] / passing[1]:.2f}",
            ]
        )  # fmt: skip
    return rows


def _cases(lab: Lab) -> Rows:
    """Shares of the samples of a case that are told as it, and as which others."""
    rows = [["case", "samples", "told rightly", "else told as"]]
    checks = _checks(lab, confusion.CLAIMS)
    for case in Case:
        row = [c for c in checks if c.condition.startswith(f"{case.name} told")]
        others = {c.condition.split(",")[0].split(" told as ")[1]: c.measured for c in row}
        right = others.pop(case.name)
        samples = row[0].condition.split(", ")[1].removesuffix(" samples")
        rows.append([case.name, samples, f"{right:.2%}", ", ".join(f"{n} {v:.2%}" for n, v in others.items())])
    return rows


TABLES: dict[str, Callable[[Lab], Rows]] = {
    "reached": accuracy.reached,
    "random": accuracy.random_sets,
    "transient": accuracy.transient,
    "events": accuracy.event_times,
    "thresholds": accuracy.measured_thresholds,
    "split": accuracy.force_split,
    "ablation": _ladder,
    "frontier": _frontier,
    "cases": _cases,
    "variants": accuracy.variants,
}
"""The tables by name."""


def main(argv: Sequence[str] | None = None) -> int:
    """Measure and write all tables of a page, or those named."""
    parser = argparse.ArgumentParser(description="Write the measured tables of docs/mujoco-settings.md.")
    parser.add_argument("page", type=Path, metavar="FILE")
    parser.add_argument("--only", action="append", choices=[*TABLES, "formulas"], metavar="NAME")
    parser.add_argument("-o", "--output", type=Path, default=Path("results"), metavar="DIR", help="where runs are kept")
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1, metavar="N", help="processes (0: none)")
    args = parser.parse_args(argv)
    results.open_directory(args.output)
    with progress.shown() as show, Campaign(args.output / results.RUNS, args.workers) as campaign:
        for name in args.only or [*TABLES, "formulas"]:
            campaign.report = lambda now, what=name: show(what, now.done, now.total, now.failed)  # type: ignore[misc]
            if name == "formulas":
                confirmation.write(args.page)
            else:
                write(args.page, name, TABLES[name](Lab(campaign, Level.DEFAULT)))
    return 0


if __name__ == "__main__":
    sys.exit(main())
