"""Which law leads: the field with a bias to what is new, the way to a waypoint, or the marker."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from bluefoot_mpc.model.parameters import SensorMounts
from bluefoot_mpc.navigation import potential_field, route
from bluefoot_mpc.navigation.config import NavigationConfig
from bluefoot_mpc.navigation.explore import Explorer
from bluefoot_mpc.navigation.limits import Motion
from bluefoot_mpc.navigation.marker_task import MarkerTask, MarkerWish
from bluefoot_mpc.navigation.plan import GoalWay, prepare
from bluefoot_mpc.navigation.potential_field import Field, Pace, PotentialField
from bluefoot_mpc.navigation.scan import LevelScan
from bluefoot_mpc.navigation.surroundings import Surroundings
from bluefoot_mpc.navigation.waypoints import Waypoints
from bluefoot_mpc.types import BodyState, FloatArray, Guide, Guided, GuideTask, SensorFrame


class Lead(NamedTuple):
    """What the leading law wants: which it is, the motion before the guard, and why in few words."""

    guided: Guided
    motion: Motion
    reason: str = ""


class Leading:
    """Holds the laws and what they remember, and asks the one that the task is for.

    Attributes:
        field: of the newest sweep.
        wish: what the marker asks; None without such a task.
        waypoints: list and place on it.

    Args:
        config: of each part.
        mounts: where the sensors are.
    """

    def __init__(self, config: NavigationConfig, mounts: SensorMounts) -> None:
        self._config = config
        prepare()
        self._potential = PotentialField(config.field)
        self._explorer = Explorer(config.explore, config.plan)
        self._goal_way = GoalWay(config.plan, every=0.5, tolerance=0.6)
        self._marker = MarkerTask(config.marker, mounts)
        self.waypoints = Waypoints(config.waypoints, config.plan)
        self.reset()

    def reset(self) -> None:
        """Forget everything."""
        self._explorer.reset()
        self._goal_way.reset()
        self._marker.reset()
        self.waypoints.reset()
        self.field = Field(np.zeros(2), 0.0)
        self.wish: MarkerWish | None = None
        self.rest()
        self._task: GuideTask | None = None

    def resume(self, pause: float) -> None:
        """Leave out a time (s) in which the robot was not asked: nothing was tried in it."""
        if self._task is GuideTask.GOTO:
            self.waypoints.resume(pause)

    def rest(self) -> None:
        """Start from standing."""
        self._pace = Pace(0.0, 0.0)

    def look(self, guide: Guide, frame: SensorFrame, estimate: BodyState, dt: float) -> None:
        """What is done on each tick: the list of waypoints, the camera.

        Args:
            guide: the task.
            frame: newest sensor frame.
            estimate: estimated state of the robot.
            dt: s, command period.
        """
        if guide.task is not self._task:
            self._explorer.reset()
            self._goal_way.reset()
            self._marker.reset()
            self.waypoints.reset()
            self._task = guide.task
        self.wish = None
        if guide.task is GuideTask.GOTO:
            self.waypoints.take(guide.waypoints, frame.time)
        elif guide.task is not GuideTask.WANDER:
            self.wish = self._marker.step(guide, frame, estimate, dt)

    def search(self, guide: Guide, around: Surroundings, time: float) -> None:
        """Look for ways over the map, where that is due: not on the tick that has a new sweep.

        Args:
            guide: the task.
            around: what the robot knows of its surroundings.
            time: s.
        """
        if guide.task is GuideTask.GOTO:
            self.waypoints.step(around.grid, around.pose, time, guide.speed)
        elif self.wish is not None and self.wish.goal is not None:
            self._goal_way.step(self.wish.goal, around.grid, around.pose, time)
        elif self.wish is None or self.wish.share < 1.0:
            self._explorer.step(around.grid, around.pose, time)

    def give_up(self, time: float) -> None:
        """Leave the present goal of exploring alone: the robot got stuck on its way there."""
        self._explorer.give_up(time)

    def step(self, guide: Guide, around: Surroundings, scan: LevelScan) -> Lead:
        """Ask the law that the task is for; once per sweep.

        Args:
            guide: the task.
            around: what the robot knows of its surroundings.
            scan: the new sweep.
        """
        config = self._config.field
        self.field = self._potential.step(scan.bearing, scan.distance)
        self._pace = potential_field.advance(self._pace, self.field, config)
        if guide.task is GuideTask.WANDER:
            return Lead(Guided.FIELD, self._onwards(guide, around))
        if guide.task is GuideTask.GOTO:
            return self._to_waypoint(guide, around)
        return self._to_marker(guide, around)

    def _onwards(self, guide: Guide, around: Surroundings) -> Motion:
        """The field, with a bias to what is new."""
        way = self._explorer.way
        if not len(way):
            return Motion(min(self._pace.speed, guide.speed), 0.0, self._pace.yaw_rate)
        return self._along(way, guide.speed, around)

    def _along(self, way: FloatArray, speed: float, around: Surroundings) -> Motion:
        place = route.ahead_on(way, around.pose, self._config.route.lookahead)
        return route.towards(place, self.field.force, speed, self._config.route)

    def _to_waypoint(self, guide: Guide, around: Surroundings) -> Lead:
        goal, reason = self.waypoints.goal, self.waypoints.reason
        if goal is None:
            return Lead(Guided.ARRIVED, Motion(), reason or ("" if len(guide.waypoints) else "no waypoints"))
        if not np.isfinite(goal).all():
            return Lead(Guided.WAYPOINT, Motion(), reason)
        return Lead(Guided.WAYPOINT, self._to_goal(goal, self.waypoints.way, guide.speed, around), reason)

    def _to_goal(self, goal: FloatArray, way: FloatArray, speed: float, around: Surroundings) -> Motion:
        """Along a way, and over its last piece without turning."""
        config = self._config.route
        place = route.in_robot(around.pose, *goal.tolist())
        far = math.hypot(*place)
        if far <= config.glide:
            return route.gliding_to(place, speed, config)
        if not len(way):
            return Motion(0.0, 0.0, config.look_rate)  # what has gone meanwhile may be behind
        slow = min(speed, config.glide_gain * far)
        return self._along(way, slow, around)

    def _to_marker(self, guide: Guide, around: Surroundings) -> Lead:
        wish = self.wish
        if wish is None:
            return Lead(Guided.SEARCH, Motion())
        motion, share = wish.motion, wish.share
        if wish.guided is Guided.MARKER and guide.task is GuideTask.APPROACH and self._detour(around):
            share = 0.0
        if share < 1.0:
            lidar = self._towards_marker(wish.goal, guide, around)
            motion = Motion(*(share * a + (1.0 - share) * b for a, b in zip(motion, lidar, strict=True)))
        return Lead(wish.guided, motion, wish.reason)

    def _detour(self, around: Surroundings) -> bool:
        """True where the way to the marker leads around something: the camera sees it, but not a way."""
        way = self._goal_way.way
        if len(way) < 2:
            return False
        steps = np.diff(way, axis=0)
        length = float(np.hypot(steps[:, 0], steps[:, 1]).sum())
        straight = math.dist(way[-1], around.pose[:2])
        return length > self._config.marker.detour * straight + self._config.marker.detour_least

    def _towards_marker(self, goal: FloatArray | None, guide: Guide, around: Surroundings) -> Motion:
        if goal is None:
            return self._onwards(guide, around)
        way = self._goal_way.way if len(self._goal_way.way) else goal[None]
        return self._along(way, guide.speed, around)
