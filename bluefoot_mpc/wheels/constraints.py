"""The constraints of all wheels of a robot, stacked.

    J1 twist = J2 speeds   (no wheel slips),    C1 twist = 0   (no fixed or steered wheel slides)

with the twist in the robot's frame. J1 has one row per wheel, C1 one per fixed
or steered wheel: castors and rollers give way and forbid nothing.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from bluefoot_mpc.model.linear import RANK_TOLERANCE, subspaces
from bluefoot_mpc.types import FloatArray
from bluefoot_mpc.wheels.robot import WheeledRobot
from bluefoot_mpc.wheels.wheel import rolling_row, sliding_row


def rolling_matrix(robot: WheeledRobot, steering: FloatArray | None = None) -> FloatArray:
    """J1 (n, 3): rolling rows of all wheels.

    Args:
        robot: n wheels.
        steering: (n,) rad, turn of each wheel that turns; None: all straight.
    """
    angles = robot.checked_steering(steering)
    return np.array([rolling_row(w, a) for w, a in zip(robot.wheels, angles.tolist(), strict=True)])


def radius_matrix(robot: WheeledRobot) -> FloatArray:
    """J2 (n, n): diagonal of r cos(gamma) (m)."""
    return np.diag([wheel.drive_radius for wheel in robot.wheels])


def sliding_matrix(
    robot: WheeledRobot, steering: FloatArray | None = None, kinds: Iterable[str] = ("fixed", "steered")
) -> FloatArray:
    """C1 (k, 3): sliding rows of the wheels that may not slide; C1f or C1s with one kind alone.

    Args:
        robot: n wheels.
        steering: (n,) rad, turn of each wheel that turns; None: all straight.
        kinds: of wheels, in the order in which their rows are stacked.
    """
    angles = robot.checked_steering(steering).tolist()
    order = [index for kind in kinds for index in robot.indices(kind)]
    return np.array([sliding_row(robot.wheels[i], angles[i]) for i in order]).reshape(-1, 3)


def scaled(rows: FloatArray, size: float) -> FloatArray:
    """(k, 3) rows for a twist whose yaw rate is multiplied by `size` (m), so that all units are alike."""
    return np.asarray(rows / np.array([1.0, 1.0, size]))


def free_twists(rows: FloatArray, size: float, tolerance: float = RANK_TOLERANCE) -> FloatArray:
    """(3, 3 - rank) basis of the twists that (k, 3) sliding rows permit.

    Orthonormal once the yaw rate is multiplied by `size` (m); an orthonormal basis
    in that sense is what projections are made with.
    """
    basis = subspaces(scaled(rows, size), tolerance).null if len(rows) else np.eye(3)
    return np.asarray(basis / np.array([[1.0], [1.0], [size]]))


def rank_of(rows: FloatArray, size: float, tolerance: float = RANK_TOLERANCE) -> int:
    """Number of independent ones among (k, 3) rows, with the yaw column scaled by `size` (m)."""
    return subspaces(scaled(rows, size), tolerance).rank if len(rows) else 0
