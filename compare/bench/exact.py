"""The set of exact cases: those of a body in two surfaces, all, and all as files for engines that don't speak Python.

Two contacts have bodies in a straight groove, in closed form, and the study's ball on floor and wall. The ball's motion
is that of `analytic.simulate`, event-driven, at its sharpest; its wrong answers are the motions of other parameters.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np

import analytic
from compare.adapters.scene import Surface
from compare.adapters.vessel import scene_fields
from compare.bench import mechanisms, one_contact
from compare.bench.case import TOLERANCE, VERSION, Case
from compare.bench.one_contact import SPEED_ALONE, G, along, closed_form, slope, sphere
from model import Parameters, State, Trajectory
from model.arrays import Array
from model.files import check_ours, make_directory, write_text
from model.hdf5 import WholeFile
from model.kinematics import to_world
from model.versions import current_versions

SLOW = Parameters.named("reference").replace(omega_0=12.0)
ROUGH = Parameters.named("high-wall-friction").replace(omega_0=25.0)
README = Path(__file__).with_name("templates") / "cases.md"
SHARP = 1e-13
"""Relative tolerance of the event-driven simulation."""
BOUND = 1e-10
"""Of what it then is wrong by: a hundred times what it differs by from itself at ten times the tolerance."""


@cache
def cases() -> tuple[Case, ...]:
    """All exact cases: those of version 1 first, of these those with one contact."""
    return (*one_contact.cases(), *_grooves(), *_vessel(), *mechanisms.cases())


def listing() -> list[list[str]]:
    """A row for each case: name, number of contacts, kind, what happens; templates/cases.json has them, too."""
    return [[case.name, str(len(case.contacts[0])), case.kind, case.about] for case in cases()]


def write(directory: Path) -> None:
    """Write JSON and MJCF of each case, one HDF5 file of all, and the scoring rule; raises `StorageError`."""
    make_directory(directory)
    check_ours(directory / "README.md", beside=directory / "cases.h5")
    said = {"version": VERSION, "tolerance": TOLERANCE, "dualball": current_versions()["dualball"]}
    said |= {"count": len(cases()), "new": sum(bool(case.needs) for case in cases())}
    with WholeFile(directory / "cases.h5") as whole:
        file = whole.file
        file.attrs.update({"schema": "dualball-cases", "version": VERSION, "tolerance": TOLERANCE})
        for case in cases():
            data = case.to_mapping()
            write_text(directory / f"{case.name}.json", json.dumps(data, indent=1))
            write_text(directory / f"{case.name}.xml", case.mjcf())
            group = file.create_group(case.name)
            group.attrs["about"], group.attrs["case"] = case.about, json.dumps(data | {"times": [], "exact": []})
            group["time"], group["exact"] = case.times, case.exact
            group["contacts"] = np.array(case.contacts, dtype="S")
            group["time"].attrs["units"] = "s"
            group["exact"].attrs["columns"] = "position (m), velocity (m s-1), spin (rad s-1), of each body"
        whole.finish()
    write_text(directory / "README.md", README.read_text("utf-8").format(**said))


def _grooves() -> list[Case]:
    """A sphere and a cube in a right-angled groove down a slope, each plane of which carries m g cos/sqrt(2)."""
    half = math.sqrt(0.5)

    def groove_planes(angle: float, mu: float) -> tuple[Surface, Surface]:
        up = half * np.array(slope(angle)[1])
        left, right = (tuple((up + side * np.array([0.0, half, 0.0])).tolist()) for side in (-1.0, 1.0))
        return Surface("left", mu, normal=left), Surface("right", mu, normal=right)

    def descends(t: Array, angle: float, size: float, lever: float = 2 * 0.4, mu: float = 9.0) -> Any:
        """A body goes down at g sin/(1 + j/sin^2 45) if it rolls, where friction allows; a block can't."""
        way, normal = slope(angle)
        a = max(G * math.sin(angle) / (1 + lever), G * (math.sin(angle) - mu * math.cos(angle) / half))
        spin = a * t / (half * size) if lever < 9 else 0 * t
        return along(way, a * t**2 / 2, a * t, spin, size / half * np.array(normal))

    gentle, steep = math.atan(0.5), math.atan(0.9 * 0.5 / half)
    turn = np.array([math.cos(steep / 2), 0.0, math.sin(steep / 2), 0.0])
    across = np.array([math.cos(math.pi / 8), math.sin(math.pi / 8)])
    orientation = (turn[0] * across[0], turn[0] * across[1], turn[2] * across[0], -turn[2] * across[1])
    cube = {"shape": "box", "size": (0.1,) * 3, "mass": 1.0, "inertia": (0.04 / 6,) * 3}
    source = "Newton and Euler; by symmetry both planes carry m g cos/sqrt(2)"
    return [
        closed_form(
            "groove-rolls", "a sphere rolls down a right-angled groove on two points, at 5/9 g sin",
            sphere(), groove_planes(gentle, 0.5), partial(descends, angle=gentle, size=0.1),
            wrong={"on one point, 5/7 g sin": {"lever": 0.4}, "a hollow sphere": {"lever": 4 / 3}},
            until=1.0, scales=(1.0, 2.0, 30.0), contacts=("RR",), source=source),
        closed_form(
            "groove-rests",
            "a cube pinched by its weight in a right-angled groove stays, at 0.9 of sqrt(2) times its friction",
            cube | {"orientation": orientation}, groove_planes(steep, 0.5),
            partial(descends, angle=steep, size=0.1, lever=math.inf),
            wrong={"a threshold as on a plane": {"mu": 0.5 * half}, "at 0.85 of Coulomb's": {"mu": 0.425}},
            until=2.0, scales=SPEED_ALONE, contacts=("RR",), source=source),
    ]  # fmt: skip


def _vessel() -> list[Case]:
    """The cases of the paper's ball in its vessel."""
    weak, hollow, thin = {"mu": 0.95, "eta": 0.95}, {"j": 1.5}, {"c": 0.0}
    weaker, bouncing = {"mu": 0.8, "eta": 0.8}, {"restitution": 0.3}
    slipping = {"friction 5 % too weak": weak, "no drag": thin}
    rolling = {"a hollow sphere": hollow, "no drag": thin}
    landing = {"a hollow sphere": hollow, "friction 20 % too weak": weaker, "it bounces at 0.3 of its speed": bouncing}
    kicked = State(omega_c=14.35, slip_x=-1.0, slip_y=2.0, slip_z=7.0)
    lands = State(y=0.02, v_y=-0.2, omega_c=12.0, slip_x=30.0, slip_y=-10.0, slip_z=20.0)
    hits = State(omega_c=10.0, slip_x=20.0, slip_y=10.0, slip_z=30.0, h=0.01, v_h=-0.3)
    rides = State(y=0.1, v_y=0.1, omega_c=22.0, slip_x=5.0)
    return [
        ball_case("rolls-on-both", "rolling on floor and wall it is sped up by the fluid (RR)", SLOW,
             State(omega_c=8.0), 4.0, rolling),
        ball_case("from-rest", "from rest it slips on the wall, then rolls on both, ever faster (RS, RR)",
             SLOW, State(), 8.0, rolling),
        ball_case("slips-on-both", "slipping on floor and wall it comes to its stationary state (SS)",
             SLOW.replace(omega_0=25.0), kicked, 2.0, slipping),
        ball_case("rides-the-wall", "the wall alone carries it, and it rolls there (NR)",
             ROUGH, rides, 1.0, rolling),
        ball_case("onset-of-slip", "rolling on both it gets too fast and begins to slip on both, at 1.1 s (RR, SS)",
             SLOW.replace(omega_0=20.0), State(omega_c=8.0), 3.0, slipping),
        ball_case("lands", "it slides down the wall, lands on the floor, slips on both, then rolls (NS, SS, RR)",
             SLOW, lands, 0.5, landing),
        ball_case("hits-the-wall", "it slides on the floor, hits the wall, slips on both, then rolls (SN, SS, RR)",
             SLOW, hits, 0.5, landing),
        ball_case("falls-in", "it flies, meets the wall, then the floor, comes back to the wall (NN, NS, RN, RS, RR)",
             SLOW, State(y=0.05, h=0.03, omega_c=8.0, v_h=-0.3), 0.7, landing),
    ]  # fmt: skip


def ball_case(
    name: str, about: str, p: Parameters, x0: State, until: float, wrong: Mapping[str, Mapping[str, float]]
) -> Case:
    """A case of the paper's ball between floor and wall by event-driven simulation, sampled 25 times.

    `wrong` are factors of its parameters, or a restitution.
    """

    def run(p: Parameters, rtol: float, restitution: float = 0.0) -> tuple[Array, Trajectory]:
        found = analytic.simulate(p, x0, until, rtol=rtol, restitution=restitution, sample_interval=until / 25)
        return np.concatenate(to_world(found.x, found.theta, p), axis=1)[1:], found

    def wrong_states(restitution: float = 0.0, **factors: float) -> Array:
        """States (n, 9) of a ball with parameters wrong by factors."""
        changed = {key: factor * getattr(p, key) for key, factor in factors.items()}
        return run(p.replace(**changed), 1e-9, restitution)[0]

    exact, motion = run(p, SHARP)
    return Case(
        name=name,
        about=f"a ball in a vessel: {about}",
        **scene_fields(p, x0),
        times=motion.time[1:],
        exact=exact,
        contacts=tuple(case.name for case in motion.cases[1:]),
        bound=BOUND,
        source=f"analytic.simulate, event-driven, rtol {SHARP:g}",
        scales=(p.R, p.R * p.omega_0, p.R * p.omega_0 / p.r),
        wrong={text: wrong_states(**how) for text, how in wrong.items()},
        drag=p.c,
        flow=p.omega_0,
        motion=(p, x0),
    )
