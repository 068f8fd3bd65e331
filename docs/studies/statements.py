"""Where each statement is checked, docs/records/statements.md: by a claim, on measurements, or by a
test, theory against theory."""

from compare.figures.pages import Rows
from compare.subjects.catalogue import CLAIMS

TESTS = {
    "test_other_ways::test_figure_12_with_a_floor_that_pulls": (
        "Fig. 12",
        "If floor and wall could pull, (12) released, all bifurcations of Table 5 would appear for "
        "η > j as well.",
    ),
    "test_other_ways::test_where_82_and_83_contradict_12": (
        "(82), (83), end of section 4.3",
        "(83) is a bound for η > 1 only, and contradicts (12) there; (82) contradicts (12) unless "
        "η < j.",
    ),
    "test_other_ways::test_rolling_is_unstable_on_all_sides_beyond_omega_03": (
        "(73), section 5.2",
        "For η > j and ω₀ > ω₀₃ RR is unstable to SR from all directions; below, slip at the floor "
        "dies out on either side.",
    ),
    "test_other_ways::test_a_share_is_between_0_and_1_where_slip_dies_out_on_either_side": (
        "after (69)",
        "The share δ is between 0 and 1 exactly where slip at the wall dies out on either side, "
        "(64).",
    ),
    "test_other_ways::test_sensitivities_are_logarithmic_derivatives_of_thresholds": (
        "(84)-(86)",
        "A design's sensitivities are the logarithmic derivatives of thresholds by friction, "
        "inertia, size, gravity.",
    ),
    "test_other_ways::test_a_slow_ramp_passes_the_fold_as_its_normal_form_does": (
        "(88)",
        "A flow that rises slowly at a rate ρ passes the fold by K ρ^(2/3) before the ball lifts "
        "off.",
    ),
    "test_other_ways::test_the_inertia_of_the_fluid_shifts_thresholds": (
        "extension",
        "A fluid with inertia shifts ω₀₁ and ω₀₂ as if mass, inertia and gravity were others; ω₀₃ "
        "stays.",
    ),
    "test_other_ways::test_onsets_of_slip_in_very_slow_and_very_fast_pulsations": (
        "(66), (67), (73)",
        "The amplitude at which a pulsation makes the ball slip tends to a closed form for slow "
        "pulsations, and to another for fast ones.",
    ),
    "test_other_ways::test_two_methods_end_in_the_same_state": (
        "Definitions 1-3",
        "The event-driven simulation and time stepping end in the same state, also where landings "
        "rebound.",
    ),
    "test_other_ways::test_the_least_friction_that_rolls_against_the_torque_of_the_fluid": (
        "extension",
        "A fluid that resists the ball's spin uses up friction; the least with which it still "
        "rolls follows from balances.",
    ),
    "test_other_ways::"
    "test_the_best_design_has_a_wall_as_rough_as_the_inertia_and_the_smallest_ball": (
        "(84), (86)",
        "The flowmeter with the longest range has η = j, whatever the friction of the floor; among "
        "equals a design takes the smallest ball.",
    ),
    "test_stationary::test_dimensions_of_table_4": (
        "Table 4, (22)",
        "The domain of each case has as many dimensions as Table 4 prints.",
    ),
    "test_flowmeter::test_a_mean_is_off_by_the_spin_about_the_tangent": (
        "(20), (4)",
        "Under Stokes' law the mean reading of a periodic motion is off by the mean of ω_c ω_z: "
        "not at all in RR, RS and SR.",
    ),
}
"""Tests of `tests/analytic` that hold a statement which no measurement shows: its source, and what
it says."""


def table() -> Rows:
    """All statements, those of claims in the order of the report."""
    claims = [[each.source, each.statement, f"claim `{each.id}`"] for each in CLAIMS]
    tests = [[*of, f"`analytic/{test}`"] for test, of in TESTS.items()]
    return [["source", "statement", "checked by"], *claims, *tests]
