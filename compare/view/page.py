"""A run as a page to look at from all sides: it needs nothing but itself, a browser and no network.

The motion is in the page, frame by frame, as are three.js, which NiceGUI brings along, and what
moves the one by the other (templates/motion.html)."""

import base64
import importlib.util
from pathlib import Path
from typing import Any

import numpy as np

from compare.figures.pages import render
from compare.figures.style import BALL, COLOURS, FORCE, SLIP
from compare.view.geometry import geometry, resampled
from model import Case, InputError, Parameters, Trajectory
from model.arrays import Array
from model.files import check_writable, write_bytes
from model.parameters import Range, check_number

DIGITS = 4
"""Of lengths, in units of R, and of parts of quaternions."""
MOST_FRAMES = 8000
"""Of a page, which then is smaller than 3 MB."""


def save(
    run: Trajectory,
    output: Path,
    at: float = 0.0,
    time: float = 60.0,
    speed: float = 0.25,
    rate: float = 60.0,
) -> str:
    """Write the page of a run; return in words what was written.

    It begins at a time `at` of the run, plays at a multiple `speed` of real time with `rate` frames
    a second, and takes `time`, less if the run ends before; all in s.

    Raises `InputError` for what can't be shown, and where NiceGUI, an extra, isn't installed;
    `StorageError` if the file can't be written."""
    check_writable(output)
    if len(run.time) == 0:
        raise InputError("the run has no samples to show")
    begin, end = float(run.time[0]), float(run.time[-1])
    check_number("at", at, "s", Range(begin, end), "to be within the run it")
    step, until = speed / rate, min(at + time * speed, end)
    if (until - at) / step > MOST_FRAMES:
        raise InputError(
            f"{(until - at) / step:.4g} frames are more than {MOST_FRAMES}: choose a shorter "
            f"time, or a lower rate"
        )
    times = np.arange(at, until + 1e-12, step)
    page = write(run.header.parameters, speed, frames(run, times), run)
    write_bytes(output, page.encode())
    return f"{output}: {len(times)} frame{'s' * (len(times) != 1)}"


def frames(run: Trajectory, times: Array) -> dict[str, Any]:
    """What moves on the page, frame by frame, at times (n,) in s."""
    p, now = run.header.parameters, resampled(run, times)
    seen = geometry(run, now)
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
    colours = {"ball": BALL, "force": FORCE, "slip": SLIP}
    return render(
        "compare.view",
        "motion.html",
        three=_three(),
        about={"cases": cases, "speed": speed, "size": p.r / p.R, "colours": colours},
        motion=motion,
        p=p,
        header=run and run.header,
        slips=run is None or bool(np.any(run.slip_speed_A + run.slip_speed_B)),
    )


def _three() -> str:
    """The address of three.js with its controls: a module, which NiceGUI brings along."""
    nicegui = importlib.util.find_spec("nicegui")
    if nicegui is None or nicegui.origin is None:
        raise InputError("a page needs NiceGUI, which has three.js: pip install 'nicegui>=3.18'")
    source = Path(nicegui.origin).parent / "elements/scene/dist/index.js"
    if not source.exists():
        raise InputError(
            "this NiceGUI has no three.js where version 3 has it: pip install 'nicegui>=3.18'"
        )
    return "data:text/javascript;base64," + base64.b64encode(source.read_bytes()).decode()
