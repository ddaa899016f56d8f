"""How rough ground is crossed: sweep it, map it, plan a way, walk it, sweep again until the goal line."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np

from bluefoot_mpc.geometry import rotation_from_quaternion
from bluefoot_mpc.model.legs import LegGeometry
from bluefoot_mpc.model.parameters import RobotParameters
from bluefoot_mpc.navigation.crossing.config import CrossingConfig
from bluefoot_mpc.navigation.crossing.follower import FeetCentre, Steering, steer
from bluefoot_mpc.navigation.crossing.mapper import Mapper, Thought
from bluefoot_mpc.navigation.crossing.sweeper import Sweeper
from bluefoot_mpc.navigation.crossing.thinker import Thinker
from bluefoot_mpc.terrain.ground import Ground
from bluefoot_mpc.types import (
    BodyState,
    CrossingPhase,
    CrossingReport,
    FloatArray,
    Guide,
    GuideTask,
    SensorFrame,
    TrunkPose,
)

_STILL = np.zeros(2)
_NOTHING = np.zeros((0, 3))
LEANS = (
    "the trunk leans as nobody told it to: the robot fell, or lies on something; "
    "set it upright and give it a new task"
)
_PAUSE = 0.3
"""s without a tick, after which a sweep begins anew: the robot was told to do something else."""


@dataclass(frozen=True, kw_only=True, slots=True)
class CrossingDecision:
    """What the crossing wants of the controller on this tick.

    Attributes:
        velocity: (2,) m/s, forward and left in the heading frame.
        yaw_rate: rad/s, left positive.
        trunk: wanted offset of the trunk.
        report: what it saw and why.
    """

    velocity: FloatArray
    yaw_rate: float
    trunk: TrunkPose
    report: CrossingReport


@dataclass(frozen=True, kw_only=True, slots=True)
class FeetState:
    """How the feet fare, as of the previous tick.

    Attributes:
        resting: the gait rests, all feet stand.
        waiting: why a foot has nowhere to step; empty while all have.
    """

    resting: bool
    waiting: str = ""


class _Stage(StrEnum):
    """What goes on within a phase."""

    SETTLE = "settle"
    LOOK = "look"
    THINK = "think"
    WALK = "walk"
    STAY = "stay"


class Crosser:
    """Crosses rough ground, or only looks at it.

    Attributes:
        ground: what to step on; None before the first map.

    Args:
        config: of each part.
        robot: where the LIDAR is, and how thick the feet are.
    """

    def __init__(self, config: CrossingConfig, robot: RobotParameters) -> None:
        self._config = config
        legs = LegGeometry.from_parameters(robot)
        self._first_sweeper = Sweeper(config.first_sweep, robot.sensors, config.cloud, legs)
        self._later_sweeper = Sweeper(config.sweep, robot.sensors, config.cloud, legs)
        self._mapper = Mapper(config, robot)
        self._thinker: Thinker[Thought] = Thinker(config.think_ticks)
        self._centre = FeetCentre(config.follower.smoothing)
        self.reset()

    def reset(self) -> None:
        """Forget everything: the state after ``__init__``, bit for bit."""
        self._mapper.reset()
        self.ground: Ground | None = None
        self.begin()

    def begin(self) -> None:
        """Forget the task, not the ground: what comes next is a new one."""
        self._sweeper = self._first_sweeper
        self._sweeper.reset()
        self._thinker.reset()
        self._centre.reset()
        self._mapper.forget_start()
        self._stage = _Stage.SETTLE
        self._thought: Thought | None = None
        self._origin: FloatArray | None = None
        self._place = _STILL
        self._furthest = 0.0
        self._fruitless = 0
        self._sweeps = 0
        self._stood = self._waited = self._since_thought = self._stalled = self._leant = 0.0
        self._pitch = 0.0
        self._stalled_at = _STILL
        self._reason = ""
        self._arrived = False
        self._stepped = -math.inf
        self._named: tuple[float, ...] | None = None

    def step(
        self, guide: Guide, frame: SensorFrame, estimate: BodyState, feet: FeetState, dt: float
    ) -> CrossingDecision:
        """One tick.

        Args:
            guide: the task, ``cross`` or ``sweep``.
            frame: newest sensor frame.
            estimate: estimated state of the robot.
            feet: how the feet fared on the last tick.
            dt: s.
        """
        self._begin_where_the_goal_is_new(guide)
        places = foot_places(estimate)
        if not np.isfinite(places).all():
            return self._stand(
                CrossingPhase.BLOCKED,
                reason="the estimate of the robot's pose is no number: start again from a stand",
            )
        self._place = self._centre.step(places, dt)
        if self._origin is None:
            self._origin = self._place
        if self._stage is _Stage.LOOK and estimate.time - self._stepped > _PAUSE:
            self._stage, self._stood = _Stage.SETTLE, 0.0  # half a sweep of before is none
        self._stepped = estimate.time
        if self._leans(estimate, dt) and self._stage is not _Stage.STAY:
            self._stage, self._reason = _Stage.STAY, LEANS
        if self._stage is _Stage.SETTLE:
            return self._settle(feet, places, estimate, dt)
        if self._stage is _Stage.LOOK:
            return self._look(guide, frame, estimate, dt)
        if self._stage is _Stage.THINK:
            return self._think(guide)
        if self._stage is _Stage.WALK:
            return self._walk(guide, frame, estimate, feet, dt)
        return self._stand(CrossingPhase.ARRIVED if self._arrived else CrossingPhase.BLOCKED)

    def _leans(self, estimate: BodyState, dt: float) -> bool:
        """True where the trunk has been far from its wanted tilt for long: no place to walk on from."""
        roll, pitch, _ = np.degrees(estimate.rpy).tolist()
        leans = max(abs(roll), abs(pitch - math.degrees(self._pitch))) > self._config.lean_deg
        self._leant = self._leant + dt if leans else 0.0
        return self._leant > self._config.lean_time

    def _begin_where_the_goal_is_new(self, guide: Guide) -> None:
        """Another goal is another task: whoever has arrived, or was blocked, sets out again."""
        named = tuple(guide.waypoints[-1].tolist()) if len(guide.waypoints) else ()
        if self._named is not None and named != self._named:
            self.begin()
        self._named = named

    def _settle(
        self, feet: FeetState, places: FloatArray, estimate: BodyState, dt: float
    ) -> CrossingDecision:
        """Stand until all feet rest, then begin to sweep."""
        self._stood = self._stood + dt if feet.resting else 0.0
        if self._stood >= self._config.settle_time:
            self._mapper.stand_on(places, estimate.time)
            self._mapper.begin_sweep()
            self._sweeper = self._later_sweeper if self._sweeps else self._first_sweeper
            self._sweeper.begin(estimate.time, self._mapper.ahead(self._pose(estimate)))
            self._stage = _Stage.LOOK
        return self._stand(CrossingPhase.SWEEP)

    def _look(self, guide: Guide, frame: SensorFrame, estimate: BodyState, dt: float) -> CrossingDecision:
        """Sweep; afterwards think about what was seen."""
        seen = self._sweeper.step(frame, estimate, dt)
        self._mapper.add(seen.points, estimate)
        decision = self._stand(CrossingPhase.SWEEP, trunk=seen.trunk, points=seen.points, level=seen.level)
        if seen.done:
            self._sweeps += 1
            self._reason = seen.reason
            if guide.task is GuideTask.CROSS and not self._mapper.has_seen:
                # What is taken to be even around the start is no reason to walk blind.
                self._look_again(seen.reason or "the sweep met no ground")
                return decision
            self._stage = _Stage.THINK
            self._thinker.start(self._mapper.thinking(self._pose(estimate), self._goal(guide)))
        return decision

    def _think(self, guide: Guide) -> CrossingDecision:
        """Stand until the way is planned."""
        thought = self._thinker.step()
        if thought is None:
            if self._thinker.failure:
                self._look_again(self._why_no_thought())
            return self._stand(CrossingPhase.THINK)
        self._take(thought)
        if guide.task is GuideTask.SWEEP:
            reason = self._reason
            self._arrive()
            self._reason = reason
            return self._stand(CrossingPhase.ARRIVED, thought=thought)
        self._reason = "; ".join(filter(None, (self._reason, thought.route.reason)))
        if self._is_there(self._goal(guide)):
            self._arrive()
        elif len(thought.route.poses) > 1:
            self._stage, self._waited, self._since_thought = _Stage.WALK, 0.0, 0.0
            self._stalled_at, self._stalled = self._place, 0.0
        else:
            self._look_again(self._reason or "no way was found")
        return self._stand(CrossingPhase.THINK, thought=thought)

    def _walk(
        self, guide: Guide, frame: SensorFrame, estimate: BodyState, feet: FeetState, dt: float
    ) -> CrossingDecision:
        """Follow the way until its end, the goal line, or a place where no foot can step."""
        goal = self._goal(guide)
        thought, points = self._looked_on_the_way(frame, estimate, goal, dt)
        if thought is not None and len(thought.route.poses) < 2:
            self._look_again(thought.route.reason or "no way was found")
            return self._stand(CrossingPhase.WALK, points=points, thought=thought)
        steering = self._steer(guide, estimate)
        self._waited = self._waited + dt if feet.waiting else 0.0
        if self._is_there(goal):
            self._arrive()
        elif steering.left == 0.0:
            self._look_again(self._reason)
        elif self._is_stuck(dt):
            self._look_again(
                "no progress: something holds the robot, or its feet find no places; free it or clear the way"
            )
        elif self._waited > self._config.patience:
            self._look_again(feet.waiting)
        elif self._thinker.failure:
            self._look_again(self._why_no_thought())
        report = self._report(CrossingPhase.WALK, points=points, thought=thought)
        trunk = self._mapper.trunk_on_the_way(estimate.time)
        self._pitch = float(trunk.rpy[1])
        report = replace(report, speed=float(np.hypot(*steering.velocity)), pitch=self._pitch)
        return CrossingDecision(
            velocity=steering.velocity, yaw_rate=steering.yaw_rate, trunk=trunk, report=report
        )

    def _looked_on_the_way(
        self, frame: SensorFrame, estimate: BodyState, goal: FloatArray, dt: float
    ) -> tuple[Thought | None, FloatArray]:
        """Map and plan while walking, where that is wanted: what was newly thought, and what was seen."""
        if not self._config.incremental:
            return None, _NOTHING
        points = self._mapper.look(frame, estimate)
        thought = self._thinker.step()
        if thought is not None:
            self._take(thought)
        self._since_thought += dt
        if self._since_thought >= self._config.rethink_time and not self._thinker.busy:
            self._since_thought = 0.0
            self._thinker.start(self._mapper.thinking(self._pose(estimate), goal))
        return thought, points

    def _why_no_thought(self) -> str:
        return f"mapping and planning failed: {self._thinker.failure}"

    def _take(self, thought: Thought) -> None:
        self._thought, self.ground = thought, thought.ground
        self._mapper.take(thought)

    def _steer(self, guide: Guide, estimate: BodyState) -> Steering:
        thought, config = self._thought, self._config.follower
        if thought is None:
            return Steering(_STILL, 0.0, 0.0)
        route = thought.route.poses
        nearest = int(np.argmin(np.hypot(*(route[:, :2] - self._place).T)))
        speed = guide.speed * float(thought.pace[nearest])
        return steer(route, self._place, float(estimate.rpy[2]), speed, config)

    def _is_stuck(self, dt: float) -> bool:
        """True where the robot has been at one place for long."""
        if float(np.hypot(*(self._place - self._stalled_at))) > self._config.progress:
            self._stalled_at, self._stalled = self._place, 0.0
        self._stalled += dt
        return self._stalled > self._config.stall

    def _arrive(self) -> None:
        self._stage, self._arrived, self._reason = _Stage.STAY, True, ""

    def _look_again(self, reason: str) -> None:
        """Sweep again; after some times without getting on, stay."""
        self._reason = reason
        progress = float(np.hypot(*(self._place - (self._place if self._origin is None else self._origin))))
        if progress > self._furthest + self._config.progress:
            self._furthest, self._fruitless = progress, 0
        else:
            self._fruitless += 1
        self._stage, self._stood = _Stage.SETTLE, 0.0
        if self._fruitless >= self._config.attempts:
            self._stage = _Stage.STAY

    def _goal(self, guide: Guide) -> FloatArray:
        """(2,) m, where to in the odometry frame; where the robot is already where none was named."""
        if len(guide.waypoints):
            return np.asarray(guide.waypoints[-1], dtype=np.float64)
        return self._place

    def _is_there(self, goal: FloatArray) -> bool:
        """True at the line through the goal, across the way from where the task began, and beyond."""
        origin = self._place if self._origin is None else self._origin
        way = goal - origin
        length = float(np.hypot(*way))
        left = float((goal - self._place) @ way) / length if length > 0.0 else 0.0
        return left <= self._config.follower.tolerance

    def _pose(self, estimate: BodyState) -> FloatArray:
        """(3,) m, m, rad: where the robot is over the ground, and its heading."""
        return np.array([*self._place.tolist(), float(estimate.rpy[2])])

    def _stand(
        self, phase: CrossingPhase, *, trunk: TrunkPose | None = None, points: FloatArray = _NOTHING,
        level: int = -1, thought: Thought | None = None, reason: str = "",
    ) -> CrossingDecision:  # fmt: skip
        trunk = trunk or TrunkPose()
        report = replace(self._report(phase, points=points, thought=thought), level=level)
        self._pitch = float(trunk.rpy[1])
        report = replace(report, pitch=self._pitch, reason=reason or report.reason)
        return CrossingDecision(velocity=_STILL, yaw_rate=0.0, trunk=trunk, report=report)

    def _report(self, phase: CrossingPhase, *, points: FloatArray, thought: Thought | None) -> CrossingReport:
        return CrossingReport(
            phase=phase, points=np.round(points, 4), sweeps=self._sweeps, reason=self._reason,
            ground=thought.ground.map if thought else None,
            route=thought.route.poses if thought else _NOTHING,
            drift=thought.drift if thought else 0.0,
        )  # fmt: skip


def foot_places(estimate: BodyState) -> FloatArray:
    """(4, 3) m, foot points in the odometry frame."""
    turned = estimate.foot_position_in_base @ rotation_from_quaternion(estimate.quaternion).T
    return np.asarray(turned + estimate.position)
