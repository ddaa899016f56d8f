"""The station's end of the link, with its port, a thread of its own and the operator's log."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TypeVar

import orjson

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.io.clock import Clock, MonotonicClock
from bluefoot_mpc.io.station.config import StationConfig
from bluefoot_mpc.io.station.ground_end import GroundEnd
from bluefoot_mpc.io.station.orders import Order
from bluefoot_mpc.io.station.picture import RobotPicture
from bluefoot_mpc.io.station.pump import Pump
from bluefoot_mpc.io.station.signing import Signer, load_key
from bluefoot_mpc.io.station.transport import Address, open_transport
from bluefoot_mpc.types import MotionCommand

_Answer = TypeVar("_Answer")


class OperatorLog:
    """Everything that was received and sent, one JSON object a line.

    ``time`` is s since 1970, ``mono`` the station's monotonic clock (s), ``way``
    ``in`` or ``out``, ``kind`` the message's name; its fields follow.

    Args:
        path: file to write; its folder is made.

    Raises:
        ConfigurationError: the file cannot be written.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            self._file = path.open("wb")
        except OSError as error:
            raise ConfigurationError(f"cannot write the log {path}: {error.strerror or error}") from error
        self._flushed = 0.0
        self.lines = 0

    def note(self, way: str, message: Any, now: float) -> None:
        """Write one message down."""
        fields = {name: getattr(message, name) for name in message.get_fieldnames()}
        self._line({"way": way, "kind": message.get_type(), "mono": now, **fields})

    def remark(self, text: str, now: float) -> None:
        """Write down what the operator, or the station itself, did."""
        self._line({"way": "here", "kind": "REMARK", "mono": now, "text": text})

    def close(self) -> None:
        """Finish the file. Idempotent."""
        self._file.close()

    def _line(self, fields: dict[str, Any]) -> None:
        if self._file.closed:
            return
        line = orjson.dumps({"time": time.time(), **fields}, default=_plain)
        self._file.write(line + b"\n")
        self.lines += 1
        if fields["mono"] - self._flushed > 1.0:
            self._flushed = fields["mono"]
            self._file.flush()


def _plain(value: Any) -> Any:
    return value.decode("ascii", "replace").rstrip("\x00") if isinstance(value, bytes) else str(value)


@dataclass(frozen=True, kw_only=True, slots=True)
class LinkQuality:
    """How well the two ends hear each other.

    Attributes:
        age: s since anything of the robot came; infinite before that.
        loss_down: share of the robot's messages that we missed, 0..1.
        loss_up: share of ours that the robot missed, 0..1.
        bad: frames that failed their sum or signature.
        bytes_down: bytes/s, mean of the last second.
        bytes_up: bytes/s.
    """

    age: float
    loss_down: float
    loss_up: float
    bad: int
    bytes_down: float
    bytes_up: float


class GroundLink:
    """A robot, seen from the ground.

    Args:
        address: ``udp:HOST:PORT``, ``udpin:HOST:PORT`` or ``serial:PATH:BAUD``, ``,key=FILE`` behind it
            where frames are signed.
        log: where to write everything down; None: nowhere.
        clock: the machine's monotonic clock.
        config: addresses, rates and times.

    Raises:
        ConfigurationError: the address or the key is wrong, or the log cannot be written.
        LinkError: the port cannot be opened.

    Attributes:
        config: addresses, rates and times, those of the address included.
        clock: whose times count.
        log: where everything is written down; None: nowhere.
        name: of the link, for messages.
    """

    def __init__(
        self,
        address: str,
        *,
        log: OperatorLog | None = None,
        clock: Clock | None = None,
        config: StationConfig | None = None,
    ) -> None:
        place = Address.parse(address)
        config = config or StationConfig()
        if place.kind == "serial":
            config = replace(config, line_rate=place.number)
        signer = None if place.key is None else Signer(load_key(place.key))
        self.config = config
        self.clock = clock or MonotonicClock()
        self.log = log
        self._lock = threading.Lock()
        self._end = _Locked(GroundEnd(config, self.clock.now(), signer), self._lock)
        if log is not None:
            self._end.end.watch = log.note
        transport = open_transport(place)
        self.name = transport.name
        self._pump = Pump("ground link", transport, self._end, self.clock)

    def steer(self, motion: MotionCommand) -> None:
        """What the robot should do; said again within half a second, or the sticks are centred."""
        with self._lock:
            self._end.end.steer(motion, self.clock.now())

    def order(self, order: Order, motion: MotionCommand) -> None:
        """Give an order, and the motion that goes with it."""
        with self._lock:
            self._end.end.motion = motion
        self.ask(order)

    def ask(self, order: Order) -> None:
        """Give an order; it is repeated until the robot answers."""
        now = self.clock.now()
        with self._lock:
            if self.log is not None:
                self.log.remark(f"order: {order}", now)
            self._end.end.ask(order, now)

    def result(self) -> tuple[str, str]:
        """(order, result) of the newest order; the result is empty while there is no answer."""
        with self._lock:
            orders = self._end.end.orders
            return (str(orders[-1].order), orders[-1].result) if orders else ("", "")

    def look(self, look: Callable[[RobotPicture], _Answer]) -> _Answer:
        """What `look` makes of the newest picture of the robot, which does not change meanwhile."""
        with self._lock:
            return look(self._end.end.picture)

    def tell(self, text: str, *, fault: bool = False) -> None:
        """Add a line of the station's own to what the robot told."""
        now = self.clock.now()
        with self._lock:
            if self.log is not None:
                self.log.remark(text, now)
            self._end.end.picture.tell(text, 3 if fault else 6, now)

    def quality(self) -> LinkQuality:
        """How well the two ends hear each other."""
        with self._lock:
            end, now = self._end.end, self.clock.now()
            down, up = self._end.rates(now)
            return LinkQuality(
                age=end.picture.age(now),
                loss_down=end.guard.loss,
                loss_up=end.picture.uplink_loss,
                bad=end.reader.bad + end.refused,
                bytes_down=down,
                bytes_up=up,
            )

    def close(self) -> None:
        """End the thread, give the port back, finish the log. Idempotent."""
        self._pump.close()
        if self.log is not None:
            self.log.close()

    def __enter__(self) -> GroundLink:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


class _Locked:
    """An end of the link that several threads use one after the other, with its traffic counted."""

    _WINDOW = 1.0  # s

    def __init__(self, end: GroundEnd, lock: threading.Lock) -> None:
        self.end, self._lock = end, lock
        self._down = self._up = 0
        self._since: float | None = None
        self._rates = (0.0, 0.0)

    def receive(self, data: bytes, now: float) -> int:
        with self._lock:
            self._down += len(data)
            return self.end.receive(data, now)

    def produce(self, now: float) -> bytes | None:
        with self._lock:
            frame = self.end.produce(now)
            self._up += len(frame or b"")
            return frame

    def wait(self, now: float) -> float:
        with self._lock:
            return self.end.wait(now)

    def rates(self, now: float) -> tuple[float, float]:
        """(down, up) bytes/s."""
        if self._since is None:
            self._since = now
        elapsed = now - self._since
        if elapsed >= self._WINDOW:
            self._rates = (self._down / elapsed, self._up / elapsed)
            self._down, self._up, self._since = 0, 0, now
        return self._rates
