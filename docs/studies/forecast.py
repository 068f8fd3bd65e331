"""Forecasts of models that others wrote: verdict, time, and predicted creep beside what a second
shows, as a table.

``python -m docs.studies.forecast MODEL.xml ...``; what a second shows is how far two points of the
bodies have slid apart that were one where they touch."""

from __future__ import annotations

import copy
import sys
import time
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from compare.bench.contact_law import geom_names
from compare.bench.forecast import Forecast, forecast
from compare.bench.settled import NOISE, UnsettledError, awake, load, settle
from compare.kit.pages import markdown
from model import InputError

SECOND, SETTLE = 1.0, 10.0
"""s."""


def row(path: Path) -> list[str]:
    """Of a model: its name, what the forecast says, pairs at rest, the worst of them, and the time
    it took, s."""
    begin, name = time.perf_counter(), f"{path.parent.name}/{path.stem}"
    try:
        model, data = load(path)
        settled = settle(model, data, SETTLE)
        start = copy.copy(data)
        found = forecast(model, data, settled)
    except (InputError, UnsettledError) as error:
        return [name, str(error).partition(":")[0], "–", "–", "–", _seconds(begin)]
    took, still = _seconds(begin), [p for p in found.pairs if not p.moves and p.creep == p.creep]
    shown = _shown(awake(model), start)
    apart = [
        abs(p.creep / max(shown[p.name], NOISE) - 1)
        for p in still
        if p.name in shown and max(p.creep, shown[p.name]) > NOISE
    ]
    agreement = f"{max(apart):.1%} of {len(apart)}" if apart else "–"
    rest = "yes" if found.settled.steady and not found.settled.moving else "no"
    return [name, _verdict(found), rest, f"{len(still)} of {len(found.pairs)}", agreement, took]


def _seconds(begin: float) -> str:
    return f"{time.perf_counter() - begin:.1f}"


def _verdict(f: Forecast) -> str:
    said = [f"set {f.change.written}"] if f.change else []
    said += ["Coulomb"] * bool(f.remedy) + ["collapsed"] * bool(f.settled.collapsed)
    said += [f"{len(f.settled.moving)} bodies move"] * bool(f.settled.moving) + ["sleeps"] * bool(
        f.settled.asleep
    )
    return "; ".join(said) or "nothing to change"


def _shown(model: Any, data: Any) -> dict[str, float]:
    """Of each pair by its name: the fastest of its contacts in the next second, m/s."""
    mujoco.mj_forward(model, data)
    names, touching = geom_names(model), data.contact.geom.min(1) >= 0
    geoms, drift = data.contact.geom[touching], data.contact.surfacevel[touching, :2]
    bodies, frames = model.geom_bodyid[geoms], data.contact.frame[touching].reshape(-1, 3, 3)
    arms = data.contact.pos[touching][:, None] - data.xpos[bodies]
    own = np.einsum("nkji,nkj->nki", data.xmat[bodies].reshape(-1, 2, 3, 3), arms)
    begin = data.time
    while data.time < begin + SECOND:
        mujoco.mj_step(model, data)
    mujoco.mj_kinematics(model, data)
    first, second = np.moveaxis(
        data.xpos[bodies] + np.einsum("nkij,nkj->nki", data.xmat[bodies].reshape(-1, 2, 3, 3), own),
        1,
        0,
    )
    slip = np.einsum("nij,nj->ni", frames[:, 1:], second - first) / (data.time - begin) + drift
    found: dict[str, float] = {}
    for (one, other), speed in zip(geoms.tolist(), np.hypot(*slip.T), strict=True):
        name = f"{names[one]} / {names[other]}"
        found[name] = max(found.get(name, 0.0), float(speed))
    return found


if __name__ == "__main__":
    mujoco.set_mju_user_warning(lambda _: None)
    head = ["model", "verdict", "rests", "pairs at rest", "creep off by at most", "time, s"]
    print(markdown([head, *map(row, map(Path, sys.argv[1:]))]))
