"""The engine as it comes: the characteristic curve with its own contact parameters, for display beside the study's."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace

from compare.measure.lab import Lab, time_unit
from compare.measure.record import Measurement, Missing, Records, measurement
from compare.measure.settled import flows, state
from compare.measure.settling import Start, judged
from compare.runs import engines
from model import Parameters

PROTOCOL = "newcomer"
SET = "reference"
STEP = 1e-3
"""Time step, s."""
LASTS = 40.0
"""Duration, in units of 1/c."""
SAMPLES = 1000


def measure(lab: Lab, sets: Mapping[str, Parameters], records: Records) -> Iterator[Measurement | Missing]:
    """omega_c and case from rest, with what they drift or swing by the end for an uncertainty."""
    if SET not in sets:
        yield Missing(PROTOCOL, next(iter(sets), ""), f"the engine's own settings are measured on {SET} only")
        return
    if not lab.engine.as_it_comes:
        yield Missing(PROTOCOL, SET, f"{lab.engine.name} has no settings of its own to be compared with")
        return
    plain, p = replace(lab, engine=engines.engine(lab.engine.as_it_comes)), sets[SET]
    begins = [Start(SET, p.replace(omega_0=Omega_0 / time_unit(p)), "rest", state()) for Omega_0 in flows(lab.level)]
    tasks = [plain.task(start.p, start.x0, LASTS / p.c, STEP, samples=SAMPLES) for start in begins]
    failed = {failure.task.key: failure.reason for failure in plain.complete(tasks)}
    for start, task in zip(begins, tasks, strict=True):
        if task.key in failed:
            yield Missing(PROTOCOL, SET, f"the run at {start.p.omega_0:.4g} rad/s {failed[task.key]}")
            continue
        (run,) = plain.run([task])
        ended = judged(start, task, run)
        for quantity, value in (("omega_c", ended.values["omega_c"]), ("case", ended.case)):
            at = {"case": ended.case.name, "start": start.name}
            yield measurement(plain, PROTOCOL, SET, start.p, quantity, value, [task], **at)
