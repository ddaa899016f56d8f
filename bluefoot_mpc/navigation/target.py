"""Where the marker is in the odometry frame: from sightings, smoothed, and predicted while it is hidden."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from bluefoot_mpc.geometry import rotation_from_quaternion, wrap_angle
from bluefoot_mpc.model.parameters import SensorMounts
from bluefoot_mpc.navigation.marker import Sighting
from bluefoot_mpc.navigation.servoing import Relative
from bluefoot_mpc.settings import require_positive, require_range
from bluefoot_mpc.types import BodyState, FloatArray


@dataclass(frozen=True, kw_only=True, slots=True)
class TargetConfig:
    """The marker's size, how well it is measured and how it may move."""

    marker_radius: float = 0.06  # m, of the ball
    acceleration: float = 0.12  # m/s², of a leader; more follows faster and smooths less
    radius_error: float = 0.25  # px, of the radius in a picture
    direction_error: float = 0.012  # rad, of pixel and attitude together
    least_error: float = 0.004  # m
    velocity_spread: float = 0.10  # m/s, of a marker seen for the first time
    velocity_time: float = 4.0  # s in which the velocity of a hidden marker is forgotten
    trust: float = 2.0  # s for which a hidden marker is predicted
    gate: float = 4.0  # standard deviations from the prediction that are believed
    gate_least: float = 0.25  # m, that are always believed
    strays: int = 4  # pictures in a row that contradict the prediction, and are then believed
    lowest: float = -0.3  # m, of a marker above the floor
    highest: float = 1.5  # m
    history: float = 0.6  # s of poses kept: pictures come late
    ahead: float = 0.05  # s that a picture's time stamp may lie ahead of the newest pose

    def __post_init__(self) -> None:
        require_positive(
            marker_radius=self.marker_radius, acceleration=self.acceleration, radius_error=self.radius_error,
            direction_error=self.direction_error, least_error=self.least_error,
            velocity_spread=self.velocity_spread, velocity_time=self.velocity_time, trust=self.trust,
            gate=self.gate, gate_least=self.gate_least, history=self.history,
        )  # fmt: skip
        require_range(1, 100, strays=self.strays)
        require_range(0.0, 1.0, ahead=self.ahead)
        require_range(self.lowest, 10.0, highest=self.highest)


class Pose(NamedTuple):
    """Where the trunk was: s, (3,) m in the odometry frame, (4,) quaternion x y z w."""

    time: float
    position: FloatArray
    quaternion: FloatArray


class Fix(NamedTuple):
    """One measured place of the marker.

    Attributes:
        position: (3,) m, odometry frame.
        distance: m, horizontal, from the camera.
        covariance: (2, 2) m², of the horizontal position.
    """

    position: FloatArray
    distance: float
    covariance: FloatArray


def ball_range(radius: float, focal: float, size: float) -> float:
    """Way (m) from the camera to the centre of a ball of radius `size` (m) that appears with `radius` (px).

    The outline is where rays touch the ball, so the sine of its angular radius counts, not the tangent:
    ``f R / r`` alone puts a ball of 6 cm 6 mm too near at 0.3 m.
    """
    return size * math.hypot(focal, radius) / radius


def direction_in_base(sighting: Sighting) -> FloatArray:
    """(3,) unit vector from the camera to the marker, base frame (the camera looks along x)."""
    right = (sighting.column - 0.5 * sighting.width) / sighting.focal
    down = (sighting.row - 0.5 * sighting.height) / sighting.focal
    return np.array([1.0, -right, -down]) / math.sqrt(1.0 + right * right + down * down)


class Target:
    """Follows the marker with a Kalman filter of constant velocity, horizontally; its height is averaged.

    How to call, once per tick: `remember(estimate)`; then `see(sighting)` when there is a new one; then
    `relative(estimate)` or `position_at(time)`. All times are the robot's clock.

    Args:
        config: of the marker and the filter.
        mounts: where the camera is.
    """

    def __init__(self, config: TargetConfig, mounts: SensorMounts) -> None:
        self._config = config
        self._camera = np.array(mounts.camera)
        self.reset()

    def reset(self) -> None:
        """Forget everything."""
        self._poses: deque[Pose] = deque()
        self.forget()

    def forget(self) -> None:
        """Forget the marker, not where the robot was."""
        self._state = np.zeros(4)
        self._covariance = np.zeros((4, 4))
        self._height = 0.0
        self._time = -math.inf
        self._seen = -math.inf
        self._strays = 0

    @property
    def known(self) -> bool:
        """True once the marker has been seen."""
        return math.isfinite(self._seen)

    def age(self, time: float) -> float:
        """Seconds since the marker was last seen; infinite before."""
        return time - self._seen

    def trusted(self, time: float) -> bool:
        """True while it is seen or may still be predicted."""
        return -self._config.ahead <= self.age(time) <= self._config.trust

    def remember(self, estimate: BodyState) -> None:
        """Keep the present pose: a picture tells of one that was."""
        if self._poses and estimate.time <= self._poses[-1].time:
            return
        self._poses.append(Pose(estimate.time, estimate.position.copy(), estimate.quaternion.copy()))
        while self._poses[0].time < estimate.time - self._config.history:
            self._poses.popleft()

    def pose_at(self, time: float) -> Pose | None:
        """The pose at a time of the last moments, between the two kept ones around it; else None."""
        if (
            not self._poses
            or not self._poses[0].time - 0.03 <= time <= self._poses[-1].time + self._config.ahead
        ):
            return None
        after = next((k for k, pose in enumerate(self._poses) if pose.time >= time), None)
        if after is None or after == 0:
            return self._poses[-1 if after is None else 0]
        first, last = self._poses[after - 1], self._poses[after]
        share = (time - first.time) / (last.time - first.time)
        sign = 1.0 if float(first.quaternion @ last.quaternion) >= 0.0 else -1.0
        quaternion = (1.0 - share) * sign * first.quaternion + share * last.quaternion
        return Pose(
            time, first.position + share * (last.position - first.position),
            quaternion / np.linalg.norm(quaternion),
        )  # fmt: skip

    def expected(self, time: float, focal: float, size: tuple[int, int]) -> tuple[float, float, float] | None:
        """Where in a picture the marker should be; None where that is not known well enough.

        Args:
            time: s, of the picture's exposure.
            focal: px, of the picture.
            size: px, its width and height.

        Returns:
            Column, row and radius as in a `Sighting`.
        """
        pose = self.pose_at(time)
        if pose is None or not self.trusted(time):
            return None
        rotation = rotation_from_quaternion(pose.quaternion)
        x, y, z = (rotation.T @ (self.position_at(time) - pose.position) - self._camera).tolist()
        far = math.hypot(x, y, z)
        if x < 0.1 or far <= self._config.marker_radius:
            return None
        radius = focal * math.tan(math.asin(self._config.marker_radius / far))
        return 0.5 * size[0] - focal * y / x, 0.5 * size[1] - focal * z / x, radius

    def fix(self, sighting: Sighting) -> Fix | None:
        """Where a sighting puts the marker; None where the pose at its time is not known any more."""
        pose = self.pose_at(sighting.time)
        if pose is None:
            return None
        config = self._config
        rotation = rotation_from_quaternion(pose.quaternion)
        far = ball_range(sighting.radius, sighting.focal, config.marker_radius)
        way = rotation @ direction_in_base(sighting) * far
        distance = math.hypot(way[0], way[1])
        along = far * config.radius_error * (sighting.width / 640.0) / sighting.radius + config.least_error
        across = far * config.direction_error + config.least_error
        ahead = way[:2] / max(distance, 1e-6)
        side = np.array([-ahead[1], ahead[0]])
        covariance = along**2 * np.outer(ahead, ahead) + across**2 * np.outer(side, side)
        return Fix(pose.position + rotation @ self._camera + way, distance, covariance)

    def see(self, sighting: Sighting, moves: bool = True) -> bool:
        """Take a sighting in; False where it is not believed.

        Args:
            sighting: of the newest picture.
            moves: whether the marker may move; one that stands has no velocity to be predicted with.
        """
        fix = self.fix(sighting)
        if fix is None or not self._config.lowest <= fix.position[2] <= self._config.highest:
            return False
        if not self.trusted(sighting.time):
            self._start(sighting.time, fix)
            return True
        if sighting.time < self._time:
            return False
        self._predict(sighting.time)
        spread = self._covariance[:2, :2] + fix.covariance
        offset = fix.position[:2] - self._state[:2]
        far = math.sqrt(max(0.0, float(offset @ np.linalg.solve(spread, offset))))
        if far > self._config.gate and math.hypot(*offset.tolist()) > self._config.gate_least:
            self._strays += 1
            if self._strays >= self._config.strays:
                self._start(sighting.time, fix)
                return True
            return False
        gain = self._covariance[:, :2] @ np.linalg.inv(spread)
        self._state += gain @ offset
        self._covariance -= gain @ self._covariance[:2, :]
        self._covariance = 0.5 * (self._covariance + self._covariance.T)
        if not moves:
            self._state[2:] = 0.0
            self._covariance[2:, :] = self._covariance[:, 2:] = 0.0
        self._height += 0.2 * (float(fix.position[2]) - self._height)
        self._seen, self._strays = sighting.time, 0
        return True

    def position_at(self, time: float) -> FloatArray:
        """(3,) m, odometry frame, predicted; NaN before the first sighting."""
        if not self.known:
            return np.full(3, np.nan)
        ahead = self._ahead(time)
        return np.array([*(self._state[:2] + ahead * self._state[2:]), self._height])

    @property
    def velocity(self) -> FloatArray:
        """(2,) m/s, odometry frame, as of the last sighting."""
        return self._state[2:].copy()

    def relative(self, estimate: BodyState) -> Relative | None:
        """The marker from the camera as it is now; None before the first sighting."""
        if not self.known:
            return None
        camera = estimate.position + rotation_from_quaternion(estimate.quaternion) @ self._camera
        x, y = (self.position_at(estimate.time) - camera)[:2].tolist()
        distance = math.hypot(x, y)
        cos, sin = (x / distance, y / distance) if distance > 1e-6 else (1.0, 0.0)
        fade = self._fade(estimate.time)
        vx, vy = (fade * self._state[2:]).tolist()
        return Relative(
            distance, wrap_angle(math.atan2(y, x) - float(estimate.rpy[2])),
            vx * cos + vy * sin, vy * cos - vx * sin,
        )  # fmt: skip

    def _start(self, time: float, fix: Fix) -> None:
        self._state = np.array([fix.position[0], fix.position[1], 0.0, 0.0])
        self._covariance = np.zeros((4, 4))
        self._covariance[:2, :2] = fix.covariance
        self._covariance[2:, 2:] = self._config.velocity_spread**2 * np.eye(2)
        self._height = float(fix.position[2])
        self._time = self._seen = time
        self._strays = 0

    def _fade(self, time: float) -> float:
        """Share of the velocity that is left of a hidden marker: leaders turn, and stop."""
        return math.exp(-max(0.0, time - self._seen) / self._config.velocity_time)

    def _ahead(self, time: float) -> float:
        """Seconds for which the velocity moves the marker on until `time`; it fades while unseen."""
        hidden = max(0.0, min(time, self._seen + 4.0 * self._config.trust) - self._time)
        return self._config.velocity_time * (1.0 - math.exp(-hidden / self._config.velocity_time))

    def _predict(self, time: float) -> None:
        dt = time - self._time
        move = np.eye(4)
        move[0, 2] = move[1, 3] = dt
        push = np.array([[dt**4 / 4.0, dt**3 / 2.0], [dt**3 / 2.0, dt**2]]) * self._config.acceleration**2
        self._state = move @ self._state
        self._covariance = move @ self._covariance @ move.T + np.kron(push, np.eye(2))
        self._time = time
