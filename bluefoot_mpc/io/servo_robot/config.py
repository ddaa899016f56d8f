"""Where the robot's devices are, and the timing of its command cycle."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.settings import require_positive, require_range


@dataclass(frozen=True, kw_only=True, slots=True)
class DevicesConfig:
    """Ports and files of a robot with servos, and the timing of its command cycle.

    One port carries all servos; two carry one pair of legs each (FL and FR, RL
    and RR), four one leg each.
    """

    ports: tuple[str, ...] = ()  # of the servos
    baud: int = 1_000_000  # bit/s of the servos' bus
    link: Literal["memory", "pty"] = "memory"  # how an emulated robot is reached
    board_port: str = ""  # of the sensor and power board; empty = none
    lidar_port: str = ""  # empty = none
    camera: str = ""  # index or path of a video device; empty = none
    camera_delay: float = 0.07  # s from exposure to arrival: two pictures of a camera at 30 Hz; not measured
    calibration: str = "calibration.toml"  # file that `bluefoot servo calibrate` wrote
    period: float = 0.020  # s, command period
    read_lead: float = 0.007  # s before the end of a period at which reading starts, at least
    lead_margin: float = 1.3  # of the longest reading lately, added to start early enough
    patience: float = 0.005  # s that a cycle waits for a set-point that is late
    arming_voltage: float = 10.5  # V, at rest; with less the robot is not armed, for it would soon sit down
    connect_time: float = 2.0  # s that devices get to send their first data
    emulate_lidar: bool = False  # an emulated robot has a LIDAR too
    faults: str = ""  # file of faults to inject; emulator only

    def __post_init__(self) -> None:
        require_positive(
            read_lead=self.read_lead, connect_time=self.connect_time, arming_voltage=self.arming_voltage
        )
        require_range(0.002, 0.2, period=self.period)
        require_range(1.0, 3.0, lead_margin=self.lead_margin)
        require_range(0.0, 1.0, camera_delay=self.camera_delay)
        require_range(7843, 1_000_000, baud=self.baud)
        if len(self.ports) not in (0, 1, 2, 4):
            raise ConfigurationError(
                f"{len(self.ports)} servo ports: give 1 (all), 2 (a pair of legs each) or 4 (a leg each)"
            )
        if self.read_lead >= self.period or not 0.0 <= self.patience < self.period:
            raise ConfigurationError("read_lead and patience must be shorter than the period")
