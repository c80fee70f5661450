"""From markers to a track: mapping, side, units, axes, rate, gaps."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mocap_files import ARM, arm_mm

from hri_prediction.errors import ConfigError, DataError
from hri_prediction.tracks.importers.axes import find_axes, parse_axes
from hri_prediction.tracks.importers.convert import HAND_M, ImportOptions, convert, plan_import
from hri_prediction.tracks.importers.mapping import guess_mapping, parse_mapping
from hri_prediction.tracks.importers.markers import MarkerData, unique_labels
from hri_prediction.tracks.importers.report import gap_report
from hri_prediction.tracks.importers.units import UNITS, find_scale, parse_units
from hri_prediction.tracks.track import ArmTrack


def markers(labels=ARM, points=None, **changes):
    labels = tuple(labels)
    if points is None:
        points = arm_mm(
            5, [("RSHO", "RELB", "RWRA", "RWRB", "RFIN")[i % 5] for i in range(len(labels))]
        )
    values = {
        "format": "C3D",
        "labels": unique_labels(labels),
        "positions": np.array(points, float),
        "frames": np.arange(1.0, len(points) + 1.0),
        "rate_hz": 100.0,
        "unit": "mm",
        "up": "+z",
    }
    return MarkerData(**{**values, **changes})


def words(data, mapping):
    return mapping.text(data.labels)


SETS = {
    "OptiTrack": (
        ("giver:Chest", "giver:RShoulder", "giver:RUArm", "giver:RFArm", "giver:RHand"),
        "shoulder=giver:RUArm,elbow=giver:RFArm,wrist=giver:RHand",
    ),
    "Plug-in Gait": (ARM, "shoulder=RSHO,elbow=RELB,wrist=RWRA+RWRB,hand_tip=RFIN"),
    "left": (
        ("LSHO", "LELB", "LWRA", "LWRB"),
        "shoulder=LSHO,elbow=LELB,wrist=LWRA+LWRB",
    ),
    "subject": (
        tuple(f"Ann:{name}" for name in ARM),
        "shoulder=Ann:RSHO,elbow=Ann:RELB,wrist=Ann:RWRA+Ann:RWRB,hand_tip=Ann:RFIN",
    ),
    "Qualisys": (
        ("L_SAE", "L_HLE", "L_HME", "L_RSP", "L_USP", "L_HM2"),
        "shoulder=L_SAE,elbow=L_HLE+L_HME,wrist=L_RSP+L_USP,hand_tip=L_HM2",
    ),
    "Qualisys animation": (
        ("RShoulderTop", "RElbowOut", "RWristOut", "RWristIn", "RHandOut", "RHandIn"),
        "shoulder=RShoulderTop,elbow=RElbowOut,wrist=RWristOut+RWristIn,hand_tip=RHandOut+RHandIn",
    ),
    "Helen Hayes": (
        ("R.Shoulder", "R.Elbow", "R.Wrist"),
        "shoulder=R.Shoulder,elbow=R.Elbow,wrist=R.Wrist",
    ),
    "OpenSim": (
        ("RACR", "RLEL", "RMEL", "RFAradius", "RFAulna"),
        "shoulder=RACR,elbow=RLEL+RMEL,wrist=RFAradius+RFAulna",
    ),
    "one arm": (
        ("Shoulder", "Elbow", "Hand right", "Hand left", "Index"),
        "shoulder=Shoulder,elbow=Elbow,wrist=Hand right+Hand left,hand_tip=Index",
    ),
}
SKELETONS = {
    "Mixamo": (
        tuple(
            f"mixamorig:Left{name}"
            for name in ("Shoulder", "Arm", "ForeArm", "Hand", "HandMiddle4")
        ),
        "shoulder=mixamorig:LeftArm,elbow=mixamorig:LeftForeArm,wrist=mixamorig:LeftHand,"
        "hand_tip=mixamorig:LeftHandMiddle4",
    ),
    "Carnegie Mellon": (
        ("RightShoulder", "RightElbow", "RightWrist", "rhand", "RFingers", "RFingers_end"),
        "shoulder=RightShoulder,elbow=RightElbow,wrist=RightWrist,hand_tip=RFingers_end",
    ),
    "Poser": (
        ("rCollar", "rShldr", "rForeArm", "rHand"),
        "shoulder=rShldr,elbow=rForeArm,wrist=rHand",
    ),
}


@pytest.mark.parametrize("name", SETS)
def test_guess_from_common_marker_sets(name):
    labels, expected = SETS[name]
    data = markers(labels)
    mapping = guess_mapping(data)
    assert words(data, mapping) == expected
    side = {"L": "left", "R": "right"}.get(
        expected.partition("=")[2].partition(",")[0].rpartition(":")[2][0], ""
    )
    assert mapping.side == side
    assert mapping.set_name
    # What is shown can be given back.
    again = parse_mapping(expected, data)
    assert words(data, again) == expected
    assert again.side == mapping.side


@pytest.mark.parametrize("name", SKELETONS)
def test_guess_from_common_skeletons(name):
    labels, expected = SKELETONS[name]
    data = markers(labels, format="BVH")
    assert words(data, guess_mapping(data)) == expected


def test_names_of_joints_do_not_count_as_markers():
    with pytest.raises(DataError, match="no arm"):
        guess_mapping(markers(("RArm", "RForeArm", "RHand")))


def test_both_arms():
    data = markers(tuple(f"{s}{name[1:]}" for s in "LR" for name in ARM))
    right = guess_mapping(data)
    assert right.side == "right"
    assert right.notes == ("the left arm is there too: --side left",)
    assert guess_mapping(data, "left").side == "left"
    with pytest.raises(DataError, match="no left arm"):
        guess_mapping(markers(), "left")


def test_several_people():
    data = markers(tuple(f"{who}:{name}" for who in ("Ann", "Bob") for name in ARM))
    with pytest.raises(
        DataError, match=r"2 people have an arm: Ann, Bob; choose one with --subject"
    ):
        guess_mapping(data)
    plan = plan_import(data, ImportOptions(subject="Bob"))
    assert plan.subject == "Bob"
    assert "Bob:RSHO" in words(data, plan.mapping)
    with pytest.raises(ConfigError, match="2 markers are named 'RSHO'; expected one of Ann:RSHO"):
        parse_mapping("shoulder=RSHO,elbow=RELB,wrist=RWRA", data)
    chosen = parse_mapping("shoulder=rsho,elbow=RELB,wrist=RWRA", data, "Bob")
    assert words(data, chosen) == "shoulder=Bob:RSHO,elbow=Bob:RELB,wrist=Bob:RWRA"


def test_repeated_labels():
    points = arm_mm(5, (*ARM, "RELB"))
    points[1:, 1] = np.nan
    data = markers((*ARM, "RELB"), points)
    mapping = guess_mapping(data)
    assert "elbow=RELB#2" in words(data, mapping)
    assert mapping.notes == ("RELB#2: 2 markers have this name, this one is seen most",)
    with pytest.raises(ConfigError, match="2 markers are named 'RELB'"):
        parse_mapping("shoulder=RSHO,elbow=RELB,wrist=RWRA", data)
    assert parse_mapping("shoulder=RSHO,elbow=RELB#2,wrist=RWRA", data).elbow == (5,)


@pytest.mark.parametrize(
    ("text", "match"),
    [
        ("shoulder=RSHO,elbow=RELB", "has no wrist"),
        ("shoulder=RSHO,elbow=RELB,hand=RFIN", "'hand=RFIN'"),
        ("shoulder=RSHO,shoulder=RSHO,wrist=RFIN", "each once"),
        ("shoulder=RSHO,elbow,wrist=RFIN", "'elbow'"),
        ("shoulder=RSHO,elbow=XXX,wrist=RFIN", "no marker 'XXX'; expected one of RSHO, RELB"),
    ],
)
def test_malformed_mapping(text, match):
    with pytest.raises(ConfigError, match=match):
        parse_mapping(text, markers())


def test_label_that_holds_a_plus():
    data = markers(("A+B", "RELB", "RWRA"))
    assert parse_mapping("shoulder=A+B,elbow=RELB,wrist=RWRA", data).shoulder == (0,)


def test_markers_that_are_never_seen():
    points = arm_mm()
    points[:, 1] = 0.0
    with pytest.raises(DataError, match="no arm is recognised among the markers; RELB never seen"):
        plan_import(markers(points=points), ImportOptions())
    given_map = ImportOptions(mapping="shoulder=RSHO,elbow=RELB,wrist=RWRA")
    with pytest.raises(DataError, match="the elbow is never seen: RELB"):
        plan_import(markers(points=points), given_map)
    kept = dataclasses.replace(given_map, keep_zeros=True, units="mm")
    assert convert(plan_import(markers(points=points), kept)).valid.all()
    points = arm_mm()
    points[:2, 0] = points[2:, 1] = np.nan
    with pytest.raises(DataError, match="never seen in the same frame"):
        plan_import(markers(points=points), given_map)


def test_a_mean_is_missing_when_one_of_its_markers_is():
    points = arm_mm()
    points[1, 3] = np.nan
    track = convert(plan_import(markers(points=points), ImportOptions()))
    np.testing.assert_array_equal(track.valid[:, 2], [True, False, True, True, True])
    np.testing.assert_allclose(track.keypoints[0, 2], [0.02, 0.48, 1.205])


def test_no_hand_tip():
    track = convert(plan_import(markers(ARM[:4]), ImportOptions()))
    forearm, hand = np.diff(track.keypoints, axis=1)[:, 1:].swapaxes(0, 1)
    np.testing.assert_allclose(np.linalg.norm(hand, axis=1), HAND_M)
    np.testing.assert_allclose(np.cross(forearm, hand), 0.0, atol=1e-12)


# ------------------------------------------------------------------ side
def test_side():
    assert not plan_import(
        markers(), ImportOptions(side="right", mapping=SETS["Plug-in Gait"][1])
    ).guessed
    assert plan_import(markers(), ImportOptions()).side_guessed
    data = markers(("Shoulder", "Elbow", "Wrist"))
    plan = plan_import(data, ImportOptions(mapping="shoulder=Shoulder,elbow=Elbow,wrist=Wrist"))
    assert plan.side == "right"
    assert plan.side_guessed
    with pytest.raises(ConfigError, match=r"--side left, but the markers .* of the right arm"):
        plan_import(markers(), ImportOptions(side="left", mapping=SETS["Plug-in Gait"][1]))


# ------------------------------------------------------------------ units
@pytest.mark.parametrize("unit", UNITS)
def test_units(unit):
    points = arm_mm() * 0.001 / UNITS[unit]
    for options in (ImportOptions(units=unit), ImportOptions(units=str(UNITS[unit]))):
        track = convert(plan_import(markers(points=points, unit=""), options))
        np.testing.assert_allclose(track.keypoints[0, 1], [0.02, 0.25, 1.25])
    plan = plan_import(markers(points=points, unit=""), ImportOptions())
    assert plan.scale.guessed
    assert plan.scale.metres == UNITS[unit]


def test_a_given_unit_is_believed_and_remarked_on():
    plan = plan_import(markers(), ImportOptions(units="m"))
    assert "with the unit m the arm is 518 m long" in plan.notes()
    assert not any("long" in note for note in plan_import(markers(), ImportOptions()).notes())


def test_units_that_cannot_be():
    with pytest.raises(DataError, match=r"unit mm the arm is 0.0005 m long.*--units, m would fit"):
        find_scale("mm", 0.5)
    with pytest.raises(DataError, match=r"the file's unit is 'ell'.*--units, mm would fit"):
        find_scale("ell", 500.0)
    with pytest.raises(DataError, match="names no unit, and its arm of 3e\\+06 units fits none"):
        find_scale("", 3e6)
    for text in ("ell", "-1", "0", "nan"):
        with pytest.raises(ConfigError, match="unit"):
            parse_units(text)
    assert parse_units("Millimeters").metres == 0.001


# ------------------------------------------------------------------ axes
BODY = ("C7", "RASI", "RKNE", "RANK")


@pytest.mark.parametrize("up", ["+x", "-x", "+y", "-y", "+z", "-z"])
def test_axes_are_told_by_the_body(up):
    axis, sign = "xyz".index(up[1]), -1.0 if up[0] == "-" else 1.0
    points = np.zeros((5, 4, 3))
    points[:, :, axis] = sign * np.array([1450.0, 1000.0, 500.0, 80.0])
    points[:, 1, (axis + 1) % 3] = 120.0
    found = find_axes(markers(BODY, points, up=""))
    assert found.guessed
    assert np.linalg.det(found.matrix) == pytest.approx(1.0)
    turned = points @ found.matrix.T
    np.testing.assert_allclose(turned[0, :, 2], [1450, 1000, 500, 80])
    assert not find_axes(markers(BODY, points, up=up)).guessed
    other = "+y" if up != "+y" else "+z"
    contested = find_axes(markers(BODY, points, up=other))
    assert contested.guessed  # the file is believed, but this is asked


def test_axes_are_told_by_the_bones_of_optitrack():
    points = np.zeros((5, 5, 3))
    points[:, :, 2] = (950.0, 1050.0, 1250.0, 1450.0, 1520.0)
    names = tuple(f"giver:{name}" for name in ("hip", "ab", "chest", "neck", "head"))
    assert find_axes(markers(names, points, up="", format="TRC")).text == "x,y,z"


def test_usual_axes():
    assert find_axes(markers(up="", format="TRC")).text == "x,-z,y"
    assert find_axes(markers(up="")).text == "x,y,z"
    fixed = find_axes(markers(up="+y", up_fixed=True, format="BVH"))
    assert (fixed.text, fixed.guessed) == ("x,-z,y", False)


@pytest.mark.parametrize("text", ["", "x", "x,y", "x,y,y", "x,y,w", "x,y,z,x", "--x,y,z"])
def test_malformed_axes(text):
    with pytest.raises(ConfigError, match="--axes"):
        parse_axes(text)


@settings(max_examples=30, deadline=None)
@given(st.permutations("xyz"), st.lists(st.sampled_from(["", "-", "+"]), min_size=3, max_size=3))
def test_axes_are_orthogonal(names, signs):
    axes = parse_axes(",".join(sign + name for sign, name in zip(signs, names, strict=True)))
    np.testing.assert_array_equal(axes.matrix @ axes.matrix.T, np.eye(3))
    assert axes.mirrored == (np.linalg.det(axes.matrix) < 0)
    assert parse_axes(axes.text).text == axes.text
    plan = plan_import(markers(), ImportOptions(axes=axes.text))
    assert any("mirror" in note for note in plan.notes()) == axes.mirrored
    expected = np.array([0.02, 0.25, 1.25]) @ axes.matrix.T
    np.testing.assert_allclose(convert(plan).keypoints[0, 1], expected)


# ------------------------------------------------------------------ rate and time
def test_rates():
    def rate(given=0.0, **changes):
        return plan_import(markers(**changes), ImportOptions(rate_hz=given)).rate_hz

    clock = np.arange(5) / 119.88012
    assert rate(clock=clock.round(6), rate_hz=119.88012) == 119.88012
    assert rate(clock=clock, rate_hz=0.0) == pytest.approx(119.88012)
    assert rate(240.0, clock=clock) == 240.0
    assert rate(clock=np.zeros(5)) == 100.0  # times that say nothing
    with pytest.raises(
        DataError, match=r"says 100 Hz, but its times are .* \(119.9 Hz\); .*--rate"
    ):
        rate(clock=clock)
    with pytest.raises(DataError, match="does not say its frame rate; give it with --rate"):
        rate(rate_hz=0.0)
    with pytest.raises(ConfigError, match="--rate -1"):
        rate(-1.0)


def test_time_keeps_frames_that_are_left_out():
    track = convert(plan_import(markers(frames=np.array([7, 8, 9, 12, 13.0])), ImportOptions()))
    np.testing.assert_allclose(track.time_s, [0.0, 0.01, 0.02, 0.05, 0.06])


def test_gap_report():
    points = np.zeros((10, 4, 3))
    points[3:5, 1] = points[0, 2] = points[8:, 2] = np.nan
    frames = np.array([0, 1, 2, 3, 4, 7, 8, 9, 10, 11])  # two are left out
    shoulder, elbow, wrist, _ = gap_report(ArmTrack(frames / 50.0, points))
    assert (shoulder.count, shoulder.share) == (1, pytest.approx(10 / 12))
    assert (shoulder.longest_s, shoulder.longest_at_s) == pytest.approx((0.04, 0.10))
    assert (elbow.count, elbow.share) == (1, pytest.approx(8 / 12))
    assert (elbow.longest_s, elbow.longest_at_s) == pytest.approx((0.08, 0.06))
    assert wrist.count == 3
    assert wrist.share == pytest.approx(7 / 12)
    whole = gap_report(ArmTrack(np.arange(3) / 50.0, np.zeros((3, 4, 3))))
    assert [(g.count, g.share, g.longest_s) for g in whole] == [(0, 1.0, 0.0)] * 4
