"""What ways of setting MuJoCo, and other methods, reach and take: ``python -m
docs.studies.settings`` draws it.

Each is tried on the stationary states and the approach to one of `docs.studies.states`. Runs
are kept in results/settings, as those of the tables of the same page (`docs.studies.tables`).
"""

from __future__ import annotations

import itertools
import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.figure import Figure

from compare.kit import drawing, progress, style
from compare.kit.campaign import Campaign
from compare.kit.engines import (
    DEFAULTS,
    ENGINES,
    EVENT,
    MOREAU,
    PLAIN,
    AnySettings,
    default_settings,
    plain,
)
from compare.kit.pages import Rows
from compare.kit.tasks import carry_out
from docs.studies import states
from docs.studies.states import CONTACT, ERRORS, OPEN, Contestant, Entry
from mjsim import ContactSettings, RigidContacts
from mjsim.contact_settings import ContactModel
from model.files import make_directory

STEP = 1e-3
"""Time step of the ladder, s."""
HIGHER = (1e-4, 2e-4, 3e-4, 4e-4)
"""By how much higher a landing ball begins, m, to land elsewhere within a step of 1 ms."""
STEPS = (4e-3, 2e-3, 1e-3, 5e-4)
"""Time steps of error against cost, s."""
Ways = Mapping[str, AnySettings]
"""Ways to set MuJoCo, named after ours or MuJoCo's defaults and what differs from them."""
LONE = "MuJoCo's defaults"
OURS, LAW = "our settings", "under Coulomb's law"
FACETS = f"{LONE}, a free ball in facets, cone pyramidal"
LOOKS: list[dict[str, Any]] = [
    {"marker": mark, "color": colour, "mfc": "white"}
    for mark, colour in zip(
        "os^vDP*X",
        ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000", "#8C564B"),
        strict=True,
    )
]


def main() -> None:
    """Measure what isn't there yet, and draw both figures into docs/settings/."""
    matplotlib.rcParams["svg.hashsalt"] = "dualball"  # equal figures make equal files
    runs, pictures = Path("results/settings"), Path(__file__).parents[1] / "settings"
    make_directory(pictures)
    with (
        progress.reporter(counted=True) as show,
        Campaign(runs, os.cpu_count() or 1, report=show) as campaign,
    ):
        drawing.save(draw_ladder(reached(campaign, rungs(STEP))), pictures / "ladder.svg")
        drawing.save(draw_frontier(frontier(campaign, STEPS)), pictures / "frontier.svg")


def rungs(step: float) -> Ways:
    """From default settings to the law, each with one thing more than the one before."""
    return {
        FACETS: DEFAULTS.at(step, states.SLIPPING.p),
        f"{LONE}, cone pyramidal": replace(default_settings(step), cone="pyramidal"),
        LONE: default_settings(step),
        OURS: ContactSettings.at(step),
        LAW: RigidContacts(timestep=step),
    }


def rivals(step: float) -> Ways:
    """Settings whose error is compared with their cost."""
    named = rungs(step)
    return {name: named[name] for name in (LAW, OURS, LONE)}


def reached(campaign: Campaign, ways: Ways) -> list[Entry]:
    """Errors of ways to set MuJoCo, and how often contact is lost."""
    return states.scored(campaign, _contestants(ways), [*ERRORS, CONTACT])


def landings(step: float) -> Rows:
    """What a landing, and motions with one, come to: relative errors of omega_c.

    That of `states.LANDING` 5 ms after it has landed and its rms over the motion, how high the ball
    rebounds within 0.1 s at most, as it begins at one of `HIGHER`, and the rms over the motion of
    `states.HITTING`."""
    bare = plain(step)
    ways: Ways = {
        f"{LAW} (mujoco)": RigidContacts(timestep=step),
        f"{OURS}, integrator implicit (mujoco-plain)": bare,
        "mujoco-plain, damping ratio 2": replace(bare, solref=(2 * step, 2.0)),
        "mujoco-plain, damping ratio 2, step divided by 10": replace(
            plain(step / 10), solref=(step / 5, 2.0)
        ),
        "mujoco-plain, step divided by 10": plain(step / 10),
        "mujoco-plain, solimp 0.9": replace(bare, solimp=0.9),
        "mujoco-plain, integrator discrete": replace(bare, integrator="discrete"),
        LONE: default_settings(step),
        f"{FACETS} (mujoco-defaults)": DEFAULTS.at(step, states.LANDING.p),
    }
    rows = [
        [
            "settings",
            "ω_c 5 ms after a landing",
            "rebound",
            "motion with it",
            "motion that hits the wall",
        ]
    ]
    for name, way in ways.items():
        (contestant,), land, hit = _contestants({name: way}), states.LANDING, states.HITTING
        lands, hits, *others = (
            carry_out(contestant.task((each.p, x0, lasts, step)))
            for each, x0, lasts in (
                *((each, each.x0, each.lasts) for each in (land, hit)),
                *((land, land.x0._replace(y=land.x0.y + more), 0.25) for more in HIGHER),
            )
        )
        exact = states.LANDING.exact
        landed = float(exact.time[np.flatnonzero(exact.y <= 0)[0]])
        after = float(np.interp(landed + 5e-3, lands.time, lands.omega_c))
        off = after / float(np.interp(landed + 5e-3, exact.time, exact.omega_c)) - 1
        high = [
            run.y[(run.time > landed + 2e-3) & (run.time < landed + 0.1)].max()
            for run in (lands, *others)
        ]
        height = float(max(high))
        motions = (
            each.errors(run.time, run.x)[0]
            for each, run in ((states.LANDING, lands), (states.HITTING, hits))
        )
        rebound = f"{1e3 * height:.2g} mm" if height > 1e-5 else "none"
        rows.append([name, states.number(abs(off)), rebound, *map(states.number, motions)])
    return rows


def frontier(campaign: Campaign, steps: Sequence[float]) -> list[Entry]:
    """Entries, with their cost, of MuJoCo under several settings and of theory's two simulators, at
    several steps."""
    ways = [
        each
        for alike in zip(*(_contestants(rivals(step)) for step in steps), strict=True)
        for each in alike
    ]
    theory = [each for name in (MOREAU.name, EVENT.name) for each in _theory(name, steps)]
    return states.scored(campaign, [*ways, *theory], ERRORS, states.cost)


def _theory(name: str, steps: Sequence[float]) -> list[Contestant]:
    """One of theory's simulators, once if it chooses its own steps."""
    engine = ENGINES[name]
    chosen: list[float | None] = [*steps] if "timestep" in engine.options else [None]
    return [Contestant(name, engine, step, engine.at(step, states.SLIPPING.p)) for step in chosen]


def _contestants(ways: Ways) -> list[Contestant]:
    """They run without a warning where contacts chatter: what poor settings do is the question
    here."""
    engines = {
        name: PLAIN if isinstance(each, ContactModel) else DEFAULTS for name, each in ways.items()
    }
    return [Contestant(name, engines[name], each.timestep, each) for name, each in ways.items()]


def draw_ladder(entries: Sequence[Entry]) -> Figure:
    """Rows of settings, a mark for each error of omega_c; a run that diverged has none."""
    figure = style.figure(9, 1.1 + 0.33 * len(entries))
    axes = figure.add_subplot()
    for name, look in zip(
        (name for name in entries[0].scores if name != OPEN), LOOKS, strict=False
    ):
        own = [
            (max(e.scores[name], states.LEAST), k)
            for k, e in enumerate(entries)
            if math.isfinite(e.scores[name])
        ]
        axes.plot([x for x, _ in own], [k for _, k in own], "-", lw=0.6, label=name, **look)
    axes.set_yticks(range(len(entries)), [entry.name for entry in entries], fontsize=8.5)
    axes.invert_yaxis()
    axes.set(xscale="log", xlabel="$|\\Delta\\omega_c|/\\omega_c$")
    axes.grid(alpha=0.3)
    style.legend(figure, loc="outside upper center", ncols=5)
    return figure


def draw_frontier(entries: Sequence[Entry]) -> Figure:
    """A panel for each state, a line for each method."""
    names = dict.fromkeys(entry.name for entry in entries)
    return states.draw_error_over_cost(
        entries, dict(zip(names, itertools.cycle(LOOKS), strict=False))
    )


if __name__ == "__main__":
    main()
