"""The planner's costs in plain vectorised NumPy: reference for agreement and for speed."""

from __future__ import annotations

import numpy as np

from hri_planner.ptomp.layout import FIRST_FREE, TERMS


def arm_points(q, lengths):
    """Shoulder, elbow, wrist, tool (..., 4, 3) by rotation matrices, configurations (..., 7)."""

    def about_z(angle):
        c, s, o, e = np.cos(angle), np.sin(angle), np.zeros_like(angle), np.ones_like(angle)
        return np.stack([c, -s, o, s, c, o, o, o, e], -1).reshape(*angle.shape, 3, 3)

    def about_y(angle):
        c, s, o, e = np.cos(angle), np.sin(angle), np.zeros_like(angle), np.ones_like(angle)
        return np.stack([c, o, s, o, e, o, -s, o, c], -1).reshape(*angle.shape, 3, 3)

    turn = about_z(q[..., 0]) @ about_y(-q[..., 1])
    shoulder = np.broadcast_to([0.0, 0.0, lengths[0]], (*q.shape[:-1], 3))
    elbow = shoulder + lengths[1] * turn[..., 2]
    turn = turn @ about_z(q[..., 2]) @ about_y(q[..., 3])
    wrist = elbow + lengths[2] * turn[..., 2]
    turn = turn @ about_z(q[..., 4]) @ about_y(-q[..., 5])
    tool = wrist + lengths[3] * turn[..., 2]
    return np.stack([shoulder, elbow, wrist, tool], axis=-2)


def capsule_gaps(points, radii, arm, human_radii):
    """Axis gaps less radii and place on the human limb (..., 3, 3) by clamped projection."""
    p, u = points[..., :-1, None, :], np.diff(points, axis=-2)[..., :, None, :]
    h, v = arm[..., None, :-1, :], np.diff(arm, axis=-2)[..., None, :, :]
    r = p - h
    a, b, c = (u * u).sum(-1), (u * v).sum(-1), (u * r).sum(-1)
    e, f = (v * v).sum(-1), (v * r).sum(-1)
    s = np.clip((b * f - c * e) / (a * e - b * b + 1e-14), 0, 1)
    t = np.clip((b * s + f) / e, 0, 1)
    s = np.clip((b * t - c) / a, 0, 1)
    gap = np.linalg.norm(r + s[..., None] * u - t[..., None] * v, axis=-1)
    return gap - radii[:, None] - human_radii, t


def costs(trajectories, step, robot, config, goal, margin, table_top, arms):
    """Weighted terms (n, TERM_COUNT) and smallest clearance (n,) of trajectories (n, 7, P).

    ``arms`` is a list of (points (P, 4, 3), sigma (P, 4), radii (3,)).
    """
    q = np.swapaxes(trajectories, 1, 2)
    points = arm_points(q, robot.lengths)
    free = slice(FIRST_FREE, None)
    term = {name: np.zeros(len(q)) for name in TERMS}
    nearest = np.full(len(q), np.inf)
    for arm, sigma, radii in arms:
        gaps, place = capsule_gaps(points, robot.capsule_radii, arm, radii)
        spread = sigma[:, None, :-1] + place * np.diff(sigma, axis=-1)[:, None, :]
        hinge = np.maximum(0, (margin + config.kappa * spread - gaps) / 0.05) ** 2
        touch = np.maximum(0, (config.contact_margin - gaps) / 0.01) ** 2
        term["collision"] += config.collision_weight * step * hinge[:, free].sum((1, 2, 3))
        term["contact"] += config.contact_weight * step * touch[:, free].sum((1, 2, 3))
        nearest = np.minimum(nearest, gaps[:, 2:].min((1, 2, 3)))
    middle = 0.5 * (points[..., :-1, :] + points[..., 1:, :])[:, 2:]
    speed2 = (np.diff(middle, axis=1) ** 2).sum(-1) / step**2
    energy = robot.part_masses * (0.5 * speed2 + 9.81 * middle[:, :-1, :, 2])
    term["effort"] = config.effort_weight * step * energy.sum((1, 2))
    tool = points[..., 3, :]
    jerk = np.diff(tool, n=3, axis=1) / step**3
    term["jerk"] = config.jerk_weight * step * (jerk**2).sum((1, 2))
    below, above = robot.lower - q[:, free], q[:, free] - robot.upper
    scale = config.joint_limit_scale
    limits = sum(np.where(x > -10 * scale, np.exp(x / scale), 0) for x in (below, above))
    term["joint_limits"] = config.joint_limit_weight * step * limits.sum((1, 2))
    share = np.abs(np.diff(q[:, 1:], axis=1)) / step / robot.velocity
    fast = np.maximum(0, (share - config.speed_share) * 20) ** 2
    term["speed"] = config.speed_weight * step * fast.sum((1, 2))
    bend = np.diff(q, n=2, axis=1) / step**2
    largest = config.acceleration_limit
    hard = np.maximum(0, (np.abs(bend) - largest) * 10 / largest) ** 2
    term["acceleration"] = config.acceleration_weight * step * hard.sum((1, 2))
    radius = robot.capsule_radii[[1, 1, 2]]
    low = table_top + config.table_margin + radius - points[:, free, 1:, 2]
    term["table"] = config.table_weight * step * (np.maximum(0, low / 0.02) ** 2).sum((1, 2))
    distance = np.linalg.norm(tool[:, free] - goal, axis=-1)
    term["goal"] = config.goal_weight * step * distance.sum(1)
    term["control"] = 0.5 * config.control_weight * step * (bend**2).sum((1, 2))
    return np.stack([term[name] for name in TERMS], axis=1), nearest
