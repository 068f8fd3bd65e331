"""Thresholds of the flow at which stationary solutions appear, vanish or change stability."""
