"""Siconos: Moreau's time stepping by a theta method, rigid contacts with Coulomb's cone.

It has no wheel, and where a distribution packages it, it belongs to the system's Python. There it
runs, a process for each run (`_siconos_worker.py`), which takes a step a line.
`DUALBALL_SICONOS_PYTHON` names another Python that has it.

Traps: a theta method keeps the forces at the end of the last step, so that of a force set between
steps only the part theta would act; threads of BLAS take longer than matrices of six rows; setters
of contact points crash where writing into the points works; warnings go to standard output."""

import contextlib
import functools
import json
import os
import select
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np

from compare.engines.adapters.free import BodyState, BreakdownError, Free, Library, Touch
from compare.engines.adapters.scene import Vector
from model import InputError
from model.versions import ABSENT

PROGRAM = Path(__file__).with_name("_siconos_worker.py")
TIMEOUT = 60.0  # for how long, s, an answer is waited for
SETTINGS = {"theta": 0.5, "activation": 1e-9, "projection": 1e-12}
SETTINGS |= {"newton": 1e-15, "tolerance": 1e-14}
"""theta of `MoreauJeanDirectProjectionOSI`, the share of forces that is taken at the end of a step;
`ConstraintActivationThreshold`, m: a contact counts as closed if half a step further its gap is
less than that, and at zero a resting contact that is open by round-off is left open, so that the
ball falls for a step; `ConstraintTolUnilateral`, m, up to which `TimeSteppingDirectProjection`
takes a ball out of an overlap; `TimeStepping` leaves it there, up to a step's way after an impact,
for as long as the contact lasts; `NewtonTolerance`, N s, of the iteration on the equations of
motion: with 1e-10 spin changes in flight; relative tolerance of `FrictionContact`'s solver,
non-smooth Gauss-Seidel. Its own settings are none: the user of Siconos writes the contacts."""
_NAMED = "DUALBALL_SICONOS_PYTHON"


class Installation(Library):
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


LIBRARY = Installation("siconos", __name__)


@functools.cache
def locate(named: str | None) -> tuple[str, str]:
    """The first Python that has Siconos and the version; an empty name if none does."""
    for python in [named] if named else [sys.executable, shutil.which("python3", path=os.defpath)]:
        command = [python or "", "-I", "-c", "import siconos; print(siconos.version)"]
        try:
            version = subprocess.run(
                command, capture_output=True, text=True, timeout=TIMEOUT, check=True
            ).stdout
        except (OSError, subprocess.SubprocessError):
            continue
        return command[0], version.strip()
    return "", ABSENT


class Siconos(Free):
    """A ball in a vessel, in a process of its own."""

    TELLS = True
    AHEAD = 0.0
    _process: subprocess.Popen[str] | None = None

    def __init__(self) -> None:
        super().__init__("siconos", "a contact closes up to half a step early or late")
        self.DECLARED = "equations of motion in turning axes, no scene"

    @property
    def MISSING(self) -> str:
        """Why it can't be used here, for `compare.bench.runner`."""
        return LIBRARY.missing

    def make(self) -> None:
        """Raises `InputError` if Siconos doesn't work in its process."""
        scene, body = self.scene, self.scene.body
        *floors, wall = scene.surfaces
        if body.shape != "sphere" or not wall.radius or len(floors) > 1:
            raise NotImplementedError("only for a ball in a vessel")
        self.close()
        self._process = subprocess.Popen(
            [locate(os.environ.get(_NAMED))[0], "-I", PROGRAM],  # -I: its own packages, not ours
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            # matrices are of six rows
            env=os.environ | {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"},
            start_new_session=True,  # Ctrl-C is for us
        )
        r, mu = body.size[0], floors[0].friction if floors else None
        problem: dict[str, Any] = {"m": body.mass, "r": r, "inertia": body.inertia[0], "g": scene.g}
        problem |= {"R": wall.radius - r, "mu": mu, "eta": wall.friction}
        try:
            self._ask({**SETTINGS, **problem, "timestep": self.timestep})
            self._ask([*body.position, *body.velocity, *body.spin])
        except BreakdownError as error:
            self.close()
            raise InputError(f"siconos {error}") from error
        self._state, self._force = (body.position, body.velocity, body.spin), (0.0, 0.0, 0.0)

    def _ask(self, what: Any) -> Any:
        """Send a line to the process and return its answer; raises `BreakdownError`."""
        assert self._process
        sent, answers = self._process.stdin, self._process.stdout
        assert sent
        assert answers
        with contextlib.suppress(OSError):  # it has ended, which the answer will show
            print(json.dumps(what), file=sent, flush=True)
        if not select.select([answers], [], [], TIMEOUT)[0]:
            raise BreakdownError(f"gave no answer for {TIMEOUT:g} s")
        line = answers.readline()
        if not line:
            assert self._process.stderr
            words = self._process.stderr.read().strip().splitlines()
            why = words[-1] if words else f"exit code {self._process.wait()}"
            raise BreakdownError(f"ended ({why})")
        answer = json.loads(line)
        if isinstance(answer, dict):
            raise BreakdownError(f"could not go on ({answer['error']})")
        return answer

    def advance(self) -> None:
        self._state = self._ask(list(self._force))

    def read(self) -> BodyState:
        return tuple(self._state)

    def push(self, force: Vector) -> None:
        self._force = force

    def touches(self) -> list[Touch]:
        return [Touch(surface, np.array(force), gap) for surface, force, gap in self._ask([])]

    def close(self) -> None:
        if self._process:
            with contextlib.suppress(BrokenPipeError), self._process:
                self._process.kill()
            self._process = None


best = Siconos()
