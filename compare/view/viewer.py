"""MuJoCo's interactive viewer, with the ball driven by the study's own loop."""

from __future__ import annotations

import os
import platform
import time
from typing import Any

import numpy as np
import numpy.typing as npt

from mjsim import engine, recorder, scene
from mjsim.contact_settings import ContactModel
from mjsim.stepping import JointedBall
from model import Flow, InputError, Parameters, State
from model.parameters import POSITIVE, check_number

FRAME = 1 / 60
"""Time between two pictures, s."""
BEHIND = 0.1
"""How far a slow machine may lag behind before the clock is set back, s."""


def view(
    p: Parameters, x0: npt.ArrayLike, flow: Flow, settings: ContactModel, speed: float = 1.0
) -> None:
    """Open a window and simulate in real time, times `speed`, until it is closed.

    Raises `InputError` if there is no display, or for a speed out of range.
    """
    check_number("speed", speed, "1", POSITIVE)
    if platform.system() == "Linux" and not (
        os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")
    ):
        raise InputError(
            "there is no display for a window; 'dualball simulate' and 'dualball render' make a "
            "page instead"
        )
    from mujoco import viewer  # here, because it needs a window system

    ball = start(p, x0, flow, settings)
    try:
        handle = viewer.launch_passive(
            ball.model, ball.data, show_left_ui=False, show_right_ui=False
        )
    except RuntimeError as error:  # macOS needs to be asked in another way
        raise InputError(f"the viewer does not open: {' '.join(str(error).split())}") from error
    with handle:
        run(handle, ball, flow, settings.timestep, speed)


def start(p: Parameters, x0: npt.ArrayLike, flow: Flow, settings: ContactModel) -> JointedBall:
    """A simulation for the viewer, with what only serves contact hidden."""
    x = State.one(x0)
    engine.check_timestep(settings.timestep, p, flow, float(flow.start[-1]), x)
    engine.check_start(x, p, settings)
    model, _ = scene.build(p, settings, shown=True)
    model.geom("wall").rgba = (0.0, 0.0, 0.0, 0.0)
    return JointedBall(model, p, settings, x, 0.0)


def run(handle: Any, ball: JointedBall, flow: Flow, timestep: float, speed: float) -> int:
    """Step and draw until the window is closed; return the number of steps.

    The simulation follows the clock; where it can't, it runs as fast as it can.
    """
    steps, begin, most = 0, time.monotonic(), max(1, int(BEHIND * speed / timestep))
    while handle.is_running():
        frame = time.monotonic()
        due = int((frame - begin) * speed / timestep) - steps
        if due > most:
            begin += (due - most) * timestep / speed
            due = most
        with handle.lock():
            ball.advance(
                flow((steps + 0.5 + np.arange(due)) * timestep), np.empty((due, recorder.COLUMNS))
            )
        steps += due
        handle.sync()
        time.sleep(max(0.0, FRAME - (time.monotonic() - frame)))
    return steps
