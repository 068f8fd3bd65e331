"""Every protocol bears on a claim, and every claim has its protocols; what is said of them is whole."""

from compare.catalogue import CLAIMS, PROTOCOLS
from compare.claim import Text
from compare.kit.levels import ASSIGNMENTS, Level, sets

NAMES = {protocol.name for protocol in PROTOCOLS}


def test_names_are_unique():
    assert len(NAMES) == len(PROTOCOLS)
    assert len({claim.id for claim in CLAIMS}) == len(CLAIMS)


def test_every_protocol_bears_on_a_claim_and_every_claim_has_its_protocols():
    assert {name for claim in CLAIMS for name in claim.protocols} == NAMES


def test_the_table_of_who_measures_what_lists_every_protocol():
    assert ASSIGNMENTS.keys() == NAMES
    asked = {name for each in ASSIGNMENTS.values() for name in (*each.quick, *each.limit, *each.as_it_comes)}
    assert asked <= sets(Level.QUICK).keys()


def test_what_is_corrected_or_expected_to_fail_says_why():
    said = [claim for claim in CLAIMS if claim.text is Text.CORRECTED or claim.expected != "confirmed"]
    assert all(claim.reason for claim in said)
