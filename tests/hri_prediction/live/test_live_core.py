"""What a live stream becomes, without a connection: times, mappings, keypoints."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hri_prediction.errors import ConfigError, DataError
from hri_prediction.live.arm_stream import ArmStream, LiveBody, MarkerLayout
from hri_prediction.live.qtm import read_layout
from hri_prediction.live.stream_clock import WINDOW_NS, StreamClock
from hri_prediction.tracks.importers.convert import ImportOptions, convert, plan_import
from hri_prediction.tracks.importers.markers import MarkerData
from hri_prediction.tracks.placement import Placement

MS = 10**6
LABELS = ("RSHO", "RELB", "RWRA", "RWRB", "RFIN")
MAP = "shoulder=RSHO,elbow=RELB,wrist=RWRA+RWRB,hand_tip=RFIN"
LAYOUT = MarkerLayout(LABELS, 200.0, "+z")
REST = np.array(
    [[0, 10, 1400], [20, 250, 1250], [40, 480, 1200], [0, 480, 1210], [10, 570, 1190.0]]
)


def stream(layout=LAYOUT, *bodies, place=None, **options):
    bodies = bodies or (LiveBody("ann", MAP),)
    return ArmStream(layout, bodies, place or Placement(), **options)


# ------------------------------------------------------------------ times
@settings(max_examples=50, deadline=None)
@given(st.lists(st.integers(0, 30 * MS), min_size=5, max_size=60), st.integers(0, 5 * MS))
def test_stamps_are_capture_times_whatever_packets_took(delays, least):
    delays[2] = 0  # one packet came as fast as packets can
    clock, period, offset = StreamClock(least), 5 * MS, 10**18
    last = -1
    for index, delay in enumerate(delays):
        capture = offset + index * period
        received = capture + least + delay
        stamp = clock.stamp(index * period, received)
        if stamp is None:
            continue
        assert last < stamp <= received
        last = stamp
        if index >= 2:
            assert stamp == capture
        else:
            assert stamp >= capture


def test_repeated_frames_are_left_out():
    clock = StreamClock()
    assert clock.stamp(0, 100 * MS) == 100 * MS
    assert clock.stamp(0, 105 * MS) is None
    assert clock.stamp(5 * MS, 105 * MS) == 105 * MS


def test_a_new_measurement_begins():
    clock = StreamClock()
    assert clock.stamp(900 * MS, 1000 * MS) == 1000 * MS
    # Times begin at zero again, and what the packet took is not known yet.
    assert clock.stamp(0, 2000 * MS) == 2000 * MS
    assert clock.restarts == 1
    assert clock.stamp(5 * MS, 2006 * MS) == 2005 * MS


def test_a_new_connection_begins():
    clock = StreamClock()
    clock.stamp(100 * MS, 1000 * MS)
    clock.restart()
    # Without the restart this would count as five seconds old.
    assert clock.stamp(200 * MS, 6100 * MS) == 6100 * MS


def test_the_receivers_clock_is_set_back():
    clock = StreamClock()
    assert clock.stamp(0, 5000 * MS) == 5000 * MS
    assert clock.stamp(5 * MS, 3005 * MS) == 3005 * MS


def test_the_offset_follows_a_drift():
    clock, late = StreamClock(), 0
    for index in range(3 * WINDOW_NS // (10 * MS)):
        source = index * 10 * MS
        received = source + source // 10_000 + 10**15  # 100 ppm
        stamp = clock.stamp(source, received)
        late = max(late, received - stamp)
    assert late <= 1.01e-4 * WINDOW_NS


# ------------------------------------------------------------------ keypoints
def test_same_keypoints_as_the_import_of_a_file():
    frames = REST + np.arange(6)[:, None, None] * np.array([1.0, 3.0, -0.5])
    frames[2, 3] = np.nan
    frames[3, 0] = 0.0
    place = Placement.parse("0.9,0.1,-1,170")
    data = MarkerData("QTM TSV", LABELS, frames, np.arange(6.0), 200.0, "mm", "+z")
    track = convert(plan_import(data, ImportOptions(mapping=MAP))).transformed(place)
    live = stream(place=place)
    for row, frame in enumerate(frames):
        ((body, sample),) = live.samples(frame, row)
        assert (body, sample.side, sample.stamp_ns) == ("ann", "right", row)
        np.testing.assert_array_equal(sample.valid, track.valid[row])
        np.testing.assert_allclose(sample.keypoints, track.keypoints[row], atol=1e-12)
    assert not track.valid[2, 2]
    assert not track.valid[3, 0]


def test_upward_axis_of_the_source():
    turned = REST[:, [0, 2, 1]] * [1, 1, -1]  # y up
    told = stream(dataclasses.replace(LAYOUT, up="+y"))
    given_axes = stream(dataclasses.replace(LAYOUT, up=""), axes="y-up")
    for each in (told, given_axes):
        np.testing.assert_allclose(
            each.samples(turned, 0)[0][1].keypoints, stream().samples(REST, 0)[0][1].keypoints
        )
    with pytest.raises(DataError, match="does not say which axis points up; give it"):
        stream(dataclasses.replace(LAYOUT, up=""))


def test_two_arms_and_no_hand_tip():
    names = ("Ann:RSHO", "Ann:RELB", "Ann:RWRA", "Bob:LSHO", "Bob:LELB", "Bob:LWRA")
    live = stream(
        MarkerLayout(names, 100.0, "+z"),
        LiveBody("ann", "shoulder=RSHO,elbow=RELB,wrist=RWRA", "right"),
        LiveBody("bob", "shoulder=Bob:LSHO,elbow=Bob:LELB,wrist=Bob:LWRA", "left"),
    )
    (ann, first), (bob, second) = live.samples(np.vstack([REST[:3], REST[:3] + 1000.0]), 7)
    assert (ann, bob, first.side, second.side) == ("ann", "bob", "right", "left")
    np.testing.assert_allclose(second.keypoints, first.keypoints + 1.0)
    assert first.valid.all()
    assert np.linalg.norm(first.keypoints[3] - first.keypoints[2]) == pytest.approx(0.09)


def test_both_arms_of_a_body_have_names_of_their_own():
    names = ("RSHO", "RELB", "RWRA", "LSHO", "LELB", "LWRA")
    live = stream(
        MarkerLayout(names, 100.0, "+z"),
        LiveBody("ann", "shoulder=RSHO,elbow=RELB,wrist=RWRA", "right"),
        LiveBody("ann", "shoulder=LSHO,elbow=LELB,wrist=LWRA", "left"),
    )
    found = live.samples(np.vstack([REST[:3], REST[:3] + 1000.0]), 7)
    assert [(body, sample.side) for body, sample in found] == [("ann", "right"), ("ann", "left")]
    assert live.mappings == {
        "ann right": "shoulder=RSHO,elbow=RELB,wrist=RWRA, side right",
        "ann left": "shoulder=LSHO,elbow=LELB,wrist=LWRA, side left",
    }


def test_a_guess_must_be_agreed_to():
    with pytest.raises(ConfigError, match=r"not yet agreed to: ann: shoulder=RSHO.*accept_guess"):
        stream(LAYOUT, LiveBody("ann"))
    live = stream(LAYOUT, LiveBody("ann"), accept_guess=True)
    assert live.mappings == {"ann": f"{MAP}, side right"}


@pytest.mark.parametrize(
    ("layout", "body", "match"),
    [
        (
            LAYOUT,
            ("ann", "shoulder=A,elbow=RELB,wrist=RWRA"),
            "no marker 'A'; expected one of RSHO",
        ),
        (LAYOUT, ("ann", MAP, "left"), "said to be the left arm, but .* right arm"),
        (MarkerLayout(("a", "b", "c"), 0.0, "+z"), ("ann", ""), "no arm is recognised"),
        (
            MarkerLayout(("a", "b", "c"), 0.0, "+z"),
            ("ann", "shoulder=a,elbow=b,wrist=c"),
            "do not tell which arm it is; give left or right",
        ),
        (MarkerLayout((), 0.0, "+z"), ("ann", MAP), "holds no points"),
    ],
)
def test_what_does_not_fit(layout, body, match):
    with pytest.raises((ConfigError, DataError), match=match):
        stream(layout, LiveBody(*body))


@pytest.mark.parametrize(
    ("body", "match"),
    [
        (("ann", "shoulder=RSHO"), "the mapping has no elbow"),
        (("ann", "hand=RSHO"), "the mapping holds 'hand=RSHO'"),
        (("ann", "shoulder="), "the mapping holds 'shoulder='"),
        (("ann", "", "both"), "side 'both'"),
    ],
)
def test_malformed_bodies_are_refused_before_there_is_a_stream(body, match):
    with pytest.raises(ConfigError, match=match):
        LiveBody(*body)


def test_frame_of_another_layout():
    with pytest.raises(DataError, match="holds 4 markers; expected 5"):
        stream().samples(REST[:4], 0)


# ------------------------------------------------------------------ what QTM says
def test_layout_of_qtm():
    xml = (
        b"<QTM_Parameters_Ver_1.25>\r\n<General><Frequency>119.88</Frequency></General><The_3D>"
        b"<AxisUpwards>-Y</AxisUpwards><Labels>2</Labels><Label><Name>R\xc3\xbccken - 1</Name></Label>"
        b"<Label><Name>b &amp; c</Name></Label></The_3D></QTM_Parameters_Ver_1.25>\r\n"
    )
    assert read_layout(xml) == MarkerLayout(("Rücken - 1", "b & c"), 119.88, "-y")


@pytest.mark.parametrize(
    ("xml", "match"),
    [
        ("<QTM>", "no XML"),
        ("<QTM><General/></QTM>", "names no markers; load an identification model"),
        ("<QTM><The_3D><Labels>0</Labels></The_3D></QTM>", "names no markers"),
    ],
)
def test_layout_that_cannot_be_used(xml, match):
    with pytest.raises(DataError, match=match):
        read_layout(xml)


def test_layout_that_says_little():
    layout = read_layout(
        "<Q><General><Frequency>fast</Frequency></General><The_3D><AxisUpwards>up</AxisUpwards>"
        "<Label><Name>a</Name></Label></The_3D></Q>"
    )
    assert layout == MarkerLayout(("a",), 0.0, "")
