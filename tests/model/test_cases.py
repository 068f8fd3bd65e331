"""Tables 3 and 4 as the paper prints them."""

import pytest

from model import Case, Contact
from model.cases import TRAITS

# Table 4 (with y and v_y as free variables where A is open), and the dimensions of Fig. 2.
TABLE_4 = {
    Case.RR: {"omega_c"},
    Case.RS: {"omega_c", "slip_y"},  # the printed table swaps the slip of RS and SR
    Case.SR: {"omega_c", "slip_x"},
    Case.SS: {"omega_c", "slip_x", "slip_y", "slip_z"},
    Case.NR: {"y", "v_y", "omega_c", "slip_x"},
    Case.NS: {"y", "v_y", "omega_c", "slip_x", "slip_y", "slip_z"},
}


@pytest.mark.parametrize("case", TABLE_4)
def test_active_variables(case: Case) -> None:
    assert set(TRAITS[case].active) == TABLE_4[case]


@pytest.mark.parametrize("case", list(Case))
def test_constraints_and_active_variables_fill_the_state_space(case: Case) -> None:
    assert len(TRAITS[case].constraints) + TRAITS[case].dimension == 8


def test_a_case_is_its_two_contacts() -> None:
    assert len(Case) == 9
    for case in Case:
        assert Case.of(case.A, case.B) is case
    assert Case.NS.A is Contact.N
    assert Case.NS.B is Contact.S
