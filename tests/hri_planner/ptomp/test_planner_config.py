"""The parameter file and the dataclass agree."""

import dataclasses

import pytest
import yaml

from hri_planner.ptomp import PtompConfig, load_default_config
from hri_planner.ptomp.config import parameter_file_text
from hri_prediction.errors import ConfigError


def test_the_file_states_every_default():
    assert load_default_config() == PtompConfig()
    assert list(yaml.safe_load(parameter_file_text())) == [
        field.name for field in dataclasses.fields(PtompConfig)
    ]


def test_unusable_values_are_refused():
    with pytest.raises(ConfigError, match="num_timesteps"):
        PtompConfig(num_timesteps=5)
    with pytest.raises(ConfigError, match="margin_min"):
        PtompConfig(margin=0.02)
    with pytest.raises(ConfigError, match="wait_cost"):
        PtompConfig(late_weight=1.0, wait_cost=1.0)
