"""One iteration of the optimiser, compiled as a whole: noise, costs, average, acceptance.

It allocates nothing: all it writes lies in buffers of its caller.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from hri_planner.ptomp.clearance import filled_columns, mark_columns
from hri_planner.ptomp.kernel import trajectory_costs
from hri_planner.ptomp.layout import FAST, FIRST_FREE
from hri_planner.ptomp.smoothing import add_smooth_noise
from hri_prediction.compiled import njit

JOINTS = 6
"""The seventh moves no capsule, so noise on it could only cost."""

MIN_WINDOW = 6
"""Fewest columns that are disturbed together."""

EASE = (0.4, 0.75, 0.95)
"""Share of the noise that remains at the first columns of a window's end."""


@njit(fastmath=FAST)
def _disturb(
    trajectory: Any,
    columns: int,
    free_until: int,
    free_end: bool,
    full: bool,
    sd: float,
    normals: Any,
    place: int,
    band: Any,
    scale: Any,
) -> int:
    """Add noise in place; returns how many normals were used.

    ``full`` noise spans all free columns, otherwise a random part of them: whole-span noise hardly
    has short waves, but a person who comes late asks for them. With ``free_end`` the end of the
    trajectory moves too, by a smooth step.
    """
    real = trajectory.dtype.type
    room = free_until - FIRST_FREE
    first, size = FIRST_FREE, room
    used = 0
    if not full and room > 2 * MIN_WINDOW:
        # Fractional parts of normals are near enough to uniform here.
        u = abs(normals[place]) * 7.0
        v = abs(normals[place + 1]) * 7.0
        used = 2
        size = MIN_WINDOW + int((u - int(u)) * (room - MIN_WINDOW))
        first = FIRST_FREE + int((v - int(v)) * (room - size + 1))
    spread = real(sd * scale[size] * (size / room))
    for joint in range(0, JOINTS, 3):
        start = place + used
        noise = normals[start : start + 3 * size]
        rows = trajectory[joint : joint + 3, first : first + size]
        add_smooth_noise(band, noise, size, spread, rows)
        used += 3 * size
    if free_end:
        for joint in range(JOINTS):
            shift = sd * normals[place + used]
            used += 1
            for i in range(first, filled_columns(columns)):
                x = min((i - first + 1.0) / size, 1.0)
                trajectory[joint, i] += real(shift * x * x * x * (10.0 - 15.0 * x + 6.0 * x * x))
    return used


@njit
def _ease(rollout: Any, incumbent: Any, first: int, direction: int) -> None:
    """Damp the noise at the first columns of an end, where the acceleration is given.

    Noise starts like t^2, a jump in acceleration; damped so, it starts like t^3.
    """
    for joint in range(JOINTS):
        for k in range(len(EASE)):
            i = first + direction * k
            change = rollout[joint, i] - incumbent[joint, i]
            rollout[joint, i] = incumbent[joint, i] + rollout.dtype.type(EASE[k]) * change


@njit
def _copy(source: Any, target: Any, columns: int) -> None:
    for joint in range(7):
        here, there = source[joint], target[joint]
        for i in range(columns):
            there[i] = here[i]


@njit(fastmath=FAST)
def _add(target: Any, source: Any, weight: Any, columns: int) -> None:
    for joint in range(7):
        here, there = source[joint], target[joint]
        for i in range(columns):
            there[i] += weight * here[i]


@njit
def explore(
    incumbent: Any,
    columns: int,
    free_until: int,
    free_end: bool,
    sd: float,
    normals: Any,
    place: int,
    band: Any,
    scale: Any,
    rollouts: Any,
) -> None:
    """Fill the roll-outs (NT, 7, ROW) with the incumbent (7, ROW) plus noise."""
    filled = filled_columns(columns)
    for index in range(rollouts.shape[0]):
        rollout = rollouts[index]
        _copy(incumbent, rollout, filled)
        place += _disturb(
            rollout, columns, free_until, free_end, index % 2 == 0, sd, normals, place, band, scale
        )
        _ease(rollout, incumbent, FIRST_FREE, 1)
        if not free_end:
            _ease(rollout, incumbent, free_until - 1, -1)


@njit
def keep_elite(rollout: Any, cost: Any, elites: Any, elite_costs: Any, filled: int) -> int:
    """Put a roll-out (7, ROW) in the place of the worst elite if it is better; where, or -1."""
    if elites.shape[0] == 0:
        return -1
    slot = int(np.argmax(elite_costs))
    if not cost < elite_costs[slot]:
        return -1
    elite_costs[slot] = cost
    _copy(rollout, elites[slot], filled)
    return slot


@njit
def average(
    incumbent: Any,
    filled: int,
    free_until: int,
    sensitivity: float,
    rollouts: Any,
    costs: Any,
    elites: Any,
    elite_costs: Any,
    mean: Any,
) -> None:
    """Weighted average of roll-outs and elites into mean (7, ROW), then renew the elites.

    ``elites`` is (n, 7, ROW) with costs (n,), infinite where still empty. The first ``filled`` columns
    are written, from ``free_until`` on with those of the incumbent.
    """
    real = mean.dtype.type
    count, kept = rollouts.shape[0], elites.shape[0]
    lowest, worst = costs[0], costs[0]
    for index in range(1, count):
        lowest, worst = min(lowest, costs[index]), max(worst, costs[index])
    for index in range(kept):
        lowest = min(lowest, elite_costs[index])
    width = max(worst - lowest, 1e-12)
    total = 0.0
    mean[:, :filled] = real(0.0)
    for index in range(count):
        weight = np.exp(-sensitivity * (costs[index] - lowest) / width)
        total += weight
        _add(mean, rollouts[index], real(weight), filled)
    for index in range(kept):
        if elite_costs[index] < np.inf:
            weight = np.exp(-sensitivity * (elite_costs[index] - lowest) / width)
            total += weight
            _add(mean, elites[index], real(weight), filled)
    share = real(1.0 / total)
    for joint in range(7):
        row, fixed = mean[joint], incumbent[joint]
        for i in range(filled):
            row[i] = row[i] * share if FIRST_FREE <= i < free_until else fixed[i]
    for index in range(count):
        keep_elite(rollouts[index], costs[index], elites, elite_costs, filled)


@njit
def iterate(
    incumbent: Any,
    cost: float,
    columns: int,
    free_until: int,
    free_end: bool,
    sd: float,
    sensitivity: float,
    normals: Any,
    place: int,
    band: Any,
    scale: Any,
    body: Any,
    humans: Any,
    human_radii: Any,
    par: Any,
    work: Any,
    rollouts: Any,
    costs: Any,
    elites: Any,
    elite_costs: Any,
    mean: Any,
    terms: Any,
) -> float:
    """One iteration on the incumbent (7, ROW), which changes if something costs less.

    Args:
        incumbent: (7, ROW) [rad].
        cost: Its cost.
        columns: Columns in use.
        free_until: First column that stays as it is.
        free_end: Whether the end posture may move too; then all columns are averaged.
        sd: Noise level [rad].
        sensitivity: Sharpness of the weights.
        normals: Pool of standard normals.
        place: Where in it to begin.
        band: Factors of the smoothing, see there.
        scale: Its normalisation.
        body: See :func:`hri_planner.ptomp.kernel.many_costs`, as all up to ``work``.
        humans: See body.
        human_radii: See body.
        par: See body.
        work: See body.
        rollouts: Buffer (NT, 7, ROW).
        costs: Buffer (NT,).
        elites: (n, 7, ROW), from iteration to iteration.
        elite_costs: (n,), infinite where empty.
        mean: Buffer (7, ROW).
        terms: Buffer (TERM_COUNT,).

    Returns:
        The incumbent's cost afterwards.
    """
    explore(
        incumbent, columns, free_until, free_end, sd, normals, place, band, scale, rollouts
    )  # fmt: skip
    mark_columns(columns, work)
    best = 0
    for index in range(rollouts.shape[0]):
        trajectory_costs(rollouts[index], columns, body, humans, human_radii, par, work, terms)
        costs[index] = terms.sum()
        if costs[index] < costs[best]:
            best = index
    filled = filled_columns(columns)
    averaged = filled if free_end else free_until
    average(
        incumbent, filled, averaged, sensitivity, rollouts, costs, elites, elite_costs, mean
    )  # fmt: skip
    trajectory_costs(mean, columns, body, humans, human_radii, par, work, terms)
    after = terms.sum()
    if costs[best] < after and costs[best] < cost:
        _copy(rollouts[best], incumbent, filled)
        return costs[best]
    if after < cost:
        _copy(mean, incumbent, filled)
        return after
    return cost
