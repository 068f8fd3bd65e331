"""The league as one page: table, plot, versions and settings."""

from __future__ import annotations

from typing import Any

from compare import pages
from compare.figures import settings
from compare.report.pictures import address, svg
from compare.scorecard import league


def html(data: dict[str, Any]) -> str:
    """The page of `league.to_mapping`, which needs nothing but itself."""
    entries = league.from_mapping(data)
    picture = address(svg(settings.draw_league(entries)))
    failures = [
        (f"{entry.name}, {1e3 * (entry.step or 0):g} ms, {name}", reason)
        for entry in entries
        for name, reason in entry.failures.items()
    ]
    shown = {"rows": league.rows(entries), "settings": league.settings_table(data), "caption": league.CAPTION}
    return pages.render("compare.report", "league.html", **shown, failures=failures, picture=picture)
