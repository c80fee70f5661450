"""A configuration file is mended in one go: all of its faults are named."""

from __future__ import annotations

from pathlib import Path

import pytest

from hri_prediction.config import from_mapping, load_yaml
from hri_prediction.errors import ConfigError
from hri_prediction.prediction.config import PredictorConfig


def test_all_faults_of_a_file(tmp_path: Path) -> None:
    path = tmp_path / "predictor.yaml"
    path.write_text("horizon: 100\nsteps: 3\noutput: median\nmin_reach: soon\n")
    with pytest.raises(ConfigError) as caught:
        load_yaml(PredictorConfig, path)
    head, *lines = str(caught.value).split("\n")
    assert head == f"{path}: 4 faults"
    assert lines[0].startswith("  PredictorConfig has no parameter steps; expected one of ")
    assert "step, " in lines[0]
    assert lines[1] == "  min_reach = 'soon'; expected a value of type float"
    assert "PredictorConfig.horizon = 100.0; expected at most" in lines[2]
    assert "PredictorConfig.output = 'median'; expected one of" in lines[3]
    assert len(caught.value.faults) == 4


def test_one_fault_is_one_line_in_parts() -> None:
    with pytest.raises(ConfigError) as caught:
        from_mapping(PredictorConfig, {"output": "median"})
    assert "\n" not in str(caught.value)
    assert caught.value.problem == "PredictorConfig.output = 'median'"
    assert caught.value.expected.startswith("one of ")


def test_what_hangs_on_a_wrong_value_is_not_guessed_at() -> None:
    # on_speed must be above onset_speed: with on_speed unreadable nothing can be said of that.
    with pytest.raises(ConfigError) as caught:
        from_mapping(PredictorConfig, {"on_speed": "fast", "onset_speed": 0.5})
    assert [fault.problem for fault in caught.value.faults] == ["on_speed = 'fast'"]


def test_numbers_that_yaml_takes_for_text_are_explained(tmp_path: Path) -> None:
    path = tmp_path / "planner.yaml"
    path.write_text("min_reach: 1e-1\n")
    with pytest.raises(ConfigError, match=r"1\.0e\+3"):
        load_yaml(PredictorConfig, path)
