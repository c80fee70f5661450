"""What command lines of resumable work have in common."""

from pathlib import Path

import pytest
import typer
from rich.console import Console

from hri_prediction.errors import ConfigError
from hri_prediction.results.options import make_folders, resumable


def test_folders_are_made_or_the_option_is_named(tmp_path: Path):
    make_folders(out=tmp_path / "a" / "b", rows=tmp_path / "a")
    assert (tmp_path / "a" / "b").is_dir()
    (tmp_path / "file").write_text("")
    with pytest.raises(ConfigError, match="cannot make --rows") as caught:
        make_folders(rows=tmp_path / "file" / "in_it")
    assert "--rows" in caught.value.hint


def test_interrupted_work_says_how_it_goes_on(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    with pytest.raises(typer.Exit) as stopped, resumable(Console(width=400), tmp_path):
        raise KeyboardInterrupt
    assert stopped.value.exit_code == 130
    assert str(tmp_path) in capsys.readouterr().out


def test_interrupted_work_that_is_not_kept_says_so(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(typer.Exit), resumable(Console(width=400), None):
        raise KeyboardInterrupt
    assert "nothing of it is kept" in capsys.readouterr().out
