"""What pages with cells share: commands that print as in a terminal."""

import contextlib
import io
import os
import re
import shlex
import subprocess
from typing import Any
from unittest import mock

from compare.commands import cli

REFUSED = "# is refused"
"""How a line ends that shows a mistake."""


def shell(command: str) -> None:
    """Print what a command prints, and its messages if it fails; a mistake in it is an error.

    `dualball` is carried out in this process, in which its packages are loaded once."""
    own, *rest = re.split(r" (?=[|>] )", command, maxsplit=1)
    if own.startswith("dualball "):
        code, out, said = _dualball(shlex.split(own, comments=True)[1:])
        piped = subprocess.run(["sh", "-c", " ".join(["cat", *rest])], input=out, **_TEXT)
        out = piped.stdout
    else:
        done = subprocess.run(["sh", "-c", command], **_TEXT)
        code, out, said = done.returncode, done.stdout, done.stderr
    if (code == 2) != command.endswith(REFUSED):
        raise RuntimeError(f"{command}: exit code {code}\n{said}")
    print(out + (said if code else ""), end="")


_TEXT: dict[str, Any] = {"text": True, "capture_output": True}


def _dualball(words: list[str]) -> tuple[int, str, str]:
    """Exit code, output and messages of the program, plain as in a file."""
    out, said = io.StringIO(), io.StringIO()
    with (
        mock.patch.dict(os.environ, {"FORCE_COLOR": ""}),  # which notebooks set
        mock.patch("rich.console._is_jupyter", return_value=False),
        contextlib.redirect_stdout(out),
        contextlib.redirect_stderr(said),
    ):
        code = cli.main(words)
    return code, out.getvalue(), said.getvalue()


def use_in(notebook: Any) -> None:
    """Let lines that begin with an exclamation mark be carried out so."""
    notebook.system = shell
