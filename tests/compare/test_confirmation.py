"""The formulas of the contact settings, confirmed by measurement."""

from __future__ import annotations

from docs.studies import confirmation


def test_formulas_are_what_mujoco_does() -> None:
    rows = confirmation.rows()
    assert len({row.what for row in rows}) == len(rows)
    wrong = [row for row in rows if not row.agrees]
    assert not wrong, wrong


def test_a_formula_that_is_off_is_noticed() -> None:
    assert confirmation.Row("length", "m", predicted=1.0, measured=1.009, tolerance=1e-2).agrees
    assert not confirmation.Row("length", "m", predicted=1.0, measured=1.011, tolerance=1e-2).agrees
