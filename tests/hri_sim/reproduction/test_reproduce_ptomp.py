"""The command as a whole, as small as it can be."""

from __future__ import annotations

import json

import pytest

from hri_prediction.errors import ConfigError
from hri_sim.benchmark import rows
from hri_sim.reproduction import closer, command, drawing, pictures
from hri_sim.reproduction.bars import BARS
from hri_sim.reproduction.elsewhere import ELSEWHERE
from hri_sim.reproduction.sections import SECTIONS

PICTURES = ["comparison", "costs_certain", "costs_uncertain", "parameters", "postures", "worst"]


def run_main(monkeypatch, *arguments) -> int:
    monkeypatch.setattr("sys.argv", ["script", *map(str, arguments)])
    with pytest.raises(SystemExit) as stop:
        command.main()
    return int(stop.value.code or 0)


def test_smoke_makes_everything_and_does_nothing_twice(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(drawing, "DPI", 30)
    options = ("--smoke", "--rows", tmp_path / "rows", "--out", tmp_path, "--workers", 2)
    assert run_main(monkeypatch, *options) == 0
    content = json.loads((tmp_path / "ptomp.json").read_text())
    text = (tmp_path / "ptomp.md").read_text()
    assert sorted(path.stem for path in (tmp_path / "ptomp").iterdir()) == PICTURES
    assert sorted(content["pictures"]) == PICTURES
    assert list(content["sections"]) == [section.name for section in SECTIONS]
    assert len(content["bars"]) == len(BARS) + len(ELSEWHERE)
    assert list(content["leads"]) == list(content["starts"]) == ["1", "64"]
    assert "402 of 450 (89.3 %)" in text
    for name in PICTURES:
        assert f"](ptomp/{name}.png)" in text
    said = capsys.readouterr().out
    assert "met           ok, F = 1" in said
    assert "robustness kappa" in said

    def refuse(*arguments, **options):
        raise AssertionError("done already")

    monkeypatch.setattr(rows, "do_all", refuse)
    monkeypatch.setattr(closer, "do_all", refuse)
    monkeypatch.setattr(pictures, "draw_all", lambda *arguments: content["pictures"])
    assert run_main(monkeypatch, *options) == 0
    again = json.loads((tmp_path / "ptomp.json").read_text())
    # Times are kept in milliseconds.
    assert again.pop("times")["conditions"] == content.pop("times")["conditions"]
    assert again == content
    assert (tmp_path / "ptomp.md").read_text().split("## Time")[0] == text.split("## Time")[0]


def test_a_folder_that_cannot_be_made_is_named(tmp_path, monkeypatch):
    (tmp_path / "file").touch()
    monkeypatch.setattr(
        "sys.argv", ["script", "--smoke", "--rows", str(tmp_path / "file" / "rows")]
    )
    with pytest.raises(ConfigError, match="--rows"):
        command.app(standalone_mode=False)
