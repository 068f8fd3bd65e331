"""Somewhere to draw without a screen: an OpenGL context that works on this machine."""

from __future__ import annotations

import functools
import importlib
import os
import platform
import subprocess
import sys
from typing import Any

import mujoco

from model import InputError

OFFSCREEN = ("egl", "osmesa")
"""Ways to draw without a display, the faster first."""


@functools.cache
def backend() -> str:
    """Name of a way to draw that works, as the environment variable MUJOCO_GL gives it; empty for MuJoCo's own choice.

    Each candidate is tried in a process of its own: a library that is missing or has no driver may leave the
    process unable to load another one, or end it. Raises `InputError` if there is none.
    """
    chosen = os.environ.get("MUJOCO_GL", "").strip().lower()
    if platform.system() != "Linux":
        return ""
    for name in (chosen,) if chosen else OFFSCREEN:
        if works(name):
            return "" if chosen else name
    if chosen:
        remedy = f"unset MUJOCO_GL = {chosen!r}, or set it to one of {', '.join(OFFSCREEN)}"
    else:
        remedy = "on Debian and Ubuntu: apt-get install libegl1 libgl1-mesa-dri (or libosmesa6)"
    raise InputError(f"there is no OpenGL to draw with; {remedy}")


def context(width: int, height: int) -> Any:
    """A context of at least that size, made current; raises `InputError` if there is no OpenGL."""
    name = backend()
    module = importlib.import_module(f"mujoco.{name}") if name else mujoco
    made = module.GLContext(width, height)
    made.make_current()
    return made


def works(name: str) -> bool:
    """Whether a way to draw works, tried in a process of its own."""
    # OSMesa's context can't be freed while Python shuts down: the process ends at once, without cleaning up.
    code = (
        "import mujoco, os; m = mujoco.MjModel.from_xml_string('<mujoco/>'); c = mujoco.GLContext(8, 8); "
        "c.make_current(); mujoco.MjrContext(m, 100); os._exit(0)"
    )
    tried = subprocess.run(
        [sys.executable, "-c", code], env=os.environ | {"MUJOCO_GL": name}, capture_output=True, timeout=60, check=False
    )
    return tried.returncode == 0
