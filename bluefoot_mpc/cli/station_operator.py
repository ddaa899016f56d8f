"""The operator at the station: keyboard, gamepad and page behind one source of commands."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any, Protocol

import numpy as np

from bluefoot_mpc.cli.teleop import GAITS, Teleop, TeleopState, Vector3
from bluefoot_mpc.io.station.ground import GroundLink
from bluefoot_mpc.io.station.orders import Order
from bluefoot_mpc.io.station.picture import Mission
from bluefoot_mpc.types import FloatArray, Guide, GuideTask, Mode, MotionCommand

PAGE_TIMEOUT = 0.4
"""s; a page whose sticks are held says so ten times a second. One that is silent for longer has let go."""
ORDER_KEYS = {"m": Order.ARM, "p": Order.STOP, "0": Order.EMERGENCY}
"""Keys of the terminal besides those of driving."""
HELP = (
    "M               arm: torque on, after all checks\n"
    "P               STOP: end the gait, sit down, torque off\n"
    "0               torque off at once, wherever the robot is"
)
TASK_GONE = 1.5
"""s after which a task that the robot does not speak of any more is over."""
TASK_BEGINS = 15.0
"""s that a robot gets to stand up and begin with a task."""
_TASKS = (GuideTask.WANDER, GuideTask.APPROACH, GuideTask.FOLLOW, GuideTask.GOTO)
_MODES = {Order.STAND: Mode.STAND, Order.WALK: Mode.WALK, Order.SIT: Mode.SIT}
_CENTRE: Vector3 = (0.0, 0.0, 0.0)


class Keys(Protocol):
    """A keyboard: see `terminal.Keyboard`."""

    closed: bool

    def read(self) -> list[str]:
        """Keys pressed since the last look."""
        ...


class Sticks(Protocol):
    """A gamepad: see `gamepad.Gamepad`."""

    def read(self) -> tuple[Vector3, list[str]]:
        """Sticks, and keys that pressed buttons stand for."""
        ...


@dataclass(frozen=True, kw_only=True, slots=True)
class _Held:
    """Sticks of a page.

    Attributes:
        page: which.
        sticks: forward, left, turn; -1..1.
        time: s, when it last said so.
    """

    page: int = 0
    sticks: Vector3 = _CENTRE
    time: float = 0.0


@dataclass(slots=True)
class Waypoints:
    """The points that people have chosen on the map.

    Attributes:
        points: m forward and m to the left of where the run started.
        done: points before those that the robot was sent to last.
        sent: number of those.
    """

    points: list[tuple[float, float]] = field(default_factory=list)
    done: int = 0
    sent: int = 0

    def reached(self, mission: Mission) -> int:
        """Number of points that the robot has reached, by what it says of its list."""
        return self.done + (mission.reached if mission.total == self.sent else 0)

    def send(self, mission: Mission) -> FloatArray:
        """(n, 2) m, the points that are left to go to; all of them once the last is reached."""
        self.done = self.reached(mission)
        if self.done >= len(self.points):
            self.done = 0
        self.sent = len(self.points) - self.done
        return np.array(self.points[self.done :]).reshape(-1, 2)


class Operator:
    """What the people at the station want, from wherever they say it.

    Everything happens in one thread: `update` is called 25 times a second.

    Args:
        link: the robot.
        teleop: what keys and sticks mean.
        keyboard: the terminal's, or None.
        gamepad: or None.

    Attributes:
        ended: True once the operator wants to leave.
        state: of keys and sticks.
    """

    def __init__(
        self, link: GroundLink, teleop: Teleop, keyboard: Keys | None = None, gamepad: Sticks | None = None
    ) -> None:
        self._link, self._teleop = link, teleop
        self._keyboard, self._gamepad = keyboard, gamepad
        self._held = _Held()
        self._start = link.clock.now()
        self._waypoints = Waypoints()
        self._task_seen: float | None = None
        self._leader = 0
        self.state = TeleopState()
        self.ended = False

    def update(self) -> MotionCommand:
        """Read everything, and tell the robot."""
        now = self._now()
        self._watch_task(now)
        sticks, buttons = self._gamepad.read() if self._gamepad is not None else (_CENTRE, [])
        keys = self._keyboard.read() if self._keyboard is not None else []
        if any(self._held.sticks) and now - self._held.time > PAGE_TIMEOUT:
            self._held = _Held()
        if any(self._held.sticks):
            sticks = self._beyond_dead_zone(self._held.sticks)
        self.state = self._teleop.tilt_sticks(self.state, sticks, now)
        for key in (*keys, *buttons):
            self.press(key)
        if self._keyboard is not None and self._keyboard.closed:
            self._keyboard = None
        motion = self._teleop.command(self.state, now)
        if motion is None:
            self.ended = True
            motion = MotionCommand(mode=Mode.SIT)
        self._link.steer(motion)
        return motion

    def press(self, key: str) -> None:
        """A key of the keyboard, or a button of the gamepad."""
        if key in ORDER_KEYS:
            self.order(str(ORDER_KEYS[key]))
            return
        before = self.state.guide
        self.state = self._teleop.press(self.state, key, self._now())
        if self.state.guide is not before:
            self._leader, self._task_seen = 0, None

    def sticks(self, page: int, values: Vector3) -> None:
        """A page's sticks; of several pages the one that moved last counts."""
        if any(values) or self._held.page == page:
            self._held = _Held(page=page, sticks=values, time=self._now())

    def trunk(self, values: tuple[float, float, float, float]) -> None:
        """A page's trunk sliders."""
        config = self._teleop.config
        roll, pitch, yaw, height = values
        rpy = (roll * config.tilt_max, pitch * config.tilt_max, yaw * config.tilt_max)
        self.state = replace(self.state, rpy=rpy, height=height * config.height_max)

    def gait(self, name: str) -> None:
        """The gait to walk with."""
        if name in GAITS:
            self.state = replace(self.state, gait=name)

    def order(self, name: str) -> None:
        """Arm, stop, stand and so on; a name that is none does nothing."""
        if name not in list(Order):
            return
        order, now = Order(name), self._now()
        self._held = _Held()
        mode = _MODES.get(order, Mode.STAND)
        self.state = replace(
            self.state, mode=mode, velocity=_CENTRE, stick=_CENTRE, guide=None, last_input=now, ending=None
        )
        # The sticks are centred before the order leaves.
        motion = self._teleop.command(self.state, now) or MotionCommand()
        self._link.order(order, motion)

    def gone(self, page: int) -> None:
        """A page closed: its sticks are let go, and the task that it began is ended."""
        if self._held.page == page:
            self._held = _Held()
        if self._leader == page and self.state.guide is not None:
            self.order(str(Order.HALT))

    def task(self, page: int, name: str) -> None:
        """The robot is to find its own way; a name that is no task does nothing."""
        if name not in _TASKS:
            return
        task = GuideTask(name)
        if task is GuideTask.GOTO and not self._waypoints.points:
            self._link.tell("no waypoint yet: click on the map, or tap it")
            return
        points = np.zeros((0, 2))
        if task is GuideTask.GOTO:
            points = self._link.look(lambda picture: self._waypoints.send(picture.mission))
        self._held, self._leader, self._task_seen = _Held(), page, None
        self.state = self._teleop.lead(self.state, Guide(task=task, waypoints=points), self._now())

    def waypoint(self, forward: float, left: float) -> None:
        """One more point to go to, m forward and m to the left of where the run started."""
        most = self._link.config.waypoints_max
        if len(self._waypoints.points) < most:
            self._waypoints.points.append((forward, left))
        else:
            self._link.tell(f"the robot takes {most} waypoints at most: clear some")

    def clear(self) -> None:
        """No waypoints any more; a robot on its way to them stands."""
        self._waypoints = Waypoints()
        if self.state.guide is not None and self.state.guide.task is GuideTask.GOTO:
            self.state = self._teleop.lead(self.state, None, self._now())
        self._link.ask(Order.CLEAR)

    def _watch_task(self, now: float) -> None:
        """A task that the robot has ended, or never begun, is over here too."""
        guide = self.state.guide
        if guide is None:
            self._task_seen = None
            return
        order, result = self._link.result()
        refused = order == guide.task and result not in ("", "accepted", "replaced")
        if self._link.look(lambda picture: picture.task) == guide.task:
            self._task_seen = now
        elif self._task_seen is not None and now - self._task_seen > TASK_GONE:
            refused = True
        elif self._task_seen is None and now - self.state.last_input > TASK_BEGINS:
            refused = True
            self._link.tell(f"the robot does not begin to {guide.task}: does a script of its own lead it?")
        if refused:
            self.state = self._teleop.lead(self.state, None, now)

    def status(self) -> str:
        """One line on what is wanted now."""
        return self._teleop.status(self.state, self._now())

    def account(self) -> dict[str, Any]:
        """What is wanted now, for the page."""
        forward, left, turn = self._teleop.wanted(self.state)
        config = self._teleop.config
        order, result = self._link.result()
        waypoints, guide = self._waypoints, self.state.guide
        return {
            "task": "" if guide is None else str(guide.task),
            "waypoints": waypoints.points,
            "sent": waypoints.done + waypoints.sent,
            "reached": self._link.look(lambda picture: waypoints.reached(picture.mission)),
            "mode": str(self.state.mode),
            "gait": self.state.gait,
            "velocity": [forward, left, turn],
            "limits": [config.speed_max, config.lateral_max, config.yaw_rate_max],
            "order": order,
            "result": result,
        }

    def _now(self) -> float:
        return self._link.clock.now() - self._start

    def _beyond_dead_zone(self, sticks: Vector3) -> Vector3:
        """A pad on a page has no dead zone: what the rules for sticks take away is added first."""
        zone = self._teleop.config.dead_zone
        x, y, turn = (_stretched(value, zone) for value in sticks)
        return x, y, turn


def _stretched(value: float, zone: float) -> float:
    if not value:
        return 0.0
    return (zone + (1.0 - zone) * abs(value)) * (1.0 if value > 0.0 else -1.0)
