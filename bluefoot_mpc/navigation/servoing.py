"""Visual servoing: towards the marker and to a wanted distance from it (thesis, chapter 6).

The printed laws live in the picture: `camera_speed`, `camera_yaw_rate`, `camera_pitch`, `mixing` and
`mixed`. Against print, a robot that is nearer than the stop size does not speed up again, and a marker that
is not seen has no share in the command.

The exponential speed never arrives: near the stop size it falls with the square of what is left, so the time
to go grows without end. `approach` and `follow` therefore work with distances: along a profile that brakes
at a steady rate down to a slow walk and ends there, with the marker's own motion fed forward.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

from bluefoot_mpc.navigation.limits import Motion
from bluefoot_mpc.settings import require_nonnegative, require_positive, require_range


@dataclass(frozen=True, kw_only=True, slots=True)
class ServoingConfig:
    """Constants of the laws. Radii are those of a picture 640 pixels wide."""

    speed_decay: float = 2.0e-3  # 1/px², c_r of the printed speed
    mix_radius: float = 30.0  # px, r_mix: nearer (larger) than this the camera alone leads
    mix_decay: float = 1.5e-2  # 1/px², c_mix
    greatest_yaw_rate: float = 0.4  # rad/s, at the picture's edge
    greatest_pitch: float = 0.05  # rad, of the trunk; more makes the LIDAR see the floor
    pitch_time: float = 0.6  # s in which the trunk's pitch follows

    gain: float = 0.7  # 1/s, speed per metre to go
    braking: float = 0.03  # m/s², along the way to the wanted distance
    slowest: float = 0.03  # m/s: a slower walk takes for ever
    back: float = 0.06  # m/s, away from a marker that is too near
    bearing_gain: float = 1.2  # 1/s, yaw rate per bearing
    turn_limit: float = 0.5  # rad/s
    clear_bearing_deg: float = 8.0  # degrees; marker within this: full speed
    turn_bearing_deg: float = 24.0  # degrees; marker beyond this: turning only

    near: float = 0.012  # m of the wanted distance: a robot that walks stops
    off: float = 0.035  # m of the wanted distance: a robot that stands sets out
    follow_near: float = 0.025  # m, the same for a marker that may move
    follow_off: float = 0.09  # m
    near_bearing_deg: float = 5.0  # degrees: a robot that walks stops
    off_bearing_deg: float = 12.0  # degrees: a robot that stands turns
    still: float = 0.02  # m/s: a marker slower than this stands
    moving: float = 0.05  # m/s: a marker faster than this moves

    def __post_init__(self) -> None:
        require_positive(
            speed_decay=self.speed_decay, mix_radius=self.mix_radius, mix_decay=self.mix_decay,
            greatest_yaw_rate=self.greatest_yaw_rate, pitch_time=self.pitch_time, gain=self.gain,
            braking=self.braking, slowest=self.slowest, back=self.back, bearing_gain=self.bearing_gain,
            turn_limit=self.turn_limit, near=self.near, off=self.off, follow_near=self.follow_near,
            follow_off=self.follow_off, still=self.still, moving=self.moving,
        )  # fmt: skip
        require_nonnegative(clear_bearing_deg=self.clear_bearing_deg)
        require_range(0.0, 0.3, greatest_pitch=self.greatest_pitch)
        require_range(self.clear_bearing_deg + 1.0, 180.0, turn_bearing_deg=self.turn_bearing_deg)
        require_range(self.near, 1.0, off=self.off)
        require_range(self.follow_near, 1.0, follow_off=self.follow_off)
        require_range(0.1, self.off_bearing_deg, near_bearing_deg=self.near_bearing_deg)
        require_range(self.still, 1.0, moving=self.moving)


class Relative(NamedTuple):
    """The marker as the camera has it now, level, in the robot's heading frame.

    Attributes:
        distance: m, horizontal, from the camera to the marker's centre.
        bearing: rad from forward, left positive.
        away: m/s, the marker's own speed along the line of sight, away from the camera.
        across: m/s, its own speed across that line, to the left.
    """

    distance: float
    bearing: float
    away: float = 0.0
    across: float = 0.0


class Servo(NamedTuple):
    """What servoing remembers: whether the robot stands at its distance, and its trunk's pitch (rad)."""

    standing: bool = False
    pitch: float = 0.0


def camera_speed(radius: float, stop_radius: float, speed: float, config: ServoingConfig) -> float:
    """m/s forward, by the marker's radius (px): printed law, zero from the stop size on and where unseen."""
    if not 0.0 < radius < stop_radius:
        return 0.0
    return speed * (1.0 - math.exp(-config.speed_decay * (radius - stop_radius) ** 2))


def camera_yaw_rate(column: float, width: int, config: ServoingConfig) -> float:
    """rad/s towards a marker in this column of a picture so wide, left positive; printed law."""
    if not math.isfinite(column):
        return 0.0
    return config.greatest_yaw_rate * min(1.0, max(-1.0, (width - 2.0 * column) / width))


def camera_pitch(row: float, height: int, config: ServoingConfig) -> float:
    """rad, nose down for a marker low in the picture; printed law, with what a walk can bear."""
    if not math.isfinite(row):
        return 0.0
    return config.greatest_pitch * min(1.0, max(-1.0, (2.0 * row - height) / height))


def mixing(radius: float, config: ServoingConfig) -> float:
    """Share of the camera in the command, 0..1; zero for a marker that is not seen (NaN or no radius)."""
    if not radius > 0.0:
        return 0.0
    if radius >= config.mix_radius:
        return 1.0
    return math.exp(-config.mix_decay * (radius - config.mix_radius) ** 2)


def mixed(camera: Motion, lidar: Motion, share: float) -> Motion:
    """The camera's motion with this share, the LIDAR's with the rest."""
    rest = 1.0 - share
    return Motion(
        share * camera.x + rest * lidar.x,
        share * camera.y + rest * lidar.y,
        share * camera.yaw_rate + rest * lidar.yaw_rate,
    )


def printed_motion(
    marker: tuple[float, float, float], size: tuple[int, int], stop_radius: float, speed: float,
    config: ServoingConfig,
) -> Motion:  # fmt: skip
    """The thesis' motion for a marker (column, row, radius) in a picture (width, height)."""
    return Motion(
        camera_speed(marker[2], stop_radius, speed, config),
        0.0,
        camera_yaw_rate(marker[0], size[0], config),
    )


def closing_speed(error: float, speed: float, config: ServoingConfig) -> float:
    """m/s that brings an error of distance (m, positive: too far) to zero in finite time.

    A steady braking from `speed`, a linear law near the end that a walk's lag does not upset, and a slowest
    walk so that it ends. Too near: the same backwards, slowly.
    """
    if error >= 0.0:
        wanted = min(config.gain * error, math.sqrt(2.0 * config.braking * error), speed)
        return max(wanted, min(config.slowest, speed))
    return -min(max(-config.gain * error, config.slowest), config.back)


def turning(marker: Relative, forward: float, config: ServoingConfig) -> float:
    """rad/s that keeps a marker ahead: towards it, and with the line of sight as it turns."""
    distance = max(marker.distance, 0.2)
    # The robot's own forward speed turns the line of sight too, away from the robot's course.
    sight = (marker.across + forward * math.sin(marker.bearing)) / distance
    rate = config.bearing_gain * marker.bearing + sight
    return min(config.turn_limit, max(-config.turn_limit, rate))


def ahead_share(bearing: float, config: ServoingConfig) -> float:
    """0..1 of the speed for a marker off to the side: to keep it in the picture comes first."""
    least, most = math.radians(config.clear_bearing_deg), math.radians(config.turn_bearing_deg)
    return min(1.0, max(0.0, (most - abs(bearing)) / (most - least)))


def approach(
    servo: Servo, marker: Relative, distance: float, speed: float, config: ServoingConfig
) -> tuple[Servo, Motion]:
    """Towards a marker that stands, to `distance` m from it, and stay there.

    Args:
        servo: what servoing remembers.
        marker: where it is.
        distance: m, wanted.
        speed: m/s, at most.
        config: the law's constants.

    Returns:
        What to remember, and the motion; `Servo.standing` says that the robot has arrived.
    """
    error = marker.distance - distance
    bearing = abs(math.degrees(marker.bearing))
    if servo.standing:
        standing = abs(error) < config.off and bearing < config.off_bearing_deg
    else:
        standing = abs(error) < config.near and bearing < config.near_bearing_deg
    return _motion(servo, standing, error, marker, (speed, config.near), config)


def follow(
    servo: Servo, marker: Relative, distance: float, speed: float, config: ServoingConfig
) -> tuple[Servo, Motion]:
    """Behind a marker that moves, `distance` m away from it; where it stops, stand.

    Args and returns as of `approach`.
    """
    error = marker.distance - distance
    bearing = abs(math.degrees(marker.bearing))
    pace = math.hypot(marker.away, marker.across)
    if servo.standing:
        standing = (
            abs(error) < config.follow_off and bearing < config.off_bearing_deg and pace < config.moving
        )
    else:
        standing = (
            abs(error) < config.follow_near and bearing < config.near_bearing_deg and pace < config.still
        )
    return _motion(servo, standing, error, marker, (speed, 0.0), config)


def _motion(
    servo: Servo, standing: bool, error: float, marker: Relative, pace: tuple[float, float],
    config: ServoingConfig,
) -> tuple[Servo, Motion]:  # fmt: skip
    """The motion of both laws; `pace` is the speed allowed and the error that is none."""
    if standing:
        return servo._replace(standing=True), Motion()
    speed, none = pace
    moves = math.hypot(marker.away, marker.across) > config.still
    if abs(error) <= none and not moves:
        closing = 0.0
    elif moves:
        # With a leader that moves there is no arriving: the plain linear law, without a slowest walk.
        closing = marker.away + config.gain * error
    else:
        closing = closing_speed(error, speed, config)
    closing = min(speed, max(-config.back, closing))
    forward = closing * ahead_share(marker.bearing, config) if closing > 0.0 else closing
    return servo._replace(standing=False), Motion(forward, 0.0, turning(marker, forward, config))


def pitched(servo: Servo, wanted: float, dt: float, config: ServoingConfig) -> Servo:
    """The trunk's pitch, moved towards `wanted` (rad) for `dt` seconds."""
    share = 1.0 - math.exp(-dt / config.pitch_time)
    return servo._replace(pitch=servo.pitch + share * (wanted - servo.pitch))
