"""Measurements come back from their files as they were; other programs read them as a table."""

import dataclasses

import numpy as np
import pytest
import xarray

from compare.kit import record
from compare.kit.record import Missing, Records
from model import InputError, Parameters, StorageError
from tests.measured import measured

P = Parameters.named("reference")
BLUNT = P.replace(drag="quadratic", nu_f=1e-6, C_D=0.5, density_ratio=0.125)
MEASURED = (
    dataclasses.replace(measured("settled", "omega_c", 11.9, 1e-9, case="RR"), runs=("runs/a.h5", "runs/b.h5")),
    measured("settled", "force_Ay", 0.1, case="SS", y=0.25),
    measured("settled", "case", 4),
    measured("settled", "slip_x", np.float64(0.1), 1e-9, BLUNT, mode=1),
)


@pytest.mark.parametrize("rows", [MEASURED, ()])
def test_a_file_gives_back_what_was_saved(rows, tmp_path):
    path, records = tmp_path / "settled.h5", Records(rows, (Missing("settled", "reference", "it never settles"),))
    record.save(records, path, {"level": "QUICK"})
    assert record.load(path) == records
    with xarray.open_dataset(path, engine="h5netcdf") as data:
        table = data.to_dataframe()
    assert list(table.quantity) == [m.quantity for m in rows]
    assert list(table.omega_0) == [P.omega_0] * len(rows)
    assert [table.unit[1], np.isnan(table.at_y[0])] == ["N", True] if rows else table.empty


def test_a_missing_file_is_named_and_an_unknown_quantity_refused(tmp_path):
    with pytest.raises(StorageError, match="no such file"):
        record.load(tmp_path / "nothing.h5")
    with pytest.raises(InputError, match="omega_c"):
        measured("settled", "omega_d", 1.0)
