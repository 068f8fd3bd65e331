"""What pages with cells share: commands that print as in a terminal."""

from __future__ import annotations

import os
import subprocess
from typing import Any

REFUSED = "# is refused"
"""How a line ends that shows a mistake."""


def shell(command: str) -> None:
    """Print what a command prints, and its messages if it fails; a mistake in it is an error."""
    plain = os.environ | {"FORCE_COLOR": ""}  # which notebooks set
    done = subprocess.run(command, shell=True, text=True, capture_output=True, env=plain)
    if (done.returncode == 2) != command.endswith(REFUSED):
        raise RuntimeError(f"{command}: exit code {done.returncode}\n{done.stderr}")
    print(done.stdout + (done.stderr if done.returncode else ""), end="")


def use_in(notebook: Any) -> None:
    """Let lines that begin with an exclamation mark be carried out so."""
    notebook.system = shell
