"""Qualisys Track Manager: what its real-time protocol says, without the connection."""

from __future__ import annotations

from dataclasses import dataclass
from xml.etree import ElementTree

from hri_prediction.arm.geometry import FloatArray
from hri_prediction.errors import DataError
from hri_prediction.live.arm_stream import MarkerLayout

_UPWARDS = ("+x", "-x", "+y", "-y", "+z", "-z")


@dataclass(frozen=True, eq=False)
class QtmFrame:
    """One frame of the stream.

    Attributes:
        layout: What QTM said when this stream began; the same object for all frames of it.
        number: Frame number of the measurement.
        source_ns: Time since the start of the measurement [ns].
        received_ns: Time of receipt [ns].
        positions: Markers, shape (M, 3) [mm], in QTM's axes; NaN where not seen.
    """

    layout: MarkerLayout
    number: int
    source_ns: int
    received_ns: int
    positions: FloatArray


def read_layout(xml: str | bytes) -> MarkerLayout:
    """Layout in QTM's answer to ``GetParameters General 3D``.

    Raises:
        DataError: when it is no such answer, or names no markers.
    """
    try:
        root = ElementTree.fromstring(xml.strip())
    except (ElementTree.ParseError, LookupError, ValueError) as error:
        # The last two: of an encoding that there is not, or that the parser does not take.
        raise DataError(f"QTM's parameters are no XML: {error}") from error
    settings = root.find("The_3D")
    names = [
        (label.findtext("Name") or "").strip()
        for label in (settings.findall("Label") if settings is not None else ())
    ]
    if settings is None or not names:
        raise DataError(
            "QTM names no markers",
            hint="load an identification model (AIM), or open a file whose trajectories are labelled",
        )
    up = (settings.findtext("AxisUpwards") or "").strip().lower()
    try:
        rate = float(root.findtext("General/Frequency") or 0.0)
    except ValueError:
        rate = 0.0
    return MarkerLayout(tuple(names), rate, up if up in _UPWARDS else "")
