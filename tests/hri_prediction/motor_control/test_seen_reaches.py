"""Recorded reaches: brought to the model, cut, averaged, explained in batches that go on."""

import json
from dataclasses import replace

import numpy as np
import pytest
from drawn import ALPHA, observed, optimum, problem, recorded

from hri_prediction.errors import DataError
from hri_prediction.evaluation.recordings import make_recording
from hri_prediction.motor_control.batch import Job, Kept, explain_all
from hri_prediction.motor_control.cli import main
from hri_prediction.motor_control.collected import People, collect
from hri_prediction.motor_control.kinematics import elbow_and_wrist
from hri_prediction.motor_control.seen import (
    arm_of,
    mean_of,
    observe,
    smoothing_spline,
    to_model,
    to_recording,
)
from hri_prediction.tracks.files import save_tracks
from hri_prediction.tracks.segmentation import SegmentationConfig, find_reaches
from hri_prediction.tracks.track import ArmTrack


@pytest.mark.parametrize("side", ["right", "left"])
@pytest.mark.parametrize("facing_deg", [90.0, -90.0, 180.0, 30.0])
def test_model_and_recording_are_the_same_turned(side, facing_deg, rng):
    points, facing = rng.normal(size=(20, 3)), np.radians(facing_deg)
    back = to_recording(to_model(points, facing, side), facing, side)
    np.testing.assert_allclose(back, points, atol=1e-12)
    ahead = np.array([np.cos(facing), np.sin(facing), 0.0])
    np.testing.assert_allclose(to_model(ahead, facing, side), [0.0, 1.0, 0.0], atol=1e-12)
    to_the_right = np.array([np.sin(facing), -np.cos(facing), 0.0])
    outwards = 1.0 if side == "right" else -1.0
    np.testing.assert_allclose(
        to_model(to_the_right, facing, side), [outwards, 0.0, 0.0], atol=1e-12
    )


@pytest.mark.parametrize(("side", "facing_deg"), [("right", 90.0), ("left", -90.0)])
def test_a_recording_is_seen_as_it_was(solver, rng, side, facing_deg):
    track, onset, end = recorded(solver, 13, rng, side=side, facing=np.radians(facing_deg))
    arm = arm_of([track])
    assert arm.upper_m == pytest.approx(solver.arm.upper_m, rel=1e-6)
    assert arm.forearm_m == pytest.approx(solver.arm.forearm_m, rel=1e-6)
    seen = observe(track, onset, end, arm, facing_rad=np.radians(facing_deg))
    assert seen.misfit_m < 1e-6
    motion, _ = optimum(solver, problem(13), ALPHA)
    whole = motion.angles(np.linspace(0.0, 1.0, 2000))
    # It is cut to where the hand has 5 % of its peak speed, and moves there.
    assert 0.7 * (end - onset) < seen.problem.duration < 0.98 * (end - onset)
    apart = np.abs(whole[:, None] - seen.problem.q_start).max(axis=2).min()
    assert apart < np.radians(0.3)
    assert np.abs(seen.problem.v_start).max() > 0.01
    speed = np.linalg.norm(np.diff(seen.hand, axis=0), axis=1)
    assert speed[0] < 0.12 * speed.max()
    assert seen.problem.a_start is None
    kept = observe(track, onset, end, arm, facing_rad=np.radians(facing_deg), trim=False)
    assert kept.problem.duration == pytest.approx(end - onset)


def test_noise_is_smoothed_and_repetitions_are_averaged(solver, rng):
    clean, onset, end = recorded(solver, 25, rng)
    truth = observe(clean, onset, end, solver.arm, facing_rad=0.5 * np.pi, trim=False)
    seen = [
        observe(
            recorded(solver, 25, rng, noise=0.003)[0], onset, end, solver.arm,
            facing_rad=0.5 * np.pi, trim=False,
        )
        for _ in range(3)
    ]  # fmt: skip
    errors = [np.linalg.norm(each.hand - truth.hand, axis=1).mean() for each in seen]
    mean = mean_of(seen, solver.arm, "mean")
    both = np.linalg.norm(mean.hand - truth.hand, axis=1).mean()
    assert max(errors) < 0.003
    assert both < 0.75 * np.mean(errors)
    assert mean.name == "mean"
    assert mean.problem.duration == pytest.approx(end - onset)
    with pytest.raises(DataError, match="one or more"):
        mean_of([], solver.arm)
    rest = observed(solver, problem(25), ALPHA)
    with pytest.raises(DataError, match="at rest"):
        mean_of([seen[0], rest], solver.arm)


def test_splines_keep_what_is_slow():
    times = np.arange(200) / 100.0
    slow = np.column_stack([np.sin(2.0 * times), np.cos(3.0 * times)])
    np.testing.assert_allclose(smoothing_spline(times, slow)(times), slow, atol=1e-6)
    fast = slow + 0.1 * np.sin(2.0 * np.pi * 20.0 * times)[:, None]
    inner = slice(10, -10)
    np.testing.assert_allclose(smoothing_spline(times, fast)(times)[inner], slow[inner], atol=0.02)


def test_gaps_are_bridged_or_refused(solver, rng):
    track, onset, end = recorded(solver, 4, rng)
    points = np.array(track.keypoints)
    points[200:215] = np.nan
    whole = observe(track, onset, end, solver.arm, facing_rad=0.5 * np.pi)
    short = ArmTrack(track.time_s, points, side="right")
    bridged = observe(short, onset, end, solver.arm, facing_rad=0.5 * np.pi)
    apart = np.abs(np.interp(whole.phases, bridged.phases, bridged.hand[:, 0]) - whole.hand[:, 0])
    assert apart.max() < 0.003
    points[200:240] = np.nan
    with pytest.raises(DataError, match=r"gap of 0\.1\d s"):
        observe(ArmTrack(track.time_s, points), onset, end, solver.arm, facing_rad=0.0)
    points[:, 0] = np.nan
    with pytest.raises(DataError, match="never seen together"):
        arm_of([ArmTrack(track.time_s, points)])


def test_a_reach_is_where_its_arm_is_seen(solver, rng):
    track, onset, end = recorded(solver, 4, rng)
    unseen = (track.time_s < onset + 0.08) | (track.time_s > end - 0.08)
    points = np.array(track.keypoints)
    points[unseen] = np.nan
    times = track.time_s[~unseen]
    part = ArmTrack(track.time_s, points, side="right")
    seen = observe(part, onset, end, solver.arm, facing_rad=0.5 * np.pi, trim=False)
    assert seen.problem.duration == pytest.approx(times[-1] - times[0])
    whole = observe(track, onset, end, solver.arm, facing_rad=0.5 * np.pi, trim=False)
    for time_s, q in ((times[0], seen.problem.q_start), (times[-1], seen.problem.q_end)):
        phase = (time_s - onset) / (end - onset)
        truth = [np.interp(phase, whole.phases, angles) for angles in whole.angles.T]
        np.testing.assert_allclose(q, truth, atol=np.radians(0.1))


def jobs(solver, count):
    return [Job(i, observed(solver, problem(11 * i), ALPHA), solver.arm) for i in range(count)]


def test_laws_are_fitted_arm_by_arm(solver, rng, tmp_path, capsys):
    tracks = [recorded(solver, 9 * n, rng, trial=n)[0] for n in range(9)]
    other = replace(recorded(solver, 3, rng)[0], subject="ben")
    save_tracks(tmp_path / "reaches.npz", [*tracks, other])
    out = tmp_path / "out"
    assert main([str(tmp_path / "reaches.npz"), "--out", str(out), "--law", "--facing", "90"]) == 0
    told = capsys.readouterr().out
    assert "law of ann right: 9 reaches" in told
    content = json.loads((out / "results.json").read_text())
    (law,) = content["laws"]
    assert np.shape(law["theta"]) == np.shape(law["theta_sd"]) == (3, 7)
    assert law["rms_cm"] < 2.0
    assert all(0.0 <= row["share_at_limits"] <= 1.0 for row in content["reaches"])
    text = (out / "results.md").read_text()
    assert "| ann right | 9 |" in text
    assert "no law of ben right: 1 different reaches, a law needs 8" in text
    # It is kept: the same command does not find it once more.
    (kept,) = (out / "laws").glob("*.json")
    kept.write_text(json.dumps({**json.loads(kept.read_text()), "rms_cm": 7.77}))
    again = [str(tmp_path / "reaches.npz"), "--out", str(out), "--law", "--facing", "90"]
    assert main([*again, "--workers", "1"]) == 0
    assert "law of ann right: 9 reaches, 7.77 cm" in capsys.readouterr().out
    arguments = [str(tmp_path / "reaches.npz"), "--out", str(out), "--law", "--costs", "energy"]
    assert main(arguments) == 1
    assert "joint_jerk and one more" in capsys.readouterr().err
    arguments = [str(tmp_path / "reaches.npz"), "--out", str(out), "--law", "--average"]
    assert main(arguments) == 1
    assert "--law with --average" in capsys.readouterr().err


def test_laws_of_whole_reaches_count_repetitions_once(solver, rng, tmp_path, capsys):
    tracks = [
        replace(recorded(solver, 9 * (n // 2), rng, trial=n)[0], task=f"T{n // 2}")
        for n in range(18)
    ]
    save_tracks(tmp_path / "reaches.npz", tracks)
    out = tmp_path / "out"
    arguments = [str(tmp_path / "reaches.npz"), "--out", str(out), "--law", "--facing", "90"]
    assert main([*arguments, "--whole"]) == 0
    content = json.loads((out / "results.json").read_text())
    assert content["whole"]
    (law,) = content["laws"]
    assert law["reaches"] == 18
    save_tracks(tmp_path / "reaches.npz", tracks[:8])
    assert main([*arguments, "--whole"]) == 0
    assert "4 different reaches, a law needs 8" in (out / "results.md").read_text()


@pytest.mark.parametrize("where", [0.2, 0.35, 0.5, 0.65])
@pytest.mark.parametrize("gap_s", [0.15, 0.3])
def test_what_is_left_of_a_reach_after_a_gap_is_none(solver, rng, where, gap_s):
    """The speed is known again soon after it, as if the hand had set out there."""
    track, onset, end = recorded(solver, 3, rng)
    hidden = np.abs(track.time_s - onset - where * (end - onset)) < 0.5 * gap_s
    points = np.where(hidden[:, None, None], np.nan, track.keypoints)
    gapped = replace(track, keypoints=points)
    arm = arm_of([track])
    found = find_reaches(gapped.time_s, gapped.keypoints[:, 2])
    assert found
    for reach in found:
        with pytest.raises(DataError, match=r"was not seen|seen together"):
            observe(gapped, reach.onset_s, reach.end_s, arm, facing_rad=0.5 * np.pi)


@pytest.mark.parametrize(("part", "word"), [((0.0, 0.5), "ends"), ((0.5, 1.0), "begins")])
def test_half_a_reach_is_none(solver, rng, part, word):
    """As where markers were lost in its middle: what is left would pass for a reach of its own."""
    track, onset, end = recorded(solver, 3, rng)
    first, last = (onset + share * (end - onset) for share in part)
    inside = (track.time_s >= first) & (track.time_s <= last)
    half = replace(track, time_s=track.time_s[inside], keypoints=track.keypoints[inside])
    with pytest.raises(DataError, match=rf"{word} with \d+% of its peak speed.*from rest to rest"):
        observe(half, first, last, solver.arm, facing_rad=0.5 * np.pi)


def test_batches_are_the_same_on_any_number_of_workers_and_go_on(solver, tmp_path):
    many = jobs(solver, 4)
    alone = explain_all(many, workers=1, kept=Kept(tmp_path / "a.jsonl"))
    done: list[tuple[int, int]] = []
    # Broken off in the middle of a line; the rest is done by two.
    lines = (tmp_path / "a.jsonl").read_text().splitlines(keepends=True)
    (tmp_path / "b.jsonl").write_text("".join(lines[:2]) + lines[2][:50])
    both = explain_all(
        many, workers=2, kept=Kept(tmp_path / "b.jsonl"), progress=lambda *at: done.append(at)
    )
    assert done == [(2, 4), (3, 4), (4, 4)]
    for one, other in zip(alone, both, strict=True):
        assert {**one.__dict__, "seconds": 0} == {**other.__dict__, "seconds": 0}
        np.testing.assert_allclose(one.alpha, ALPHA, atol=1e-3)
    again = explain_all(many, workers=1, kept=Kept(tmp_path / "b.jsonl"))
    assert [each.index for each in again] == [0, 1, 2, 3]
    other = Job(0, many[0].observed, solver.arm, ("joint_jerk", "energy"))
    assert Kept(tmp_path / "a.jsonl").get(other) is None


def test_a_reach_that_cannot_be_explained_is_an_outcome(solver):
    seen = observed(solver, problem(0), ALPHA)
    limits = solver.limits.degrees(((-90.0, 90.0), (60.0, 135.0), (0.0, 150.0)))
    (outcome,) = explain_all([Job(0, seen, solver.arm, limits=limits)], workers=1)
    assert "q2" in outcome.error
    assert outcome.alpha == ()


def test_command_line(solver, rng, tmp_path, capsys):
    tracks = [
        recorded(solver, number, rng, noise=0.001, trial=trial)[0]
        for number in (0, 40)
        for trial in range(2)
    ]
    save_tracks(tmp_path / "reaches.npz", tracks)
    out = tmp_path / "out"
    arguments = [str(tmp_path / "reaches.npz"), "--out", str(out), "--workers", "1"]
    assert main(arguments) == 0
    results = json.loads((out / "results.json").read_text())
    assert len(results["reaches"]) == 4
    assert results["costs"] == ["hand_jerk", "joint_jerk", "torque_change", "energy"]
    for row in results["reaches"]:
        assert sum(row["alpha"]) == pytest.approx(1.0)
        assert row["distance_cm"] <= min(row["single_cm"]) + 1e-9
        assert row["distance_cm"] < 0.2
        assert row["misfit_cm"] < 1.0
    assert (out / "results.png").stat().st_size > 10_000
    assert "composite" in (out / "results.md").read_text()
    assert len((out / "reaches.jsonl").read_text().splitlines()) == 4
    capsys.readouterr()
    assert main([*arguments, "--average"]) == 1
    assert "results with other average" in capsys.readouterr().err
    assert main([*arguments, "--average", "--overwrite"]) == 0
    results = json.loads((out / "results.json").read_text())
    assert [row["name"] for row in results["reaches"]] == ["ann right task0", "ann right task40"]
    assert len((out / "reaches.jsonl").read_text().splitlines()) == 6  # what was there is kept
    assert "hand [cm]" in capsys.readouterr().out  # no markup of the terminal
    # What there is stays until there is something new.
    gone = [str(tmp_path / "gone.npz"), "--out", str(out), "--overwrite"]
    assert main(gone) == 1
    assert json.loads((out / "results.json").read_text()) == results
    capsys.readouterr()
    (out / "results.json").write_text("[]")
    assert main(arguments) == 1
    assert "no result of this command" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "word"),
    [
        (["--costs", "effort"], "hand_jerk"),
        (["--scaling", "none"], "maximum, range"),
        (["--convention", "roll"], "yaw_pitch"),
        (["--facing", "north"], "degrees"),
    ],
)
def test_wrong_options_are_refused_in_one_line(solver, rng, tmp_path, capsys, arguments, word):
    save_tracks(tmp_path / "one.npz", [recorded(solver, 0, rng)[0]])
    code = main([str(tmp_path / "one.npz"), "--out", str(tmp_path / "out"), *arguments])
    error = capsys.readouterr().err
    assert code == 1
    assert word in error
    assert error.count("\n") == 1


def test_files_without_reaches_are_refused(solver, rng, tmp_path, capsys):
    still = ArmTrack(np.arange(300) / 100.0, np.ones((300, 4, 3)) * np.arange(4)[:, None] * 0.1)
    save_tracks(tmp_path / "still.npz", [still])
    assert main([str(tmp_path / "still.npz"), "--out", str(tmp_path / "out")]) == 1
    error = capsys.readouterr().err
    assert "no wrist moves faster than 0.08 m/s for 0.25 s" in error
    assert error.count("expected") == 1
    # Here one is found, and cannot be used.
    shown, onset, end = recorded(solver, 5, rng)
    hidden = np.array(shown.keypoints)
    hidden[(shown.time_s > onset - 0.1) & (shown.time_s < end + 0.1), 1] = np.nan
    save_tracks(tmp_path / "hidden.npz", [replace(shown, keypoints=hidden)])
    assert main([str(tmp_path / "hidden.npz"), "--out", str(tmp_path / "out")]) == 1
    assert "no reach can be used, of 1; the first: reach 0, from" in capsys.readouterr().err
    assert main([str(tmp_path / "none.npz"), "--out", str(tmp_path / "out")]) == 1
    assert "none.npz" in capsys.readouterr().err


def test_what_cannot_be_used_is_named_and_counted(solver, rng):
    """A reach of which too little is seen is still the first of its recording; so is one without any."""
    first, onset, end = recorded(solver, 5, rng, task="cup", trial=0)
    shift = first.time_s[-1] + 0.01
    time_s = np.concatenate([first.time_s, shift + first.time_s])
    points = np.concatenate([first.keypoints, first.keypoints[::-1]])
    both = replace(first, time_s=time_s, keypoints=points)
    hidden = points.copy()
    hidden[(time_s > onset - 0.1) & (time_s < end + 0.1), 1] = np.nan  # the elbow
    still = np.repeat(first.keypoints[:1], len(first.time_s), axis=0)
    recordings = [
        make_recording(track, SegmentationConfig())
        for track in (
            both,
            replace(both, keypoints=hidden, trial=1),
            replace(first, keypoints=still, trial=2),
        )
    ]
    assert [recording.numbers for recording in recordings] == [(0, 1), (1,), ()]
    people = People("90", 1.75, 70.0, solver.arm.convention, False)
    found, skipped = collect(recordings, people)
    assert sorted(each.task for each in found) == ["cup.0", "cup.1", "cup.1"]
    assert skipped[0].startswith("ann right cup 1: reach 0, from")
    assert skipped[1] == "ann right cup 2: no reach is found in it"


def test_who_shows_no_hand_tip_is_asked_where_people_face(solver, rng):
    track, _, _ = recorded(solver, 5, rng)
    points = np.array(track.keypoints)
    points[:, 3] = np.nan
    recording = make_recording(replace(track, keypoints=points), SegmentationConfig())
    found, skipped = collect([recording], People("auto", 1.75, 70.0, solver.arm.convention, False))
    assert found == []
    assert "--facing DEGREES" in skipped[0]
    found, _ = collect([recording], People("90", 1.75, 70.0, solver.arm.convention, False))
    assert len(found) == 1


def test_all_reaches_of_a_person_are_seen_to_face_the_same_way(solver, rng):
    # Single reaches that begin sideways point nearer to the side than to the front.
    recordings = [
        make_recording(recorded(solver, number, rng)[0], SegmentationConfig())
        for number in range(0, 81, 4)
    ]
    people = People("auto", 1.72, 70.0, "yaw_pitch", False)
    found, skipped = collect(recordings, people)
    assert not skipped
    assert {each.facing_deg for each in found} == {90.0}
    assert max(each.observed.misfit_m for each in found) < 0.005
    turned, _ = collect(recordings, People("0", 1.72, 70.0, "yaw_pitch", False))
    assert max(each.observed.misfit_m for each in turned) > 0.05


def test_means_are_those_of_repetitions(solver, rng):
    tracks = [recorded(solver, 9, rng, trial=trial)[0] for trial in range(2)]
    recordings = [make_recording(track, SegmentationConfig()) for track in tracks]
    people = People("90", 1.72, 70.0, "yaw_pitch", True)
    (only,), skipped = collect(recordings, people)
    assert only.observed.name == "ann right task9"
    assert not skipped
    other = replace(recorded(solver, 2, rng)[0], task="task9", trial=2)
    found, skipped = collect([*recordings, make_recording(other, SegmentationConfig())], people)
    assert not found
    assert "from the mean of all" in skipped[0]
    nameless = make_recording(replace(tracks[0], subject=""), SegmentationConfig())
    with pytest.raises(DataError, match="leave out --average"):
        collect([nameless], people)


def test_stretched_arms_stay_within_the_limits(solver, rng):
    time_s = np.arange(500) / 250.0
    phase = np.clip((time_s - 0.5) / 1.0, 0.0, 1.0)[:, None]
    share = phase**3 * (10.0 - 15.0 * phase + 6.0 * phase**2)
    angles = np.array([0.1, 0.2, 0.0]) + share * np.array([0.0, 1.0, 0.4])
    elbow, wrist = elbow_and_wrist(angles, solver.arm)
    points = np.zeros((500, 4, 3))
    points[:, 1], points[:, 2], points[:, 3] = elbow, wrist, 1.1 * wrist
    points += rng.normal(0.0, 0.002, points.shape)
    seen = observe(ArmTrack(time_s, points), 0.5, 1.5, solver.arm, facing_rad=0.5 * np.pi)
    seen.problem.check_limits()
    assert seen.angles[:, 2].min() >= 0.0


@pytest.mark.parametrize(
    "change",
    [
        {"alpha": None},
        {"alpha": [0.5, 0.5]},
        {"distance_cm": "near"},
        {"distance_cm": float("nan")},
        {"sd": [1, 2, 3, "x"]},
        {"name": 3},
        {"error": "and an error too"},
        {"more": 1},
    ],
)
def test_lines_of_something_else_are_done_again(solver, tmp_path, change):
    (job,) = jobs(solver, 1)
    path = tmp_path / "kept.jsonl"
    explain_all([job], workers=1, kept=Kept(path))
    entry = json.loads(path.read_text())
    assert Kept(path).get(job) is not None
    path.write_text(json.dumps({**entry, **change}) + "\n")
    assert Kept(path).get(job) is None


def test_one_file_without_reaches_does_not_stop_the_others(solver, rng, tmp_path, capsys):
    save_tracks(tmp_path / "one.npz", [recorded(solver, 0, rng)[0]])
    out = tmp_path / "out"
    files = [str(tmp_path / "one.npz"), str(tmp_path / "none.npz")]
    assert main([*files, "--out", str(out), "--workers", "1"]) == 0
    results = json.loads((out / "results.json").read_text())
    assert len(results["reaches"]) == 1
    assert "none.npz" in results["skipped"][0]
    assert results["reaches"][0]["facing_deg"] in (0.0, 90.0)
    assert "Share of the dynamic costs" in (out / "results.md").read_text()
    capsys.readouterr()
