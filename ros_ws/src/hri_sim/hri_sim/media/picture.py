"""One picture of a run: the scene at its closest moment, the paths, and the distances over time."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from hri_planner.robot.model import RobotModel, load_robot
from hri_prediction.arm.geometry import ArmRadii
from hri_prediction.errors import DataError
from hri_prediction.geometry.segments import capsule_distances, closest_parameters
from hri_sim.media.frames import PredictionMark, ReachMark, RunRecord, holes
from hri_sim.media.look import (
    BLUE,
    GREEN,
    GREY,
    LIMBS,
    PURPLE,
    ROBOT_PARTS,
    STYLE,
    TORSO,
    TUBE_M,
    VERMILION,
    arm_shape,
    camera_for,
    robot_shape,
    target_shape,
    torso_shape,
    tube_shape,
    tube_shown,
)
from hri_sim.media.raycast import Capsules, RayCaster

if TYPE_CHECKING:
    from matplotlib.axes import Axes

FloatArray = NDArray[np.float64]

PREDICTED_AT = 0.3
"""Share of the reach at which the prediction is shown."""


def draw_picture(record: RunRecord, path: str | Path, dpi: int = 150) -> Path:
    """Draw a run: scene and top view at the closest moment, clearance and speeds over time.

    Args:
        record: The run.
        path: Where to write; the ending chooses the format (.png, .pdf, .svg).
        dpi: Resolution [1/inch]; the picture is 11 x 8.2 inches.

    Returns:
        The path written.

    Raises:
        DataError: when the file cannot be written.
    """
    import matplotlib
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(11.0, 8.2), layout="constrained")
        FigureCanvasAgg(figure)
        grid = figure.add_gridspec(
            4, 2, height_ratios=(3.3, 0.34, 1.25, 0.85), width_ratios=(1.3, 1)
        )
        moment = _Moment(record, load_robot())
        _draw_scene(figure.add_subplot(grid[0, 0]), moment)
        _draw_top_view(figure.add_subplot(grid[0, 1]), moment)
        _legend(figure.add_subplot(grid[1, :]), moment)
        clearance = figure.add_subplot(grid[2, :])
        _draw_clearance(clearance, moment)
        _draw_speeds(figure.add_subplot(grid[3, :], sharex=clearance), moment)
        figure.align_ylabels()
        if record.title:
            figure.suptitle(record.title, fontsize=12.5, fontweight="bold", x=0.012, ha="left")
        target = Path(path)
        try:
            figure.savefig(target, dpi=dpi)
        except (OSError, ValueError) as error:
            raise DataError(f"cannot write {target}: {error}") from error
    return target


class _Moment:
    """The run at its closest moment, and what belongs to that reach."""

    def __init__(self, record: RunRecord, robot: RobotModel) -> None:
        self.record, self.robot = record, robot
        self.index = record.closest()
        self.time_s = float(record.time_s[self.index])
        self.q, self.arms = record.q[self.index], record.arms[self.index]
        self.reach: ReachMark = record.reach_at(self.time_s)
        begin, end = self.reach.start_s, self.reach.end_s
        self.during = (record.time_s >= begin) & (record.time_s <= end)
        self.tool = robot.frames(record.q)[:, 3]
        self.prediction: PredictionMark | None = record.prediction_near(
            begin + PREDICTED_AT * (end - begin)
        )
        self.baseline_tool: FloatArray | None = None
        if record.baseline is not None:
            chosen = (record.baseline.time_s >= begin) & (record.baseline.time_s <= end)
            if chosen.any():
                self.baseline_tool = robot.frames(record.baseline.q[chosen])[:, 3]

    def closest_points(self) -> FloatArray | None:
        """Nearest surface points of robot and people (2, 3) [m]; None when nobody is there."""
        robot = self.robot.robot_capsules(self.q)
        best: tuple[float, FloatArray] | None = None
        radii = ArmRadii().array
        for arm in self.arms:
            if not np.isfinite(arm).all():
                continue
            limbs = np.stack((arm[:-1], arm[1:]), axis=1)
            distances = capsule_distances(robot, self.robot.capsule_radii, limbs, radii)
            i, j = np.unravel_index(int(distances.argmin()), distances.shape)
            if best is not None and distances[i, j] >= best[0]:
                continue
            s, t, _ = closest_parameters(*robot[i], *limbs[j])
            a = robot[i, 0] + s * (robot[i, 1] - robot[i, 0])
            b = limbs[j, 0] + t * (limbs[j, 1] - limbs[j, 0])
            way = (b - a) / max(float(np.linalg.norm(b - a)), 1e-9)
            ends = np.stack((a + self.robot.capsule_radii[i] * way, b - radii[j] * way))
            best = float(distances[i, j]), ends
        return None if best is None else best[1]


def _draw_scene(axes: Axes, moment: _Moment) -> None:
    record, scenario = moment.record, moment.record.scenario
    width, height = 1180, 880
    camera = camera_for(scenario)
    caster = RayCaster(width, height, camera, scenario.table.center, scenario.table.size, 2)
    solid = [robot_shape(moment.robot, moment.q)]
    solid += [arm_shape(arm) for arm in moment.arms]
    solid += [torso_shape(person) for person in scenario.persons]
    solid.append(target_shape(record.goal_places))
    solid.append(Capsules.along(moment.tool[moment.during][::4], 0.006, BLUE))
    if moment.baseline_tool is not None:
        dashes = moment.baseline_tool[::4].copy()
        dashes[np.arange(len(dashes)) % 6 > 3] = np.nan
        solid.append(Capsules.along(dashes, 0.006, (0.25, 0.25, 0.27)))
    glass = None
    if moment.prediction is not None:
        glass = tube_shape(moment.prediction.mean[:, 2], moment.prediction.sigma[:, 2])
    axes.imshow(caster.draw(Capsules.joined(solid), glass), interpolation="lanczos")
    axes.set_axis_off()
    axes.set_title(f"Closest moment, t = {moment.time_s:.2f} s")
    ends = moment.closest_points()
    if ends is not None:
        u, v = camera.project(ends.mean(axis=0), width, height)
        text = f"{1e3 * record.clearance_m[moment.index]:.0f} mm".replace("-", "\N{MINUS SIGN}")
        axes.annotate(
            text,
            (u, v),
            (u - 30, max(v - 230, 60)),
            fontsize=11,
            fontweight="bold",
            ha="center",
            bbox={"boxstyle": "round,pad=0.3", "fc": "white", "ec": "0.6", "alpha": 0.92},
            arrowprops={"arrowstyle": "-", "color": "0.2", "lw": 1.1},
        )


def _outline(a: FloatArray, b: FloatArray, radius: float) -> FloatArray:
    """Closed outline (N, 2) of the shadow of a capsule with ends (2,) [m]."""
    angle = float(np.arctan2(*(b - a)[::-1]))
    half = np.linspace(-0.5 * np.pi, 0.5 * np.pi, 25)
    first = b + radius * np.stack((np.cos(angle + half), np.sin(angle + half)), axis=1)
    second = a - radius * np.stack((np.cos(angle + half), np.sin(angle + half)), axis=1)
    return np.concatenate((first, second))


def _mixed(colour: tuple[float, ...], white: float) -> tuple[float, ...]:
    """A colour with white mixed in; a negative share darkens it."""
    return tuple(float(c + white * (1.0 - c if white > 0.0 else c)) for c in colour)


def _capsules(axes: Axes, shape: Capsules, order: float, white: float = 0.0, **style: Any) -> None:
    for ends, radius, colour in sorted(
        zip(shape.ends, shape.radii, shape.colours, strict=True),
        key=lambda part: part[0][:, 2].max(),
    ):
        outline = _outline(ends[0, :2], ends[1, :2], float(radius))
        axes.fill(*outline.T, fc=_mixed(colour, white), zorder=order, **style)


def _tube(axes: Axes, centres: FloatArray, radii: FloatArray) -> None:
    """The union of discs (K, 2), (K,) [m] as one translucent patch, and their centres as a line."""
    pad = float(radii.max()) + 0.02
    low, high = centres.min(axis=0) - pad, centres.max(axis=0) + pad
    x, y = np.linspace(low[0], high[0], 240), np.linspace(low[1], high[1], 240)
    grid = np.stack(np.meshgrid(x, y), axis=-1)
    outside = np.full(grid.shape[:2], np.inf)
    for centre, radius in zip(centres, radii, strict=True):
        distance = np.linalg.norm(grid - centre, axis=-1) - radius
        np.minimum(outside, distance, out=outside)
    axes.contourf(x, y, outside, [-np.inf, 0.0], colors=[PURPLE], alpha=0.40, zorder=4)
    axes.contour(x, y, outside, [0.0], colors=[PURPLE], linewidths=1.0, zorder=4.1)
    axes.plot(*centres.T, ":", color=_mixed(PURPLE, -0.35), lw=1.6, zorder=4.5)


def _draw_top_view(axes: Axes, moment: _Moment) -> None:
    record, scenario = moment.record, moment.record.scenario
    table = scenario.table
    corner = (table.center[0] - 0.5 * table.size[0], table.center[1] - 0.5 * table.size[1])
    from matplotlib.patches import Rectangle

    axes.add_patch(
        Rectangle(corner, *table.size[:2], fc=(0.955, 0.94, 0.91), ec=(0.8, 0.76, 0.7), zorder=0)
    )
    for box in scenario.obstacles:
        begin = (box.center[0] - 0.5 * box.size[0], box.center[1] - 0.5 * box.size[1])
        axes.add_patch(
            Rectangle(begin, *box.size[:2], fc=(0.95, 0.72, 0.45), ec=(0.8, 0.5, 0.2), zorder=0.5)
        )
    during = moment.during
    if moment.prediction is not None:
        wrist, radii = tube_shown(moment.prediction.mean[:, 2], moment.prediction.sigma[:, 2])
        if len(wrist):
            _tube(axes, wrist[:, :2], radii)
    for person in scenario.persons:
        shape = torso_shape(person)
        _capsules(axes, shape, 1.0, white=0.45, ec="none")
    for index in np.flatnonzero(during)[[0, -1]] if during.any() else ():
        _capsules(axes, robot_shape(moment.robot, record.q[index]), 2.0, 0.80, ec="0.75", lw=0.5)
    _capsules(axes, robot_shape(moment.robot, moment.q), 3.0, 0.12, ec="white", lw=0.7, alpha=0.93)
    for arm in moment.arms:
        _capsules(axes, arm_shape(arm), 3.5, 0.1, ec="white", lw=0.7, alpha=0.93)
    for wrist in record.arms[during, :, 2, :2].swapaxes(0, 1):
        axes.plot(*wrist.T, color=VERMILION, lw=1.8, zorder=5)
    if moment.baseline_tool is not None:
        axes.plot(*moment.baseline_tool[:, :2].T, "--", color="0.25", lw=1.5, zorder=5)
    axes.plot(*moment.tool[during, :2].T, color="white", lw=4.0, zorder=5.5, alpha=0.8)
    axes.plot(*moment.tool[during, :2].T, color=BLUE, lw=2.2, zorder=6)
    axes.plot(*record.goal_places[:, :2].T, "o", ms=7, mfc=GREEN, mec="white", zorder=7)
    ends = moment.closest_points()
    if ends is not None:
        axes.plot(*ends[:, :2].T, "-", color="black", lw=1.4, zorder=8)
        axes.plot(*ends[:, :2].T, ".", color="black", ms=4, zorder=8)
    axes.set(xlim=(-0.22, 1.08), ylim=(-0.62, 0.62), xlabel="x [m]", ylabel="y [m]")
    axes.set_aspect("equal")
    axes.set_title("From above")


def _legend(axes: Axes, moment: _Moment) -> None:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    entries: list[Any] = [Line2D([], [], color=BLUE, lw=2.2, label="tool, executed")]
    if moment.baseline_tool is not None:
        entries.append(Line2D([], [], color="0.25", ls="--", lw=1.5, label="tool, no replanning"))
    if moment.record.arms.shape[1]:
        entries.append(Line2D([], [], color=VERMILION, lw=1.8, label="wrist, true"))
    if moment.prediction is not None:
        since = moment.prediction.time_s - moment.reach.start_s
        label = f"wrist, predicted at {since:.2f} s (mean ± 2σ, to {100.0 * TUBE_M:g} cm)"
        entries.append(Patch(fc=_mixed(PURPLE, 0.55), ec=PURPLE, label=label))
    entries.append(Patch(fc=ROBOT_PARTS[1], label="robot capsules"))
    if moment.record.arms.shape[1]:
        entries.append(Patch(fc=LIMBS[1], label="arm capsules"))
        entries.append(Patch(fc=_mixed(TORSO, 0.45), label="head and trunk (not modelled)"))
    entries.append(Line2D([], [], marker="o", ls="", mfc=GREEN, mec="white", ms=7, label="targets"))
    axes.legend(
        handles=entries,
        loc="center",
        ncols=4,
        columnspacing=1.8,
        handlelength=1.8,
        labelspacing=0.35,
    )
    axes.set_axis_off()


def _reach_bands(axes: Axes, record: RunRecord, labels: bool) -> None:
    for number, reach in enumerate(record.reaches):
        end_s = min(reach.end_s, float(record.time_s[-1]))
        if end_s <= reach.start_s:  # the recording had ended before it
            continue
        axes.axvspan(reach.start_s, end_s, color="0.5", alpha=0.10, lw=0, zorder=0)
        if labels:
            axes.annotate(
                reach.label or f"reach {number + 1}",
                (0.5 * (reach.start_s + end_s), 1.0),
                xycoords=("data", "axes fraction"),
                xytext=(0, -3),
                textcoords="offset points",
                ha="center",
                va="top",
                color="0.35",
                fontsize=8.5,
            )


def _broken(record: RunRecord, values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Times [s] and values of the samples of a run, as a line that breaks where nothing was recorded."""
    after = holes(record.time_s) + 1
    return np.insert(record.time_s, after, record.time_s[after]), np.insert(values, after, np.nan)


def _unrecorded(axes: Axes, record: RunRecord, label: str = "") -> None:
    for number, index in enumerate(holes(record.time_s)):
        begin_s, end_s = record.time_s[index : index + 2]
        name = label if number == 0 else ""
        axes.axvspan(begin_s, end_s, fc="none", ec="0.7", hatch="////", lw=0, zorder=1, label=name)


def _draw_clearance(axes: Axes, moment: _Moment) -> None:
    record = moment.record
    ours = np.where(np.isfinite(record.clearance_m), 1e3 * record.clearance_m, np.nan)
    low = float(np.nanmin(ours)) if np.isfinite(ours).any() else 0.0
    high = float(np.nanmax(ours)) if np.isfinite(ours).any() else 1.0
    _reach_bands(axes, record, labels=True)
    axes.axhline(0.0, color="black", lw=1.0)
    if record.baseline is not None:
        theirs = 1e3 * record.baseline.clearance_m
        theirs = np.where(np.isfinite(theirs), theirs, np.nan)
        axes.plot(record.baseline.time_s, theirs, "--", color=GREY, lw=1.5, label="no replanning")
        axes.fill_between(
            record.baseline.time_s,
            theirs,
            0.0,
            where=theirs < 0.0,
            color=VERMILION,
            alpha=0.30,
            lw=0,
            label="collision without replanning",
        )
        if np.isfinite(theirs).any():
            low, high = min(low, float(np.nanmin(theirs))), max(high, float(np.nanmax(theirs)))
    axes.plot(*_broken(record, ours), color=BLUE, lw=2.0, label="executed")
    _unrecorded(axes, record, "no states recorded")
    axes.plot(moment.time_s, ours[moment.index], "o", ms=6, mfc="white", mec=BLUE, mew=1.6)
    axes.set_ylim(low - 0.08 * (high - low) - 5.0, high + 0.20 * (high - low) + 5.0)
    axes.set_xlim(record.time_s[0], record.time_s[-1])
    axes.set_ylabel("clearance [mm]")
    axes.set_title("Smallest distance between the surfaces of robot and person")
    axes.legend(loc="upper right", bbox_to_anchor=(1.0, 1.22), ncols=4)
    axes.tick_params(labelbottom=False)


def _draw_speeds(axes: Axes, moment: _Moment) -> None:
    record = moment.record
    _reach_bands(axes, record, labels=False)

    before = holes(record.time_s)

    def speed(points: FloatArray) -> FloatArray:
        result: FloatArray = np.linalg.norm(np.gradient(points, record.time_s, axis=0), axis=1)
        result[before] = result[before + 1] = np.nan  # differences across what is missing
        return result

    _unrecorded(axes, record)
    axes.plot(*_broken(record, speed(moment.tool)), color=BLUE, lw=1.6, label="robot tool")
    for person in range(record.arms.shape[1]):
        label = "person's wrist" if person == 0 else None
        wrist = record.arms[:, person, 2]
        axes.plot(*_broken(record, speed(wrist)), color=VERMILION, lw=1.6, label=label)
    axes.set_ylim(bottom=0.0)
    axes.set(xlabel="time [s]", ylabel="speed [m/s]")
    axes.legend(loc="upper right", bbox_to_anchor=(1.0, 1.32), ncols=2)
