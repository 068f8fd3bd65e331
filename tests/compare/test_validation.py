"""The quick claims come out as they should; a claim known not to hold is asserted as such."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path

import pytest

import compare
from compare import CLAIMS, Check, Claim, Outcome, results
from compare.campaign import Campaign
from compare.claims import Lab, Level, judge
from model import InputError, StorageError, storage

QUICK = [claim for claim in CLAIMS if claim.level is Level.QUICK]


@pytest.mark.parametrize("claim", QUICK, ids=lambda claim: claim.id)
def test_verdict(validated, claim: Claim) -> None:
    (verdict,) = (v for v in validated.verdicts if v.claim.id == claim.id)
    failed = [check for check in verdict.checks if not check.passed]
    assert verdict.outcome is claim.expected, (verdict.error, failed[:5])


def test_no_claim_is_confirmed_by_a_tolerance_wider_than_ten_uncertainties(validated) -> None:
    wide = [c for v in validated.verdicts for c in v.checks if c.judged and c.tolerance > 10 * c.uncertainty]
    assert wide == []


def test_the_results_directory_is_whole(validated) -> None:
    summary = results.load(validated.directory)
    assert set(summary.verdicts) == {claim.id for claim in QUICK}
    for verdict in summary.verdicts.values():
        for check in verdict["checks"]:
            if check["run"]:
                run = storage.load(validated.directory / check["run"])
                assert run.complete
                assert run.header.engine == check["witness"]


def test_what_is_there_is_not_computed_again(validated) -> None:
    before = {path: path.stat().st_mtime_ns for path in (validated.directory / "runs").iterdir()}
    again = compare.validate(validated.directory, level=Level.QUICK, claims=[CLAIMS[0].id], workers=0)
    assert [check.measured for check in again[0].checks] == [c.measured for c in validated.verdicts[0].checks]
    assert {path: path.stat().st_mtime_ns for path in (validated.directory / "runs").iterdir()} == before


def check(**changes: object) -> Check:
    values = {
        "quantity": "ω_c", "unit": "rad/s", "witness": "mujoco", "parameters": "reference", "omega_0": 1.0,
        "condition": "", "predicted": 2.0, "measured": 2.1, "uncertainty": 0.05, "tolerance": 0.15,
        "case_predicted": "RR", "case_found": "RR",
    }  # fmt: skip
    return Check(**(values | changes))


@pytest.mark.parametrize(
    ("checks", "outcome"),
    [
        ([check()], Outcome.CONFIRMED),
        ([check(), check(measured=2.2)], Outcome.NOT_REPRODUCED),
        ([check(case_found="SS")], Outcome.NOT_REPRODUCED),
        ([check(measured=float("nan"))], Outcome.NOT_REPRODUCED),
        ([check(tolerance=float("nan"))], Outcome.NOT_REPRODUCED),
        ([check(), check(measured=9.0, judged=False)], Outcome.CONFIRMED),
        ([check(judged=False)], Outcome.NOT_REPRODUCED),
        ([], Outcome.NOT_REPRODUCED),
    ],
)
def test_a_verdict_can_fail(tmp_path: Path, checks: list[Check], outcome: Outcome) -> None:
    claim = dataclasses.replace(CLAIMS[0], study=lambda lab: checks)
    verdict = judge(claim, Lab(Campaign(tmp_path, workers=0), Level.QUICK))
    assert verdict.outcome is outcome
    assert verdict.passed is (outcome is Outcome.CONFIRMED)


def test_an_unknown_claim_gets_a_suggestion(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"no claim is called 'prop1' \(did you mean 'prop-1'\?\)"):
        compare.validate(tmp_path, claims=["prop1"])


def test_results_of_another_version_are_refused(tmp_path: Path) -> None:
    results.save(results.Summary().with_verdicts("QUICK", []), tmp_path)
    path = tmp_path / results.SUMMARY
    content = json.loads(path.read_text())
    content["provenance"]["versions"]["dualball"] = "0.0.1"
    path.write_text(json.dumps(content))
    with pytest.raises(StorageError, match=r"holds results of dualball 0\.0\.1"):
        compare.validate(tmp_path)
    for text in ("{", "[]", "{}"):
        path.write_text(text)
        with pytest.raises(StorageError, match=r"summary\.json is not"):
            compare.validate(tmp_path)
