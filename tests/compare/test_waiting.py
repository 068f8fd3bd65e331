"""A command that takes long says that it is at work, and how far it is."""

import time

from compare.commands import waiting


def test_only_what_takes_long_says_so(monkeypatch, capsys):
    with waiting.told("quick"):
        pass
    assert capsys.readouterr().err == ""
    monkeypatch.setattr(waiting, "LATER", 0.05)
    monkeypatch.setattr("compare.kit.progress.INTERVAL", 0.3)
    with waiting.told("slow") as tell:
        tell(0.25)
        time.sleep(1.5)
    said = capsys.readouterr().err.splitlines()
    assert said[0] == "slow"
    assert "s: slow, 25%" in said[1]
