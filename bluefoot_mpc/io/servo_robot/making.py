"""Drivers put on links."""

from __future__ import annotations

from collections.abc import Sequence

from bluefoot_mpc.io.board.driver import SensorBoard
from bluefoot_mpc.io.calibration import Calibration
from bluefoot_mpc.io.camera import PictureSource
from bluefoot_mpc.io.clock import Clock
from bluefoot_mpc.io.dynamixel.bus import BusConfig, ServoBus
from bluefoot_mpc.io.dynamixel.cycle import BusCycle
from bluefoot_mpc.io.dynamixel.latch import Latch
from bluefoot_mpc.io.dynamixel.layout import spread
from bluefoot_mpc.io.lidar.driver import Lidar
from bluefoot_mpc.io.link import Link
from bluefoot_mpc.io.servo_robot.bundle import Devices

BOARD_BAUD = 115_200
"""bit/s of the sensor board's port (docs/board-protocol.md)."""
LIDAR_BAUD = 115_200
"""bit/s of the LIDAR's port; over USB it means nothing."""


def drivers(
    servos: Sequence[Link],
    clock: Clock,
    calibration: Calibration,
    board: SensorBoard | None = None,
    *,
    lidar: Lidar | None = None,
    camera: PictureSource | None = None,
    model: str = "bluefoot",
    bus: BusConfig | None = None,
) -> Devices:
    """Drivers of the servos on their ports, under one closed latch, beside the other devices.

    Raises:
        ConfigurationError: joints cannot be spread over so many ports.
    """
    latch = Latch(closed=True)
    buses = tuple(ServoBus(link, clock, bus, latch) for link in servos)
    layout = spread(len(buses), calibration.ids)
    return Devices(
        buses=buses, cycle=BusCycle(buses, layout, clock), layout=layout, calibration=calibration,
        board=board, lidar=lidar, camera=camera, model=model,
    )  # fmt: skip
