r"""Equations of motion and their derivatives as graphs, from which compiled code is made (thesis eq. 2.1).

Everything is derived link by link in frames that turn with the arm (recursive Newton-Euler). With the yaw
outermost, its angle then appears nowhere but in the path of the hand, as it must: gravity and inertia do
not change when the whole arm is turned about the vertical. In the frame of the world the graph of second
derivatives is about three times larger.

The seven costs (table 2.1) are functions of ten *outputs* y: jerk of the hand (3), torques (3), their rates
(3) and :math:`\dot q^\top M \dot q`; and of joint velocities, accelerations and jerks. So derivatives of
costs by weights need no graph each: the generated code has y, its Jacobian, and the sum of the Hessians of
its elements with given multipliers; the rest is in `hri_prediction.motor_control.integrand`.

CasADi is imported here, and in the reference solver, alone.
"""

from __future__ import annotations

from typing import Any

import casadi as ca

from hri_prediction.motor_control.arm_model import PARAMETERS
from hri_prediction.motor_control.convention import Convention

OUTPUTS = 10
"""Elements of y."""
STATE = 12
"""Elements of z: q, and its first, second and third derivative by time."""
_UNIT = {"y": (0.0, 1.0, 0.0), "-y": (0.0, -1.0, 0.0), "z": (0.0, 0.0, 1.0)}


def _rotation(axis: str, angle: Any) -> Any:
    """Turns vectors of the turned frame into those of the one before; sparse where it is zero."""
    c, s = ca.cos(angle), ca.sin(angle)
    rows = {
        "y": ((c, 0, s), (0, 1, 0), (-s, 0, c)),
        "-y": ((c, 0, -s), (0, 1, 0), (s, 0, c)),
        "z": ((c, -s, 0), (s, c, 0), (0, 0, 1)),
    }[axis]
    return ca.sparsify(ca.SX(ca.vertcat(*(ca.horzcat(*row) for row in rows))))


def _along(length: Any) -> Any:
    return ca.vertcat(length, 0, 0)


def symbols() -> tuple[Any, Any]:
    """The state z (12,) and the parameters of the arm (11,)."""
    return ca.SX.sym("z", STATE), ca.SX.sym("p", len(PARAMETERS))


def outputs(convention: Convention, z: Any, p: Any) -> Any:
    """The outputs y (10,) at a state.

    Args:
        convention: How the joints turn.
        z: q [rad], q' , q'' and q''' (12,).
        p: Parameters of an arm model (11,).
    """
    q, dq, ddq, dddq = z[0:3], z[3:6], z[6:9], z[9:12]
    named = dict(zip(PARAMETERS, ca.vertsplit(p), strict=True))
    order, axes = convention.joints, convention.axes
    turns = [_rotation(axis, q[joint]) for axis, joint in zip(axes, order, strict=True)]
    units = [ca.DM(_UNIT[axis]) for axis in axes]
    elbow = _along(named["upper_m"])

    # Outwards: velocities and accelerations of each frame, in its own axes. The trunk accelerates upwards
    # instead of gravity pulling down.
    spin, turning = ca.SX.zeros(3), ca.SX.zeros(3)
    velocity, acceleration = ca.SX.zeros(3), _vertical(named["gravity"])
    links = []
    for index, (turn, unit, joint) in enumerate(zip(turns, units, order, strict=True)):
        offset = elbow if index == 2 else ca.SX.zeros(3)
        velocity = turn.T @ (velocity + ca.cross(spin, offset))
        acceleration = turn.T @ (
            acceleration + ca.cross(turning, offset) + ca.cross(spin, ca.cross(spin, offset))
        )
        carried = turn.T @ spin
        turning = turn.T @ turning + ca.cross(carried, unit * dq[joint]) + unit * ddq[joint]
        spin = carried + unit * dq[joint]
        links.append((spin, turning, velocity, acceleration))

    wrenches, energy = [], 0
    for (spin, turning, velocity, acceleration), name in zip(
        links[1:], ("upper", "forearm"), strict=True
    ):
        mass, centre = named[f"{name}_kg"], _along(named[f"{name}_centre_m"])
        inertia = ca.vertcat(
            named[f"{name}_along"], named[f"{name}_across"], named[f"{name}_across"]
        )
        force = mass * (
            acceleration + ca.cross(turning, centre) + ca.cross(spin, ca.cross(spin, centre))
        )
        moment = inertia * turning + ca.cross(spin, inertia * spin) + ca.cross(centre, force)
        wrenches.append((force, moment))
        moved = velocity + ca.cross(spin, centre)
        energy += mass * ca.dot(moved, moved) + ca.dot(spin, inertia * spin)

    # Inwards: forces and moments that the joints carry.
    (_force_1, moment_1), (force_2, moment_2) = wrenches
    carried_force = turns[2] @ force_2
    at_shoulder = moment_1 + turns[2] @ moment_2 + ca.cross(elbow, carried_force)
    torques: list[Any] = [None, None, None]
    torques[order[2]] = ca.dot(moment_2, units[2])
    torques[order[1]] = ca.dot(at_shoulder, units[1])
    torques[order[0]] = ca.dot(turns[1] @ at_shoulder, units[0])
    torque = ca.vertcat(*torques)

    state, rate = ca.vertcat(q, dq, ddq), ca.vertcat(dq, ddq, dddq)
    hand = turns[1] @ (elbow + turns[2] @ _along(named["forearm_m"]))
    first_spin = units[0] * dq[order[0]]
    for _ in range(3):  # position, velocity, acceleration, jerk, in the frame of the first joint
        hand = ca.jtimes(hand, state, rate) + ca.cross(first_spin, hand)
    return ca.vertcat(hand, torque, ca.jtimes(torque, state, rate), energy)


def _vertical(value: Any) -> Any:
    return ca.sparsify(ca.SX(ca.vertcat(0, 0, value)))


def functions(convention: Convention) -> tuple[Any, Any, Any]:
    """What is compiled.

    ``hri_values(z, p) -> y``, ``hri_jacobian(z, p) -> dy/dz`` (10 x 12, dense, column by column),
    ``hri_second(z, p, multipliers) -> dy/dz, sum of Hessians`` (12 x 12, lower triangle).
    """
    z, p = symbols()
    multipliers = ca.SX.sym("l", OUTPUTS)
    y = outputs(convention, z, p)
    jacobian = ca.densify(ca.jacobian(y, z))
    hessian = ca.densify(ca.tril(ca.hessian(ca.dot(multipliers, y), z)[0]))
    shared = {"cse": True}
    return (
        ca.Function("hri_values", [z, p], [y], shared),
        ca.Function("hri_jacobian", [z, p], [jacobian], shared),
        ca.Function("hri_second", [z, p, multipliers], [jacobian, hessian], shared),
    )
