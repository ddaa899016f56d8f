"""Commands to a running robot from a Python program, over the same link that a ground station uses.

    from bluefoot_mpc.io.station.client import RemoteRobot

    with RemoteRobot("udpin:127.0.0.1:14550") as robot:
        robot.walk(5.0, forward=0.06)
        robot.turn(3.0, left=20.0)
        robot.pose(2.0, pitch=5.0)
        robot.sit(2.0)

The robot's side is ``bluefoot run remote --station udp:127.0.0.1:14550``. Every
call holds its command for that long and then returns; leaving the ``with`` block
stops a walking robot. A program that ends or hangs is a silent station: the
robot stops walking by itself.
"""

from __future__ import annotations

import time

from bluefoot_mpc.exceptions import DeviceError
from bluefoot_mpc.io.link import LinkLostError
from bluefoot_mpc.io.station.config import StationConfig
from bluefoot_mpc.io.station.ground import GroundLink, OperatorLog
from bluefoot_mpc.io.station.orders import Order
from bluefoot_mpc.io.station.picture import RobotPicture
from bluefoot_mpc.io.station.steps import Steps
from bluefoot_mpc.types import MotionCommand

_PERIOD = 0.04  # s between two words to the robot
_LOST = 3.0  # s without telemetry
_ANSWER = 10.0  # s that arming may take


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

    def sit(self, seconds: float) -> None:
        """Sit down."""
        self.play(Steps().sit(seconds))

    def play(self, steps: Steps) -> None:
        """Do one step after the other.

        Raises:
            LinkLostError: the robot is not heard any more.
        """
        start = time.monotonic()
        while (elapsed := time.monotonic() - start) < steps.duration:
            self.command(steps.at(elapsed))
            time.sleep(_PERIOD)

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
            texts = self.link.look(lambda picture: [text.text for text in picture.texts][-1:])
            raise DeviceError(f"'{order}': {result}. {' '.join(texts)}".strip())
