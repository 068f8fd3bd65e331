"""The numbers of the law, one record that Python and compiled code share."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any

import numpy as np


@dataclass(frozen=True)
class Law:
    """What a `Coulomb` is asked for, and its numbers; docs/records/law.md shows what some of them
    decide."""

    rigid: bool = False
    restitution: tuple[float, ...] = ()
    """Of each geom; two in contact have the larger one, as of friction. None: nothing bounces."""
    kinetic: float = 1.0
    """Friction of contacts that slide, in units of what keeps them from it."""
    servo: float = 0.0
    """Baumgarte stabilisation: time in which soft contacts lose their depth, s; 0: never."""
    share: float = 2e-2
    """Share of gravity to which the slip of contacts, and what rigid ones bear, must be
    predicted."""
    most: int = 20
    """Solutions that a step may take for that."""
    regularisation: float = 1e-3
    """R of a rigid contact, in units of the inverse mass that the engine estimates."""
    push: float = 0.1
    """Share of its depth that a rigid contact loses in a step."""
    depth: float = 1e-5
    """Depth that it keeps at `USUAL_STEP`, in units of the smaller radius; it falls with the square
    of the step. Without any, colliders drop points of what rests."""
    calm: float = 1e-5
    """Acceleration below which the solver starts from none, m s-2 or rad s-2."""
    near: float = 0.01
    """Share of the larger radius up to which two points of contact count as one."""
    fixed: float = 0.1
    """Up to this share of the smaller radius times the angle by which its bodies turn in a step, a
    contact may move on them, beside its creep, and still counts as fixed; what rolls moves more."""
    fast: float = 3.0
    """Slip of a rigid contact, in units of its change in a step, above which it slides on: friction
    opposes its slip in the middle of the step, else that at the end, which may be none."""

    def record(self) -> np.void:
        """The same as an item of `LAW`."""
        values: Any = np.zeros((), LAW)
        values[()] = tuple(getattr(self, name) for name in LAW.names or ())
        return values[()]  # type: ignore[no-any-return]


_KINDS = {"bool": np.bool_, "int": np.int64, "float": np.float64}
_fields = {each.name: str(each.type) for each in dataclasses.fields(Law)}
LAW = np.dtype(
    [(name, _KINDS[kind]) for name, kind in _fields.items() if kind in _KINDS], align=True
)
"""What compiled code reads of it; restitution is an array of the memory."""

CCD_TOLERANCE = 1e-14
"""To which colliders find the points of rigid contacts; MuJoCo's own is 1e-6. Rounding of distances
then leaves points of round sides up to a few nm off."""
DOFS = 60
"""Degrees of freedom of which the solver's tolerance is taken for rigid contacts, where a model has
fewer: it is one of forces, and grows with their number. Where the law has predicted them, the
solver of a few bodies then has mostly nothing to do. (Ten times that of any model lets towers of
128 bricks creep at 1e-8 m/s.)"""
UNMOVED = 1e-6
"""Distance below which a contact is the one of the same number in the last step, m."""
ALIKE, FARTHEST = 0.1, 0.2
"""Part by which the ways of a contact that rolls over its bodies may differ; the longest in a step,
in units of the smaller radius: what goes farther has jumped."""
FASTER = 10.0
"""How much faster a contact may roll over bodies than these turn, without having jumped: on a disc
that leans by 6°."""
AT_MOST = 2.0
"""Depth that a contact has at most when it is new, in units of the way that its bodies close in a
step."""
STILL = 1e-9
"""Most that contacts and bodies may move, m or rad, for their Jacobians to stay as they are."""
FLUSH = 1e-3
"""Most that points of contact may move for that, in units of the smaller radius: those of flush
faces shift."""
ALIGNED = 1e-3
"""By how much the cosine of the angle between normals of one face is less than 1, at most."""
ACROSS = 0.7
"""The cosine between a normal and that of a face below which a point isn't one of that face."""
EDGE = 1e-3
"""How high above a floor the edge of one of its pieces may stand, in units of the smaller radius,
for what slides not to stop there."""
LEVEL = 1e-9
"""Least share of a normal that counts as upwards, for its slope to be a number."""
NARROW = 1e-3
"""Square of the width of a face, in units of its length, below which its points lie on a line."""
APART = 1e9
"""Approach that a contact allows which is open, m s-2."""
EARTH = 9.81
"""Gravity where there is none, m s-2: the scale of small accelerations."""
USUAL_STEP = 2e-3
"""MuJoCo's own time step, s."""
ITERATIONS = 20
"""Iterations of the implicit midpoint rule; each takes the angle of half a step, rad, from the
error, as a factor."""
STEPS = 20
"""Factorisations that Newton's method may take for an island with one R."""
EXACT, ROUGH = 1e-9, 1e-6
"""Part of the forces without contacts to which it solves with the least R, and with others. What is
rougher changes how contacts share a load that they can bear in many ways: 1e-4 moves the speed at
which a wall alone lifts a ball by 1e-4 of it."""
BLOCK = 4
"""Rows that are eliminated from another one at once, in `newton.subtract_block`, which is written
for four."""
FEWER, DECREASE, SHORTEST = 0.5, 1e-4, 1e-3
"""By what a Newton step is shortened; by how much, relative to its length, the residual must fall;
the shortest."""
FORCED = 2
"""Newton steps that may be the shortest although the residual doesn't fall: after more it comes to
no end."""
SOFTER = 128.0
"""How much larger R is in a step that Newton's method solves, which holds forces until contacts
give way no more."""
R_RISES, R_FALLS, R_LEAST = 4.0, 0.5, 2.0**-9
"""Factors of an island's R: where Newton's method comes to no end; after a solution; and all of
them together at least. Powers of two, which are undone exactly."""
NEAR = 0.02
"""Part of `share` from which on R is the least."""
FALLING = 0.1
"""Part to which what they give way must fall by a solution for another one to be tried, when it is
little enough."""
FEEDBACK, STEADIER = 0.5, 2.5e-2
"""`friction.feedback` beyond which errors of predicted slip grow from step to step; part of `share`
to which it must be known there. Velocities of a ball that slides in a corner are then off by up to
5e-4 m/s or rad/s, with 1 by 3e-2."""
OVER = 0.75
"""Part of a time step after which the next one has begun: stages of Runge and Kutta are in one."""
NEXT = 1.5
"""Time steps up to which a step is the next one."""
SLOWEST = 1e-3
"""Slip of a contact that slides at least, in units of what gravity adds in a step: of several that
hold a body one may bear all that it can, and doesn't move."""
STUCK = 100.0
"""Load above which a rigid contact isn't pushed out of its depth, in units of a weight: bodies that
can't part would be pushed for ever, by ever larger forces."""
BOUNCES = 2.0
"""Speed of approach that bounces at least, in units of what the step adds to it without contact."""
