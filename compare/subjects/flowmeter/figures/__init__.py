"""Fig. 13, and the fall at unloading; `meter` draws designed meters for their own pages."""

from __future__ import annotations

from compare.kit.drawing import Drawing
from compare.subjects.flowmeter.figures import characteristic, unloading

FIGURES = {
    "characteristic": Drawing(
        "Characteristic curves", characteristic.select, characteristic.draw, characteristic.caption
    ),
    "fig-13-left": characteristic.figure_13("fig-13-left", "Fig. 13, left: hysteresis, η < j"),
    "fig-13-right": characteristic.figure_13("fig-13-right", "Fig. 13, right: η > j"),
    "unloading": Drawing(
        "Section 5.3: the fall at unloading", unloading.select, unloading.draw, unloading.caption, ("fig-13-right",)
    ),
}
