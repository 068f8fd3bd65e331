"""Stationary solutions of each case, their forces, existence, stability; the branch of SS."""
