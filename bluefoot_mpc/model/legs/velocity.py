"""Between joint rates and foot velocities, with the trunk moving (paper ch. 4).

The lever of the trunk's rotation is the foot point relative to the trunk's
origin; the paper's printed form adds the hip's offset a second time.
"""

from __future__ import annotations

import numpy as np

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.geometry import skew
from bluefoot_mpc.types import FloatArray

DAMPING = 1e-6
"""m²/rad², Λ of the damped inverse: a ten-thousandth of J Jᵀ in the default stance."""


def foot_velocities_in_world(
    rotation_base_to_world: FloatArray,
    base_twist: FloatArray,
    feet_in_base: FloatArray,
    jacobians_in_base: FloatArray,
    joint_velocity: FloatArray,
) -> FloatArray:
    """Velocities of the foot points in the world.

    Args:
        rotation_base_to_world: (3, 3).
        base_twist: (6,) linear m/s and angular rad/s of the trunk, base frame.
        feet_in_base: (n, 3) m, base frame.
        jacobians_in_base: (n, 3, 4) m/rad, base frame.
        joint_velocity: (4 n,) rad/s, leg-major.

    Returns:
        (n, 3) m/s, world frame.
    """
    rates = joint_velocity.reshape(-1, 4, 1)
    of_joints = (jacobians_in_base @ rates)[..., 0]
    return (of_joints + _carried(base_twist, feet_in_base)) @ rotation_base_to_world.T


def joint_velocities(
    rotation_base_to_world: FloatArray,
    base_twist: FloatArray,
    feet_in_base: FloatArray,
    jacobians_in_base: FloatArray,
    foot_velocity_in_world: FloatArray,
    *,
    damping: FloatArray | float = DAMPING,
) -> FloatArray:
    """Joint rates that give the foot points wanted velocities in the world.

    Args:
        rotation_base_to_world: (3, 3).
        base_twist: (6,) linear m/s and angular rad/s of the trunk, base frame.
        feet_in_base: (n, 3) m, base frame.
        jacobians_in_base: (n, 3, 4) m/rad, base frame.
        foot_velocity_in_world: (n, 3) m/s, wanted, world frame.
        damping: Λ of `damped_inverse`, m²/rad².

    Returns:
        (4 n,) rad/s, leg-major.
    """
    relative = foot_velocity_in_world @ rotation_base_to_world - _carried(base_twist, feet_in_base)
    rates = damped_inverse(jacobians_in_base, damping) @ relative[..., None]
    return rates.reshape(-1)


def damped_inverse(jacobian: FloatArray, damping: FloatArray | float = DAMPING) -> FloatArray:
    """Damped least-squares inverse (JᵀJ + Λ)⁻¹ Jᵀ of one Jacobian or a stack.

    It exists in every posture, and where J loses rank it gives up speed along
    the lost direction instead of asking for boundless joint rates.

    Args:
        jacobian: (..., m, k).
        damping: Λ > 0, one number or the (k,) diagonal; squared unit of `jacobian`.

    Returns:
        (..., k, m).

    Raises:
        ConfigurationError: an entry of Λ is not positive.
    """
    size = jacobian.shape[-1]
    diagonal = np.full(size, damping) if isinstance(damping, float | int) else np.asarray(damping)
    if not (diagonal > 0.0).all():
        raise ConfigurationError(
            f"damping = {damping!r} must be positive: four joints move three coordinates"
        )
    transposed = np.swapaxes(jacobian, -1, -2)
    return np.asarray(np.linalg.solve(transposed @ jacobian + np.diag(diagonal), transposed))


def _carried(base_twist: FloatArray, feet_in_base: FloatArray) -> FloatArray:
    """(n, 3) m/s, velocity of points fixed to the moving trunk, base frame."""
    return base_twist[:3] + feet_in_base @ skew(base_twist[3:]).T
