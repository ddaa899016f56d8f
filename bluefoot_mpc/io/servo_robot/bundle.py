"""The drivers of everything that a robot with servos has."""

from __future__ import annotations

from dataclasses import dataclass

from bluefoot_mpc.io.board.driver import SensorBoard
from bluefoot_mpc.io.calibration import Calibration
from bluefoot_mpc.io.camera import PictureSource
from bluefoot_mpc.io.dynamixel.bus import ServoBus
from bluefoot_mpc.io.dynamixel.cycle import BusCycle
from bluefoot_mpc.io.dynamixel.layout import ServoLayout
from bluefoot_mpc.io.lidar.driver import Lidar


@dataclass(frozen=True, kw_only=True, slots=True)
class Devices:
    """Drivers of everything that the robot has.

    Attributes:
        buses: of the servos, one for each port.
        cycle: scheduler on these buses.
        layout: which servo drives which joint.
        calibration: signs, offsets, IDs.
        board: sensor and power board; None without one.
        lidar: None without one.
        camera: None without one.
        model: name of the parameter set that the robot runs with.
    """

    buses: tuple[ServoBus, ...]
    cycle: BusCycle
    layout: ServoLayout
    calibration: Calibration
    board: SensorBoard | None = None
    lidar: Lidar | None = None
    camera: PictureSource | None = None
    model: str = "bluefoot"
