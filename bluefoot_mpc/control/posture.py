"""Where the trunk is wanted over the feet: height, commanded offset, ZMP placement, sitting."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from bluefoot_mpc.control.level import CentringConfig
from bluefoot_mpc.control.servo_map import ServoMapConfig
from bluefoot_mpc.gait.parameters import Style
from bluefoot_mpc.model.parameters import StanceParameters
from bluefoot_mpc.settings import require_nonnegative, require_positive
from bluefoot_mpc.types import FloatArray, TrunkPose


@dataclass(frozen=True, kw_only=True, slots=True)
class PostureConfig:
    """Trunk posture and how fast it may change.

    Heights and stance left at ``None`` are the robot's own (its parameter file).
    """

    trunk_height: float | None = None  # m, trunk origin above the foot points
    stance_x: float | None = None  # m, foot from the trunk centre, forward
    stance_y: float | None = None  # m, foot from the trunk centre, sideways
    trunk_forward: float = 0.0  # m, trunk origin ahead of the middle of the feet
    sit_height_share: float = 0.4  # of the trunk height, when sitting; the belly hangs 15 mm above the floor
    max_rate: float = 0.08  # m/s, commanded trunk translation
    max_turn_rate: float = 0.6  # rad/s, commanded trunk rotation
    max_offset: float = 0.12  # m, each axis of a commanded offset
    max_tilt: float = 0.7  # rad, each axis of a commanded rotation
    level_gain: float = 0.15  # 1/s, slow integral that trims the trunk's mean tilt away
    level_bound: float = 0.15  # rad, largest trim
    centring: CentringConfig = field(default_factory=CentringConfig)

    def __post_init__(self) -> None:
        for name in ("trunk_height", "stance_x", "stance_y"):
            value = getattr(self, name)
            if value is not None:
                require_positive(**{name: value})
        require_positive(
            sit_height_share=self.sit_height_share, max_rate=self.max_rate, max_turn_rate=self.max_turn_rate
        )
        require_nonnegative(
            max_offset=self.max_offset, max_tilt=self.max_tilt,
            level_gain=self.level_gain, level_bound=self.level_bound,
        )  # fmt: skip


def follow_pose(pose: FloatArray, wanted: TrunkPose, dt: float, config: PostureConfig) -> FloatArray:
    """(6,) m and rad, `pose` moved towards the wanted offset at limited speed.

    Args:
        pose: (6,) offset in force.
        wanted: the command; beyond the configured bounds it is cut.
        dt: s.
        config: bounds and rates.
    """
    target: list[float] = wanted.position.tolist() + wanted.rpy.tolist()
    now: list[float] = pose.tolist()
    if target == now:
        return pose
    linear = (config.max_offset, config.max_rate * dt)
    angular = (config.max_tilt, config.max_turn_rate * dt)
    moved = [_follow(*pair, *linear) for pair in zip(now[:3], target[:3], strict=True)]
    moved += [_follow(*pair, *angular) for pair in zip(now[3:], target[3:], strict=True)]
    return np.array(moved)


def _follow(value: float, target: float, bound: float, step: float) -> float:
    """`value` moved by `step` at most towards the target, which is cut to ±`bound`."""
    target = min(max(target, -bound), bound)
    return value + min(max(target - value, -step), step)


def trim_level(trim: FloatArray, tilt_error: FloatArray, gain: float, bound: float, dt: float) -> FloatArray:
    """(2,) rad, slow integral of the tilt error (estimate minus reference), bounded.

    Args:
        trim: (2,) rad, roll and pitch so far.
        tilt_error: (2,) rad.
        gain: 1/s.
        bound: rad, largest trim.
        dt: s.
    """
    share = gain * dt
    pairs = zip(trim.tolist(), tilt_error.tolist(), strict=True)
    return np.array([min(max(value - share * error, -bound), bound) for value, error in pairs])


@dataclass(frozen=True, kw_only=True, slots=True)
class Stance:
    """Where the feet stand and how high the trunk is.

    Attributes:
        feet: (4, 3) m, feet around the trunk's neutral place, on the ground.
        trunk_height: m, trunk origin above the foot points.
    """

    feet: FloatArray
    trunk_height: float


def stance(robot: StanceParameters, config: PostureConfig) -> Stance:
    """The stance in force: the robot's own with what the configuration replaces."""
    chosen = replace(
        robot,
        foot_x=config.stance_x or robot.foot_x,
        foot_y=config.stance_y or robot.foot_y,
        trunk_height=config.trunk_height or robot.trunk_height,
    )
    return Stance(feet=chosen.foot_position, trunk_height=chosen.trunk_height)


def style(stance: Stance, config: PostureConfig, servo: ServoMapConfig) -> Style:
    """What holds for trunk and servos where the gait's table says nothing."""
    return Style(
        trunk_height=stance.trunk_height, trunk_forward=config.trunk_forward, level_gain=config.level_gain,
        mixing=servo.mixing, back_emf=servo.back_emf,
    )  # fmt: skip
