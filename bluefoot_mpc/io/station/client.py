"""Commands to a running robot from a Python program, over the same link that a ground station uses.

    from bluefoot_mpc.io.station.client import RemoteRobot

    with RemoteRobot("udpin:127.0.0.1:14550") as robot:
        robot.walk(5.0, forward=0.06)
        robot.turn(3.0, left=20.0)
        robot.pose(2.0, pitch=5.0)
        robot.goto([(1.0, 0.5), (2.0, 0.0)])
        robot.sit(2.0)

The robot's side is ``bluefoot run remote --station udp:127.0.0.1:14550``. Every
call holds its command for that long and then returns; leaving the ``with`` block
stops a walking robot. A program that ends or hangs is a silent station: the
robot stops walking by itself.
"""

from __future__ import annotations

import math
import time
from collections.abc import Sequence

import numpy as np

from bluefoot_mpc.exceptions import DeviceError
from bluefoot_mpc.io.link import LinkLostError
from bluefoot_mpc.io.station.config import StationConfig
from bluefoot_mpc.io.station.ground import GroundLink, OperatorLog
from bluefoot_mpc.io.station.orders import Order
from bluefoot_mpc.io.station.picture import RobotPicture
from bluefoot_mpc.io.station.steps import Steps
from bluefoot_mpc.io.station.tasks import NEAR
from bluefoot_mpc.types import FloatArray, GuideTask, MotionCommand

_PERIOD = 0.04  # s between two words to the robot
_LOST = 3.0  # s without telemetry
_ANSWER = 10.0  # s that arming may take
_GONE = 1.5  # s after which a task that the robot does not speak of any more is over


class RemoteRobot:
    """A robot at the other end of a link.

    Args:
        address: where it is, as for `GroundLink`.
        log: where to write everything down.
        config: of the link.
        timeout: s to wait for the first telemetry.

    Raises:
        ConfigurationError: the address is wrong.
        LinkError: the port cannot be opened, or no robot is heard in time.

    Attributes:
        link: for everything that has no method here.
    """

    def __init__(
        self,
        address: str = "udpin:127.0.0.1:14550",
        *,
        log: OperatorLog | None = None,
        config: StationConfig | None = None,
        timeout: float = 30.0,
    ) -> None:
        self.link = GroundLink(address, log=log, config=config)
        end = time.monotonic() + timeout
        while not self.link.look(lambda picture: picture.mode):
            if time.monotonic() > end:
                self.link.close()
                raise LinkLostError(
                    f"{self.link.name}: no robot was heard for {timeout:g} s. "
                    "Start one with: bluefoot run remote --station udp:127.0.0.1:14550"
                )
            time.sleep(_PERIOD)

    def arm(self) -> None:
        """Torque on, after all checks.

        Raises:
            DeviceError: the robot refused.
        """
        self._order(Order.ARM)

    def stop(self) -> None:
        """End the gait, sit down, torque off; only `arm` ends it."""
        self._order(Order.STOP)

    def emergency(self) -> None:
        """Torque off at once, wherever the robot is."""
        self._order(Order.EMERGENCY)

    def stand(self, seconds: float) -> None:
        """Stand level."""
        self.play(Steps().stand(seconds))

    def walk(
        self,
        seconds: float,
        *,
        forward: float = 0.06,
        left: float = 0.0,
        turn: float = 0.0,
        gait: str = "trot",
    ) -> None:
        """Walk: m/s forward and to the left, degrees/s to the left, ``"trot"`` or ``"walk"``."""
        self.play(Steps().walk(seconds, forward=forward, left=left, turn=turn, gait=gait))

    def turn(self, seconds: float, *, left: float = 15.0) -> None:
        """Turn on the spot, degrees/s to the left."""
        self.play(Steps().turn(seconds, left=left))

    def pose(
        self, seconds: float, *, roll: float = 0.0, pitch: float = 0.0, yaw: float = 0.0, height: float = 0.0
    ) -> None:
        """Stand with the trunk tilted, degrees (right side down, nose down, left), and raised, m."""
        self.play(Steps().pose(seconds, roll=roll, pitch=pitch, yaw=yaw, height=height))

    def goto(
        self, points: Sequence[Sequence[float]] | FloatArray, *, seconds: float = 120.0, speed: float = 0.1
    ) -> bool:
        """Go to one point after the other; True once it is at the last, False where it could not.

        Args:
            points: m forward and m to the left of where the run started.
            seconds: s that it may take.
            speed: m/s, at most.

        Raises:
            ConfigurationError: the points are none.
            DeviceError: the robot refused.
            LinkLostError: the robot is not heard any more.
        """
        motion = Steps().goto(seconds, points=points, speed=speed).at(0.0)
        progress = _Progress(self.link, np.asarray(points, dtype=np.float64)[-1])
        end = time.monotonic() + seconds
        while time.monotonic() < end and progress.open:
            self.command(motion)
            time.sleep(_PERIOD)
            progress.look()
        self.command(MotionCommand())
        if progress.refusal:
            raise DeviceError(f"'goto': {progress.refusal}. {self._last_text()}".strip())
        return progress.arrived

    def wander(self, seconds: float, *, speed: float = 0.15) -> None:
        """Walk through what is free, at most so fast (m/s)."""
        self.play(Steps().wander(seconds, speed=speed))

    def follow(self, seconds: float, *, distance: float = 0.6, speed: float = 0.15) -> None:
        """Follow the marker at a distance (m), at most so fast (m/s)."""
        self.play(Steps().follow(seconds, distance=distance, speed=speed))

    def approach(self, seconds: float, *, distance: float = 0.6, speed: float = 0.15) -> None:
        """Look for the marker and stop at a distance (m) from it."""
        self.play(Steps().approach(seconds, distance=distance, speed=speed))

    def sit(self, seconds: float) -> None:
        """Sit down."""
        self.play(Steps().sit(seconds))

    def play(self, steps: Steps) -> None:
        """Do one step after the other; a task that is still under way at the end is ended.

        Raises:
            LinkLostError: the robot is not heard any more.
        """
        start = time.monotonic()
        while (elapsed := time.monotonic() - start) < steps.duration:
            self.command(steps.at(elapsed))
            time.sleep(_PERIOD)
        if steps.commands and steps.commands[-1].guide is not None:
            self.command(MotionCommand())

    def command(self, motion: MotionCommand) -> None:
        """Say what the robot should do now; to be said again within half a second.

        Raises:
            LinkLostError: the robot is not heard any more.
        """
        self.link.steer(motion)
        age = self.link.quality().age
        if age > _LOST:
            raise LinkLostError(f"{self.link.name}: no telemetry for {age:.1f} s")

    def picture(self) -> RobotPicture:
        """What is known of the robot; changes while one looks at it."""
        return self.link.look(lambda picture: picture)

    def close(self) -> None:
        """Stand still, and hang up. Idempotent."""
        self.link.ask(Order.HALT)
        time.sleep(3 * _PERIOD)
        self.link.close()

    def __enter__(self) -> RemoteRobot:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _order(self, order: Order) -> None:
        self.link.ask(order)
        end = time.monotonic() + _ANSWER
        while not self.link.result()[1]:
            if time.monotonic() > end:
                raise DeviceError(f"'{order}' was not answered for {_ANSWER:g} s")
            time.sleep(_PERIOD)
        result = self.link.result()[1]
        if result != "accepted":
            raise DeviceError(f"'{order}': {result}. {self._last_text()}".strip())

    def _last_text(self) -> str:
        texts = self.link.look(lambda picture: [text.text for text in picture.texts][-1:])
        return " ".join(texts)


class _Progress:
    """How far the robot has come with the list that it was given.

    Args:
        link: the robot.
        last: (2,) m, the last point of the list.

    Attributes:
        open: True while it is on its way, or has not answered yet.
        arrived: True once it is at the last point.
        refusal: why it did not begin; empty where it did.
    """

    def __init__(self, link: GroundLink, last: FloatArray) -> None:
        self._link, self._last = link, last
        self._begun = self._ended = self._seen = math.inf
        self.open, self.arrived, self.refusal = True, False, ""

    def look(self) -> None:
        """Look at what the robot has said."""
        now = self._link.clock.now()
        order, result = self._link.result()
        if order == Order.GOTO and result not in ("", "accepted"):
            self.open, self.refusal = False, result
        elif result == "accepted" and self._begun == math.inf:
            self._begun = now
        if self._begun < math.inf:
            self._link.look(lambda picture: self._judge(picture, now))

    def _judge(self, picture: RobotPicture, now: float) -> None:
        # What was told before the robot began is about another list, and a place from before the end is old.
        def told(kind: str, since: float) -> bool:
            return picture.arrived.get(kind, -math.inf) > since

        if self._ended < math.inf:
            if told("LOCAL_POSITION_NED", self._ended):
                self.open = False
                # Points that it finds no way to are left out.
                self.arrived = math.dist(picture.position[:2], self._last) < NEAR
        elif told("MISSION_CURRENT", self._begun) and picture.mission.complete:
            self._ended = now
        elif picture.task == GuideTask.GOTO:
            self._seen = now
        elif now - self._seen > _GONE:
            self.open = False
