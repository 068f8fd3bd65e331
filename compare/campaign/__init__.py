"""Runs as tasks: each is carried out once, by any number of workers, and kept in sealed files."""
