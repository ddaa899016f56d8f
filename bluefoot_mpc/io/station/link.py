"""The robot's end of the link, with its port and a thread of its own."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace

from pymavlink.dialects.v20 import common as mavlink

from bluefoot_mpc.io.clock import Clock, MonotonicClock
from bluefoot_mpc.io.station.config import StationConfig
from bluefoot_mpc.io.station.pump import Pump
from bluefoot_mpc.io.station.robot_end import RobotEnd
from bluefoot_mpc.io.station.signing import Signer, load_key
from bluefoot_mpc.io.station.telemetry import Snapshot
from bluefoot_mpc.io.station.transport import Address, open_transport
from bluefoot_mpc.types import MotionCommand, SensorFrame, Telemetry

_GOODBYE = 0.2
"""s that the last words get to leave."""


class StationLink:
    """A ground station, seen from the robot.

    `publish` and `command` only touch values in memory: nothing that happens on
    the line can delay whoever calls them. Times are those of a monotonic clock.

    Args:
        address: ``udp:HOST:PORT``, ``udpin:HOST:PORT`` or ``serial:PATH:BAUD``, ``,key=FILE`` behind it
            where frames are signed.
        clock: the machine's monotonic clock; its times are those of `command`.
        config: addresses, rates and times.

    Raises:
        ConfigurationError: the address or the key is wrong.
        LinkError: the port cannot be opened.

    Attributes:
        name: of the link, for messages.
    """

    def __init__(self, address: str, clock: Clock | None = None, config: StationConfig | None = None) -> None:
        place = Address.parse(address)
        config = config or StationConfig()
        if place.kind == "serial":
            config = replace(config, line_rate=place.number)
        signer = None if place.key is None else Signer(load_key(place.key))
        self._clock = clock or MonotonicClock()
        self._end = RobotEnd(config, self._clock.now(), signer)
        transport = open_transport(place)
        self.name = transport.name
        self._seen: tuple[str, tuple[str, ...]] = ("", ())
        self._closed = False
        self._pump = Pump("station link", transport, self._end, self._clock)

    def publish(
        self, telemetry: Telemetry, frame: SensorFrame, state: str = "", reasons: tuple[str, ...] = ()
    ) -> None:
        """Tell what happened on a tick; returns at once, and never raises.

        Args:
            telemetry: the controller's account.
            frame: what the sensors said.
            state: of the safety supervisor.
            reasons: what the supervisor has against going on.
        """
        self._end.offer(Snapshot(telemetry=telemetry, frame=frame, state=str(state), reasons=reasons))
        known_state, known_reasons = self._seen
        if state and state != known_state:
            self._end.say(mavlink.MAV_SEVERITY_NOTICE, f"state: {state}")
        for reason in reasons:
            if reason not in known_reasons:
                self._end.say(mavlink.MAV_SEVERITY_CRITICAL, reason)
        for event in telemetry.events:
            self._end.say(mavlink.MAV_SEVERITY_INFO, event)
        self._seen = (str(state), reasons)

    def say(self, text: str, *, fault: bool = False) -> None:
        """Tell the operator something; returns at once."""
        self._end.say(mavlink.MAV_SEVERITY_ERROR if fault else mavlink.MAV_SEVERITY_NOTICE, text)

    def command(self, now: float) -> tuple[MotionCommand, float]:
        """The motion that the station wants, and its age (s); before the first one, the link's own age.

        Args:
            now: s, on the link's clock.
        """
        return self._end.inbox.command(now)

    @property
    def stop_requested(self) -> bool:
        """True once the operator wants a controlled stop, until the robot is armed anew."""
        return self._end.inbox.wishes.stop

    @property
    def emergency_requested(self) -> bool:
        """True once the operator wants every torque off at once, until the robot is armed anew."""
        return self._end.inbox.wishes.emergency

    @property
    def arm_requested(self) -> bool:
        """True while the operator wants the robot armed and nobody has answered; see `arm_done`."""
        return self._end.inbox.wishes.arm

    def arm_done(self, refusal: str = "") -> None:
        """Answer the wish to arm: done, or why not."""
        self._end.inbox.wishes.arm = False
        self._end.armed(refusal)

    def on_emergency(self, call: Callable[[str], None]) -> None:
        """What to call, with a reason, when the operator stops the robot at once; from the link's thread."""
        self._end.inbox.on_emergency = call

    @property
    def station_seen(self) -> bool:
        """True once something from a station has arrived."""
        return any(guard.taken for guard in self._end.guards)

    def close(self) -> None:
        """Say goodbye, end the thread and give the port back. Idempotent."""
        if not self._closed:
            self._closed = True
            self._end.farewell()
            end = time.monotonic() + _GOODBYE
            while self._end.writer.waiting and time.monotonic() < end:
                time.sleep(0.01)
        self._pump.close()

    def __enter__(self) -> StationLink:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
