"""What can go wrong between host and servo: each names the servo, the port, and what to look at."""

from __future__ import annotations

from bluefoot_mpc.exceptions import DeviceError
from bluefoot_mpc.io.dynamixel.codec import error_words


class ServoError(DeviceError):
    """A transaction with a servo failed.

    Args:
        servo: its ID.
        port: where it hangs.
        text: what happened.
        mend: what to check.

    Attributes:
        servo: its ID.
        port: where it hangs.
    """

    def __init__(self, servo: int, port: str, text: str, mend: str) -> None:
        self.servo, self.port = servo, port
        super().__init__(f"servo {servo} on {port}: {text}. {mend}")


class NoReplyError(ServoError):
    """A servo did not answer in time."""

    def __init__(self, servo: int, port: str, tries: int) -> None:
        super().__init__(
            servo,
            port,
            f"no reply to {tries} request{'s' if tries > 1 else ''}",
            "Check its cable, the servos' power, its ID and the baud rate",
        )


class CorruptReplyError(ServoError):
    """A servo's answer came garbled, short, or was not the one that was asked for."""

    def __init__(self, servo: int, port: str, what: str) -> None:
        super().__init__(
            servo,
            port,
            f"no usable reply: {what}",
            "Check the cable and its ground, that the ID is not given twice, and the baud rate",
        )


class ServoFaultError(ServoError):
    """A servo answered that it would not do what it was told, or did not do it.

    Attributes:
        error: `ErrorBit`s of its answer.
    """

    def __init__(self, servo: int, port: str, error: int, what: str = "") -> None:
        self.error = error
        super().__init__(
            servo,
            port,
            what or f"it refused: {error_words(error)}",
            "Check the value against the control table of an AX-12A, and that it is one",
        )


class LatchedError(DeviceError):
    """Something would have moved a servo after an emergency stop, and was not sent."""

    def __init__(self, port: str, reason: str) -> None:
        self.port = port
        super().__init__(
            f"{port}: servos are latched off ({reason}); nothing that could move them was sent. "
            "Mend the cause, then arm again"
        )


class EepromRefusedError(DeviceError):
    """Something would have written a servo's permanent memory, and was not sent."""

    def __init__(self, port: str, address: int) -> None:
        self.port = port
        super().__init__(
            f"{port}: register {address} is permanent memory (EEPROM), which a running robot never writes. "
            "Use the commissioning command `bluefoot servo`"
        )


class CommandRangeError(DeviceError):
    """A goal, speed or limit that no register can hold; nothing was sent."""
