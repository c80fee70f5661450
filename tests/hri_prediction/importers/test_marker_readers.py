"""Readers of motion capture files, on files made here: every trap that such files hold."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from mocap_files import ARM, arm_mm, bvh_text, c3d_bytes, qtm_text, trc_text, vicon_text
from scipy.spatial.transform import Rotation

from hri_prediction.errors import DataError
from hri_prediction.tracks.importers.bvh import read_bvh
from hri_prediction.tracks.importers.mapping import seen
from hri_prediction.tracks.importers.qtm import read_qtm
from hri_prediction.tracks.importers.recognise import read_markers
from hri_prediction.tracks.importers.trc import read_trc
from hri_prediction.tracks.importers.vicon import read_vicon

TEXTS = {
    "trc": (trc_text, read_trc),
    "vicon": (vicon_text, read_vicon),
    "qtm": (qtm_text, read_qtm),
}
MISSING = ("", "NaN", "nan", "-NaN", "null", "1.#QNAN", "1.#QNAN0", "-1.#IND", "-nan(ind)", "N/A")


def holes(points):
    """Points with one marker missing in one frame."""
    points = points.copy()
    points[2, 1] = np.nan
    return points


@pytest.mark.parametrize("kind", TEXTS)
@pytest.mark.parametrize("missing", MISSING)
def test_missing_in_every_spelling(kind, missing):
    write, read = TEXTS[kind]
    points = holes(arm_mm())
    data = read(write(points, missing=missing), "a")
    np.testing.assert_allclose(data.positions, points)
    assert data.labels == ARM
    assert data.rate_hz == 100.0


@pytest.mark.parametrize("kind", TEXTS)
def test_zeros_are_missing(kind):
    write, read = TEXTS[kind]
    points = arm_mm()
    points[2, 1] = 0.0
    points[3, 1, :2] = 0.0  # two zeros are a place
    data = read(write(points), "a")
    np.testing.assert_array_equal(seen(data)[:, 1], [True, True, False, True, True])


@pytest.mark.parametrize("kind", TEXTS)
def test_text_with_carriage_returns_and_mark(tmp_path, kind):
    write, _ = TEXTS[kind]
    points = holes(arm_mm())
    text = write(points).replace("\n", "\r\n")
    for encoding in ("utf-8-sig", "utf-16", "cp1252"):
        (tmp_path / "a.txt").write_bytes(text.replace("RFIN", "Rücken").encode(encoding))
        data = read_markers(tmp_path / "a.txt")
        np.testing.assert_allclose(data.positions, points)
        assert data.labels[-1] == "Rücken"


@pytest.mark.parametrize("kind", [*TEXTS, "c3d"])
def test_prefixes_and_repeated_labels(tmp_path, kind):
    labels = ["Ann:RSHO", "Ann:RELB", "Ann:RELB", "box", "Ann:RFIN"]
    if kind == "c3d":
        (tmp_path / "a").write_bytes(c3d_bytes(arm_mm(), labels))
    else:
        (tmp_path / "a").write_text(TEXTS[kind][0](arm_mm(), labels))
    data = read_markers(tmp_path / "a")
    assert data.labels == ("Ann:RSHO", "Ann:RELB#1", "Ann:RELB#2", "box", "Ann:RFIN")
    np.testing.assert_allclose(data.positions, arm_mm(), rtol=1e-6)


@pytest.mark.parametrize("kind", [*TEXTS, "c3d"])
def test_rates_that_are_no_whole_numbers(tmp_path, kind):
    if kind == "c3d":
        (tmp_path / "a").write_bytes(c3d_bytes(arm_mm(), rate=119.88012))
    else:
        (tmp_path / "a").write_text(TEXTS[kind][0](arm_mm(), rate="119.88012"))
    assert read_markers(tmp_path / "a").rate_hz == pytest.approx(119.88012, rel=1e-6)


@pytest.mark.parametrize("kind", TEXTS)
def test_frames_that_are_left_out_are_a_gap(kind):
    write, read = TEXTS[kind]
    lines = write(arm_mm(6), first=7).splitlines()
    last = max(number for number, line in enumerate(lines) if line.strip())
    del lines[last - 2]
    data = read("\n".join(lines) + "\n", "a")
    np.testing.assert_array_equal(data.frames, [7, 8, 9, 11, 12])


@pytest.mark.parametrize("kind", TEXTS)
@pytest.mark.parametrize(
    ("old", "new", "match"),
    [
        ("250.000000", "25O.0", "holds '25O.0'; expected a number"),
        ("250.000000", "inf", "finite"),
        ("250.000000", "250.0{s}1", "line [0-9]+ has [0-9]+ cells"),
        ("\n2{s}", "\n1{s}", "frame 1 follows frame 1"),
    ],
)
def test_malformed_rows(kind, old, new, match):
    write, read = TEXTS[kind]
    separator = "," if kind == "vicon" else "\t"
    text = write(arm_mm()).replace(old, new.format(s=separator)) if "{s}" not in old else None
    if text is None:
        text = write(arm_mm()).replace(old.format(s=separator), new.format(s=separator))
    with pytest.raises(DataError, match=match):
        read(text, "a")


# ------------------------------------------------------------------ TRC
def test_trc_separated_by_commas():
    points = holes(arm_mm())
    data = read_trc(trc_text(points, separator=","), "a")
    np.testing.assert_allclose(data.positions, points)
    assert data.notes == ()


def test_trc_that_cuts_off_what_is_empty_at_the_end():
    points = arm_mm()
    points[1, 3:] = np.nan
    text = trc_text(points)
    lines = [line.rstrip("\t") for line in text.splitlines()]
    np.testing.assert_allclose(read_trc("\n".join(lines) + "\n", "a").positions, points)
    whole = trc_text(arm_mm()).rstrip("\n")
    cut = whole.rsplit("\t", 3)[0]  # the last line lacks a marker because the file was cut off
    with pytest.raises(DataError, match="line 11 has 14 cells"):
        read_trc(cut, "a")


def test_trc_counts_what_is_there():
    text = trc_text(arm_mm()).replace("\t5\t5\tmm", "\t652\t7\tmm")
    assert read_trc(text, "a").notes == (
        "the header says 652 frames, the table has 5",
        "the header says 7 markers, the table has 5",
    )


@pytest.mark.parametrize(
    ("old", "new", "match"),
    [
        ("Frame#", "Bild", "TRC header is bad; expected a line that begins with Frame#"),
        ("Frame#\tTime", "Frame#\tRSHO", "TRC header is bad: line 4"),
        ("DataRate\t", "Rate\t", "TRC header is bad; expected a line with DataRate"),
        ("RSHO\t\t\t", "RSHO\t\t", "marker 'RELB' does not stand above an x"),
        ("\tX1", "\tA1", "TRC header is bad: line 5"),
        ("100\t100", "fast\t100", "DataRate holds 'fast'"),
        ("100\t100", "-5\t100", "frame rate is -5"),
    ],
)
def test_trc_with_a_bad_header(old, new, match):
    with pytest.raises(DataError, match=match):
        read_trc(trc_text(arm_mm()).replace(old, new, 1), "a")


@pytest.mark.parametrize("kind", [*TEXTS, "c3d", "bvh"])
def test_no_points_or_no_frames(tmp_path, kind):
    path = tmp_path / "a.c3d" if kind == "c3d" else tmp_path / "a"
    none, empty = np.zeros((5, 0, 3)), arm_mm(0)
    for points, labels in ((none, ()), (empty, ARM), (arm_mm(1), ARM)):
        if kind == "c3d":
            path.write_bytes(c3d_bytes(points, labels))
        elif kind == "bvh":
            path.write_text(bvh_text(np.zeros((len(points), 18))) if len(labels) else "HIERARCHY")
        else:
            path.write_text(TEXTS[kind][0](points, labels))
        with pytest.raises(DataError, match=r"points|frames|no rows|rows|header is bad|MOTION"):
            read_markers(path)


# ------------------------------------------------------------------ Vicon and QTM
def test_vicon_reads_its_trajectories_among_other_parts():
    before = ["Devices", "1000", ",,Force", "Frame,Sub Frame,Fx", ",,N", "1,0,3.5", "1,1,3.6", ""]
    text = vicon_text(arm_mm(), before=before) + "Model Outputs\n100\n,,Ann:RElbowAngles\n"
    np.testing.assert_allclose(read_vicon(text, "a").positions, arm_mm())


@pytest.mark.parametrize(
    ("old", "new", "match"),
    [
        ("Trajectories", "Devices", "holds no points: it has no part Trajectories"),
        ("Frame,Sub", "Bild,Sub", "line 4 begins with 'Bild'"),
        (",mm", ",cm", "the units cm, mm"),
        (",X,Y,Z", ",Fx,Fy,Fz", "holds no points"),
    ],
)
def test_vicon_with_a_bad_header(old, new, match):
    count = -1 if new.startswith((",Fx", "Dev")) else 1
    with pytest.raises(DataError, match=match):
        read_vicon(vicon_text(arm_mm()).replace(old, new, count), "a")


@pytest.mark.parametrize("lead", [True, False])
@pytest.mark.parametrize("end", ["", "\t"])
def test_qtm_without_column_names(lead, end):
    points = holes(arm_mm())
    points[0, -1] = np.nan  # the first row ends in empty cells
    data = read_qtm(qtm_text(points, header=False, lead=lead, end=end), "a")
    np.testing.assert_allclose(data.positions, points)
    np.testing.assert_array_equal(data.frames, np.arange(1, 6))
    assert data.labels == ARM


@pytest.mark.parametrize(
    ("old", "new", "match"),
    [
        ("INCLUDED\t3D", "INCLUDED\t6D", "holds 6D data"),
        ("FREQUENCY\t100", "FREQUENCY\t", "FREQUENCY = nan"),
        ("MARKER_NAMES", "NAMES", "no table header"),
        ("\tRFIN", "", "17 cells for 4 markers"),
    ],
)
def test_qtm_with_a_bad_header(old, new, match):
    text = qtm_text(arm_mm(), header=False, end="")
    with pytest.raises(DataError, match=match):
        read_qtm(text.replace(old, new, 1), "a")


# ------------------------------------------------------------------ C3D
@pytest.mark.parametrize("processor", ["Intel", "DEC", "MIPS"])
@pytest.mark.parametrize("real", [True, False])
def test_c3d_in_every_byte_order(tmp_path, processor, real):
    points = holes(arm_mm())
    path = tmp_path / "a.c3d"
    path.write_bytes(c3d_bytes(points, processor=processor, real=real, y_screen="+Z", first=52))
    data = read_markers(path)
    np.testing.assert_allclose(data.positions, points, atol=0.03)
    assert (data.labels, data.unit, data.up, data.rate_hz) == (ARM, "mm", "+z", 100.0)
    assert data.frames[0] == 52
    assert data.notes == (f"{processor} byte order",)


@pytest.mark.parametrize("processor", ["Intel", "DEC", "MIPS"])
def test_c3d_that_is_damaged(tmp_path, processor):
    whole = c3d_bytes(arm_mm(40), processor=processor)
    path = tmp_path / "a.c3d"
    path.write_bytes(whole[:-1024])
    with pytest.raises(DataError, match="cut off"):
        read_markers(path)
    for content in (b"", whole[:100], b"\x02\x51" + whole[2:], whole[:515] + b"\x00" + whole[516:]):
        path.write_bytes(content)
        with pytest.raises(DataError, match="C3D header is bad"):
            read_markers(path)


# ------------------------------------------------------------------ BVH
def test_bvh_against_a_closed_form():
    values = np.zeros((3, 18))
    values[1, 9] = 90.0  # RightArm about y: -x turns to +z
    values[2, 3] = 90.0  # Hips about z: everything turns, -x to -y
    data = read_bvh(bvh_text(values), "a")
    names = ("RightShoulder", "RightArm", "RightForeArm", "RightHand", "RightHand_end")
    places = {name: data.positions[:, data.labels.index(name)] for name in names}
    # The position channels of the root take the place of its offset.
    np.testing.assert_allclose(places["RightShoulder"][0], [-20, 50, 0], atol=1e-12)
    np.testing.assert_allclose(places["RightHand_end"][0], [-94, 50, 0], atol=1e-12)
    np.testing.assert_allclose(places["RightForeArm"][1], [-30, 50, 30], atol=1e-12)
    np.testing.assert_allclose(places["RightHand_end"][1], [-30, 50, 64], atol=1e-12)
    np.testing.assert_allclose(places["RightHand_end"][2], [-50, -94, 0], atol=1e-12)
    assert data.rate_hz == pytest.approx(100.0)


@settings(max_examples=25, deadline=None)
@given(hnp.arrays(float, (2, 18), elements=st.floats(-360.0, 360.0).map(lambda v: round(v, 4))))
def test_bvh_against_scipy(values):
    data = read_bvh(bvh_text(values), "a")
    place, turn = values[:, :3], Rotation.from_euler("ZXY", values[:, 3:6], degrees=True)
    orders = ("ZXY", "YZX", "ZXY", "ZXY")
    offsets = ([-20, 50, 0], [-10, 0, 0], [-30, 0, 0], [-25, 0, 0], [-9, 0, 0])
    for index, offset in enumerate(offsets, start=1):
        place = place + turn.apply(np.tile(np.array(offset, float), (2, 1)))
        np.testing.assert_allclose(data.positions[:, index], place, atol=1e-9)
        if index <= len(orders):
            angles = values[:, 3 + 3 * index : 6 + 3 * index]
            turn = turn * Rotation.from_euler(orders[index - 1], angles, degrees=True)


def test_bvh_positions_of_inner_joints():
    old = "OFFSET -30.0 0.0 0.0\n      CHANNELS 3 "
    old = old.replace("      ", "        ")
    new = old.replace("3 ", "6 Xposition Yposition Zposition ")
    values = np.zeros((2, 21))
    text = bvh_text(values)
    assert old in text
    text = text.replace(old, new)
    arm = read_bvh(text, "a").positions[0, 3]
    np.testing.assert_allclose(arm, [-60, 50, 0])  # zeros throughout: the offset holds
    values[:, 12] = -31.0
    arm = read_bvh(bvh_text(values).replace(old, new), "a").positions[0, 3]
    np.testing.assert_allclose(arm, [-61, 50, 0])


@pytest.mark.parametrize(
    ("old", "new", "match"),
    [
        ("MOTION", "", "no line MOTION"),
        ("Frame Time: 0.01", "", "motion is bad"),
        ("Frame Time: 0.01", "Frame Time: 0", "Frame Time: 0"),
        ("Frames: 3", "Frames: 4", "holds 54 numbers; expected 72"),
        ("0.000000", "x", "holds"),
        ("0.000000", "nan", "holds 'nan'; expected numbers"),
        ("Xposition", "Wposition", "CHANNELS 6 wposition"),
        ("CHANNELS 6", "CHANNELS x", "CHANNELS x"),
        ("OFFSET 1.0", "SHIFT 1.0", "'SHIFT'"),
        ("ROOT", "JOINT", "wrong place"),
        ("}\n", "", "cut off"),
    ],
)
def test_malformed_bvh(old, new, match):
    with pytest.raises(DataError, match=match):
        read_bvh(bvh_text(np.zeros((3, 18))).replace(old, new, 1), "a")


# ------------------------------------------------------------------ recognition and round trips
@pytest.mark.parametrize(
    "content", [b"", b"hello\n", b"\x00\x01" * 600, b"time_s,shoulder_x\n1,2\n"]
)
def test_other_files_are_refused(tmp_path, content):
    (tmp_path / "a.dat").write_bytes(content)
    with pytest.raises(DataError, match=r"bad header|not text"):
        read_markers(tmp_path / "a.dat")
    with pytest.raises(DataError, match="cannot read"):
        read_markers(tmp_path / "absent")


PLACES = hnp.arrays(
    float,
    st.tuples(st.integers(2, 6), st.just(3), st.just(3)),
    elements=st.one_of(
        st.floats(-9000, 9000).map(lambda v: round(v, 3) + 0.0005), st.just(float("nan"))
    ),
)


@settings(max_examples=30, deadline=None)
@given(PLACES, st.sampled_from(sorted(TEXTS)), st.sampled_from(MISSING))
def test_text_round_trip(points, kind, missing):
    write, read = TEXTS[kind]
    data = read(write(points, ("a", "b", "c"), missing=missing), "a")
    np.testing.assert_allclose(data.positions, points, atol=1e-6)


@settings(max_examples=30, deadline=None)
@given(PLACES, st.sampled_from(["Intel", "DEC", "MIPS"]))
def test_c3d_round_trip(tmp_path_factory, points, processor):
    path = tmp_path_factory.mktemp("c3d") / "a.c3d"
    points[np.isnan(points).any(axis=-1)] = np.nan
    path.write_bytes(c3d_bytes(points, ("a", "b", "c"), processor=processor))
    np.testing.assert_allclose(read_markers(path).positions, points, rtol=1e-6)
