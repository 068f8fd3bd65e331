"""Exact contact cases, engines on trial on them, and the league."""

from compare.bench.case import read
from compare.bench.exact import cases
from compare.bench.runner import Result, run

__all__ = ["Result", "cases", "read", "run"]
