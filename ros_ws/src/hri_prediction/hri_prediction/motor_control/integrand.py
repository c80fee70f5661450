r"""Costs, gradients and Hessians at one point of a reach, from the outputs of the compiled graph.

With :math:`s_i = \sqrt{(\dot q_i \tau_i)^2 + \epsilon^2}` and :math:`K = \dot q^\top M \dot q` the
integrand of weights w is

.. math:: \phi = w_1 |j|^2 + w_2 |\ddot q|^2 + w_3 |\dddot q|^2 + w_4 |\dot\tau|^2 + w_5 |\tau|^2
                 + w_6 \sum_i (s_i - \epsilon) + w_7 (\sqrt{K + \epsilon_K^2} - \epsilon_K).

It depends on the state z both directly and by the outputs y(z), so that

.. math:: \nabla\phi = Y^\top \phi_y + \phi_z, \quad
          \nabla^2\phi = Y^\top \phi_{yy} Y + Y^\top \phi_{yz} + \phi_{zy} Y + \phi_{zz} + \sum_k
          \phi_{y_k} \nabla^2 y_k.

The kernels fill arrays that they are given and allocate nothing.
"""

from __future__ import annotations

import math
from typing import Any

from hri_prediction.compiled import njit


@njit
def costs_at(z: Any, y: Any, power: float, speed: float, out: Any) -> None:
    """The seven integrands (7,) at a state z (12,) with outputs y (10,)."""
    for k in range(7):
        out[k] = 0.0
    for i in range(3):
        out[0] += y[i] * y[i]
        out[1] += z[6 + i] * z[6 + i]
        out[2] += z[9 + i] * z[9 + i]
        out[3] += y[6 + i] * y[6 + i]
        out[4] += y[3 + i] * y[3 + i]
        work = z[3 + i] * y[3 + i]
        out[5] += math.sqrt(work * work + power * power) - power
    out[6] = math.sqrt(max(y[9], 0.0) + speed * speed) - speed


@njit
def multipliers_at(z: Any, y: Any, weights: Any, power: float, speed: float, out: Any) -> None:
    """The derivatives of the integrand by the outputs, phi_y (10,)."""
    for i in range(3):
        rate, torque = z[3 + i], y[3 + i]
        root = math.sqrt(rate * rate * torque * torque + power * power)
        out[i] = 2.0 * weights[0] * y[i]
        out[3 + i] = 2.0 * weights[4] * torque + weights[5] * rate * rate * torque / root
        out[6 + i] = 2.0 * weights[3] * y[6 + i]
    out[9] = 0.5 * weights[6] / math.sqrt(max(y[9], 0.0) + speed * speed)


@njit
def gradient_at(
    z: Any, y: Any, jacobian: Any, weights: Any, multipliers: Any, power: float, out: Any
) -> None:
    """The gradient of the integrand by the state (12,); jacobian (12, 10): row i are derivatives by z_i."""
    for a in range(12):
        total = 0.0
        for k in range(10):
            total += jacobian[a, k] * multipliers[k]
        out[a] = total
    for i in range(3):
        rate, torque = z[3 + i], y[3 + i]
        root = math.sqrt(rate * rate * torque * torque + power * power)
        out[3 + i] += weights[5] * rate * torque * torque / root
        out[6 + i] += 2.0 * weights[1] * z[6 + i]
        out[9 + i] += 2.0 * weights[2] * z[9 + i]


@njit
def hessian_at(
    z: Any, y: Any, jacobian: Any, weights: Any, power: float, speed: float, hessian: Any
) -> None:
    """Add to the contracted Hessians of the outputs (12, 12) all other terms; the upper triangle counts."""
    squared = power * power
    for i in range(3):
        rate, torque = z[3 + i], y[3 + i]
        root = math.sqrt(rate * rate * torque * torque + squared)
        cubed = weights[5] / (root * root * root)
        # phi_yy of hand jerk, torque and rate of torque; phi_yz of the torque
        jerk, change = 2.0 * weights[0], 2.0 * weights[3]
        own = 2.0 * weights[4] + cubed * rate * rate * squared
        mixed = cubed * rate * torque * (root * root + squared)
        for a in range(12):
            by_jerk = jerk * jacobian[a, i]
            by_torque = own * jacobian[a, 3 + i]
            by_change = change * jacobian[a, 6 + i]
            for b in range(a, 12):
                hessian[a, b] += (
                    by_jerk * jacobian[b, i]
                    + by_torque * jacobian[b, 3 + i]
                    + by_change * jacobian[b, 6 + i]
                )
            cross = mixed * jacobian[a, 3 + i]
            if a <= 3 + i:
                hessian[a, 3 + i] += cross
            if a >= 3 + i:
                hessian[3 + i, a] += cross
        hessian[3 + i, 3 + i] += cubed * torque * torque * squared
        hessian[6 + i, 6 + i] += 2.0 * weights[1]
        hessian[9 + i, 9 + i] += 2.0 * weights[2]
    if weights[6] != 0.0:
        bent = -0.25 * weights[6] / (max(y[9], 0.0) + speed * speed) ** 1.5
        for a in range(12):
            by_energy = bent * jacobian[a, 9]
            for b in range(a, 12):
                hessian[a, b] += by_energy * jacobian[b, 9]


@njit
def gradients_at(
    z: Any, y: Any, jacobian: Any, power: float, speed: float, weights: Any, work: Any, out: Any
) -> None:
    """The gradient of each integrand by the state (7, 12); weights (7,) and work (10,) are scratch."""
    for k in range(7):
        for other in range(7):
            weights[other] = 1.0 if other == k else 0.0
        multipliers_at(z, y, weights, power, speed, work)
        gradient_at(z, y, jacobian, weights, work, power, out[k])
