"""Stability with respect to slipping and lifting: growth rates, and where slip sets in."""
