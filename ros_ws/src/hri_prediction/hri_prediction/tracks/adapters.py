"""Recordings of other laboratories as arm tracks.

**ADL Vicon reaches** (github.com/MiaH-kin/UE_ADLdatabase, MIT; as an ``.npz`` with ``pos`` (rows,
joints, 3) [m], ``joint_names``, and per trial ``start``, ``length``, ``onset``, ``subject``,
``side``, ``trial``, ``task``; 100 Hz). Axes, kept as they are: x to the subject's right, y forward
(where the subject looks), z up, table at z = 0. ``hand_tip`` is the joint ``fingertip``, the other
three have our names. The subject is ``ADL001`` and so on; time is 0 at the onset of the movement.
The shoulder marker is the greater tubercle, so the upper arm reads about 33 mm short.

**QTM text exports** (Qualisys Track Manager, tab separated, of the marker set of Gutzeit et al.,
github.com/dfki-ric/vMCI_segmentation, BSD-3). Read by column name and by the ``Frame`` column:
time = (Frame - 1) / FREQUENCY; frames that are left out become gaps in time. Millimetres become
metres; empty, ``nan`` and ``null`` mean not seen. Axes, kept: z up; both subjects face -y with +x
to their left (the box that they reach for lies at y = -0.8 m; the back marker lies at greater x
than the right shoulder). The set has no wrist and no true finger tip:

* wrist: the hand carries three markers on its back, ``Hand right`` and ``Hand left`` near the
  wrist and ``Hand top`` near the knuckles. The proxy continues the line from ``Hand top`` to the
  middle of the other two by 30 mm. It is rigid in the hand and lies 0.26-0.31 m from the elbow.
* hand tip: ``Index``; where the file has no such column, ``Middle``. (Not both: ``Middle`` is
  hidden 4-17 % of the time, and switching would make the tip jump by 30 mm.)
* side: from the markers ``Back left`` and ``Back right``; without them, right.

The same runs also exist as an ``.npz`` with ``pos`` (rows, markers, 3) [m], ``marker_names``,
``rate_hz`` and per run ``subject``, ``run``, ``start``, ``length``, and their hand-made labels
(:mod:`hri_prediction.tracks.labels`). Time is 0 at the first row of a run.
"""

from __future__ import annotations

import re
from collections.abc import Mapping

import numpy as np

from hri_prediction.arm.geometry import FloatArray
from hri_prediction.errors import DataError, cut, shown
from hri_prediction.tracks.importers.qtm import read_qtm
from hri_prediction.tracks.tables import one_number, row_spans
from hri_prediction.tracks.track import ArmTrack

WRIST_BEHIND_HAND_M = 0.03
"""QTM: how far the wrist lies behind the middle of the two rear hand markers [m]."""

_ADL_JOINTS = ("shoulder", "elbow", "wrist", "fingertip")
_ADL_ARRAYS = ("pos", "joint_names", "start", "length", "onset", "subject", "side", "trial")
_RUN_ARRAYS = ("pos", "marker_names", "rate_hz", "subject", "run", "start", "length")
ADL_RATE_HZ = 100.0
"""Rate of all trials of the ADL data [Hz]."""
_ADL_SIDES = {"L": "left", "R": "right"}


def is_adl_arrays(arrays: Mapping[str, np.ndarray]) -> bool:
    """Whether the arrays of an ``.npz`` are laid out like the ADL Vicon reaches."""
    return "pos" in arrays and "joint_names" in arrays and "onset" in arrays


def tracks_from_adl(arrays: Mapping[str, np.ndarray], source: str) -> list[ArmTrack]:
    """ADL Vicon trials as tracks (see the module for axes and names).

    Args:
        arrays: The arrays of the file.
        source: Name of the file.

    Returns:
        One track a trial, time 0 at the onset of the movement [s].

    Raises:
        DataError: when an array is missing or has an unusable shape or value.
    """
    missing = [name for name in _ADL_ARRAYS if name not in arrays]
    if missing:
        raise DataError(f"array {missing[0]} is missing", expected=", ".join(_ADL_ARRAYS))
    names = _names(arrays, "joint_names")
    absent = [joint for joint in _ADL_JOINTS if joint not in names]
    if absent:
        raise DataError(f"joint_names are {cut(', '.join(names))}", expected=absent[0])
    pos = arrays["pos"]
    if pos.ndim != 3 or pos.shape[1:] != (len(names), 3) or pos.dtype.kind != "f":
        raise DataError(
            f"pos is {pos.dtype} {pos.shape}", expected=f"floats (rows, {len(names)}, 3)"
        )
    columns = [names.index(joint) for joint in _ADL_JOINTS]
    spans = row_spans(arrays, len(pos))
    # The drinking trials of the same laboratory carry no task.
    tasks = arrays.get("task", np.full(len(spans), "drink"))
    kinds = {"onset": "iu", "subject": "iu", "trial": "iu", "side": "U"}
    for name, array in ((name, arrays[name]) for name in kinds):
        if array.shape != (len(spans),) or array.dtype.kind not in kinds[name]:
            what = "texts" if kinds[name] == "U" else "integers"
            raise DataError(
                f"{name} is {array.dtype} {array.shape}", expected=f"{what} ({len(spans)},)"
            )
    if tasks.shape != (len(spans),) or tasks.dtype.kind != "U":
        raise DataError(f"task is {tasks.dtype} {tasks.shape}", expected=f"texts ({len(spans)},)")
    tracks = []
    for trial, (first, last) in enumerate(spans):
        side = str(arrays["side"][trial])
        if side not in _ADL_SIDES:
            raise DataError(f"side of trial {trial} is {shown(side)}", expected="L or R")
        tracks.append(
            ArmTrack(
                time_s=(np.arange(last - first, dtype=float) - float(arrays["onset"][trial]))
                / ADL_RATE_HZ,
                keypoints=pos[first:last, columns],
                side=_ADL_SIDES[side],
                subject=f"ADL{int(arrays['subject'][trial]):03d}",
                task=str(tasks[trial]),
                trial=int(arrays["trial"][trial]),
                source=source,
            )
        )
    return tracks


def tracks_from_qtm(text: str, source: str) -> list[ArmTrack]:
    """One QTM export as one track (see the module for axes, wrist and side).

    Args:
        text: Content of the file.
        source: Name of the file; ``subject1_run2.tsv`` also gives subject and trial.

    Raises:
        DataError: when the frequency, a column or a marker is missing, a row is ragged or holds no
            numbers, or frames do not increase.
    """
    data = read_qtm(text, source)
    markers = {name: 1e-3 * data.positions[:, column] for column, name in enumerate(data.labels)}
    match = re.match(r"(?P<subject>.+)_run(?P<run>\d+)", source)
    return [
        ArmTrack(
            time_s=(data.frames - 1.0) / data.rate_hz,
            keypoints=_qtm_keypoints(markers),
            side=_qtm_side(markers),
            subject=match["subject"] if match else "",
            trial=int(match["run"]) if match else 0,
            source=source,
        )
    ]


def is_run_arrays(arrays: Mapping[str, np.ndarray]) -> bool:
    """Whether the arrays of an ``.npz`` are laid out like the pick-and-place runs."""
    return "pos" in arrays and "marker_names" in arrays and "run" in arrays


def tracks_from_runs(arrays: Mapping[str, np.ndarray], source: str) -> list[ArmTrack]:
    """Pick-and-place runs as tracks, with the keypoints of the QTM exports.

    Args:
        arrays: The arrays of the file.
        source: Name of the file.

    Raises:
        DataError: when an array is missing or has an unusable shape or value.
    """
    missing = [name for name in _RUN_ARRAYS if name not in arrays]
    if missing:
        raise DataError(f"array {missing[0]} is missing", expected=", ".join(_RUN_ARRAYS))
    names = _names(arrays, "marker_names")
    pos = arrays["pos"]
    if pos.ndim != 3 or pos.shape[1:] != (len(names), 3) or pos.dtype.kind != "f":
        raise DataError(
            f"pos is {pos.dtype} {pos.shape}", expected=f"floats (rows, {len(names)}, 3)"
        )
    spans = row_spans(arrays, len(pos))
    for name in ("subject", "run"):
        if arrays[name].shape != (len(spans),) or arrays[name].dtype.kind not in "iu":
            raise DataError(
                f"{name} is {arrays[name].dtype} {arrays[name].shape}",
                expected=f"integers ({len(spans)},)",
            )
    rate = one_number(arrays, "rate_hz")
    if not rate > 0.0:
        raise DataError(f"rate_hz is {rate}", expected="one positive number")
    tracks = []
    for number, (first, last) in enumerate(spans):
        points = pos[first:last].astype(float)
        markers = {name: points[:, column] for column, name in enumerate(names)}
        tracks.append(
            ArmTrack(
                time_s=np.arange(last - first) / rate,
                keypoints=_qtm_keypoints(markers),
                side=_qtm_side(markers),
                subject=f"subject{int(arrays['subject'][number])}",
                trial=int(arrays["run"][number]),
                source=source,
            )
        )
    return tracks


def _names(arrays: Mapping[str, np.ndarray], key: str) -> list[str]:
    """A list of texts."""
    names = arrays[key]
    if names.ndim != 1 or names.dtype.kind != "U":
        raise DataError(f"{key} is {names.dtype} {names.shape}", expected="texts (names,)")
    return [str(name) for name in names]


def _qtm_keypoints(markers: Mapping[str, FloatArray]) -> FloatArray:
    tip = "Index" if "Index" in markers else "Middle"
    wanted = ("Shoulder", "Elbow", "Hand top", "Hand right", "Hand left", tip)
    missing = [name for name in wanted if name not in markers]
    if missing:
        raise DataError(
            f"marker {missing[0]} is missing",
            expected=", ".join(wanted[:-1]) + ", Index or Middle",
            hint="scripts/import_mocap.py takes QTM exports of any marker set",
        )
    rear = 0.5 * (markers["Hand right"] + markers["Hand left"])
    back = rear - markers["Hand top"]
    length = np.linalg.norm(back, axis=-1, keepdims=True)
    wrist = rear + WRIST_BEHIND_HAND_M * back / np.where(length > 0.0, length, np.nan)
    return np.stack((markers["Shoulder"], markers["Elbow"], wrist, markers[tip]), axis=1)


def _qtm_side(markers: Mapping[str, FloatArray]) -> str:
    if "Back left" not in markers or "Back right" not in markers:
        return "right"
    leftward = markers["Back left"] - markers["Back right"]
    offset = markers["Shoulder"] - 0.5 * (markers["Back left"] + markers["Back right"])
    along = np.einsum("ni,ni->n", leftward, offset)
    seen = along[np.isfinite(along)]
    return "left" if len(seen) and np.median(seen) > 0.0 else "right"
