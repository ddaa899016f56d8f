"""A robot with servos in real time: a thread keeps the bus going, whatever the control thread does."""

from __future__ import annotations

import logging
import threading
from collections import deque
from collections.abc import Callable
from dataclasses import replace
from typing import TypeVar

from bluefoot_mpc.exceptions import DeviceError
from bluefoot_mpc.io.clock import Clock
from bluefoot_mpc.io.findings import Finding, Severity
from bluefoot_mpc.io.safety.guard import Guard, GuardState
from bluefoot_mpc.io.safety.health import Health
from bluefoot_mpc.io.servo_robot.bundle import Devices
from bluefoot_mpc.io.servo_robot.config import DevicesConfig
from bluefoot_mpc.io.servo_robot.devices import DeviceCycle
from bluefoot_mpc.io.servo_robot.port_watchdog import PortWatchdog
from bluefoot_mpc.types import FloatArray, JointCommand, SensorFrame

log = logging.getLogger(__name__)

T = TypeVar("T")

_PATIENCE = 1.0
"""s that the control thread waits for a frame before it gives the bus thread up."""
_JOB_TIME = 20.0
"""s that a check or the arming may take."""
_OFF_TIME = 0.1
"""s in which an emergency stop must have switched every torque off."""


class LiveRobot:
    """A `PoweredRobot` whose bus thread runs at the command rate from `reset` to `close`.

    The control thread leaves set-points and takes frames. Where they stay away,
    the guard on the bus thread holds, then lowers the robot and switches it off.

    Attributes:
        period: s, command period.

    Args:
        devices: drivers.
        clock: the clock that their links were made with.
        config: timing.
        watchdog: process that switches the robot off when this one dies; None for none.
        on_close: called when the ports have been given back.
    """

    def __init__(
        self,
        devices: Devices,
        clock: Clock,
        config: DevicesConfig,
        watchdog: PortWatchdog | None = None,
        on_close: Callable[[], None] | None = None,
    ) -> None:
        self.period = config.period
        self._clock, self._config = clock, config
        self._cycle = DeviceCycle(devices, clock, config, self._watch)
        self._guard = Guard()
        self._watchdog = watchdog
        self._on_close = on_close
        self._changed = threading.Condition()
        self._jobs: deque[Callable[[], None]] = deque()
        self._setpoint: JointCommand | None = None
        self._given_at = clock.now()
        self._is_new = False
        self._is_armed = self._is_watched = self._has_torque = False
        self._is_sure = True
        self._frame: SensorFrame | None = None
        self._count = self._taken = 0
        self._ending = self._is_closed = False
        self._is_off = threading.Event()
        self._failure: BaseException | None = None
        self._thread: threading.Thread | None = None
        self.late_setpoints = 0

    # -- control thread ----------------------------------------------------------

    def reset(self) -> SensorFrame:
        """Connect; the robot is limp.

        Raises:
            DeviceError: the bus thread has ended, or gives no frames.
        """
        self._cycle.latch("not armed")
        self._guard.reset()
        self._is_armed = False
        if self._thread is None:
            self._thread = threading.Thread(target=self._run, name="bluefoot-bus", daemon=True)
            self._thread.start()
        return self._on_bus(self._cycle.connect)

    def preflight(self) -> tuple[Finding, ...]:
        """Check everything that must hold before torque; writes nothing."""
        return self._on_bus(self._check)

    def arm(self, torque_limit: float) -> SensorFrame:
        """Hold the present position with a low torque limit.

        Raises:
            NotArmedError: a servo refused; every torque is off again.
            DeviceError: the bus thread has ended.
        """
        frame = self._on_bus(lambda: self._arm(torque_limit))
        self._taken = self._count
        return frame

    def watch_over(self, sit: FloatArray) -> None:
        """Tell where to sink to: (16,) rad, the sitting posture."""
        self._guard.watch_over(sit)

    def step(self, command: JointCommand) -> SensorFrame:
        """Leave a set-point and wait for the next frame.

        Raises:
            DeviceError: the bus thread has ended, or gives no frames.
        """
        with self._changed:
            self._setpoint, self._given_at, self._is_new = command, self._clock.now(), True
            self._changed.notify_all()
            arrived = self._changed.wait_for(
                lambda: self._count > self._taken or self._failure is not None, _PATIENCE
            )
            self._require_alive(arrived)
            self._taken = self._count
            return self._newest()

    def health(self) -> Health:
        """What the devices say of themselves."""
        watched = None if self._watchdog is None else not self._watchdog.lost
        return replace(self._cycle.health(), guard=self._guard.state, watched=watched)

    def disarm(self) -> None:
        """Torque off three times, verified, power cut, latch set. Never raises."""
        self._cycle.latch("disarmed")
        try:
            self._on_bus(lambda: self._switch_off("disarmed", verified=True))
        except DeviceError as error:
            log.error("%s", error)
            self.stop()

    def stop(self) -> None:
        """Emergency: torque off and power cut at once; nothing moves again until armed. Never raises."""
        # Here and now, whatever the bus thread is doing; it sends the rest.
        self._cycle.latch("stopped")
        self._guard.emergency("stopped")
        self._cycle.cut_power()
        if not self._has_torque:
            return
        with self._changed:
            self._changed.notify_all()
        thread = self._thread
        if thread is None or not thread.is_alive() or thread is threading.current_thread():
            self._switch_off("stopped", verified=False)
        elif not self._is_off.wait(_OFF_TIME):
            log.error("the bus thread has not switched the torque off within %g s", _OFF_TIME)

    def close(self) -> None:
        """Switch off what is still on, end the thread and give back the ports. Idempotent."""
        self.stop()
        with self._changed:
            self._ending = True
            self._changed.notify_all()
        if self._thread is not None and self._thread is not threading.current_thread():
            self._thread.join(timeout=2.0)
            self._thread = None
        if self._is_closed:
            return
        self._is_closed = True
        is_off = self._cycle.close() or (self._is_sure and not self._has_torque)
        if self._watchdog is not None:
            self._watchdog.close(is_off=is_off)
        if self._on_close is not None:
            self._on_close()

    def _on_bus(self, job: Callable[[], T]) -> T:
        """Have the bus thread do something, wait for it, and give what it gives or raises."""
        result: list[T] = []
        raised: list[BaseException] = []

        def work() -> None:
            try:
                result.append(job())
            except BaseException as error:  # It belongs to the thread that asked.
                raised.append(error)
            with self._changed:
                self._changed.notify_all()

        with self._changed:
            self._jobs.append(work)
            self._changed.notify_all()
            self._changed.wait_for(
                lambda: bool(result or raised) or self._failure is not None or self._ending, _JOB_TIME
            )
            if work in self._jobs:
                # Nobody waits for it any more.
                self._jobs.remove(work)
        if raised:
            raise raised[0]
        self._require_alive(bool(result), _JOB_TIME)
        return result[0]

    def _require_alive(self, arrived: bool, patience: float = _PATIENCE) -> None:
        if self._failure is not None:
            raise DeviceError(f"the bus thread has ended: {self._failure}") from self._failure
        if not arrived:
            raise DeviceError(f"nothing from the bus thread within {patience:g} s: adapter or machine hang")

    def _newest(self) -> SensorFrame:
        if self._frame is None:
            raise DeviceError("the bus gave no frame")
        return self._frame

    # -- bus thread ----------------------------------------------------------------

    def _run(self) -> None:
        try:
            while not self._ending:
                self._work()
        except BaseException as error:
            # Whatever it is: torque goes, and the control thread is told.
            log.exception("the bus thread failed")
            self._failure = error
            self._switch_off("the bus thread failed", verified=False)
            with self._changed:
                self._changed.notify_all()

    def _work(self) -> None:
        """One period: jobs that wait, a set-point, a frame."""
        self._watch()
        while self._jobs:
            self._jobs.popleft()()
        with self._changed:
            in_time = self._changed.wait_for(
                lambda: self._is_new or not self._is_armed or bool(self._jobs) or self._ending,
                self._config.patience,
            )
            self.late_setpoints += not in_time
            command, given_at, self._is_new = self._setpoint, self._given_at, False
        if self._is_armed:
            self._guarded(command, given_at)
        frame = self._cycle.collect()
        with self._changed:
            self._frame = frame
            self._count += 1
            self._changed.notify_all()

    def _guarded(self, command: JointCommand | None, given_at: float) -> None:
        """Write what the guard allows."""
        self._watch()
        now = self._clock.now()
        action = self._guard.step(now, now - given_at, command)
        if action.state is GuardState.OFF:
            log.warning("torque off: %s", action.reason)
            # The latch is closed already where somebody wants it at once.
            self._switch_off(action.reason, verified=not self._cycle.is_latched)
        elif action.command is not None:
            self._cycle.send(action.command)

    def _switch_off(self, reason: str, *, verified: bool) -> None:
        self._is_armed = False
        findings = self._cycle.off(reason) if verified else self._cycle.cut(reason)
        self._has_torque, self._is_sure = False, not findings
        self._is_off.set()
        for finding in findings:
            log.warning("%s", finding)

    def _watch(self) -> None:
        """Tell the watchdog process that all is well, and hear whether it thinks so."""
        if self._watchdog is None or not self._is_watched:
            return
        if not self._watchdog.beat():
            self._guard.emergency("the watchdog process has switched the torque off")

    def _check(self) -> tuple[Finding, ...]:
        findings = self._cycle.check()
        self._cycle.restart()
        if self._watchdog is not None and self._watchdog.lost:
            mend = "Start the program again"
            gone = Finding(
                part="watchdog process", text=self._watchdog.lost, mend=mend, severity=Severity.REFUSAL
            )
            return (*findings, gone)
        return findings

    def _arm(self, torque_limit: float) -> SensorFrame:
        self._guard.reset()
        self._is_off.clear()
        # From the first beat on it expects the next: what came before could take its time.
        self._is_watched = self._has_torque = True
        self._watch()
        try:
            self._cycle.arm(torque_limit)
        except BaseException:
            # Perhaps not of every servo: the supply's end at `close` tells.
            self._has_torque = self._is_sure = False
            self._is_off.set()
            raise
        self._setpoint, self._given_at = None, self._clock.now()
        self._is_armed = True
        return self._cycle.collect_all()
