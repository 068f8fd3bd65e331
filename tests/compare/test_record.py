"""Measurements come back from their files as they were, and a file that was touched is refused by name."""

import dataclasses

import h5py
import numpy as np
import pytest
import xarray

from compare.kit import record
from compare.kit.record import Missing, Records
from model import InputError, Parameters, StorageError
from model.hdf5 import seal
from tests.measured import measured

P = Parameters.named("reference")
BLUNT = P.replace(drag="quadratic", nu_f=1e-6, C_D=0.5, density_ratio=0.125)


def measurement(quantity="omega_c", value=11.9, **conditions):
    made = measured("settled", quantity, value, 1e-9, **conditions)
    return dataclasses.replace(made, runs=("runs/a.h5", "runs/b.h5"))


RECORDS = Records(
    (
        measurement(case="RR", start="rest"),
        measurement("force_Ay", 0.1, case="SS", y=0.25),
        measurement("case", 4),
        measurement("slip_x", np.float64(0.1), mode=1),
    ),
    (Missing("settled", "reference", "it never settles"),),
)


@pytest.fixture
def path(tmp_path):
    """A file of those."""
    record.save(RECORDS, tmp_path / "settled.h5", {})
    return tmp_path / "settled.h5"


def test_a_file_gives_back_what_was_saved(tmp_path):
    other = dataclasses.replace(RECORDS.measurements[0], parameters=BLUNT)
    for rows in ((*RECORDS.measurements, other), ()):
        records = Records(rows, RECORDS.missing)
        record.save(records, tmp_path / "settled.h5", {"level": "QUICK"})
        assert record.load(tmp_path / "settled.h5") == records


def test_files_without_the_law_of_drag_are_stokes(path):
    with h5py.File(path, "r+") as older:
        for name in ("drag", "nu_f", "C_D", "density_ratio"):
            del older[name]
    with path.open("r+b") as content:
        seal(content)
    assert record.load(path) == RECORDS


def test_xarray_reads_it_as_a_table(path):
    with xarray.open_dataset(path, engine="h5netcdf") as data:
        table = data.to_dataframe()
    assert list(table.quantity) == ["omega_c", "force_Ay", "case", "slip_x"]
    assert table.unit[1] == "N"
    assert list(table.omega_0) == [P.omega_0] * 4
    assert np.isnan(table.at_y[0])


def test_a_missing_file_is_named_and_an_unknown_quantity_refused(tmp_path):
    with pytest.raises(StorageError, match="no such file"):
        record.load(tmp_path / "nothing.h5")
    with pytest.raises(InputError, match="omega_c"):
        measurement("omega_d")
