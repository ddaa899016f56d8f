"""What shall go wrong on emulated lines, and when: a plan, read from a TOML file.

    seed = 7                    # of what is drawn

    [[fault]]
    kind = "drop_reply"
    servo = 5                   # every servo unless given
    start = 10.0                # s after the line began; 0 unless given
    end = 12.0                  # for ever unless given
    probability = 0.1           # of each reply; always unless given

`docs/emulator.md` lists the kinds. A fault acts on the line that `device` names:
``servos`` unless given, ``board`` or ``lidar``.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal, get_args

from bluefoot_mpc.exceptions import ConfigurationError, UnknownNameError
from bluefoot_mpc.settings import build, read_toml, require_nonnegative, require_range

LineName = Literal["servos", "board", "lidar"]
"""Lines of the robot."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Kind:
    """A kind of fault.

    Attributes:
        text: what it does, for lists of valid kinds.
        acts_on: ``"reply"`` (each reply, or piece of what a device sends), ``"request"`` (each piece of
            what the host sends), ``"line"``, ``"servo"`` (a servo for a while), ``"start"`` (a servo as it
            is found).
        value: what `Fault.value` is unless given; NaN where it has no meaning, None where it must be given.
        unit: of the value.
        servos_only: makes no sense on another line.
    """

    text: str
    acts_on: str
    value: float | None = math.nan
    unit: str = ""
    servos_only: bool = False


KINDS: dict[str, Kind] = {
    "drop_reply": Kind(text="a reply is lost", acts_on="reply"),
    "corrupt_reply": Kind(text="one byte of a reply is changed", acts_on="reply"),
    "bad_checksum": Kind(text="the last byte of a reply is wrong", acts_on="reply"),
    "truncate_reply": Kind(text="the end of a reply is missing", acts_on="reply", value=1, unit="bytes"),
    "wrong_length": Kind(
        text="the length byte is wrong", acts_on="reply", value=1, unit="bytes more", servos_only=True
    ),
    "wrong_id": Kind(
        text="a reply comes from another ID", acts_on="reply", value=-1, unit="ID", servos_only=True
    ),
    "duplicate_reply": Kind(text="a reply comes twice", acts_on="reply"),
    "late_reply": Kind(text="a reply comes late", acts_on="reply", value=0.06, unit="s"),
    "garbage": Kind(text="random bytes before and after a reply", acts_on="reply", value=5, unit="bytes"),
    "split_reply": Kind(text="a reply comes in two halves", acts_on="reply", value=0.002, unit="s apart"),
    "short_status": Kind(text="a sound reply without its data", acts_on="reply", servos_only=True),
    "range_error": Kind(
        text="a range error instead of the data", acts_on="reply", value=8, unit="error bits",
        servos_only=True,
    ),
    "drop_request": Kind(text="a request is lost", acts_on="request"),
    "corrupt_request": Kind(text="one byte of a request is changed", acts_on="request"),
    "corrupt_sync_write": Kind(
        text="one byte of a sync write is changed", acts_on="request", servos_only=True
    ),
    "babble": Kind(text="random bytes without end", acts_on="line", value=50_000, unit="bytes a second"),
    "latency_timer": Kind(text="replies are handed on in ticks", acts_on="line", value=0.016, unit="s"),
    "stall": Kind(text="nothing passes either way, then all of it", acts_on="line", value=0.2, unit="s"),
    "usb_lost": Kind(text="the adapter is gone, and comes back", acts_on="line", value=0.7, unit="s"),
    "unplugged": Kind(
        text="a servo is off the bus and without power, then plugged in again", acts_on="servo",
        servos_only=True,
    ),
    "temperature": Kind(
        text="a servo feels this heat", acts_on="servo", value=75, unit="°C", servos_only=True
    ),
    "overload": Kind(text="a servo feels an overload", acts_on="servo", servos_only=True),
    "voltage": Kind(
        text="the supply has this voltage, or goes from `value` to `to`", acts_on="servo", value=None,
        unit="V", servos_only=True,
    ),
    "brown_out": Kind(text="the supply collapses, servos restart", acts_on="servo", servos_only=True),
    "power_stuck": Kind(text="the power switch does nothing", acts_on="servo", servos_only=True),
    "missing": Kind(text="a servo is not there", acts_on="start", servos_only=True),
    "wrong_baud": Kind(
        text="a servo listens at another rate", acts_on="start", value=57_600, unit="bit/s", servos_only=True
    ),
    "duplicate_id": Kind(
        text="a servo has another's ID", acts_on="start", value=None, unit="ID", servos_only=True
    ),
    "wrong_model": Kind(
        text="another model of servo", acts_on="start", value=18, unit="model number", servos_only=True
    ),
    "register": Kind(
        text="a register (`address`) has this value", acts_on="start", value=None, servos_only=True
    ),
}  # fmt: skip
"""Kinds of faults by name."""

_LASTING = ("stall", "usb_lost")
"""Kinds whose value is how long they last."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Fault:
    """One thing that goes wrong."""

    kind: str
    device: LineName = "servos"
    servo: int | None = None  # ID at the start; every servo (or the line) unless given
    start: float = 0.0  # s after the line began
    end: float | None = None  # s; for ever unless given
    probability: float = 1.0  # of each reply or request
    nth: int = 0  # only this reply or request in the window, from 1; 0 is each
    value: float | None = None  # see the kind
    to: float | None = None  # V at the end of a ramp
    address: int | None = None  # of the register, for kind "register"

    def __post_init__(self) -> None:
        if self.kind not in KINDS:
            raise UnknownNameError("kind of fault", self.kind, KINDS)
        kind = KINDS[self.kind]
        require_nonnegative(start=self.start)
        require_range(0.0, 1.0, probability=self.probability)
        require_range(0, 1_000_000_000, nth=self.nth)
        if self.end is not None and self.end <= self.start:
            raise ConfigurationError(f"fault {self.kind}: end = {self.end:g} must be after start")
        if self.value is None and kind.value is None:
            raise ConfigurationError(f"fault {self.kind} needs a value ({kind.unit or kind.text})")
        if kind.servos_only and self.device != "servos":
            raise ConfigurationError(f"fault {self.kind} acts on servos, not on the {self.device}")
        self._check_details(kind)

    @property
    def stop(self) -> float:
        """End of its window, s after the line began; infinity where it lasts."""
        if self.end is not None:
            return self.end
        return self.start + self.amount if self.kind in _LASTING else math.inf

    @property
    def amount(self) -> float:
        """The value, or what its kind has instead."""
        if self.value is not None:
            return self.value
        default = KINDS[self.kind].value
        return math.nan if default is None else default

    def is_on(self, elapsed: float) -> bool:
        """True within its window; `elapsed` in s after the line began."""
        return self.start <= elapsed < self.stop

    def _check_details(self, kind: Kind) -> None:
        if kind.acts_on == "start" and self.servo is None:
            raise ConfigurationError(f"fault {self.kind} needs to know the servo: servo = ID")
        if kind.acts_on == "start" and self.start > 0.0:
            raise ConfigurationError(f"fault {self.kind} is there from the start; it takes no start and end")
        if (self.kind == "register") != (self.address is not None):
            raise ConfigurationError("an address goes with a fault of the kind register, and with no other")
        if self.address is not None:
            require_range(0, 49, address=self.address)
        if self.to is not None and (self.kind != "voltage" or self.end is None):
            raise ConfigurationError("'to' is the end of a voltage's ramp, which needs an 'end' in s too")
        if self.value is not None and self.value < 0.0:
            raise ConfigurationError(f"fault {self.kind}: value = {self.value:g} must not be negative")
        if self.kind in ("babble", "latency_timer", *_LASTING) and not self.amount > 0.0:
            raise ConfigurationError(f"fault {self.kind}: value = {self.amount:g} must be positive")


@dataclass(frozen=True, kw_only=True, slots=True)
class FaultPlan:
    """Faults of a run, and the seed of what is drawn."""

    faults: tuple[Fault, ...] = field(default_factory=tuple)
    seed: int = 0

    def __post_init__(self) -> None:
        require_range(0, 2**63 - 1, seed=self.seed)

    def on(self, device: LineName) -> FaultPlan:
        """The faults of one line."""
        return FaultPlan(
            faults=tuple(fault for fault in self.faults if fault.device == device),
            seed=self.seed + get_args(LineName).index(device),
        )

    @staticmethod
    def from_table(table: dict[str, Any]) -> FaultPlan:
        """From a table with the keys ``seed`` and ``fault`` (a list of tables).

        Raises:
            ConfigurationError: something in it is wrong; the message says what.
        """
        for key in table:
            if key not in ("seed", "fault"):
                raise UnknownNameError("key of a fault plan", key, ("seed", "fault"))
        entries = table.get("fault", [])
        if not isinstance(entries, list) or not all(isinstance(entry, dict) for entry in entries):
            raise ConfigurationError("faults are written one by one, each under a line [[fault]]")
        seed = table.get("seed", 0)
        if not isinstance(seed, int) or isinstance(seed, bool):
            raise ConfigurationError(f"seed = {seed!r} must be a whole number")
        faults = tuple(build(Fault, entry, f"fault {i}") for i, entry in enumerate(entries, start=1))
        return FaultPlan(faults=faults, seed=seed)

    @staticmethod
    def load(path: Path) -> FaultPlan:
        """Read a file.

        Raises:
            ConfigurationError: it is missing, not TOML, or says something impossible.
        """
        try:
            return FaultPlan.from_table(read_toml(path))
        except ConfigurationError as error:
            if str(path) in str(error):
                raise
            raise ConfigurationError(f"{path}: {error}") from error
