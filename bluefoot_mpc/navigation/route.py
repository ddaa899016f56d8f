"""Following a way: which way to look, and how fast to go."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from bluefoot_mpc.navigation.limits import Motion
from bluefoot_mpc.navigation.pose import Pose
from bluefoot_mpc.settings import require_positive, require_range
from bluefoot_mpc.types import FloatArray


@dataclass(frozen=True, kw_only=True, slots=True)
class RouteConfig:
    """How a way is followed."""

    lookahead: float = 0.5  # m along the way to the place that is steered to
    share: float = 0.75  # of the way in the direction; the rest is the potential field's
    yaw_gain: float = 1.2  # 1/s, turn for an error of the direction
    turn_first_deg: float = 60.0  # degrees off the direction from which the robot turns in place
    yaw_rate: float = 0.5  # rad/s, at most
    glide: float = 0.3  # m to the goal, within which the robot steps towards it without turning
    glide_gain: float = 0.8  # 1/s, speed for the distance there

    def __post_init__(self) -> None:
        require_positive(
            lookahead=self.lookahead, yaw_gain=self.yaw_gain, yaw_rate=self.yaw_rate, glide=self.glide,
            glide_gain=self.glide_gain,
        )  # fmt: skip
        require_range(0.0, 1.0, share=self.share)
        require_range(5.0, 90.0, turn_first_deg=self.turn_first_deg)


def ahead_on(way: FloatArray, pose: Pose, lookahead: float) -> FloatArray:
    """(2,) m in the robot frame: the place on the way a little ahead of the robot.

    Args:
        way: (k, 2) m in the odometry frame, k > 0.
        pose: of the robot.
        lookahead: m.
    """
    rel = pose.to_robot(way)
    nearest = int((rel[:, 0] ** 2 + rel[:, 1] ** 2).argmin())
    lengths = np.hypot(*np.diff(rel[nearest:], axis=0).T)
    last = nearest + int(np.searchsorted(np.cumsum(lengths), lookahead))
    return np.asarray(rel[min(last, len(rel) - 1)])


def towards(place: FloatArray, field: FloatArray, speed: float, config: RouteConfig) -> Motion:
    """The motion towards a place, bent by the potential field.

    Args:
        place: (2,) m in the robot frame.
        field: (2,) sum of the field's forces.
        speed: m/s, where nothing is to be turned.
        config: how a way is followed.
    """
    direction = config.share * _unit(place) + (1.0 - config.share) * _unit(field)
    bearing = math.atan2(float(direction[1]), float(direction[0]))
    return turning_to(bearing, speed, config)


def turning_to(bearing: float, speed: float, config: RouteConfig) -> Motion:
    """The motion that turns to a bearing (rad, left positive), the slower the more there is to turn."""
    turn = min(max(config.yaw_gain * bearing, -config.yaw_rate), config.yaw_rate)
    least = math.cos(math.radians(config.turn_first_deg))
    share = max(0.0, (math.cos(bearing) - least) / (1.0 - least))
    return Motion(speed * share, 0.0, turn)


def gliding_to(place: FloatArray, speed: float, config: RouteConfig) -> Motion:
    """The motion to a near place (2,) m in the robot frame, without turning."""
    x, y = (config.glide_gain * place).tolist()
    share = min(1.0, speed / max(math.hypot(x, y), 1e-9))
    return Motion(share * x, share * y, 0.0)


def _unit(vector: FloatArray) -> FloatArray:
    length = math.hypot(*vector.tolist())
    return vector / length if length > 0.0 else np.zeros(2)
