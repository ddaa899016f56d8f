"""How joint torques and disturbances turn the trunk: Γ1 M̂⁻¹ and its pseudo-inverse, and the target ψ."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.model.dynamics import Dynamics
from bluefoot_mpc.types import N_JOINTS, FloatArray

_ANGULAR = slice(3, 6)
_FREE_FLYER = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0])


@dataclass(frozen=True, kw_only=True, slots=True)
class TrunkDynamics:
    """One mass matrix, as the levelling law needs it.

    Attributes:
        mass: (22, 22) M̂, rotors included.
        from_force: (3, 22) Γ1 M̂⁻¹: angular acceleration of the trunk per generalised force, base frame.
        to_torque: (16, 3) (Γ1 M̂⁻¹ Γ2)†: smallest joint torques for an angular acceleration.
    """

    mass: FloatArray
    from_force: FloatArray
    to_torque: FloatArray

    @classmethod
    def of(cls, mass: FloatArray) -> Self:
        """Of a (22, 22) mass matrix.

        Raises:
            ConfigurationError: joints and trunk are not coupled in it, so that no torque turns the trunk.
        """
        from_force: FloatArray = np.asarray(np.linalg.inv(mass)[_ANGULAR], dtype=np.float64)
        from_torque = from_force[:, -N_JOINTS:]
        square = from_torque @ from_torque.T
        # Rotors alone reach some 1e-3 of what the joints do to the trunk; without coupling nothing is left.
        if not square.trace() > 1e-6 * (from_force @ from_force.T).trace():
            raise ConfigurationError(
                "the mass matrix does not couple joints and trunk: the levelling law needs its "
                "off-diagonal block, so take it from the model"
            )
        return cls(mass=mass, from_force=from_force, to_torque=from_torque.T @ np.linalg.inv(square))

    @property
    def from_torque(self) -> FloatArray:
        """(3, 16) Γ1 M̂⁻¹ Γ2: angular acceleration of the trunk per joint torque."""
        return self.from_force[:, -N_JOINTS:]


def nominal_mass_matrix(dynamics: Dynamics, joints: FloatArray) -> FloatArray:
    """(22, 22) mean mass matrix over a gait.

    In Pinocchio's velocity convention it depends on the joints alone: the
    twist of the trunk is that in its own frame.

    Args:
        dynamics: the robot, rotors included.
        joints: (n, 16) rad, joints over whole cycles of the gait.
    """
    matrices = [dynamics.mass_matrix(np.concatenate([_FREE_FLYER, row])) for row in joints]
    return np.asarray(np.mean(matrices, axis=0))


def disturbance(
    mass: FloatArray, before: FloatArray, after: FloatArray, torque: FloatArray, dt: float
) -> FloatArray:
    """(22,) ψ_k = M̂ (z2_k - z2_{k-1})/Δ - Γ2 τ_{k-1}: all that is not motor torque; N, N·m.

    The sign is that of Φ in ``M v̇ = Γ2 τ + Φ``, the opposite of the printed target's (errata, item 10).

    Args:
        mass: (22, 22) M̂.
        before: (22,) velocity at the start of the period, trunk twist in the base frame, joints.
        after: (22,) velocity at its end.
        torque: (16,) N·m, motor torque at the joints during the period.
        dt: s, length of the period Δ.
    """
    force: FloatArray = mass @ ((after - before) / dt)
    force[-N_JOINTS:] -= torque
    return force
