"""Simulation across all cases: event-driven, and by Moreau-Jean time stepping."""
