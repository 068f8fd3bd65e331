"""What theory says about one set of parameters, for `dualball predict`."""

from __future__ import annotations

import argparse
import dataclasses
import json
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from rich.console import Console
from rich.table import Table

import analytic
from analytic import StationarySolution, Thresholds
from compare.commands import options
from compare.statistics import plain
from model import Case, Parameters
from model.kinematics import UNITS, VARIABLES


def add(commands: options.Commands) -> None:
    """Declare the command."""
    command = options.command(
        commands, "predict", run, "stationary solutions, thresholds and operating range, from theory"
    )
    options.add_parameters(command)
    command.add_argument("--json", action="store_true", help="print JSON instead of tables")


def run(args: argparse.Namespace) -> int:
    """Predict and show."""
    prediction = predict(options.parameters(args))
    if args.json:
        print(json.dumps(prediction.to_mapping(), indent=1))
    else:
        Console().print(*tables(prediction), sep="\n")
    return 0


@dataclass(frozen=True)
class Prediction:
    """Thresholds, stationary solutions, and what they mean for a flowmeter."""

    parameters: Parameters
    thresholds: Thresholds
    solutions: list[StationarySolution]
    attractors: list[StationarySolution]
    """Those a disturbed ball returns to."""
    operating_range: float
    """Largest omega_0 up to which omega_c = omega_0 holds uniquely, rad s-1 (section 5.3)."""

    @property
    def reading(self) -> str:
        """What a flowmeter would show, in a sentence."""
        p = self.parameters
        cases = [solution.case for solution in self.attractors]
        if not cases:
            return "no stationary motion attracts the ball"
        if all(math.isclose(s.x[2], p.omega_0, rel_tol=1e-12, abs_tol=1e-300) for s in self.attractors):
            return f"the ball goes round with the fluid ({' or '.join(dict.fromkeys(c.name for c in cases))})"
        if len(set(cases) - {Case.SR, Case.NR}) == len(set(cases)) == 1:
            lag = 1 - self.attractors[0].x[2] / p.omega_0
            return f"the ball slips ({cases[0].name}) and lags {lag:.1%} behind the fluid"
        return f"ambiguous: {', '.join(c.name for c in cases)} all attract, the reading depends on the history"

    def to_mapping(self) -> dict[str, Any]:
        """JSON-able data; what doesn't exist is null."""
        about: dict[str, Any] = plain(
            {
                "parameters": dataclasses.asdict(self.parameters),
                "groups": {"kappa": self.parameters.kappa, "Omega_0": self.parameters.Omega_0},
                "thresholds": dataclasses.asdict(self.thresholds),
                "operating_range": self.operating_range,
                "reading": self.reading,
                "solutions": [_solution(solution) for solution in self.solutions],
            }
        )
        return about


def predict(p: Parameters) -> Prediction:
    """Ask the closed-form theory for everything."""
    solutions, attractors = analytic.stationary_solutions(p), analytic.stable_solutions(p)
    return Prediction(p, analytic.thresholds(p), solutions, attractors, analytic.operating_range(p))


def tables(prediction: Prediction) -> list[Table | str]:
    """Thresholds, solutions and the reading, for the terminal."""
    p = prediction.parameters
    groups = f"κ = c√(R/g) = {p.kappa:.6g}, Ω₀ = ω₀√(R/g) = {p.Omega_0:.6g}"
    head = Table(title="Parameters", title_justify="left", title_style="bold", show_header=False, box=None)
    for field in dataclasses.fields(p):
        unit = "" if field.metadata["unit"] == "1" else field.metadata["unit"]
        head.add_row(
            field.metadata["symbol"], f"{getattr(p, field.name):.8g} {unit}", f"[dim]{field.metadata['meaning']}"
        )
    limits = Table(title="Thresholds", title_justify="left", title_style="bold")
    for column in ("", "value", "what happens there"):
        limits.add_column(column, justify="right" if column == "value" else "left")
    for name, meaning in _MEANING.items():
        value = getattr(prediction.thresholds, name)
        unit = " rad/s" if name.startswith("omega") else ""
        limits.add_row(_SYMBOLS[name], "does not exist" if math.isnan(value) else f"{value:.12g}{unit}", meaning)
    found = Table(title="Stationary solutions", title_justify="left", title_style="bold")
    found.add_column("")
    attracting = {s.case for s in prediction.attractors}
    for s in prediction.solutions:
        found.add_column(s.case.name, justify="right", style="" if s.exists and s.case in attracting else "dim")
    for label, show in _ROWS.items():
        found.add_row(label, *(show(s) for s in prediction.solutions))
    range_ = prediction.operating_range
    reach = (
        f"ω_c = ω₀ holds uniquely up to ω₀ = {range_:.8g} rad/s" if math.isfinite(range_) else "no limit to ω_c = ω₀"
    )
    reading = f"Flowmeter at ω₀ = {p.omega_0:g} rad/s: {prediction.reading}; {reach}."
    return [head, f"[dim]{groups}", limits, found, reading]


_SYMBOLS = {"omega_01": "ω₀₁", "omega_02": "ω₀₂", "omega_03": "ω₀₃", "omega_04": "ω₀₄", "eta_cr": "η_cr"}
_MEANING = {
    "omega_01": "two-point rolling becomes two-point slipping (P3)",
    "omega_02": "the wall begins to carry the ball (P2; NF2 where η < j)",
    "omega_03": "the floor lets go of the rolling ball (NT1)",
    "omega_04": "two-point slipping ends in a fold (F)",
    "eta_cr": "least wall friction for which there is a fold",
}


_ROWS: dict[str, Callable[[StationarySolution], str]] = {
    "ω_c (rad/s)": lambda s: f"{s.x[2]:.8g}",
    "ω̃_x (rad/s)": lambda s: f"{s.x[3]:.8g}",
    "ω̃_y (rad/s)": lambda s: f"{s.x[4]:.8g}",
    "ω̃_z (rad/s)": lambda s: f"{s.x[5]:.8g}",
    "v_y (m/s)": lambda s: f"{s.x[1]:.6g}",
    "A_y (N)": lambda s: f"{s.force_A[1]:.6g}",
    "B_x (N)": lambda s: f"{s.force_B[0]:.6g}",
    "forces admissible": lambda s: "yes" if s.exists else "no",
    "within the case": lambda s: s.stability.value.removesuffix("ly stable").removesuffix(" stable"),
    "against slipping": lambda s: "stable" if s.slip_stable else "unstable",
    "rightmost eigenvalue (1/s)": lambda s: (
        f"{s.eigenvalues[0]:.4g}" if s.eigenvalues[0].imag else f"{s.eigenvalues[0].real:.4g}"
    ),
    "free": lambda s: ", ".join(s.family) or "-",
}


def _solution(s: StationarySolution) -> dict[str, Any]:
    return {
        "case": s.case.name,
        "x": dict(zip(VARIABLES, map(float, s.x), strict=True)),
        "units": dict(zip(VARIABLES, UNITS, strict=True)),
        "force_A": s.force_A.tolist(),
        "force_B": s.force_B.tolist(),
        "eigenvalues": [[float(v.real), float(v.imag)] for v in s.eigenvalues],
        "exists": bool(s.exists),
        "stability": s.stability.value,
        "slip_stable": bool(s.slip_stable),
        "family": list(s.family),
    }
