"""What xarray reads a run with for ``engine="dualball"``, by an entry point of pyproject.toml."""

import os
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
import xarray
from xarray.backends import BackendEntrypoint

from model.errors import InputError
from model.trajectory import COMPONENTS, FLUID, Trajectory, attributes, columns


class RunBackend(BackendEntrypoint):
    """A run, or one of a batch as ``FILE/KEY``, as columns along the time: one row a sample."""

    description = "Runs of dualball, one row a sample"
    open_dataset_parameters = ("filename_or_obj", "drop_variables")

    def open_dataset(
        self, filename_or_obj: Any, *, drop_variables: str | Iterable[str] | None = None
    ) -> xarray.Dataset:
        """A run's file: the columns of `Trajectory.table` along the time, cases by name, no events.

        Raises `StorageError`, in one line, for a file that isn't a run or is damaged."""
        from model import storage  # here, because xarray loads this module whatever it is to open

        if not isinstance(filename_or_obj, str | os.PathLike):
            kind = type(filename_or_obj).__name__
            raise InputError(f"engine='dualball' opens a file by its name, not a {kind}")
        run, about = storage.load(Path(filename_or_obj)), columns(Trajectory)
        metas = {name: about[column] for name, (column, _) in COMPONENTS.items()}
        metas["omega_0"], table = FLUID, run.table().items()
        found = {name: ("time", values, attributes(metas[name])) for name, values in table}
        names = [case.name for case in run.cases]
        found["case"] = "time", np.array(names), {"long_name": about["case"]["long_name"]}
        whole = xarray.Dataset(found, attrs=run.header.attributes())
        return whole.drop_vars(drop_variables or (), errors="ignore")
