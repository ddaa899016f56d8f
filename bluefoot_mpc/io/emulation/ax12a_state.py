"""State of an emulated AX-12A: its registers, its supply, what it measures, and what makes it shut down.

Source: ROBOTIS' AX-12A e-manual; `ax12a` lists what was chosen where it is silent.
"""

from __future__ import annotations

import math
from collections.abc import Callable

from bluefoot_mpc.io.emulation.ax12a_checks import is_wheel
from bluefoot_mpc.io.emulation.ax12a_table import (
    BAUD,
    EEPROM_SIZE,
    FACTORY,
    GOAL,
    ID,
    MARGIN,
    MAX_TORQUE,
    MAX_VOLTAGE,
    MIN_VOLTAGE,
    MOVING,
    OVERHEATING,
    OVERLOAD,
    POSITION,
    PUNCH,
    REGISTERED,
    SHUTDOWN,
    SLOPE,
    SLOPES,
    SPEED,
    TEMPERATURE_LIMIT,
    TORQUE_ENABLE,
    TORQUE_LIMIT,
    VOLTAGE,
)
from bluefoot_mpc.io.emulation.shafts import COUNT, MIDDLE, ShaftDrive, Shafts
from bluefoot_mpc.model.servo import SPEED_UNIT

OVERLOAD_TIME = 2.0
"""s at the torque limit without moving until it counts as overload."""
BOOT_TIME = 0.1
"""s after power-up in which a servo hears nothing."""

_DIRECTION = 1 << 10
_STALLED = 8  # counts of speed, 0.9 rpm


class ServoState:
    """Registers of one servo and the joint that they drive.

    Attributes:
        registers: (50,) bytes of the control table as they are; `read` and
            `write` access a register by address for tests.
        is_plugged: False while it hangs in the air: no power, no bus.
        forced_temperature, forced_voltage, forced_overload: what a test makes the
            servo feel instead of what its joint says, °C and V; None is the joint's.

    Args:
        shafts: the joints.
        index: of this servo's joint.
        identity: ID at the start.
        baud_register: of the baud rate at the start (register 4).
        rewired: called when ID or baud rate have changed.
    """

    def __init__(
        self,
        shafts: Shafts,
        index: int,
        identity: int,
        baud_register: int = 1,
        rewired: Callable[[], None] = lambda: None,
    ) -> None:
        self.index = index
        self.registers = bytearray(FACTORY)
        self.registers[ID] = identity
        self.registers[BAUD] = baud_register
        self.is_plugged = True
        self.forced_temperature: float | None = None
        self.forced_voltage: float | None = None
        self.forced_overload = False
        self._shafts = shafts
        self._rewired = rewired
        self._registered: tuple[int, bytes] | None = None
        self._state_error = 0
        self._pushing_since = math.inf
        self._gave_up = False
        self._is_powered = False
        self._hears_from = -math.inf
        self.power_up(-math.inf)

    @property
    def identity(self) -> int:
        """The ID it answers to."""
        return self.registers[ID]

    @property
    def baud(self) -> float:
        """Bit/s it listens at."""
        return 2_000_000 / (self.registers[BAUD] + 1)

    def hears(self, time: float) -> bool:
        """True where it is powered and has started."""
        return self._is_powered and time >= self._hears_from

    def power_down(self) -> None:
        """Lose supply: limp, the RAM is lost."""
        self._is_powered = False
        self._forget()
        self._drive()

    def power_up(self, time: float) -> None:
        """Get supply, at `time` (s): RAM from the EEPROM and the factory's defaults, torque off."""
        self._is_powered = True
        self._hears_from = time + BOOT_TIME
        self._forget()
        self.sense(time)
        self.registers[GOAL : GOAL + 2] = self.registers[POSITION : POSITION + 2]
        self._drive()

    def read(self, address: int, size: int = 1) -> int:
        """A register's value."""
        return int.from_bytes(self.registers[address : address + size], "little")

    def write(self, address: int, value: int, size: int = 1) -> None:
        """Put a value into a register without any check, as if it had always been there."""
        self.registers[address : address + size] = value.to_bytes(size, "little")
        self._drive()
        self._rewired()

    def sense(self, time: float) -> None:
        """Bring the registers of what is measured (36..46) and the lasting errors up to date."""
        state = self._shafts.state(self.index)
        registers = self.registers
        count = math.floor(state.angle * (1.0 / COUNT) + 0.5) + MIDDLE
        count = 0 if count < 0 else 1023 if count > 1023 else count
        speed = _signed(state.speed / SPEED_UNIT)
        load = _signed(state.load * 1023.0)
        voltage = state.voltage if self.forced_voltage is None else self.forced_voltage
        heat = state.temperature if self.forced_temperature is None else self.forced_temperature
        volts = min(max(int(voltage * 10.0 + 0.5), 0), 255)
        degrees = min(max(int(heat), 0), 255)
        registers[POSITION:REGISTERED] = bytes(
            (count & 255, count >> 8, speed & 255, speed >> 8, load & 255, load >> 8, volts, degrees)
        )
        error = self._lasting_errors(volts, degrees, load & 1023, speed & 1023, time)
        if error != self._state_error:
            self._state_error = error
            if error & registers[SHUTDOWN]:
                self._shut_down()
                self._drive()
        off = abs(self.read(GOAL, 2) - count)
        is_moving = registers[TORQUE_ENABLE] and speed & 1023 and off > registers[MARGIN]
        registers[MOVING] = 1 if is_moving else 0

    def _forget(self) -> None:
        """Lose the RAM and all that came with the power."""
        registers = self.registers
        registers[EEPROM_SIZE:] = FACTORY[EEPROM_SIZE:]
        registers[TORQUE_LIMIT : TORQUE_LIMIT + 2] = registers[MAX_TORQUE : MAX_TORQUE + 2]
        self._registered = None
        self._state_error = 0
        self._pushing_since = math.inf
        self._gave_up = False

    def _lasting_errors(self, volts: int, degrees: int, load: int, speed: int, time: float) -> int:
        """Error bits of what lasts; quantities as in the registers, without direction bits."""
        registers = self.registers
        error = 0
        if not registers[MIN_VOLTAGE] <= volts <= registers[MAX_VOLTAGE]:
            error = VOLTAGE
        if degrees > registers[TEMPERATURE_LIMIT]:
            error |= OVERHEATING
        if self._is_overloaded(load, speed, time) or self.forced_overload or self._gave_up:
            error |= OVERLOAD
        return error

    def _relieve(self) -> None:
        """The torque limit is rewritten: a servo that gave up under an overload tries again."""
        if self._gave_up:
            self._gave_up = False
            self._state_error &= ~OVERLOAD

    def _is_overloaded(self, load: int, speed: int, time: float) -> bool:
        limit = self.registers[TORQUE_LIMIT] | self.registers[TORQUE_LIMIT + 1] << 8
        if limit == 0 or load < limit - 1 or speed > _STALLED:
            self._pushing_since = math.inf
            return False
        self._pushing_since = min(self._pushing_since, time)
        return time - self._pushing_since > OVERLOAD_TIME

    def _shut_down(self) -> None:
        """Alarm shutdown."""
        # Without torque the overload is over; it shows until somebody rewrites the limit.
        self._gave_up |= bool(self._state_error & OVERLOAD & self.registers[SHUTDOWN])
        self.registers[TORQUE_LIMIT] = self.registers[TORQUE_LIMIT + 1] = 0

    def _drive(self) -> None:
        """Let the registers act on the joint."""
        r = self.registers
        limit = r[TORQUE_LIMIT] | r[TORQUE_LIMIT + 1] << 8
        self._shafts.drive(
            self.index,
            ShaftDrive(
                enabled=bool(self._is_powered and r[TORQUE_ENABLE] and limit),
                goal=r[GOAL] | r[GOAL + 1] << 8,
                speed=r[SPEED] | r[SPEED + 1] << 8,
                torque_limit=limit,
                is_wheel=is_wheel(self.registers),
                margin=(r[MARGIN], r[MARGIN + 1]),
                slope=(SLOPES[r[SLOPE]], SLOPES[r[SLOPE + 1]]),
                punch=r[PUNCH] | r[PUNCH + 1] << 8,
            ),
        )


def _signed(value: float) -> int:
    """Magnitude in ten bits, bit 10 for clockwise."""
    size = min(int(abs(value) + 0.5), 1023)
    return size | _DIRECTION if value < 0.0 and size else size
