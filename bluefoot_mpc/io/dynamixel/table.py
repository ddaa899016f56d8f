"""Control table of the AX-12A, as data.

Source: ROBOTIS e-manual, AX-12A, "Control Table" (addresses, sizes, access,
initial values, ranges); the areas are divided at address 24: below it EEPROM,
which survives loss of power and wears out with writing, from there on RAM.
"""

from __future__ import annotations

import enum
from collections.abc import Iterator
from dataclasses import dataclass

from bluefoot_mpc.exceptions import UnknownNameError

RAM_START = 24
"""First address that loses its value with the power, and may be written at any time."""


class Area(enum.Enum):
    """Where a register lives."""

    EEPROM = "EEPROM"
    RAM = "RAM"


class Access(enum.Enum):
    """What a host may do with a register."""

    READ = "read"
    WRITE = "read and write"


@dataclass(frozen=True, slots=True)
class Register:
    """One entry of a control table.

    Attributes:
        name: in words of the data sheet.
        address: of its low byte.
        size: bytes, 1 or 2, low byte first.
        area: EEPROM or RAM.
        access: whether it may be written.
        default: factory value, or value after power-up; None where the sheet gives none.
        low: least value.
        high: greatest value.
        unit: of one count; empty for plain numbers and flags.
    """

    name: str
    address: int
    size: int
    area: Area
    access: Access
    default: int | None
    low: int
    high: int
    unit: str = ""

    @property
    def end(self) -> int:
        """First address after it."""
        return self.address + self.size

    def encode(self, value: int) -> bytes:
        """The bytes of a value.

        Raises:
            ValueError: outside the register's range.
        """
        if not self.low <= value <= self.high:
            raise ValueError(f"{self.name} = {value} must lie in {self.low}..{self.high}")
        return int(value).to_bytes(self.size, "little")

    def decode(self, block: bytes, start: int | None = None) -> int:
        """The value in a block of bytes.

        Args:
            block: bytes of the table.
            start: address of the block's first byte; the register's own where not given.
        """
        at = 0 if start is None else self.address - start
        return int.from_bytes(block[at : at + self.size], "little")


@dataclass(frozen=True, slots=True)
class ControlTable:
    """All registers of a model.

    Attributes:
        model: name on the data sheet.
        model_number: value of its first register.
        source: where the table comes from.
        registers: in order of address.
    """

    model: str
    model_number: int
    source: str
    registers: tuple[Register, ...]

    def __getitem__(self, name: str) -> Register:
        """A register by name.

        Raises:
            UnknownNameError: there is none; the message lists the names.
        """
        for register in self.registers:
            if register.name == name:
                return register
        raise UnknownNameError("servo register", name, (register.name for register in self.registers))

    def __iter__(self) -> Iterator[Register]:
        """Registers in order of address."""
        return iter(self.registers)

    @property
    def size(self) -> int:
        """Bytes of the table."""
        return self.registers[-1].end


_E, _R, _RO, _RW = Area.EEPROM, Area.RAM, Access.READ, Access.WRITE

AX12A = ControlTable(
    "AX-12A",
    12,
    "ROBOTIS e-manual, AX-12A, Control Table",
    (
        Register("model_number", 0, 2, _E, _RO, 12, 0, 65535),
        Register("firmware_version", 2, 1, _E, _RO, None, 0, 255),
        Register("id", 3, 1, _E, _RW, 1, 0, 253),
        Register("baud_rate", 4, 1, _E, _RW, 1, 0, 254, "2 Mbit/s over one more"),
        Register("return_delay_time", 5, 1, _E, _RW, 250, 0, 254, "2 µs"),
        Register("cw_angle_limit", 6, 2, _E, _RW, 0, 0, 1023, "0.293°"),
        Register("ccw_angle_limit", 8, 2, _E, _RW, 1023, 0, 1023, "0.293°"),
        Register("temperature_limit", 11, 1, _E, _RW, 70, 0, 99, "°C"),
        Register("min_voltage_limit", 12, 1, _E, _RW, 60, 50, 160, "0.1 V"),
        Register("max_voltage_limit", 13, 1, _E, _RW, 140, 50, 160, "0.1 V"),
        Register("max_torque", 14, 2, _E, _RW, 1023, 0, 1023, "0.1 %"),
        Register("status_return_level", 16, 1, _E, _RW, 2, 0, 2),
        Register("alarm_led", 17, 1, _E, _RW, 36, 0, 127),
        Register("shutdown", 18, 1, _E, _RW, 36, 0, 127),
        Register("torque_enable", 24, 1, _R, _RW, 0, 0, 1),
        Register("led", 25, 1, _R, _RW, 0, 0, 1),
        Register("cw_compliance_margin", 26, 1, _R, _RW, 1, 0, 255, "0.293°"),
        Register("ccw_compliance_margin", 27, 1, _R, _RW, 1, 0, 255, "0.293°"),
        Register("cw_compliance_slope", 28, 1, _R, _RW, 32, 0, 255),
        Register("ccw_compliance_slope", 29, 1, _R, _RW, 32, 0, 255),
        Register("goal_position", 30, 2, _R, _RW, None, 0, 1023, "0.293°"),
        Register("moving_speed", 32, 2, _R, _RW, 0, 0, 2047, "0.111 rpm"),
        Register("torque_limit", 34, 2, _R, _RW, None, 0, 1023, "0.1 %"),
        Register("present_position", 36, 2, _R, _RO, None, 0, 1023, "0.293°"),
        Register("present_speed", 38, 2, _R, _RO, None, 0, 2047, "0.111 rpm"),
        Register("present_load", 40, 2, _R, _RO, None, 0, 2047, "0.1 %"),
        Register("present_voltage", 42, 1, _R, _RO, None, 0, 255, "0.1 V"),
        Register("present_temperature", 43, 1, _R, _RO, None, 0, 255, "°C"),
        Register("registered", 44, 1, _R, _RO, 0, 0, 1),
        Register("moving", 46, 1, _R, _RO, 0, 0, 1),
        Register("lock", 47, 1, _R, _RW, 0, 0, 1),
        Register("punch", 48, 2, _R, _RW, 32, 0, 1023, "0.1 %"),
    ),
)
"""Control table of the AX-12A. Default of torque limit: what max torque (14) holds at power-up."""

MOTION_START = AX12A["goal_position"].address
"""First of the registers that make a servo move: goal, speed, torque limit."""

MOTION_END = AX12A["torque_limit"].end
