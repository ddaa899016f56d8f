"""A robot with servos behind the robot interface: everything in one thread, on any clock."""

from __future__ import annotations

import logging
from dataclasses import replace

from bluefoot_mpc.io.clock import Clock
from bluefoot_mpc.io.findings import Finding
from bluefoot_mpc.io.safety.guard import Guard, GuardState
from bluefoot_mpc.io.safety.health import Health
from bluefoot_mpc.io.servo_robot.bundle import Devices
from bluefoot_mpc.io.servo_robot.config import DevicesConfig
from bluefoot_mpc.io.servo_robot.devices import DeviceCycle
from bluefoot_mpc.types import FloatArray, JointCommand, SensorFrame

log = logging.getLogger(__name__)


class ServoRobot:
    """A `PoweredRobot` whose cycle runs when it is stepped.

    For an emulator on a virtual clock, where nothing happens between two steps.
    Real servos want `bluefoot_mpc.io.servo_robot.live.LiveRobot`, whose cycle goes on when
    the control thread does not.

    Attributes:
        period: s, command period.

    Args:
        devices: drivers.
        clock: the clock that their links were made with.
        config: timing.
    """

    def __init__(self, devices: Devices, clock: Clock, config: DevicesConfig) -> None:
        self.period = config.period
        self._clock = clock
        self._cycle = DeviceCycle(devices, clock, config)
        self._guard = Guard()
        self._is_closed = False

    def reset(self) -> SensorFrame:
        """Connect; the robot is limp."""
        self._cycle.latch("not armed")
        self._guard.reset()
        return self._cycle.connect()

    def preflight(self) -> tuple[Finding, ...]:
        """Check everything that must hold before torque; writes nothing."""
        findings = self._cycle.check()
        self._cycle.restart()
        return findings

    def arm(self, torque_limit: float) -> SensorFrame:
        """Hold the present position with a low torque limit.

        Raises:
            NotArmedError: a servo refused; every torque is off again.
        """
        self._guard.reset()
        self._cycle.arm(torque_limit)
        return self._cycle.collect_all()

    def watch_over(self, sit: FloatArray) -> None:
        """Tell where to sink to: (16,) rad, the sitting posture."""
        self._guard.watch_over(sit)

    def step(self, command: JointCommand) -> SensorFrame:
        """Send a command, let one command period pass, return the next frame."""
        action = self._guard.step(self._clock.now(), 0.0, command)
        if action.state is GuardState.OFF and self._cycle.may_move:
            _tell(self._cycle.off(action.reason))
        elif action.command is not None:
            self._cycle.send(action.command)
        return self._cycle.collect()

    def health(self) -> Health:
        """What the devices say of themselves."""
        return replace(self._cycle.health(), guard=self._guard.state)

    def disarm(self) -> None:
        """Torque off three times, verified, power cut, latch set. Never raises."""
        _tell(self._cycle.off("disarmed"))

    def stop(self) -> None:
        """Emergency: torque off and power cut at once; nothing moves again until armed. Never raises."""
        # An arming under way in another thread finds the latch closed, and takes its torque back.
        self._cycle.latch("stopped")
        self._guard.emergency("stopped")
        if self._cycle.may_move:
            _tell(self._cycle.cut("stopped"))
        else:
            self._cycle.cut_power()

    def close(self) -> None:
        """Switch off what is still on, and give back the ports. Idempotent."""
        if not self._is_closed:
            self._is_closed = True
            self.stop()
            self._cycle.close()


def _tell(findings: tuple[Finding, ...]) -> None:
    for finding in findings:
        log.warning("%s", finding)
