"""The equations of motion, the laws of contact and friction, changes of case and landings."""

from __future__ import annotations

from compare.kit.programme import FOUR, LAWS, ONE, TWO, Protocol
from compare.subjects.motion.measure import laws, motions, runs

PROTOCOLS = (
    Protocol("laws", laws.measure, plain=ONE, waits=False, cost=3),
    Protocol("field", motions.field, plain=FOUR, waits=False),
    Protocol("motions", motions.motions, quick=ONE, plain=ONE, waits=False),
    Protocol("runs", runs.measure, quick=LAWS, plain=ONE, waits=False),
    Protocol("torque", runs.torque, quick=ONE),
    Protocol("impacts", motions.impacts, quick=TWO, plain=ONE, waits=False),
)
