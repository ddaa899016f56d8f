"""Which writes an emulated AX-12A refuses, and with what error."""

from __future__ import annotations

from bluefoot_mpc.io.dynamixel.table import Access, Register
from bluefoot_mpc.io.emulation.ax12a_table import (
    ANGLE_LIMIT,
    CCW_LIMIT,
    CELLS,
    CW_LIMIT,
    EEPROM_SIZE,
    GOAL,
    LOCK,
    RANGE,
    SPEED,
    TABLE_SIZE,
)

_JOINT_SPEED = 1023
"""Highest moving speed in joint mode; wheel mode has a direction besides."""


def refusal(registers: bytearray, address: int, data: bytes) -> int:
    """Error bits of a write that is refused as a whole; 0 where it is fine.

    Args:
        registers: (50,) bytes as they are.
        address: of the first byte written.
        data: bytes to write.
    """
    end = address + len(data)
    if end > TABLE_SIZE or (address < EEPROM_SIZE and registers[LOCK]):
        return RANGE
    error = 0
    position = address
    while position < end:
        cell = CELLS[position]
        if cell is None:  # an address without a register, taken and kept
            position += 1
            continue
        error |= _refusal_of(registers, cell, position, data[position - address :])
        position = cell.end
    return error


def is_wheel(registers: bytearray) -> bool:
    """True where both angle limits are 0."""
    return not any(registers[CW_LIMIT : CCW_LIMIT + 2])


def _refusal_of(registers: bytearray, cell: Register, position: int, data: bytes) -> int:
    """Error bits of a write to one register, or to the part of it that `data` covers from `position` on."""
    if cell.access is not Access.WRITE:
        return RANGE
    if position == cell.address and len(data) >= cell.size:
        value = data[0] if cell.size == 1 else data[0] | data[1] << 8
    else:
        value = _patched(registers, cell, position, data)
    high = cell.high
    if cell.address == SPEED and not is_wheel(registers):
        high = _JOINT_SPEED
    if not cell.low <= value <= high:
        return RANGE
    # The lock can be set and not taken back.
    if cell.address == LOCK and value == 0 and registers[LOCK]:
        return RANGE
    if cell.address == GOAL and not is_wheel(registers):
        low = registers[CW_LIMIT] | registers[CW_LIMIT + 1] << 8
        high = registers[CCW_LIMIT] | registers[CCW_LIMIT + 1] << 8
        return 0 if low <= value <= high else ANGLE_LIMIT
    return 0


def _patched(registers: bytearray, cell: Register, position: int, data: bytes) -> int:
    """Value of a register of which only some bytes are written."""
    block = registers[cell.address : cell.end]
    offset = position - cell.address
    given = data[: cell.size - offset]
    block[offset : offset + len(given)] = given
    return int.from_bytes(block, "little")
