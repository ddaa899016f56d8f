"""The servos' supply through the sensor board, for as long as a command works on them.

The board cuts the supply when heartbeats stay away, so a thread of its own keeps
them coming while the main thread talks with servos, or waits for a person.
"""

from __future__ import annotations

import threading
from types import TracebackType
from typing import Self

from bluefoot_mpc.exceptions import DeviceError
from bluefoot_mpc.io.board.driver import SensorBoard
from bluefoot_mpc.io.clock import Clock
from bluefoot_mpc.io.findings import Finding, Severity
from bluefoot_mpc.io.link import Link

BEAT = 0.05
"""s between heartbeats."""
_ON_TIME = 3.0
_BOOT = 0.3
"""s that servos need after their supply came on."""


class ServoSupply:
    """Switches the supply on at entry and off at exit.

    Args:
        link: the board's port.
        clock: real time, that of the link.
    """

    def __init__(self, link: Link, clock: Clock) -> None:
        self._link, self._clock = link, clock
        self.board = SensorBoard(link, clock)
        self._lock = threading.Lock()
        self._end = threading.Event()
        self._thread = threading.Thread(target=self._keep, name="servo supply", daemon=True)

    def __enter__(self) -> Self:
        """Switch on.

        Raises:
            DeviceError: the board does not answer, or refuses.
        """
        try:
            self._hear()
            self.board.power(True)
            if not self.board.wait_power(True, _ON_TIME):
                self._refuse()
        except BaseException:
            self._switch_off()
            raise
        self._clock.sleep_until(self._clock.now() + _BOOT)
        self.board.beat()
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Switch off, and wait for the board's word."""
        self._end.set()
        self._thread.join()
        self._switch_off()

    def findings(self) -> tuple[Finding, ...]:
        """What the board says of itself and its sensors, from any thread."""
        with self._lock:
            self.board.poll()  # a sample that waits in the port since the last beat is no silent sensor
            return self.board.findings()

    def _hear(self) -> None:
        """Let the board introduce itself."""
        end = self._clock.now() + _BOOT
        while self._clock.now() < end:
            self.board.poll()
            self._clock.sleep_until(self._clock.now() + 0.005)

    def _keep(self) -> None:
        while not self._end.wait(BEAT):
            with self._lock:
                self.board.poll()
                self.board.beat()

    def _switch_off(self) -> None:
        self.board.cut()
        self.board.wait_power(False, 1.0)
        self.board.close()

    def _refuse(self) -> None:
        bad = [str(f) for f in self.board.findings() if f.severity is Severity.REFUSAL]
        raise DeviceError(
            f"board {self._link.name} does not switch the servos' supply on: "
            + ("; ".join(bad) or "it gives no reason. Check the emergency switch and the pack")
        )
