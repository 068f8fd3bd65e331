"""Every protocol bears on a claim, and every claim has its protocols."""

from collections import Counter

from compare.catalogue import CLAIMS, PROTOCOLS
from compare.claim import Text
from compare.kit.levels import ASSIGNMENTS, COUNT, Level, sets
from compare.kit.programme import needed


def test_names_are_unique():
    for names in ([claim.id for claim in CLAIMS], [protocol.name for protocol in PROTOCOLS]):
        assert max(Counter(names).values()) == 1


def test_every_protocol_bears_on_a_claim_and_every_claim_has_its_protocols():
    used = {name for claim in CLAIMS for name in claim.protocols}
    assert used == {protocol.name for protocol in PROTOCOLS}


def test_the_table_of_who_measures_what_lists_every_protocol():
    assert ASSIGNMENTS.keys() == {protocol.name for protocol in PROTOCOLS}
    asked = {name for each in ASSIGNMENTS.values() for name in (*each.quick, *each.limit, *each.as_it_comes)}
    assert asked <= sets(Level.QUICK).keys()


def test_protocols_come_after_what_they_need():
    for k, protocol in enumerate(PROTOCOLS):
        assert set(protocol.needs) <= {earlier.name for earlier in PROTOCOLS[:k]}
        assert needed(PROTOCOLS, [protocol.name])[-1] is protocol


def test_what_is_corrected_or_expected_to_fail_says_why():
    for claim in CLAIMS:
        if claim.text is Text.CORRECTED or claim.expected != "confirmed":
            assert claim.reason, claim.id


def test_sets_are_many_and_different():
    quick, default = sets(Level.QUICK), sets(Level.DEFAULT)
    assert len(quick) >= 6
    assert len(default) == COUNT[Level.DEFAULT] >= 24
    assert {name: default[name] for name in quick} == quick
    for chosen in (quick, default):
        rows = chosen.values()
        assert any(p.mu > p.eta for p in rows)
        assert any(p.mu < p.eta for p in rows)
        assert any(p.eta > p.j for p in rows)
        assert any(p.eta < p.c**2 * p.R / (4 * p.g * p.mu**2) for p in rows)  # below eta_cr (87): no fold
        assert any(p.c**2 * p.R / (4 * p.g * p.mu**2) < p.eta < p.j for p in rows)
        assert len({p.j for p in rows}) > 4
        assert len({p.r / p.R for p in rows}) > 4
