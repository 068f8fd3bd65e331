"""The figures of transients draw what they are given; what they show is checked where it is computed."""

from __future__ import annotations

import pytest

from analytic import scenarios
from compare.figures import transients
from model import Case, Parameters

ROUGH = Parameters.named("high-wall-friction")


@pytest.mark.parametrize(("omega_0", "title"), [(25.0, "rolls again"), (16.0, "slips on")])
def test_slip_perturbation(omega_0, title):
    figure = transients.draw_slip_perturbation(scenarios.slip_perturbation(ROUGH.replace(omega_0=omega_0)))
    assert title in figure.axes[0].get_title(loc="left")


def test_hysteresis_shows_both_ways():
    run = scenarios.hysteresis(Parameters.named("reference"), [10.0, 20.0, 10.0], hold=5.0)
    axes = transients.draw_hysteresis(run).axes[0]
    labels = [text.get_text() for text in axes.get_legend().get_texts()]
    assert any(label.startswith("raising") for label in labels)
    assert any(label.startswith("lowering") for label in labels)


def test_unloading_names_the_cases(tmp_path):
    run = scenarios.unloading(ROUGH, hold=5.0)
    figure = transients.draw_unloading(run)
    assert Case.RR.name in {text.get_text() for text in figure.axes[0].texts}
    figure.savefig(tmp_path / "unloading.png")
