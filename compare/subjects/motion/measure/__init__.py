"""The equations of motion, the laws of contact and friction, changes of case and landings."""

from __future__ import annotations

from compare.kit.programme import Protocol
from compare.subjects.motion.measure import laws, motions, runs

PROTOCOLS = (
    Protocol("laws", laws.measure, waits=False, cost=3),
    Protocol("field", motions.field, waits=False),
    Protocol("motions", motions.motions, waits=False),
    Protocol("runs", runs.measure, waits=False),
    Protocol("torque", runs.torque),
    Protocol("impacts", motions.impacts, waits=False),
)
