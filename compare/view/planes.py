"""A map of basins as a figure."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from compare.kit import style
from compare.subjects.attractors.basins import FATES, Basins
from model import Case

_COLOURS = (style.HOPPING, *(style.COLOURS[case] for case in (Case.RR, Case.SS, Case.NR, Case.NN)))
"""Of `FATES`."""
_VARIABLES = {
    "omega_c": style.OMEGA_C,
    **{f"slip_{axis}": f"$\\tilde\\omega_{axis}$ (rad/s)" for axis in "xyz"},
    **{"y": "y (m)", "v_y": "$v_y$ (m/s)", "h": "h (m)", "v_h": "$v_h$ (m/s)"},
}


def draw(basins: Basins) -> Figure:
    """The map as a figure."""
    figure = style.figure(6.2, 4.4)
    fill(figure.add_subplot(), basins)
    return figure


def fill(axes: Axes, basins: Basins) -> None:
    """The map by time stepping, and a point for each run of MuJoCo."""
    look: dict[str, Any] = {"cmap": ListedColormap(_COLOURS), "vmin": -0.5, "vmax": len(FATES) - 0.5, "alpha": 0.55}
    axes.pcolormesh(basins.x, basins.y, basins.fates, shading="nearest", rasterized=True, **look)
    present = set(np.unique(basins.fates)) | set(np.unique(basins.mujoco))
    handles: list[object] = [Patch(color=_COLOURS[k], alpha=0.55, label=FATES[k]) for k in sorted(present)]
    if basins.coarse:
        x, y = np.meshgrid(basins.x[:: basins.coarse], basins.y[:: basins.coarse])
        for k in sorted(set(basins.mujoco.ravel().tolist())):
            own = basins.mujoco == k
            axes.plot(x[own], y[own], "o", ms=4, color=_COLOURS[k], mec="k", mew=0.4)
        differ = basins.mujoco != basins.fates[:: basins.coarse, :: basins.coarse]
        if np.any(differ):
            handles += axes.plot(x[differ], y[differ], "kx", ms=9, mew=1.3, label="MuJoCo differs")
        handles += axes.plot([], [], "o", ms=4, color="white", mec="k", mew=0.6, label="MuJoCo")
    axes.set(xlabel=f"{_VARIABLES[basins.across]} at the start", ylabel=f"{_VARIABLES[basins.up]} at the start")
    axes.legend(
        handles=handles, fontsize=8, loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=len(handles), frameon=False
    )
