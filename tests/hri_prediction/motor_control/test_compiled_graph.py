"""The compiled model: made once, kept, found again; and what is said when it cannot be."""

import os

import pytest

from hri_prediction.errors import ConfigError, HriError
from hri_prediction.motor_control import compiled_graph
from hri_prediction.motor_control.convention import PITCH_YAW


@pytest.fixture
def empty_cache(tmp_path, monkeypatch):
    monkeypatch.setattr(compiled_graph, "cache_folder", lambda: tmp_path / "hri-0")
    compiled_graph.compiled_graph.cache_clear()
    yield tmp_path
    compiled_graph.compiled_graph.cache_clear()


def test_it_is_made_once_and_nothing_else_is_left(empty_cache):
    name = PITCH_YAW.name
    old, young = empty_cache / "arm_x_0.so", empty_cache / "arm_x_1.so"
    for file in (old, young):
        file.write_text("")
    os.utime(old, (0.0, 0.0))
    assert not compiled_graph.is_prepared(name)
    made = compiled_graph.compiled_graph(name)
    assert made.values
    assert made.second != made.jacobian
    assert compiled_graph.is_prepared(name)
    assert not old.exists()
    young.unlink()
    (file,) = empty_cache.iterdir()
    assert file == compiled_graph.library_path(name)
    before = file.stat().st_ino
    compiled_graph.compiled_graph.cache_clear()
    compiled_graph.compiled_graph(name)
    assert file.stat().st_ino == before


def test_a_damaged_library_is_named(empty_cache):
    path = compiled_graph.library_path(PITCH_YAW.name)
    path.write_bytes(b"no library")
    with pytest.raises(HriError, match=r"remove it"):
        compiled_graph.compiled_graph(PITCH_YAW.name)


def test_without_a_compiler_it_is_said_how_to_get_one(empty_cache, monkeypatch):
    compiled_graph._compiler.cache_clear()
    monkeypatch.setattr(compiled_graph.shutil, "which", lambda name: None)
    with pytest.raises(HriError, match="build-essential"):
        compiled_graph.compiled_graph(PITCH_YAW.name)
    monkeypatch.undo()
    compiled_graph._compiler.cache_clear()


def test_a_compiler_that_fails_is_quoted(empty_cache, monkeypatch):
    monkeypatch.setattr(compiled_graph, "_FLAGS", ("--no-such-flag",))
    with pytest.raises(HriError, match="no-such-flag"):
        compiled_graph.compiled_graph(PITCH_YAW.name)
    assert list(empty_cache.iterdir()) == []


def test_a_folder_that_cannot_be_written_is_named(empty_cache, monkeypatch):
    (empty_cache / "file").write_text("")
    monkeypatch.setattr(compiled_graph, "cache_folder", lambda: empty_cache / "file" / "hri-0")
    with pytest.raises(HriError, match="XDG_CACHE_HOME"):
        compiled_graph.compiled_graph(PITCH_YAW.name)


def test_other_conventions_are_refused():
    with pytest.raises(ConfigError, match="yaw_pitch, pitch_yaw"):
        compiled_graph.compiled_graph("roll")
