"""``python -m tests.mutants.blind SEED``: a round played blind.

The seed draws parameter sets that nobody has seen, and plants faults in theories and engines, which
are kept in a file that the judge doesn't read. Engines of the study measure; claims are judged by
the right theory and by each wrong one. What came out, whatever it is, becomes a section of
docs/blind.md."""

import importlib
import json
import math
import pkgutil
import sys
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from types import CodeType
from typing import Any

import numpy as np

import analytic
from analytic.mechanics.drag import coefficient
from analytic.simulation import compiling
from compare import validation
from compare.campaign.campaign import Campaign
from compare.campaign.progress import ValidationProgress, show_nothing
from compare.campaign.workers import LateError, at_most
from compare.engines.study import ENGINES, MUJOCO, PLAIN, Engine
from compare.figures import pages
from compare.figures.pages import Rows
from compare.method.record import RecordsByEngine
from compare.plan import HIGH, LOW, Level
from compare.report.deviations import distribution
from compare.report.results import RUNS
from compare.subjects.catalogue import CLAIMS
from compare.verification.assessment import full_verdict
from compare.verification.claim import EngineVerdict, Outcome, Verdict
from compare.verification.judge import forget
from docs.studies import tables
from model import Parameters
from model.drag import LAWS, STOKES
from model.files import make_directory, write_text
from model.versions import current_commit
from tests.by_scipy import runs_by_scipy
from tests.mutants import formulas
from tests.mutants.engines import wrong_engine
from tests.mutants.exchange import WrongTheory, believed
from tests.mutants.trial import LONGEST, PROVING

PAGE, KEY = Path("docs/blind.md"), "key.json"
ASKED = ("drake", "siconos")
"""Engines beside MuJoCo that measure where they are installed; the page says which aren't."""
UNCHANGED = 1e-9
"""Part of its natural size by which a prediction may move for a fault to have changed nothing: a
fault in the first guess of an iteration leaves round-off. (It was a part of the prediction, until
two such faults of seed 20261217 had counted as missed: a prediction of 0 had moved by 1e-16. Up to
seed 20261215 motions by a wrong theory, which scipy's integrators find, were compared with those by
the right one's compiled ones: these differ by up to 5e-8.)"""
BY = (MUJOCO, PLAIN)
REYNOLDS_NUMBERS = (200.0, 2000.0)
"""Of a ball that moves with sqrt(g R) through the fluid."""


def drawn(rng: np.random.Generator) -> Parameters:
    """A set drawn evenly from the box of the study's design, with one of the laws of drag.

    That has the coefficient of the design at a speed of sqrt(g R) in the fluid, where the Reynolds
    number is that of two sets of the study, or up to ten times as great."""
    values: dict[str, Any] = {name: float(rng.uniform(LOW[name], HIGH[name])) for name in LOW}
    ratio, kappa = values.pop("r/R"), values.pop("kappa")
    least, most = REYNOLDS_NUMBERS
    drag, Re = str(rng.choice(LAWS)), least * (most / least) ** rng.uniform()
    r, speed = ratio * values["R"], math.sqrt(values["g"] * values["R"])
    nu_f = 0.0 if drag == STOKES else 2 * r * speed / Re
    p = Parameters(**values, r=r, c=1.0, omega_0=1.0, drag=drag, nu_f=nu_f)
    return p.replace(c=kappa * math.sqrt(p.g / p.R) / float(coefficient(speed, p)))


def measured(
    directory: Path, engines: Sequence[Engine], p: Parameters, protocols: Collection[str]
) -> RecordsByEngine:
    """What engines measure on a set, by all protocols of the quick level if none is named."""
    study = validation.plan(directory, Level.QUICK, None, {"blind-1": p}, None)
    chosen = [each for each in study.protocols if not protocols or each.name in protocols]
    study = replace(study, engines=list(engines), protocols=chosen)
    with Campaign(directory / RUNS, 0, passing=True) as campaign:
        far = ValidationProgress(show_nothing, 0)
        *_, last = validation.measure(study, campaign, far, {})
    for name, error in last.broken.items():
        print(f"{name}: {error}", file=sys.stderr)
    return last.records


@dataclass(frozen=True)
class Said:
    """A verdict by the right theory, and the code of the functions that its predictions call."""

    verdict: Verdict
    calls: frozenset[CodeType]

    @property
    def engines(self) -> dict[str, EngineVerdict]:
        """What each engine says."""
        return {each.engine: each for each in self.verdict.engines}


def watched(act: Callable[[], Verdict]) -> Said:
    """A verdict, and what was called for it."""
    called = set[CodeType]()
    forget()
    sys.setprofile(lambda frame, event, of: called.add(frame.f_code) if event == "call" else None)
    try:
        verdict = act()
    finally:
        sys.setprofile(None)
    return Said(verdict, frozenset(called))


def formulas_called(said: Sequence[Said]) -> list[Callable[..., Any]]:
    """The plain functions of `analytic` that predictions call: a fault elsewhere is not about
    anything that was measured."""
    known = frozenset[CodeType]().union(*(each.calls for each in said))
    found = []
    for name in sorted(each.name for each in pkgutil.walk_packages(analytic.__path__, "analytic.")):
        for _, value in sorted(vars(importlib.import_module(name)).items()):
            own = getattr(value, "__module__", "") == name
            found += [value] if own and getattr(value, "__code__", None) in known else []
    return found


@dataclass
class Detection:
    """What became of a fault."""

    by: dict[str, str] = field(default_factory=dict)
    """Which claim found it, by engine."""
    changes: bool = False
    """Whether some prediction, or measurement, is another."""
    broke: bool = False
    """Whether some prediction broke down, or was given up: that alone finds nothing."""

    def add(self, right: Verdict, now: Verdict) -> None:
        """Take in a verdict under the fault, beside that by the right theory."""
        engines = {each.engine: each for each in right.engines}
        for each in now.engines:
            before = engines[each.engine]
            one, other = ([check.predicted for check in of.checks] for of in (before, each))
            sizes = [check.scale for check in before.checks]
            self.broke |= each.outcome is Outcome.ERROR
            self.changes |= len(one) != len(other) or bool(
                np.any(np.isnan(one) != np.isnan(other))
                or np.any(np.abs(np.subtract(one, other)) > UNCHANGED * np.array(sizes))
            )
            if each.outcome is Outcome.REFUTED is not before.outcome:
                self.by.setdefault(each.engine, now.claim.id)


def rightly_by_scipy(said: Sequence[Said], records: RecordsByEngine) -> dict[str, Verdict]:
    """Verdicts by the right theory on claims of which formulas are compiled, by their ids, with
    the integrators by which wrong ones run."""
    compiled = {each.__code__ for each in compiling.called}
    claims = [each.verdict.claim for each in said if each.calls & compiled]
    forget()
    with runs_by_scipy():
        return {claim.id: full_verdict(claim, records) for claim in claims}


def tried(
    wrong: WrongTheory,
    said: Sequence[Said],
    by_scipy: Mapping[str, Verdict],
    records: RecordsByEngine,
) -> Detection:
    """Judge the claims that call a wrong function, until every engine has found the fault."""
    detection = Detection()
    function = getattr(importlib.import_module(wrong.module), wrong.function)
    code, rights = function.__code__, by_scipy if function in compiling.called else {}
    forget()
    with believed(wrong):
        for each in (each for each in said if code in each.calls):
            if each.engines.keys() <= detection.by.keys():
                continue
            try:
                with at_most(LONGEST):
                    right = rights.get(each.verdict.claim.id, each.verdict)
                    detection.add(right, full_verdict(each.verdict.claim, records))
            except LateError:
                detection.broke = detection.changes = True
    return detection


def tried_engine(wrong: Engine, said: Sequence[Said], directory: Path, p: Parameters) -> Detection:
    """Measure with a wrong engine, and judge by the right theory."""
    ENGINES[wrong.name] = wrong  # tasks name it
    detection = Detection(changes=True)
    records = measured(directory, [wrong], p, PROVING)
    own = {MUJOCO.name: records[wrong.name]}
    forget()
    for each in (each for each in said if each.verdict.claim.protocols <= PROVING):
        detection.add(each.verdict, full_verdict(each.verdict.claim, own))
    return detection


def play(
    seed: int,
    directory: Path,
    *,
    theories: int = 20,
    engines: int = 3,
    protocols: Collection[str] = (),
) -> str:
    """Play a round in a directory, with so many wrong theories and engines; the section about it,
    in Markdown."""
    rng = np.random.default_rng(seed)
    p = drawn(rng)
    make_directory(directory)
    there = [*BY, *(ENGINES[name] for name in ASKED if not ENGINES[name].missing)]
    records = measured(directory / "measured", there, p, protocols)
    rows = [m for steps in records.values() for own in steps.values() for m in own.measurements]
    names = {m.protocol for m in rows}
    said = [
        watched(partial(full_verdict, claim, records))
        for claim in CLAIMS
        if claim.protocols <= names
    ]
    planted = formulas.planted(rng, formulas_called(said))
    wrongs = [next(planted) for _ in range(theories)]
    balls = [formulas.of_ball(rng) for _ in range(engines)]
    key = [*(each.what for each in wrongs), *(what for what, _ in balls)]
    write_text(directory / KEY, json.dumps(key, ensure_ascii=False, indent=1))
    by_scipy = rightly_by_scipy(said, records)
    detections = [tried(wrong, said, by_scipy, records) for wrong in wrongs]
    for n, (_, ball) in enumerate(balls):
        wrong = wrong_engine(f"blind-engine-{n}", ball)
        detections.append(tried_engine(wrong, said, directory / wrong.name, p))
    return section(seed, p, said, list(zip(key, detections, strict=True)))


def section(
    seed: int, p: Parameters, said: Sequence[Said], faults: Sequence[tuple[str, Detection]]
) -> str:
    """What came out, once the key is opened."""
    off = {row.engine: row for row in distribution([e.verdict for e in said]) if not row.quantity}
    names = list(dict.fromkeys(name for each in said for name in each.engines))
    head = ["engine", "found", "confirmed", "false alarms", "numbers", "beyond 1", "beyond 2", "3"]
    counts, found = [head], [["fault", *names, ""]]
    for name in names:
        own = [(e.verdict.claim, e.engines[name].outcome) for e in said if name in e.engines]
        alarms = [c.id for c, o in own if o is Outcome.REFUTED is not c.expected]
        confirmed = sum(outcome is Outcome.CONFIRMED for _, outcome in own)
        row = [name, str(sum(name in each.by for _, each in faults)), f"{confirmed} of {len(own)}"]
        beyond = [f"{off[name].beyond(n):.1%}" if name in off else "–" for n in (1, 2, 3)]
        numbers = str(len(off[name].sizes)) if name in off else "0"
        counts.append([*row, ", ".join(alarms) or "none", numbers, *beyond])
    for what, each in faults:
        notes = ["changes no prediction"] * (not each.changes) + ["breaks down"] * each.broke
        shown = "`" + what.replace("|", "\\|") + "`"
        found.append([shown, *(each.by.get(name, "–") for name in names), ", ".join(notes)])
    absent = ", ".join(name for name in ASKED if name not in names)
    live = sum(each.changes for _, each in faults)
    names_of = ("mu", "eta", "j", "r", "R", "m", "g", "c", *["nu_f"] * (p.drag != STOKES))
    values = ", ".join(f"{name} = {getattr(p, name):.4g}" for name in names_of)
    return f"""
## Seed {seed}

Found: **{sum(bool(each.by) for _, each in faults)} of the {live} faults that change a prediction \
or a measurement**, of {len(faults)}
that were planted. Rules as
of the commit `{current_commit()[:12] or "unknown"}`. Set, SI: `{values}`, drag: {p.drag}.
Measured by {", ".join(names)}; not installed: {absent or "none"}.

{pages.markdown(counts)}

{pages.markdown(found)}
"""


def rounds(page: str) -> Rows:
    """What became of the faults of all rounds on the page, by MuJoCo under the law."""
    counts = {}
    for one in page.split("\n## Seed ")[1:]:
        faults = [row.split(" | ") for row in one.splitlines() if row.startswith("| `")]
        live = [row for row in faults if "changes no prediction" not in row[-1]]
        unseen = [row for row in live if row[1] == "–"]
        broke = sum("breaks down" in row[-1] for row in unseen)
        seed, found = one.split("\n")[0], len(live) - len(unseen)
        counts[seed] = np.array([len(live), found, broke, len(unseen) - broke])
    counts["all"] = np.sum(list(counts.values()), axis=0)
    head = ["seed", "faults that change something", "found", "break down", "go unseen"]
    return [head, *([seed, *map(str, own)] for seed, own in counts.items())]


def main(seed: str, directory: str = "results/blind") -> None:
    """Play a round, and add its section to the page."""
    before = PAGE.read_text("utf-8")
    if f"## Seed {seed}\n" in before:
        sys.exit(f"seed {seed} was played already: {PAGE}")
    page = before + play(int(seed), Path(directory) / seed)
    write_text(PAGE, page)
    tables.write(PAGE, "rounds", rounds(page))


if __name__ == "__main__":
    main(*sys.argv[1:])
