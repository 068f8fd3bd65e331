"""The report: one self-contained page, made from stored results only."""

from __future__ import annotations

import io
import re
import zlib
from collections import Counter
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from compare import page, results
from compare.claims import Outcome
from compare.figures import characteristic
from compare.results import Summary
from model.files import write_text

_SYMBOLS = {Outcome.CONFIRMED: "✓", Outcome.CORRECTED: "✓", Outcome.REFUTED: "✗", Outcome.FORMAL: "○"}


def write(directory: Path) -> Path:
    """Make ``report.html`` in a results directory from what is stored there; return its path.

    Raises `model.StorageError` if there is no summary or the page can't be written.
    """
    path = directory / results.REPORT
    write_text(path, render(results.load(directory)))
    return path


def render(summary: Summary) -> str:
    """The page as text."""
    claims = [_row(verdict) for verdict in summary.verdicts.values()]
    return page.render(
        "report.html",
        summary={"passed": sum(claim["passed"] for claim in claims), "total": len(claims)},
        headline=_headline(claims),
        lead=_lead(summary),
        tiles=_tiles(claims),
        figures=_figures(summary),
        claims=claims,
        outcomes=sorted({claim["outcome"] for claim in claims}),
        level_option={"QUICK": " --quick", "FULL": " --full"}.get(summary.level, ""),
        errata="",
        provenance=_provenance(summary),
    )


def svg(figure: Figure) -> str:
    """A figure as inline SVG, with text as text."""
    out = io.StringIO()
    figure.savefig(out, format="svg", metadata={"Date": None})
    text = out.getvalue()
    # An inline element takes its size from the page, and its ids must not meet those of the next figure.
    prefix = f"f{zlib.crc32(text.encode()):08x}-"
    text = re.sub(r'\bid="', f'id="{prefix}', text[text.index("<svg") :])
    text = re.sub(r'(xlink:href="|url\()#', rf"\1#{prefix}", text)
    return re.sub(
        r'(<svg[^>]*?) width="[^"]*"', r"\1", re.sub(r'(<svg[^>]*?) height="[^"]*"', r"\1", text, count=1), count=1
    )


def _row(verdict: Mapping[str, Any]) -> dict[str, Any]:
    outcome = Outcome(verdict["outcome"])
    good = verdict["passed"]
    mark = "fail" if not good else "pass" if outcome in (Outcome.CONFIRMED, Outcome.CORRECTED) else "other"
    return {**verdict, "mark": mark, "symbol": _SYMBOLS[outcome] if good else "✗", "figure": ""}


def _headline(claims: list[dict[str, Any]]) -> str:
    if not claims:
        return "Nothing has been checked yet"
    failed = [claim["id"] for claim in claims if not claim["passed"]]
    if failed:
        return f"{len(failed)} of {len(claims)} claims did not come out as expected: {', '.join(failed)}"
    counts = Counter(claim["outcome"] for claim in claims)
    return "The paper and the engine agree: " + ", ".join(f"{n} {name}" for name, n in counts.most_common())


def _lead(summary: Summary) -> str:
    checks = [check for verdict in summary.verdicts.values() for check in verdict["checks"]]
    omega = [abs(c["error"] / c["predicted"]) for c in checks if c["quantity"] == "ω_c" and c["predicted"]]
    if not omega:
        return "A ball rolls and slips round a cylinder; its closed-form theory is held against simulation."
    return (
        "A ball rolls and slips round a cylinder. Its angular velocity ω_c, predicted in closed form by Antali and "
        f"Stépán, was measured in {len(omega)} stationary states; the largest relative deviation is {max(omega):.1e}."
    )


def _tiles(claims: list[dict[str, Any]]) -> list[dict[str, str]]:
    checks = [check for claim in claims for check in claim["checks"]]
    runs = {check["run"] for check in checks if check["run"]}
    return [
        {"value": f"{sum(c['passed'] for c in claims)}/{len(claims)}", "label": "claims as expected"},
        {"value": f"{sum(c['passed'] for c in checks)}/{len(checks)}", "label": "numbers within tolerance"},
        {"value": str(len(runs)), "label": "simulations"},
    ]


def _figures(summary: Summary) -> list[dict[str, str]]:
    return [{"svg": svg(characteristic.draw(summary)), "caption": characteristic.CAPTION}]


def _provenance(summary: Summary) -> dict[str, str]:
    found = summary.provenance
    return {
        "made": found.get("created", ""),
        "level": summary.level.lower(),
        "versions": ", ".join(f"{name} {version}" for name, version in found.get("versions", {}).items()),
        "commit": found.get("commit", "") or "not from a checkout",
        "machine": found.get("machine", ""),
    }
