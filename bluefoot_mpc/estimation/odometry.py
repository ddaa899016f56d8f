"""Position in the odometry frame, from the feet that stand."""

from __future__ import annotations

from typing import NamedTuple

from bluefoot_mpc.estimation.inertial import Vector
from bluefoot_mpc.types import FloatArray


class OdometryState(NamedTuple):
    """Memory of the leg odometry.

    Attributes:
        position: m, IMU in the odometry frame.
        feet: (4, 3) m, feet relative to the IMU at the last frame, world axes.
        standing: feet that the filter kept in place at the last frame.
    """

    position: Vector
    feet: FloatArray
    standing: tuple[int, ...]


def advance_position(
    state: OdometryState, feet: FloatArray, roll: FloatArray, standing: tuple[int, ...], way: Vector
) -> OdometryState:
    """Move by what the standing feet moved backwards; without any, by the filter's own way.

    Within a stance the sum telescopes, so rounding of the joints does not add up.

    Args:
        state: memory.
        feet: (4, 3) m, filtered feet relative to the IMU, world axes.
        roll: (4, 3) m, way of the foot points over the ground since the last frame.
        standing: feet that the filter used.
        way: m, displacement of the IMU by the filter's velocity.
    """
    legs = list(standing)
    if legs:
        moved = (state.feet + roll - feet)[legs].sum(axis=0) / len(legs)
        dx, dy, dz = moved.tolist()
    else:
        dx, dy, dz = way
    x, y, z = state.position
    return OdometryState((x + dx, y + dy, z + dz), feet, standing)


def trunk_height(feet_from_trunk: FloatArray, contact: list[bool]) -> float:
    """Trunk origin above the mean of the standing feet, or above the lowest foot without any.

    Args:
        feet_from_trunk: (4, 3) m, world axes.
        contact: (4,) feet that touch.

    Returns:
        m, above foot points (one ball radius less than above the floor).
    """
    heights: list[float] = feet_from_trunk[:, 2].tolist()
    standing = [h for h, touches in zip(heights, contact, strict=True) if touches]
    return -sum(standing) / len(standing) if standing else -min(heights)


def start_odometry(feet: FloatArray, height: float, mount: FloatArray) -> OdometryState:
    """Odometry at the first frame: trunk origin above the frame's origin.

    Args:
        feet: (4, 3) m, relative to the IMU, world axes.
        height: m, trunk origin above the foot points.
        mount: (3,) m, IMU from the trunk origin, world axes.
    """
    x, y, z = mount.tolist()
    return OdometryState((x, y, z + height), feet, ())
