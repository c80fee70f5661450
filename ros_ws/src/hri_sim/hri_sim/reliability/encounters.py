"""People meet the robot: whether the separation monitor has it at rest before anybody can touch it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from hri_planner.separation.config import (
    ASSUMED,
    MEASURED,
    PREDICTED,
    BodyConfig,
    ProtectiveDistanceConfig,
)
from hri_prediction.results.progress import ProgressLine
from hri_sim.launch.separation import CONTACT_SPEED
from hri_sim.separation.batch import chunks_of, run_chunks
from hri_sim.separation.capture import Capture
from hri_sim.separation.encounter import KINDS, Meeting, Settings

WANTED = 10_000
"""Encounters of the first case; of each other one a tenth."""


@dataclass(frozen=True)
class Case:
    """A way to set the monitor.

    Attributes:
        name: Short.
        text: What it is.
        settings: Of the encounters.
        share: Of the encounters of the first case.
        bar: Whether nobody must be touched.
    """

    name: str
    text: str
    settings: Settings
    share: float
    bar: bool


_NOISE_M = Settings().capture.noise
_LAUNCHED = ProtectiveDistanceConfig(intrusion=0.0)
_ARMS_ALONE = Settings(
    distance=ProtectiveDistanceConfig(intrusion=0.35), body=BodyConfig(trunk=False)
)
CASES = (
    Case(
        ASSUMED,
        "as the node starts: people at the speeds of the standards, trunk and head from the shoulders",
        Settings(),
        1.0,
        True,
    ),
    Case("arms alone", "the same without trunk and head, C = 0.35 m for both", _ARMS_ALONE, 0.1, True),
    Case(
        MEASURED,
        "arms as fast as seen, with 7 m/s² on top (those who chase turn at once: more than that)",
        Settings(distance=ProtectiveDistanceConfig(human=MEASURED, sample_noise=_NOISE_M)),
        0.1,
        True,
    ),
    Case(
        PREDICTED,
        "arms where the predictor expects them, three standard deviations farther, with 7 m/s² on top, and "
        "at least as fast as seen; it has learnt nobody's tasks",
        Settings(distance=ProtectiveDistanceConfig(human=PREDICTED, sample_noise=_NOISE_M)),
        0.1,
        True,
    ),
    Case(
        "launched, assumed",
        "as launch scripts set it with `assumed`: people are arms and nothing else, and nothing is "
        "reckoned "
        "with beyond them (C = 0)",
        Settings(distance=_LAUNCHED, body=BodyConfig(trunk=False), arms_only=True),
        0.1,
        True,
    ),
    Case(
        "launched, measured",
        "as launch scripts set it with `measured`: the same people as fast as seen, and motion away from "
        "them "
        "is let go on, as is any of no more than 0.15 m/s; 2 mm of noise, as many as are reckoned with",
        Settings(
            distance=replace(
                _LAUNCHED,
                human=MEASURED,
                evasion=True,
                contact_speed=CONTACT_SPEED,
            ),
            body=BodyConfig(trunk=False),
            capture=Capture(noise=_LAUNCHED.sample_noise),
            arms_only=True,
        ),
        0.1,
        False,
    ),
    Case("unmonitored", "the robot at full speed, for comparison", replace(Settings(), monitored=False),
    0.1, False),
)  # fmt: skip


def measure(
    count: int, first_seed: int, folder: Path, workers: int, progress: ProgressLine
) -> dict[str, Any]:
    """Do the encounters.

    Args:
        count: Of the first case.
        first_seed: Of each kind of encounter.
        folder: Where they are kept.
        workers: Processes.
        progress: Says how far it is.
    """
    found = {}
    for case in CASES:
        wanted = max(round(count * case.share), len(KINDS))
        progress.say(f"encounters, {case.name}")
        meetings = run_chunks(
            chunks_of(case.settings, wanted, first_seed), folder, workers, progress.count
        )
        found[case.name] = {
            kind: _figures([m for m in meetings if m.kind == kind]) for kind in KINDS
        }
    return found


def _figures(meetings: Sequence[Meeting]) -> dict[str, Any]:
    moving = np.array([m.closest_moving for m in meetings])
    moving = moving[np.isfinite(moving)]
    seconds = sum(m.duration_s for m in meetings)
    return {
        "encounters": len(meetings),
        "robot_moved": len(moving),
        "touched_moving": sum(m.touched for m in meetings),
        "fastest_approach_m_s": max(
            (m.fastest_approach for m in meetings if m.touched), default=0.0
        ),
        "seeds_touched": [m.seed for m in meetings if m.touched][:10],
        "fastest_touch_m_s": max((m.fastest_touch for m in meetings), default=0.0),
        "came_to_a_resting_robot": sum(m.closest <= 0.0 and not m.touched for m in meetings),
        "closest_moving_m": float(moving.min()) if len(moving) else None,
        "median_closest_moving_m": float(np.median(moving)) if len(moving) else None,
        "stops": sum(m.stops for m in meetings),
        "stopped_share": sum(m.stopped_s for m in meetings) / seconds,
        "slowed_share": sum(m.slowed_s for m in meetings) / seconds,
    }


def touched(found: Mapping[str, Any]) -> int:
    """How often somebody was touched by a moving robot where nobody must be."""
    return sum(
        int(found[case.name][kind]["touched_moving"])
        for case in CASES
        for kind in KINDS
        if case.bar
    )


def counted(found: Mapping[str, Any], what: str = "encounters") -> int:
    """How many encounters there were in which nobody must be touched.

    Args:
        found: What :func:`measure` returned.
        what: ``encounters``, or ``robot_moved``: those in which the robot moved.
    """
    return sum(int(found[case.name][kind][what]) for case in CASES for kind in KINDS if case.bar)


def lines(found: Mapping[str, Any]) -> list[str]:
    """The tables, in Markdown."""
    text = [
        "A person with two arms, trunk and head meets a robot that moves between random postures, at up "
        "to 1.5 m/s and 10 m/s², and heeds nobody; every other one turns on its way, about twice a second. "
        "Who is *walking* goes through its workspace at up to 1.6 m/s with "
        "swinging arms; who is *reaching* stands at the table and puts a hand where the tool was, and "
        "back; who is *chasing* goes for the nearest point of the robot at once and all the time, at up "
        "to 2 m/s. Motion capture sees both arms with 3 mm of noise (cut at 10 mm), 4 to 20 ms late, "
        "stamped up to 5 ms too late, with gaps of up to 60 ms, and keypoints that are hidden for as "
        "long; commands take 2 to 8 ms; every other "
        "monitor is killed on the way, or hangs for 20 ms to half a second; physics, torque "
        "control, controller and stop chain are those of the simulator. To repeat: "
        "`scripts/reproduce_reliability.py --only encounters`.\n",
        "| monitor | what it is |\n| --- | --- |",
        *(f"| {case.name} | {case.text} |" for case in CASES),
        "",
        "| monitor | person | encounters | in which the robot moved | touched by a moving robot | "
        "robot's speed then [m/s] | of that, at the person [m/s] | came to a resting robot | "
        "closest while it moved [cm] | median | stopped [%] | slowed [%] |",
        "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    for case in CASES:
        for kind in KINDS:
            row = found[case.name][kind]
            fast = approach = "–"
            if row["touched_moving"]:
                fast = f"{row['fastest_touch_m_s']:.2f}"
                approach = f"{row['fastest_approach_m_s']:+.2f}"
            text.append(
                f"| {case.name} | {kind} | {row['encounters']:,} | {row['robot_moved']:,} | "
                f"{row['touched_moving']} | {fast} | {approach} | {row['came_to_a_resting_robot']} | "
                f"{_cm(row['closest_moving_m'])} | {_cm(row['median_closest_moving_m'])} | "
                f"{100 * row['stopped_share']:.0f} | {100 * row['slowed_share']:.0f} |"
            )
    return [*text, ""]


def _cm(value: float | None) -> str:
    return "–" if value is None else f"{100.0 * value:.1f}"
