"""The set of exact cases, the study's ball among them, and as files for any language.

The ball's motion is that of `analytic.simulate`, event-driven, at its sharpest; its wrong answers
are the motions of other parameters."""

from __future__ import annotations

import json
from collections.abc import Mapping
from functools import cache
from pathlib import Path

import numpy as np

import analytic
from compare.bench.case import TOLERANCE, VERSION, ContactCase
from compare.bench.closed_forms import CLOSED_FORMS
from compare.bench.mechanisms import MECHANISMS
from compare.bench.oblique import OBLIQUE
from compare.engines.adapters.vessel import scene_fields
from model import Parameters, State, Trajectory
from model.arrays import Array
from model.files import check_ours, make_directory, write_text
from model.hdf5 import writing
from model.kinematics import to_world
from model.versions import current_versions

SLOW = Parameters.named("reference").replace(omega_0=12.0)
ROUGH = Parameters.named("high-wall-friction").replace(omega_0=25.0)
README = Path(__file__).with_name("templates") / "cases.md"
EVENT_RTOL = 1e-13  # relative tolerance of the event-driven simulation
BOUND = 1e-10  # of what it then is wrong by: a hundred times what ten times the tolerance changes


@cache
def cases() -> tuple[ContactCase, ...]:
    """All exact cases: those of version 1 first, of these those in closed form."""
    later = [form() for form in (*MECHANISMS, *OBLIQUE)]
    return (*(form() for form in CLOSED_FORMS), *(_in_vessel(*row) for row in VESSEL), *later)


def listing() -> list[list[str]]:
    """A row for each case: name, contacts, kind, what happens; as templates/cases.json."""
    return [[case.name, str(len(case.contacts[0])), case.kind, case.about] for case in cases()]


def write(directory: Path) -> None:
    """Write each case, one HDF5 file of all, and the scoring rule; `StorageError`."""
    make_directory(directory)
    check_ours(directory / "README.md", beside=directory / "cases.h5")
    said = {"version": VERSION, "tolerance": TOLERANCE, "dualball": current_versions()["dualball"]}
    said |= {"count": len(cases()), "new": sum(bool(case.needs) for case in cases())}
    with writing(directory / "cases.h5") as file:
        file.attrs.update({"schema": "dualball-cases", "version": VERSION, "tolerance": TOLERANCE})
        for case in cases():
            data = case.to_mapping()
            write_text(directory / f"{case.name}.json", json.dumps(data, indent=1))
            write_text(directory / f"{case.name}.xml", case.mjcf())
            group = file.create_group(case.name)
            group.attrs["about"] = case.about
            group.attrs["case"] = json.dumps(data | {"times": [], "exact": []})
            group["time"], group["exact"] = case.times, case.exact
            group["contacts"] = np.array(case.contacts, dtype="S")
            group["time"].attrs["units"] = "s"
            columns = "position (m), velocity (m s-1), spin (rad s-1), of each body"
            group["exact"].attrs["columns"] = columns
    write_text(directory / "README.md", README.read_text("utf-8").format(**said))


_IMPACT = {
    "a hollow sphere": {"j": 1.5},
    "friction 20 % too weak": {"mu": 0.8, "eta": 0.8},
    "it bounces at 0.3 of its speed": {"restitution": 0.3},
}
_ROLL = {"a hollow sphere": {"j": 1.5}, "no drag": {"c": 0.0}}
_SLIP = {"friction 5 % too weak": {"mu": 0.95, "eta": 0.95}, "no drag": {"c": 0.0}}
"""Wrong answers for what lands, rolls and slips: factors of parameters, or a restitution."""
# fmt: off
VESSEL: tuple[tuple[str, str, Parameters, State, float, Mapping[str, Mapping[str, float]]], ...] = (
    ("rolls-on-both", "rolling on floor and wall it is sped up by the fluid (RR)",
     SLOW, State(omega_c=8.0), 4.0, _ROLL),
    ("from-rest", "from rest it slips on the wall, then rolls on both, ever faster (RS, RR)",
     SLOW, State(), 8.0, _ROLL),
    ("slips-on-both", "slipping on floor and wall it comes to its stationary state (SS)",
     SLOW.replace(omega_0=25.0), State(omega_c=14.35, slip_x=-1.0, slip_y=2.0, slip_z=7.0),
     2.0, _SLIP),
    ("rides-the-wall", "the wall alone carries it, and it rolls there (NR)",
     ROUGH, State(y=0.1, v_y=0.1, omega_c=22.0, slip_x=5.0), 1.0, _ROLL),
    ("onset-of-slip",
     "rolling on both it gets too fast and begins to slip on both, at 1.1 s (RR, SS)",
     SLOW.replace(omega_0=20.0), State(omega_c=8.0), 3.0, _SLIP),
    ("lands", "it slides down the wall, lands on the floor, slips on both, then rolls (NS, SS, RR)",
     SLOW, State(y=0.02, v_y=-0.2, omega_c=12.0, slip_x=30.0, slip_y=-10.0, slip_z=20.0),
     0.5, _IMPACT),
    ("hits-the-wall",
     "it slides on the floor, hits the wall, slips on both, then rolls (SN, SS, RR)",
     SLOW, State(omega_c=10.0, slip_x=20.0, slip_y=10.0, slip_z=30.0, h=0.01, v_h=-0.3),
     0.5, _IMPACT),
    ("falls-in",
     "it flies, meets the wall, then the floor, comes back to the wall (NN, NS, RN, RS, RR)",
     SLOW, State(y=0.05, h=0.03, omega_c=8.0, v_h=-0.3), 0.7, _IMPACT),
)
# fmt: on
"""The paper's ball: name, what happens, parameters, start, duration in s, and wrong answers."""


def _in_vessel(
    name: str,
    about: str,
    p: Parameters,
    x0: State,
    until: float,
    wrong: Mapping[str, Mapping[str, float]],
) -> ContactCase:
    """A case of the ball between floor and wall, as in `VESSEL`, sampled 25 times."""

    def run(rtol: float, restitution: float = 0.0, **factors: float) -> tuple[Array, Trajectory]:
        """States (n, 9) of a ball with parameters wrong by factors, and its motion."""
        other = p.replace(**{key: factor * getattr(p, key) for key, factor in factors.items()})
        found = analytic.simulate(
            other, x0, until, rtol=rtol, restitution=restitution, sample_interval=until / 25
        )
        return np.concatenate(to_world(found.x, found.theta, other), axis=1)[1:], found

    exact, motion = run(EVENT_RTOL)
    return ContactCase(
        name=name,
        about=f"a ball in a vessel: {about}",
        **scene_fields(p, x0),
        times=motion.time[1:],
        exact=exact,
        contacts=tuple(case.name for case in motion.cases[1:]),
        bound=BOUND,
        source=f"analytic.simulate, event-driven, rtol {EVENT_RTOL:g}",
        scales=(p.R, p.R * p.omega_0, p.R * p.omega_0 / p.r),
        wrong={text: run(1e-9, **how)[0] for text, how in wrong.items()},
        drag=p.c,
        flow=p.omega_0,
        motion=(p, x0),
    )
