import math

import numpy as np
import pytest

from bluefoot_mpc.io.calibration import Calibration
from bluefoot_mpc.io.dynamixel.cycle import Readings
from bluefoot_mpc.io.servo_robot.frames import sensor_frame


def readings(full_times):
    nothing = np.zeros(16, dtype=bool)
    return Readings(
        counts=np.full(16, 512.0), times=np.full(16, 10.0), fresh=~nothing, put_off=nothing,
        speed=np.zeros(16), load=np.zeros(16), voltage=np.full(16, 11.1), temperature=np.full(16, 41.0),
        full_times=full_times, errors=np.zeros(16, dtype=np.int64), suspects=nothing, returned=nothing,
        shut=nothing, lost_ports=(),
    )  # fmt: skip


def test_an_old_temperature_is_not_known():
    times = np.full(16, 9.7)
    times[3], times[5] = 6.9, math.nan
    frame = sensor_frame(10.0, readings(times), None, Calibration.nominal())
    assert np.flatnonzero(np.isnan(frame.joint_temperature)).tolist() == [3, 5]
    assert frame.joint_temperature[0] == 41.0
    assert frame.joint_valid.all()


@pytest.mark.parametrize(("age", "is_known"), [(0.5, True), (3.5, False)])
def test_an_old_voltage_is_not_known(age, is_known):
    frame = sensor_frame(10.0, readings(np.full(16, 10.0 - age)), None, Calibration.nominal())
    assert frame.voltage_valid is is_known
    assert frame.voltage == 11.1 if is_known else math.isnan(frame.voltage)
