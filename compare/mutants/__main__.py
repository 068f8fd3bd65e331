"""``python -m compare.mutants``: try the verdicts, and write the page that says what they notice."""

from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path

from compare.mutants import trial
from model import InputError
from model.files import write_text


def main() -> int:
    """Return 0 if enough faults were noticed, 1 if not, 2 where there is nothing to judge."""
    parser = argparse.ArgumentParser(prog="python -m compare.mutants", description=trial.__doc__)
    parser.add_argument("directory", type=Path, metavar="DIR", help="results of 'dualball validate --quick'")
    parser.add_argument("--engines", action="store_true", help="also measure with every wrong engine")
    page = "page to write; else a theory is judged until a claim notices it"
    parser.add_argument("--page", type=Path, metavar="FILE", help=page)
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1, metavar="N", help="processes")
    parser.add_argument("--least", type=float, default=1.0, metavar="SHARE", help="to be noticed (default 1: all)")
    args = parser.parse_args()
    try:
        level = trial.judged(args.directory, args.workers, whole=bool(args.page))
        measured = trial.wrong_engines(args.directory, args.workers) if args.engines else []
        if args.page:
            write_text(args.page, trial.page(level, measured))
    except InputError as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    trials = [*level.trials, *measured]
    missed, count = [each.what for each in trials if not each.noticed], len(trials)
    print(f"{count - len(missed)} of {count} faults were noticed")
    for what in missed:
        print(f"nobody noticed: {what}")
    return 0 if count - len(missed) >= args.least * count else 1


if __name__ == "__main__":
    sys.exit(main())
