"""What writes tables and figures of pages: each has its place, and its numbers hold together."""

from __future__ import annotations

import dataclasses
import io
import itertools
import math
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

import analytic
from compare.kit import pages
from compare.kit.campaign import Campaign
from docs.studies import accuracy, confirmation, settings, tables
from docs.studies.states import APPROACH, COST, ERRORS, OPEN, ROLLING, SLIPPING, STATES, Entry
from mjsim import ContactSettings
from model import InputError

DOCS = Path(__file__).parents[2] / "docs"
ROWS = [["a", "b"], ["1", "2"], ["3", "4"]]
ROUNDED = 0.05 + 0.1 / math.log(2)
"""An order as it is written, to a digit, less the slope of errors as they are written, to two."""

STEP = 4e-3


@pytest.fixture
def campaign(tmp_path: Path) -> Iterator[Campaign]:
    with Campaign(tmp_path, workers=0) as made:
        yield made


def drawn(figure: Figure) -> bool:
    """Whether a figure can be written."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=40)
    return buffer.tell() > 1000


def test_a_table_is_put_in_its_place(tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    page.write_text("before\n<!-- begin: x -->\nold\n<!-- end: x -->\nafter <!-- begin: y --><!-- end: y -->\n")
    for _ in range(2):
        tables.write(page, "x", ROWS)
        assert page.read_text() == (
            "before\n<!-- begin: x -->\n| a | b |\n| --- | --: |\n| 1 | 2 |\n| 3 | 4 |\n<!-- end: x -->\n"
            "after <!-- begin: y --><!-- end: y -->\n"
        )
    with pytest.raises(InputError, match="must have the lines '<!-- begin: z -->'"):
        tables.write(page, "z", ROWS)


@pytest.mark.parametrize("name", tables.PAGES)
def test_the_page_has_a_place_for_every_table(name: str, tmp_path: Path) -> None:
    page, (_, named) = tmp_path / name, tables.PAGES[name]
    page.write_text((DOCS / name).read_text("utf-8"), "utf-8")
    for table in named:
        tables.write(page, table, ROWS)
    assert page.read_text("utf-8").count(pages.markdown(ROWS)) == len(named)


def test_formulas_are_what_mujoco_does_and_one_that_is_off_is_noticed() -> None:
    rows = confirmation.rows()
    assert len({row.what for row in rows}) == len(rows)
    assert not [row for row in rows if not row.agrees]
    for measured, agrees in ((1.009, True), (1.011, False)):
        row = confirmation.Row("length", "m", predicted=1.0, measured=measured, tolerance=1e-2)
        assert row.agrees is agrees


def test_the_transient_converges_and_is_extrapolated(campaign: Campaign) -> None:
    head, *rows, last = accuracy.transient(campaign, (2e-3, 1e-3, 5e-4))
    errors = [float(row[1]) for row in rows]
    assert errors == sorted(errors, reverse=True)
    for before, row in itertools.pairwise(rows):
        slope = math.log2(float(before[1]) / float(row[1]))
        assert float(row[2]) == pytest.approx(slope, abs=ROUNDED)
        assert slope > 1.8
    assert float(last[1]) < errors[-1]
    assert len(head) == len(last)


def test_landings_are_located_far_below_the_step(campaign: Campaign) -> None:
    _, *rows = accuracy.event_times(campaign, (1e-3, 5e-4))
    for (_, _, coarse, *_), (_, _, fine, order, *_) in zip(rows[::2], rows[1::2], strict=True):
        coarse, fine = (float(cell.removesuffix(" µs")) for cell in (coarse, fine))
        assert float(order) == pytest.approx(math.log2(coarse / fine), abs=ROUNDED)
        assert float(order) > 1.5
        assert coarse < 0.1  # a ten-thousandth of the step of 1 ms


def test_states_are_reached_from_rest_and_from_near(campaign: Campaign) -> None:
    head, row = accuracy.reached(campaign, accuracy.REACHED[:1], [4e-3])
    assert dict(zip(head, row, strict=True))["state"] == accuracy.REACHED[0].name
    assert row[-1] == "0.0%"


def test_splits_lie_in_the_admissible_interval(campaign: Campaign) -> None:
    _, row = accuracy.force_split(campaign, [10.0])
    least, greatest = (float(end) for end in row[1].split(" … "))
    digit = 1e-4  # of what is written
    assert all(least - digit <= float(chosen) <= greatest + digit for chosen in row[2:])


def test_the_ladder_ends_at_the_defaults_by_one_thing_at_a_time() -> None:
    rungs = list(settings.rungs(1e-3).values())
    assert rungs[-1] == ContactSettings()
    contact = {"solref", "solreffriction", "solimp", "impratio"}  # one thing: what makes it stiff and continuous
    for low, high in itertools.pairwise(rungs):
        changed = {f.name for f in dataclasses.fields(low) if getattr(low, f.name) != getattr(high, f.name)}
        assert len(changed) == 1 or changed == contact


def test_errors_are_those_of_the_run() -> None:
    """A run of the slipping state, with known errors put in."""
    run, exact = analytic.simulate(SLIPPING.p, SLIPPING.solution.x, 0.1), APPROACH.exact
    off = dataclasses.replace(run, omega_c=1.01 * run.omega_c, slip_z=run.slip_z + 2.0, force_B=0 * run.force_B)
    held = SLIPPING.held(off, 0.05)
    assert held.omega_c == pytest.approx(0.01)
    assert held.slip == pytest.approx(2.0 * SLIPPING.p.r)
    assert held.open == 1
    broken = dataclasses.replace(run, header=dataclasses.replace(run.header, failure="diverged"))
    assert math.isnan(SLIPPING.held(broken, 0.05).omega_c)
    scaled = exact.x * np.where(np.arange(8) == 2, 1.001, 1.0)
    omega_c, slip = APPROACH.errors(exact.time, scaled)
    assert omega_c == pytest.approx(1e-3)
    assert slip == 0


def test_ladder_as_records_and_drawn(campaign: Campaign) -> None:
    rungs = settings.rungs(STEP)
    entries = settings.reached(campaign, {name: rungs[name] for name in ("MuJoCo's defaults", "ours")})
    poor, ours = entries
    assert poor.name == "MuJoCo's defaults"
    assert list(ours.scores) == [*(state.name for state in STATES), APPROACH.name, OPEN]
    assert all(ours.scores[name] < poor.scores[name] for name in ours.scores)
    assert ours.scores[OPEN] == 0
    assert drawn(settings.draw_ladder(entries))


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
def test_a_run_that_breaks_down_has_no_error(campaign: Campaign, monkeypatch: pytest.MonkeyPatch) -> None:
    """Known to diverge: a pyramidal cone with a low impedance."""
    wild = ContactSettings.at(STEP, solimp=0.1, solreffriction=20 * STEP, cone="pyramidal", memory=False, order=1)
    monkeypatch.setattr(settings, "ERRORS", ERRORS[:1])
    monkeypatch.setattr(settings, "CONTACT", ERRORS[0])
    (entry,) = settings.reached(campaign, {"wild": wild})
    assert math.isnan(entry.scores[ROLLING.name])
    assert entry.failures.keys() == {ROLLING.name}


def test_frontier_has_a_cost_that_is_measured_once(campaign: Campaign, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(settings, "rivals", lambda step: {"ours": ContactSettings.at(step)})
    monkeypatch.setattr(settings, "BATCH", 2)
    entries = settings.frontier(campaign, [STEP])
    assert [(e.name, e.step) for e in entries] == [("ours", STEP), ("time-stepping", STEP), ("event", None)]
    assert all(entry.scores[COST] > 0 for entry in entries)
    assert settings.frontier(campaign, [STEP]) == entries
    assert drawn(settings.draw_frontier(entries))


def test_figures_are_drawn_where_an_error_is_zero_or_missing() -> None:
    entries = [Entry(n, 1e-3, {"RR at 12": e, COST: 0.1}) for n, e in {"a": 0.0, "b": math.nan, "c": 1e-3}.items()]
    assert drawn(settings.draw_ladder(entries))
    assert drawn(settings.draw_frontier(entries))
