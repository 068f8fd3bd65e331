"""Motions that are not stationary: periodic orbits, their branches, and attractors."""
