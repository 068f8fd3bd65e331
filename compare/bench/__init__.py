"""Engines beside each other: grades of a person's settings, and the league."""
