"""``python -m tests.mutants``: try the verdicts, and write the page that says what they notice."""

import argparse
import os
import sys
from pathlib import Path

from docs.studies import mutants
from model import InputError
from tests.mutants import trial


def main() -> int:
    """Return 0 if enough faults were noticed, 1 if not, 2 where there is nothing to judge."""
    parser = argparse.ArgumentParser(prog="python -m tests.mutants", description=trial.__doc__)
    results = (
        "results of 'dualball validate'; a theory is judged on them until a claim notices it, "
        "the quickest first"
    )
    parser.add_argument("directories", type=Path, nargs="+", metavar="DIR", help=results)
    one = (
        "also judge by what this engine alone says, as mujoco-plain, stored in DIR or the first "
        "of all; repeatable"
    )
    add, cores = parser.add_argument, os.cpu_count() or 1
    add("--engines", action="store_true", help="also measure with every wrong engine")
    add("--alone", action="append", default=[], metavar="NAME[=DIR]", help=one)
    whole = "judge by all claims on the first of them: takes longer"
    add("--whole", action="store_true", help=whole)
    add("--page", type=Path, metavar="FILE", help="page to write, and the list beside it")
    add("--workers", type=int, default=cores, metavar="N", help="processes")
    noticed = "to be noticed (default 1: all)"
    add("--least", type=float, default=1.0, metavar="SHARE", help=noticed)
    args = parser.parse_args()
    try:
        first, *others = args.directories
        levels = trial.judged(first, args.workers, args.whole)
        for each in others:
            levels |= trial.judged(each, args.workers)
        engines = trial.wrong_engines(first, args.workers) if args.engines else []
        alone = dict[str, list[trial.Trial]]()
        for name, _, where in (each.partition("=") for each in args.alone):
            alone |= trial.judged(Path(where or first), args.workers, by=name)
        if args.page:
            mutants.write(args.page, levels | alone, engines)
    except InputError as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    trials = [each for own in (*levels.values(), engines) for each in own if each.tried]
    missed, count = [each for each in trials if each.kind != "by_numbers"], len(trials)
    hanging = sum(bool(each.hung) for each in trials)
    print(
        f"{count - len(missed)} of {count} faults were noticed by numbers; with {hanging} of them "
        "the predictions of a claim hang"
    )
    for each in missed:
        print(f"not noticed by numbers: {each.what}: {each.by}")
    return 0 if count - len(missed) >= args.least * count else 1


if __name__ == "__main__":
    sys.exit(main())
