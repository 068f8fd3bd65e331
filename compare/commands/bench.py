"""Contacts and engines: ``forecast`` of any MuJoCo model, ``league``, the exact ``cases``."""

from __future__ import annotations

import argparse
import dataclasses
import itertools
import json
import re
import sys
from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from compare.commands import options
from compare.figures import pages
from model import InputError
from model.files import check_ours, make_directory, write_text
from model.parameters import check_names

if TYPE_CHECKING:
    from compare.bench.case import ContactCase

LOOK: Any = {"no_wrap": True, "padding": (0, 1, 0, 0), "pad_edge": False}
LEAGUE_JSON, LEAGUE_PAGE = "league.json", "league.html"


def run_league(args: argparse.Namespace) -> int:
    # here and below, because a list of the cases waits for no engine
    from compare.bench import league, runner
    from compare.campaign import progress
    from compare.figures.pictures import embedded, svg

    chosen = {name: league.ENTRIES.get(name, name) for name in args.engine or league.ENTRIES}
    dotted = re.compile(r"\w[.:]\w")
    modules = {name for name in chosen if dotted.search(name) or Path(f"{name}.py").exists()}
    check_names(chosen.keys() - modules, list(league.ENTRIES), "engine")
    for name in args.engine or ():
        runner.check(chosen[name])
    make_directory(args.output)
    check_ours(args.output / LEAGUE_PAGE, beside=args.output / LEAGUE_JSON)
    with progress.reporter(args.quiet, timed=True) as show:
        found = league.measure(chosen, league.QUICK if args.quick else None, args.workers, show)
    if all(result.skipped for results in found.values() for result in results):
        why = "; ".join(results[0].skipped for results in found.values())
        raise InputError(f"there is nothing to compare: {why}")
    data = league.to_mapping(found)
    write_text(args.output / LEAGUE_JSON, json.dumps(data, indent=1))
    summary, rows, caption = league.summary(found), league.rows(found), league.caption(found)
    notes, columns = list(league.notes(found)), enumerate(league.ranked(found).values(), 1)
    failed = {(r.case, k) for k, own in columns for r in own if not (r.skipped or r.passed)}
    pictures, letters = embedded({"": svg(league.draw(found))})
    page = pages.render(
        "compare.bench",
        "league.html",
        summary=summary,
        rows=rows,
        failed=failed,
        about=league.declarations(found),
        notes=notes,
        caption=caption,
        least=f"{league.LEAST:g}",
        picture=pictures[""],
        letters=letters,
    )
    write_text(args.output / LEAGUE_PAGE, page)
    for name, those, why in notes:
        if not those:
            print(f"dualball: {name} is left out: {why}", file=sys.stderr)
    head = [name.replace("-", "- ") for name in rows[0]]  # which may be broken there
    tables = {"League": summary, "Errors by case": [head, *rows[1:]]}
    drawn = (pages.table(title, own, no_wrap=True, padding=0) for title, own in tables.items())
    options.show(data, args.json, *drawn, caption)
    if not args.json:
        print(f"page: {args.output / LEAGUE_PAGE}")
    return 0


def run_forecast(args: argparse.Namespace) -> int:
    """Settle the model, print the forecast, and check the limits."""
    import mujoco
    from rich.text import Text

    from compare.bench import forecast, forecast_page, settled
    from compare.campaign import progress

    creep = args.max_creep or forecast.Tolerances.creep
    tolerances = forecast.Tolerances(creep, args.max_depth)
    ends = (0, 1 / 2, 5 / 6, 1) if args.tries else (0, 1 / 2, 1, 1)  # shares of time, about
    settling, advising, trying = (
        progress.part(args.tell, *both) for both in itertools.pairwise(ends)
    )
    heard = mujoco.get_mju_user_warning()
    # it would write a log here; what it warns of is in the table
    mujoco.set_mju_user_warning(lambda _: None)
    try:
        model, data = settled.load(args.file, args.keyframe)
        settled.set_controls(model, data, args.ctrl)
        rest = settled.settle(model, data, args.settle, tell=settling)
        found = forecast.forecast(model, data, rest, tolerances, tell=advising)
        after = held = None
        if args.tries:
            found, after, held = forecast.follow_advice(
                model, data, found, args.settle, tolerances, trying
            )
    except settled.UnsettledError as error:
        print(f"dualball: {args.file}: {error}", file=sys.stderr)
        return 1
    finally:
        mujoco.set_mju_user_warning(heard)
    if args.output:
        write_text(args.output, forecast_page.html(found, after, held, args.file.name))
    shown: list[Any] = [Text(f"• {line}") for line in forecast_page.sentences(found)]
    shown += [
        Text(f"\n{what}:\n{text}") for what, text in forecast_page.snippets(found, args.file.name)
    ]
    tables = forecast_page.tables(found, after, held)
    shown += [Text(""), *(pages.table(title, rows, **LOOK) for title, rows in tables)]
    shown += [Text(text, "dim") for text in forecast_page.LEGEND]
    options.show({"before": found, "after": after, "held": held}, args.json, *shown)
    said = [f"{args.file}: {found.unsettled}"] if found.unsettled else []
    limits = ("creep", "m/s", args.max_creep), ("depth", "m", args.max_depth)
    for pair, (name, unit, limit) in itertools.product(found.pairs, limits):
        value = getattr(pair, f"{name}_measured")
        if limit and value > limit:
            said.append(f"{pair.name}: {name} {value:.3g} {unit}, more than {limit:g}")
    for line in said:
        print(f"dualball: {line}", file=sys.stderr)
    return int(bool(said))


def run_cases(args: argparse.Namespace) -> int:
    # as a file has them, since the cases are simulated
    if not (args.name or args.json or args.output):
        known = json.loads(
            (resources.files("compare.bench") / "templates" / "cases.json").read_text("utf-8")
        )
        options.show(None, False, _table(known["version"], known["cases"]))
        return 0
    if args.name and args.output:
        raise InputError(f"-o writes all cases: {args.name!r} has no effect beside it")
    from compare.bench import exact
    from compare.bench.case import VERSION

    own = {case.name: case for case in exact.cases()}
    check_names([args.name] if args.name else [], list(own), "case")
    if args.output:
        exact.write(args.output)
    chosen = own[args.name] if args.name else None
    if args.json:
        all_of_them = {"version": VERSION, "cases": [case.to_mapping() for case in own.values()]}
        options.show(chosen.to_mapping() if chosen else all_of_them, True)
        return 0
    shown = pages.pairs(_told_of(chosen)) if chosen else _table(VERSION, exact.listing())
    options.show(None, False, shown, *([f"written to {args.output}"] if args.output else []))
    return 0


def _told_of(case: ContactCase) -> dict[str, str]:
    """All that there is to say of an exact case, by headings."""
    place, velocity, spin = (_numbers(part) for part in np.split(case.exact[-1, :9], 3))
    weight = f"m g = {case.body.mass * case.g:.6g} N down"
    pulled = f"pull {_numbers(case.pull)} N, growth {_numbers(case.growth)} N/s"
    around = f"drag {case.drag:g} 1/s, flow {case.flow:g} rad/s, spring {case.spring:g} N/m"
    joint = f"along {_numbers(case.joint)}, dry friction {case.dry:g} N" if case.joint else ""
    under = f"{_fields(case.under)}, between them {case.between:g}" if case.under else ""
    units = "of position (m), velocity (m/s), spin (rad/s); inf: not compared"
    told = {
        "case": case.name,
        "about": case.about,
        "body": _fields(case.body),
        "under it": under,
        "surfaces": "\n".join(map(_fields, case.surfaces)),
        "joint": joint,
        "force": f"{weight}, {pulled}, {around}",
        "scales": f"{_numbers(case.scales)} {units}",
        "source": f"{case.source}; error below {case.bound:g}",
        "notices": "; ".join(f"{why}: {case.error(x):.2g}" for why, x in case.wrong.items()),
        "ends at": f"t = {case.times[-1]:g} s: position {place} m, velocity {velocity} m/s, "
        f"spin {spin} rad/s",
        "more": "all states, JSON, HDF5 and MJCF: dualball cases -o DIR",
    }
    return {heading: text for heading, text in told.items() if text}


def _table(version: int, rows: list[list[str]]) -> Any:
    head = ["case", "contacts", "kind", "what happens"]
    return pages.table(f"Exact contact cases, version {version}", [head, *rows], justify="left")


def _fields(item: Any) -> str:
    """The fields of a dataclass in a line, SI units."""
    values = ((field.name, getattr(item, field.name)) for field in dataclasses.fields(item))
    shown = ((name, v if isinstance(v, str) else _numbers(v)) for name, v in values if v)
    return ", ".join(f"{name} {value}" for name, value in shown)


def _numbers(values: Any) -> str:
    """A number, or several in brackets."""
    several = ", ".join(f"{value + 0.0:.6g}" for value in np.atleast_1d(values))
    return f"({several})" if np.ndim(values) else several
