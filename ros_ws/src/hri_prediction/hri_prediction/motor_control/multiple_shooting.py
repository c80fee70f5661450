r"""The same problem as the thesis solved it, by direct multiple shooting (2.2.3): a reference.

Little is shared with the fast solver but the names of costs and the numbers of the arm: the equations of
motion come from Lagrange's function in the frame of the world; states are q, q' and q'' at the ends of
the intervals, controls the joint jerks there, between which they are linear; continuity is a constraint
(eq. 2.11), and IPOPT solves the nonlinear program. The thesis' control is the rate of the torques,
constant in each interval: the same motions in other coordinates, as the arm is fully actuated, but with
steps in them.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import BPoly

from hri_prediction.motor_control.arm_model import ANATOMICAL, ArmModel, JointLimits
from hri_prediction.motor_control.convention import convention_of
from hri_prediction.motor_control.costs import COSTS, Smoothing, check_weights
from hri_prediction.motor_control.kinematics import hand
from hri_prediction.motor_control.problem import ReachProblem

Array = NDArray[np.float64]

_UNITS = {"y": [0.0, 1.0, 0.0], "-y": [0.0, -1.0, 0.0], "z": [0.0, 0.0, 1.0]}
_POINTS = 3
"""Of the quadrature in each interval."""
_SCALES = (1.0, 3.0, 10.0, 50.0)
"""Of q and its derivatives, so that all unknowns are about 1."""


def _turn(axis: str, angle: Any) -> Any:
    """Rotation matrix, by Rodrigues' formula."""
    k = ca.skew(ca.DM(_UNITS[axis]))
    return ca.DM.eye(3) + ca.sin(angle) * k + (1 - ca.cos(angle)) * (k @ k)


def _moved(q: Any, dq: Any, ddq: Any, jerk: Any, later: Any, share: float, length: Any) -> Any:
    """The state after a share of an interval in which the jerk goes evenly from one value to the next."""
    t = share * length
    slope = (later - jerk) / length
    return ca.vertcat(
        q + t * dq + t**2 / 2 * ddq + t**3 / 6 * jerk + t**4 / 24 * slope,
        dq + t * ddq + t**2 / 2 * jerk + t**3 / 6 * slope,
        ddq + t * jerk + t**2 / 2 * slope,
    )


@dataclass(frozen=True, eq=False)
class ShootingMotion:
    """What multiple shooting found.

    Attributes:
        angles: At the ends of the intervals (N + 1, 3) [rad].
        velocities: The same [rad/s].
        costs: All seven, unweighted (7,).
        seconds: What IPOPT took.
        converged: Whether it says that this is an optimum.
        status: Its own word.
    """

    angles: Array
    velocities: Array
    costs: Array
    seconds: float
    converged: bool
    status: str


class MultipleShooting:
    """Solves reaches of one arm, one after the other; the program is built once, which takes seconds.

    Args:
        arm: The model.
        intervals: N.
        limits: Of the joints.
        smoothing: Of absolute values and roots.
    """

    def __init__(
        self,
        arm: ArmModel,
        intervals: int = 30,
        limits: JointLimits = ANATOMICAL,
        smoothing: Smoothing | None = None,
    ) -> None:
        self.arm, self.intervals, self.limits = arm, intervals, limits
        self._smoothing = smoothing or Smoothing()
        self._build(self._dynamics())

    def _dynamics(self) -> Any:
        arm, smoothing = self.arm, self._smoothing
        convention = convention_of(arm.convention)
        q, dq, ddq, jerk = (ca.SX.sym(name, 3) for name in ("q", "dq", "ddq", "dddq"))
        turns = [
            _turn(axis, q[joint])
            for axis, joint in zip(convention.axes, convention.joints, strict=True)
        ]
        upper = turns[0] @ turns[1]
        forearm = upper @ turns[2]
        along = [upper[:, 0], forearm[:, 0]]
        elbow = arm.upper_m * along[0]
        wrist = elbow + arm.forearm_m * along[1]
        # The spin of each link, from how its axes move.
        kinetic, potential = 0, 0
        for frame, axis, base, name in (
            (upper, along[0], ca.SX.zeros(3), "upper"),
            (forearm, along[1], elbow, "forearm"),
        ):
            mass = getattr(arm, f"{name}_kg")
            centre = base + getattr(arm, f"{name}_centre_m") * axis
            moved = ca.jtimes(centre, q, dq)
            spin = ca.inv_skew(ca.reshape(ca.jtimes(ca.vec(frame), q, dq), 3, 3) @ frame.T)
            lengthwise = ca.dot(spin, axis)
            kinetic += 0.5 * mass * ca.dot(moved, moved)
            kinetic += 0.5 * getattr(arm, f"{name}_across") * (ca.dot(spin, spin) - lengthwise**2)
            kinetic += 0.5 * getattr(arm, f"{name}_along") * lengthwise**2
            potential += mass * arm.gravity * centre[2]
        momentum = ca.gradient(kinetic, dq)
        mass_matrix = ca.jacobian(momentum, dq)
        bias = ca.jtimes(momentum, q, dq) - ca.gradient(kinetic, q) + ca.gradient(potential, q)
        torque = mass_matrix @ ddq + bias
        state, change = ca.vertcat(q, dq, ddq), ca.vertcat(dq, ddq, jerk)
        rate = ca.jtimes(torque, state, change)
        path = wrist
        for _ in range(3):
            path = ca.jtimes(path, state, change)
        work = dq * torque
        costs = ca.vertcat(
            ca.dot(path, path),
            ca.dot(ddq, ddq),
            ca.dot(jerk, jerk),
            ca.dot(rate, rate),
            ca.dot(torque, torque),
            ca.sum1(ca.sqrt(work**2 + smoothing.power**2) - smoothing.power),
            ca.sqrt(2 * kinetic + smoothing.speed**2) - smoothing.speed,
        )
        at = ca.Function("at", [state, jerk], [costs], {"cse": True})
        length, later = ca.SX.sym("h"), ca.SX.sym("later", 3)
        total: Any = 0
        nodes, node_weights = np.polynomial.legendre.leggauss(_POINTS)
        for node, weight in zip(nodes, node_weights, strict=True):
            share = 0.5 * (node + 1.0)
            inside = jerk + share * (later - jerk)
            total += 0.5 * weight * at(_moved(q, dq, ddq, jerk, later, share, length), inside)
        after = _moved(q, dq, ddq, jerk, later, 1.0, length)
        return ca.Function(
            "step", [state, jerk, later, length], [after, length * total], {"cse": True}
        )

    def _build(self, step: Any) -> None:
        count = self.intervals
        states, controls = ca.MX.sym("s", 9, count + 1), ca.MX.sym("u", 3, count + 1)
        ends = ca.MX.sym("ends", 9, 2)
        duration, weights = ca.MX.sym("T"), ca.MX.sym("w", len(COSTS))
        scale = ca.DM(np.repeat(_SCALES[:3], 3))
        real, jerks = states * ca.repmat(scale, 1, count + 1), controls * _SCALES[3]
        after, costs = step.map(count)(
            real[:, :count], jerks[:, :count], jerks[:, 1:], ca.repmat(duration / count, 1, count)
        )
        total = ca.sum2(costs)
        gaps = (after - real[:, 1:]) / ca.repmat(scale, 1, count)
        free = ca.vertcat(ca.vec(states), ca.vec(controls))
        given = ca.vertcat(ca.vec(ends), duration, weights)
        constraints = ca.vertcat(
            ca.vec(gaps), states[:, 0] - ends[:, 0] / scale, states[:, -1] - ends[:, 1] / scale
        )
        program: dict[str, Any] = {
            "x": free,
            "p": given,
            "f": ca.dot(weights, total),
            "g": constraints,
        }
        options: dict[str, Any] = {
            "print_time": False,
            "ipopt.print_level": 0,
            "ipopt.sb": "yes",
            "ipopt.tol": 1e-9,
            "ipopt.max_iter": 500,
        }
        self._solver = ca.nlpsol("reach", "ipopt", program, options)
        self._costs = ca.Function("costs", [free, given], [total])
        low = np.full((9, count + 1), -np.inf)
        high = np.full((9, count + 1), np.inf)
        low[:3], high[:3] = (
            np.array(self.limits.lower)[:, None],
            np.array(self.limits.upper)[:, None],
        )
        rest = np.full(3 * (count + 1), np.inf)
        self._bounds = (
            np.concatenate([low.T.ravel(), -rest]),
            np.concatenate([high.T.ravel(), rest]),
        )

    def solve(self, problem: ReachProblem, weights: ArrayLike) -> ShootingMotion:
        """The cheapest motion of a reach.

        Args:
            problem: Ends and duration; accelerations that it does not give are left to the optimum.
            weights: Of all seven costs (7,).

        Raises:
            DataError: weights cannot be right, or the reach begins or ends where no joint can be.
        """
        chosen = check_weights(weights)
        problem.check_limits(self.limits)
        count = self.intervals
        rest = np.zeros(3)
        ends = [
            np.concatenate([q, v, rest if a is None else a])
            for q, v, a in (
                (problem.q_start, problem.v_start, problem.a_start),
                (problem.q_end, problem.v_end, problem.a_end),
            )
        ]
        # The polynomial of the least degree between these: from rest to rest that of minimum jerk.
        way = BPoly.from_derivatives([0.0, problem.duration], [end.reshape(3, 3) for end in ends])
        at = np.linspace(0.0, problem.duration, count + 1)
        rows = [way.derivative(order)(at) / scale for order, scale in enumerate(_SCALES)]
        start = np.concatenate([np.hstack(rows[:3]).ravel(), rows[3].ravel()])
        given = np.concatenate([*ends, [problem.duration], chosen])
        room = np.zeros(9 * count + 18)
        for first, value in ((9 * count, problem.a_start), (9 * count + 9, problem.a_end)):
            room[first + 6 : first + 9] = np.inf if value is None else 0.0
        # What IPOPT calls small must not depend on the unit of the cost.
        norm = max(float(chosen @ np.array(self._costs(start, given)).ravel()), 1e-30)
        given[-len(COSTS) :] /= norm
        begun = time.perf_counter()
        found = self._solver(
            x0=start, p=given, lbg=-room, ubg=room, lbx=self._bounds[0], ubx=self._bounds[1]
        )
        seconds = time.perf_counter() - begun
        stats = self._solver.stats()
        states = np.array(found["x"]).ravel()[: 9 * (count + 1)].reshape(count + 1, 9)
        return ShootingMotion(
            angles=states[:, :3].copy(),
            velocities=_SCALES[1] * states[:, 3:6],
            costs=np.array(self._costs(found["x"], given)).ravel(),
            seconds=seconds,
            converged=bool(stats["success"]),
            status=str(stats["return_status"]),
        )

    def hand(self, motion: ShootingMotion) -> Array:
        """Path of the hand at the ends of the intervals (N + 1, 3) [m]."""
        return hand(motion.angles, self.arm)
