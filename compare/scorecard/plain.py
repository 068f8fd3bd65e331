"""Data as JSON can hold it."""

from __future__ import annotations

import math
from typing import Any


def without_nan(value: Any) -> Any:
    """Nested data with lists for tuples and None for nan."""
    if isinstance(value, dict):
        return {name: without_nan(part) for name, part in value.items()}
    if isinstance(value, list | tuple):
        return [without_nan(part) for part in value]
    return None if isinstance(value, float) and math.isnan(value) else value
