"""What the robot measures."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bluefoot_mpc.types.common import BoolArray, FloatArray


@dataclass(frozen=True, kw_only=True, slots=True)
class ImuBatch:
    """All inertial samples since the previous frame, oldest first (n may be 0).

    Attributes:
        time: (n,) s, clock of the robot.
        gyro: (n, 3) rad/s, angular velocity in the base frame.
        accel: (n, 3) m/s², specific force in the base frame (+g up at rest).
        magnetometer: (n, 3) field over its nominal strength, base frame; NaN
            rows where no new sample came (it is slower than the gyro).
        valid: (n,) False where a sample must not be used.
    """

    time: FloatArray
    gyro: FloatArray
    accel: FloatArray
    magnetometer: FloatArray
    valid: BoolArray


@dataclass(frozen=True, kw_only=True, slots=True)
class LidarScan:
    """One sweep of the planar LIDAR.

    Attributes:
        time: s, end of the sweep.
        bearing: (n,) rad from forward, left positive.
        distance: (n,) m; NaN where no echo came back.
        valid: False where the scan must not be used.
    """

    time: float
    bearing: FloatArray
    distance: FloatArray
    valid: bool


@dataclass(frozen=True, kw_only=True, slots=True)
class CameraImage:
    """One picture of the forward camera.

    Attributes:
        time: s, time of exposure.
        pixels: (height, width, 3) uint8, RGB.
        valid: False where the picture must not be used.
    """

    time: float
    pixels: NDArray[np.uint8]
    valid: bool


@dataclass(frozen=True, kw_only=True, slots=True)
class SensorFrame:
    """Everything the real robot can measure, once per command period.

    Attributes:
        time: s, time of the frame; the only clock controllers know.
        joint_position: (16,) rad, quantised.
        joint_speed: (16,) rad/s as the servo reports it (noisy, delayed).
        joint_load: (16,) fraction of stall torque as the servo reports it.
        joint_temperature: (16,) °C.
        joint_time: (16,) s, when each position was read.
        joint_valid: (16,) False where no reply came.
        voltage: V at the servos, under load.
        voltage_valid: False where the voltage is unknown.
        imu: inertial samples since the previous frame.
        contact: (4,) foot switches, True = touches.
        contact_time: (4,) s, time of the switch samples.
        contact_valid: (4,) False where a switch is known to be broken.
        lidar: newest scan, when new.
        camera: newest picture, when new.
    """

    time: float
    joint_position: FloatArray
    joint_speed: FloatArray
    joint_load: FloatArray
    joint_temperature: FloatArray
    joint_time: FloatArray
    joint_valid: BoolArray
    voltage: float
    voltage_valid: bool
    imu: ImuBatch
    contact: BoolArray
    contact_time: FloatArray
    contact_valid: BoolArray
    lidar: LidarScan | None = None
    camera: CameraImage | None = None
