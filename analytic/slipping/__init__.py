"""Stability with respect to slipping and lifting: growth rates, and the flows at which slip sets
in."""
