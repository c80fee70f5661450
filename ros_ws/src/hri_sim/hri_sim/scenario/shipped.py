"""The scenarios that come with the package."""

from __future__ import annotations

from importlib import resources

import yaml

from hri_prediction.errors import ConfigError
from hri_sim.scenario.schema import Scenario, load_scenario, scenario_from_mapping

_FOLDER = resources.files("hri_sim").joinpath("scenarios")


def shipped_names() -> tuple[str, ...]:
    """Names of the shipped scenarios, in alphabetical order."""
    names = (entry.name for entry in _FOLDER.iterdir())
    return tuple(sorted(name.removesuffix(".yaml") for name in names if name.endswith(".yaml")))


def load_shipped(name: str) -> Scenario:
    """Read a shipped scenario.

    Raises:
        ConfigError: when there is none of this name.
    """
    if name not in shipped_names():
        raise ConfigError(f"no scenario {name!r}", expected="one of " + ", ".join(shipped_names()))
    text = _FOLDER.joinpath(f"{name}.yaml").read_text(encoding="utf-8")
    return scenario_from_mapping(yaml.safe_load(text), where=name)


def scenario_or_shipped(path: str) -> Scenario:
    """The scenario at ``path``; the table scene that ships when empty."""
    return load_scenario(path) if path else load_shipped("table_reach")
