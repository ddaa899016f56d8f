"""Joints that cannot be where they seem to be are refused before torque."""

import numpy as np

from bluefoot_mpc.io.calibration import Calibration
from bluefoot_mpc.io.findings import Severity
from bluefoot_mpc.io.servo_robot.preflight import posture_findings


def test_a_wrong_offset_shows_before_torque():
    calibration = Calibration.nominal()
    counts = calibration.counts(np.zeros(16)).astype(float)
    assert posture_findings(calibration, counts) == ()
    found = posture_findings(calibration.with_joint(0, offset=200), counts)
    assert [finding.severity for finding in found] == [Severity.REFUSAL]
    assert "servo 1 (FL_hip_yaw): its joint reads -59°, outside its limits (-45..45°)" in str(found[0])
    assert "servo calibrate" in found[0].mend


def test_a_leg_may_hang_a_little_outside_and_a_silent_servo_has_its_own_finding():
    calibration = Calibration.nominal()
    counts = calibration.counts(np.full(16, np.radians(-95.0))).astype(float)
    counts[0::4] = 512.0
    counts[5] = np.nan
    assert posture_findings(calibration, counts) == ()
