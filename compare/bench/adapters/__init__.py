"""Engines that take exact cases; each module is one, see `compare.bench.runner`."""
