"""The subjects of the study: a folder each with `measure`, `claims`, `figures`; and their order.

To take one out, remove both."""

from importlib import import_module
from importlib.util import find_spec
from types import ModuleType

NAMES = (
    "stationary",
    "thresholds",
    "regions",
    "stability",
    "flowmeter",
    "motion",
    "slipping",
    "attractors",
    "unsteady",
)
"""In the order of the report; each measures only after those before it."""


def parts(part: str) -> list[ModuleType]:
    """The modules `measure`, `claims` or `figures` of all subjects that have them."""
    modules = (f"{__name__}.{name}.{part}" for name in NAMES)
    return [import_module(module) for module in modules if find_spec(module)]
