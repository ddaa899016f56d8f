"""What the controller believes and refers to."""

from __future__ import annotations

from dataclasses import dataclass

from bluefoot_mpc.types.common import BoolArray, FloatArray


@dataclass(frozen=True, kw_only=True, slots=True)
class BodyState:
    """Estimated state of the robot (never the simulator's truth).

    Attributes:
        time: s.
        position: (3,) m, trunk origin in the odometry frame (starts at the
            robot's first stance: origin under the trunk, x along its heading).
        quaternion: (4,) x, y, z, w: rotation_base_to_world.
        rpy: (3,) rad, the same orientation as roll, pitch, yaw.
        linear_velocity: (3,) m/s of the trunk origin, in the base frame.
        angular_velocity: (3,) rad/s in the base frame, bias removed.
        joint_position: (16,) rad.
        joint_velocity: (16,) rad/s, estimated from positions.
        contact: (4,) True where the foot touches (switches, debounced).
        foot_position_in_base: (4, 3) m, by forward kinematics.
        height: m, trunk origin above the mean of the stance feet.
        healthy: False when the estimate must not be trusted (sensors lost).
    """

    time: float
    position: FloatArray
    quaternion: FloatArray
    rpy: FloatArray
    linear_velocity: FloatArray
    angular_velocity: FloatArray
    joint_position: FloatArray
    joint_velocity: FloatArray
    contact: BoolArray
    foot_position_in_base: FloatArray
    height: float
    healthy: bool = True


@dataclass(frozen=True, kw_only=True, slots=True)
class GaitPhase:
    """Where the gait stands: which legs swing and how far.

    Attributes:
        swing: (4,) True where the leg is in swing (y2 > 0).
        y1: (4,) first oscillator states.
        y2: (4,) second oscillator states.
        phase: (4,) fraction of the cycle since lift-off, in [0, 1).
        walking: False when the network rests.
    """

    swing: BoolArray
    y1: FloatArray
    y2: FloatArray
    phase: FloatArray
    walking: bool


@dataclass(frozen=True, kw_only=True, slots=True)
class ContactSchedule:
    """Contacts ahead, as the gait will produce them.

    Attributes:
        time: (n,) s from now.
        stance: (n, 4) True where the foot is scheduled to stand.
        footholds: (n, 4, 3) m, planned foot positions in the b' frame.
    """

    time: FloatArray
    stance: BoolArray
    footholds: FloatArray


@dataclass(frozen=True, kw_only=True, slots=True)
class PostureReference:
    """Wanted trunk pose and feet, both in the robot-relative frame b'.

    b' translates and turns with the commanded motion (the virtual robot) and
    never tilts with the trunk. Its origin lies on the ground.

    Attributes:
        trunk_position: (3,) m, trunk origin.
        trunk_rpy: (3,) rad, roll, pitch and yaw of the trunk.
        foot_position: (4, 3) m.
        swing: (4,) True where the leg swings.
    """

    trunk_position: FloatArray
    trunk_rpy: FloatArray
    foot_position: FloatArray
    swing: BoolArray
