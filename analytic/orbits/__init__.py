"""Motions that are not stationary: periodic orbits, their branches, and the attractors that balls
come to."""
