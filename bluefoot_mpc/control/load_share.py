"""How planted feet share the robot's weight, and the joint torques that hold it: the static law.

The rung below the whole-body problem: no accelerations, no inequalities.
"""

from __future__ import annotations

import numpy as np

from bluefoot_mpc.gait.gait import GaitOutput
from bluefoot_mpc.model.dynamics import Dynamics
from bluefoot_mpc.types import FloatArray

_UNLOADED = 1e-6
"""Weight of a foot in the air: keeps the problem regular, carries nothing."""


def load_ramp(gait: GaitOutput, ramp: float) -> FloatArray:
    """(4,) share of its load that a foot may carry: 0 in the air, rising and falling over `ramp` s."""
    phase = gait.phase
    if not phase.walking:
        return np.ones(4)
    since = (phase.phase - gait.swing_share) * gait.cycle_time
    left = (1.0 - phase.phase) * gait.cycle_time
    share = np.minimum(np.maximum(np.minimum(since, left) / ramp, 0.0), 1.0)
    return np.where(phase.swing, 0.0, share)


def static_torques(dynamics: Dynamics, q: FloatArray, share: FloatArray) -> tuple[FloatArray, FloatArray]:
    """(16,) N·m joint torques and (4, 3) N foot forces that hold a configuration.

    Args:
        dynamics: the robot.
        q: (23,) configuration.
        share: (4,) load that each foot may carry, 0..1.
    """
    weight = np.repeat(share**2 + _UNLOADED, 3)
    weight.reshape(4, 3)[:, :2] *= 0.3  # friction: rather upright than sideways
    gravity = dynamics.gravity(q)
    jacobian = dynamics.foot_jacobians(q).reshape(12, -1)
    base = jacobian[:, :6]
    force = weight * (base @ np.linalg.solve(base.T @ (weight[:, None] * base), gravity[:6]))
    return gravity[6:] - jacobian[:, 6:].T @ force, force.reshape(4, 3)
