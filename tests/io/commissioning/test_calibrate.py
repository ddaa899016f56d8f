"""Calibrating: offsets from the pose, signs from joints that a person turns."""

import math

import numpy as np
import pytest

from bluefoot_mpc.exceptions import ConfigurationError, DeviceError
from bluefoot_mpc.io.calibration import STEP, Calibration, findings
from bluefoot_mpc.io.commissioning.calibrate import check_joints, posed, read_counts, with_checks
from bluefoot_mpc.io.commissioning.pose import Pose, drawing, joint_table, parse_pose, positive_direction
from bluefoot_mpc.io.commissioning.survey import survey
from bluefoot_mpc.io.findings import Severity
from bluefoot_mpc.model.legs.geometry import LegGeometry
from bluefoot_mpc.model.parameters import load_parameters
from bluefoot_mpc.types import JOINTS

from .bench import Bench

ALL = tuple(range(1, 17))


@pytest.fixture(scope="module")
def geometry():
    return LegGeometry.from_parameters(load_parameters())


class Person:
    """Turns the joint that the question names, by a true sign, and answers."""

    def __init__(self, bench, signs, agrees=True):
        self.bench, self.signs, self.agrees = bench, signs, agrees
        self.asked, self.said, self.lazy = [], [], 0
        self.instead = {}

    def say(self, text):
        self.said.append(text)

    def wait(self, text):
        self.asked.append(text)
        joint = JOINTS.index(text.split()[0])
        if self.lazy > 0:
            self.lazy -= 1
            return
        self.bench.turn(self.instead.get(joint, joint), 14.0 * self.signs[joint])

    def confirm(self, text):
        self.asked.append(text)
        return self.agrees


def calibrated(bench, pose, signs, person, joints=range(16), geometry=None):
    ports = bench.ports()
    base = Calibration.nominal()
    made = posed(base, survey(ports, ALL), read_counts(ports, ALL), pose, [1] * 16)
    assert not any(joint.verified for joint in made.joints)
    words = dict.fromkeys(joints, "turn it")
    return with_checks(made, check_joints(ports, made, words, person), pose)


@pytest.mark.parametrize("angles", [(0.0, 0.0, 0.0, 0.0), (10.0, 30.0, -40.0, -60.0)])
def test_signs_and_offsets_of_a_crooked_robot_are_found(angles):
    bench, pose = Bench(), Pose(angles_deg=angles)
    rng = np.random.default_rng(4)
    signs = rng.choice([-1, 1], 16)
    offsets = rng.integers(-40, 41, 16)
    for index in range(16):
        bench.shafts.turn(index, (offsets[index] + signs[index] * pose.joints[index] / STEP) * STEP)
    person = Person(bench, signs)
    made = calibrated(bench, pose, signs, person)
    assert [joint.sign for joint in made.joints] == signs.tolist()
    assert np.abs(np.array([joint.offset for joint in made.joints]) - offsets).max() <= 1
    assert all(joint.verified for joint in made.joints)
    assert made.joints[0].firmware == 24
    assert not [f for f in findings(made, "bluefoot") if f.severity is Severity.REFUSAL]
    # In the pose again, every angle reads what the pose says.
    assert made.angles(made.counts(pose.joints)) == pytest.approx(pose.joints, abs=STEP)
    assert bench.limp
    assert bench.line.eeprom_writes == 0


def test_a_joint_that_a_person_does_not_agree_with_stays_unverified():
    bench = Bench()
    made = calibrated(bench, Pose(), [1] * 16, Person(bench, [1] * 16, agrees=False), joints=[2])
    assert not made.joints[2].verified


def test_a_joint_is_asked_for_again_until_it_turns():
    bench = Bench()
    person = Person(bench, [-1] * 16)
    person.lazy = 2
    made = calibrated(bench, Pose(), [1] * 16, person, joints=[5])
    assert made.joints[5].sign == -1
    assert len(person.said) == 2


def test_a_joint_that_never_turns_ends_the_calibration():
    bench = Bench()
    person = Person(bench, [1] * 16)
    person.lazy = 9
    with pytest.raises(DeviceError, match=r"servo 6 \(FR_hip_pitch\) did not turn in 3 tries"):
        calibrated(bench, Pose(), [1] * 16, person, joints=[5])


def test_mixed_up_ids_are_noticed():
    bench = Bench()
    person = Person(bench, [1] * 16)
    person.instead = {0: 4}
    with pytest.raises(DeviceError, match=r"servo 5 \(FR_hip_yaw\) turned instead of servo 1"):
        calibrated(bench, Pose(), [1] * 16, person)


def test_a_robot_that_moves_is_not_read():
    bench = Bench(configs=None)
    ports = bench.ports()
    servo = bench.line.servos[3]
    original, calls = servo.sense, []

    def restless(time):
        calls.append(time)
        bench.turn(2, 0.5)
        original(time)

    servo.sense = restless
    with pytest.raises(DeviceError, match="servo 3 .*Hold the robot still"):
        read_counts(ports, ALL)


def test_the_drawing_shows_four_feet_and_every_joint(geometry):
    text = drawing(geometry, Pose())
    for leg in ("FL*", "*FR", "RL*", "*RR", "*foot"):
        assert leg in text
    assert text.count("o") >= 16 + 4
    assert "hip_yaw 0°" in text
    # Forward is up, left is left: the front left foot is the first character of the first line drawn.
    rows = [line for line in text.splitlines() if "*" in line and "foot" not in line and "feet" not in line]
    assert rows[0].index("FL") < rows[0].index("FR")
    assert "RL" in rows[1]


def test_directions_follow_from_the_kinematics(geometry):
    table = dict(joint_table(geometry, Pose()))
    assert len(table) == 16
    assert "counter-clockwise" in table["FL_hip_yaw"]
    assert "the foot goes up" in table["RR_knee"]
    folded = Pose(angles_deg=(0.0, 90.0, 90.0, 0.0))
    assert "down" in positive_direction(geometry, folded, 2)


def test_a_pose_outside_the_limits_is_refused(geometry):
    assert parse_pose("1,2,3,4", geometry).joints[1] == pytest.approx(math.radians(2.0))
    with pytest.raises(ConfigurationError, match="hip_yaw -45..45"):
        parse_pose("60,0,0,0", geometry)
    with pytest.raises(ConfigurationError, match="--pose = '1,2'"):
        parse_pose("1,2", geometry)
