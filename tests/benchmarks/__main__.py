"""``python -m tests.benchmarks``, ``make benchmarks``: the figures of speed, as ratios in one run, into their pages.

Run by hand, some twenty minutes: nothing here fails by a clock, and ``make test`` leaves it out.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path

from compare.kit.pages import Rows
from docs.studies.tables import write
from model.parameters import check_names
from tests.benchmarks import program, theory

DOCS = Path(__file__).parents[2] / "docs"


def main() -> None:
    """Measure and write all tables, or those named."""
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks", description="Write the tables on speed.")
    parser.add_argument("--only", action="append", metavar="NAME", help="only this table (may be repeated)")
    args = parser.parse_args()
    pages: dict[str, dict[str, Callable[[], Rows]]] = {
        "speed.md": {"event-driven": theory.event_driven, "states": theory.states, "many": theory.many,
                     "siconos": theory.stepped},
        "campaigns.md": {"growth": program.growth, "costs": program.costs, "start": program.start_up,
                         "study": program.study},
    }  # fmt: skip
    check_names(args.only or (), [name for tables in pages.values() for name in tables], "table")
    for page, tables in pages.items():
        for name, rows in tables.items():
            if not args.only or name in args.only:
                write(DOCS / page, name, rows())


if __name__ == "__main__":
    main()
