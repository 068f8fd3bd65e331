"""The chain of a claim names the lines of the sources where each link is written."""

import json

import pytest

from compare.method.record import Records
from compare.report import chain
from compare.report.results import Summary
from compare.subjects.catalogue import CLAIMS
from compare.verification.assessment import full_verdict
from model import Parameters
from tests.commands import carried_out, refused
from tests.measured import measured

P = Parameters.named("reference").replace(omega_0=8.0)


def line(place):
    """A line of the sources, by FILE:LINE."""
    file, _, number = place.rpartition(":")
    return (chain.ROOT / file).read_text("utf-8").splitlines()[int(number) - 1]


@pytest.mark.parametrize("claim", CLAIMS, ids=lambda claim: claim.id)
def test_every_link_is_where_it_says(claim):
    found = {link.what: link for link in chain.links(claim, None, Summary())}
    assert claim.statement in found["statement"].text
    assert "claim(" in line(found["statement"].place)
    assert "def " in line(found["measured by"].place)
    assert "Entry(" in line(found["planned on"].place)
    assert any(word in line(found["criterion"].place) for word in ("def ", "lambda"))
    assert found["verdict"].text.startswith("none")


def test_numbers_stand_beside_the_theory_that_was_asked():
    (claim,) = (each for each in CLAIMS if each.id == "prop-1")
    wrong = measured("settled", "omega_c", 8.1, 1e-9, P, "mine", start="with the fluid", case="RR")
    verdict = full_verdict(claim, {"mujoco": {1: Records((wrong,))}})
    files = Summary(measurements={"mujoco": {1: ["measurements/abc/settled.h5"]}})
    found = chain.links(claim, verdict, files)
    (kept,) = (link for link in found if link.what == "kept")
    assert kept.place == "measurements/abc/settled.h5"
    theory = {link.text: link.place for link in found if link.what == "predicted by"}
    assert "def stable_solutions" in line(theory["analytic.stationary.solutions.stable_solutions"])
    assert not any("wall_spin" in name for name in theory)  # of which nothing was measured
    (numbers,) = (link.numbers for link in found if link.numbers)
    row = dict(zip(*numbers, strict=True))
    assert (row["set"], row["measured"], row["predicted"]) == ("mine", "8.1 rad/s", "8")
    assert (row["± u"], row["required"], row[""]) == ("1.0e-09", "1.0e-07", "fail")
    assert found[-1].text == "refuted, expected: confirmed"


def test_the_command(here, capsys):
    """Of claims that are not measured yet, too."""
    code, out, _ = carried_out(capsys, "inspect --claim prop-1 --json")
    assert code == 0
    assert [link["what"] for link in json.loads(out)][:3] == ["statement", "source", "measured by"]
    assert "(did you mean 'prop-1'?)" in refused(capsys, "inspect --claim prop1")
    assert "inspect needs the file of a run, or --claim" in refused(capsys, "inspect")
    assert "--plot" in refused(capsys, "inspect --claim prop-1 --plot it.png")
