"""OpenGL without a screen: a kind of it that works on this machine, for `mujoco.Renderer`."""

from __future__ import annotations

import functools
import importlib
import os
import platform
import subprocess
import sys

from mujoco.rendering.classic import gl_context

from model import InputError

OFFSCREEN = ("egl", "osmesa")
"""Kinds of OpenGL that need no display, the faster first."""


@functools.cache
def choose() -> None:
    """Let `mujoco.Renderer` draw with the kind of OpenGL that MUJOCO_GL names, else with one that works.

    Raises `InputError` if there is none.
    """
    chosen = os.environ.get("MUJOCO_GL", "").strip().lower()
    working = platform.system() != "Linux" or next(filter(works, [chosen] if chosen else OFFSCREEN), None)
    if not working:
        remedy = "on Debian and Ubuntu: apt-get install libegl1 libgl1-mesa-dri (or libosmesa6)"
        if chosen:
            remedy = f"unset MUJOCO_GL = {chosen!r}, or set it to one of {', '.join(OFFSCREEN)}"
        raise InputError(f"there is no OpenGL to draw with; {remedy}")
    if isinstance(working, str) and not chosen:  # MuJoCo chose one that needs a display when it was imported
        gl_context.GLContext = importlib.import_module(f"mujoco.{working}").GLContext


def works(kind: str) -> bool:
    """Whether a kind of OpenGL works, tried in a process of its own.

    A library that is missing or has no driver may end the process, or leave it unable to load another one.
    """
    # OSMesa's context can't be freed while Python shuts down: the process ends at once, without cleaning up.
    code = "import mujoco, os; mujoco.Renderer(mujoco.MjModel.from_xml_string('<mujoco/>'), 8, 8); os._exit(0)"
    environment = os.environ | {"MUJOCO_GL": kind}
    tried = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, timeout=60, check=False)
    return tried.returncode == 0
