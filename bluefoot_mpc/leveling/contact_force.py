"""Estimated ground forces: the robot's weight and acceleration, shared by the feet that touch."""

from __future__ import annotations

import numpy as np

from bluefoot_mpc.types import N_LEGS, BoolArray, FloatArray, ImuBatch


def specific_force(imu: ImuBatch) -> FloatArray | None:
    """(3,) m/s², mean specific force (p̈_b - g) over the batch, base frame; None without a usable sample."""
    usable = imu.accel[imu.valid] if len(imu.time) else imu.accel
    if not len(usable):
        return None
    mean: FloatArray = usable.sum(axis=0) / len(usable)
    return mean if np.isfinite(mean).all() else None


def contact_forces(mass: float, force: FloatArray, contact: BoolArray) -> FloatArray:
    """(4, 3) N, ground force on each foot in the axes of `force`: m_T μ_i (p̈_b - g) / Σμ.

    Paper, section on the NARX compensator; zero when no foot touches.

    Args:
        mass: m_T, kg, of the whole robot.
        force: (3,) m/s², p̈_b - g.
        contact: (4,) μ, True where a foot touches.
    """
    touching = int(np.count_nonzero(contact))
    if touching == 0:
        return np.zeros((N_LEGS, 3))
    shared: FloatArray = np.multiply.outer(contact.astype(float), (mass / touching) * force)
    return shared
