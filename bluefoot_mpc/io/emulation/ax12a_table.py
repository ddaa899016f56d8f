"""The AX-12A's control table as an emulated servo needs it: by address, with the factory's bytes."""

from __future__ import annotations

from bluefoot_mpc.io.dynamixel.table import AX12A, RAM_START, Register

VOLTAGE, ANGLE_LIMIT, OVERHEATING, RANGE, CHECKSUM, OVERLOAD, INSTRUCTION = (1 << bit for bit in range(7))
"""Error bits of a status packet."""

PING, READ, WRITE, REG_WRITE, ACTION, RESET, SYNC_WRITE = 1, 2, 3, 4, 5, 6, 0x83
"""Instructions of Protocol 1.0."""

BROADCAST = 254
"""ID that every servo obeys and none answers."""

FIRMWARE = 24
"""Version that emulated servos report."""
TABLE_SIZE = AX12A.size
"""Bytes of the table."""
EEPROM_SIZE = RAM_START
"""Bytes of it that survive without power."""

(
    ID, BAUD, RETURN_DELAY, CW_LIMIT, CCW_LIMIT, TEMPERATURE_LIMIT, MIN_VOLTAGE, MAX_VOLTAGE, MAX_TORQUE,
    STATUS_LEVEL, SHUTDOWN, TORQUE_ENABLE, MARGIN, SLOPE, GOAL, SPEED, TORQUE_LIMIT, POSITION, REGISTERED,
    MOVING, LOCK, PUNCH,
) = (
    AX12A[name].address
    for name in (
        "id", "baud_rate", "return_delay_time", "cw_angle_limit", "ccw_angle_limit", "temperature_limit",
        "min_voltage_limit", "max_voltage_limit", "max_torque", "status_return_level", "shutdown",
        "torque_enable", "cw_compliance_margin", "cw_compliance_slope", "goal_position", "moving_speed",
        "torque_limit", "present_position", "registered", "moving", "lock", "punch",
    )
)  # fmt: skip

CELLS: tuple[Register | None, ...] = tuple(
    next((register for register in AX12A if register.address <= address < register.end), None)
    for address in range(TABLE_SIZE)
)
"""For every address the register that covers it, None where there is none."""


def _factory() -> bytes:
    table = bytearray(TABLE_SIZE)
    for register in AX12A:
        table[register.address : register.end] = (register.default or 0).to_bytes(register.size, "little")
    table[AX12A["firmware_version"].address] = FIRMWARE
    return bytes(table)


FACTORY = _factory()
"""The table as the factory leaves it: ID 1 at 1 Mbit/s."""

SLOPES = tuple(2 << min(6, max(0, value.bit_length() - 2)) for value in range(256))
"""Counts of error for full duty by the value of a compliance-slope register: 2, 4, … 128."""
