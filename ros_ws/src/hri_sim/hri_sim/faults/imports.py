"""Recordings that are cut, have wrong bits or lengths of another unit, or are none, given to the import."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hri_planner.policy.model_file import find_any
from hri_prediction.bags import BagWriter
from hri_prediction.errors import HriError
from hri_prediction.tracks.files import load_tracks
from hri_sim.faults.ended import SECONDS, ended
from hri_sim.faults.exports import EXPORTS, FRAMES
from hri_sim.reliability.damage import cut, flipped
from hri_sim.reliability.fault import FILES, Fault, Figure, Place, Trial

SCRIPT = "hri_prediction.tracks.importers.cli"
"""What scripts/import_mocap.py runs."""
CALLED = "import_mocap.py: "
"""How what it says begins."""
MAPS = {"bvh": "shoulder=RightArm,elbow=RightForeArm,wrist=RightHand"}
MAP = "shoulder=RSHO,elbow=RELB,wrist=RWRA+RWRB,hand_tip=RFIN"
UNITS = {"bvh": "mm"}
"""Said on the command line where the file says none."""
OTHER_UNITS = (0.001, 0.1, 10.0, 25.4, 304.8, 1000.0)
"""So many times too long is an arm whose lengths are of another unit than the file says: those between
these that make an arm of possible length cannot be told by it."""
BEFORE = b"what was there before"
KEYS = ("other_errors", "left_behind", "taken", "altered", "unnoticed", "refused", "untold")


@dataclass(frozen=True)
class Import:
    """What came of a file.

    Attributes:
        code: Exit code; none: it did not end.
        said: What was said as errors.
        kept: Whether the output, and all around it, is as it was before.
        keypoints: Of the track that was written; none: there is none, or it cannot be read.
    """

    code: int | None
    said: str
    kept: bool
    keypoints: NDArray[np.float64] | None = None

    def refused(self, name: str) -> bool:
        """Whether it was refused with one clear error: one line, which names the file."""
        lines = self.said.strip().splitlines()
        one = len(lines) == 1 and lines[0].startswith(CALLED) and name in lines[0]
        return one and self.code in (1, 2)

    @property
    def told(self) -> bool:
        """Whether the error says more than what is wrong: an :class:`HriError` puts it behind a ``;``."""
        return "; " in self.said


def run_import(path: Path, out: Path) -> Import:
    """Import a file with the script, over a file that is there already.

    Args:
        path: The file.
        out: Track file, in a folder of its own.
    """
    out.parent.mkdir(exist_ok=True)
    out.write_bytes(BEFORE)
    ending = path.suffix.removeprefix(".")
    words = [
        "--map",
        MAPS.get(ending, MAP),
        "--side",
        "right",
        "--units",
        UNITS.get(ending, "auto"),
    ]
    axes = "y-up" if ending == "bvh" else "z-up"
    command: list[str | Path] = [
        sys.executable,
        "-m",
        SCRIPT,
        path,
        *words,
        "--axes",
        axes,
        "--yes",
        "--out",
        out,
    ]
    done = ended(command)
    if done is None:
        return Import(None, f"nothing for {SECONDS:g} s", kept=False)
    kept = list(out.parent.iterdir()) == [out] and out.read_bytes() == BEFORE
    keypoints = None
    if done.returncode == 0:
        try:
            (track,) = load_tracks(out)
            keypoints = track.keypoints
        except HriError as error:
            return Import(0, str(error), kept)
    return Import(done.returncode, done.stderr, kept, keypoints)


def no_recordings(rng: np.random.Generator, ending: str, folder: Path) -> list[bytes]:
    """What has the ending of a recording and is something else."""
    folder.mkdir(parents=True, exist_ok=True)
    with BagWriter(folder / "bag"):
        pass
    (bag,) = (folder / "bag").glob("*.mcap")
    # A reader of texts goes by what is in the file, whatever its ending; one of C3D goes by the ending too.
    others = [write(rng, 1.0) for name, write in EXPORTS.items() if name != ending == "c3d"]
    return [
        b"",
        bytes(1000),
        rng.bytes(int(rng.integers(1, 5000))),
        b"This is a text.\nIt is no recording.\n",
        b"time,x,y,z\n0.0,1.0,2.0,3.0\n0.1,1.0,2.0,3.0\n",
        b'{"format": "none", "values": [1, 2, 3]}\n',
        b"\x89PNG\r\n\x1a\n" + rng.bytes(500),
        bag.read_bytes(),
        find_any("dmp_transfer").read_bytes(),
        *others,
    ]


def malformed(seeds: Sequence[int], place: Place) -> Iterator[Trial]:
    """Each format cut, with wrong bits, of another unit, and of another kind, once a repetition."""
    for seed in seeds:
        rng = np.random.default_rng(seed)
        folder = place.folder / str(seed)
        counts = dict.fromkeys(KEYS, 0.0)
        said = ""
        for ending, write in EXPORTS.items():
            path, out = folder / f"recording.{ending}", folder / "out" / "track.npz"
            no_recording = no_recordings(rng, ending, folder / f"others_{ending}")
            whole = write(rng, 1.0)
            path.write_bytes(whole)
            original = run_import(path, out).keypoints
            if original is None:
                raise HriError(f"{path} is not imported as it is")
            damages = {
                "cut": cut(rng, whole),
                "flipped": flipped(rng, whole),
                "unit": write(rng, float(rng.choice(OTHER_UNITS))),
                "kind": no_recording[int(rng.integers(len(no_recording)))],
            }
            for damage, content in damages.items():
                path.write_bytes(content)
                came = run_import(path, out)
                _count(counts, came, damage, path.name, original)
                said = said or came.said.strip().replace(f"{folder}/", "")
        yield Trial(seed, counts, said)


def _count(
    counts: dict[str, float],
    came: Import,
    damage: str,
    name: str,
    original: NDArray[np.float64],
) -> None:
    """Add what came of a file."""
    if came.code == 0 and came.keypoints is not None:
        counts["taken"] += damage in ("unit", "kind")
        counts["altered"] += damage == "cut" and not _begins_as(came.keypoints, original)
        counts["unnoticed"] += damage == "flipped" and not (
            came.keypoints.shape == original.shape
            and np.array_equal(came.keypoints, original, equal_nan=True)
        )
        return
    refused = came.refused(name)
    counts["other_errors"] += not refused
    counts["left_behind"] += not came.kept
    counts["refused"] += refused
    counts["untold"] += refused and not came.told


def _begins_as(keypoints: NDArray[np.float64], original: NDArray[np.float64]) -> bool:
    """Whether a track is the beginning of another, but for its last row.

    A text may end in the midst of its last number, and what is left of that is a number as well: of
    formats that do not count their rows nothing tells it.
    """
    rows = len(keypoints) - 1
    return rows < FRAMES and np.allclose(keypoints[:rows], original[:rows], equal_nan=True)


IMPORTS = (
    Fault(
        "malformed_import",
        "malformed recordings",
        "C3D, TRC, Vicon CSV, QTM TSV and BVH files, each once a repetition: ends anywhere; 1 to 8 bits "
        "are wrong; lengths of another unit than it says; no recording at all",
        "one clear error that names the file, exit code not 0, and what was there is as it was; or what "
        "was recorded",
        FILES,
        (
            Figure(
                "other_errors", "ends otherwise than by an import or one clear error", limit=0.0
            ),
            Figure("left_behind", "refused, and something written or overwritten", limit=0.0),
            Figure("taken", "imported though of another unit, or no recording", limit=0.0),
            Figure("altered", "ends early, and imported with what was not recorded", limit=0.0),
            Figure("unnoticed", "wrong bits that change what is imported, which no format tells"),
            Figure("untold", "errors without what was expected or what to do", limit=0.0),
            Figure("refused", f"refused with one clear error, of {4 * len(EXPORTS)}"),
        ),
        malformed,
    ),
)
"""Faults of recordings of others."""
