"""Options that all launch scripts have."""

from __future__ import annotations

import difflib
import time
from pathlib import Path
from typing import Annotated

import typer

from hri_prediction.errors import ConfigError

HUMANS = ("simulated", "replay")

Human = Annotated[
    str,
    typer.Option(
        help="Where the person comes from: simulated or replay. Live motion capture is for "
        "nodes that are started by hand (mocap_live)."
    ),
]
HumanFile = Annotated[
    Path | None, typer.Option(help="Recording to replay: mocap bag or track file.")
]
Trial = Annotated[int | None, typer.Option(help="Trial of the recording, from 0.")]
Place = Annotated[
    str | None,
    typer.Option(
        help="Where the recording is put: X,Y,Z,YAW in metres and degrees. "
        "Default: seated across the table, facing the robot."
    ),
]
ScenarioFile = Annotated[
    Path | None, typer.Option(help="Scenario file (YAML). Default: drawn by the seed.")
]
ReachCount = Annotated[int | None, typer.Option(help="Reaches of a drawn scenario.")]
Parameters = Annotated[
    Path | None, typer.Option(help="YAML file with parameters: 'node: {parameter: value}'.")
]
Record = Annotated[Path | None, typer.Option(help="Bag folder to create. Default: bag in --out.")]
Seed = Annotated[int, typer.Option(help="Seed of everything random.", min=0)]
Picture = Annotated[bool, typer.Option(help="Draw picture.png at the end.")]
Video = Annotated[bool, typer.Option(help="Render video.mp4 after the run.")]


def default_folder(kind: str) -> Path:
    """``runs/<kind>_<time>`` below the present folder."""
    return Path("runs") / f"{kind}_{time.strftime('%Y-%m-%d_%H-%M-%S')}"


def one_of(name: str, value: str, allowed: tuple[str, ...], hint: str = "") -> str:
    """The value, or a clear error that lists those that are meant, or all allowed ones."""
    if value not in allowed:
        near = difflib.get_close_matches(value, allowed, 3)
        raise ConfigError(
            f"--{name} {value}",
            expected="one like " + ", ".join(near) if near else "one of " + ", ".join(allowed),
            hint=hint or f"give --{name} {(near or allowed)[0]}, or leave it out",
        )
    return value
