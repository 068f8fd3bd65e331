"""The theory figures of the paper: they draw, carry both scales, and put their special points on the curves."""

from __future__ import annotations

import io

import numpy as np
import pytest

from analytic import thresholds
from compare.figures import style
from compare.figures.paper import FIGURES
from model import Case, Parameters

WITH_SCALES = [name for name in FIGURES if name not in ("fig03", "fig06")]


@pytest.mark.parametrize("name", FIGURES)
def test_figure_draws(name: str) -> None:
    buffer = io.BytesIO()
    FIGURES[name]().savefig(buffer, format="png", dpi=40)
    assert buffer.tell() > 1000


@pytest.mark.parametrize("name", WITH_SCALES)
def test_both_scales(name: str) -> None:
    """SI on the axes, dimensionless on secondary ones, labelled."""
    for axes in FIGURES[name]().axes:
        assert "rad/s" in axes.get_ylabel()
        labels = [child.get_xlabel() + child.get_ylabel() for child in axes.child_axes]
        assert any("sqrt{R/g}" in label for label in labels)


@pytest.mark.parametrize("name", ["fig09", "fig10", "fig11", "fig12"])
def test_special_points_lie_on_curves(name: str) -> None:
    """Every black dot is the end of a curve, or on one, within a thousandth of the frame."""
    (axes,) = FIGURES[name]().axes
    lines = [line for line in axes.lines if line.get_label() and not str(line.get_label()).startswith("_")]
    dots = [line for line in axes.lines if line.get_marker() == "o"]
    assert dots
    frame = np.array([np.ptp(axes.get_xlim()), np.ptp(axes.get_ylim())])
    for dot in dots:
        point = np.array([float(np.ravel(v)[0]) for v in (dot.get_xdata(), dot.get_ydata())]) / frame
        nearest = np.inf
        for line in lines:
            xy = np.stack([np.asarray(line.get_xdata(), float), np.asarray(line.get_ydata(), float)], axis=-1) / frame
            xy = xy[np.isfinite(xy).all(axis=1)]
            begin, step = xy[:-1], np.diff(xy, axis=0)
            along = np.clip(np.sum((point - begin) * step, 1) / np.maximum(np.sum(step**2, 1), 1e-300), 0, 1)
            nearest = min(
                nearest, np.min(np.linalg.norm(begin + along[:, None] * step - point, axis=1), initial=np.inf)
            )
        assert nearest < 1e-3


def test_stable_and_unstable_parts_of_figure_10() -> None:
    """The stable part of SS runs from omega_01 to omega_04, the unstable one from omega_02 to omega_04."""
    (axes,) = FIGURES["fig10"]().axes
    t = thresholds(Parameters.named("reference"))
    for label, begin in (("SS", t.omega_01), ("SS, unstable", t.omega_02)):
        (line,) = (line for line in axes.lines if line.get_label() == label)
        shown = np.isfinite(np.asarray(line.get_ydata(), float))
        omega_0 = np.asarray(line.get_xdata(), float)[shown]
        np.testing.assert_allclose([omega_0.min(), omega_0.max()], [begin, t.omega_04], rtol=1e-4)


def test_every_case_has_its_look() -> None:
    assert set(style.COLOURS) == set(style.MARKERS) == set(Case)
    assert len(set(style.COLOURS.values())) == len(set(style.MARKERS.values())) == len(Case)
