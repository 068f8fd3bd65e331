"""An engine that knows the answers to exact cases, in a module that a process of its own loads at
once."""

import os
import sys
import time
from dataclasses import dataclass

import numpy as np

SHAPES = "state() must return position, velocity and spin, not shapes "
BREAKS = {
    "sphere-rolls-down": ("hangs", "took longer than 3 s at a step of 4 ms"),
    "block-rests": ("dies", "crashed (exit code 3) at a step of 4 ms"),
    "cylinder": ("raises", "ValueError: singular matrix"),
    "sphere-slips-down": ("shapes", f"{SHAPES}[(3,), (2,), (3,)]"),
    "sphere-slides-rolls": ("none", f"{SHAPES}[]"),
    "box-stops": ("nan", "diverged by t = 0.04 s at a step of 4 ms"),
    "drilling-sphere": ("leaves", "SystemExit: 7"),
}
"""How an engine breaks in a case, and what is said of it."""


@dataclass
class Exact:
    """Knows the answer, and gives it with an error of first order; may break in the cases of
    `BREAKS`."""

    breaks: bool = False
    PRECISION: str = "f64"

    def build(self, case, timestep):
        self.case, self.timestep, self.done = case, timestep, 0
        self.how = BREAKS.get(case.name, [""])[0] if self.breaks else ""
        if case.name == "growing-pull":
            raise NotImplementedError("no forces")

    def step(self, n):
        self.done += n
        if self.how == "hangs":
            time.sleep(60)
        if self.how == "dies":
            os._exit(3)
        if self.how == "leaves":
            sys.exit(7)
        if self.how == "raises":
            raise ValueError("singular matrix")

    def state(self):
        k = int(np.argmin(np.abs(self.case.times - self.done * self.timestep)))
        position, velocity, spin = self.case.exact[k].reshape(3, 3)
        broken = {
            "shapes": (position, velocity[:2], spin),
            "nan": (position, velocity * np.nan, spin),
            "none": None,
        }
        if self.how in broken:
            return broken[self.how]
        return position + self.timestep * self.case.times[k] * np.eye(3)[0], velocity, spin


class Compiles(Exact):
    """One that numba compiles before its first step."""

    def build(self, case, timestep):
        import numba

        numba.njit(lambda x: np.sort(x)[::2].sum())(np.zeros(3))
        super().build(case, timestep)


class Stepless(Exact):
    TIMESTEPS = ()


class Featured(Exact):
    FEATURES = "two bodies"


EXACT, ROUGH, COMPILES = Exact(), Exact(PRECISION="f32"), Compiles()
STEPLESS, FEATURED = Stepless(), Featured()
"""Engines by name, for a league that takes no time."""
