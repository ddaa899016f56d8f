"""The watchdog process on the robot's ports: what it writes there, and which descriptors it holds."""

from __future__ import annotations

from collections.abc import Sequence

from bluefoot_mpc.io.board.framing import encode_frame
from bluefoot_mpc.io.board.messages import Kind
from bluefoot_mpc.io.link import LinkLostError
from bluefoot_mpc.io.safety.watchdog import GuardedPort
from bluefoot_mpc.io.safety.watchdog_process import TORQUE_OFF, WatchdogProcess
from bluefoot_mpc.io.serial_link import SerialLink

_CUT = encode_frame(Kind.POWER_CUT, 0)


class PortWatchdog:
    """A watchdog process that holds the ports of servos and board. Start it before torque is on.

    Args:
        servos: ports of the servos.
        board: port of the sensor and power board.

    Raises:
        DeviceError: the process did not start.
    """

    def __init__(self, servos: Sequence[SerialLink], board: SerialLink) -> None:
        self._links = (*servos, board)
        self._held = [link.openings for link in self._links]
        guarded = [_guarded(link, TORQUE_OFF) for link in servos]
        self._process = WatchdogProcess([*guarded, _guarded(board, _CUT)])

    @property
    def lost(self) -> str:
        """Why it does not watch any more; empty while it does."""
        return self._process.lost

    @property
    def pid(self) -> int:
        """Its process number."""
        return self._process.pid

    def beat(self) -> bool:
        """Tell it that all is well, and which ports went or came back; False where torque must go now."""
        for index, link in enumerate(self._links):
            held = link.openings if link.is_open else 0
            if held != self._held[index]:
                self._held[index] = held
                self._hand_over(index, link)
        return self._process.beat()

    def close(self, *, is_off: bool = True) -> None:
        """Dismiss it; where it is not known that torque is off, it tries to switch it off before it ends."""
        self._process.close(is_off=is_off)

    def _hand_over(self, index: int, link: SerialLink) -> None:
        try:
            self._process.replace(index, link.fileno())
        except LinkLostError:
            self._process.replace(index, None)


def _guarded(link: SerialLink, payload: bytes) -> GuardedPort:
    return GuardedPort(path=link.name, baud=link.baud, payload=payload, descriptor=link.fileno())
