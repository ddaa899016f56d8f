"""The robot's end of the link, with its port and a thread of its own."""

from __future__ import annotations

import contextlib
import logging
import select
import threading
from collections.abc import Callable
from dataclasses import replace

from pymavlink.dialects.v20 import common as mavlink

from bluefoot_mpc.io.clock import Clock, MonotonicClock
from bluefoot_mpc.io.station.config import StationConfig
from bluefoot_mpc.io.station.robot_end import RobotEnd
from bluefoot_mpc.io.station.signing import Signer, load_key
from bluefoot_mpc.io.station.telemetry import Snapshot
from bluefoot_mpc.io.station.transport import Address, Transport, open_transport
from bluefoot_mpc.types import Mode, MotionCommand, SensorFrame, Telemetry

_LOG = logging.getLogger(__name__)
_LONGEST_WAIT = 0.02
"""s; what is published is seen by the thread after this time at the latest."""


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
        self._transport: Transport = open_transport(place)
        self.name = self._transport.name
        self._seen: tuple[Mode | None, str, tuple[str, ...]] = (None, "", ())
        self._rest = b""
        self._ending = threading.Event()
        self._thread = threading.Thread(target=self._serve, name="station link", daemon=True)
        self._thread.start()

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
        mode, known_state, known_reasons = self._seen
        if state and state != known_state:
            self._end.say(mavlink.MAV_SEVERITY_NOTICE, f"state: {state}")
        for reason in reasons:
            if reason not in known_reasons:
                self._end.say(mavlink.MAV_SEVERITY_CRITICAL, reason)
        if mode is not telemetry.mode:
            self._end.say(mavlink.MAV_SEVERITY_NOTICE, f"mode: {telemetry.mode}")
        for event in telemetry.events:
            self._end.say(mavlink.MAV_SEVERITY_INFO, event)
        self._seen = (telemetry.mode, str(state), reasons)

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
        """End the thread and give the port back. Idempotent."""
        self._ending.set()
        self._thread.join(timeout=2.0)
        self._transport.close()

    def __enter__(self) -> StationLink:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _serve(self) -> None:
        while not self._ending.is_set():
            try:
                self._turn()
            except Exception:
                # The boundary that keeps the robot safe: a link that broke is a silent one, and ages.
                _LOG.exception("the station link failed; it goes on")
                self._ending.wait(0.1)

    def _turn(self) -> None:
        self._wait()
        # Bounded: however much babble arrives, telemetry gets its turn.
        for _ in range(32):
            data = self._transport.read()
            if not data:
                break
            if self._end.receive(data, self._clock.now()):
                self._transport.confirm()
        self._send()

    def _wait(self) -> None:
        pause = _LONGEST_WAIT if self._rest else min(_LONGEST_WAIT, self._end.wait(self._clock.now()))
        descriptor = self._transport.fileno()
        if descriptor < 0:
            self._ending.wait(_LONGEST_WAIT)
            return
        # A port that vanishes between the two lines shows with the next read.
        with contextlib.suppress(OSError, ValueError):
            select.select([descriptor], [], [], pause)

    def _send(self) -> None:
        while not self._ending.is_set():
            if not self._rest:
                self._rest = self._end.produce(self._clock.now()) or b""
            if not self._rest:
                return
            taken = self._transport.write(self._rest)
            self._rest = self._rest[taken:]
            if self._rest:
                return
