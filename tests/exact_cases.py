"""The exact cases by name, simulated when a test first asks for one: to collect tests takes none of
them."""

import json
from importlib import resources

from compare.bench import cases
from compare.bench.case import ContactCase

LISTED = json.loads(
    (resources.files("compare.bench") / "templates" / "cases.json").read_text("utf-8")
)


class Cases(dict[str, ContactCase]):
    def __missing__(self, name: str) -> ContactCase:
        self.update({case.name: case for case in cases()})
        return dict(self)[name]


CASES = Cases()
