"""What a figure is: what it selects from the results, how that is drawn, and its caption."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from compare.claims.claim import Verdict
from compare.measure.check import Check
from compare.measure.record import Measurement, Records
from model import Trajectory, storage

if TYPE_CHECKING:  # it takes half a second to load, and much that hands over material never draws
    from matplotlib.figure import Figure

    from compare.scorecard.league import Entry


@dataclass(frozen=True)
class Motion:
    """A trajectory handed to a figure, by a name that stands for its content; it is read only to be drawn."""

    name: str
    load: Callable[[], Trajectory] = field(repr=False, compare=False)


@dataclass(frozen=True)
class Material:
    """What figures are made of: verdicts, measurements, and run files; without any, theory alone is drawn."""

    verdicts: tuple[Verdict, ...] = ()
    records: Records = Records()
    directory: Path = Path()
    """The results directory, where names of run files begin."""
    ladder: tuple[Entry, ...] = ()
    """What is reached under settings that each have one thing more than the one before."""
    frontier: tuple[Entry, ...] = ()
    """What methods reach, with their cost."""

    @cached_property
    def by_claim(self) -> Mapping[str, Verdict]:
        """The verdicts by the id of their claim."""
        return {verdict.claim.id: verdict for verdict in self.verdicts}

    def checks(self, *claims: str) -> tuple[Check, ...]:
        """All checks of some claims."""
        return tuple(c for name in claims if name in self.by_claim for c in self.by_claim[name].checks)

    def select(self, quantity: str, **conditions: Any) -> Iterator[Measurement]:
        """Measurements of a quantity that have the given conditions; None stands for any value."""
        for m in self.records.measurements:
            if m.quantity == quantity and all(
                name in m.conditions and value in (None, m.conditions[name]) for name, value in conditions.items()
            ):
                yield m

    def motions(self, m: Measurement) -> list[Motion]:
        """The runs of a measurement whose files are there."""
        paths = [self.directory / name for name in m.runs]
        return [
            Motion(name, lambda path=path: storage.load(path))  # type: ignore[misc]
            for name, path in zip(m.runs, paths, strict=True)
            if path.is_file()
        ]


class GapError(Exception):
    """Why a figure can't be drawn, in a sentence for the reader."""


@dataclass(frozen=True, kw_only=True)
class Drawing:
    """One figure: a record of the registry."""

    title: str
    select: Callable[[Material], Any]
    """All that is drawn, as data whose repr tells it apart; raises `GapError` where results are missing."""
    draw: Callable[[Any], Figure]
    caption: Callable[[Any], str]
    """What is shown, with the parameters."""
    claims: tuple[str, ...] = ()
    """The claims beside which it stands."""
    background: bool = False
    """Whether it explains the model rather than showing results."""
