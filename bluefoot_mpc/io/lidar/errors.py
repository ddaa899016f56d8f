"""Errors of the LIDAR."""

from __future__ import annotations

from bluefoot_mpc.exceptions import DeviceError


class LidarError(DeviceError):
    """The LIDAR does not answer, is not the one expected, or is broken."""


class ScipError(LidarError):
    """Bytes are not what SCIP 2.0 says: a sum, a length or a character is wrong."""
