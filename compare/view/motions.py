"""Motions in words, tables and pictures: what a file of one holds, it on its cases, two side by
side.

Each is first described as data, then shown."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from rich.table import Table

from analytic.flowmeter import real_fluid
from compare.figures import drawing, pages
from compare.testing import UNITS, Series, common_times, difference
from compare.view import steady
from model import Case, Flow, InputError, Parameters, Trajectory, kinematics, storage
from model import table as storage_table
from model.kinematics import VARIABLES
from model.trajectory import FLUID

if TYPE_CHECKING:  # it takes a second to load
    from matplotlib.figure import Figure

LISTED, LISTED_OF_TWO = 20, 8
"""Most phases, and most events, that are listed of one motion; most phases of one of two."""
PAIR_COLOURS = "#0072B2", "#D55E00"
SEEN = 1e-5
"""A gap in m below which it isn't drawn."""


def describe(path: Path) -> dict[str, Any]:
    """Parameters, versions, cases over time, events and last state of a stored run, JSON-able.

    Raises `StorageError` for a file that isn't a trajectory or isn't whole."""
    run = storage.load(path)
    header, events, samples = run.header, run.events, len(run.time)
    settled = steady.last_quarter(run)
    return {
        **{name: getattr(header, name) for name in ("engine", "failure", "commit", "created")},
        "complete": run.complete,
        "parameters": dataclasses.asdict(header.parameters),
        "flow": header.flow.to_mapping(),
        "settings": header.settings,
        "versions": header.versions,
        "samples": samples,
        "duration": float(run.time[-1]) if samples else 0.0,
        "cases": [
            {"case": case.name, "from": start, "to": end} for case, start, end in run.phases()
        ],
        "events": [
            {"time": t, "from": Case(a).name, "to": Case(b).name}
            for t, a, b in zip(events.time, events.from_case, events.to_case, strict=True)
        ],
        "last": dict(zip(VARIABLES, run.x[-1], strict=True)) if samples else {},
        "steady": steady.described(settled),
    }


def table(about: dict[str, Any]) -> Table:
    """What `describe` returned as a table of two columns."""

    def listed(items: list[str]) -> str:
        more = [f"… and {len(items) - LISTED} more"] if len(items) > LISTED else []
        return "\n".join(items[:LISTED] + more) or "none"

    def short(value: Any) -> str:
        if isinstance(value, list):
            return f"[{', '.join(map(short, value))}]"
        return f"{value:g}" if isinstance(value, float) else str(value)

    parameters, flow = about["parameters"], Flow.from_mapping(about["flow"])
    units = {
        field.name: pages.readable(field.metadata["unit"]) for field in Parameters.quantities()
    }
    told = (
        f"{flow.kind}, ω₀ from {flow.value[0]:g} to {flow.value[-1]:g} rad/s within "
        f"{flow.start[-1]:g} s"
    )
    if flow.is_steady:
        told = f"steady, ω₀ = {flow.value[0]:g} rad/s"
    elif len(flow.waves):
        waves = ", ".join(
            f"{amplitude:g} rad/s at {frequency:g} Hz" for amplitude, frequency, _ in flow.waves
        )
        told = f"{flow.kind}, ω₀ = {flow.value[0]:g} rad/s with waves of {waves}"
    last = zip(VARIABLES, kinematics.UNITS, strict=True) if about["last"] else ()
    rows = {
        "engine": f"{about['engine']} "
        f"({', '.join(f'{k} {v}' for k, v in about['versions'].items())})",
        "made": f"{about['created']} {about['commit'][:12]}".strip(),
        "parameters": ", ".join(
            f"{name} = {parameters[name]:g} {unit}".strip() for name, unit in units.items()
        ),
        "drag": parameters["drag"],
        "flow": told,
        "settings": ", ".join(f"{k} = {short(v)}" for k, v in about["settings"].items()),
        "samples": f"{about['samples']} over {about['duration']:g} s",
        "cases": listed([f"{p['case']} {p['from']:.6g}…{p['to']:.6g} s" for p in about["cases"]]),
        "events": listed([f"{e['time']:.9g} s  {e['from']} → {e['to']}" for e in about["events"]]),
        "last state": "\n".join(
            f"{n} = {about['last'][n]:.9g} {pages.readable(u)}" for n, u in last
        ),
        "steady value": steady.in_words(flow, about["duration"], about["steady"].get("omega_c")),
    }
    return pages.pairs(rows | ({"failure": about["failure"]} if about["failure"] else {}))


def labelled(run: Trajectory) -> dict[str, Sequence[Any]]:
    """The samples of a run as a table has them: units in their labels, cases by name."""
    units = UNITS | {FLUID["name"]: FLUID["units"]}
    columns = {
        storage_table.label(name, units[name]): values.tolist()
        for name, values in run.table().items()
    }
    return columns | {"case": [Case(code).name for code in run.case]}


def compared(a: Series, b: Series) -> dict[str, Any]:
    """Differences of all quantities that both have, cases, and parameters that differ, JSON-able.

    Raises `InputError` as `difference`, and where they have no quantity in common."""
    both = [name for name in UNITS if name in a.values and name in b.values and name != "case"]
    if not both:
        raise InputError(
            f"{a.name} has {', '.join(a.values)}, {b.name} has {', '.join(b.values)}: nothing to "
            f"compare"
        )
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


def compared_tables(about: dict[str, Any]) -> list[Any]:
    """What `compared` returned, for the terminal."""
    rows = {}
    for letter, each in zip("ab", about["motions"], strict=True):
        made = (
            f"{each['name']}{each['engine'] and ', ' + each['engine']}: {each['samples']} samples"
        )
        rows[letter] = f"{made} from {each['from']:g} to {each['to']:g} s"
        listed = [f"{case} {start:.4g}…{end:.4g} s" for case, start, end in each["cases"]]
        more = f", and {len(listed) - LISTED_OF_TWO} more" if len(listed) > LISTED_OF_TWO else ""
        rows[f"cases of {letter}"] = ", ".join(listed[:LISTED_OF_TWO]) + more
        rows[f"failure of {letter}"] = each["failure"]
    differ = about["parameters that differ"].items()
    rows["made with other parameters"] = ", ".join(
        f"{name} = {a} in a, {b} in b" for name, (a, b) in differ
    )
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
    """A figure of two motions in common quantities, on the first one's cases."""
    from compare.figures import style  # here, because drawing takes a second to load

    names = [name for name in a.values if name in b.values]
    shown = ("omega_c", "slip_x", "slip_y", "slip_z", "y", "h")
    seen = [
        n for n in shown if n in names and (n not in "yh" or max(a[n].max(), b[n].max()) > SEEN)
    ]
    names = seen or names[:1]
    figure, panels = style.panels(9, 1.6 * len(names) + 2.2, len(names) + 1, sharex=True)
    t = common_times(a, b)
    for axes, name in zip(panels, names, strict=False):
        symbol = style.symbol(name)
        for each, colour, line in zip((a, b), PAIR_COLOURS, ("-", "--"), strict=True):
            axes.plot(each.time, each[name], line, color=colour, label=each.name)
        axes.set(ylabel=f"{symbol} ({pages.readable(UNITS[name])})", xlim=t[[0, -1]])
        there = [np.interp(t, each.time, each[name]) for each in (a, b)]
        size = np.abs(there[1]).max() or 1.0
        panels[-1].semilogy(
            t, np.maximum(np.abs(there[0] - there[1]) / size, style.LEAST), lw=1, label=symbol
        )
        if a.run:
            style.ground(axes, a.run, (t[0], t[-1]), named=axes is panels[0])
    style.legend(panels[0])
    style.legend(panels[-1], ncols=6)
    panels[-1].set(xlabel="time (s)", ylabel="|a − b|/max |b|")
    panels[-1].grid(alpha=0.3)
    return figure


def draw(run: Trajectory) -> Figure:
    """A figure of omega_c, slip, gaps and forces over time, on the colours of cases."""
    from compare.figures import style  # here, because drawing takes a second to load

    t, p = run.time, run.header.parameters
    cases = Case.RR, Case.NR, Case.SR, Case.SS, Case.NS
    blue, green, orange, red, pink = (style.COLOURS[case] for case in cases)
    scale, unit = (
        (1e3, "mm") if max(np.abs(run.y).max(), np.abs(run.h).max()) > 1e-5 else (1e6, "µm")
    )
    friction_A = np.hypot(*run.force_A[:, [0, 2]].T)
    friction_B = np.hypot(*run.force_B[:, [1, 2]].T)
    slips = zip("xyz", (red, green, pink), ("-", "--", ":"), strict=True)
    curves = {
        "angular velocity (rad/s)": (
            ("fluid, $ω_0$", run.header.flow(t), "0.6", "--"),
            ("orbit, $ω_c$", run.omega_c, blue, "-"),
        ),
        "slip (rad/s)": tuple(
            (style.symbol(f"slip_{k}"), getattr(run, f"slip_{k}"), *look) for k, *look in slips
        ),
        f"gap ({unit})": (
            ("floor, $y$", scale * run.y, blue, "-"),
            ("wall, $h$", scale * run.h, orange, "--"),
        ),
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
    told = steady.of_run(run)
    figure.suptitle(f"{run.header.engine}: {style.named(p)}\nsteady value: {told}", fontsize=11)
    drawing.warn_of(figure, real_fluid.model_error(p.replace(omega_0=float(run.omega_0[-1]))))
    return figure
