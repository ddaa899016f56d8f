"""Numbers, sums and blocks of SCIP 2.0. Pure; source: SCIP 2.0 specification C-42-03320B.

A number is cut into groups of six bits, highest first, and 0x30 is added to
each; a sum is the lowest six bits of the sum of all characters, plus 0x30. Data go
in blocks of 64 characters, each with its sum and a line feed.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bluefoot_mpc.io.lidar.errors import ScipError

BLOCK = 64
STAMP_BITS = 24
STAMP_UNIT = 0.001
"""s a count of the sensor's clock, which wraps after 4.66 h."""
STAMP_CHARACTERS = 4
_BASE = 0x30
_MASK = 0x3F
_TOP = _BASE + _MASK


def checksum(text: bytes) -> int:
    """The character that stands after `text`."""
    return (sum(text) & _MASK) + _BASE


def with_sum(text: bytes) -> bytes:
    """`text` and its sum."""
    return text + bytes((checksum(text),))


def without_sum(line: bytes) -> bytes:
    """The characters before a line's sum.

    Raises:
        ScipError: the line is empty or the sum is wrong.
    """
    if not line or checksum(line[:-1]) != line[-1]:
        raise ScipError(f"wrong sum of a line of {len(line)} characters")
    return line[:-1]


def encode_number(value: int, characters: int) -> bytes:
    """A number in `characters` characters.

    Raises:
        ScipError: it does not fit.
    """
    if not 0 <= value < 1 << 6 * characters:
        raise ScipError(f"{value} does not fit into {characters} characters")
    return bytes((value >> 6 * place & _MASK) + _BASE for place in reversed(range(characters)))


def decode_number(text: bytes) -> int:
    """The number that `text` stands for.

    Raises:
        ScipError: a character is none of the code.
    """
    value = 0
    for character in text:
        if not _BASE <= character <= _TOP:
            raise ScipError(f"character 0x{character:02x} is none of the code")
        value = value << 6 | character - _BASE
    return value


def encode_values(values: NDArray[np.int64], characters: int) -> bytes:
    """(n,) numbers in 2 or 3 characters each.

    Raises:
        ScipError: one does not fit.
    """
    if len(values) and not (int(values.min()) >= 0 and int(values.max()) < 1 << 6 * characters):
        raise ScipError(f"values {values.min()}..{values.max()} do not fit into {characters} characters")
    places = 6 * np.arange(characters - 1, -1, -1)
    return ((values[:, None] >> places & _MASK) + _BASE).astype(np.uint8).tobytes()


def decode_values(text: bytes, characters: int) -> NDArray[np.int64]:
    """(n,) numbers from 2 or 3 characters each.

    Raises:
        ScipError: the length does not fit, or a character is none of the code.
    """
    if len(text) % characters:
        raise ScipError(f"{len(text)} characters are not a multiple of {characters}")
    digits = np.frombuffer(text, dtype=np.uint8).astype(np.int64) - _BASE
    if len(digits) and not (int(digits.min()) >= 0 and int(digits.max()) <= _MASK):
        raise ScipError("a character of the data is none of the code")
    places = 1 << 6 * np.arange(characters - 1, -1, -1)
    return np.asarray(digits.reshape(-1, characters) @ places, dtype=np.int64)


def encode_blocks(text: bytes) -> bytes:
    """Data in lines of 64 characters, sum and line feed."""
    pieces = (text[at : at + BLOCK] for at in range(0, len(text), BLOCK))
    return b"".join(with_sum(piece) + b"\n" for piece in pieces)


def decode_blocks(lines: tuple[bytes, ...], size: int) -> bytes:
    """The data in lines without line feeds.

    Args:
        lines: lines of a reply.
        size: characters that must come out.

    Raises:
        ScipError: a sum, or the length of a line, is wrong.
    """
    for line in lines[:-1]:
        if len(line) != BLOCK + 1:
            raise ScipError(f"a line of {len(line)} characters inside the data")
    text = b"".join([without_sum(line) for line in lines])
    if len(text) != size:
        raise ScipError(f"{len(text)} characters of data where {size} were asked for")
    return text
