"""Figures of one's own: functions draw into axes of matplotlib, new ones if none are given, and
return them.

For example:

    from compare import plot
    from model import Parameters

    axes = plot.characteristic(Parameters.load("mine.toml"))
    axes.figure.savefig("mine.svg")"""

from __future__ import annotations

import textwrap
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from analytic.flowmeter import real_fluid
from compare.figures import pages, style
from compare.figures.drawing import GapError
from compare.figures.validity import model_warning
from compare.report import gallery
from compare.subjects.attractors import figures as attractors
from compare.subjects.attractors.basins import Basins
from compare.subjects.flowmeter import figures as flowmeter
from compare.subjects.thresholds import figures as thresholds
from compare.testing import UNITS
from model import Case, InputError, Parameters, Trajectory
from model.parameters import check_names
from model.trajectory import component

if TYPE_CHECKING:
    import xarray


def characteristic(p: Parameters, axes: Axes | None = None) -> Axes:
    """The stationary solutions of a set, omega_c over omega_0: dashed where unstable.

    Dotted: the thresholds (84) to (88). The title warns of a fluid for which the model doesn't
    hold. Raises `InputError` where a set has none, as without drag."""
    axes, top = _given_or_new(axes), flowmeter.top_flow(p)
    flowmeter.theory(axes, p, top)
    axes.set(xlabel=style.OMEGA_0, ylabel=style.OMEGA_C)
    _warn(axes, p, p.replace(omega_0=top))
    flowmeter.names_within(axes)
    return axes


def regions(p: Parameters, axes: Axes | None = None, *, equal: bool = False) -> Axes:
    """A map of which cases have a stationary solution, over friction and flow.

    As Figs. 7 and 8 of the paper, of this set. The title warns as that of `characteristic`."""
    axes = _given_or_new(axes)
    thresholds.regions(axes, p, equal)
    style.legend(axes, loc="upper right")
    _warn(axes, p)
    return axes


def figure(name: str, p: Parameters) -> Figure:
    """A figure of a set, of the paper or beyond: "fig-9", as `dualball figures` names them.

    Raises `InputError` for an unknown name, and for a figure of which the set has nothing to show.
    """
    known = gallery.of_set(p)
    check_names([name], list(known), "figure")
    try:
        drawn, _ = gallery.FIGURES[name].draw(known[name]())
    except GapError as error:
        raise InputError(f"{name} can't be drawn of this set: {error}") from error
    return drawn


def motion(run: Trajectory | xarray.Dataset, *names: str, axes: Axes | None = None) -> Axes:
    """Quantities of a motion over time, omega_c if none is named, on the colours of its cases.

    `run`: what `simulate` returns, or a file that xarray has opened. A component of a force is
    named as in `Trajectory.to_pandas`, ``force_Ay``. Raises `InputError` for an unknown name, or
    for quantities of different units."""
    if not hasattr(run, "force_A"):
        how = "open it without engine='dualball', which makes a table of it"
        raise InputError(f"the run must be as its file is: {how}")
    names, known = names or ("omega_c",), [n for n in UNITS if n not in ("time", "case")]
    check_names(names, known, "quantity of a motion")
    units = {UNITS[name]: name for name in names}
    if len(units) > 1:
        raise InputError(f"{' and '.join(units.values())} have different units: {', '.join(units)}")
    axes, time, case = _given_or_new(axes), np.asarray(run.time), np.asarray(run.case)
    for name in names:
        axes.plot(time, component(run, name), label=style.symbol(name))
    begins = np.flatnonzero(np.diff(case, prepend=-1))
    for first, last in zip(begins, [*begins[1:], len(case) - 1], strict=True):
        colour = style.COLOURS[Case(case[first])]
        axes.axvspan(time[first], time[last], color=colour, alpha=0.15, lw=0)
    (unit,) = units
    said = ", ".join(dict.fromkeys(str(line.get_label()) for line in axes.get_lines()))
    axes.set(xlabel="time (s)", ylabel=f"{said} ({pages.readable(unit)})", xlim=time[[0, -1]])
    style.legend(axes)
    return axes


def basins(of: Basins | str | Path, axes: Axes | None = None) -> Axes:
    """A map of where balls end, from the file of `dualball basins`, or what it holds.

    Raises `StorageError` for a file that isn't one."""
    axes = _given_or_new(axes)
    attractors.fill_basins(axes, of if isinstance(of, Basins) else Basins.load(of))
    return axes


def _given_or_new(axes: Axes | None) -> Axes:
    """The given axes, or those of a new figure."""
    return axes if axes is not None else style.figure(6.2, 4.4).add_subplot()


def _warn(axes: Axes, *sets: Parameters) -> None:
    """Write above axes what the model leaves out, if it is too much for one of the sets."""
    width = axes.get_window_extent().width / axes.figure.dpi  # inch
    for doubt in model_warning(max(map(real_fluid.model_error, sets))):
        axes.set_title("\n".join(textwrap.wrap(doubt, round(13 * width))), fontsize=9)
