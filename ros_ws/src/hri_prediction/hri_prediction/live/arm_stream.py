"""From the markers of one frame to samples of arms, with the mappings of the importers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hri_prediction.arm.geometry import SIDES, FloatArray
from hri_prediction.errors import ConfigError, DataError
from hri_prediction.tracks.importers.axes import Axes, parse_axes, turn_up
from hri_prediction.tracks.importers.convert import arm_keypoints
from hri_prediction.tracks.importers.mapping import (
    Mapping,
    guess_mapping,
    mapping_parts,
    parse_mapping,
    seen_places,
)
from hri_prediction.tracks.importers.markers import MarkerData, unique_labels
from hri_prediction.tracks.placement import Placement
from hri_prediction.tracks.track import ArmSample

MM = 0.001


@dataclass(frozen=True)
class MarkerLayout:
    """What a source says about its stream.

    Attributes:
        names: Names of the markers, in the order of the stream; may repeat.
        rate_hz: Frames a second; 0 where the source does not say.
        up: Axis that points up, such as ``+z``; empty where the source does not say.
    """

    names: tuple[str, ...]
    rate_hz: float = 0.0
    up: str = ""


@dataclass(frozen=True)
class LiveBody:
    """An arm to be followed.

    Attributes:
        body_id: Its name in the graph.
        mapping: As ``--map`` of the import; empty to guess.
        side: ``left`` or ``right``; empty where the names of the markers tell it.

    Raises:
        ConfigError: when the mapping is malformed, or the side is none.
    """

    body_id: str
    mapping: str = ""
    side: str = ""

    def __post_init__(self) -> None:
        """Check what can be checked without a stream."""
        if self.mapping:
            mapping_parts(self.mapping)
        if self.side not in ("", *SIDES):
            raise ConfigError(
                f"side {self.side!r} of {self.body_id}", expected="left, right or nothing"
            )


class ArmStream:
    """Arms of a stream whose layout is known.

    Args:
        layout: What the source says.
        bodies: Arms to be followed; both arms of a body are two, with the same id.
        placement: Laboratory (z up) to world.
        axes: As ``--axes`` of the import; ``auto`` for what the source says.
        accept_guess: Use guessed mappings and sides; otherwise they are an error that names them.

    Raises:
        ConfigError: a mapping does not fit the layout, a side is not told, or a guess is not accepted.
        DataError: no markers, no arm, or no upward axis is told.
    """

    def __init__(
        self,
        layout: MarkerLayout,
        bodies: Sequence[LiveBody],
        placement: Placement,
        *,
        axes: str = "auto",
        accept_guess: bool = False,
    ) -> None:
        self.layout = layout
        markers = _as_markers(layout)
        self._placement = placement
        self.axes = _axes(layout, axes)
        self._matrix = MM * self.axes.matrix
        self._arms: list[tuple[str, str, Mapping]] = []
        guesses: list[str] = []
        for body in bodies:
            mapping, side, guessed = _arm_of(body, markers)
            self._arms.append((body.body_id, side, mapping))
            if guessed:
                guesses.append(f"{body.body_id}: {mapping.text(markers.labels)}, side {side}")
        if guesses and not accept_guess:
            raise ConfigError(
                f"guessed and not yet agreed to: {'; '.join(guesses)}",
                hint="give it as the parameters maps and sides, or set accept_guess",
            )
        ids = [body_id for body_id, _, _ in self._arms]
        self.mappings = {
            body_id if ids.count(body_id) == 1 else f"{body_id} {side}": (
                f"{mapping.text(markers.labels)}, side {side}"
            )
            for body_id, side, mapping in self._arms
        }
        """What each arm is made of, for people, by its body's name; by name and side where it has both."""

    def samples(self, positions: FloatArray, stamp_ns: int) -> list[tuple[str, ArmSample]]:
        """Body id and sample of every arm; keypoints whose markers are missing are not valid.

        Args:
            positions: Markers in the order of the layout, shape (M, 3) [mm], in the axes of the
                source; NaN, or (0, 0, 0), where not seen.
            stamp_ns: Capture time [ns].

        Raises:
            DataError: when the number of markers is not that of the layout.
        """
        if positions.shape != (len(self.layout.names), 3):
            raise DataError(
                f"a frame holds {len(positions)} markers", expected=str(len(self.layout.names))
            )
        places = positions[None]
        present = seen_places(places, zeros_missing=True)
        found = []
        for body_id, side, mapping in self._arms:
            arm = arm_keypoints(places, present, mapping, self._matrix)[0]
            arm = self._placement.apply(arm)
            valid = np.asarray(np.isfinite(arm).all(axis=1))
            found.append((body_id, ArmSample(stamp_ns, arm, valid, side)))
        return found


def _as_markers(layout: MarkerLayout) -> MarkerData:
    """The names as the mappings take them; all count as seen."""
    return MarkerData(
        format="QTM stream",
        labels=unique_labels(layout.names),
        positions=np.ones((2, len(layout.names), 3)),
        frames=np.arange(2.0),
        rate_hz=layout.rate_hz,
        unit="mm",
        up=layout.up,
    )


def _axes(layout: MarkerLayout, axes: str) -> Axes:
    if axes.strip().lower() != "auto":
        return parse_axes(axes)
    if not layout.up:
        raise DataError(
            "the stream does not say which axis points up", hint="give it as the parameter axes"
        )
    return Axes(turn_up(layout.up), f"the stream says {layout.up} up")


def _arm_of(body: LiveBody, markers: MarkerData) -> tuple[Mapping, str, bool]:
    """Mapping and side of a body, and whether they are guessed."""
    if not body.mapping:
        mapping = guess_mapping(markers, body.side)
        return mapping, body.side or mapping.side or "right", True
    mapping = parse_mapping(body.mapping, markers)
    side = body.side or mapping.side
    if not side:
        raise ConfigError(
            f"the markers of {body.body_id} do not tell which arm it is",
            hint="give left or right as the parameter sides",
        )
    if mapping.side and side != mapping.side:
        raise ConfigError(
            f"{body.body_id} is said to be the {side} arm, but its markers are of the "
            f"{mapping.side} arm",
            hint="correct the parameter sides or maps",
        )
    return mapping, side, False
