import dataclasses

import numpy as np
import pinocchio as pin
import pytest

from bluefoot_mpc.exceptions import ConfigurationError, UnknownNameError
from bluefoot_mpc.model.library import LIBRARY, LibraryEntry, library_folder, load_library_robot
from bluefoot_mpc.model.parameters import GRAVITY

try:
    library_folder()
except ConfigurationError:
    installed = False
else:
    installed = True
needs_robots = pytest.mark.skipif(not installed, reason="example-robot-data is not installed")


@needs_robots
@pytest.mark.parametrize(("name", "mass"), [("solo12", 2.5), ("go2", 16.1), ("anymal", 30.5)])
def test_a_robot_of_the_library_stands_on_four_feet(name, mass):
    robot = load_library_robot(name)
    model, data = robot.pin_model, robot.pin_model.createData()
    assert pin.computeTotalMass(model) == pytest.approx(mass, rel=0.01)
    assert (model.nq, len(robot.feet)) == (19, 4)
    assert model.gravity.linear == pytest.approx([0.0, 0.0, -GRAVITY])
    pin.framesForwardKinematics(model, data, robot.posture)
    feet = np.array([data.oMf[model.getFrameId(foot)].translation for foot in robot.feet])
    assert feet[:, 2] == pytest.approx(robot.foot_radius, abs=2e-3)  # level, and on the ground
    assert feet[0, 0] > 0.0 > feet[2, 0]  # front left, hind left
    assert feet[0, 1] > 0.0 > feet[1, 1]  # front left, front right
    com = pin.centerOfMass(model, data, robot.posture)
    assert abs(com[:2]).max() < 0.03
    assert robot.height == pytest.approx(com[2])
    lower, upper = model.lowerPositionLimit[7:], model.upperPositionLimit[7:]
    assert np.all((lower < robot.posture[7:]) & (robot.posture[7:] < upper))


@needs_robots
def test_unknown_robot_lists_the_known_ones():
    with pytest.raises(UnknownNameError, match="Valid: anymal, go2, solo12"):
        load_library_robot("spot")


@needs_robots
@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            {"feet": ("FL_foot", "left_shoe")},
            "no frame 'left_shoe' for a foot; frames of its links: .*FL_foot",
        ),
        ({"posture": "lying"}, "no posture 'lying'; it has: standing"),
        ({"urdf": "go2_description/urdf/go3.urdf"}, "no file .*go3.urdf"),
    ],
)
def test_an_entry_that_does_not_fit_its_files_says_what_they_have(change, message):
    with pytest.raises(ConfigurationError, match=message):
        load_library_robot("mine", dataclasses.replace(LIBRARY["go2"], **change))


def test_an_entry_needs_feet_of_some_size():
    with pytest.raises(ConfigurationError, match="at least one frame"):
        LibraryEntry(urdf="a", srdf="b", feet=(), foot_radius=0.02)
    with pytest.raises(ConfigurationError, match="foot_radius"):
        LibraryEntry(urdf="a", srdf="b", feet=("foot",), foot_radius=0.0)


def test_without_the_library_the_error_names_the_way_out(monkeypatch, tmp_path):
    monkeypatch.setattr(pin, "__file__", str(tmp_path / "lib" / "python3" / "site-packages" / "pin" / "a.py"))
    with pytest.raises(ConfigurationError, match=r"pip install 'bluefoot-mpc\[robots\]'"):
        load_library_robot("go2")
