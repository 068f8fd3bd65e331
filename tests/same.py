"""Do two results directories hold the same measurements, to the bit? ``python -m tests.same A B
[PROTOCOL ...]``

A pure refactoring of what measures must leave them so, each quantity in its order. Which runs a
number came from, and what its uncertainty is made up of, is not compared."""

import json
import sys
from pathlib import Path

import h5py

from compare.method import record
from compare.method.record import Missing, Records
from model import InputError


def protocols(directory: Path) -> dict[str, Records]:
    """The measurements of each protocol in a results directory, by each engine with each step."""
    found = {}
    for path in sorted(directory.glob("measurements/*/*.h5")):
        with h5py.File(path) as file:
            about = json.loads(file.attrs["about"])
        by = about["by"]
        try:
            own = record.load(path)
        except InputError as error:  # as of a quantity that is measured no more
            own = Records(missing=(Missing(path.stem, "all sets", str(error)),))
        found[f"{path.stem} by {by}, step/{about['step']}"] = own
    return found


def differences(one: Records, other: Records) -> list[str]:
    """What differs between the records of a protocol, a line each; floats are compared to the
    bit."""
    found = [] if one.missing == other.missing else ["what is missing, or why"]
    if len(one.measurements) != len(other.measurements):
        return [*found, f"{len(one.measurements)} and {len(other.measurements)} measurements"]
    pairs = (sorted(each.measurements, key=lambda m: m.quantity) for each in (one, other))
    for a, b in zip(*pairs, strict=True):
        names = [
            name
            for name in vars(a)
            if name not in ("runs", "budget") and getattr(a, name) != getattr(b, name)
        ]
        if names:
            found.append(
                f"{a.quantity} of {a.set} at {a.parameters.omega_0:g} rad/s: {', '.join(names)}"
            )
    return found


def main(first: str, second: str, *names: str) -> int:
    """Print what differs; 1 if anything does."""
    one, other = protocols(Path(first)), protocols(Path(second))
    worst = 0
    for name in sorted(one.keys() | other.keys()):
        if names and name.partition(" by ")[0] not in names:
            continue
        found = (
            differences(one[name], other[name])
            if name in one and name in other
            else ["in one of them only"]
        )
        print(f"{name}: {f'{len(found)} differences, such as {found[0]}' if found else 'the same'}")
        worst = max(worst, bool(found))
    return worst


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
