"""The devices of a robot with servos, as one thing: what happens on the lines in a command period."""

from __future__ import annotations

import contextlib
import logging
from collections import deque
from collections.abc import Callable

import numpy as np

from bluefoot_mpc.io.board.readings import BoardReadings
from bluefoot_mpc.io.clock import Clock
from bluefoot_mpc.io.dynamixel import arming, units
from bluefoot_mpc.io.dynamixel.cycle import Readings
from bluefoot_mpc.io.findings import Finding, NotArmedError, Severity
from bluefoot_mpc.io.lidar.errors import LidarError
from bluefoot_mpc.io.safety.health import Health
from bluefoot_mpc.io.servo_robot.bundle import Devices
from bluefoot_mpc.io.servo_robot.config import DevicesConfig
from bluefoot_mpc.io.servo_robot.frames import sensor_frame
from bluefoot_mpc.io.servo_robot.preflight import posture_findings, preflight, switch_findings
from bluefoot_mpc.model.servo import FULL_DUTY
from bluefoot_mpc.types import N_LEGS, BoolArray, JointCommand, SensorFrame

log = logging.getLogger(__name__)

_LATELY = 50
"""Cycles whose reading times decide how early reading starts."""
_STILL_ON = Finding(
    part="power board",
    text="the servos' supply is still on after the board was told to cut it",
    mend="Unplug the servos' battery",
    severity=Severity.REFUSAL,
)
_STOPPED = Finding(
    part="arming",
    text="somebody stopped the robot meanwhile",
    mend="Arm anew",
    severity=Severity.REFUSAL,
)
_NOW = 0.0
_CUT_TIME = 0.3
"""s in which the board must say that the supply is off."""
_TRIES = 5
"""Periods more in which all servos may answer while the robot is being armed."""
_BOOT = 0.3
"""s that servos need after their supply came on."""


class DeviceCycle:
    """What is done with the devices, step by step. One thread calls it.

    Attributes:
        may_move: False until armed: goals are not sent.

    Args:
        devices: the drivers.
        clock: the clock that their links were made with.
        config: timing.
        alive: called at least every quarter of a second, also while the servos are checked and armed.
    """

    def __init__(
        self,
        devices: Devices,
        clock: Clock,
        config: DevicesConfig,
        alive: Callable[[], object] = lambda: None,
    ) -> None:
        self._devices, self._clock, self._config = devices, clock, config
        self._alive = alive
        self._stops = 0
        self._checked_at: int | None = None
        self._reading_times: deque[float] = deque(maxlen=_LATELY)
        self._due = clock.now()
        self._board: BoardReadings | None = None
        self._joints: Readings | None = None
        self.may_move = False

    # -- once ------------------------------------------------------------------

    def connect(self) -> SensorFrame:
        """Switch the servos' supply on, hear all devices, read all servos; no torque.

        What is missing is left to the check before arming.
        """
        self.may_move = False
        devices = self._devices
        if devices.lidar is not None:
            # The robot walks without it; the check before arming tells.
            with contextlib.suppress(LidarError):
                devices.lidar.start()
        if devices.camera is not None:
            devices.camera.open()
        self._supply()
        self.restart()
        return self.collect()

    def _supply(self) -> None:
        """Have the servos' supply on, and give them time to start."""
        board, clock = self._devices.board, self._clock
        if board is None:
            return
        if board.is_cut:
            # What was cut a moment ago may not have gone off yet.
            board.wait_power(False, _CUT_TIME, self._alive)
        board.power(True)
        board.wait_power(True, self._config.connect_time, self._alive)
        end = clock.now() + _BOOT
        while clock.now() < end:
            clock.sleep_until(min(end, clock.now() + _BOOT / 2))
            self._beat()

    def restart(self) -> None:
        """Begin a new period now."""
        self._due = self._clock.now()

    def check(self) -> tuple[Finding, ...]:
        """Everything that must hold before torque; writes nothing.

        A robot that was stopped gets its servos' supply back for it.
        """
        self._checked_at = self._stops
        board = self._devices.board
        if board is not None and (board.is_cut or not board.wait_power(True, _NOW)):
            self._supply()
            self.restart()
            self.collect()
        found = preflight(self._devices, self._config.arming_voltage, self._beat)
        if self._joints is not None:
            found += posture_findings(self._devices.calibration, self._joints.counts)
        return found

    def arm(self, torque_limit: float) -> None:
        """Hold the present position with a low torque limit.

        Raises:
            NotArmedError: a servo refused, or somebody stopped the robot since it was checked; every
                torque is off again, and the supply cut.
        """
        devices = self._devices
        checked_at, self._checked_at = self._checked_at, None
        for bus in devices.buses:
            bus.latch.release()
        try:
            # After the release: a stop that comes later closes the latch again.
            if checked_at not in (None, self._stops):
                raise NotArmedError([_STOPPED])
            for leg in range(N_LEGS):
                arming.arm(devices.buses, devices.layout, torque_limit, range(4 * leg, 4 * leg + 4))
                # Sixteen servos can take longer than board and watchdog wait.
                self._beat()
            devices.cycle.admit()
            self.may_move = True
            if self.is_latched:
                raise NotArmedError([_STOPPED])
        except BaseException:
            # Whatever it was: torque off may not have reached every servo.
            self.cut("not armed")
            raise
        self.restart()

    def cut(self, reason: str) -> tuple[Finding, ...]:
        """Emergency: torque off three times, and the servos' supply, at once. Goals are refused."""
        self.may_move = False
        self.latch(reason)
        self.cut_power()
        return tuple(arming.broadcast_off(self._devices.buses))

    def off(self, reason: str) -> tuple[Finding, ...]:
        """Torque off three times, verified, then the servos' supply. Goals are refused from now on."""
        self.may_move = False
        self.latch(reason)
        board = self._devices.board
        if self._board is not None and not self._board.power_on:
            # Servos without a supply are limp, and answer nobody.
            return tuple(arming.broadcast_off(self._devices.buses))
        found = arming.torque_off(self._devices.buses, self._devices.layout)
        if board is not None:
            board.cut()
            if not board.wait_power(False, _CUT_TIME):
                found.append(_STILL_ON)
        return tuple(finding for finding in found if finding.severity is Severity.REFUSAL)

    def latch(self, reason: str) -> None:
        """Refuse every write that could move a servo, from any thread, until armed."""
        self._stops += 1
        for bus in self._devices.buses:
            bus.latch.close(reason)

    def cut_power(self) -> None:
        """Cut the servos' supply, from any thread."""
        if self._devices.board is not None:
            self._devices.board.cut()

    def close(self) -> bool:
        """Cut the servos' supply, and give back every port; True where the board says that it is off."""
        devices, is_off = self._devices, False
        if devices.board is not None and self._joints is not None:
            devices.board.cut()
            is_off = devices.board.wait_power(False, _CUT_TIME)
        for bus in devices.buses:
            bus.link.close()
        for device in (devices.board, devices.lidar, devices.camera):
            if device is not None:
                device.close()
        return is_off

    # -- every period ----------------------------------------------------------

    def send(self, command: JointCommand) -> None:
        """Write goals, speeds and limits, if the robot is armed."""
        if not self.may_move:
            return
        speed = [units.register_from_speed(value) for value in command.speed.tolist()]
        limit = np.clip(command.torque_limit, 0.0, 1.0) * FULL_DUTY
        goal = self._devices.calibration.counts(command.position)
        self._devices.cycle.write(goal.astype(np.float64), np.array(speed, dtype=np.float64), limit)

    def collect(self) -> SensorFrame:
        """Let the rest of the period pass, read the servos at its end, and take what the others say."""
        clock, devices = self._clock, self._devices
        now = clock.now()
        self._due = max(self._due + self._config.period, now)
        longest = max(self._reading_times, default=0.0)
        lead = max(self._config.read_lead, self._config.lead_margin * longest)
        clock.sleep_until(self._due - min(lead, self._config.period))
        started = clock.now()
        self._joints = devices.cycle.read(self._due)
        self._reading_times.append(clock.now() - started)
        clock.sleep_until(self._due)
        if devices.board is not None:
            devices.board.poll()
            self._board = devices.board.take()
        self._beat()
        if devices.lidar is not None:
            devices.lidar.poll()
        return sensor_frame(
            clock.now(), self._joints, self._board, devices.calibration,
            lidar=None if devices.lidar is None else devices.lidar.take(),
            camera=None if devices.camera is None else devices.camera.take(),
        )  # fmt: skip

    def collect_all(self) -> SensorFrame:
        """As `collect`, until every servo has answered, some periods at most."""
        frame = self.collect()
        heard = frame.joint_valid.copy()
        for _ in range(_TRIES):
            if heard.all() or self.is_latched:
                break
            frame = self.collect()
            heard |= frame.joint_valid
        return frame

    def health(self) -> Health:
        """What the devices say of themselves, as of the last period."""
        joints, board = self._joints, self._board
        if joints is None:
            return Health(power_on=None if board is None else board.power_on)
        return Health(
            power_on=None if board is None else board.power_on,
            shut_down=_where(joints.shut),
            restarted=_where(joints.returned),
            silent=_where(joints.suspects),
            put_off=_where(joints.put_off),
            findings=() if board is None else switch_findings(board),
        )

    @property
    def is_latched(self) -> bool:
        """True while goals are refused."""
        return any(bus.latch.closed for bus in self._devices.buses)

    def _beat(self) -> None:
        self._alive()
        if self._devices.board is not None:
            self._devices.board.beat()


def _where(joints: BoolArray) -> tuple[int, ...]:
    """Numbers of the joints that are marked."""
    return tuple(np.flatnonzero(joints).tolist())
