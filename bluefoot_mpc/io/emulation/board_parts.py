"""What stands behind an emulated board, its rates, and the faults that it can be given."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Protocol

from bluefoot_mpc.settings import require_nonnegative, require_positive
from bluefoot_mpc.types import BoolArray, ImuBatch


class BoardSource(Protocol):
    """What the board senses and switches: a simulated robot, say."""

    def advance(self, time: float) -> None:
        """Let the physics pass until `time` (s); a time that is past changes nothing."""
        ...

    def samples(self, since: float) -> ImuBatch:
        """Inertial samples taken after `since` (s) and so far, oldest first; NaN fields where none is new."""
        ...

    def switches(self) -> tuple[BoolArray, float]:
        """(4,) foot switches, and the time (s) at which they were so."""
        ...

    def voltage(self) -> float:
        """V of the battery under load, now."""
        ...

    def current(self) -> float:
        """A out of the battery, now."""
        ...

    def set_power(self, on: bool) -> None:
        """The supply of the servos goes on or off."""
        ...


@dataclass(frozen=True, kw_only=True, slots=True)
class BoardTimes:
    """Rates of the board's firmware, and its clock against the line's."""

    tick: float = 0.005  # s between two looks at IMU and switches
    power_ticks: int = 4  # ticks between two power messages, and the longest between two of the switches
    latency: float = 0.0003  # s from a measurement to its first byte on the line
    heartbeat: float = 0.5  # s after the last heartbeat the supply is cut
    code_life: float = 1.0  # s that a code for switching on holds
    cut_voltage: float = 9.0  # V, below it for cut_delay the supply is cut
    cut_delay: float = 0.2  # s
    baud: int = 115200  # bit/s, for the time that bytes take
    clock_offset: float = 0.0  # s, board's clock at time 0
    clock_drift: float = 0.0  # s/s, by how much it runs fast

    def __post_init__(self) -> None:
        require_positive(
            tick=self.tick, power_ticks=self.power_ticks, heartbeat=self.heartbeat,
            code_life=self.code_life, cut_delay=self.cut_delay, baud=self.baud,
        )  # fmt: skip
        require_nonnegative(latency=self.latency, cut_voltage=self.cut_voltage)


@dataclass(slots=True)
class BoardFaults:
    """Faults of the board, to be set while it runs.

    Attributes:
        silent: nothing is sent any more, nothing heard.
        imu_silent: no inertial samples.
        imu_frozen: the same sample again and again.
        imu_nan: samples without a measurement.
        clock_jump: s, added to the board's clock.
        stuck_switch: state that a switch (0..3) keeps whatever the foot does.
        chattering: switches (0..3) that change at every look.
    """

    silent: bool = False
    imu_silent: bool = False
    imu_frozen: bool = False
    imu_nan: bool = False
    clock_jump: float = 0.0
    stuck_switch: dict[int, bool] = field(default_factory=dict)
    chattering: set[int] = field(default_factory=set)
