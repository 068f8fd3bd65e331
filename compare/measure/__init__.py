"""Protocols that measure blind, one module each: they know an engine and a parameter set, and nothing of the theory."""
