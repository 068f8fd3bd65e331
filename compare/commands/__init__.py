"""The commands."""

import compare.engines  # noqa: F401  (it says so where somebody else's `model` is in the way)
