"""Where the trunk was at the time of a scan, between two ticks."""

from __future__ import annotations

from collections import deque
from typing import NamedTuple

import numpy as np

from bluefoot_mpc.geometry import rpy_from_quaternion
from bluefoot_mpc.types import BodyState, FloatArray


class TrackedPose(NamedTuple):
    """An estimated pose at a time.

    Attributes:
        position: (3,) m, trunk origin in the odometry frame.
        quaternion: (4,) x, y, z, w: rotation_base_to_world.
        pitch: rad, nose down positive.
        rate: rad/s, how fast the trunk turned about its sideways axis, without sign.
    """

    position: FloatArray
    quaternion: FloatArray
    pitch: float
    rate: float


class PoseTrack:
    """Keeps the last estimates; between two of them a pose is on the straight way.

    Args:
        length: ticks that are kept.
    """

    def __init__(self, length: int = 24) -> None:
        self._states: deque[BodyState] = deque(maxlen=length)

    def add(self, estimate: BodyState) -> None:
        """Keep the newest estimate."""
        self._states.append(estimate)

    def at(self, time: float) -> TrackedPose:
        """The pose at a time (s); before the first and after the last estimate theirs.

        Raises:
            IndexError: no estimate was kept.
        """
        after = self._states[-1]
        before = after
        for state in reversed(self._states):
            before = state
            if state.time <= time:
                break
            after = state
        span = after.time - before.time
        share = min(max((time - before.time) / span, 0.0), 1.0) if span > 0.0 else 0.0
        # Two neighbouring ticks differ by so little that the straight way between them is the turn's own.
        near = np.copysign(1.0, before.quaternion @ after.quaternion)
        quaternion = (1.0 - share) * before.quaternion + share * near * after.quaternion
        quaternion = quaternion / np.sqrt(quaternion @ quaternion)
        rate = (1.0 - share) * before.angular_velocity[1] + share * after.angular_velocity[1]
        return TrackedPose(
            position=(1.0 - share) * before.position + share * after.position,
            quaternion=quaternion,
            pitch=float(rpy_from_quaternion(quaternion)[1]),
            rate=abs(float(rate)),
        )
