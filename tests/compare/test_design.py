"""``dualball design`` gives its answers as data and as a page, and one clear line for what can't be
asked."""

import json
import math
import re
from pathlib import Path

import numpy as np
import pytest
import tomli_w

from analytic import operating_range, thresholds
from analytic.flowmeter import design
from compare.commands import design as commands
from model import Parameters
from model.parameters import read_toml
from tests.commands import carried_out, refused, told

METER = {
    "fluid": {"nu_f": 1.004e-6, "rho_f": 998.2},
    "flow": {"slowest": 3.0, "fastest": 18.0},
    "bounds": {"r": [0.004, 0.006], "R": 0.02, "mu": [0.1, 0.3], "eta": [0.1, 0.6]},
    "material": [{"name": "steel", "rho_b": 7850}, {"name": "cork", "rho_b": 200}],
    "tolerances": {"mu": 0.1, "eta": 0.2},
}


def written(folder, **changes):
    """A file of `METER` with other tables; None leaves one out."""
    asked = {name: value for name, value in {**METER, **changes}.items() if value is not None}
    path = folder / "meter.toml"
    path.write_text(tomli_w.dumps(asked), "utf-8")
    return str(path)


def test_the_best_meter_as_json_and_as_a_page(tmp_path, capsys):
    page = tmp_path / "meter.html"
    made = json.loads(told(capsys, f"design {written(tmp_path)} -o {page} --json"))
    p = Parameters(**made["parameters"])
    values, worst = made["meter"]["values"], made["meter"]["worst"]
    assert made["material"] == "steel"
    assert made["meter"]["limit"]["omega_0"] == operating_range(p)
    # At the best wall slip, with the smoothest contacts, is as near as unloading, with the
    # roughest.
    slip = thresholds(p.replace(mu=0.9 * p.mu, eta=0.8 * p.eta)).omega_01
    unloading = thresholds(p.replace(eta=1.2 * p.eta)).omega_02
    assert slip == pytest.approx(unloading, rel=1e-3)
    assert worst["omega_0"] == pytest.approx(min(slip, unloading), rel=1e-12)
    assert made["meter"]["margin"] == worst["omega_0"] / 18.0
    assert made["sensitivities"]["omega_02"]["eta"]["value"] == pytest.approx(-0.5)
    assert made["thresholds"]["omega_03"]["lowest"] == pytest.approx(math.sqrt(p.g / (p.j * p.R)))
    assert "a ball not denser than the fluid floats" in made["refused"]["cork"]
    assert made["model_holds"] is False
    text = page.read_text("utf-8")
    assert text.index("hold for this fluid") < text.index("ω₀₂")
    # The model is off by half of each number, which leaves three digits; what is chosen or given
    # has all.
    for shown in (f"{worst['omega_0']:.3g}", f"{values['eta']:.4g}", "cork can't be used"):
        assert shown in text
    assert text.count('<figure class="plot"') == 2


def test_a_search_tells_how_far_it_is(tmp_path):
    told = list[float]()
    path = Path(written(tmp_path, bounds=METER["bounds"] | {"mu": 0.2, "r": 0.005}))
    design.design(commands.request(read_toml(path)), tell=told.append)
    half = max(told) / 2  # of two materials the second floats
    assert 0 <= min(told) < half / 4
    assert half == 0.25
    assert abs(np.median(told) - half) < half / 2  # steadily, as it takes as long a generation


BALL = {"r": 0.005, "R": 0.02, "rho_b": 7850, "mu": 0.2, "eta": 0.2}


@pytest.mark.parametrize(
    ("changes", "code", "said"),
    [
        (
            {
                "bounds": BALL | {"R": [0.02, 0.03], "rho_b": [2000, 3000]},
                "flow": {"slowest": 0, "fastest": 60},
            },
            1,  # none is good enough: the best there is
            "No meter within the bounds covers the flows up to 60 rad/s. Best: ball, r = 0.005 m, "
            "R = 0.02 m",
        ),
        (
            {
                "bounds": BALL,
                "flow": {"slowest": 3, "fastest": 10},
                "material": [{"name": "[red]"}],
            },
            0,  # Stokes' law is meant for Re < 1, a ball that slips in water has thousands
            r"Best: \[red\], r = 0.005 m.*Warning: beyond the limit the ball may lag with Re up to",
        ),
        (
            {"bounds": BALL | {"mu": 0}},
            1,
            "no operating range: a contact without friction never makes it roll.",
        ),
    ],
)
def test_the_best_meter_in_words(tmp_path, capsys, changes, code, said):
    path = written(tmp_path, **{"material": None, "tolerances": None} | changes)
    found, shown, _ = carried_out(capsys, f"design {path}")
    assert found == code
    assert re.search(said, " ".join(shown.split()))
    assert shown.startswith("Warning: the paper's model doesn't hold for this fluid: it is off by")


FLUID, FLOW, BOUNDS = METER["fluid"], METER["flow"], METER["bounds"]
WRONG = [
    ({"fluid": FLUID | {"nu_f": -1.0}}, "fluid.nu_f = -1 m2 s-1 is out of range: must be > 0"),
    ({"fluid": FLUID | {"drag": "stoks"}}, "fluid.drag = 'stoks' must be one of"),
    ({"fluid": FLUID | {"rho": 1}}, "unknown entry of [fluid] 'rho' (did you mean 'rho_f'?)"),
    ({"fluid": 3}, "fluid = 3 must be a table, [fluid]"),
    (
        {"flow": {"slowest": 5, "fastest": 4}},
        "flow.fastest = 4 rad s-1 is out of range: must be > flow.slowest = 5",
    ),
    (
        {"flow": FLOW | {"response": 1e-3}},
        "response = 0.001 s excludes everything: within the bounds",
    ),
    (
        {"fluid": FLUID | {"drag": "quadratic"}, "flow": FLOW | {"response": 9}},
        "flow.response can't",
    ),
    ({"bounds": BOUNDS | {"eta": [0.3, 0.1]}}, "steel: eta = [0.3, 0.1] excludes everything"),
    ({"bounds": {"r": 0.01}}, "missing bound of steel: 'R', 'mu', 'eta'"),
    (
        {"material": [{"name": "cork", "rho_b": 200}]},
        "cork: rho_b = 200 kg m-3 is out of range: a ball not denser",
    ),
    (
        {"material": [{"name": "a", "rho_b": 2e3}] * 2},
        "material.name = 'a' must be a text, and no other material's",
    ),
    ({"material": {"name": "a"}}, "material must be a list of tables"),
    ({"tolerances": {"mu": 1.5}}, "tolerances.mu = 1.5 is out of range: must be >= 0 and < 1"),
    ({"tables": {}}, "unknown table 'tables'"),
]


@pytest.mark.parametrize(("changes", "message"), WRONG)
def test_what_cannot_be_asked_is_one_line(tmp_path, capsys, changes, message):
    path = written(tmp_path, **changes)
    said = refused(capsys, f"design {path}")
    assert said.startswith(f"dualball: error: {path}: ")
    assert message in said
