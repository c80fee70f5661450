"""Files that other people's software wrote, against coordinates taken from them by other means.

The coordinates were read with ``struct`` (C3D), by splitting lines (TRC, CSV), and with SciPy's
rotations (BVH), not with the readers under test.
"""

import os
from pathlib import Path

import numpy as np
import pytest

from hri_prediction.errors import DataError
from hri_prediction.tracks.files import load_tracks, save_tracks
from hri_prediction.tracks.importers import cli
from hri_prediction.tracks.importers.convert import ImportOptions, convert, plan_import
from hri_prediction.tracks.importers.recognise import read_markers
from hri_prediction.tracks.plausible import SEGMENT_M

CMU = 0.0254 / 0.45
NO_ARM = "no arm is recognised among the markers"
CLUSTERS = "shoulder=RAR1,elbow=RFA1,wrist=RFA2"
CLUSTER_PLACES = {
    (10, 0): (0.47238556, 0.13187430, 1.25885120),
    (10, 1): (0.54436810, 0.13299902, 1.00634991),
    (10, 2): (0.50162843, 0.23141267, 0.98441772),
}

# file, options, then frames, rate, side, subject, {(row, keypoint): metres}, or a refusal
CASES = [
    ("adl_vicon_csv_mit/ADL001FR1.csv", {}, "ADL001:RGTH, .* never seen"),
    (
        "adl_vicon_csv_mit/ADL001FR1.csv",
        {"mapping": "shoulder=RGTH,elbow=RUAR1,wrist=RLAR1"},
        "the shoulder is never seen: ADL001:RGTH",
    ),
    (
        "adl_vicon_csv_mit/ADL001FR1.csv",
        {"mapping": "shoulder=RSHO1,elbow=RUAR1+RUAR2,wrist=RLAR1,hand_tip=RFTP"},
        (339, 100.0, "right", "ADL001", {(0, 0): (0.129567566, -0.277534943, 0.354296478)}),
    ),
    (
        "adl_vicon_csv_mit/ADL001_static.csv",
        {},
        (
            41,
            100.0,
            "right",
            "ADL001",
            {
                (10, 0): (0.191321014, -0.292804047, 0.373414276),
                (10, 1): (0.163692648, -0.046851221, 0.2570101775),
                (10, 3): (0.134907593, 0.367302155, 0.336445526),
            },
        ),
    ),
    (
        "bvh11_cmu/131_01.bvh",
        {},
        (
            994,
            120.0005,
            "right",
            "",
            {
                (0, 0): (2.52083 * CMU, 32.50394 * CMU, 21.94740 * CMU),
                (500, 2): (4.97103 * CMU, 22.46613 * CMU, 20.47016 * CMU),
                (500, 3): (5.35435 * CMU, 22.93154 * CMU, 21.40384 * CMU),
            },
        ),
    ),
    (
        "bvh11_cmu/131_01.bvh",
        {"side": "left", "units": "1", "axes": "x,y,z"},
        (994, 120.0005, "left", "", {(500, 2): (10.51778, 14.39784, -28.41507)}),
    ),
    *((f"kineticstoolkit_apache2/{name}.c3d", {}, NO_ARM) for name in ("pc_real", "pc_int")),
    *((f"kineticstoolkit_apache2/{name}.c3d", {}, NO_ARM) for name in ("dec_real", "dec_int")),
    *(
        (
            f"kineticstoolkit_apache2/{name}.c3d",
            {"mapping": CLUSTERS},
            (89, 50.0, "right", "", CLUSTER_PLACES),
        )
        for name in ("pc_real", "pc_int", "dec_real", "dec_int")
    ),
    (
        "kineticstoolkit_apache2/kinematics_racing_full.c3d",
        {"axes": "y-up"},
        (
            700,
            69.9926147,
            "right",
            "",
            {
                (0, 0): (-0.3874277, -0.0202298, 0.9613500),
                (100, 1): (-0.6572619, -0.0827535, 0.8461361),
                (100, 2): (-0.9052459, -0.1483682, 0.7687200),
            },
        ),
    ),
    (
        "kineticstoolkit_apache2/kinematics_tennis_serve_2players.c3d",
        {},
        "2 people have an arm: Derrick, Viktor; choose one with --subject",
    ),
    (
        "kineticstoolkit_apache2/kinematics_tennis_serve_2players.c3d",
        {"subject": "Viktor", "side": "left"},
        (
            599,
            50.0,
            "left",
            "Viktor",
            {
                (0, 0): (1.6354886, -0.6748774, 1.3058834),
                (100, 2): (1.4888756, -0.2263476, 1.7970151),
            },
        ),
    ),
    (
        "opensim_apache2/dataWithEformat.trc",
        {},
        (
            5,
            119.88012,
            "right",
            "",
            {(0, 0): (-0.0517, 1.70, 0.305), (4, 1): (-0.2305, 1.66, 0.023395)},
        ),
    ),
    ("opensim_apache2/dataWithNaNsOfDifferentCases.trc", {}, NO_ARM),
    ("opensim_apache2/exampleFormat.trc", {}, f"{NO_ARM}.*marker1, marker2, marker3"),
    (
        "opensim_apache2/exampleFormat.trc",
        {"mapping": "shoulder=marker1,elbow=marker2,wrist=marker3"},
        (
            5,
            100.0,
            "right",
            "",
            {
                (0, 0): None,
                (0, 1): (-0.152, 1.71, 0.245),
                (2, 0): (-0.273, 1.57, 0.0745),
                (2, 1): None,
            },
        ),
    ),
    *(
        (
            f"pyomeca_apache2/{name}",
            {},
            (
                580,
                100.0,
                "right",
                "Daphnee",
                {
                    (100, 0): (0.727107, 0.361260, 0.663532),
                    (100, 1): (0.471218, 0.449189, 0.518384),
                    (100, 3): (0.264665, 0.328575, 0.744718),
                },
            ),
        )
        for name in ("markers.csv", "markers_analogs.c3d")
    ),
    (
        "pyomeca_apache2/markers.trc",
        {},
        (
            93,
            100.0,
            "right",
            "",
            {
                (50, 0): (0.6862784, 0.4058206, 0.6185284),
                (50, 1): (0.6870350, 0.4308804, 0.2924909),
                (50, 3): (0.5847056, 0.5644372, 0.0167029),
            },
        ),
    ),
]


def _folder() -> Path:
    folder = os.environ.get("HRI_DATA_DIR")
    if not folder:
        pytest.skip("HRI_DATA_DIR is not set")
    return Path(folder) / "file_samples"


@pytest.mark.parametrize(
    ("file", "options", "expected"),
    CASES,
    ids=[f"{Path(file).name}-{number}" for number, (file, _, _) in enumerate(CASES)],
)
def test_sample(tmp_path, file, options, expected):
    path = _folder() / file
    if isinstance(expected, str):
        with pytest.raises(DataError, match=expected):
            plan_import(read_markers(path), ImportOptions(**options))
        return
    frames, rate, side, subject, places = expected
    track = convert(plan_import(read_markers(path), ImportOptions(**options)))
    assert (len(track), track.side, track.subject) == (frames, side, subject)
    assert track.rate_hz == pytest.approx(rate, rel=1e-5)
    for (row, keypoint), place in places.items():
        if place is None:
            assert not track.valid[row, keypoint]
        else:
            np.testing.assert_allclose(track.keypoints[row, keypoint], place, atol=2e-6)
    save_tracks(tmp_path / "a.npz", [track])
    spans = np.nanmedian(np.linalg.norm(np.diff(track.keypoints, axis=1), axis=-1), axis=0)[:2]
    if spans.min() < SEGMENT_M[0] or spans.max() > SEGMENT_M[1]:  # these markers are no arm
        with pytest.raises(DataError, match="m long"):
            load_tracks(tmp_path / "a.npz")
        return
    (loaded,) = load_tracks(tmp_path / "a.npz")
    np.testing.assert_array_equal(loaded.keypoints, track.keypoints)


def test_every_sample_is_covered():
    endings = (".c3d", ".trc", ".bvh", ".csv")
    folder = _folder()
    found = {str(p.relative_to(folder)) for p in folder.rglob("*") if p.suffix in endings}
    assert found == {file for file, _, _ in CASES}


def _samples():
    folder = os.environ.get("HRI_DATA_DIR")
    found = sorted((Path(folder) / "file_samples").rglob("*.*")) if folder else []
    return [path for path in found if path.suffix in (".c3d", ".trc", ".bvh", ".csv")]


@pytest.mark.skipif(not _samples(), reason="HRI_DATA_DIR is not set")
@pytest.mark.parametrize("path", _samples(), ids=lambda path: path.name)
def test_the_command_writes_or_says_why_not_in_one_line(tmp_path, capsys, path):
    out = tmp_path / "a.npz"
    code = cli.main([str(path), "--out", str(out), "--yes"])
    said = capsys.readouterr()
    assert code == int(not out.exists())
    if code:
        assert said.err.count("\n") == 1
        assert str(path) in said.err
        assert "give --map" in said.err or "choose one with --subject" in said.err
        return
    assert said.err == ""
    (track,) = load_tracks(out)
    upper, fore, _ = np.nanmedian(np.linalg.norm(np.diff(track.keypoints, axis=1), axis=-1), axis=0)
    assert 0.2 < upper < 0.4
    assert 0.15 < fore < 0.35


@pytest.mark.parametrize("run", range(15))
def test_qtm_recordings_against_their_archive(run):
    folder = os.environ.get("HRI_DATA_DIR")
    if not folder:
        pytest.skip("HRI_DATA_DIR is not set")
    folder = Path(folder) / "pickplace_dfki_qualisys"
    with np.load(folder / "runs.npz", allow_pickle=False) as archive:
        name = f"subject{archive['subject'][run]}_run{archive['run'][run]}.tsv"
        first = archive["first_frame"][run]
        rows = slice(archive["start"][run], archive["start"][run] + archive["length"][run])
        positions, names = archive["pos"][rows], list(archive["marker_names"])
    data = read_markers(folder / "original" / name)
    assert data.frames[0] == first
    assert sorted(data.labels) == sorted(names)
    order = [data.labels.index(label) for label in names]
    np.testing.assert_allclose(1e-3 * data.positions[:, order], positions, rtol=1e-6, atol=1e-6)
