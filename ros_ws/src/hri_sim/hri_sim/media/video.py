"""A video of a run, drawn by MuJoCo where OpenGL works and by our own ray caster elsewhere."""

from __future__ import annotations

import contextlib
import itertools
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hri_planner.robot.model import load_robot
from hri_prediction.errors import ConfigError, DataError
from hri_sim.media.decorations import Decorations
from hri_sim.media.frames import RunRecord
from hri_sim.media.look import arm_shape, camera_for, robot_shape
from hri_sim.media.raycast import Capsules, RayCaster
from hri_sim.media.strip import Strip

FloatArray = NDArray[np.float64]
Image = NDArray[np.uint8]

RENDERERS = ("auto", "mujoco", "software")
SLOWEST = 20.0
"""With ``auto``, MuJoCo draws only where it makes this many pictures a second: OpenGL without a
graphics card is slower than the ray caster."""


@dataclass(frozen=True)
class VideoInfo:
    """A video that was written.

    Attributes:
        path: The file.
        renderer: ``"mujoco"`` or ``"software"``.
        frames: Number of pictures.
        fps: Pictures a second.
        note: Why MuJoCo did not draw, when ``auto`` fell back; empty otherwise.
    """

    path: Path
    renderer: str
    frames: int
    fps: float
    note: str = ""


def render_video(
    record: RunRecord,
    path: str | Path,
    fps: float = 25.0,
    size: tuple[int, int] = (960, 540),
    *,
    renderer: str = "auto",
    speed: float = 1.0,
) -> VideoInfo:
    """Write a run as H.264 video: the scene above, clearance over time below.

    Args:
        record: The run.
        path: The file to write (.mp4).
        fps: Pictures a second.
        size: Width and height [pixel], both even.
        renderer: ``"mujoco"`` (OpenGL, EGL), ``"software"`` (the ray caster), or ``"auto"``: the
            first of the two that works, MuJoCo only where it is fast.
        speed: Seconds of the run in a second of video.

    Raises:
        ConfigError: on an odd or small size, a rate or speed that is not positive, or an unknown
            renderer.
        DataError: when the video cannot be drawn or encoded; the encoder's last words are included.
    """
    width, height = size
    if width % 2 or height % 2 or width < 320 or height < 240:
        raise ConfigError(f"video size {width} x {height}", expected="even, at least 320 x 240")
    if not (fps > 0.0 and speed > 0.0):
        raise ConfigError(f"fps = {fps}, speed = {speed}", expected="positive numbers")
    if renderer not in RENDERERS:
        raise ConfigError(f"renderer {renderer!r}", expected="one of " + ", ".join(RENDERERS))
    begin, end = float(record.time_s[0]), float(record.time_s[-1])
    times = np.arange(begin, end + 0.5 * speed / fps, speed / fps)
    strip = Strip(record, width, _strip_height(height))
    scene_size = (width, height - strip.height)
    note = ""
    if renderer == "software":
        scenes = _software_scenes(record, times, scene_size)
    else:
        try:
            slowest = SLOWEST if renderer == "auto" else 0.0
            scenes = _started(_mujoco_scenes(record, times, scene_size), slowest)
            renderer = "mujoco"
        except DataError as error:
            if renderer == "mujoco":
                raise
            note = str(error)
            scenes = _software_scenes(record, times, scene_size)
            renderer = "software"
    target = Path(path)
    with _Encoder(target, size, fps) as encoder:
        for time_s, scene in zip(times, scenes, strict=True):
            encoder.write(np.concatenate((scene, strip.draw(float(time_s))), axis=0))
    return VideoInfo(target, renderer, len(times), fps, note)


def _strip_height(height: int) -> int:
    """A quarter of the picture for the plot, so that the scene above has an even height too."""
    return 2 * round(0.125 * height)


def _software_scenes(
    record: RunRecord, times: FloatArray, size: tuple[int, int]
) -> Iterator[Image]:
    robot, scenario = load_robot(), record.scenario
    caster = RayCaster(*size, camera_for(scenario), scenario.table.center, scenario.table.size)
    postures, arms, _ = record.at(times)
    decorations = Decorations(record)
    for time_s, q, people in zip(times, postures, arms, strict=True):
        solid, glass = decorations.at(float(time_s))
        shapes = [robot_shape(robot, q), *(arm_shape(arm) for arm in people), solid]
        yield caster.draw(Capsules.joined(shapes), glass)


def _started(frames: Iterator[Image], slowest: float) -> Iterator[Image]:
    """The same pictures, after the first few were drawn: errors of starting come at once.

    Raises:
        DataError: when they come more slowly than ``slowest`` [1/s].
    """
    first = [next(frames)]
    begun = time.perf_counter()
    first += itertools.islice(frames, 6)
    rate = (len(first) - 1) / (time.perf_counter() - begun)
    if rate < slowest:
        raise DataError(f"MuJoCo draws only {rate:.0f} pictures a second here")
    return itertools.chain(first, frames)


def _mujoco_scenes(record: RunRecord, times: FloatArray, size: tuple[int, int]) -> Iterator[Image]:
    """Pictures from a child process: a crash of the OpenGL driver ends only the child.

    Raises:
        DataError: when the child dies or is silent; its last words are included.
    """
    postures, arms, _ = record.at(times)
    length = size[0] * size[1] * 3
    with tempfile.TemporaryDirectory() as folder:
        job, log = Path(folder) / "job.npz", Path(folder) / "log.txt"
        scenario = np.frombuffer(record.scenario.model_dump_json().encode(), np.uint8)
        arrays: dict[str, Any] = {"scenario": scenario, "q": postures, "arms": arms}
        arrays |= Decorations(record).packed(times) | {"size": np.array(size)}
        np.savez(job, **arrays)
        environment = os.environ | {"MUJOCO_GL": "egl"}
        with log.open("wb") as errors:
            child = subprocess.Popen(
                [sys.executable, "-m", "hri_sim.media.mujoco_child", str(job)],
                stdout=subprocess.PIPE,
                stderr=errors,
                env=environment,
            )
        assert child.stdout is not None
        try:
            for _ in times:
                data = child.stdout.read(length)
                if len(data) < length:
                    child.wait()
                    words = log.read_text(errors="replace").strip().splitlines()
                    raise DataError(
                        f"MuJoCo cannot draw here (exit code {child.returncode}): "
                        + (words[-1] if words else "no message"),
                        hint="install Mesa (libegl1, libgl1-mesa-dri) or use the software renderer",
                    )
                yield np.frombuffer(data, np.uint8).reshape(size[1], size[0], 3)
        finally:
            child.stdout.close()
            child.kill()
            child.wait()


class _Encoder:
    """ffmpeg fed with raw pictures; leaves no file behind when it fails."""

    def __init__(self, path: Path, size: tuple[int, int], fps: float) -> None:
        self._path, self._size, self._fps = path, size, fps
        # An older video of this name stays until the new one is whole.
        self._part = path.with_name(path.name + ".part")

    def __enter__(self) -> _Encoder:
        try:
            import imageio_ffmpeg

            program = imageio_ffmpeg.get_ffmpeg_exe()
        except (ImportError, RuntimeError) as error:
            raise DataError(
                f"no video encoder: {error}", hint="install the package imageio-ffmpeg"
            ) from error
        if not self._path.parent.is_dir():
            raise DataError(f"cannot write {self._path}: its folder does not exist")
        command = [program, "-y", "-loglevel", "error", "-f", "rawvideo", "-pix_fmt", "rgb24"]
        command += ["-s", f"{self._size[0]}x{self._size[1]}", "-r", f"{self._fps:g}", "-i", "-"]
        command += ["-an", "-c:v", "libx264", "-preset", "veryfast", "-crf", "21"]
        command += ["-pix_fmt", "yuv420p", "-movflags", "+faststart", "-f", "mp4", str(self._part)]
        # A file, not a pipe, for its messages: nobody reads them meanwhile.
        self._log = tempfile.TemporaryFile()
        try:
            self._process = subprocess.Popen(
                command, stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=self._log
            )
        except OSError as error:
            raise DataError(f"cannot start the video encoder {program}: {error}") from error
        return self

    def write(self, picture: Image) -> None:
        assert self._process.stdin is not None
        try:
            self._process.stdin.write(picture.tobytes())
        except BrokenPipeError as error:
            raise self._failure() from error

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        assert self._process.stdin is not None
        with contextlib.suppress(BrokenPipeError):
            self._process.stdin.close()
        code = self._process.wait()
        failure = self._failure() if code and kind is None else None
        self._log.close()
        if code or kind is not None:
            self._part.unlink(missing_ok=True)
        if failure is not None:
            raise failure
        if kind is None:
            try:
                self._part.replace(self._path)
            except OSError as error:
                self._part.unlink(missing_ok=True)
                raise DataError(f"cannot write {self._path}: {error.strerror}") from error

    def _failure(self) -> DataError:
        self._process.wait()
        self._log.seek(0)
        words = self._log.read().decode(errors="replace").strip().splitlines()
        return DataError(f"cannot encode {self._path}: {words[-1] if words else 'ffmpeg failed'}")
