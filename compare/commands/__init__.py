"""The commands."""

import compare.kit  # noqa: F401  (it says so where somebody else's `model` is in the way)
