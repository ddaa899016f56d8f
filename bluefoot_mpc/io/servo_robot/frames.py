"""From what the devices say to a sensor frame."""

from __future__ import annotations

import math

import numpy as np

from bluefoot_mpc.io.board.readings import BoardReadings
from bluefoot_mpc.io.calibration import Calibration
from bluefoot_mpc.io.dynamixel.cycle import Readings
from bluefoot_mpc.types import (
    N_JOINTS,
    N_LEGS,
    CameraImage,
    FloatArray,
    ImuBatch,
    LidarScan,
    SensorFrame,
)

_NO_SAMPLES = ImuBatch(
    time=np.empty(0), gyro=np.empty((0, 3)), accel=np.empty((0, 3)),
    magnetometer=np.empty((0, 3)), valid=np.empty(0, dtype=np.bool_),
)  # fmt: skip

_MAX_AGE = 3.0
"""s after which temperature and voltage of a servo are not known any more: they come every 0.32 s, or every
second and a half on a slow adapter."""


def sensor_frame(
    time: float,
    joints: Readings,
    board: BoardReadings | None,
    calibration: Calibration,
    lidar: LidarScan | None = None,
    camera: CameraImage | None = None,
) -> SensorFrame:
    """Put the newest readings together; what is not known is not valid.

    A joint that did not answer keeps its last position, marked; a temperature that
    is too old is NaN. The voltage is the board's, and the servos' own where there is
    no board.

    Args:
        time: s, of the frame.
        joints: newest readings of the servos.
        board: newest readings of the sensor board; None without one.
        calibration: signs and offsets.
        lidar: newest scan, when new.
        camera: newest picture, when new.
    """
    is_known = time - joints.full_times <= _MAX_AGE
    voltage, voltage_valid = _voltage(joints.voltage[is_known], board)
    return SensorFrame(
        time=time,
        joint_position=calibration.angles(joints.counts),
        joint_speed=calibration.signs * joints.speed,
        joint_load=calibration.signs * joints.load,
        joint_temperature=np.where(is_known, joints.temperature, math.nan),
        joint_time=joints.times,
        joint_valid=joints.fresh,
        voltage=voltage,
        voltage_valid=voltage_valid,
        imu=_NO_SAMPLES if board is None else board.imu,
        contact=np.zeros(N_LEGS, dtype=np.bool_) if board is None else board.contact,
        contact_time=np.full(N_LEGS, math.nan) if board is None else board.contact_time,
        contact_valid=np.zeros(N_LEGS, dtype=np.bool_) if board is None else board.contact_valid,
        lidar=lidar,
        camera=camera,
    )


def _voltage(servos: FloatArray, board: BoardReadings | None) -> tuple[float, bool]:
    if board is not None and board.voltage_valid:
        return board.voltage, True
    known: FloatArray = servos[np.isfinite(servos)]
    return (float(np.median(known)), True) if known.size > N_JOINTS // 2 else (math.nan, False)
