"""Files whose numbers cannot be true are refused at once, whatever they ask for."""

import resource
import struct

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from mocap_files import ARM, arm_mm, bvh_text, c3d_bytes, trc_text

from hri_prediction.errors import ConfigError, DataError
from hri_prediction.tracks.importers.bvh import read_bvh
from hri_prediction.tracks.importers.mapping import parse_mapping
from hri_prediction.tracks.importers.markers import MOST_FRAMES
from hri_prediction.tracks.importers.recognise import read_markers
from hri_prediction.tracks.importers.report import gap_report
from hri_prediction.tracks.importers.trc import read_trc
from hri_prediction.tracks.tables import parse_number
from hri_prediction.tracks.track import ArmTrack


def peak_bytes() -> int:
    return 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


def far_frame(number: int) -> str:
    """A TRC at 100 Hz whose last frame number is far away, its time too."""
    lines = trc_text(arm_mm(5)).splitlines()
    cells = lines[-1].split("\t")
    lines[-1] = "\t".join([str(number), f"{(number - 1) * 0.01:.2f}", *cells[2:]])
    return "\n".join(lines) + "\n"


def test_a_frame_number_that_no_recording_has_is_refused():
    with pytest.raises(DataError, match=r"frame 1000000000000 follows frame 4.*at most"):
        read_trc(far_frame(10**12), "a.trc")
    assert len(read_trc(far_frame(MOST_FRAMES), "a.trc")) == 5


def test_a_long_gap_takes_no_memory():
    before = peak_bytes()
    times = np.array([0.0, 0.01, 0.02, 0.03, 1e10])
    first, *_ = gap_report(ArmTrack(times, np.ones((5, 4, 3))))
    assert (first.count, first.longest_at_s) == (1, pytest.approx(0.04))
    assert first.longest_s == pytest.approx(1e10)
    assert peak_bytes() - before < 50e6


@given(st.lists(st.booleans(), min_size=2, max_size=30))
def test_gaps_are_those_of_a_plain_count(seen):
    keypoints = np.ones((len(seen), 4, 3))
    keypoints[~np.array(seen), 0] = np.nan
    first, *_ = gap_report(ArmTrack(0.01 * np.arange(len(seen)), keypoints))
    gaps = [len(part) for part in "".join("x" if s else "." for s in seen).split("x") if part]
    assert first.count == len(gaps)
    assert first.share == pytest.approx(np.mean(seen))
    assert first.longest_s == pytest.approx(0.01 * max(gaps, default=0))


@pytest.mark.parametrize("processor", ["Intel", "DEC", "MIPS"])
@pytest.mark.parametrize("real", [True, False])
def test_header_counts_that_the_file_cannot_hold(tmp_path, processor, real):
    whole = c3d_bytes(arm_mm(40), processor=processor, real=real)
    path = tmp_path / "a.c3d"
    high = (0, 1)[processor != "MIPS"]
    for word in (1, 2, 4):  # points, analogue values, last frame
        altered = bytearray(whole)
        altered[2 * word + high] = 0xEA
        path.write_bytes(altered)
        before = peak_bytes()
        with pytest.raises(DataError, match=r"cut off, or its header is wrong: .* bytes"):
            read_markers(path)
        assert peak_bytes() - before < 50e6


@pytest.mark.parametrize("processor", ["Intel", "DEC", "MIPS"])
def test_parameters_that_reach_into_the_next_one(tmp_path, processor):
    whole = c3d_bytes(arm_mm(40), processor=processor)
    path = tmp_path / "a.c3d"
    group = whole.index(b"POINT") + len(b"POINT") + 2  # length of its description
    labels = whole.index(b"LABELS") + len(b"LABELS") + 4  # first of its two sizes
    kind = labels - 2
    for at, value in ((group, 196), (labels, 250), (kind, 96)):
        altered = bytearray(whole)
        altered[at] = value
        path.write_bytes(altered)
        before = peak_bytes()
        with pytest.raises(DataError, match="parameter section does not hold together at byte"):
            read_markers(path)
        assert peak_bytes() - before < 50e6


@pytest.mark.parametrize(
    "cell", ["1_0", "١٢", "１２", "0x10", "1e", "1e5_0", "1 0", ".", "+", "1.2.3"]
)
def test_what_only_python_takes_for_a_number_is_refused(cell):
    with pytest.raises(DataError, match="line 7 holds"):
        parse_number(cell, "line 7")


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_every_spelling_of_a_float_is_read(value):
    for text in (repr(value), f"{value:.17g}", f"{value:+.17E}", f" {value!r}\t"):
        assert parse_number(text, "a cell") == value


@pytest.mark.parametrize(
    ("old", "new"), [("-20.0", "-2_0"), ("3 Zrot", "³ Zrot"), ("Frames: 5", "Frames: ٥")]
)
def test_a_bvh_with_numbers_that_are_none(old, new):
    text = bvh_text(np.zeros((5, 18)))
    assert old in text
    with pytest.raises(DataError, match=r"holds|CHANNELS ³"):
        read_bvh(text.replace(old, new, 1), "a.bvh")


def test_analogue_values_without_their_parameters(tmp_path):
    altered = bytearray(c3d_bytes(arm_mm(200)))
    altered[4] = 1  # analogue value a frame; with half of the frames there is room for it
    altered[8] -= 100
    path = tmp_path / "a.c3d"
    path.write_bytes(altered)
    with pytest.raises(DataError, match="analogue values, but no parameter ANALOG:USED"):
        read_markers(path)


@pytest.mark.parametrize(
    ("cell", "value"), [("1.", 1.0), (".5", 0.5), ("-1E+03", -1000.0), ("007", 7.0)]
)
def test_numbers_as_programs_write_them(cell, value):
    assert parse_number(cell, "a cell") == value


def test_a_mapping_uses_each_marker_once():
    data = read_trc(trc_text(arm_mm(5)), "a.trc")
    with pytest.raises(ConfigError, match="marker 'RSHO' for shoulder and elbow; expected each"):
        parse_mapping("shoulder=RSHO,elbow=RSHO,wrist=RSHO", data)
    with pytest.raises(ConfigError, match="marker 'RWRA' twice in wrist"):
        parse_mapping("shoulder=RSHO,elbow=RELB,wrist=RWRA+rwra", data)
    assert parse_mapping("shoulder=RSHO,elbow=RELB,wrist=RWRA+RWRB", data).wrist == (2, 3)
    assert data.labels == ARM


def test_a_cell_that_is_no_number_is_told_at_once():
    """Digits that could be matched in many ways took hours."""
    for cell in ("1" * 200_000 + "x", "1." * 2 + "1" * 200_000, "." * 100_000):
        with pytest.raises(DataError, match="line 7 holds"):
            parse_number(cell, "line 7")


def test_channels_twice():
    text = bvh_text(np.zeros((5, 18)))
    line = "    CHANNELS 3 Zrotation Xrotation Yrotation\n"
    assert line in text
    with pytest.raises(DataError, match="RightShoulder has CHANNELS twice"):
        read_bvh(text.replace(line, 2 * line, 1), "a.bvh")


def test_joints_that_nothing_moves():
    """Each would have a place in each frame."""
    text = bvh_text(np.zeros((5, 18)))
    joints = [f"JOINT a{number}\n{{\nOFFSET 0 0 0\nCHANNELS 0\n}}\n  " for number in range(80)]
    some = text.replace("JOINT", "".join(joints[:50]) + "JOINT", 1)
    assert len(read_bvh(some, "a.bvh").labels) == 56
    with pytest.raises(DataError, match="86 joints and ends for 18 channels"):
        read_bvh(text.replace("JOINT", "".join(joints) + "JOINT", 1), "a.bvh")


def test_rows_that_lack_nearly_all_markers():
    names = [f"M{number}" for number in range(400)]
    lines = trc_text(np.ones((3, 400, 3)), names).splitlines()
    some = "\n".join([*lines, *(f"{row}\t{row / 100}" for row in range(4, 20))]) + "\n"
    assert len(read_trc(some, "a.trc")) == 19
    many = "\n".join([*lines, *(f"{row}\t{row / 100}" for row in range(4, 5000))]) + "\n"
    with pytest.raises(DataError, match=r"up to line [0-9]+ the rows lack [0-9]+ of their cells"):
        read_trc(many, "a.trc")


@pytest.mark.parametrize("processor", ["Intel", "DEC", "MIPS"])
@pytest.mark.parametrize("name", ["USED", "FRAMES", "SCALE", "RATE"])
def test_parameters_without_a_value(tmp_path, processor, name):
    """Of which the reader of the package takes the first value all the same, and dies."""
    whole = c3d_bytes(arm_mm(40), processor=processor)
    at = whole.index(bytes([len(name), 1]) + name.encode()) + 2 + len(name) + 2
    count = abs(whole[at])
    altered = bytearray(whole)
    altered[at + 1 : at + 2 + count] = bytes([count, *(0 for _ in range(count))])
    path = tmp_path / "a.c3d"
    path.write_bytes(altered)
    with pytest.raises(
        DataError, match=f"a.c3d: the C3D file has no value of POINT:{name} that can be used"
    ):
        read_markers(path)


@pytest.mark.parametrize(("name", "value"), [("USED", -2), ("USED", 32000)])
def test_counts_in_parameters_that_the_file_cannot_hold(tmp_path, name, value):
    altered = bytearray(c3d_bytes(arm_mm(40)))
    at = altered.index(bytes([len(name), 1]) + name.encode()) + 2 + len(name) + 4
    struct.pack_into("<h", altered, at, value)
    path = tmp_path / "a.c3d"
    path.write_bytes(altered)
    with pytest.raises(DataError, match=r"its parameters are wrong: .* points"):
        read_markers(path)
