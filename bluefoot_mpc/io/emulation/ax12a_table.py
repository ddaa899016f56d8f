"""The AX-12A's control table as an emulated servo needs it: by address, with factory bytes."""

from __future__ import annotations

from typing import NamedTuple


class Cell(NamedTuple):
    """A register by where it lies."""

    address: int
    size: int
    is_writable: bool
    default: int
    low: int
    high: int


_TABLE = (
    (0, 2, 0, 12, 0, 65535), (2, 1, 0, 24, 0, 255), (3, 1, 1, 1, 0, 253), (4, 1, 1, 1, 0, 254),
    (5, 1, 1, 250, 0, 254), (6, 2, 1, 0, 0, 1023), (8, 2, 1, 1023, 0, 1023), (11, 1, 1, 70, 0, 150),
    (12, 1, 1, 60, 50, 250), (13, 1, 1, 140, 50, 250), (14, 2, 1, 1023, 0, 1023), (16, 1, 1, 2, 0, 2),
    (17, 1, 1, 36, 0, 127), (18, 1, 1, 36, 0, 127), (24, 1, 1, 0, 0, 1), (25, 1, 1, 0, 0, 1),
    (26, 1, 1, 1, 0, 255), (27, 1, 1, 1, 0, 255), (28, 1, 1, 32, 0, 255), (29, 1, 1, 32, 0, 255),
    (30, 2, 1, 0, 0, 1023), (32, 2, 1, 0, 0, 2047), (34, 2, 1, 1023, 0, 1023), (36, 2, 0, 0, 0, 1023),
    (38, 2, 0, 0, 0, 2047), (40, 2, 0, 0, 0, 2047), (42, 1, 0, 0, 0, 255), (43, 1, 0, 0, 0, 255),
    (44, 1, 0, 0, 0, 1), (46, 1, 0, 0, 0, 1), (47, 1, 1, 0, 0, 1), (48, 2, 1, 32, 0, 1023),
)  # fmt: skip

TABLE_SIZE = 50
"""Bytes of the table."""
EEPROM_SIZE = 24
"""Bytes of it that survive without power."""

CELLS: tuple[Cell | None, ...] = tuple(
    next((Cell(a, s, bool(w), d, lo, hi) for a, s, w, d, lo, hi in _TABLE if a <= at < a + s), None)
    for at in range(TABLE_SIZE)
)
"""For every address the register that covers it, None where there is none."""


def _factory() -> bytes:
    table = bytearray(TABLE_SIZE)
    for cell in CELLS:
        if cell is not None:
            table[cell.address : cell.address + cell.size] = cell.default.to_bytes(cell.size, "little")
    return bytes(table)


FACTORY = _factory()
"""The table as the factory leaves it, ID 1 at 1 Mbit/s."""

SLOPES = tuple(2 << min(7, max(0, (value if value > 0 else 1).bit_length() - 2)) for value in range(256))
"""Counts of error for full duty by the compliance-slope register's value."""
