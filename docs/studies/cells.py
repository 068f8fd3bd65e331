"""What pages with cells share: commands that print as in a terminal."""

from __future__ import annotations

import os
import subprocess
from typing import Any


def shell(command: str) -> None:
    """Print what a command prints, and its messages if it fails."""
    plain = os.environ | {"FORCE_COLOR": ""}  # which notebooks set
    done = subprocess.run(command, shell=True, text=True, capture_output=True, env=plain)
    print(done.stdout + (done.stderr if done.returncode else ""), end="")


def use_in(notebook: Any) -> None:
    """Let lines that begin with an exclamation mark be carried out so."""
    notebook.system = shell
