"""Out of a corner: who should move and does not makes room, turns, backs off and steps aside, in turn."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass

from bluefoot_mpc.geometry import wrap_angle
from bluefoot_mpc.navigation.limits import Motion
from bluefoot_mpc.navigation.pose import Pose
from bluefoot_mpc.settings import require_positive


@dataclass(frozen=True, kw_only=True, slots=True)
class EscapeConfig:
    """When the robot counts as stuck, and what it does then."""

    patience: float = 4.0  # s without motion
    least_speed: float = 0.008  # m/s; who wants less does not want to move
    least_turn: float = 0.05  # rad/s; likewise
    stall: float = 0.5  # s in which the guard lets nothing pass
    distance: float = 0.05  # m, that count as motion
    turn_deg: float = 10.0  # degrees, that do
    away_time: float = 2.0  # s of making room
    turn_time: float = 3.0  # s of turning in place
    back_time: float = 2.5  # s of backing off
    side_time: float = 2.0  # s of stepping aside
    yaw_rate: float = 0.45  # rad/s
    back_speed: float = 0.06  # m/s
    side_speed: float = 0.05  # m/s
    enough_deg: float = 50.0  # degrees turned that end the escape
    enough: float = 0.12  # m moved that do

    def __post_init__(self) -> None:
        require_positive(
            patience=self.patience, least_speed=self.least_speed, least_turn=self.least_turn,
            stall=self.stall, distance=self.distance, turn_deg=self.turn_deg,
            away_time=self.away_time, turn_time=self.turn_time, back_time=self.back_time,
            side_time=self.side_time, yaw_rate=self.yaw_rate, back_speed=self.back_speed,
            side_speed=self.side_speed,
            enough_deg=self.enough_deg, enough=self.enough,
        )  # fmt: skip

    def is_motion(self, motion: Motion) -> bool:
        """True where something is wanted that should be seen."""
        fast = math.hypot(motion.x, motion.y) > self.least_speed
        return fast or abs(motion.yaw_rate) > self.least_turn


class StuckWatch:
    """Notices that the robot stays where it is.

    Args:
        config: what counts as motion.
    """

    def __init__(self, config: EscapeConfig) -> None:
        self._config = config
        self._poses: deque[tuple[float, Pose, Motion]] = deque()

    def reset(self) -> None:
        """Forget everything: the robot may stay for a while from now."""
        self._poses.clear()

    def rests(self, pose: Pose, time: float, wanted: Motion) -> float:
        """How long the robot has stayed within the bounds around where it is, though it should not have (s).

        Args:
            pose: of the robot.
            time: s.
            wanted: motion since the last call; zero is returned until all of it adds up to twice the bounds.
        """
        config, asked = self._config, Motion()
        if self._poses:
            last, _, asked = self._poses[-1]
            asked = Motion(*(a + (time - last) * b for a, b in zip(asked, wanted, strict=True)))
        while self._poses and moved(self._poses[0][1], pose, config):
            self._poses.popleft()
        self._poses.append((time, pose, asked))
        since, _, before = self._poses[0]
        x, y, turn = (a - b for a, b in zip(asked, before, strict=True))
        far = math.hypot(x, y) > 2.0 * config.distance or abs(turn) > 2.0 * math.radians(config.turn_deg)
        return time - since if far else 0.0


def moved(start: Pose, now: Pose, config: EscapeConfig) -> bool:
    """True where two poses are farther apart than what counts as motion."""
    turn = abs(wrap_angle(now.yaw - start.yaw))
    return math.dist(start[:2], now[:2]) > config.distance or turn > math.radians(config.turn_deg)


class Escape:
    """The way out of a corner, a sequence of simple motions.

    Args:
        config: motions and times.
    """

    def __init__(self, config: EscapeConfig) -> None:
        self._config = config
        self._start: Pose | None = None
        self._since = 0.0
        self._side = 1.0

    @property
    def active(self) -> bool:
        """True while the sequence lasts."""
        return self._start is not None

    def reset(self) -> None:
        """Forget everything."""
        self._start, self._since, self._side = None, 0.0, 1.0

    def begin(self, pose: Pose, time: float, openness: float) -> None:
        """Begin, turning to the more open side (`openness` positive: the left)."""
        self._start, self._since = pose, time
        self._side = 1.0 if openness >= 0.0 else -1.0

    def step(self, pose: Pose, time: float, away: Motion) -> Motion:
        """What to do now; ends itself once the robot has come away.

        Args:
            pose: of the robot.
            time: s.
            away: the motion that makes most room.
        """
        config, start = self._config, self._start
        if start is None:
            return Motion()
        turned = abs(wrap_angle(pose.yaw - start.yaw))
        gone = math.dist(pose[:2], start[:2])
        if turned > math.radians(config.enough_deg) or gone > config.enough:
            self._start = None
            return Motion()
        return self._phase(time - self._since, away)

    def _phase(self, lasted: float, away: Motion) -> Motion:
        """The motion after some seconds of the sequence; every second round is to the other side."""
        config = self._config
        cycle = config.away_time + 2.0 * config.turn_time + config.back_time + config.side_time
        rounds, left = divmod(lasted, cycle)
        side = self._side if int(rounds) % 2 == 0 else -self._side
        turn = Motion(0.0, 0.0, side * config.yaw_rate)
        for length, motion in (
            (config.away_time, away if any(away) else turn),
            (config.turn_time, turn),
            (config.back_time, Motion(-config.back_speed, 0.0, 0.0)),
            (config.turn_time, Motion(0.0, 0.0, -side * config.yaw_rate)),
        ):
            if left < length:
                return motion
            left -= length
        return Motion(0.0, side * config.side_speed, 0.0)
