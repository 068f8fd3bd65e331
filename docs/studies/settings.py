"""What ways of setting MuJoCo, and other methods, reach and take: tables and pictures of
docs/records/settings.md, made by `docs.studies.tables`.

Each is tried on the stationary states and the approach to one of `docs.studies.states`."""

import json
import statistics
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from compare.campaign.campaign import Campaign
from compare.campaign.tasks import Task, carry_out
from compare.engines.study import DEFAULTS, EVENT, MOREAU, MUJOCO, PLAIN, AnySettings, plain
from compare.figures import drawing, style
from compare.figures.pages import Rows
from docs.studies.states import (
    APPROACH,
    HITTING,
    LANDING,
    SLIPPING,
    STATES,
    Asked,
    Stationary,
    Transient,
)
from docs.studies.ways import processor_time
from mjsim import ContactSettings, RigidContacts
from model.files import write_text

PICTURES = Path(__file__).parents[1] / "settings"
STEP = 1e-3
"""Time step of the ladder, s."""
STEPS = (4e-3, 2e-3, 1e-3, 5e-4)
"""Time steps of error against cost, s."""
HIGHER = (1e-4, 2e-4, 3e-4, 4e-4)
"""By how much higher a landing ball begins, m, to land elsewhere within a step of 1 ms."""
REPEATS = 3
"""Cost is the median of as many timings."""
LEAST = 1e-16
"""Smaller errors are drawn here: an error may be zero."""
Ways = Mapping[str, AnySettings]
"""Ways to set MuJoCo, named after ours or MuJoCo's defaults and what differs from them."""
LONE = "MuJoCo's defaults"
OURS, LAW = "our settings", "under Coulomb's law"
FACETS = f"{LONE}, a free ball in facets, cone pyramidal"
TRIED: tuple[Stationary | Transient, ...] = (*STATES, APPROACH)
MARKS, COLOURS = "os^vD", ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00")


@dataclass(frozen=True)
class Contestant:
    """An engine with settings."""

    name: str
    engine: str
    settings: AnySettings
    step: float | None
    """s; None for one that chooses its own."""

    def task(self, asked: Asked) -> Task:
        """A run; it samples no more often than it steps."""
        p, x0, lasts, interval = asked
        every = max(interval, self.step or 0.0)
        return Task(
            engine=self.engine,
            parameters=p,
            x0=x0,
            t_end=lasts,
            settings=self.settings,
            sample_interval=every,
        )

    def errors(self, campaign: Campaign) -> list[float]:
        """Relative errors of omega_c, one for each of `TRIED`; raises as `Campaign.run`."""
        return [of.error(campaign.run([self.task(of.run)])[0]) for of in TRIED]

    def open(self, campaign: Campaign) -> float:
        """Largest share of time in which contact is lost that should not be."""
        return max(of.open(campaign.run([self.task(of.run)])[0]) for of in TRIED)

    def cost(self, kept: Path) -> float:
        """Processor time divided by simulated time, without what it takes to begin; measured
        once."""
        task = self.task(APPROACH.run)
        half, file = replace(task, t_end=task.t_end / 2), kept / f"{task.key}.cost.json"
        if not file.exists():
            runs = [partial(carry_out, each) for each in (task, half)]
            timed = ([processor_time(run) for run in runs] for _ in range(REPEATS))
            second = statistics.median(whole - first for whole, first in timed)
            write_text(file, json.dumps(second / half.t_end))
        return float(json.loads(file.read_text("utf-8")))


def contestants(ways: Ways) -> list[Contestant]:
    """They run without a warning where contacts chatter: what poor settings do is the question
    here."""
    engines = {RigidContacts: MUJOCO, ContactSettings: PLAIN}
    return [
        Contestant(name, engines.get(type(way), DEFAULTS).name, way, way.timestep)
        for name, way in ways.items()
    ]


def default_settings(step: float) -> ContactSettings:
    """MuJoCo's own contact parameters on the joints of the study."""
    return ContactSettings(
        timestep=step, solref=(0.02, 1.0), solreffriction=0.02, solimp=0.9, impratio=1.0
    )


def rungs(step: float) -> Ways:
    """From default settings to the law, each with one thing more than the one before."""
    return {
        FACETS: DEFAULTS.at(step, SLIPPING.p),
        f"{LONE}, cone pyramidal": replace(default_settings(step), cone="pyramidal"),
        LONE: default_settings(step),
        OURS: ContactSettings.at(step),
        LAW: RigidContacts(timestep=step),
    }


def ablation(campaign: Campaign) -> Rows:
    """Errors from rung to rung, and how often contact is lost; drawn, too."""
    those = contestants(rungs(STEP))
    campaign.complete(each.task(of.run) for each in those for of in TRIED)
    errors = {each.name: each.errors(campaign) for each in those}
    drawing.save(draw_ladder(errors), PICTURES / "ladder.svg")
    rows = [["settings", *(of.name for of in TRIED), "open"]]
    for each in those:
        rows.append([each.name, *map(number, errors[each.name]), f"{each.open(campaign):.0%}"])
    return rows


def frontier(campaign: Campaign) -> Rows:
    """Errors of MuJoCo under several settings and of theory's two simulators at several steps, and
    their cost; drawn, too."""
    those = [
        each
        for name in (LAW, OURS, LONE)
        for h in STEPS
        for each in contestants({name: rungs(h)[name]})
    ]
    those += [Contestant(MOREAU.name, MOREAU.name, MOREAU.at(h, SLIPPING.p), h) for h in STEPS]
    those += [Contestant(EVENT.name, EVENT.name, EVENT.at(None, SLIPPING.p), None)]
    campaign.complete(each.task(of.run) for each in those for of in TRIED)
    found = [(each, each.errors(campaign), each.cost(campaign.directory)) for each in those]
    drawing.save(draw_frontier(found), PICTURES / "frontier.svg")
    rows = [["engine", "step", *(of.name for of in TRIED), "cost"]]
    for each, errors, cost in found:
        step = f"{1e3 * each.step:g} ms" if each.step else "its own"
        rows.append([each.name, step, *map(number, errors), f"{cost:.2g}"])
    return rows


def landings() -> Rows:
    """What a landing, and motions with one, come to: relative errors of omega_c.

    That of `LANDING` 5 ms after it has landed and its rms over the motion, how high the ball
    rebounds within 0.1 s at most, as it begins at one of `HIGHER`, and the rms over the motion of
    `HITTING`."""
    bare, shorter = plain(STEP), plain(STEP / 10)
    ways: Ways = {
        f"{LAW} (mujoco)": RigidContacts(timestep=STEP),
        f"{OURS}, integrator implicit (mujoco-plain)": bare,
        "mujoco-plain, damping ratio 2": replace(bare, solref=(2 * STEP, 2.0)),
        "mujoco-plain, step divided by 10": shorter,
        "mujoco-plain, solimp 0.9": replace(bare, solimp=0.9),
        "mujoco-plain, integrator discrete": replace(bare, integrator="discrete"),
        LONE: default_settings(STEP),
        f"{FACETS} (mujoco-defaults)": DEFAULTS.at(STEP, LANDING.p),
    }
    landed = float(LANDING.exact.time[np.flatnonzero(LANDING.exact.y <= 0)[0]])
    asked: list[Asked] = [(of.p, of.x0, of.lasts, STEP) for of in (LANDING, HITTING)]
    asked += [
        (LANDING.p, LANDING.x0._replace(y=LANDING.x0.y + more), 0.25, STEP) for more in HIGHER
    ]
    head = ["ω_c 5 ms after a landing", "rebound", "motion with it", "motion that hits the wall"]
    rows = [["settings", *head]]
    for each in contestants(ways):
        lands, hits, *others = (carry_out(each.task(of)) for of in asked)
        after = float(np.interp(landed + 5e-3, lands.time, lands.omega_c))
        height = max(
            run.y[(run.time > landed + 2e-3) & (run.time < landed + 0.1)].max()
            for run in (lands, *others)
        )
        error = abs(after / float(LANDING.at(landed + 5e-3)) - 1)
        rebound = f"{1e3 * height:.2g} mm" if height > 1e-5 else "none"
        errors = number(LANDING.error(lands)), number(HITTING.error(hits))
        rows.append([each.name, number(error), rebound, *errors])
    return rows


def number(value: float) -> str:
    """An error: round-off is shown as such."""
    return "< 1e-14" if value < 1e-14 else f"{value:.1e}"


def draw_ladder(errors: Mapping[str, Sequence[float]]) -> Figure:
    """Rows of settings, a mark for each error of omega_c."""
    figure = style.figure(9, 1.1 + 0.33 * len(errors))
    axes = figure.add_subplot()
    shown, rows = np.maximum(list(errors.values()), LEAST), range(len(errors))
    for of, x, mark, colour in zip(TRIED, shown.T, MARKS, COLOURS, strict=True):
        axes.plot(x, rows, f"-{mark}", color=colour, mfc="white", lw=0.6, label=of.name)
    axes.set_yticks(rows, list(errors), fontsize=8.5)
    axes.invert_yaxis()
    axes.set(xscale="log", xlabel="$|\\Delta\\omega_c|/\\omega_c$")
    axes.grid(alpha=0.3)
    style.legend(figure, loc="outside upper center", ncols=5)
    return figure


def draw_frontier(found: Sequence[tuple[Contestant, Sequence[float], float]]) -> Figure:
    """A panel for each error of omega_c; those of one name at several time steps are joined."""
    figure = style.figure(11, 6.9)
    panels = figure.subplots(2, 3, sharex=True, sharey=True).ravel()
    names = dict.fromkeys(each.name for each, _, _ in found)
    for k, (axes, of) in enumerate(zip(panels, TRIED, strict=False)):
        for name, mark, colour in zip(names, MARKS, COLOURS, strict=True):
            own = sorted((cost, max(e[k], LEAST)) for each, e, cost in found if each.name == name)
            look = {"ms": 6, "lw": 1, "color": colour, "mfc": "white"}
            axes.plot(*np.transpose(own), f"-{mark}", label=name, **look)
        axes.set(xscale="log", yscale="log")
        axes.set_title(of.name, fontsize=10)
        axes.set_xlabel("processor time divided by simulated time")
        axes.grid(alpha=0.3)
    panels[0].set_ylabel("relative error")
    panels[-1].set_visible(False)
    style.legend(figure, loc="outside lower center", ncols=4)
    return figure
