"""A gamepad through Linux's joystick device, read without a library and without waiting."""

from __future__ import annotations

import os
import struct
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from bluefoot_mpc.cli.teleop import Vector3

_EVENT = struct.Struct("<IhBB")  # ms, value, type, number (linux/joystick.h)
_BUTTON, _AXIS, _INITIAL = 0x01, 0x02, 0x80
_FULL = 32767.0
_KEYS = {0: "g", 1: "space", 2: "c", 3: "t", 7: "x"}
"""Key that a button stands for: A gait, B stop, X level the trunk, Y sit or stand, Start end."""
_FORWARD, _SIDEWAYS, _TURN = 1, 0, 3
"""Axes: left stick up and down, left stick left and right, right stick left and right."""


def decode_events(data: bytes) -> Iterator[tuple[int, int, int]]:
    """(type, number, value) of every whole event in `data`; the state at opening counts as events."""
    whole = len(data) - len(data) % _EVENT.size
    for _, value, kind, number in _EVENT.iter_unpack(data[:whole]):
        yield kind & ~_INITIAL, number, value


@dataclass(slots=True)
class Gamepad:
    """One gamepad, if there is one; unplugging it centres its sticks.

    Attributes:
        device: path of the joystick device.
        name: what to call it in messages, or "" where there is none.
    """

    device: Path
    name: str = ""
    _descriptor: int = -1
    _axes: dict[int, float] = field(default_factory=dict)

    def open(self) -> bool:
        """Open the device; False where there is none, or it may not be read."""
        try:
            self._descriptor = os.open(self.device, os.O_RDONLY | os.O_NONBLOCK)
        except OSError:
            return False
        self.name = str(self.device)
        return True

    def read(self) -> tuple[Vector3, list[str]]:
        """Sticks (forward, left, turn to the left; -1..1) and the keys that pressed buttons stand for."""
        keys: list[str] = []
        for kind, number, value in decode_events(self._arrived()):
            if kind == _AXIS:
                self._axes[number] = value / _FULL
            elif kind == _BUTTON and value and number in _KEYS:
                keys.append(_KEYS[number])
        # The device counts down and right as positive.
        forward, left, turn = (-self._axes.get(axis, 0.0) + 0.0 for axis in (_FORWARD, _SIDEWAYS, _TURN))
        return (forward, left, turn), keys

    def close(self) -> None:
        """Give the device back. Idempotent."""
        if self._descriptor >= 0:
            os.close(self._descriptor)
        self._descriptor = -1
        self._axes.clear()

    def _arrived(self) -> bytes:
        if self._descriptor < 0:
            return b""
        try:
            return os.read(self._descriptor, 64 * _EVENT.size)
        except BlockingIOError:
            return b""
        except OSError:  # unplugged
            self.close()
            return b""
