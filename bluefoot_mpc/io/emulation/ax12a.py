"""One emulated AX-12A: its control table, and what it answers to an instruction packet.

Source: ROBOTIS' AX-12A e-manual and Protocol 1.0. Where they are silent, this
emulator does the following, and a driver must not rely on it:

- A write that is refused for any reason (range, angle limit, read-only, locked)
  changes nothing at all, not even those of its registers that were fine.
- A write to a read-only register, or to the locked EEPROM, is a range error; so
  is a read past the end of the table. A parameter count that does not fit the
  instruction is an instruction error.
- An angle limit error refuses the goal. It needs a goal in joint mode outside
  the limits; wheel mode takes every goal and ignores it.
- A write to the goal position switches the torque on, except in wheel mode.
- The reply to a change of ID or baud rate still comes from the old ID at the old
  rate; the new ones hold from the next packet. RESET likewise.
- A new status return level or return delay holds for the reply to its own write.
- Errors of an instruction (range, checksum, angle limit, instruction) show in its
  own reply only; voltage, heat and overload in every reply while they last.
- Overload: the motor has pushed at its torque limit for 2 s and the shaft hardly
  moved. It ends when either ends.
- An alarm shutdown puts the torque limit (34) to 0 and leaves torque enable as it
  is. While the cause lasts, whatever is written to 34 becomes 0 at once.
- Moving: torque is on, the goal is outside the margin, and the shaft turns.
- RESET to the broadcast ID is obeyed. A broadcast PING or READ stays unanswered.
- Positions outside the 300° read as the nearer end of the range.
- Firmware version 24. After power-up the goal is the present position, moving
  speed is 0, and for 0.1 s nothing is heard.
"""

from __future__ import annotations

import math
from collections.abc import Callable

from bluefoot_mpc.io.emulation.ax12a_checks import is_wheel, refusal
from bluefoot_mpc.io.emulation.ax12a_table import (
    ACTION,
    BAUD,
    EEPROM_SIZE,
    FACTORY,
    GOAL,
    ID,
    INSTRUCTION,
    MARGIN,
    MAX_TORQUE,
    MAX_VOLTAGE,
    MIN_VOLTAGE,
    MOVING,
    OVERHEATING,
    OVERLOAD,
    PING,
    POSITION,
    PUNCH,
    RANGE,
    READ,
    REG_WRITE,
    REGISTERED,
    RESET,
    SHUTDOWN,
    SLOPE,
    SLOPES,
    SPEED,
    STATUS_LEVEL,
    TABLE_SIZE,
    TEMPERATURE_LIMIT,
    TORQUE_ENABLE,
    TORQUE_LIMIT,
    VOLTAGE,
    WRITE,
)
from bluefoot_mpc.io.emulation.shafts import COUNT, MIDDLE, ShaftDrive, Shafts
from bluefoot_mpc.model.servo import SPEED_UNIT

OVERLOAD_TIME = 2.0
"""s at the torque limit without moving until it counts as overload."""
BOOT_TIME = 0.1
"""s after power-up in which a servo hears nothing."""

_DIRECTION = 1 << 10
_STALLED = 8  # counts of speed, 0.9 rpm


class EmulatedServo:
    """Registers of one servo and the joint that they drive.

    Attributes:
        registers: (50,) bytes of the control table as they are; `read` and
            `write` access a register by address for tests.
        eeprom_writes: instructions that changed or could have changed the EEPROM.
        goal_writes_while_off: goals that switched the torque on.
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
        self.eeprom_writes = 0
        self.goal_writes_while_off = 0
        self.is_plugged = True
        self.forced_temperature: float | None = None
        self.forced_voltage: float | None = None
        self.forced_overload = False
        self._shafts = shafts
        self._rewired = rewired
        self._registered: tuple[int, bytes] | None = None
        self._state_error = 0
        self._pushing_since = math.inf
        self._is_powered = False
        self._hears_from = -math.inf
        self.power_up(-math.inf)

    # Power.

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
        self._registered = None
        self._shafts.drive(self.index, ShaftDrive())

    def power_up(self, time: float) -> None:
        """Get supply, at `time` (s): RAM from the EEPROM and the factory's defaults, torque off."""
        self._is_powered = True
        self._hears_from = time + BOOT_TIME
        registers = self.registers
        registers[EEPROM_SIZE:] = FACTORY[EEPROM_SIZE:]
        registers[TORQUE_LIMIT : TORQUE_LIMIT + 2] = registers[MAX_TORQUE : MAX_TORQUE + 2]
        self._registered = None
        self._state_error = 0
        self._pushing_since = math.inf
        self.sense(time)
        registers[GOAL : GOAL + 2] = registers[POSITION : POSITION + 2]
        self._drive()

    # Access for tests.

    def read(self, address: int, size: int = 1) -> int:
        """A register's value."""
        return int.from_bytes(self.registers[address : address + size], "little")

    def write(self, address: int, value: int, size: int = 1) -> None:
        """Put a value into a register without any check, as if it had always been there."""
        self.registers[address : address + size] = value.to_bytes(size, "little")
        self._drive()
        self._rewired()

    # The bus.

    def execute(self, instruction: int, data: bytes, time: float) -> bytes | None:
        """Do an instruction that is for this servo; the status packet, or None.

        Args:
            instruction: its number.
            data: its parameters.
            time: s, end of the packet.
        """
        identity = self.registers[ID]
        answer = b""
        if instruction == READ:
            self.sense(time)
            error, answer = self._read(data)
        elif instruction == WRITE:
            self.sense(time)
            error = self.store(data[0], data[1:], time) if len(data) > 1 else INSTRUCTION
        elif instruction == PING:
            self.sense(time)
            error = INSTRUCTION if data else 0
        else:
            error = self._execute_rarely(instruction, data, time)
        # Level 0 answers a PING only, level 1 READ as well.
        level = self.registers[STATUS_LEVEL]
        if instruction != PING and (level == 0 or (level == 1 and instruction != READ)):
            return None
        return self.status(identity, error, answer)

    def complain(self, error: int, time: float) -> bytes | None:
        """The status packet to a broken packet with this servo's ID; None where the level forbids it."""
        self.sense(time)
        return self.status(self.registers[ID], error) if self.registers[STATUS_LEVEL] == 2 else None

    def status(self, identity: int, error: int, data: bytes = b"") -> bytes:
        """A status packet with the errors that last added."""
        length = len(data) + 2
        error |= self._state_error
        total = identity + length + error + sum(data)
        return bytes((0xFF, 0xFF, identity, length, error)) + data + bytes((~total & 0xFF,))

    def store(self, address: int, data: bytes, time: float) -> int:
        """Write registers, or nothing; returns error bits."""
        if self._state_error:  # whose cause may be gone
            self.sense(time)
        error = refusal(self.registers, address, data)
        if error:
            return error
        registers = self.registers
        end = address + len(data)
        if address < EEPROM_SIZE:
            self.eeprom_writes += 1
        registers[address:end] = data
        if (
            address <= GOAL + 1
            and end > GOAL
            and not is_wheel(self.registers)
            and not registers[TORQUE_ENABLE]
        ):
            registers[TORQUE_ENABLE] = 1
            self.goal_writes_while_off += 1
        if self._state_error & registers[SHUTDOWN]:
            self._shut_down()
        self._drive()
        if address <= BAUD and end > ID:
            self._rewired()
        return 0

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

    def _lasting_errors(self, volts: int, degrees: int, load: int, speed: int, time: float) -> int:
        """Error bits of what lasts; quantities as in the registers, without direction bits."""
        registers = self.registers
        error = 0
        if not registers[MIN_VOLTAGE] <= volts <= registers[MAX_VOLTAGE]:
            error = VOLTAGE
        if degrees > registers[TEMPERATURE_LIMIT]:
            error |= OVERHEATING
        if self._is_overloaded(load, speed, time) or self.forced_overload:
            error |= OVERLOAD
        return error

    def _is_overloaded(self, load: int, speed: int, time: float) -> bool:
        limit = self.registers[TORQUE_LIMIT] | self.registers[TORQUE_LIMIT + 1] << 8
        if limit == 0 or load < limit - 1 or speed > _STALLED:
            self._pushing_since = math.inf
            return False
        self._pushing_since = min(self._pushing_since, time)
        return time - self._pushing_since > OVERLOAD_TIME

    def _shut_down(self) -> None:
        self.registers[TORQUE_LIMIT] = self.registers[TORQUE_LIMIT + 1] = 0

    def _read(self, data: bytes) -> tuple[int, bytes]:
        if len(data) != 2:
            return INSTRUCTION, b""
        address, count = data
        if count == 0 or address + count > TABLE_SIZE:
            return RANGE, b""
        return 0, bytes(self.registers[address : address + count])

    def _execute_rarely(self, instruction: int, data: bytes, time: float) -> int:
        """REG WRITE, ACTION, RESET and what does not exist; returns error bits."""
        self.sense(time)
        if instruction == REG_WRITE and len(data) > 1:
            error = refusal(self.registers, data[0], data[1:])
            if not error:
                self._registered = (data[0], data[1:])
                self.registers[REGISTERED] = 1
            return error
        if instruction == ACTION and not data and self._registered is not None:
            address, values = self._registered
            self._registered = None
            self.registers[REGISTERED] = 0
            return self.store(address, values, time)
        if instruction == RESET and not data:
            self.eeprom_writes += 1
            self.registers[:EEPROM_SIZE] = FACTORY[:EEPROM_SIZE]
            self._drive()
            self._rewired()
            return 0
        return INSTRUCTION

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
