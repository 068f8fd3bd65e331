"""The equations of motion, the laws of contact and friction, changes of case and landings."""

from __future__ import annotations

from compare.kit.programme import Protocol
from compare.subjects.motion.measure import laws, motions, runs

PROTOCOLS = (
    Protocol("laws", laws.measure),
    Protocol("field", motions.field),
    Protocol("motions", motions.motions),
    Protocol("runs", runs.measure),
    Protocol("torque", runs.torque),
    Protocol("impacts", motions.impacts),
)
