"""A forecast in words, tables and as a page."""

import itertools
import math
from collections.abc import Iterator

from compare.bench.advice import FAULTS
from compare.bench.contact_law import FAINT
from compare.bench.forecast import SHOWN, Forecast
from compare.bench.settled import NOISE
from compare.figures import pages
from model.errors import few

SLIGHT = 0.05  # share of Coulomb's friction that a pyramid may lack without a word
CREEP_OFF = 0.05  # share of the predicted creep by which the measured one may differ without a word
Table = tuple[str, list[list[str]]]  # its title and its rows, a head first


def _cures(f: Forecast) -> Iterator[str]:
    """What to do, and what was found when it was tried."""
    if f.change:
        name, factor, unit = FAULTS[f.change.quantity]
        endless = "any" if f.change.quantity == "largest_step" else "∞"
        before, after, found = (
            _number(v, factor, endless) for v in (f.change.before, f.change.after, f.change.found)
        )
        done = "" if found == "–" else f" Measured: {found} {unit}."
        yield (
            f"Set {f.change.written}: where {f.change.pair} touch, the {name} goes from "
            f"{before} to {after} {unit}.{done}"
        )
    if f.remedy:
        yield (
            f"{'That alone does not cure' if f.change else 'No single option cures'} the creep. "
            "Step with mjsim.Coulomb: what friction can hold then stays. Creep 0, depth as it is; "
            "what it costs is not forecast."
        )


def sentences(f: Forecast) -> Iterator[str]:
    """A forecast in sentences: what to do, what was found, what else one should know."""
    yield from _cures(f)
    short = {p.name: f"{p.name} by {100 * p.short:.0f} %" for p in f.pairs if p.short > SLIGHT}
    sliding = [p.name for p in f.pairs if p.slides and p.name not in short]
    rattling = [p.name for p in f.pairs if p.moves]
    moving = [*f.settled.moving.values()]
    if sliding:
        yield (
            f"Friction is used up, so these slide: {few(sliding)}. No setting but more friction "
            "holds them."
        )
    if short:
        yield (
            "Loaded, or sliding, off the axes of MuJoCo's friction pyramid, where it is weaker "
            f'than Coulomb\'s cone: {few([*short.values()])}. cone="elliptic" has friction in full.'
        )
    if slips := [p.name for p in f.pairs if p.slides and p.name in short]:
        yield f"These slide, though friction in full may hold them: {few(slips)}."
    if lost := [p.name for p in f.pairs if p.slides and p.creep_measured > p.hover]:
        yield f"These slide so fast that contact is lost again and again: {few(lost)}."
    if off := [
        p.name for p in f.pairs if abs(p.creep_measured - p.creep) > CREEP_OFF * p.creep + NOISE
    ]:
        yield (
            f"Creep is not what was predicted at {few(off)}: not settled yet, or the solver "
            "stops early (tolerance)."
        )
    if f.settled.collapsed:
        yield (
            f"Collapsed since the start: {few(f.settled.collapsed)}. The table is of how it lies. "
            "To hold it up: --ctrl, --keyframe, or in Python a step of your own."
        )
    if moving:
        yield f"Not settled: {few(moving)}."
    elif not f.settled.steady:
        yield (
            "Speeds still change, slowly: loads, and what is forecast from them, are means over "
            "a second."
        )
    if rattling:
        yield (
            "Nothing is forecast, and what is shown are means, where bodies move or lose "
            f"contact: {few(rattling)}."
        )
    if not (f.change or f.remedy or sliding or short or moving or rattling or f.settled.collapsed):
        yield "Nothing needs to change."
    yield from _worth_knowing(f)


def _worth_knowing(f: Forecast) -> Iterator[str]:
    """What else one should know of a model: what sleeps, is jammed, is replaced, is left out."""
    if f.settled.asleep:
        yield (
            "MuJoCo puts to sleep, so that nothing creeps till it wakes: "
            f"{few(f.settled.asleep)}. Forecast awake."
        )
    if stuck := [p.name for p in f.pairs if not p.parts]:
        yield (
            "No joint can part these; they bear what the overlap they were built with asks for: "
            f"{few(stuck)}."
        )
    for kind in dict.fromkeys(kind for p in f.pairs for kind in p.replaced):
        those = [p for p in f.pairs if kind in p.replaced]
        more = f", and at {len(those) - 1} more" if len(those) > 1 else ""
        yield f"MuJoCo replaces {kind} at {those[0].name}{more}: {those[0].replaced[kind]}."
    if math.isfinite(f.largest_step):
        yield (
            f"The contacts are stable up to a step of {1e3 * f.largest_step:.3g} ms (now "
            f"{1e3 * f.timestep:g} ms)."
        )
    if f.flexible:
        yield f"{f.flexible} contacts of flexible bodies are left out."


def _number(value: float, factor: float = 1, endless: str = "any") -> str:
    """A number times a factor: three digits, 0 for next to nothing, `endless` for inf."""
    value *= factor
    if not math.isfinite(value):
        return endless if math.isinf(value) else "–"
    if abs(value) < 1e-3:
        return "0"
    return f"{value:.0f}" if 1e3 <= abs(value) < 1e6 else f"{value:.3g}"


def tables(f: Forecast, after: Forecast | None = None, held: Forecast | None = None) -> list[Table]:
    """Tables of the worst pairs at rest and in motion; what was measured is called found.

    Then what the change was made for, and the creep with the remedy, if these are given."""
    rest = [["pair", "creep\nµm/s", "found\nµm/s", "turning\nµrad/s", "found\nµrad/s"]]
    rest[0] += ["depth\nµm", "found\nµm", "load\nN", "cone\n%", "short\n%"]
    motion = [["pair", "hover\nmm/s", "step\nms"]]
    for p in f.pairs[:SHOWN]:
        micro = p.creep, p.creep_measured, p.turning, p.turning_measured, p.depth, p.depth_measured
        shares = _number(p.cone, 100), _number(p.short, 100)
        rest.append([p.name, *(_number(v, 1e6, "∞") for v in micro), _number(p.load), *shares])
        motion.append([p.name, _number(p.hover, 1e3), _number(p.largest_step, 1e3)])
    title = f"Pairs in contact: {len(f.pairs)}"
    title += f", of which the {SHOWN} worst" if len(f.pairs) > SHOWN else ""
    shown = [(title, _without_empty_columns(rest)), ("In motion", _without_empty_columns(motion))]
    if after and f.change:
        _, changed = tables(after)[f.change.quantity == "largest_step"]
        shown.append((f"With {f.change.written}", changed))
    if held:
        shown.append(("With mjsim.Coulomb", tables(held)[0][1]))
    return shown


def _without_empty_columns(rows: list[list[str]]) -> list[list[str]]:
    """A table without the columns in which there is nothing."""
    there = [any(cell != "–" for cell in column[1:]) for column in zip(*rows, strict=True)]
    return [[*itertools.compress(row, there)] for row in rows]


def snippets(f: Forecast, file: str) -> list[tuple[str, str]]:
    """What makes a model's file better: what it is, and text to paste."""
    mjcf = [("MJCF, within <mujoco>", f.change.mjcf)] if f.change else []
    program = f"""\
import mujoco
import mjsim

model = mujoco.MjModel.from_xml_path({file!r})
data = mujoco.MjData(model)
{f.remedy}"""
    return mjcf + ([("Python", program)] if f.remedy else [])


LEGEND = (
    "Creep: speed at which what should rest slides on; turning: the same of spinning and rolling "
    "friction. Depth: how far bodies sink into one another. Each is predicted from the load of a "
    "contact and its parameters. Found: measured beside it, from where bodies are after the next "
    "tenth of a second, or a second where speeds still change or contact is lost.",
    "Cone: share of the friction that a contact can bear which it needs; beyond 100 % it slides. "
    "Short: share of Coulomb's friction that the pyramid lacks in the direction of the load or "
    "slip. Hover: slip speed from which a sliding contact is lost again and again. Step: largest "
    "time step at which small motions die out; “any” if it is a second or more.",
    f"–: it slides, moves on, or has no such friction. A contact that bears less than {FAINT:.1%} "
    "of the weight of its lighter body counts as none. #2: a geom without a name, by its number.",
)
"""What the columns of the tables mean."""


def html(f: Forecast, after: Forecast | None, held: Forecast | None, file: str) -> str:
    """The forecast, and those after the change and with the remedy, as one self-contained page."""
    shown = tables(f, after, held)
    said = {"sentences": list(sentences(f)), "paste": snippets(f, file), "legend": LEGEND}
    return pages.render("compare.bench", "forecast.html", file=file, tables=shown, **said)
