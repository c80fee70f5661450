"""PTOMP's peers, ablations and literal forms by name: one optimiser core, other settings.

``config/variants.yaml`` says of each in what it differs from ``config/ptomp.yaml``.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from functools import cache, cached_property
from importlib import resources
from types import MappingProxyType
from typing import Any

import yaml

from hri_planner.ptomp.config import PtompConfig, load_default_config
from hri_prediction.config import from_mapping
from hri_prediction.errors import ConfigError

PREDICTIONS = ("promp", "prior", "constant_velocity", "staying")
"""What a planner may be told of a person: learnt from recorded reaches and updated by what is seen; the
same before anything is seen; that a reach goes on at constant velocity; that the arm stays where it is."""
KINDS = ("planner", "ablation", "literal")


@dataclass(frozen=True)
class Variant:
    """A planner by name.

    Attributes:
        name: As on the command line.
        kind: One of :data:`KINDS`.
        text: What it is, in words.
        prediction: One of :data:`PREDICTIONS`.
        settings: Parameters of :class:`PtompConfig` that differ from the default, with values.
    """

    name: str
    kind: str
    text: str
    prediction: str
    settings: Mapping[str, Any]

    @cached_property
    def config(self) -> PtompConfig:
        """All parameters."""
        return from_mapping(PtompConfig, {**asdict(load_default_config()), **self.settings})


@cache
def variants() -> Mapping[str, Variant]:
    """All of them by name, in the order of the file.

    Raises:
        ConfigError: naming the entry that is wrong, and what was expected.
    """
    text = resources.files("hri_planner.config").joinpath("variants.yaml").read_text()
    return MappingProxyType(
        {name: _variant(name, entry) for name, entry in yaml.safe_load(text).items()}
    )


def _variant(name: str, entry: Mapping[str, Any]) -> Variant:
    keys = {"kind", "text", "prediction", "settings"}
    if set(entry) != keys:
        raise ConfigError(f"variant {name} has {sorted(entry)}", expected=f"{sorted(keys)}")
    variant = Variant(name, settings=MappingProxyType(entry["settings"] or {}), **{
        key: entry[key] for key in keys - {"settings"}
    })  # fmt: skip
    for what, value, known in (
        ("kind", variant.kind, KINDS), ("prediction", variant.prediction, PREDICTIONS),
    ):  # fmt: skip
        if value not in known:
            raise ConfigError(
                f"variant {name}: {what} {value}", expected="one of " + ", ".join(known)
            )
    try:
        _ = variant.config  # checks the settings
    except ConfigError as error:
        raise ConfigError(f"variant {name}: {error}") from error
    return variant


def find_variant(name: str) -> Variant:
    """A variant by name.

    Raises:
        ConfigError: naming those that exist.
    """
    known = variants()
    if name not in known:
        raise ConfigError(f"planner {name!r}", expected="one of " + ", ".join(known))
    return known[name]


def live_names() -> tuple[str, ...]:
    """Those that a graph can run: the predictor node says what they are told."""
    said = ("promp", "constant_velocity")
    return tuple(name for name, found in variants().items() if found.prediction in said)
