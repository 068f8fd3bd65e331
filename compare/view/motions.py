"""Motions over time: one on its cases, or two side by side, how far apart and what they were made with."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from compare.kit import pages, style
from compare.testing import UNITS, Series, common, difference
from model import InputError, Trajectory

PAIR_COLOURS = "#0072B2", "#D55E00"
SEEN = 1e-5
"""A gap in m below which it isn't drawn."""
LISTED = 8
"""Most stretches in a case that are listed."""


def describe(a: Series, b: Series) -> dict[str, Any]:
    """Differences of all quantities that both have, cases, and parameters that differ, JSON-able.

    Raises `InputError` as `difference`, and where they have no quantity in common.
    """
    both = [name for name in UNITS if name in a.values and name in b.values and name != "case"]
    if not both:
        raise InputError(f"{a.name} has {', '.join(a.values)}, {b.name} has {', '.join(b.values)}: nothing to compare")
    about = [
        {
            "name": each.name,
            "from": float(each.time[0]),
            "to": float(each.time[-1]),
            "samples": len(each.time),
            "engine": each.run.header.engine if each.run else "",
            "failure": each.run.header.failure if each.run else "",
            "cases": [[case.name, *span] for case, *span in each.run.phases()] if each.run else [],
        }
        for each in (a, b)
    ]
    made = [each.run.header for each in (a, b) if each.run]
    differ = {}
    if len(made) == 2:
        of = [dataclasses.asdict(header.parameters) for header in made]
        differ = {name: [each[name] for each in of] for name in of[0] if of[0][name] != of[1][name]}
        if made[0].flow.to_mapping() != made[1].flow.to_mapping() and "omega_0" not in differ:
            differ["flow"] = [header.flow.kind for header in made]
    return {
        "motions": about,
        "parameters that differ": differ,
        "differences": [dataclasses.asdict(difference(a, b, name)) for name in both],
    }


def tables(about: dict[str, Any]) -> list[Any]:
    """What `describe` returned, for the terminal."""
    rows = {}
    for letter, each in zip("ab", about["motions"], strict=True):
        made = f"{each['name']}{each['engine'] and ', ' + each['engine']}: {each['samples']} samples"
        rows[letter] = f"{made} from {each['from']:g} to {each['to']:g} s"
        listed = [f"{case} {start:.4g}…{end:.4g} s" for case, start, end in each["cases"]]
        more = f", and {len(listed) - LISTED} more" if len(listed) > LISTED else ""
        rows[f"cases of {letter}"] = ", ".join(listed[:LISTED]) + more
        rows[f"failure of {letter}"] = each["failure"]
    differ = about["parameters that differ"].items()
    rows["made with other parameters"] = ", ".join(f"{name} = {a} in a, {b} in b" for name, (a, b) in differ)
    table = [["a - b", "unit", "rms", "rms/max |b|", "largest", "at (s)"]]
    for each in about["differences"]:
        part = f"{each['rms'] / each['scale']:.1e}" if each["scale"] else ""
        star = "*" if 0 < each["rms"] <= 2 * each["doubt"] else ""
        row = [f"{each['rms']:.2e}", part, f"{each['largest']:.2e}", f"{each['at']:.4g}"]
        table.append([each["quantity"] + star, pages.readable(UNITS[each["quantity"]]), *row])
    stars = any(row[0].endswith("*") for row in table)
    note = "* half or more of it may come from interpolating between samples" if stars else None
    shown = pages.table("Differences", table, caption=note, padding=(0, 1))
    return [pages.pairs({name: text for name, text in rows.items() if text}), shown]


def draw_both(a: Series, b: Series) -> Figure:
    """Both motions in the quantities that both have, on the cases of the first, and how far they are apart in each."""
    names = [name for name in a.values if name in b.values]
    shown = ("omega_c", "slip_x", "slip_y", "slip_z", "y", "h")
    seen = [n for n in shown if n in names and (n not in "yh" or max(a[n].max(), b[n].max()) > SEEN)]
    names = seen or names[:1]
    figure, panels = style.panels(9, 1.6 * len(names) + 2.2, len(names) + 1, sharex=True)
    t = common(a, b)
    for axes, name in zip(panels, names, strict=False):
        symbol = style.symbol(name)
        for each, colour, line in zip((a, b), PAIR_COLOURS, ("-", "--"), strict=True):
            axes.plot(each.time, each[name], line, color=colour, label=each.name)
        axes.set(ylabel=f"{symbol} ({pages.readable(UNITS[name])})", xlim=t[[0, -1]])
        there = [np.interp(t, each.time, each[name]) for each in (a, b)]
        size = np.abs(there[1]).max() or 1.0
        panels[-1].semilogy(t, np.maximum(np.abs(there[0] - there[1]) / size, style.LEAST), lw=1, label=symbol)
        if a.run:
            style.ground(axes, a.run, (t[0], t[-1]), named=axes is panels[0])
    style.legend(panels[0])
    style.legend(panels[-1], ncols=6)
    panels[-1].set(xlabel="time (s)", ylabel="|a − b|/max |b|")
    panels[-1].grid(alpha=0.3)
    return figure


def draw(run: Trajectory) -> Figure:
    """omega_c, slip, gaps and forces over time; backgrounds in the colour of the case, named above."""
    t, p = run.time, run.header.parameters
    blue, green, orange, red, pink = "#0072B2", "#009E73", "#E69F00", "#D55E00", "#CC79A7"
    scale, unit = (1e3, "mm") if max(np.abs(run.y).max(), np.abs(run.h).max()) > 1e-5 else (1e6, "µm")
    friction_A, friction_B = np.hypot(*run.force_A[:, [0, 2]].T), np.hypot(*run.force_B[:, [1, 2]].T)
    slips = zip("xyz", (red, green, pink), ("-", "--", ":"), strict=True)
    curves = {
        "angular velocity (rad/s)": (
            ("fluid, $ω_0$", run.header.flow(t), "0.6", "--"),
            ("orbit, $ω_c$", run.omega_c, blue, "-"),
        ),
        "slip (rad/s)": tuple((style.symbol(f"slip_{k}"), getattr(run, f"slip_{k}"), *look) for k, *look in slips),
        f"gap ({unit})": (("floor, $y$", scale * run.y, blue, "-"), ("wall, $h$", scale * run.h, orange, "--")),
        "force (N)": (
            (style.symbol("force_Ay"), run.force_A[:, 1], blue, "-"),
            ("friction at A", friction_A, blue, ":"),
            (style.symbol("force_Bx"), run.force_B[:, 0], orange, "-"),
            ("friction at B", friction_B, orange, ":"),
        ),
    }
    figure, panels = style.panels(9, 8.6, 4, sharex=True, height_ratios=[3, 3, 2, 3])
    for axes, (label, lines) in zip(panels, curves.items(), strict=True):
        for name, values, colour, line in lines:
            axes.plot(t, values, color=colour, ls=line, label=name)
        style.ground(axes, run, (t[0], t[-1]), named=axes is panels[0])
        axes.set(ylabel=label, xlim=t[[0, -1]])
        axes.grid(alpha=0.3)
        style.legend(axes, ncols=4)
    panels[-1].set_xlabel("time (s)")
    figure.suptitle(f"{run.header.engine}: {style.named(p)}", fontsize=11)
    return figure
