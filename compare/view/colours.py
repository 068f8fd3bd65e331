"""Colours of pictures and films beside those of the cases."""

from __future__ import annotations

FORCE, SLIP, BALL, INK = "#b3261e", "#6a3d9a", "#f5cc6b", "#1c2430"
"""Arrows of force and slip, the ball, text."""


def rgb(colour: str) -> tuple[float, float, float]:
    """Red, green and blue, 0 to 1, of a colour like "#b3261e"."""
    red, green, blue = (int(colour[k : k + 2], 16) / 255 for k in (1, 3, 5))
    return red, green, blue
