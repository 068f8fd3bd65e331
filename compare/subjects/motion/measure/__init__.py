"""The equations of motion, the laws of contact and friction, changes of case and landings."""

from __future__ import annotations

from compare.kit.programme import LAWS, ONE, TWO, Protocol
from compare.subjects.motion.measure import laws, motions, runs

PROTOCOLS = (
    Protocol("laws", laws.measure, waits=False, cost=3),
    Protocol("field", motions.field, waits=False),
    Protocol("motions", motions.motions, quick=ONE, waits=False),
    Protocol("runs", runs.measure, quick=LAWS, waits=False),
    Protocol("torque", runs.torque, quick=ONE),
    Protocol("impacts", motions.impacts, quick=TWO, waits=False),
)
