"""Which case is it? The case told from MuJoCo's slip speeds and forces, against that of the event-driven simulation.

A few motions visit all nine cases. They are cut into short pieces: at the start of each, MuJoCo takes over the state of
the event-driven run, so that what is compared is how cases are told and followed, not how far two motions come apart.
A dead time around each change of case is left out: that in which friction builds up and persistence is waited for.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from compare.claims import Check, Claim, Lab, Level
from compare.studies import Bench, main
from compare.tasks import Task
from mjsim import ContactSettings
from mjsim.classify import PERSISTENCE
from mjsim.measurement import Measured
from model import Case, Parameters, Trajectory

ID = "cases"
STEP = 2.5e-4
"""Time step and interval between samples, s."""
LASTS = 0.4
"""Duration of each motion, s."""
PIECES = {Level.QUICK: 16, Level.DEFAULT: 20, Level.FULL: 40}
"""Into how many pieces each is cut."""
DEAD = 5 + PERSISTENCE
"""Steps left out after a start and on both sides of a change of case: five in which a slip dies out (three) and forces
reach the new case's, and what the classifier waits for."""
FASTEST = 2.0
"""Slip speed for which the contacts are set, m s-1."""
SLACK = 0.02
"""Share of samples that may differ: the moment of a change moves by what the motion before it is off by."""

_ROUGH = Parameters.named("reference").replace(eta=0.6)
MOTIONS: tuple[tuple[Parameters, tuple[float, ...]], ...] = (
    # Falls from mid-air onto the floor, slides, rolls outwards to the wall, hops, slips at both points, sticks.
    (_ROUGH.replace(omega_0=12.0), (0.022, 0.042, 33.0, 39.6, 8.5, 1.5, 0.034, 0.178)),
    # Slides on the floor, rolls, rides the wall without slip, and comes down through SS and SR.
    (_ROUGH.replace(omega_0=14.5), (0.0, 0.0, -22.669, -0.266, 27.136, -7.88, 0.015, -0.085)),
    # Long stays in the cases that those pass in a moment: spun up from rest (RS), slipping at both points (SS),
    # a ball that spins on the wall and on the floor (SR), and one that slips down the wall (NS).
    (Parameters.named("reference").replace(omega_0=20.0), (0.0,) * 8),
    (Parameters.named("reference").replace(omega_0=25.0), (0.0, 0.0, 14.3, -1.0, 2.0, 7.0, 0.0, 0.0)),
    (_ROUGH.replace(omega_0=15.0), (0.0, 0.0, 15.0, 20.0, 0.0, 0.0, 0.0, 0.0)),
    (Parameters.named("reference").replace(omega_0=25.0), (0.5, 0.0, 25.0, 0.0, 10.0, 10.0, 0.0, 0.0)),
)


@dataclass(frozen=True)
class Piece:
    """A part of a motion, run again by MuJoCo from its first state."""

    motion: int
    first: int
    """Sample of the motion at which it starts."""
    task: Task


def pieces(motions: list[Trajectory], count: int) -> list[Piece]:
    """Equal parts of motions sampled every `STEP`."""
    samples = round(LASTS / STEP) // count
    cut = []
    for k, run in enumerate(motions):
        p = run.header.parameters
        settings = ContactSettings.for_problem(p, STEP, FASTEST)
        for first in range(0, samples * count, samples):
            x0 = tuple(run.x[first].tolist())
            task = Task(
                engine="mujoco", parameters=p, x0=x0, t_end=samples * STEP, settings=settings, sample_interval=STEP
            )
            cut.append(Piece(k, first, task))
    return cut


def alive(run: Trajectory) -> npt.NDArray[np.bool_]:
    """The samples of an event-driven motion that lie outside every dead time, shape (n,)."""
    since = run.time[:, None] - run.events.time
    return np.asarray(~np.any(np.abs(since) < DEAD * STEP, axis=-1))


def confusion(motions: list[Trajectory], cut: list[Piece], runs: list[Trajectory]) -> npt.NDArray[np.intp]:
    """Samples outside dead times by case of the event-driven motion (row) and case told (column), shape (9, 9)."""
    counts = np.zeros((len(Case), len(Case)), dtype=np.intp)
    outside = [alive(run) for run in motions]
    for piece, run in zip(cut, runs, strict=True):
        part = slice(piece.first + DEAD, piece.first + len(run.time) - 1)
        use = outside[piece.motion][part]
        np.add.at(counts, (motions[piece.motion].case[part][use], run.case[DEAD:-1][use]), 1)
    return counts


def _study(lab: Lab) -> list[Check]:
    whole = [
        Task(engine="event", parameters=p, x0=x0, t_end=LASTS, sample_interval=STEP) for p, x0 in MOTIONS
    ]  # fmt: skip
    motions = lab.run(whole)
    cut = pieces(motions, PIECES[lab.level])
    counts = confusion(motions, cut, lab.run([piece.task for piece in cut]))
    bench, found = Bench(lab, "reference, η = 0.6"), []
    for row, told in zip(Case, counts, strict=True):
        for column in Case:
            share = float(told[column] / told.sum()) if told.sum() else 0.0
            if row is column or share:
                expected = 1.0 if row is column else 0.0
                where = f"{row.name} told as {column.name}, {told.sum()} samples"
                found.append(bench.number(cut[0].task, "share", "1", where, expected, Measured(share, SLACK / 3)))
    return found


CLAIMS = (
    Claim(
        id=ID, source="Fig. 2, Table 3",
        statement="Slip speeds and normal forces at the two points tell all nine kinematic cases apart.",
        prediction="the case of the event-driven simulation",
        measurement=(
            "the case told from MuJoCo's forces and slip speeds, sampled every step, in pieces of motions that "
            "visit all nine cases"
        ),
        tolerance=(
            f"{SLACK:g} of the samples of a case, outside a dead time of {DEAD} steps on both sides of a change"
        ),
        study=_study,
    ),
)  # fmt: skip

if __name__ == "__main__":
    sys.exit(main(CLAIMS))
