"""Looking for the marker: a look around now and then, and where it was lost."""

from __future__ import annotations

import enum
import math
from dataclasses import dataclass

from bluefoot_mpc.geometry import wrap_angle
from bluefoot_mpc.navigation.limits import Motion
from bluefoot_mpc.settings import require_positive, require_range
from bluefoot_mpc.types import BodyState, FloatArray

MOVES = 0.01
"""m/s across the line of sight; slower, a marker has no side to which it went."""


@dataclass(frozen=True, kw_only=True, slots=True)
class SearchConfig:
    """How the robot looks for a marker."""

    turn_rate: float = 0.5  # rad/s, of a look around
    look_turn_deg: float = 360.0  # degrees, of a look around
    wander_time: float = 14.0  # s between two looks around, at least
    wander_distance: float = 1.3  # m between two looks around, at least
    turn_first_deg: float = 25.0  # degrees to where it was lost, beyond which the robot turns in place
    arrived: float = 0.9  # m from where it was lost that is near enough
    chase_time: float = 12.0  # s, at most, on the way to where it was lost

    def __post_init__(self) -> None:
        require_positive(
            turn_rate=self.turn_rate, wander_time=self.wander_time, wander_distance=self.wander_distance,
            arrived=self.arrived, chase_time=self.chase_time,
        )  # fmt: skip
        require_range(30.0, 1440.0, look_turn_deg=self.look_turn_deg)
        require_range(1.0, 180.0, turn_first_deg=self.turn_first_deg)


class Phase(enum.StrEnum):
    """What a search does."""

    LOOK = "looking around"
    WANDER = "wandering"
    TURN = "turning to where the marker was lost"
    CHASE = "going to where the marker was lost"


@dataclass(frozen=True, kw_only=True, slots=True)
class SearchWish:
    """What a search wants of this tick.

    Attributes:
        phase: what it does.
        motion: in place of the field's; None: the field leads, or the goal where there is one.
        goal: (2,) m in the odometry frame to go to like a waypoint; None without one.
    """

    phase: Phase
    motion: Motion | None = None
    goal: FloatArray | None = None


class Search:
    """A search for the marker, from tick to tick while it is not seen.

    A look around in place first, then wandering with a look around every so often. A marker that was lost:
    turn to where it is supposed to be, go there, look around, and then the same. Every phase ends by itself.

    How to call: `reset()` whenever the marker is in view, `step(...)` on each tick without it.

    Args:
        config: times, distances and rates.
    """

    def __init__(self, config: SearchConfig) -> None:
        self._config = config
        self.reset()

    def reset(self) -> None:
        """Start afresh at the next step."""
        self._phase: Phase | None = None
        self._since = 0.0
        self._turned = 0.0
        self._yaw = 0.0
        self._sense = 1.0
        self._walked = 0.0
        self._place = (0.0, 0.0)
        self._drift = 0.0

    def step(self, estimate: BodyState, lost: FloatArray | None, drift: float = 0.0) -> SearchWish:
        """One tick.

        Args:
            estimate: where the robot is.
            lost: (3,) or (2,) m in the odometry frame, where the marker is supposed to be; None unknown.
            drift: m/s, to the left across the line of sight, of the marker when it was lost.
        """
        self._drift = drift
        if self._phase is None:
            self._enter(Phase.LOOK if lost is None else Phase.TURN, estimate, lost)
        self._track(estimate)
        if self._done(estimate, lost):
            self._enter(self._next(), estimate, lost)
        phase = self._phase or Phase.LOOK
        if phase is Phase.LOOK:
            return SearchWish(phase=phase, motion=Motion(0.0, 0.0, self._sense * self._config.turn_rate))
        if phase is Phase.TURN:
            rate = min(1.0, 2.0 * abs(_bearing(estimate, lost))) * self._config.turn_rate
            return SearchWish(phase=phase, motion=Motion(0.0, 0.0, self._sense * max(rate, 0.15)))
        if phase is Phase.CHASE and lost is not None:
            return SearchWish(phase=phase, goal=lost[:2])
        return SearchWish(phase=Phase.WANDER)

    def _enter(self, phase: Phase, estimate: BodyState, lost: FloatArray | None) -> None:
        self._phase, self._since = phase, estimate.time
        self._turned, self._walked = 0.0, 0.0
        self._yaw = float(estimate.rpy[2])
        self._place = (float(estimate.position[0]), float(estimate.position[1]))
        if lost is not None:
            # It went to that side, or left the view there: it is more likely there than behind.
            ahead = phase is Phase.LOOK and abs(self._drift) > MOVES
            self._sense = math.copysign(1.0, self._drift if ahead else _bearing(estimate, lost))

    def _track(self, estimate: BodyState) -> None:
        yaw = float(estimate.rpy[2])
        self._turned += wrap_angle(yaw - self._yaw)
        self._yaw = yaw
        x, y = estimate.position[:2].tolist()
        self._walked = max(self._walked, math.hypot(x - self._place[0], y - self._place[1]))

    def _done(self, estimate: BodyState, lost: FloatArray | None) -> bool:
        config, lasted = self._config, estimate.time - self._since
        if self._phase is Phase.LOOK:
            # Time too: a robot that something keeps from turning must not look for ever.
            whole = math.radians(config.look_turn_deg)
            return abs(self._turned) >= whole or lasted > 2.0 * whole / config.turn_rate
        if self._phase is Phase.TURN:
            ahead = abs(_bearing(estimate, lost)) < math.radians(config.turn_first_deg)
            return ahead or lasted > 2.0 * math.pi / config.turn_rate
        if self._phase is Phase.CHASE:
            near = lost is None or _distance(estimate, lost) < config.arrived
            return near or lasted > config.chase_time
        long = lasted > config.wander_time and self._walked > config.wander_distance
        return long or lasted > 3.0 * config.wander_time

    def _next(self) -> Phase:
        after = {Phase.TURN: Phase.CHASE, Phase.CHASE: Phase.LOOK, Phase.LOOK: Phase.WANDER}
        return after.get(self._phase or Phase.LOOK, Phase.LOOK)


def _bearing(estimate: BodyState, place: FloatArray | None) -> float:
    """Bearing (rad) from the robot's heading to a place, left positive; 0 without a place."""
    if place is None:
        return 0.0
    x, y = (place[:2] - estimate.position[:2]).tolist()
    return wrap_angle(math.atan2(y, x) - float(estimate.rpy[2]))


def _distance(estimate: BodyState, place: FloatArray) -> float:
    """Way (m) on the floor from the trunk to a place."""
    x, y = (place[:2] - estimate.position[:2]).tolist()
    return math.hypot(x, y)
