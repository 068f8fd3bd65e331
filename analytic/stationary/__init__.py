"""Stationary solutions of each case, with forces, existence and stability; the branch of slipping
at both points."""
