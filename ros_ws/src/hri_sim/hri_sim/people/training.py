"""Reaches for a predictor to learn from, made and tracked like those that it will see."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hri_prediction.errors import ConfigError
from hri_prediction.tracks.track import ArmTrack
from hri_sim.people.person import SimulatedPerson
from hri_sim.people.tracking import SAMPLE_PERIOD_NS, TrackingModel, tracked_samples
from hri_sim.scenario.schema import PersonSpec, Scenario, Vector3

REST_S = 0.3
"""Rest recorded before and after each reach [s]."""
DURATIONS_S = (1.0, 1.7)
"""Range of the durations that people take [s]."""
REACHES_A_TASK = 25

_START_SCATTER_M = 0.005


def training_reaches(
    spec: PersonSpec,
    from_target: Vector3,
    to_target: Vector3,
    n: int,
    rng: np.random.Generator,
    *,
    durations: tuple[float, float] = DURATIONS_S,
    task: str = "",
) -> list[ArmTrack]:
    """Record ``n`` repetitions of one reach with the tracking system.

    Args:
        spec: Who reaches.
        from_target: Where the hand tip is meant to start [m], world frame.
        to_target: Where it is meant to go [m].
        n: Number of repetitions.
        rng: Source of all randomness.
        durations: Usual durations are drawn evenly from this range [s].
        task: Name of the task that the tracks carry.

    Returns:
        Tracks at 250 Hz in the world frame with 0.3 s of rest on both sides and time 0 at the true
        onset. Drop-outs are NaN.

    Raises:
        ConfigError: when ``n`` is less than one.
        PlanningError: when the reach is out of reach.
    """
    if n < 1:
        raise ConfigError(f"n = {n!r} training reaches", expected="at least 1")
    tracks = []
    for trial in range(n):
        jitter = _START_SCATTER_M * spec.variability * rng.standard_normal(3)
        start = np.array(from_target) + jitter
        if not spec.arm.can_reach(start):
            start = np.array(from_target, dtype=float)
        home = (float(start[0]), float(start[1]), float(start[2]))
        person = SimulatedPerson(spec.model_copy(update={"home": home}), seed=0)
        motion = person.plan_reach(to_target, 0.0, float(rng.uniform(*durations)), rng)
        # Whole sampling periods of rest, so that the onset falls on a sample.
        rest = round(REST_S * 1e9) // SAMPLE_PERIOD_NS
        count = 2 * rest + int(motion.duration * 1e9) // SAMPLE_PERIOD_NS + 1
        model = TrackingModel(spec, rng)
        samples = tracked_samples(person, model, -rest * SAMPLE_PERIOD_NS, count)
        tracks.append(
            ArmTrack(
                time_s=1e-9 * np.array([tracked.sample.stamp_ns for tracked in samples]),
                keypoints=np.stack([tracked.sample.keypoints for tracked in samples]),
                side=spec.side,
                subject=spec.id,
                task=task,
                trial=trial,
                source="simulated",
            )
        )
    return tracks


def scenario_training(
    scenario: Scenario, index: int, rng: np.random.Generator, n: int = REACHES_A_TASK
) -> dict[str, list[ArmTrack]]:
    """Training reaches of all tasks that an observer of one reach must reckon with.

    Args:
        scenario: The scenario.
        index: Number of the reach.
        rng: Source of all randomness.
        n: Repetitions a task.

    Returns:
        Target name to tracks, in the order of :meth:`.Scenario.candidates`; empty when the person
        does not move in this reach.
    """
    names: Sequence[str] = scenario.candidates(index)
    if not names:
        return {}
    spec, start = scenario.person_of(index), scenario.person_from(index)
    return {
        name: training_reaches(spec, start, scenario.targets[name], n, rng, task=name)
        for name in names
    }
