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
  moved. It ends when either ends, but where it shut the servo down it shows until
  the torque limit is rewritten.
- An alarm shutdown puts the torque limit (34) to 0 and leaves torque enable as it
  is. While the cause lasts, whatever is written to 34 becomes 0 at once.
- Moving: torque is on, the goal is outside the margin, and the shaft turns.
- RESET to the broadcast ID is obeyed. A broadcast PING or READ stays unanswered.
- Positions outside the 300° read as the nearer end of the range.
- Firmware version 24. After power-up the goal is the present position, moving
  speed is 0, and for 0.1 s nothing is heard.
"""

from __future__ import annotations

from bluefoot_mpc.io.emulation.ax12a_checks import is_wheel, refusal
from bluefoot_mpc.io.emulation.ax12a_state import ServoState
from bluefoot_mpc.io.emulation.ax12a_table import (
    ACTION,
    BAUD,
    EEPROM_SIZE,
    FACTORY,
    GOAL,
    ID,
    INSTRUCTION,
    PING,
    RANGE,
    READ,
    REG_WRITE,
    REGISTERED,
    RESET,
    SHUTDOWN,
    STATUS_LEVEL,
    TABLE_SIZE,
    TORQUE_ENABLE,
    TORQUE_LIMIT,
    WRITE,
)


class EmulatedServo(ServoState):
    """A servo as the bus sees it; see `ServoState` for its arguments.

    Attributes:
        eeprom_writes: instructions that changed or could have changed the EEPROM.
        goal_writes_while_off: goals that switched the torque on.
    """

    eeprom_writes = 0
    goal_writes_while_off = 0

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
        is_goal = address <= GOAL + 1 and end > GOAL and not is_wheel(registers)
        if is_goal and not registers[TORQUE_ENABLE]:
            registers[TORQUE_ENABLE] = 1
            self.goal_writes_while_off += 1
        if address <= TORQUE_LIMIT + 1 and end > TORQUE_LIMIT and not self.forced_overload:
            self._relieve()
        if self._state_error & registers[SHUTDOWN]:
            self._shut_down()
        self._drive()
        if address <= BAUD and end > ID:
            self._rewired()
        return 0

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
