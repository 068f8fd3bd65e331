"""What a result was computed with: versions of packages, and the program's commit."""

import functools
import platform
import subprocess
from collections.abc import Mapping
from pathlib import Path

ABSENT = "not installed"
"""The version of a package that isn't there."""


@functools.cache
def current_versions() -> Mapping[str, str]:
    """Versions of the packages that determine a result, and of Python."""
    versions = {"python": platform.python_version()}
    return versions | {name: version(name) for name in ("dualball", "mujoco", "numpy", "scipy")}


@functools.cache
def version(package: str) -> str:
    """The version of an installed package."""
    # here, because it takes longer to load than the program to say its version
    from importlib import metadata

    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return ABSENT


def absent(package: str) -> str:
    """Says that a package isn't installed, and what to do about it."""
    return f"{package} is {ABSENT}: pip install {package}"


@functools.cache
def current_commit() -> str:
    """The git commit of the checkout the program runs from, ``+`` for local changes, or empty."""
    # Without locks: git leaves them in the checkout if it takes too long and is killed.
    git = "git --no-optional-locks describe --always --dirty=+ --abbrev=40 --exclude=*"
    here = Path(__file__).resolve().parent
    try:
        return subprocess.check_output(
            git.split(), cwd=here, stderr=subprocess.DEVNULL, text=True, timeout=10
        ).strip()
    except (OSError, subprocess.SubprocessError):
        return ""
