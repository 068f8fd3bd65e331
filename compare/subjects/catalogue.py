"""All protocols, and all claims in the order of the report, as the subjects list them."""

from dataclasses import replace

from compare import subjects
from compare.method.protocol import Protocol
from compare.verification.claim import Claim

PROTOCOLS: tuple[Protocol, ...] = tuple(
    protocol for each in subjects.parts("measure") for protocol in each.PROTOCOLS
)
"""Every protocol there is; each goes out only from those before it."""
_SECTIONS: dict[str, list[Claim]] = {}
for _each in subjects.parts("claims"):
    for _section, _claims in _each.SECTIONS.items():
        _SECTIONS.setdefault(_section, []).extend(_claims)
CLAIMS = tuple(
    replace(claim, section=section) for section, claims in _SECTIONS.items() for claim in claims
)
"""Every claim there is."""
