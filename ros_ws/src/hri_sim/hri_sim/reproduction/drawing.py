"""What the pictures of single conditions have in common: scenes as ray casts, clearances over time."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from hri_planner.robot import load_robot
from hri_prediction.arm.geometry import FloatArray
from hri_sim.benchmark.conditions import ROBOT_GOAL, Condition
from hri_sim.benchmark.outcome import Execution
from hri_sim.media.look import (
    GREEN,
    STYLE,
    Colour,
    arm_shape,
    camera_for,
    robot_shape,
    target_shape,
    torso_shape,
)
from hri_sim.media.raycast import Camera, Capsules, RayCaster
from hri_sim.reproduction.closer import pair_distances
from hri_sim.scenario.schema import Scenario

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

DPI = 150
_PAD = 0.09  # around each panel [inch]
_WIDTH, _HEIGHT = 880, 760
_PATH = 0.013  # radius of a path, over the field of view [m/rad]
_RIM = 0.05  # of the picture, kept free of paths


@dataclass(frozen=True, eq=False)
class Trace:
    """One motion of the robot in a picture.

    Attributes:
        label: In the legend.
        colour: Of its path and its curve.
        run: The motion.
        style: Of the curve, as matplotlib's; the path is dashed unless it is ``-``.
    """

    label: str
    colour: Colour
    run: Execution
    style: str = "-"

    def clearance(self) -> FloatArray:
        """Distance to the person over time (N,) [m]."""
        return np.asarray(pair_distances(self.run).min(axis=(1, 2)))

    def closest_s(self) -> float:
        """When robot and person are nearest on the way [s]; at the goal does not count."""
        end = None if self.run.arrived is None else self.run.arrived + 1
        return float(self.clearance()[:end].argmin()) * self.run.step_s

    def row(self, time_s: float) -> int:
        """The row of a time [s], the last one after the end."""
        return min(round(time_s / self.run.step_s), len(self.run.q) - 1)


@contextlib.contextmanager
def drawn(path: Path, width: float, height: float) -> Iterator[Figure]:
    """A figure of a size [inch] in the style of all pictures, written when it is done."""
    import matplotlib
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure
    from matplotlib.layout_engine import ConstrainedLayoutEngine

    with matplotlib.rc_context(STYLE):
        figure = Figure(
            figsize=(width, height), layout=ConstrainedLayoutEngine(h_pad=_PAD, w_pad=_PAD)
        )
        FigureCanvasAgg(figure)
        yield figure
        figure.savefig(path, dpi=DPI)


def draw_scene(
    axes: Axes, condition: Condition, shown: Trace, time_s: float, paths: Sequence[Trace] = ()
) -> None:
    """Robot and person at a time of a motion, and the whole paths of the tool of some motions.

    A green ring is around the robot's goal.
    """
    robot, scenario = load_robot(), condition.scenario
    row = shown.row(time_s)
    arm = condition.person().truth(np.array([time_s]))[0]
    tools = [robot.frames(trace.run.q)[:, 3] for trace in paths]
    trunk = torso_shape(scenario.persons[0])
    head = trunk.ends[-1]
    bodies = [robot.frames(shown.run.q[row]), arm, head]
    camera = camera_showing(scenario, np.concatenate([*bodies, *tools]))
    caster = RayCaster(_WIDTH, _HEIGHT, camera, scenario.table.center, scenario.table.size, 2)
    solid = [robot_shape(robot, shown.run.q[row]), arm_shape(arm), trunk]
    solid.append(target_shape(np.array([scenario.targets[ROBOT_GOAL]])))
    for trace, whole in zip(paths, tools, strict=True):
        tool = whole[::4].copy()
        if trace.style != "-":
            tool[np.arange(len(tool)) % 6 > 3] = np.nan
        solid.append(Capsules.along(tool, _PATH * camera.fov, trace.colour))
    axes.imshow(caster.draw(Capsules.joined(solid)), interpolation="lanczos")
    goal = camera.project(np.array(condition.robot_goal), _WIDTH, _HEIGHT)
    axes.plot(*goal, "o", ms=11, mfc="none", mec=GREEN, mew=1.6)
    axes.set_axis_off()


def camera_showing(scenario: Scenario, points: FloatArray) -> Camera:
    """The usual view; a wider one, aimed at the middle, where points (N, 3) [m] would be outside."""
    usual = camera_for(scenario)
    if _extent(usual, points) <= 1.0:
        return usual
    x, y, z = 0.5 * (points.min(axis=0) + points.max(axis=0))
    aimed = replace(usual, target=(float(x), float(y), float(z)))
    return replace(aimed, fov=2.0 * math.atan(_extent(aimed, points) * math.tan(0.5 * aimed.fov)))


def _extent(camera: Camera, points: FloatArray) -> float:
    """How far out the outermost point is seen; 1 is at the rim that is kept free."""
    middle = 0.5 * np.array([_WIDTH, _HEIGHT])
    away = np.abs(camera.project(points, _WIDTH, _HEIGHT) - middle) / middle
    return float(away.max()) / (1.0 - _RIM)


def draw_clearances(
    axes: Axes, condition: Condition, traces: Sequence[Trace], instants: Sequence[float] = ()
) -> None:
    """Clearance of motions over time; the span in which the person moves is shaded."""
    reach = condition.scenario.reaches[0]
    axes.axvspan(
        reach.person_delay,
        reach.person_delay + reach.person_duration,
        color="0.5",
        alpha=0.12,
        lw=0,
        label="person moves",
    )
    axes.axhline(0.0, color="black", lw=1.0)
    for trace in traces:
        values = 1e3 * trace.clearance()
        times = np.arange(len(values)) * trace.run.step_s
        axes.plot(times, values, trace.style, color=trace.colour, lw=2.0, label=trace.label)
        if trace.run.arrived is not None:
            at = trace.run.arrived
            axes.plot(times[at], values[at], "o", ms=6, mfc="white", mec=trace.colour, mew=1.6)
    for time_s in instants:
        axes.axvline(time_s, color="0.35", lw=1.0, ls=":")
    axes.set_xlim(0.0, max(len(trace.run.q) for trace in traces) * traces[0].run.step_s)
    axes.set_xlabel("time since the robot's start [s]   (ring: at rest at the goal)")
    axes.set_ylabel("clearance [mm]")
