"""Parameter files: what is right is read, what is wrong gets one clear message."""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
import pytest

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.model.parameters import load_parameters
from bluefoot_mpc.model.resources import model_file, models_folder
from bluefoot_mpc.settings import build, dump_toml, read_toml, to_table

SHIPPED = models_folder() / "bluefoot.toml"


def test_documents_own_numbers() -> None:
    parameters = load_parameters()
    assert parameters.legs.link_lengths == (0.065,) * 4
    assert parameters.legs.hip_offset == 0.09215
    assert parameters.legs.hip_azimuth_deg == (45.0, -45.0, 135.0, -135.0)
    assert parameters.stance.trunk_height == 0.115
    np.testing.assert_allclose(np.abs(parameters.stance.foot_position[:, :2]), 0.165)
    servos = [
        p.mass * (1 if p.body == "trunk" else 4) for p in parameters.parts if p.name.startswith("servo")
    ]
    assert sum(servos) == pytest.approx(16 * 0.0546)
    assert 1.85 <= parameters.total_mass <= 1.98
    table = sum(load.voltage * load.current for load in parameters.power.loads)
    assert table == pytest.approx(133.825)
    assert table + parameters.power.losses == pytest.approx(137.825)


def test_servo_figures_follow_from_the_data_sheet() -> None:
    servo = load_parameters().servo
    assert servo.stall_torque / servo.no_load_speed == pytest.approx(0.243, abs=5e-4)
    assert servo.back_emf == pytest.approx(0.243, abs=5e-4)
    assert math.degrees(servo.step_angle) == pytest.approx(0.2933, abs=1e-4)
    assert servo.stiffness == pytest.approx(9.16, abs=0.02)
    assert servo.no_load_speed == pytest.approx(59.0 * 2.0 * math.pi / 60.0, rel=1e-3)


@pytest.mark.parametrize("name", ["bluefoot", "bluefoot_large"])
def test_file_and_record_convert_into_each_other(name: str, tmp_path: Path) -> None:
    parameters = load_parameters(name)
    path = tmp_path / "again.toml"
    path.write_text(dump_toml(to_table(parameters)), encoding="utf-8")
    assert load_parameters(path) == parameters
    assert build(type(parameters), read_toml(models_folder() / f"{name}.toml")) == parameters


def test_default_name_and_path_find_the_same_robot() -> None:
    assert (
        load_parameters()
        == load_parameters("bluefoot")
        == load_parameters(SHIPPED)
        == load_parameters(str(SHIPPED))
    )


def test_shipped_name_wins_over_a_file_that_happens_to_be_here(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "bluefoot").write_text("#!/bin/sh\n")
    monkeypatch.chdir(tmp_path)
    assert model_file("bluefoot") == SHIPPED


WRONG = [
    # what to replace, by what, words of the message
    ("hip_offset = 0.09215", "", ["missing value", "legs.hip_offset"]),
    ("hip_offset = 0.09215", "hip_ofset = 0.09215", ["hip_ofset", "Did you mean 'hip_offset'", "legs"]),
    ("hip_offset = 0.09215", "hip_offset = 'wide'", ["legs.hip_offset = 'wide'", "float"]),
    ("hip_offset = 0.09215", "hip_offset = -0.1", ["[legs]", "hip_offset = -0.1", "positive"]),
    ("hip_offset = 0.09215", "hip_offset = nan", ["legs.hip_offset = nan", "finite"]),
    ("hip_offset = 0.09215", "hip_offset = true", ["legs.hip_offset = True"]),
    (
        "[0.065, 0.065, 0.065, 0.065]",
        "[0.065, 0.0, 0.065, 0.065]",
        ["[legs]", "link_lengths[1] = 0.0", "positive"],
    ),
    ("[0.065, 0.065, 0.065, 0.065]", "[0.065, 0.065]", ["legs.link_lengths", "4 entries, not 2"]),
    ("[0.065, 0.065, 0.065, 0.065]", "0.065", ["legs.link_lengths must be a list"]),
    ("foot_radius = 0.008", "foot_radius = 0.07", ["foot_radius = 0.07", "link_lengths[3] = 0.065"]),
    (
        "hip_yaw = [-45.0, 45.0]",
        "hip_yaw = [45.0, -45.0]",
        ["legs.limits_deg", "hip_yaw = [45, -45]", "rising"],
    ),
    ("hip_yaw = [-45.0, 45.0]", "hip_yaw = [-45.0, 85.0]", ["limits_deg.hip_yaw", "physical", "82"]),
    ("trunk_height = 0.115", "trunk_height = 0", ["[stance]", "trunk_height = 0.0"]),
    ("ankle_direction_deg = -99.0", "ankle_direction_deg = 270", ["ankle_direction_deg = 270", "-180..180"]),
    ("steps = 1024", "steps = 1", ["[servo]", "steps = 1", "2.."]),
    ("steps = 1024", "steps = 10.5", ["servo.steps = 10.5", "int"]),
    (
        "empty_voltage = 9.6",
        "empty_voltage = 13.0",
        ["[battery]", "empty_voltage = 13", "full_voltage = 12.4"],
    ),
    ("mass = 0.090", "mass = -0.090", ["parts[0]", "mass of 'chassis' = -0.09", "positive"]),
    ("size = [0.025, 0.070]", "size = [0.025]", ["parts[5]", "'lidar'", "cylinder takes 2 sizes, not 1"]),
    ("size = [0.025, 0.070]", "size = [0.025, 0.0]", ["parts[5]", "size[1] of 'lidar' = 0.0"]),
    ("mass = 0.090", "mass = 90000", ["parts[0]", "mass (kg) of 'chassis' = 90000.0", "1e-05..100"]),
    ("size = [0.200, 0.200,", "size = [200, 200,", ["parts[0]", "size[0] (m) of 'chassis' = 200.0"]),
    ("position = [0.035,", "position = [35,", ["parts[4]", "position[0] (m) of 'head' = 35.0"]),
    ('shape = "sphere"', 'shape = "ball"', ["parts", "shape", "'ball'", "sphere", "cylinder_x"]),
    ('body = "link3"', 'body = "link5"', ["parts", "body", "'link5'", "link4"]),
    ('name = "head"', 'name = "chassis"', ["2 [[parts]]", "'chassis'"]),
    ("[battery] ", "[batteries] ", ["batteries", "Did you mean 'battery'"]),
    ('name = "bluefoot"', 'name = "bluefoot', ["is not a TOML file", "line 6"]),
]


@pytest.mark.parametrize(
    ("old", "new", "words"), WRONG, ids=[f"{new or 'without ' + old}" for old, new, _ in WRONG]
)
def test_wrong_file_gets_one_message_with_file_key_and_value(
    tmp_path: Path, old: str, new: str, words: list[str]
) -> None:
    text = SHIPPED.read_text(encoding="utf-8")
    assert old in text
    path = tmp_path / "mine.toml"
    path.write_text(text.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(ConfigurationError) as error:
        load_parameters(path)
    message = str(error.value)
    for word in ["mine.toml", *words]:
        assert word in message, message
    assert "\n" not in message
    assert message.count("mine.toml") == 1


def test_body_without_mass_is_named(tmp_path: Path) -> None:
    text = SHIPPED.read_text(encoding="utf-8").replace('body = "link2"', 'body = "link1"')
    path = tmp_path / "mine.toml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(
        ConfigurationError, match=re.escape("mine.toml: no [[parts]] entry gives the body 'link2'")
    ):
        load_parameters(path)


@pytest.mark.parametrize("name", ["no_such_robot", "no/such/file.toml", "", ".", "x" * 5000, "nul\0"])
def test_missing_file_lists_what_ships(name: str) -> None:
    with pytest.raises(ConfigurationError, match=r"no parameter file .* bluefoot, bluefoot_large"):
        load_parameters(name)


def test_file_that_is_not_text_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "picture.toml"
    path.write_bytes(b"\x89PNG\xff\xfe")
    with pytest.raises(ConfigurationError, match=r"picture\.toml is not a TOML file"):
        load_parameters(path)
