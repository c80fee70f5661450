"""The table of imported files: one row a try, with what came of it, and no table without files."""

import json
import os
import shutil
from pathlib import Path

import pytest

from hri_prediction.errors import ConfigError
from hri_prediction.tracks.importers import reproduce

TRC = Path(__file__).resolve().parents[3] / "examples" / "data" / "simulated_reach.trc"


@pytest.fixture
def folder(tmp_path, monkeypatch):
    samples = tmp_path / "data" / "file_samples"
    samples.mkdir(parents=True)
    shutil.copy(TRC, samples / "good.trc")
    shutil.copy(TRC, samples / "exampleFormat.trc")
    (samples / "bad.c3d").write_bytes(b"no such file")
    (samples / "LICENSE").write_text("not a recording")
    monkeypatch.setenv(reproduce.DATA_VARIABLE, str(tmp_path / "data"))
    return tmp_path


def test_each_file_is_a_row_imported_or_refused_with_the_reason(folder, capsys):
    assert reproduce.main(["--out", str(folder / "out")]) == 0
    content = json.loads((folder / "out" / "import.json").read_text())
    assert set(content["origin"]) == {"commit", "date", "machine"}
    bad, plain, mapped, good = content["rows"]
    assert bad["file"] == "file_samples/bad.c3d"
    assert bad["refused"]
    assert "marker1" in mapped["options"]["map"]
    assert "there is no marker 'marker1'" in mapped["refused"]
    assert (good["format"], good["side"], good["options"]) == ("TRC", "right", {})
    assert good["frames"] == plain["frames"] > 100
    assert good["rate_hz"] == pytest.approx(100.0)
    assert len(good["gaps"]) == 4
    text = (folder / "out" / "import.md").read_text()
    assert "3 files: 2 imported, 1 refused each time." in text
    rows = [line for line in text.splitlines() if line.startswith("| file_samples")]
    assert [row.count("|") for row in rows] == 4 * [11]
    assert "table: " in capsys.readouterr().out


def test_a_gap_is_told_and_a_bar_does_not_break_the_table(folder):
    lines = TRC.read_text().splitlines()
    cells = lines[40].split("\t")
    lines[40] = "\t".join([*cells[:2], *[""] * (len(cells) - 2)])
    path = folder / "gap|.trc"
    path.write_text("\n".join(lines) + "\n")
    (row,) = reproduce.import_rows(path, "gap|.trc")
    assert [gap["count"] for gap in row["gaps"]] == [1, 2, 1, 1]  # one is the example's
    line = reproduce.table_line(row)
    assert line.startswith("| gap\\|.trc |")
    assert "| 1 / 2 / 1 / 1 | 0.01 / " in line


def test_without_recordings_it_says_so_and_writes_nothing(tmp_path, monkeypatch, capsys):
    monkeypatch.delenv(reproduce.DATA_VARIABLE, raising=False)
    assert reproduce.main(["--out", str(tmp_path / "out")]) == 0
    assert capsys.readouterr().out.startswith("skipped: HRI_DATA_DIR")
    assert not (tmp_path / "out").exists()
    monkeypatch.setenv(reproduce.DATA_VARIABLE, str(tmp_path))
    with pytest.raises(ConfigError, match="no file to import"):
        reproduce.main([])


@pytest.mark.skipif("HRI_DATA_DIR" not in os.environ, reason="HRI_DATA_DIR is not set")
def test_every_file_with_options_to_try_is_there():
    names = {path.name for path in reproduce.sample_files(Path(os.environ["HRI_DATA_DIR"]))}
    assert set(reproduce.FURTHER) <= names
