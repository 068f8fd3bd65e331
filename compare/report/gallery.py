"""The figures of the report, as the subjects list them."""

import hashlib
import html
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.textpath import text_to_path

from compare import subjects
from compare.campaign.tasks import sources
from compare.campaign.workers import JUDGING, LateError, Spread, at_most
from compare.figures import drawing, style
from compare.figures.drawing import Drawing, Evidence, Figures, GapError
from compare.figures.pictures import embedded, svg
from compare.method.record import Check
from model import InputError, Parameters, StorageError
from model.files import make_directory, write_text

_FRAME = 1e-6, 10.0
"""Deviations, in parts of the tolerance, that are drawn; others stand at the edge."""
_MANY = 100
"""Points beyond which marks are small and hollow."""
_WIDTH, _BELOW = 7.0, 0.48
"""Of a figure of deviations, and of what is below its frame, inches."""
Checks = tuple[Check, ...]
Selected = dict[str, Callable[[], Any]]
"""By name, what gives a figure its data, or raises `GapError`."""

FORMATS = tuple(suffix[1:] for suffix in drawing.SUFFIXES)
PICTURES, CAPTIONS = "figures", "captions.txt"
FIGURES: Figures = {
    name: each for part in subjects.parts("figures") for name, each in part.FIGURES.items()
}
"""Every figure, in the order of the report."""


def figures_of(claim: str) -> Figures:
    """The figures shown with a claim; its deviations, too, unless one bears its name."""
    own = {name: each for name, each in FIGURES.items() if claim in each.claims}
    chosen = partial(measured, claim=claim)
    deviations = Drawing(f"Deviations of {claim}", chosen, draw_deviations, (claim,))
    return own if claim in own else own | {f"claim-{claim}": deviations}


def measured(evidence: Evidence, claim: str) -> Checks:
    """The checks of a claim; `GapError` if none has a tolerance, since counts need no figure."""
    checks = tuple(evidence.checks.get(claim, ()))
    if not any(map(_has_tolerance, checks)):
        raise GapError("nothing with a tolerance was measured")
    return checks


def _has_tolerance(check: Check) -> bool:
    return check.tolerance > 0 and bool(np.isfinite(check.deviation))


def draw_deviations(checks: Checks) -> tuple[Figure, str]:
    """A figure of a claim's deviations, a row for each quantity; and its caption."""
    every, checks = checks, tuple(filter(_has_tolerance, checks))
    names = list(dict.fromkeys(c.measurement.quantity for c in checks))
    engines = list(dict.fromkeys(c.measurement.engine for c in checks))
    height = 0.75 + len(names) * (0.15 + 0.12 * len(engines)) + 0.25 * (len(engines) > 1)
    figure = Figure(figsize=(_WIDTH, height))
    axes = figure.add_subplot()
    for band, grey in ((1, "0.93"), (1 / checks[0].coverage, "0.86")):
        axes.axvspan(_FRAME[0] / 2, band, color=grey, lw=0, zorder=0)
    for k in range(1, len(names)):
        axes.axhline(k - 0.5, color="white", lw=1.5, zorder=0.5)
    _draw_points(axes, checks, names, engines)
    axes.set_yticks(range(len(names)), [style.symbol(name) for name in names])
    label = "|measured − predicted|/tolerance"
    axes.set(xscale="log", xlim=_FRAME, ylim=(len(names) - 0.5, -0.5), xlabel=label)
    axes.minorticks_off()  # of which there would be more than marks
    if len(engines) > 1:
        style.legend(figure, loc="upper center", ncols=4)
    _place(axes, height, above=0.33 if len(engines) > 1 else 0.04)
    return figure, _told_of(every, checks, engines)


def _draw_points(axes: Axes, checks: Checks, names: Sequence[str], engines: Sequence[str]) -> None:
    """Draw a point for each check: rows of quantities, and in each a strip for every engine."""
    row = np.array([names.index(c.measurement.quantity) for c in checks])
    engine = np.array([engines.index(c.measurement.engine) for c in checks])
    # Points are spread vertically against overlap; a single point stays centred.
    kind = row * len(engines) + engine
    alone = np.bincount(kind)[kind] == 1
    spread = np.where(alone, 0.0, (np.arange(len(row)) * 0.618 + 0.5) % 1 - 0.5)
    lanes = row + 1 / len(engines) * (engine + 0.5 + 0.6 * spread) - 0.5
    parts = np.clip([abs(c.deviation) / c.tolerance for c in checks], *_FRAME)
    agrees = np.array([c.agrees for c in checks])
    size: dict[str, Any] = {"ms": 3, "mfc": "none"} if len(checks) > _MANY else {"ms": 4.5}
    for k, name in enumerate(engines):
        look: dict[str, Any] = {"label": name, "ls": "none", "clip_on": False}
        look |= style.mark_of(name) | size
        for own, bad in ((agrees, {}), (~agrees, {"color": style.FORCE, "label": f"_{name}"})):
            own = own & (engine == k)
            axes.plot(parts[own], lanes[own], **look | bad)


def _place(axes: Axes, height: float, above: float) -> None:
    """Place the frame of a figure of deviations, with so much above, inches.

    By hand: there are so many of these figures that a solver of layouts would cost more than
    drawing them."""
    measure, widths = text_to_path.get_text_width_height_descent, []
    for label in axes.get_yticklabels():
        text = label.get_text()
        widths.append(measure(text, label.get_fontproperties(), "$" in text)[0])
    left = 0.15 + max(widths) / 72  # points
    wide, high = _WIDTH - left - 0.16, height - _BELOW - above
    axes.set_position((left / _WIDTH, _BELOW / height, wide / _WIDTH, high / height))


def _told_of(every: Checks, checks: Checks, engines: Sequence[str]) -> str:
    """The caption of a figure of deviations, which shows these of all checks."""
    sets = dict.fromkeys(c.measurement.set for c in checks)
    alone = f"{next(iter(sets))}: {style.named(checks[0].measurement.parameters)}"
    counts = Counter(c.measurement.engine for c in every)
    shown = Counter(c.measurement.engine for c in checks)
    told = ", ".join(
        f"{counts[name]} number{'s' if counts[name] > 1 else ''} of {name}"
        + (f", of which {shown[name]} have a tolerance" if shown[name] < counts[name] else "")
        for name in engines
    )
    return (
        "By how much what was measured differs from what is predicted, in parts of the tolerance: "
        f"{told} ({f'{len(sets)} parameter sets' if len(sets) > 1 else alone}), a strip for each "
        "quantity, and in it one for each engine. Shaded: within tolerance, "
        f"{checks[0].coverage:.1f} standard uncertainties of the numbers of {engines[0]}; darker: "
        f"within one; red: not as predicted. What is less than {_FRAME[0]:g} or more than "
        f"{_FRAME[1]:g} stands at the edge."
    )


def of_set(p: Parameters) -> Selected:
    """For each figure that theory alone can draw, what selects its data for a set."""
    return {name: partial(each.of_set, p) for name, each in FIGURES.items() if each.of_set}


def of_results(evidence: Evidence) -> Selected:
    """For each figure, by name, the function that selects its data from results."""
    return {name: partial(each.select, evidence) for name, each in FIGURES.items()}


def write(
    output: Path, selected: Selected, formats: Sequence[str] = ("svg",)
) -> Iterator[tuple[str, str]]:
    """Write figures to a directory, with captions; yield each name, and why not if so.

    Raises `InputError` for an unknown format, `StorageError` if a file can't be written."""
    for suffix in formats:
        if suffix not in FORMATS:
            known = ", ".join(FORMATS)
            raise InputError(f"no figure can be written as {suffix!r}; there are {known}")
    make_directory(output)
    captions = []
    for name, data in selected.items():
        each = FIGURES[name]
        try:
            figure, caption = each.draw(data())
        except (GapError, StorageError, InputError) as gap:
            yield name, f"not drawn: {gap}"
            continue
        for suffix in formats:
            drawing.save(figure, output / f"{name}.{suffix}")
        captions.append(f"{name}\n{each.title}. {caption}\n")
        yield name, ""
    if captions:
        write_text(output / CAPTIONS, "\n".join(captions))


def pictures(
    evidence: Evidence, drawings: Mapping[str, Drawing], spread: Spread = map
) -> tuple[dict[str, dict[str, str]], str]:
    """For a page: each figure's picture and caption by name, and the letters that they share.

    Each is drawn once, by `spread`, a `map`, and kept with a hash of all that it shows."""
    figures, new = {}, []
    for name, each in drawings.items():
        path = evidence.directory / PICTURES / f"{name}.svg"
        figures[name] = {"id": f"figure-{name}", "title": each.title, "gap": ""}
        try:
            data = each.select(evidence)
        except GapError as error:
            figures[name]["gap"] = str(error)
            continue
        if known := kept(path, each, data):
            figures[name] |= known
        else:
            new.append((path, each, data))
    if new:
        make_directory(evidence.directory / PICTURES)
    new.reverse()  # the last ones take longest
    for (path, *_), found in zip(new, spread(drawn, new), strict=True):
        figures[path.stem] |= found
    whole = {name: of["picture"] for name, of in figures.items() if not of["gap"]}
    made, letters = embedded(whole)
    for name, picture in made.items():
        figures[name]["picture"] = picture
    return figures, letters


def kept(path: Path, drawing: Drawing, data: Any) -> dict[str, str] | None:
    """Picture and caption in an SVG file, if this program made it from the same data."""
    picture = path.read_text("utf-8") if path.is_file() else ""
    if not picture.endswith(mark := _mark(drawing, data)):
        return None
    before, _, caption_on = picture.removesuffix(mark).partition("<desc>")
    caption, _, after = caption_on.partition("</desc>")
    return {"picture": before + after, "caption": html.unescape(caption)}


def drawn(new: tuple[Path, Drawing, Any]) -> dict[str, str]:
    """Draw a figure and write it to its SVG file: picture and caption.

    Where it can't be drawn or written, the reason as a "gap"."""
    path, drawing, data = new
    try:
        with at_most(JUDGING):
            figure, caption = drawing.draw(data)
        picture = svg(figure)
        described = picture.replace("<defs>", f"<desc>{html.escape(caption)}</desc><defs>", 1)
        write_text(path, described + _mark(drawing, data))
    except (GapError, StorageError, LateError) as error:
        return {"gap": str(error)}
    return {"picture": picture, "caption": caption}


def _mark(drawing: Drawing, data: Any) -> str:
    """A comment for the end of an SVG file: a hash of program and data."""
    made_from = "\n".join(
        [repr(data), drawing.title, matplotlib.__version__, sources("model", "analytic", "compare")]
    )
    return f"<!-- {hashlib.sha256(made_from.encode()).hexdigest()} -->"
