"""Calibration: counts and angles, its file, and when it must not be trusted."""

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.io.calibration import (
    AX12_MODEL,
    STEP,
    Calibration,
    findings,
    joint_of_id,
    load_calibration,
    now_text,
    save_calibration,
    servo_ids,
)
from bluefoot_mpc.io.findings import Severity
from bluefoot_mpc.model.parameters import load_parameters
from bluefoot_mpc.types import JOINTS


@pytest.fixture(scope="module")
def nominal():
    return Calibration.nominal()


def odd(nominal):
    """A calibration with signs and offsets of all kinds."""
    for index in range(16):
        sign = 1 if index % 3 else -1
        nominal = nominal.with_joint(index, sign=sign, offset=3 * index - 20)
    return nominal.sealed()


def refusals(found):
    return [str(f) for f in found if f.severity is Severity.REFUSAL]


def test_step_is_that_of_the_model():
    assert load_parameters().servo.step_angle == pytest.approx(STEP, rel=1e-12)


def test_nominal_is_the_middle_and_counter_clockwise(nominal):
    assert nominal.counts(np.zeros(16)).tolist() == [512] * 16
    assert nominal.counts(np.full(16, math.radians(30.0))).tolist() == [512 + 102] * 16
    assert nominal.ids == servo_ids() == tuple(range(1, 17))
    _, upper = nominal.soft_limits
    assert np.degrees(upper[:4]).tolist() == pytest.approx([45, 90, 90, 90])
    assert not refusals(findings(nominal, "bluefoot"))


def test_sign_and_offset_move_the_count(nominal):
    calibration = nominal.with_joint(5, sign=-1, offset=7)
    angles = np.zeros(16)
    angles[5] = 10.0 * STEP
    assert calibration.counts(angles)[5] == 512 + 7 - 10
    assert calibration.signs[5] == -1
    assert calibration.offsets[5] == 7


@given(st.lists(st.integers(0, 1023), min_size=16, max_size=16))
def test_counts_of_angles_of_counts_are_the_counts(counts):
    calibration = odd(Calibration.nominal())
    assert calibration.counts(calibration.angles(np.array(counts))).tolist() == counts


def test_goals_are_clipped_and_measurements_are_not(nominal):
    assert nominal.counts(np.full(16, 4.0)).tolist() == [1023] * 16
    assert nominal.counts(np.full(16, -4.0)).tolist() == [0] * 16
    measured = nominal.angles(np.array([1500.0, np.nan] + [512.0] * 14))
    assert measured[0] == pytest.approx((1500 - 512) * STEP)
    assert np.isnan(measured[1])


def test_a_file_gives_back_what_was_saved(nominal, tmp_path):
    calibration = dataclasses.replace(odd(nominal), made=now_text())
    save_calibration(calibration, tmp_path / "deep" / "calibration.toml")
    assert load_calibration(tmp_path / "deep" / "calibration.toml") == calibration
    assert [p.name for p in (tmp_path / "deep").iterdir()] == ["calibration.toml"]


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("sign = 1", "sign = 0", ["joints[0]", "sign = 0", "1 or -1"]),
        ("sign = 1", "sgin = 1", ["sgin", "sign"]),
        ("offset = 0", "offset = 700", ["joints[0]", "offset = 700", "-512..511"]),
        ("id = 2\n", "id = 1\n", ["FL_hip_yaw and FL_hip_pitch", "ID 1"]),
        ("id = 2\n", "id = 254\n", ["joints[1]", "id = 254", "0..253"]),
        ('name = "FL_knee"', 'name = "knee"', ["'knee'", "FL_knee"]),
        ("made = ", "made = 5 #", ["made = 5", "str"]),
        ('made = "2000', 'made = "2oo0', ["made", "not a date"]),
        ("[[joints]]", "[[joints]", ["not a TOML file"]),
        ("soft_limits_deg = [-45.0, 45.0]", "soft_limits_deg = [45.0, -45.0]", ["rising"]),
        ("offset = 0", "offset = nan", ["joints[0].offset", "int"]),
    ],
)
def test_a_wrong_file_is_named_with_key_and_mend(nominal, tmp_path, old, new, words):
    file = tmp_path / "calibration.toml"
    save_calibration(nominal, file)
    text = file.read_text()
    assert old in text
    file.write_text(text.replace(old, new, 1))
    with pytest.raises(ConfigurationError) as caught:
        load_calibration(file)
    for word in [str(file), "bluefoot servo calibrate", *words]:
        assert word in str(caught.value)


def test_a_missing_file_says_how_to_make_one(tmp_path):
    with pytest.raises(ConfigurationError, match="bluefoot servo calibrate --out"):
        load_calibration(tmp_path / "none.toml")


def test_a_folder_that_cannot_be_written_is_named(nominal, tmp_path):
    (tmp_path / "file").touch()
    with pytest.raises(ConfigurationError, match="cannot write"):
        save_calibration(nominal, tmp_path / "file" / "calibration.toml")


def test_a_later_setup_makes_it_stale(nominal):
    made = dataclasses.replace(nominal, made="2026-01-02T00:00:00+00:00")
    assert not refusals(findings(dataclasses.replace(made, setup="2026-01-01T00:00:00"), "bluefoot"))
    (refusal,) = refusals(findings(dataclasses.replace(made, setup="2026-01-03T00:00:00"), "bluefoot"))
    assert "stale" in refusal
    assert "bluefoot servo calibrate" in refusal


def test_another_robot_refuses(nominal):
    (refusal,) = refusals(findings(nominal, "bluefoot_large"))
    assert "'bluefoot_large'" in refusal


def test_an_id_changed_by_hand_refuses(nominal):
    (refusal,) = refusals(findings(nominal.with_joint(3, id=40), "bluefoot"))
    assert "not those that it was made for" in refusal


def test_an_unverified_joint_refuses(nominal):
    (refusal,) = refusals(findings(nominal.with_joint(6, verified=False), "bluefoot"))
    assert "servo 7 (FR_knee)" in refusal


def test_another_servo_refuses(nominal):
    calibration = nominal.with_joint(2, firmware=24)
    seen = dict.fromkeys(nominal.ids, (AX12_MODEL, 24))
    assert not refusals(findings(calibration, "bluefoot", seen))
    (refusal,) = refusals(findings(calibration, "bluefoot", seen | {3: (AX12_MODEL, 22)}))
    assert "servo 3 (FL_knee)" in refusal
    (refusal,) = refusals(findings(calibration, "bluefoot", seen | {4: (18, 24)}))
    assert "model 18" in refusal


def test_a_horn_far_off_the_middle_is_a_warning(nominal):
    found = findings(nominal.with_joint(1, offset=300).sealed(), "bluefoot")
    assert [f.severity for f in found] == [Severity.WARNING]
    assert "horn" in str(found[0])


def test_joints_have_names_by_id():
    assert [joint_of_id(i) for i in (1, 16, 0, 17)] == [JOINTS[0], JOINTS[15], "no joint", "no joint"]
