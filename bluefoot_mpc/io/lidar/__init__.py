"""The Hokuyo URG-04LX: a planar LIDAR that speaks SCIP 2.0."""

from bluefoot_mpc.io.lidar.config import LidarConfig
from bluefoot_mpc.io.lidar.driver import Lidar, LidarStatistics
from bluefoot_mpc.io.lidar.errors import LidarError, ScipError

__all__ = ["Lidar", "LidarConfig", "LidarError", "LidarStatistics", "ScipError"]
