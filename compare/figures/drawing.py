"""What a figure is: what it selects from the results, how that is drawn, and its caption."""

from __future__ import annotations

import io
import textwrap
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from analytic.flowmeter import real_fluid
from compare.figures.validity import model_warning
from compare.method.record import Check, Measurement, Records
from model import Parameters, Trajectory, storage
from model.files import write_bytes, write_text

if TYPE_CHECKING:  # it takes half a second to load, and much that hands it over never draws
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class DrawnMotion:
    """A trajectory for a figure, by a name that stands for its content."""

    name: str
    engine: str
    p: Parameters
    load: Callable[[], Trajectory] = field(repr=False, compare=False)


@dataclass(frozen=True)
class Evidence:
    """What a validation leaves for figures: judged numbers, measurements, run files."""

    checks: Mapping[str, Sequence[Check]] = field(default_factory=dict)
    """By the id of the claim on which they bear."""
    records: Records = Records()
    directory: Path = Path()
    """The results directory, where names of run files begin."""
    others: Records = Records()
    """What other engines measured at steps that users take."""

    def select(self, quantity: str, *conditions: str) -> Iterator[Measurement]:
        """Measurements of a quantity, by all engines, that have conditions so named."""
        named = set(conditions)
        measured = (*self.records.measurements, *self.others.measurements)
        return (m for m in measured if m.quantity == quantity and named <= m.at.keys())

    def motions(self, m: Measurement) -> list[DrawnMotion]:
        """The runs of a measurement whose files are there."""
        paths = [(name, self.directory / name) for name in m.runs]
        return [
            DrawnMotion(name, m.engine, m.parameters, partial(storage.load, path))
            for name, path in paths
            if storage.exists(path)
        ]


@dataclass(frozen=True)
class Diagram:
    """What most figures show: a parameter set, what was measured with it, and its runs."""

    figure: str
    p: Parameters
    states: tuple[Measurement, ...] = ()
    motions: tuple[DrawnMotion, ...] = ()
    checks: tuple[Check, ...] = ()


class GapError(Exception):
    """Why a figure can't be drawn, in a sentence for the reader."""


def only_where(p: Parameters, folds: bool) -> None:
    """Raise `GapError` unless eta < j in a set, if a figure shows folds, or else eta > j."""
    if (p.eta < p.j) != folds:
        raise GapError(f"it is for η {'<' if folds else '>'} j, here η = {p.eta:g} and j = {p.j:g}")


@dataclass(frozen=True)
class Drawing:
    """One figure: a record of the registry."""

    title: str
    select: Callable[[Evidence], Any]
    """All that is drawn, as data whose repr tells it apart; raises `GapError`."""
    draw: Callable[[Any], tuple[Figure, str]]
    """The figure, and its caption: what is shown, with the parameters."""
    claims: tuple[str, ...] = ()
    """The claims beside which it stands."""
    of_set: Callable[[Parameters], Any] | None = None
    """The same of another set, by theory alone; `draw` may raise `GapError`."""


_Rows = Callable[[Evidence], Iterable[Measurement]]
"""What a figure shows of what was measured, by all engines on all sets."""


def diagram(
    name: str,
    title: str,
    set: str,
    draw: Callable[[Diagram], tuple[Figure, str]],
    claims: tuple[str, ...],
    measured: _Rows | None = None,
) -> Drawing:
    """The figure of a `Diagram`: of one set with measurements, of others without."""
    chosen = partial(select, name, set, measured)
    return Drawing(title, chosen, partial(_doubted, draw), claims, partial(Diagram, name))


def _doubted(draw: Callable[[Diagram], tuple[Figure, str]], of: Diagram) -> tuple[Figure, str]:
    """A figure of a set and its caption, both with a warning if the model doesn't hold for it."""
    figure, caption = draw(of)
    return figure, " ".join([caption, *warn_of(figure, real_fluid.model_error(of.p))])


def warn_of(figure: Figure, off: float) -> list[str]:
    """Write the warning of `model_warning` above a figure, and return it."""
    doubts, above = model_warning(off), figure.get_suptitle()
    if doubts:
        lines = textwrap.wrap(doubts[0], round(13 * figure.get_figwidth()))
        figure.suptitle("\n".join([above, *lines] if above else lines), fontsize=9)
    return doubts


def select(name: str, set: str, measured: _Rows | None, evidence: Evidence) -> Diagram:
    """What a figure shows of one set: what was measured with it, and the runs that are there."""
    states = tuple(m for m in measured(evidence) if m.set == set) if measured else ()
    motions = tuple(run for m in states for run in evidence.motions(m))
    return Diagram(name, Parameters.named(set), states, motions)


SUFFIXES = (".svg", ".pdf", ".png")
"""Of the files that figures are written to."""


def save(figure: Figure, path: Path) -> None:
    """Write a figure to a file, as its name says: `SUFFIXES`; equal figures make equal files.

    Raises `StorageError` if it can't be written."""
    suffix = path.suffix.lower()
    if suffix == ".svg":
        from compare.figures.pictures import svg  # here, because drawing takes a second to load

        return write_text(path, svg(figure))
    out = io.BytesIO()
    metadata = {"CreationDate": None} if suffix == ".pdf" else {}
    figure.savefig(out, format=suffix[1:], dpi=200, metadata=metadata)
    write_bytes(path, out.getvalue())


Figures = dict[str, Drawing]
"""Figures by their file names."""
