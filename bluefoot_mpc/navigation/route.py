"""Following a way: which way to look, and how fast to go."""

from __future__ import annotations

import math
from dataclasses import dataclass

from bluefoot_mpc.navigation.limits import Motion
from bluefoot_mpc.navigation.pose import Pose
from bluefoot_mpc.settings import require_positive, require_range
from bluefoot_mpc.types import FloatArray

STEP = 0.1
"""m between the places of a way: squares of the map."""

Place = tuple[float, float]


@dataclass(frozen=True, kw_only=True, slots=True)
class RouteConfig:
    """How a way is followed."""

    lookahead: float = 0.4  # m along the way to the place that is steered to
    share: float = 0.75  # of the way in the direction; the rest is the potential field's
    yaw_gain: float = 1.2  # 1/s, turn for an error of the direction
    turn_first_deg: float = 60.0  # degrees off the direction from which the robot turns in place
    yaw_rate: float = 0.5  # rad/s, at most
    look_rate: float = 0.4  # rad/s, looking around where no way is known
    glide: float = 0.3  # m to the goal, within which the robot steps towards it without turning
    glide_gain: float = 0.8  # 1/s, speed for the distance there

    def __post_init__(self) -> None:
        require_positive(
            lookahead=self.lookahead, yaw_gain=self.yaw_gain, yaw_rate=self.yaw_rate,
            look_rate=self.look_rate, glide=self.glide,
            glide_gain=self.glide_gain,
        )  # fmt: skip
        require_range(0.0, 1.0, share=self.share)
        require_range(5.0, 90.0, turn_first_deg=self.turn_first_deg)


def ahead_on(way: FloatArray, pose: Pose, lookahead: float) -> Place:
    """The place on the way a little ahead of the robot, in the robot frame.

    Args:
        way: (k, 2) m in the odometry frame, k > 0, at least about `STEP` apart.
        pose: of the robot.
        lookahead: m; counted in steps of the way.
    """
    offset = way - pose[:2]
    offset *= offset
    last = int(offset.sum(axis=1).argmin()) + round(lookahead / STEP)
    x, y = way[min(last, len(way) - 1)].tolist()
    return in_robot(pose, x, y)


def in_robot(pose: Pose, x: float, y: float) -> Place:
    """A place of the odometry frame in the robot frame, m."""
    cos, sin, dx, dy = math.cos(pose.yaw), math.sin(pose.yaw), x - pose.x, y - pose.y
    return cos * dx + sin * dy, cos * dy - sin * dx


def towards(place: Place, field: FloatArray, speed: float, config: RouteConfig) -> Motion:
    """The motion towards a place, bent by the potential field.

    Args:
        place: m in the robot frame.
        field: (2,) sum of the field's forces.
        speed: m/s, where nothing is to be turned.
        config: how a way is followed.
    """
    (x, y), (fx, fy) = place, field.tolist()
    one = config.share / max(math.hypot(x, y), 1e-9)
    other = (1.0 - config.share) / max(math.hypot(fx, fy), 1e-9)
    return turning_to(math.atan2(one * y + other * fy, one * x + other * fx), speed, config)


def turning_to(bearing: float, speed: float, config: RouteConfig) -> Motion:
    """The motion that turns to a bearing (rad, left positive), the slower the more there is to turn."""
    turn = min(max(config.yaw_gain * bearing, -config.yaw_rate), config.yaw_rate)
    least = math.cos(math.radians(config.turn_first_deg))
    share = max(0.0, (math.cos(bearing) - least) / (1.0 - least))
    return Motion(speed * share, 0.0, turn)


def gliding_to(place: Place, speed: float, config: RouteConfig) -> Motion:
    """The motion to a near place, without turning."""
    x, y = config.glide_gain * place[0], config.glide_gain * place[1]
    share = min(1.0, speed / max(math.hypot(x, y), 1e-9))
    return Motion(share * x, share * y, 0.0)
