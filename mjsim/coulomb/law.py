"""What is remembered of a contact, and the numbers of the law."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

GEOMS, PLACE, NORMAL, GAP, LIFT, BORE, STATE, ERROR, SLIP, SEEN, GUESS, MISS, LOAD, FORCE, SPEED, WIDTH = (
    0, 2, 8, 11, 12, 13, 14, 15, 16, 17, 18, 19, 20, 25, 37, 40
)  # fmt: skip
"""Where in the row of a contact stand: its geoms (2); its place on both, in their axes (6), m; its
normal in the axes of the first (3); its gap, m; the distance that a servo holds, m; what a rigid
one bore in the step before the last, N; whether it was open, stuck or slid; by how much its slip
was not foreseen, m s-2; its slip as foreseen and as found, times the coefficient of friction, m
s-2; of one that slides that from velocities and the accelerations of the step before alone, and
what is added, the mean of what was and of what that missed, m s-2; what its normal, or each pair of
a pyramid's edges, bears (5), N; force and moment of friction in the axes of both geoms (geom; axis;
force, moment; 12), N and N m; the velocity that its last Jacobian gives to the present speeds, in
world axes (3), m s-1."""
NEW, OPEN, STICKS, SLIDES = range(4)

UNMOVED = 1e-6
"""Distance below which a contact is the one of the same number in the last step, m."""
STILL = 1e-9
"""Most that contacts and bodies may move, m or rad, for what depends on their poses to stay as it
is."""
APART = 1e9
"""Approach that a contact allows which is open, m s-2."""
USUAL = 2e-3
"""MuJoCo's own time step, s."""
ITERATIONS = 20
"""Iterations of the implicit midpoint rule; each takes the angle of half a step, rad, from the
error, as a factor."""
CORNER = 1.05 * math.pi
"""Angle without other points of its patch that a corner of the patch sees at least."""


@dataclass(frozen=True)
class Law:
    """The numbers of the law; docs/friction.md has the table that decided each."""

    rigid: bool = False
    restitution: float = 0.0
    servo: float = 0.0
    """Time in which contacts lose their depth, s; 0: never."""
    share: float = 5e-2
    """Share of gravity to which the slip of contacts, and what rigid ones bear, must be
    foreseen."""
    most: int = 20
    """Solutions that a step may take to foresee them."""
    softness: float = 1e-3
    """R of a rigid contact, in units of the inverse mass that the engine estimates."""
    push: float = 0.1
    """Share of its depth that a rigid contact loses in a step."""
    depth: float = 1e-5
    """Depth that it keeps at `USUAL`, in units of the smaller radius; it falls with the square of
    the step. Without any, colliders drop points of what rests."""
    calm: float = 1e-5
    """Acceleration below which the solver starts from none, m s-2 or rad s-2."""
    near: float = 0.01
    """Share of the larger radius up to which two points of contact count as one."""
    fixed: float = 0.1
    """Share of what their turning moves the smaller radius up to which a contact that moves on its
    bodies, but for its creep, is fixed on them; what rolls isn't."""
    fast: float = 3.0
    """Slip of a rigid contact, in units of its change in a step, above which it slides on: friction
    opposes its slip in the middle of the step, else that at the end, which may be none."""


def free_bodies(model: Any) -> npt.NDArray[np.int64]:
    """Bodies that nothing joins to others, and the first degree of freedom of each, (n, 2)."""
    last = model.jnt_dofadr[model.jnt_type == 0] + 5
    alone = last[~np.isin(last, model.dof_parentid)]
    return np.column_stack((model.dof_bodyid[alone], alone - 5)).astype(np.int64)
