"""From markers to a track: decisions that are given or found, then arithmetic."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hri_prediction.arm.geometry import KEYPOINTS, FloatArray
from hri_prediction.errors import ConfigError, DataError
from hri_prediction.tracks.importers.axes import Axes, find_axes, parse_axes
from hri_prediction.tracks.importers.mapping import (
    Mapping,
    guess_mapping,
    mean_position,
    parse_mapping,
    seen,
)
from hri_prediction.tracks.importers.markers import MarkerData, subject_of
from hri_prediction.tracks.importers.units import (
    POSSIBLE_ARM_M,
    Scale,
    arm_length,
    find_scale,
    parse_units,
)
from hri_prediction.tracks.track import ArmTrack

HAND_M = 0.09
"""Wrist to hand tip where no marker shows it [m], straight on from the forearm; the predictor's too."""
_CLOCK_TOLERANCE = 0.02
"""Relative difference between the file's times and its rate that is put down to rounding."""


@dataclass(frozen=True)
class ImportOptions:
    """What the user says about a file; the rest is found out.

    Attributes:
        mapping: As ``--map``; empty to guess.
        side: ``left`` or ``right``; empty to guess.
        units: A unit, a number of metres, or ``auto``.
        axes: As :func:`.axes.parse_axes`, or ``auto``.
        rate_hz: Frames a second; 0 for what the file says.
        subject: Name of the person; empty for the one that the labels name.
        task: Name of the movement.
        trial: Number of the trial.
        keep_zeros: (0, 0, 0) is a place, not a marker that was not seen.
    """

    mapping: str = ""
    side: str = ""
    units: str = "auto"
    axes: str = "auto"
    rate_hz: float = 0.0
    subject: str = ""
    task: str = ""
    trial: int = 0
    keep_zeros: bool = False


@dataclass(frozen=True)
class ImportPlan:
    """How a file is imported, and what of it was guessed.

    Attributes:
        data: The markers.
        mapping: Which of them are the arm.
        mapping_guessed: The mapping should be confirmed.
        side: ``left`` or ``right``.
        side_guessed: The side should be confirmed.
        scale: Unit of length.
        arm_m: Length of the arm in that unit [m].
        axes: Axes of the file behind those of the track.
        rate_hz: Frames a second.
        subject: Name of the person.
        options: What the user said.
    """

    data: MarkerData
    mapping: Mapping
    mapping_guessed: bool
    side: str
    side_guessed: bool
    scale: Scale
    arm_m: float
    axes: Axes
    rate_hz: float
    subject: str
    options: ImportOptions

    @property
    def guessed(self) -> bool:
        """Something should be confirmed."""
        parts = (self.mapping_guessed, self.side_guessed, self.scale.guessed, self.axes.guessed)
        return any(parts)

    def notes(self) -> tuple[str, ...]:
        """What a person should know before agreeing."""
        notes = [*self.data.notes, *self.mapping.notes]
        if not self.mapping.hand_tip:
            notes.append(
                f"no hand tip: it is put {HAND_M:g} m beyond the wrist, in line with the forearm"
            )
        if not POSSIBLE_ARM_M[0] <= self.arm_m <= POSSIBLE_ARM_M[1]:
            notes.append(f"with the unit {self.scale.text} the arm is {self.arm_m:.3g} m long")
        if self.axes.mirrored:
            notes.append("the axes mirror: right only for a file with left-handed axes")
        return tuple(notes)


def plan_import(data: MarkerData, options: ImportOptions) -> ImportPlan:
    """Decide what the options leave open.

    Raises:
        ConfigError: an option that is malformed or does not fit the file.
        DataError: no arm, no unit or no rate can be found, or the arm is never seen.
    """
    if options.keep_zeros:
        data = dataclasses.replace(data, zeros_missing=False)
    if options.mapping:
        mapping = parse_mapping(options.mapping, data, options.subject)
    else:
        mapping = guess_mapping(data, options.side, options.subject)
    if options.side and mapping.side and options.side != mapping.side:
        raise ConfigError(
            f"--side {options.side}, but the markers {mapping.text(data.labels)} are of the "
            f"{mapping.side} arm",
            hint="correct --side or --map",
        )
    present = seen(data)
    points = [mean_position(data.positions, present, r) for _, r in mapping.items() if r]
    _check_seen(data, mapping, points)
    arm = arm_length(points[0], points[1], points[2])
    auto = options.units.strip().lower() == "auto"
    scale = find_scale(data.unit, arm) if auto else parse_units(options.units)
    people = {subject_of(data.labels[rows[0]]) for _, rows in mapping.items() if rows}
    return ImportPlan(
        data=data,
        mapping=mapping,
        mapping_guessed=not options.mapping,
        side=options.side or mapping.side or "right",
        side_guessed=not (options.side or (mapping.side and options.mapping)),
        scale=scale,
        arm_m=arm * scale.metres,
        axes=find_axes(data)
        if options.axes.strip().lower() == "auto"
        else parse_axes(options.axes),
        rate_hz=_rate(data, options.rate_hz),
        subject=options.subject or (people.pop() if len(people) == 1 else ""),
        options=options,
    )


def _check_seen(data: MarkerData, mapping: Mapping, points: list[FloatArray]) -> None:
    names = [name for name, rows in mapping.items() if rows]
    for name, place in zip(names, points, strict=True):
        if not np.isfinite(place).any():
            rows = getattr(mapping, name)
            raise DataError(
                f"the {name} is never seen: " + " + ".join(data.labels[row] for row in rows),
                expected="at least one frame with all its markers",
                hint="give other markers with --map",
            )
    if not np.isfinite(np.hstack(points[:3])).all(axis=1).any():
        raise DataError(
            "shoulder, elbow and wrist are never seen in the same frame",
            expected="frames in which all three are",
        )


def _rate(data: MarkerData, given: float) -> float:
    """Frames a second, given or found, checked against the file's own times."""
    if not (math.isfinite(given) and given >= 0.0):
        raise ConfigError(f"--rate {given:g}", expected="a positive number of Hz")
    if given:
        return given
    told = math.nan
    if data.clock is not None:
        step = float(np.median(np.diff(data.clock) / np.diff(data.frames)))
        told = 1.0 / step if step > 0.0 else math.nan
    if not data.rate_hz:
        if math.isnan(told):
            raise DataError("the file does not say its frame rate", hint="give it with --rate")
        return told
    if not math.isnan(told) and abs(told / data.rate_hz - 1.0) > _CLOCK_TOLERANCE:
        raise DataError(
            f"the file says {data.rate_hz:g} Hz, but its times are {1.0 / told:.6g} s apart "
            f"({told:.4g} Hz)",
            hint="give the right one with --rate",
        )
    return data.rate_hz


def arm_keypoints(
    positions: FloatArray, present: NDArray[np.bool_], mapping: Mapping, matrix: FloatArray
) -> FloatArray:
    """Shoulder, elbow, wrist and hand tip.

    Args:
        positions: Markers, shape (N, M, 3), in the unit and axes of the file.
        present: Which were seen, shape (N, M).
        mapping: Which of them are the arm; without a hand tip it is put :data:`HAND_M` beyond the
            wrist.
        matrix: Coordinates of the file to metres with z up, shape (3, 3).

    Returns:
        Shape (N, 4, 3) [m], NaN where not seen.
    """
    keypoints = np.full((len(positions), len(KEYPOINTS), 3), np.nan)
    for index, (_, rows) in enumerate(mapping.items()):
        if rows:
            keypoints[:, index] = mean_position(positions, present, rows) @ matrix.T
    if not mapping.hand_tip:
        forearm = keypoints[:, 2] - keypoints[:, 1]
        length = np.linalg.norm(forearm, axis=-1, keepdims=True)
        keypoints[:, 3] = keypoints[:, 2] + HAND_M * forearm / np.where(length > 0, length, np.nan)
    return keypoints


def convert(plan: ImportPlan) -> ArmTrack:
    """The track, in right-handed axes with z up; time 0 is the first frame of the file.

    Raises:
        DataError: when coordinates overflow.
    """
    data = plan.data
    matrix = plan.scale.metres * plan.axes.matrix
    keypoints = arm_keypoints(data.positions, seen(data), plan.mapping, matrix)
    return ArmTrack(
        time_s=(data.frames - data.frames[0]) / plan.rate_hz,
        keypoints=keypoints,
        side=plan.side,
        subject=plan.subject,
        task=plan.options.task,
        trial=plan.options.trial,
        source=f"{data.source} ({data.format}): {plan.mapping.text(data.labels)}, "
        f"units {plan.scale.text}, axes {plan.axes.text}, from frame {data.frames[0]:.0f}",
    )
