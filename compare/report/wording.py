"""Numbers, conditions and verdicts as a reader sees them; nothing reads them back."""

import math
from collections import Counter, defaultdict
from collections.abc import Mapping, Sequence
from statistics import median
from typing import Any

from compare.engines.study import ENGINES
from compare.figures.pages import readable
from compare.method.conditions import UNITS, Conditions
from compare.method.quantities import QUANTITIES, quantity
from compare.method.record import Check, Measurement
from compare.verification.claim import Claim, EngineVerdict, Outcome, Text, Verdict
from model import Case
from model.errors import few

SYMBOLS = {name: each.symbol for name, each in QUANTITIES.items()} | {
    n: n for n in ("v_h", "n_x", "n_y", "n_z")
}
"""How quantities and conditions are written, where that isn't their name."""
MARKS = {
    Outcome.CONFIRMED: ("pass", "✓"),
    Outcome.REFUTED: ("fail", "✗"),
    Outcome.INCONCLUSIVE: ("other", "?"),
    Outcome.ERROR: ("fail", "!"),
    Outcome.NOT_RUN: ("none", "…"),
    Outcome.NOT_ASKED: ("none", "–"),
}
"""Class and sign of each outcome."""
_OPEN = Outcome.INCONCLUSIVE, Outcome.ERROR, Outcome.NOT_RUN


def size(value: float, sign: str = "") -> str:
    """A small number as text: two digits, or 0."""
    return f"{value:{sign}.1e}" if value else "0"


def symbol_and_unit(m: Measurement) -> str:
    """What was measured: "ω_c rad/s"."""
    return f"{SYMBOLS[m.quantity]} {readable(m.unit)}".rstrip()


def value(m: Measurement, of: float) -> str:
    """A value of the measurement's quantity; cases by name, of what is tiny its size."""
    if not math.isfinite(of):
        return "none" if math.isnan(of) else f"{of:g}"
    if m.quantity == "case":
        return Case(int(of)).name
    if m.quantity == "cases":
        return " ".join(case.name for case in Case if int(of) & 1 << case)
    return f"{of:.9g}" if abs(of) >= 1e-4 else size(of)


def conditions(of: Conditions) -> str:
    """Conditions as text: "case SS, from above, y = 0.02 m"; without states that are 0."""
    said = []
    for name, each in of.items():
        plain = name.replace("_", " ")
        if isinstance(each, str):
            said.append(each if name == "side" else f"{plain} {each}")
        elif each or name not in ("y", "v_y", "h", "v_h", "slip_x", "slip_y", "slip_z"):
            unit = readable(UNITS.get(name, "1"))
            said.append(f"{SYMBOLS.get(name, plain)} = {each:.4g} {unit}".rstrip())
    return ", ".join(said)


def where(m: Measurement) -> str:
    """The set, flow and conditions of a measurement: "reference, ω₀ = 25 rad/s: case SS"."""
    flow = f"{m.set}, ω₀ = {m.parameters.omega_0:.6g} rad/s"
    return f"{flow}: {conditions(m.at)}" if m.at else flow


def budget(m: Measurement) -> str:
    """What an uncertainty is made up of, by shares of the variance: "time step 81 %, degree 19 %";
    shares below 1 % are left out."""
    whole = sum(u**2 for u in m.budget.values())
    shares = sorted(((u**2 / whole, cause) for cause, u in m.budget.items() if u), reverse=True)
    said = (f"{cause.replace('_', ' ')} {100 * share:.0f} %" for share, cause in shares)
    return ", ".join(text for text, (share, _) in zip(said, shares, strict=True) if share >= 0.01)


def mark(check: Check) -> str:
    """Pass, coarse or fail: what a check comes to."""
    return "fail" if not check.agrees else "pass" if check.conclusive else "coarse"


def ranked(checks: Sequence[Check]) -> list[Check]:
    """Checks, the worst first: failed, too coarse, then by deviation over tolerance."""
    return sorted(checks, key=lambda check: (check.agrees, check.conclusive, -check.share))


def findings(verdict: Verdict) -> dict[str, str]:
    """What a verdict's numbers come to: the largest deviation, what they would notice.

    The latter is given by quantity, and left out where only counts are compared."""
    if not verdict.checks:
        return {}
    check = ranked(verdict.checks)[0]
    where = f"{SYMBOLS[check.measurement.quantity]}, {check.measurement.set}"
    found = {"Largest deviation": f"{verdict.worst:.2g} of its tolerance ({where})"}
    if quantity(check.measurement.quantity).resolution == 0:
        found = {"Largest deviation": "none: all equal" if check.agrees else f"not equal: {where}"}
    elif math.isnan(check.predicted):
        found = {"Largest deviation": f"theory knows no such state: {where}"}
    if errors := noticed_errors(verdict.resolving_power):
        found["Would notice"] = errors
    told, planned = verdict.told, verdict.planned
    if told < planned:
        found["Can tell"] = f"{told} of {planned} numbers planned"
    if coarse := len(verdict.checks) - told:
        found["Too coarse to tell"] = str(coarse)
    if verdict.left_out:
        found["Left out by its protocols"] = str(verdict.left_out)
    return found


def noticed_errors(powers: Mapping[str, float]) -> str:
    """In words which errors of theory would be noticed; empty if all are counts."""
    alike: dict[str, list[str]] = {}
    for name, power in powers.items():
        if quantity(name).resolution:
            alike.setdefault(f"{power:.2g}" if power < 1 else "", []).append(SYMBOLS[name])
    blind = ", ".join(alike.pop("", []))
    errors = "; ".join(f"{power} in {', '.join(names)}" for power, names in alike.items())
    parts = [f"a relative error of {errors}"] * bool(errors)
    parts += [f"none in {blind}, which are too coarse"] * bool(blind)
    return "; ".join(parts)


def coarsest(said: EngineVerdict) -> float:
    """The coarsest resolving power of a quantity; nan where all are counts."""
    powers = said.resolving_power.items()
    return max((power for name, power in powers if quantity(name).resolution), default=math.nan)


def engine_outcome(said: EngineVerdict) -> str:
    """In words the outcome by an engine, and to what relative error it confirms."""
    if said.outcome is not Outcome.CONFIRMED:
        return said.outcome
    power = coarsest(said)
    return f"{said.outcome} to {power:.1e}" if math.isfinite(power) else f"{said.outcome} by counts"


def engine_sentence(said: EngineVerdict) -> str:
    """What an engine beside the one on trial says of a claim, in a sentence."""
    if said.outcome in (Outcome.NOT_ASKED, Outcome.ERROR):
        return f"{said.outcome}: {said.reason}"
    order = f", converging with order {said.order:.1f}" if math.isfinite(said.order) else ""
    at = f"; at 2 ms typically off by {percent(said.typical)}, at most {percent(said.farthest)}"
    left_out = f"; {said.left_out} not measured" if said.left_out else ""
    count = len(said.checks)
    numbers = f" on {count} number{'s' if count > 1 else ''}" if count else ""
    errors = f"; would notice {found}" if (found := noticed_errors(said.resolving_power)) else ""
    off = at if math.isfinite(said.farthest) else ""
    why = f"; {said.reason}" if said.reason else ""
    return f"{said.outcome}{numbers}{order}{errors}{off}{left_out}{why}"


def percent(share: float) -> str:
    """A relative deviation with two digits."""
    shown = f"{100 * share:#.2g}".rstrip(".") if share < 0.995 else f"{100 * share:.0f}"
    return f"{shown} %" if share >= 1e-6 else f"{size(100 * share)} %"


def engines(ran: Sequence[Verdict]) -> list[dict[str, Any]]:
    """What each engine says of all claims: how many came out how, its deviations."""
    said = defaultdict[str, list[tuple[Claim, EngineVerdict]]](list)
    for verdict in ran:
        for each in verdict.engines:
            said[each.engine].append((verdict.claim, each))
    rows = []
    for name, own in said.items():
        counts = Counter(each.outcome for _, each in own)
        refuted = [claim for claim, each in own if each.outcome is Outcome.REFUTED]
        off = [each for _, each in own if math.isfinite(each.typical)]
        powers = [coarsest(each) for _, each in own if each.outcome is Outcome.CONFIRMED]
        known = [power for power in powers if math.isfinite(power)]
        row = {
            "engine": name,
            "title": ENGINES[name].title or name,
            "about": ENGINES[name].about,
            "asked": str(len(own) - counts[Outcome.NOT_ASKED]),
            "confirmed": str(counts[Outcome.CONFIRMED]),
            "counted": str(len(powers) - len(known)),
            "to": f"{median(known):.1e}, at worst {max(known):.1e}" if known else "–",
            "refuted": {claim.id: claim.expected is Outcome.REFUTED for claim in refuted},
            "open": str(sum(counts[each] for each in _OPEN)),
            "typical": percent(median(each.typical for each in off)) if off else "–",
            "worst": percent(max(each.farthest for each in off)) if off else "–",
        }
        rows.append(row)
    return rows


QUESTIONS = {
    "mujoco-plain": "What does MuJoCo get right by itself?",
    "mujoco": "What does it get right with Coulomb's law?",
    "mujoco-defaults": "What does it get right as it comes?",
}
"""What a reader who simulates robots wants to know first, by the engine that answers."""


def answers(ran: Sequence[Verdict]) -> list[dict[str, Any]]:
    """The answers of the report's first screen, by engine: how many claims agree, the subjects of
    which all do, and what is wrong."""
    found = {each["engine"]: each for each in engines(ran) if each["asked"] != "0"}
    order = [*(name for name in QUESTIONS if name in found), *found]
    return [found[name] | _subjects(ran, name) for name in dict.fromkeys(order)]


def _subjects(ran: Sequence[Verdict], engine: str) -> dict[str, Any]:
    """A question, and by an engine how much of each subject came out as it should, what is wrong,
    and how many false claims it refutes."""
    outcomes: dict[str, list[bool]] = {}
    wrong, due = [], 0
    for verdict in ran:
        for each in verdict.engines:
            if each.engine == engine and each.outcome is not Outcome.NOT_ASKED:
                right = each.outcome is verdict.claim.expected
                outcomes.setdefault(verdict.claim.section, []).append(right)
                due += right and each.outcome is Outcome.REFUTED
                if each.outcome is Outcome.REFUTED and not right:
                    wrong.append(verdict.claim)
    return {
        "question": QUESTIONS.get(engine, f"What does {engine} get right?"),
        "subjects": [f"{section} {sum(own)}/{len(own)}" for section, own in outcomes.items()],
        "wrong": wrong,
        "due": due,
    }


def headline(ran: Sequence[Verdict]) -> str:
    """All verdicts in a sentence: what failed or is inconclusive, or that all agrees."""
    parts, bad = [], [verdict for verdict in ran if not verdict.passed]
    inconclusive = [verdict.claim.id for verdict in bad if verdict.outcome is Outcome.INCONCLUSIVE]
    failed = [verdict.claim.id for verdict in bad if verdict.outcome is not Outcome.INCONCLUSIVE]
    for what, ids in (
        ("did not come out as expected", failed),
        ("can't be told from what was measured", inconclusive),
    ):
        parts += [f"{len(ids)} of {len(ran)} claims {what}: {few(ids, 4)}"] * bool(ids)
    if parts:
        return "; ".join(parts)
    if not ran:
        return "Nothing has been checked yet"
    name = next((each.engine for verdict in ran for each in verdict.engines), "")
    return f"{ENGINES[name].title or name if name else 'The engine'} agrees with the paper"


def by_kind(ran: Sequence[Verdict]) -> list[tuple[str, str]]:
    """Counts of claims as expected, by kind, and of others; each with what it counts."""
    passed = [verdict for verdict in ran if verdict.passed]
    left = sum(verdict.outcome is Outcome.INCONCLUSIVE and not verdict.passed for verdict in ran)
    counts = {
        "confirmed by measurement": sum(v.outcome is Outcome.CONFIRMED for v in passed),
        "refuted as expected": sum(v.outcome is Outcome.REFUTED for v in passed),
        "not as expected": len(ran) - len(passed) - left,
        "inconclusive": left,
    }
    return [(str(n), what) for what, n in counts.items() if n]


def coarse_and_missing(ran: Sequence[Verdict]) -> str:
    """How many numbers are too coarse or missing, in a sentence; empty if none is."""
    coarse = sum(not check.conclusive for verdict in ran for check in verdict.checks)
    left_out = sum(each.rows for each in {each for verdict in ran for each in verdict.missing})
    parts = [f"{coarse} of these numbers are too coarse to tell"] * (coarse > 0)
    parts += [f"{left_out} more could not be measured"] * (left_out > 0)
    alone = ": an error of theory there alone would go unnoticed."
    return " and ".join(parts) + alone if parts else ""


def totals(ran: Sequence[Verdict]) -> list[tuple[str, str]]:
    """Counts of claims and of numbers by outcome, each with what it counts, in words."""
    checks = [check for verdict in ran for check in verdict.checks]
    within = f"{sum(check.agrees for check in checks)}/{len(checks)}"
    counts = [*by_kind(ran), (within, "numbers within tolerance")]
    if corrected := sum(v.passed and v.claim.text is Text.CORRECTED for v in ran):
        hold = "claims hold" if corrected > 1 else "claim holds"
        counts.append((str(corrected), f"{hold} in a corrected form, see the errata"))
    return counts
