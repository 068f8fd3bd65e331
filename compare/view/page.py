"""A run as a page to look at from all sides: it needs nothing but itself, a browser and no network.

The motion is in the page, frame by frame, as are three.js, which NiceGUI brings along, and what
moves the one by the other (templates/motion.html)."""

from __future__ import annotations

import base64
import importlib.util
from pathlib import Path
from typing import Any

import numpy as np

from compare.kit.pages import render
from compare.kit.style import BALL, COLOURS, FORCE, SLIP
from compare.view.geometry import geometry, resampled
from model import Case, InputError, Parameters, Trajectory
from model.arrays import Array

DIGITS = 4
"""Of lengths, in units of R, and of parts of quaternions."""


def frames(run: Trajectory, times: Array, **arrows: float) -> dict[str, Any]:
    """What moves on the page, frame by frame, at times (n,) in s; `arrows` as in `render.write`."""
    p, now = run.header.parameters, resampled(run, times)
    seen = geometry(run, now, **arrows)
    columns = [
        seen.centres / p.R, seen.turns.as_quat(),
        *(part[k] / p.R for k in range(2) for part in (seen.contacts, seen.forces, seen.slips)),
    ]  # fmt: skip
    return {
        "time": np.round(times, 6).tolist(),
        "omega_0": np.round(np.broadcast_to(run.header.flow(times), times.shape), 3).tolist(),
        "omega_c": np.round(now.omega_c, 3).tolist(),
        "slip_A": np.round(now.slip_speed_A, 4).tolist(),
        "slip_B": np.round(now.slip_speed_B, 4).tolist(),
        "case": now.case.tolist(),
        "rows": np.round(np.hstack(columns), DIGITS).tolist(),
    }


def write(
    p: Parameters, speed: float, motion: dict[str, Any] | None = None, run: Trajectory | None = None
) -> str:
    """The page of a run with its `frames`, which plays at a multiple of real time.

    Without them it is a part of another page, which sends it frames of balls and vessels as large
    as those of `p`. Raises `InputError` if NiceGUI, an extra, isn't installed."""
    cases = {
        int(case): {
            "name": case.name,
            "floor": case.A.value,
            "wall": case.B.value,
            "colour": COLOURS[case],
        }
        for case in Case
    }
    about = {
        "cases": cases,
        "speed": speed,
        "size": p.r / p.R,
        "colours": {"ball": BALL, "force": FORCE, "slip": SLIP},
    }
    slips = run is not None and bool(np.any(run.slip_speed_A + run.slip_speed_B))
    told = {"p": p, "header": run and run.header, "force": FORCE, "slip": SLIP, "slips": slips}
    nicegui = importlib.util.find_spec("nicegui")
    if nicegui is None or nicegui.origin is None:
        raise InputError(
            "a page needs NiceGUI, which has three.js: pip install 'dualball[explore]'"
        )
    try:
        source = (Path(nicegui.origin).parent / "elements/scene/dist/index.js").read_bytes()
    except FileNotFoundError:
        raise InputError(
            "this NiceGUI has no three.js where version 3 has it: pip install 'nicegui>=3.18'"
        ) from None
    three = (
        "data:text/javascript;base64," + base64.b64encode(source).decode()
    )  # with its controls, as a module
    return render("compare.view", "motion.html", three=three, about=about, motion=motion, **told)
