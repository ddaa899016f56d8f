"""What the robot is told: from outside, and by its controller."""

from __future__ import annotations

import enum
from dataclasses import dataclass, field

import numpy as np

from bluefoot_mpc.types.common import FloatArray


class Mode(enum.StrEnum):
    """What the robot is asked to do, or does."""

    OFF = "off"
    STAND = "stand"
    WALK = "walk"
    SIT = "sit"
    SAFE = "safe"


@dataclass(frozen=True, kw_only=True, slots=True)
class JointCommand:
    """What the servos are told, once per command period.

    Attributes:
        position: (16,) rad, goal positions.
        speed: (16,) rad/s, moving speed limit; 0 = unlimited.
        torque_limit: (16,) fraction of stall torque, 0..1; 0 = limp.
    """

    position: FloatArray
    speed: FloatArray
    torque_limit: FloatArray


@dataclass(frozen=True, kw_only=True, slots=True)
class TrunkPose:
    """Offset of the trunk from its nominal pose over the feet.

    Attributes:
        position: (3,) m in the heading frame (x forward, y left, z up).
        rpy: (3,) rad: roll (right side down +), pitch (nose down +), yaw (left +).
    """

    position: FloatArray = field(default_factory=lambda: np.zeros(3))
    rpy: FloatArray = field(default_factory=lambda: np.zeros(3))


class GuideTask(enum.StrEnum):
    """What the robot finds its own way for."""

    WANDER = "wander"
    APPROACH = "approach"
    FOLLOW = "follow"
    GOTO = "goto"
    SWEEP = "sweep"
    CROSS = "cross"


@dataclass(frozen=True, kw_only=True, slots=True)
class Guide:
    """A task for which the robot chooses its motion itself, from LIDAR and camera.

    Attributes:
        task: ``wander`` through what is free; ``approach`` a marker, looked for where it is not in view,
            and stay there; ``follow`` a marker that moves; ``goto`` the waypoints, one after the other;
            ``sweep`` the ground ahead with the LIDAR, feet planted, and map it; ``cross`` rough ground to
            the last waypoint by sweeping, mapping, planning and stepping where the ground allows.
        speed: m/s, at most.
        distance: m, wanted horizontal distance from the camera to the marker's centre.
        waypoints: (n, 2) m, in the odometry frame; empty but for ``goto`` and ``cross``.
    """

    task: GuideTask
    speed: float = 0.15
    distance: float = 0.6
    waypoints: FloatArray = field(default_factory=lambda: np.zeros((0, 2)))


@dataclass(frozen=True, kw_only=True, slots=True)
class MotionCommand:
    """What an operator, script or navigator wants from the controller.

    Attributes:
        mode: requested mode (``SAFE`` cannot be requested, only entered).
        velocity: (2,) m/s, forward and left, in the heading frame.
        yaw_rate: rad/s, left positive.
        gait: name of the gait, ``"trot"`` or ``"walk"``.
        trunk: wanted offset of the trunk.
        guide: task that decides velocity and yaw rate while walking, and the
            trunk's offset in place of `trunk`; None: they are as they stand here.
    """

    mode: Mode = Mode.STAND
    velocity: FloatArray = field(default_factory=lambda: np.zeros(2))
    yaw_rate: float = 0.0
    gait: str = "trot"
    trunk: TrunkPose = field(default_factory=TrunkPose)
    guide: Guide | None = None
