"""Which of the formats a file has, found out by its content."""

from __future__ import annotations

from pathlib import Path

from hri_prediction.errors import DataError
from hri_prediction.files.content import read_content
from hri_prediction.tracks.importers.bvh import is_bvh, read_bvh
from hri_prediction.tracks.importers.c3d import is_c3d, read_c3d
from hri_prediction.tracks.importers.markers import MarkerData
from hri_prediction.tracks.importers.qtm import is_qtm_text, read_qtm
from hri_prediction.tracks.importers.text import decode
from hri_prediction.tracks.importers.trc import is_trc, read_trc
from hri_prediction.tracks.importers.vicon import is_vicon, read_vicon

_TEXTS = (
    (is_bvh, read_bvh),
    (is_trc, read_trc),
    (is_vicon, read_vicon),
    (is_qtm_text, read_qtm),
)
KNOWN = "C3D, TRC, BVH, a Vicon Nexus CSV or a QTM TSV export"


def read_markers(path: str | Path) -> MarkerData:
    """Read a motion capture file of another program.

    Raises:
        DataError: when it cannot be read, has none of the formats, or is malformed; the text names
            the file and the first thing that is wrong.
    """
    path = Path(path)
    content = read_content(path)
    try:
        if path.suffix.lower() == ".c3d" or is_c3d(content):
            return read_c3d(path, content)
        text = decode(content)
        for matches, read in _TEXTS:
            if matches(text):
                return read(text, path.name)
    except DataError as error:
        raise DataError(
            f"{path}: {error.problem}", expected=error.expected, hint=error.hint
        ) from error
    raise DataError(f"{path} has a bad header, or is of another format", expected=KNOWN)
