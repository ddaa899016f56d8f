"""What a station asks the robot to find its own way for: the list of waypoints, and the task in force.

Orders of MAVLink's ``common`` dialect: MAV_CMD_MISSION_START goes through the
list that was uploaded, MAV_CMD_USER_1 starts the tasks that have no list,
MAV_CMD_DO_CHANGE_SPEED says how fast the way to waypoints may be, and
MAV_CMD_DO_PAUSE_CONTINUE 1 goes on with what was interrupted.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from pymavlink.dialects.v20 import common as mavlink

from bluefoot_mpc.io.station.protocol import ACCEPTED, DENIED, FAILED, TASKS
from bluefoot_mpc.io.station.steps import NEAREST
from bluefoot_mpc.types import FloatArray, Guide, Guided, GuideTask, Telemetry

SPEED_MAX = 1.0
"""m/s; more is not asked for in earnest. What the robot really does is far below."""
DISTANCE_MAX = 5.0
"""m."""
NEAR = 0.2
"""m; a waypoint that is passed from farther away was given up."""
_DEFAULT = Guide(task=GuideTask.GOTO)
_GROUND_SPEED = float(mavlink.SPEED_TYPE_GROUNDSPEED)
_START = int(mavlink.MAV_CMD_MISSION_START)
_TASK = int(mavlink.MAV_CMD_USER_1)
_SPEED = int(mavlink.MAV_CMD_DO_CHANGE_SPEED)
_PAUSE_CONTINUE = int(mavlink.MAV_CMD_DO_PAUSE_CONTINUE)
ORDERS = (_START, _TASK, _SPEED)


@dataclass(slots=True)
class TaskBoard:
    """The waypoints that were uploaded, and the task that the robot is at.

    Attributes:
        points: (n, 2) m, waypoints in the odometry frame.
        speed: m/s, at most, on the way to waypoints.
        guide: the task in force; None while the robot is told where to go.
        missed: numbers of the waypoints that were given up since the start.
        refusal: why the last order was denied, where its numbers alone do not say it; else empty.
    """

    points: FloatArray = field(default_factory=lambda: np.zeros((0, 2)))
    speed: float = _DEFAULT.speed
    guide: Guide | None = None
    missed: list[int] = field(default_factory=list)
    refusal: str = ""
    _paused: Guide | None = None
    _begun: int = 0
    _first: int = 0
    _left: int = 0
    _started: bool = False

    def load(self, points: FloatArray) -> None:
        """Another list; what was under way on the old one is over."""
        if self.guide is not None and self.guide.task is GuideTask.GOTO:
            self.guide = None
        if self._paused is not None and self._paused.task is GuideTask.GOTO:
            self._paused = None
        self.points = points
        self._first, self._left, self._started, self.missed = 0, len(points), False, []

    def execute(self, number: int, parameters: list[float]) -> int:
        """Carry out one of `ORDERS`; gives its MAV_RESULT."""
        if number == _START:
            return self._start_mission(parameters)
        return self._start_task(parameters) if number == _TASK else self._change_speed(parameters)

    def pause(self) -> bool:
        """End the task in force, which `resume` may take up; False where there is none."""
        if self.guide is None:
            return False
        self.shorten()
        self._paused, self.guide = self.guide, None
        return True

    def resume(self) -> int:
        """Go on with the task that was interrupted last; gives the MAV_RESULT."""
        if self.guide is not None:
            return ACCEPTED
        if self._paused is None:
            return DENIED
        self.guide, self._paused = self._paused, None
        return ACCEPTED

    def shorten(self) -> None:
        """Leave out what has been reached: a task that starts anew must not begin from the first point."""
        if self.guide is None or self.guide.task is not GuideTask.GOTO:
            return
        done = len(self.guide.waypoints) - self._left
        if done:
            self.guide = replace(self.guide, waypoints=self.guide.waypoints[done:])
            self._first += done

    def progress(self, telemetry: Telemetry) -> list[int]:
        """Waypoints (numbers in the list) reached since the last call; the end of the list ends the task.

        Those that the robot gives up are passed, and not reached.
        """
        guide, report, doing = self.guide, telemetry.navigation, telemetry.motion.guide
        if guide is None or report is None or doing is None or guide.task is not GuideTask.GOTO:
            return []
        # What is told of another list than the newest is old.
        if doing.task is not guide.task or not np.array_equal(doing.waypoints, guide.waypoints):
            return []
        left = report.waypoints_left
        if report.guided is Guided.BLIND or (left == 0) != (report.guided is Guided.ARRIVED):
            return []
        before, self._left = self._left, min(self._left, max(0, left))
        count = len(guide.waypoints)
        passed = range(count - before, count - self._left)
        if self._left == 0:
            self.guide = self._paused = None
        away = np.hypot(*(guide.waypoints - telemetry.estimate.position[:2]).T)
        self.missed += [self._first + number for number in passed if away[number] >= NEAR]
        return [self._first + number for number in passed if away[number] < NEAR]

    def current(self) -> tuple[int, int, int]:
        """(number of the waypoint that is next, number of waypoints, MISSION_STATE)."""
        total = len(self.points)
        if not total:
            state = mavlink.MISSION_STATE_NO_MISSION
        elif not self._started:
            state = mavlink.MISSION_STATE_NOT_STARTED
        elif self._left == 0:
            state = mavlink.MISSION_STATE_COMPLETE
        elif self._runs():
            state = mavlink.MISSION_STATE_ACTIVE
        else:
            state = mavlink.MISSION_STATE_PAUSED
        return min(total - self._left, max(0, total - 1)), total, int(state)

    def _start_mission(self, parameters: list[float]) -> int:
        first, last, *unused = parameters
        total = len(self.points)
        if any(unused) or not first.is_integer() or last not in (0.0, total - 1.0):
            return DENIED
        if not total:
            return FAILED
        if not 0 <= first < total:
            return DENIED
        begun = int(first)
        if self._runs() and begun == self._begun:
            return ACCEPTED  # the order came again because its answer was lost
        self._begun = self._first = begun
        self._left, self._started, self.missed = total - begun, True, []
        self.guide = Guide(task=GuideTask.GOTO, speed=self.speed, waypoints=self.points[begun:])
        self._paused = None
        return ACCEPTED

    def _start_task(self, parameters: list[float]) -> int:
        number, speed, distance, *unused = parameters
        if any(unused) or number not in range(1, len(TASKS)) or TASKS[int(number)] == GuideTask.GOTO:
            return DENIED
        if not (0.0 <= speed <= SPEED_MAX and 0.0 <= distance <= DISTANCE_MAX):
            return DENIED
        task = GuideTask(TASKS[int(number)])
        # Numbers come in single precision.
        speed, distance = round(speed, 6) or _DEFAULT.speed, round(distance, 6) or _DEFAULT.distance
        if task is not GuideTask.WANDER and distance < NEAREST:
            self.refusal = f"{task}: at least {NEAREST:g} m from the marker, not {distance:g} m"
            return DENIED
        wanted = Guide(task=task, speed=speed, distance=distance)
        if self.guide is None or _without_points(self.guide) != _without_points(wanted):
            self.guide, self._paused = wanted, None
        return ACCEPTED

    def _change_speed(self, parameters: list[float]) -> int:
        kind, speed, throttle, *unused = parameters
        if any(unused) or kind != _GROUND_SPEED or throttle not in (-1.0, 0.0):
            return DENIED
        if not 0.0 < speed <= SPEED_MAX:
            return DENIED
        self.speed = round(speed, 6)
        if self.guide is not None:
            self.shorten()
            self.guide = replace(self.guide, speed=self.speed)
        return ACCEPTED

    def _runs(self) -> bool:
        return self.guide is not None and self.guide.task is GuideTask.GOTO


def _without_points(guide: Guide) -> tuple[GuideTask, float, float]:
    return guide.task, guide.speed, guide.distance
