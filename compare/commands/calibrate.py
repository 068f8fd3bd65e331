"""``dualball calibrate``: the calibration curve of a meter, from theory and in a meter's words."""

import argparse
import math
from typing import Any

import numpy as np

import analytic
from analytic.bifurcation import diagram as bifurcation
from analytic.flowmeter import design, real_fluid
from compare.commands import options
from compare.figures import drawing, pages
from compare.figures.validity import model_warning, torque_left_out
from compare.report import meter
from model import InputError, Parameters, table
from model.arrays import Array
from model.parameters import REACH, check_number

LINES, FINE = 12, 2000
"""Flows of the table for the terminal, and of those among which the largest error is looked for."""


def run(args: argparse.Namespace) -> int:
    if args.parameter_omega_0 is not None:
        raise InputError("--omega-0 has no effect: it is varied; see --slowest and --fastest")
    p, k = options.parameters(args), args.swirl or 1.0
    t = bifurcation.thresholds(p)
    if not (math.isfinite(t.omega_02) and p.mu and p.c):
        given = f"mu = {p.mu:g}, eta = {p.eta:g}, c = {p.c:g} 1/s"
        raise InputError(f"{given}: a ball without friction or drag measures no flow")
    last = 1.25 * float(np.nanmax([t.omega_02, t.omega_04 if p.eta < p.j else t.omega_03]))
    top = last if args.fastest is None else args.fastest * k
    slowest = (args.slowest or 0.0) * k
    if slowest >= top:
        unit = "m³/s" if args.swirl else "rad/s"
        raise InputError(
            f"--fastest {top / k:g} {unit} is out of range: must be > --slowest {slowest / k:g}"
        )
    check_number("--fastest times --swirl", top, "rad/s", REACH)
    columns = curve(p, slowest, top, args.count, args.swirl)
    off = float(np.max(columns.get(LEFT_OUT, 0.0))) / 100
    if args.table:
        table.write(args.table, columns)
    if args.plot:
        from compare.subjects.flowmeter import figures  # here, because drawing is slow to load

        drawing.save(figures.draw_calibration(p, top, args.swirl, off), args.plot)
    said = [*model_warning(off), *in_words(p, slowest, top, args.swirl, off)]
    at = np.unique(np.linspace(0, len(columns[FLOW]) - 1, LINES).round().astype(int))
    names = [name for name in columns if not name.startswith("K ")]
    rows = [names, *([_cell(columns[name][i]) for name in names] for i in at)]
    data = {"parameters": p, "swirl": args.swirl, "said": said, "curve": columns}
    options.show(data, args.json, *said, pages.table("Calibration curve", rows))
    return 0


FLOW = "omega_0 (rad/s)"
RISING = "omega_c rising (rad/s)"
FALLING = "omega_c falling (rad/s)"
LEFT_OUT = "model error (%)"


def curve(
    p: Parameters, slowest: float, top: float, count: int, swirl: float | None
) -> dict[str, Any]:
    """The curve at `count` flows between two, rad s-1, and beside each jump, by labels with units.

    Readings, K-factors and branches while the flow rises from rest and while it falls, and what
    the model leaves out; volume flows and pulses if there is a swirl constant, rad m-3."""
    flows = flows_between(p, slowest, top, count)
    rising, falling = design.readings(p, flows)
    columns: dict[str, Any] = {"Q (m3/s)": flows / swirl} if swirl else {}
    columns |= {FLOW: flows, RISING: rising, FALLING: falling}
    for way, read in (("rising", rising), ("falling", falling)):
        if swirl:
            columns[f"K {way} (pulses/m3)"] = swirl * read / flows / (2 * math.pi)
        columns[f"error {way} (%)"] = 100 * (read / flows - 1)
        columns[f"motion {way}"] = motions(p, flows, read, way == "rising")
    off = [100 * real_fluid.model_error(p.replace(omega_0=float(w))) for w in flows]
    return columns | ({LEFT_OUT: np.array(off)} if p.nu_f or p.fluid_torque else {})


def flows_between(p: Parameters, slowest: float, top: float, count: int) -> Array:
    """So many flows above 0 between two, and both sides of each jump, rad s-1."""
    t = bifurcation.thresholds(p)
    sides = np.outer([t.omega_01, t.omega_02, t.omega_03, t.omega_04], (1 - 1e-6, 1 + 1e-6)).ravel()
    flows = np.linspace(slowest, top, count + (slowest == 0))[slowest == 0 :]
    return np.union1d(flows, sides[(sides > slowest) & (sides < top)])


def motions(p: Parameters, flows: Array, read: Array, rising: bool) -> list[str]:
    """What the ball does at each flow: rolls, slips, or is carried by the wall."""
    t = bifurcation.thresholds(p)
    carried = t.omega_02 if not rising or p.eta < p.j else t.omega_03
    slips = read < flows
    words = np.where(slips, "slips", np.where(flows > carried, "on the wall", "rolls"))
    return [str(each) for each in words]


def in_words(
    p: Parameters, slowest: float, top: float, swirl: float | None, off: float
) -> list[str]:
    """What a meter's user asks: range, K-factor, turndown, repeatability, doubts."""
    flows = flows_between(p, slowest, top, FINE)
    rising, falling = design.readings(p, flows)
    limit = analytic.operating_limit(p)

    def flow(omega_0: float) -> str:
        said = f"ω₀ = {meter.rounded(omega_0, off)} rad/s"
        return f"Q = {meter.rounded(omega_0 / swirl, off)} m³/s ({said})" if swirl else said

    factor = f"{meter.rounded((swirl or 0) / (2 * math.pi))} pulses per m³ (turns of the ball)"
    factor = factor if swirl else "1 turn of the ball per turn of the fluid"
    said = [f"Range: it reads right up to {flow(limit.omega_0)}; there {limit.end.value}."]
    said.append(f"K-factor: {factor}, at every flow of the range.")
    ratio = "--slowest gives it for a slowest flow of yours"
    if slowest:
        ratio = f"from --slowest on it is {meter.rounded(limit.omega_0 / slowest)} : 1"
        ratio = ratio if slowest < limit.omega_0 else "--slowest is beyond the range"
    said.append(f"Turndown: in the model rolling costs nothing, there is no slowest flow; {ratio}.")
    apart = rising < falling
    if apart.any():
        k = int(np.argmax(1 - rising / falling))
        ends = (flow(x) for x in (flows[apart][0], flows[apart][-1]))
        said.append(
            f"Repeatability: from {' to '.join(ends)} the reading depends on the past: while the "
            f"flow rises it is up to {100 * (1 - rising[k] / falling[k]):.2g} % less than while it "
            "falls. Elsewhere one flow has one reading."
        )
    else:
        said.append("Repeatability: one flow has one reading, whether it rose or fell.")
    slips = rising < flows
    if slips.any():
        worst = 100 * float(np.max(1 - rising / flows))
        again = ""
        if not slips[-1]:
            again = f", and right again from {flow(flows[slips][-1])} on, while it rises"
        said.append(f"Beyond the range it reads up to {worst:.2g} % too low{again}.")
    elif limit.omega_0 < top:
        said.append("Beyond the range it reads right, too, but for the ball's fall.")
    torque = torque_left_out(p.replace(omega_0=min(limit.omega_0, top)))
    left = [each for each in (torque, meter.AT_WALLS * bool(p.nu_f)) if each]
    unknown = (
        "Left out are a real fluid's torque on the ball and its inertia: give nu_f and "
        "density_ratio to have their share."
    )
    return said + (left or [unknown])


def _cell(value: Any) -> str:
    return value if isinstance(value, str) else meter.rounded(float(value), most=5)
