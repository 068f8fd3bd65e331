"""``dualball compare curve.csv``: a measured calibration curve of a meter beside theory."""

import argparse
from collections.abc import Sequence

import numpy as np

from analytic.bifurcation import diagram as bifurcation
from analytic.flowmeter import measured, real_fluid
from analytic.flowmeter.measured import Fit
from compare.commands import options
from compare.figures import drawing, pages
from compare.figures.validity import model_warning
from compare.report.meter import SYMBOLS, rounded
from model import InputError, table
from model.arrays import Array
from model.parameters import POSITIVE, check_number

COLUMNS: dict[str, tuple[str, Sequence[str]]] = {
    "omega_0": ("rad s-1", []),
    "Q": ("m3 s-1", []),
    "omega_c": ("rad s-1", ["omega_c rising"]),
    "omega_c falling": ("rad s-1", []),
}
"""What a curve may have, by the labels that `dualball calibrate -o` writes."""


def run(args: argparse.Namespace) -> int:
    if not (own := options.own_set(args)):
        how = "--set NAME or --parameters FILE"
        raise InputError(f"a measured curve needs its meter, {how}; motions come in two")
    (p,) = own.values()
    name, flow, read = curve(args.a)
    bifurcation.check_branch(p)  # first: a fault of the set is none of the file's
    try:
        found = measured.fits(p, flow, read)
    except InputError as error:
        raise InputError(f"{args.a}: {error}") from error
    best = next((fit for fit in found[::-1] if fit.told), None)
    if args.plot:
        from compare.subjects.flowmeter import figures  # here, because drawing is slow to load

        shown, omega_0 = (best.p, best.factor * flow) if best else (p, np.mean(read / flow) * flow)
        figure = figures.draw_calibration(shown, 1.05 * float(omega_0.max()))
        figure.axes[0].plot(omega_0, read, "k.", ms=4, label="measured")
        figure.axes[0].legend(loc="upper left", fontsize=8.5)
        drawing.save(figure, args.plot)
    doubt = model_warning(real_fluid.model_error(p.replace(omega_0=float(read.max()))))
    data = {"flow is": name, "flow": flow, "omega_c": read, "fits": found, "best": best}
    rows = [["fitted", "μ", "η", "c (1/s)", "scatter (%)"], *map(_row, found)]
    tables = [pages.table("Fits: what isn't fitted is the meter's", rows)] * bool(found)
    options.show(data, args.json, *doubt, *in_words(found, best, name, flow, read), *tables)
    return 0


def curve(path: str) -> tuple[str, Array, Array]:
    """What the flow is, omega_0 or Q, flows and readings (n,) of a file; raises `InputError`."""
    columns, lines = table.read(path, COLUMNS, ["omega_c"], ("omega_0", "omega_c"))
    for name, values in columns.items():
        for line, value in zip(lines, values, strict=True):
            check_number(f"{path}, line {line}: {name}", value, COLUMNS[name][0], POSITIVE)
    flow = next((name for name in ("omega_0", "Q") if name in columns), None)
    if flow is None:
        raise InputError(f"{path}: no column is called omega_0 (rad/s) or Q (m3/s)")
    reads = [columns[name] for name in ("omega_c", "omega_c falling") if name in columns]
    return flow, np.tile(columns[flow], len(reads)), np.concatenate(reads)


def in_words(found: list[Fit], best: Fit | None, name: str, flow: Array, read: Array) -> list[str]:
    """What a curve tells: its kink, factor of flows, parameters, what theory is off by."""
    symbol, unit = ("Q", "m³/s") if name == "Q" else ("ω₀", "rad/s")
    per_flow, theory = "rad/m³ " * (name == "Q"), ", by theory 1" * (name == "omega_0")
    if not found:
        times = float(np.mean(read / flow))
        return [
            f"No kink: {len(flow)} readings up to {symbol} = {rounded(float(flow.max()))} {unit} "
            "are in proportion to the flow.",
            f"ω_c is {rounded(times)} {per_flow}times {symbol}{theory}, within "
            f"{_percent(read / flow / times - 1)} %.",
            "The ball rolls, and tells nothing of friction and drag.",
        ]
    fit = best or found[0]
    rolls = flow < fit.kink
    others = " and ".join(_symbol(each) for each in found[-1].free if each not in fit.free)
    alone = ", ".join(map(_symbol, fit.free)) + (f", if {others} are as given" * bool(others))
    off = [f"{_percent(fit.off[side])} % in {side.sum()} readings" for side in (rolls, ~rolls)]
    turns = f"{_with(fit.factor, fit.u['factor'])} {per_flow}times {symbol}"
    return [
        f"Kink: from {symbol} = {_with(fit.kink, fit.u['kink'])} {unit} on it slips, ω₀₁ (84): one "
        "combination of μ and η.",
        f"Flow: the fluid turns with {turns}{theory}.",
        f"Told: {alone if best else 'no parameter by itself'}.",
        f"Theory is off by {off[0]} before the kink, where any theory fits, and by {off[1]} "
        "beyond.",
    ]


def _row(fit: Fit) -> list[str]:
    values = [
        _with(value, fit.u[name]) if name in fit.free else f"{value:.3g} (given)"
        for name in measured.FITS[-1]
        for value in [getattr(fit.p, name)]
    ]
    return [", ".join(map(_symbol, fit.free)), *values, _percent(fit.off)]


def _with(value: float, u: float) -> str:
    """A value with its standard uncertainty, of which it is given the relative one."""
    told = f"{rounded(value, u)} ± {rounded(value * u, most=2)}"
    return told if u <= measured.TOLD else "not told"


def _percent(off: Array) -> str:
    return rounded(100 * float(np.sqrt(np.mean(off**2))), most=2)


def _symbol(name: str) -> str:
    return SYMBOLS.get(name, name)
