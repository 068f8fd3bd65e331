"""Siconos: Moreau's time stepping by a theta method, rigid contacts with Coulomb's cone, impacts by Newton's law.

It has no wheel, and where a distribution packages it, it belongs to the system's Python. There it runs, a process for
each run (`_siconos_worker.py`), which takes a step a line. `DUALBALL_SICONOS_PYTHON` names another Python that has it.

Traps: a theta method keeps the forces at the end of the last step, so that of a force set between steps only the part
theta would act; threads of BLAS take longer than matrices of six rows; setters of contact points crash where writing
into the points works; warnings go to standard output.
"""

from __future__ import annotations

import contextlib
import functools
import json
import os
import select
import shutil
import subprocess
import sys
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from compare.kit.adapters import adapter
from compare.kit.adapters.adapter import BreakdownError, Floats, Library, Touch
from model import InputError, Parameters

PROGRAM = Path(__file__).with_name("_siconos_worker.py")
PATIENCE = 60.0
"""For how long, s, an answer is waited for."""


@dataclass(frozen=True, kw_only=True)
class Settings(adapter.Settings):
    """The engine's settings: by default the best known, a ball in turning axes and contacts solved to round-off.

    A free ball is in a true cylinder.
    """

    theta: float = 0.5
    """Of `MoreauJeanOSI`: the share of forces that is taken at the end of a step."""
    activation: float = 1e-9
    """`ConstraintActivationThreshold`, m: a contact counts as closed if half a step further its gap is less than that.
    At zero a resting contact that is open by round-off is left open, and the ball falls for a step."""
    projection: float | None = 1e-12
    """`ConstraintTolUnilateral`, m, up to which `TimeSteppingDirectProjection` takes a ball out of an overlap. None for
    `TimeStepping`, which leaves it there: up to a step's way after an impact, for as long as the contact lasts."""
    newton: float = 1e-15
    """`NewtonTolerance`, N s, of the iteration on the equations of motion; with 1e-10 spin changes in flight."""
    tolerance: float = 1e-14
    """Of `FrictionContact`'s solver, non-smooth Gauss-Seidel, relative."""
    iterations: int = 1000
    """Most iterations of that solver."""


DEFAULTS = Settings(coordinates="free", activation=0.0, projection=None, newton=1e-6, tolerance=1e-4)
"""The engine's own settings: a free ball in a true cylinder, since the user of Siconos writes the contacts."""


class _Installation(Library):
    """Siconos in another Python."""

    @property
    def missing(self) -> str:
        named = os.environ.get(_NAMED)
        if locate(named)[0]:
            return ""
        if named:
            return f"siconos is not installed for {named}, which {_NAMED} names"
        return "siconos is not installed: on Debian or Ubuntu, apt-get install python3-siconos"

    @property
    def version(self) -> str:
        return locate(os.environ.get(_NAMED))[1]

    def load(self) -> str:
        """The Python that has it; `InputError` if there is none."""
        if self.missing:
            raise InputError(self.missing)
        return locate(os.environ.get(_NAMED))[0]


LIBRARY = _Installation("siconos")
_NAMED = "DUALBALL_SICONOS_PYTHON"


@functools.cache
def locate(named: str | None) -> tuple[str, str]:
    """The first Python that has Siconos and the version; an empty name if none does."""
    for python in [named] if named else [sys.executable, shutil.which("python3", path=os.defpath)]:
        command = [python or "", "-I", "-c", "import siconos; print(siconos.version)"]
        try:
            version = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE, check=True).stdout
        except (OSError, subprocess.SubprocessError):
            continue
        return command[0], version.strip()
    return "", "not installed"


class Scene(adapter.Scene):
    """The ball in a process of its own; `InputError` if Siconos doesn't work there."""

    def __init__(self, python: str, p: Parameters, settings: Settings) -> None:
        self._process = subprocess.Popen(
            [python, "-I", PROGRAM],  # -I: its own packages, not ours
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            env=os.environ | {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"},  # matrices are of six rows
            start_new_session=True,  # Ctrl-C is for us
        )
        numbers = {name: getattr(p, name) for name in ("m", "r", "R", "j", "mu", "eta", "g")}
        try:
            self._ask({**asdict(settings), **numbers})
        except BreakdownError as error:
            self.close()
            raise InputError(f"siconos {error}") from error

    def _ask(self, what: Any) -> Any:
        sent, answers = self._process.stdin, self._process.stdout
        assert sent
        assert answers
        with contextlib.suppress(OSError):  # it has ended, which the answer will show
            print(json.dumps(what), file=sent, flush=True)
        if not select.select([answers], [], [], PATIENCE)[0]:
            raise BreakdownError(f"gave no answer for {PATIENCE:g} s")
        line = answers.readline()
        if not line:
            assert self._process.stderr
            words = self._process.stderr.read().strip().splitlines()
            raise BreakdownError(f"ended ({words[-1] if words else f'exit code {self._process.wait()}'})")
        answer = json.loads(line)
        if isinstance(answer, dict):
            raise BreakdownError(f"could not go on ({answer['error']})")
        return answer

    def start(self, place: Floats, velocity: Floats) -> None:
        self._ask([*place, *velocity])

    def advance(self, force: Floats) -> tuple[Floats, Floats]:
        place, velocity = self._ask(list(force))
        return place, velocity

    def touches(self) -> list[Touch]:
        return [Touch(contact, np.array(force), gap) for contact, force, gap in self._ask([])]

    def close(self) -> None:
        """End the process."""
        with contextlib.suppress(BrokenPipeError), self._process:
            self._process.kill()
