"""The set of exact cases, and the same as files for engines that don't speak Python."""

from __future__ import annotations

import functools
import json
from pathlib import Path

import numpy as np

from compare.bench import one_contact, two_contacts
from compare.bench.case import TOLERANCE, VERSION, Case
from model.files import WholeFile, make_directory, write_text
from model.trajectory import current_versions

README = Path(__file__).with_name("templates") / "cases.md"


@functools.cache
def cases() -> tuple[Case, ...]:
    """All of them: those with one contact first."""
    return (*one_contact.cases(), *two_contacts.cases())


def write(directory: Path) -> None:
    """JSON and MJCF of each case, one HDF5 file of all, and the scoring rule; raises `StorageError`."""
    make_directory(directory)
    count = [len(case.surfaces) for case in cases()]
    said = {"version": VERSION, "tolerance": TOLERANCE, "dualball": current_versions()["dualball"]}
    said |= {"count": len(count), "one": count.count(1), "two": count.count(2)}
    write_text(directory / "README.md", README.read_text("utf-8").format(**said))
    with WholeFile(directory / "cases.h5") as whole:
        file = whole.file
        file.attrs.update({"schema": "dualball-cases", "version": VERSION, "tolerance": TOLERANCE})
        for case in cases():
            data = case.to_mapping()
            write_text(directory / f"{case.name}.json", json.dumps(data, indent=1))
            write_text(directory / f"{case.name}.xml", case.mjcf())
            group = file.create_group(case.name)
            group.attrs["about"], group.attrs["case"] = case.about, json.dumps(data | {"times": [], "exact": []})
            group["time"], group["exact"] = case.times, case.exact
            group["contacts"] = np.array(case.contacts, dtype="S")
            group["time"].attrs["units"] = "s"
            group["exact"].attrs["columns"] = "position (m), velocity (m s-1), spin (rad s-1)"
        whole.finish()
