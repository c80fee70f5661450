"""Pictures and videos: they are made, they show something, and they fail with a clear line."""

import os
import subprocess
from dataclasses import replace

import imageio_ffmpeg
import matplotlib.image
import numpy as np
import pytest

from hri_planner.robot import load_robot
from hri_prediction.errors import ConfigError, DataError
from hri_sim.media import (
    BaselineTrack,
    PredictionMark,
    ReachMark,
    RunRecord,
    draw_picture,
    picture,
    render_video,
    video,
)
from hri_sim.media.frames import holes
from hri_sim.media.look import tube_shape, tube_shown
from hri_sim.media.raycast import Camera, Capsules, RayCaster
from hri_sim.scenario.schema import PersonSpec, ReachSpec, Scenario

ROBOT = load_robot()
LEFT = np.array([0.75, -0.9, 0.0, 1.5, 0.0, -0.75, 0.0])
ARM = np.array([[0.75, 0.0, 0.4], [0.70, 0.15, 0.2], [0.55, 0.1, 0.1], [0.5, 0.1, 0.1]])
SIZE = (320, 240)


def make_record(people=1, hidden=False, extras=True, seconds=0.8):
    scenario = Scenario(
        name="small",
        robot_start=tuple(LEFT),
        targets={"cup": (0.5, 0.1, 0.2)},
        persons=tuple(PersonSpec(id=f"person{n + 1}") for n in range(people)),
        reaches=(ReachSpec(robot_target="cup"),),
    )
    t = np.arange(0.0, seconds, 0.004)
    q = LEFT + np.linspace(0.0, 1.0, len(t))[:, None] * [-1.5, 0, 0, 0, 0, 0, 0]
    arms = np.tile(ARM, (len(t), people, 1, 1)) + 0.1 * t[:, None, None, None]
    clearance = 0.1 - 0.12 * np.sin(4.0 * t)
    if hidden or not people:
        arms, clearance = arms * np.nan, clearance * np.inf
    prediction = PredictionMark(0.3, np.tile(ARM, (10, 1, 1)), np.full((10, 4), 0.01))
    return RunRecord(
        scenario,
        t,
        q,
        arms,
        clearance,
        reaches=(ReachMark(0.1, 0.7, "reach"),) if extras else (),
        predictions=(prediction,) if extras else (),
        baseline=BaselineTrack(t, q, clearance - 0.05) if extras else None,
        title="A small run" if extras else "",
    )


def count_frames(path):
    return imageio_ffmpeg.count_frames_and_secs(str(path))


@pytest.mark.parametrize(
    "options",
    [{}, {"people": 2}, {"people": 0}, {"hidden": True}, {"extras": False}],
    ids=["full", "two", "nobody", "hidden", "bare"],
)
def test_picture_of_any_run(tmp_path, options):
    path = draw_picture(make_record(**options), tmp_path / "run.png", dpi=60)
    pixels = matplotlib.image.imread(path)
    assert pixels.shape[:2] == (492, 660)
    assert pixels[..., :3].std() > 0.05


@pytest.mark.filterwarnings("error")
def test_picture_of_a_recording_that_ended_before_the_reaches(tmp_path):
    marks = (ReachMark(0.3, 4.5, "cut off"), ReachMark(6.0, 8.0, "not recorded"))
    path = draw_picture(replace(make_record(), reaches=marks), tmp_path / "run.png", dpi=60)
    assert path.stat().st_size > 5000


def test_what_was_not_recorded_is_no_line(tmp_path):
    """Neither straight across the gap, nor as a speed."""
    whole = make_record()
    kept = np.r_[0:60, 160:200]
    record = replace(
        whole,
        **{name: getattr(whole, name)[kept] for name in ("time_s", "q", "arms", "clearance_m")},
    )
    assert list(holes(record.time_s)) == [59]
    times, values = picture._broken(record, record.clearance_m)
    assert list(np.flatnonzero(np.isnan(values))) == [60]
    assert (np.diff(times) >= 0.0).all()
    text = draw_picture(record, tmp_path / "run.svg", dpi=60).read_text()
    assert "no states recorded" in text
    assert (
        "no states recorded" not in draw_picture(whole, tmp_path / "whole.svg", dpi=60).read_text()
    )


def test_picture_as_vector_graphics(tmp_path):
    path = draw_picture(make_record(), tmp_path / "run.svg", dpi=60)
    text = path.read_text()
    assert "<svg" in text


def test_picture_that_cannot_be_written(tmp_path):
    with pytest.raises(DataError, match="cannot write"):
        draw_picture(make_record(), tmp_path / "no" / "run.png", dpi=40)
    with pytest.raises(DataError, match="cannot write"):
        draw_picture(make_record(), tmp_path / "run.xyz", dpi=40)


def test_video_without_opengl(tmp_path, monkeypatch):
    monkeypatch.setattr(video.sys, "executable", "/bin/false")
    info = render_video(make_record(), tmp_path / "run.mp4", fps=10.0, size=SIZE)
    assert info.renderer == "software"
    assert "MuJoCo cannot draw here (exit code 1)" in info.note
    frames, seconds = count_frames(info.path)
    assert frames == info.frames == 9
    assert seconds == pytest.approx(0.9, abs=0.11)
    with pytest.raises(DataError, match="MuJoCo cannot draw"):
        render_video(make_record(), tmp_path / "b.mp4", size=SIZE, renderer="mujoco")


def test_video_with_mujoco_where_it_draws(tmp_path):
    try:
        info = render_video(
            make_record(), tmp_path / "run.mp4", fps=10.0, size=SIZE, renderer="mujoco"
        )
    except DataError as error:
        pytest.skip(str(error))
    assert count_frames(info.path)[0] == 9


def test_slow_motion_has_more_frames(tmp_path):
    path = tmp_path / "slow.mp4"
    info = render_video(make_record(), path, 10.0, SIZE, renderer="software", speed=0.5)
    assert info.frames == 17


def test_video_errors_are_one_clear_line(tmp_path, monkeypatch):
    record = make_record(seconds=0.1)
    with pytest.raises(ConfigError, match="321 x 240"):
        render_video(record, tmp_path / "a.mp4", size=(321, 240))
    with pytest.raises(ConfigError, match="renderer 'magic'"):
        render_video(record, tmp_path / "a.mp4", renderer="magic")
    with pytest.raises(ConfigError, match="fps = 0"):
        render_video(record, tmp_path / "a.mp4", fps=0.0)
    with pytest.raises(DataError, match="folder does not exist"):
        render_video(record, tmp_path / "no" / "a.mp4", size=SIZE, renderer="software")
    (tmp_path / "folder.mp4").mkdir()
    with pytest.raises(DataError, match=r"cannot write .*directory"):
        render_video(record, tmp_path / "folder.mp4", size=SIZE, renderer="software")
    assert list(tmp_path.iterdir()) == [tmp_path / "folder.mp4"]
    monkeypatch.setenv("IMAGEIO_FFMPEG_EXE", "/no/such/program")
    with pytest.raises(DataError, match="cannot start the video encoder"):
        render_video(record, tmp_path / "a.mp4", size=SIZE, renderer="software")


def test_a_crash_of_the_driver_stays_in_the_child(tmp_path, monkeypatch):
    script = tmp_path / "crash.sh"
    script.write_text("#!/bin/sh\necho driver says no >&2\nkill -SEGV $$\n")
    script.chmod(0o755)
    monkeypatch.setattr(video.sys, "executable", str(script))
    info = render_video(make_record(seconds=0.1), tmp_path / "a.mp4", size=SIZE)
    assert info.renderer == "software"
    assert "driver says no" in info.note


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"time_s": np.zeros(200)}, "increasing"),
        ({"q": np.zeros((200, 6))}, r"q has shape \(200, 6\)"),
        ({"arms": np.zeros((200, 2, 4, 3))}, "arms has shape"),
        ({"clearance_m": np.zeros(3)}, "clearance_m has shape"),
        ({"q": np.full((200, 7), np.nan)}, "not finite"),
    ],
)
def test_records_are_checked(changes, message):
    record = make_record()
    values = {name: getattr(record, name) for name in record.__dataclass_fields__}
    with pytest.raises(DataError, match=message):
        RunRecord(**values | changes)


def test_ray_caster_projects_as_its_camera_says():
    camera = Camera()
    caster = RayCaster(320, 240, camera, (0.85, 0.0, -0.03), (1.2, 1.4, 0.04))
    point = np.array([0.4, 0.1, 0.5])
    ball = Capsules(np.stack((point, point))[None], np.array([0.05]), np.array([[1.0, 0.0, 0.0]]))
    nothing = Capsules(np.zeros((0, 2, 3)), np.zeros(0), np.zeros((0, 3)))
    difference = caster.draw(ball)[..., 1] < 0.5 * caster.draw(nothing)[..., 1]
    rows, columns = np.nonzero(difference)
    u, v = camera.project(point, 320, 240)
    assert columns.mean() == pytest.approx(u, abs=1.0)
    assert rows.mean() == pytest.approx(v, abs=1.0)


def test_child_draws_as_a_module(tmp_path):
    done = subprocess.run(
        [video.sys.executable, "-m", "hri_sim.media.mujoco_child", str(tmp_path / "none.npz")],
        capture_output=True,
        env=os.environ | {"MUJOCO_GL": "egl"},
        check=False,
    )
    assert done.returncode != 0
    assert b"none.npz" in done.stderr


def test_predictions_are_drawn_as_far_as_they_say_something():
    mean, sigma = np.zeros((5, 3)), np.array([0.01, 0.1, 0.15, 0.2, 0.1])
    points, radii = tube_shown(mean, sigma)
    assert len(points) == 3
    np.testing.assert_allclose(radii, [0.02, 0.2, 0.3])
    assert len(tube_shape(mean, sigma + 0.2).radii) == 0
    assert len(tube_shown(mean, 0.1 * sigma)[0]) == 5
