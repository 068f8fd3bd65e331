"""``dualball attractors``, ``basins``: what balls come to, over starts and over parameters."""

import argparse
import itertools
import shlex
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np

import analytic
from analytic.orbits import orbit_branch
from analytic.orbits.attractors import Attractor
from analytic.orbits.periodic import Orbit
from analytic.simulation.ensemble import interval
from compare.campaign.sweep import Axis, grid
from compare.campaign.tasks import carry_out
from compare.commands import options, running
from compare.engines.study import EVENT
from compare.figures import drawing, pages
from compare.method.statistics import plain
from compare.subjects.attractors.basins import ATTRACTORS, basins
from model import InputError, Parameters, State, Trajectory
from model.arrays import Array
from model.files import write_text
from model.kinematics import UNITS, VARIABLES
from model.parameters import Range, check_number

_FOUND = "attractors", "branches"


def run(args: argparse.Namespace) -> int:
    axes, ways = map(Axis.several, (args.vary, args.follow))
    ranges = {way.name: way.ends for way in ways}
    sets = list(grid(options.parameters(args), axes))
    rows = []
    for k, p in enumerate(sets):

        def tell(done: float, k: int = k) -> None:
            args.tell((k + done) / len(sets))

        found = _attractors(args, p, tell)
        orbits = [each.limit.orbit for each in found if each.limit.orbit]
        follow = orbit_branch.follow
        branches = [follow(orbit, name, *ends) for orbit in orbits for name, ends in ranges.items()]
        varied: dict[str, Any] = {axis.name: getattr(p, axis.name) for axis in axes}
        attracting, born = list(map(attractor_data, found)), list(map(branch_data, branches))
        rows.append(varied | {"attractors": attracting, "branches": born})
    options.warn_of_model(sets[0], sets[-1])
    data = plain({"engine": args.engine.name, "seed": args.seed, "sets": rows})
    table = _table(data)
    if args.page:
        title = args.page.stem.capitalize()
        write_text(args.page, _page(title, args.words, options.parameters(args), data, table))
    title, lines = f"What balls come to ({args.engine.name})", []
    for branch in _branches(data):
        name = branch["parameter"]
        values = [orbit[name] for orbit in branch["orbits"]]
        span = f"{len(values)} orbits from {min(values):.6g} to {max(values):.6g}"
        lines.append(f"Followed in {name}, {span}:")
        for at in branch["places"]:
            lines.append(f"  {at['kind']} at {at['value']:.7g} {at['reason']}")
    options.show(data, args.json, pages.table(title, table, caption="\n".join(lines)))
    return 0


def _attractors(
    args: argparse.Namespace, p: Parameters, tell: Callable[[float], None]
) -> list[Attractor]:
    """The attractors of a set of parameters: by theory, or by the runs of another engine."""
    args.engine.check_set(p)

    def simulate(p: Parameters, x0s: Array, duration: float, interval: float) -> list[Trajectory]:
        step = running.settings(args, p).timestep or 0.0
        densely = "to sample these motions densely enough it"
        check_number("timestep", step, "s", Range(high=interval), densely)
        lasting = {"t_end": duration, "sample_interval": interval}
        return [carry_out(running.task(args, p, x0=State.of(x0), **lasting)) for x0 in x0s]

    starts = np.array([running.start(args)]) if args.start else args.random
    usual = args.engine is EVENT and running.settings(args, p) == EVENT.configure({}, p)
    own: dict[str, Any] = {} if usual else {"run": simulate}
    return analytic.attractors(p, starts, seed=args.seed, lasting=args.time, progress=tell, **own)


def _branches(data: dict[str, Any]) -> Iterator[dict[str, Any]]:
    return itertools.chain.from_iterable(each["branches"] for each in data["sets"])


def attractor_data(of: Attractor) -> dict[str, Any]:
    """An attractor as JSON-able data, SI."""
    limit, run, orbit = of.limit, of.run, of.limit.orbit
    states = {
        "mean": orbit.mean if orbit else run.x.mean(axis=0),
        "low": run.x.min(axis=0),
        "high": run.x.max(axis=0),
    }
    # Those of a period, or those of the last window in the order in which they first come up.
    cases = orbit.cases if orbit else dict.fromkeys(limit.last.cases)
    return {
        "kind": limit.kind.value,
        "cases": list(cases),
        "count": of.count,
        "starts": of.starts,
        "share": of.share,
        "share_95": of.interval,
        "period": orbit.period if orbit else limit.period,
        "period_in_the_run": limit.period,
        "multipliers": orbit.multipliers if orbit else [],
        "lyapunov": limit.exponent,
        "theory": limit.solution.case if limit.solution else "orbit" if orbit else None,
        **{name: dict(zip(VARIABLES, x, strict=True)) for name, x in states.items()},
        "failure": limit.failure,
    }


def branch_data(branch: orbit_branch.OrbitBranch) -> dict[str, Any]:
    """A branch of orbits as JSON-able data, SI; each bifurcation with an orbit."""

    def orbit_data(orbit: Orbit) -> dict[str, Any]:
        return {
            branch.name: getattr(orbit.p, branch.name),
            "period": orbit.period,
            "omega_c": orbit.mean[VARIABLES.index("omega_c")],
            "height": orbit.cycle.y.max(),
            "stable": orbit.stable,
            "multipliers": orbit.multipliers,
            "x": orbit.loop.x,
        }

    places = [
        vars(place) | {"kind": place.kind.value, "orbit": orbit_data(place.orbit)}
        for place in branch.places
    ]
    return {
        "parameter": branch.name,
        "places": places,
        "orbits": list(map(orbit_data, branch.orbits)),
    }


def _table(data: dict[str, Any]) -> pages.Rows:
    rows: list[dict[str, str]] = []
    for each in data["sets"]:
        varied = {name: f"{each[name]:.6g}" for name in each if name not in _FOUND}
        for row in each["attractors"]:
            low, high = row["share_95"]
            mean, least, most = (row[name]["omega_c"] for name in ("mean", "low", "high"))
            exponent = "none" if row["lyapunov"] is None else f"exponent {row['lyapunov']:.2g}/s"
            cells = {
                "motion": row["kind"],
                "cases": " ".join(row["cases"]),
                "starts (95 %)": f"{row['count']}/{row['starts']} ({low:.2f}–{high:.2f})",
                "period (s)": f"{row['period']:.6g}" if row["period"] else "-",
                "ω_c (rad/s)": f"{mean:.6g} ({least:.5g}–{most:.5g})",
                "y max (mm)": f"{1e3 * row['high']['y']:.4g}",
                "|multiplier|": f"{_largest(row):.4g}" if row["multipliers"] else "-",
                "theory": row["theory"] or row["failure"] or exponent,
            }
            rows.append(varied | cells)
    return pages.by_heading(rows)


def _page(
    title: str, words: Sequence[str], p: Parameters, data: dict[str, Any], table: pages.Rows
) -> str:
    symbols = {f.name: f.metadata["symbol"] for f in p.quantities()}
    units = {f.name: pages.readable(f.metadata["unit"]) for f in p.quantities()}
    values = {symbols[name]: f"{getattr(p, name):.5g} {unit}" for name, unit in units.items()}
    given = ", ".join(f"{symbol} = {value}".rstrip() for symbol, value in values.items())
    lines = [f"# {title}: what balls come to", ""]
    lines += [f"Parameters, unless a table says otherwise: {given}; drag: {p.drag}. Written by", ""]
    lines += ["```sh", shlex.join(words), "```", "", pages.markdown(table)]
    for branch in _branches(data):
        name = branch["parameter"]
        symbol = symbols[name]
        lines += ["", f"## Followed in {symbol}", ""]
        for at in branch["places"]:
            lines.append(f"* {at['kind']} at {symbol} = {at['value']:.6g} {at['reason']}".rstrip())
        head = "period (s)", "mean ω_c (rad/s)", "height (mm)", "largest |multiplier|", "stable"
        rows = [[symbol, *head]]
        for orbit in branch["orbits"]:
            size, stable = 1e3 * orbit["height"], "yes" if orbit["stable"] else "no"
            numbers = orbit[name], orbit["period"], orbit["omega_c"], size, _largest(orbit)
            rows.append([*(f"{number:.7g}" for number in numbers), stable])
        lines += ["", pages.markdown(rows)]
    return "\n".join(lines) + "\n"


def _largest(row: dict[str, Any]) -> float:
    """The largest modulus of the multipliers; nan if there are none."""
    return max((abs(complex(*each)) for each in row["multipliers"]), default=float("nan"))


def run_basins(args: argparse.Namespace) -> int:
    p, start = options.parameters(args), running.start(args)
    units = dict(zip(VARIABLES, UNITS, strict=True))
    across, up = (Axis.parse(text, units, "state variable") for text in (args.across, args.up))
    for name in (across.name, up.name):
        if any(item.partition("=")[0] == name for item in args.start):
            raise InputError(f"--start {name} has no effect: {name} spans the plane")
    with running.campaign(args, "basins") as campaign:
        mapped = basins(campaign, p, start._asdict(), (across, up), args.mujoco, args.timestep)
    options.warn_of_model(p)
    if args.map and args.map.suffix.lower() in drawing.SUFFIXES:
        # here, because drawing takes a second to load
        from compare.subjects.attractors import figures

        drawing.save(figures.draw_basins(mapped), args.map)
    elif args.map:
        mapped.save(args.map)
    shares = {name: mapped.share(name) for name in ATTRACTORS if mapped.share(name)[0]}
    differ = mapped.differences().tolist() if args.mujoco else []
    said = []
    for name, (hits, of) in shares.items():
        share, low, high = (100 * each for each in (hits / of, *interval(hits, of)))
        said.append(f"{name:>14}: {share:5.1f} % of {of} starts ({low:.1f} to {high:.1f} %)")
    if args.mujoco:
        said.append(
            f"MuJoCo differs at {len(differ)} of {mapped.mujoco.size} starts, so many cells from "
            f"a boundary: {differ}; {mapped.undecided} more came to nothing"
        )
    data = {"shares": shares, "mujoco": mapped.mujoco.size}
    data |= {"differences": differ, "undecided": mapped.undecided}
    options.show(data, args.json, *said)
    return 0
