"""Pictures of the study, like figures 2.3, 2.7, 2.9, 3.5 and 3.7 of the thesis."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy.typing import NDArray

from hri_prediction.errors import HriError
from hri_prediction.motor_control import design
from hri_prediction.motor_control.analyses.discomfort import SIX, THREE, terms
from hri_prediction.motor_control.analyses.table import ReachTable
from hri_prediction.motor_control.arm_model import ArmModel
from hri_prediction.motor_control.costs import ABBREVIATIONS, CHAPTER_3, COSTS
from hri_prediction.motor_control.ocp import ReachSolver
from hri_prediction.motor_control.problem import ReachProblem

Array = NDArray[np.float64]

DPI = 110
_TASK = (0, 0)
"""Start and target of the reach that is drawn for each cost: P1 to T1."""


def _figure(width: float, height: float) -> Figure:
    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def single_costs(path: Path) -> None:
    """Ways of the hand of least cost, for each cost alone (figure 2.3)."""
    start, target = _TASK
    arm = ArmModel.of_body()
    solver = ReachSolver(arm)
    reach = ReachProblem.at_rest(
        np.radians(design.STARTS_DEG[start]),
        np.radians(design.TARGETS_DEG[target]),
        float(design.DURATIONS_S[target]),
    )
    phases = np.linspace(0.0, 1.0, 201)
    figure = _figure(11.0, 3.6)
    axes = figure.subplots(1, 3)
    for name in CHAPTER_3:
        try:
            motion = solver.solve(reach, np.eye(len(COSTS))[COSTS.index(name)])
        except HriError:
            continue  # a cost that alone has no optimum is not drawn
        hand = 100.0 * motion.hand(phases, arm)
        speed = np.linalg.norm(np.gradient(hand, phases * reach.duration, axis=0), axis=1)
        axes[0].plot(hand[:, 0], hand[:, 1], label=name.replace("_", " "))
        axes[1].plot(hand[:, 1], hand[:, 2])
        axes[2].plot(phases * reach.duration, speed / 100.0)
    for axis, across, up in (
        (axes[0], "to the side [cm]", "to the front [cm]"),
        (axes[1], "to the front [cm]", "up [cm]"),
        (axes[2], "time [s]", "speed of the hand [m/s]"),
    ):
        axis.set_xlabel(across)
        axis.set_ylabel(up)
    for axis in axes[:2]:
        axis.set_aspect("equal", adjustable="datalim")
    axes[0].legend(fontsize=7)
    figure.suptitle(
        f"P{start + 1} to T{target + 1}: the hand's way of least cost, each cost alone", fontsize=9
    )
    figure.savefig(path, dpi=DPI)


def error_boxes(table: ReachTable, path: Path, what: str) -> None:
    """Distances to what was seen of each cost alone and of the mix (figure 2.7)."""
    labels = [*(ABBREVIATIONS[name] for name in table.names), "mix"]
    figure = _figure(9.0, 3.4)
    for axis, single, mixed, unit in zip(
        figure.subplots(1, 2),
        (table.single_cm, table.single_joint_deg),
        (table.hand_cm, table.joint_deg),
        ("hand [cm]", "joints [deg]"),
        strict=True,
    ):
        columns = [column[np.isfinite(column)] for column in (*single.T, mixed)]
        axis.boxplot(columns, showfliers=False)
        axis.set_xticks(range(1, len(labels) + 1), labels)
        axis.set_ylabel(f"distance of the {unit}")
        axis.set_ylim(bottom=0.0)
    figure.suptitle(
        f"{len(table)} {what}; boxes: quartiles, whiskers: 1.5 of their distance", fontsize=9
    )
    figure.savefig(path, dpi=DPI)


def discomfort_picture(table: ReachTable, found: dict[str, Any], path: Path) -> None:
    """Dynamic share by discomfort, and how much it explains of each person (figure 2.9)."""
    pooled, people = found[SIX], found["people"]
    values = terms(table.q_start, table.q_end, SIX) @ np.array(pooled["beta"])
    figure = _figure(11.0, 3.8)
    cloud, bars = figure.subplots(1, 2)
    names = list(people)
    colours = {name: f"C{i % 10}" for i, name in enumerate(names)}
    for name in names:
        own = table.person == name
        cloud.plot(values[own], table.dynamic[own], ".", ms=3, color=colours[name])
    ends = np.array([values.min(), values.max()])
    cloud.plot(ends, pooled["offset"] + pooled["slope"] * ends, "k-", lw=1)
    cloud.set_xlabel("discomfort (2.21)")
    cloud.set_ylabel("share of dynamic costs")
    cloud.set_title(f"all: R² = {pooled['r2']:.2f}", fontsize=9)
    places = np.arange(len(names))
    bars.bar(places, [people[name]["r2"] for name in names], color=[colours[n] for n in names])
    bars.plot(
        places, [people[name]["chance_r2"] for name in names], "k_", ms=14, label="95 % of chance"
    )
    bars.axhline(pooled["r2"], color="k", lw=0.8, ls="--", label="all together")
    bars.set_xticks(places, names, fontsize=7)
    bars.set_ylabel("R² of each person")
    bars.set_ylim(0.0, 1.0)
    bars.legend(fontsize=7)
    figure.savefig(path, dpi=DPI)


def mean_errors(found: dict[str, Any], path: Path) -> None:
    """Mean errors of five costs and the mix over all tasks (figure 3.5)."""
    figure = _figure(11.0, 3.4)
    titles = ("hand [cm]", "joints [deg]", "joints without T1 [deg]")
    keys = ("hand_cm", "joint_deg", "joint_deg_without_T1")
    for axis, key, title in zip(figure.subplots(1, 3), keys, titles, strict=True):
        names = [name for name in found[key] if found[key][name]["mean"] is not None]
        means = np.array([found[key][name]["mean"] for name in names])
        spreads = np.array([found[key][name]["sd"] for name in names])
        down = np.minimum(spreads, means)
        axis.bar(range(len(names)), means, yerr=np.array([down, spreads]), capsize=3, color="C0")
        axis.set_xticks(range(len(names)), [ABBREVIATIONS.get(name, "mix") for name in names])
        axis.set_title(f"distance of the {title}", fontsize=9)
    figure.suptitle(f"mean and standard deviation over {found['n']} tasks", fontsize=9)
    figure.savefig(path, dpi=DPI)


def transitions(table: ReachTable, found: dict[str, Any], path: Path) -> None:
    """Shares by three angles, and by discomfort of these (figure 3.7)."""
    figure = _figure(11.0, 7.0)
    change = np.degrees(table.q_end[:, 0] - table.q_start[:, 0])
    q1, q2 = np.degrees(table.q_start[:, 0]), np.degrees(table.q_start[:, 1])
    kinematic = 1.0 - table.dynamic
    if "geodesic" in table.names:
        kinematic = kinematic - table.alpha[:, table.names.index("geodesic")]
    values = terms(table.q_start, table.q_end, THREE) @ np.array(found["beta"])
    for column, (share, name) in enumerate(((table.dynamic, "dynamic"), (kinematic, "kinematic"))):
        cloud: Any = figure.add_subplot(2, 2, column + 1, projection="3d")
        dots = cloud.scatter(q1, q2, change, c=share, cmap="viridis", s=18)
        figure.colorbar(dots, ax=cloud, shrink=0.6, pad=0.18)
        cloud.set_xlabel("q1 at the start [deg]", fontsize=7)
        cloud.set_ylabel("q2 at the start [deg]", fontsize=7)
        cloud.set_zlabel("change of q1 [deg]", fontsize=7)
        cloud.set_title(f"share of {name} costs", fontsize=9)
        line = figure.add_subplot(2, 2, column + 3)
        line.plot(values, share, ".", ms=5)
        slope, offset = np.polyfit(values, share, 1)
        ends = np.array([values.min(), values.max()])
        line.plot(ends, offset + slope * ends, "r-", lw=1)
        r2 = float(np.corrcoef(values, share)[0, 1] ** 2)
        line.set_xlabel("discomfort (3.5)")
        line.set_ylabel(f"share of {name} costs")
        line.set_title(f"R² = {r2:.2f}", fontsize=9)
    figure.savefig(path, dpi=DPI)


def real_weights(found: dict[str, Any], path: Path) -> None:
    """Mean weights of real reaches, each task, with intervals over people."""
    figure = _figure(7.0, 3.4)
    axis = figure.subplots()
    names: Sequence[str] = list(found["weights"])
    width = 0.8 / max(len(found["tasks"]), 1)
    for i, task in enumerate(found["tasks"]):
        rows = [found["weights"][name][task] for name in names]
        means = np.array([row["mean"] for row in rows])
        ends = np.array(
            [
                [row["mean"] - row["low"] for row in rows],
                [row["high"] - row["mean"] for row in rows],
            ]
        )
        axis.bar(np.arange(len(names)) + i * width, means, width, yerr=ends, capsize=3, label=task)
    axis.set_xticks(
        np.arange(len(names)) + 0.4 - width / 2, [name.replace("_", " ") for name in names]
    )
    axis.set_ylabel("weight")
    axis.legend(fontsize=8)
    axis.set_title(
        f"{found['people']} people; bars: 95 % interval of the mean over people", fontsize=9
    )
    figure.savefig(path, dpi=DPI)
