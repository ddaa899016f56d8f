"""The operator's keys and sticks as motion commands."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bluefoot_mpc.cli.teleop import GAITS, HELP, Teleop, TeleopConfig, TeleopState
from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.types import GuideTask, Mode

TELEOP = Teleop()
CONFIG = TELEOP.config
KEYS = "wasdqeijklourfcgtvb xhz1"


def pressed(keys, time=0.0, state=None, teleop=TELEOP):
    state = state or TeleopState()
    for key in keys:
        state = teleop.press(state, key, time)
    return state


def command(keys, time=0.0):
    return TELEOP.command(pressed(keys), time)


def test_starts_standing_without_velocity():
    motion = TELEOP.command(TeleopState(), 0.0)
    assert motion.mode is Mode.STAND
    assert not motion.velocity.any()
    assert motion.yaw_rate == 0.0
    assert not motion.trunk.rpy.any()
    assert not motion.trunk.position.any()


@pytest.mark.parametrize(
    ("keys", "forward", "left", "turn"),
    [
        (["w"], 1, 0, 0),
        (["up"], 1, 0, 0),
        (["s"], -1, 0, 0),
        (["down"], -1, 0, 0),
        (["a"], 0, 1, 0),
        (["d"], 0, -1, 0),
        (["q"], 0, 0, 1),
        (["left"], 0, 0, 1),
        (["e"], 0, 0, -1),
        (["right"], 0, 0, -1),
    ],
)
def test_velocity_keys_walk_one_step_in_their_direction(keys, forward, left, turn):
    motion = command(keys)
    assert motion.mode is Mode.WALK
    np.testing.assert_allclose(motion.velocity, [forward * CONFIG.speed_step, left * CONFIG.speed_step])
    assert motion.yaw_rate == pytest.approx(turn * CONFIG.yaw_rate_step)


def test_presses_add_up_to_the_bound_and_back_to_exactly_zero():
    fast = pressed(["w"] * 50)
    assert TELEOP.command(fast, 0.0).velocity[0] == CONFIG.speed_max
    steps = round(CONFIG.speed_max / CONFIG.speed_step)
    assert TELEOP.command(pressed(["s"] * steps, state=fast), 0.0).velocity[0] == 0.0


def test_space_stops_and_stands():
    motion = command(["w", "a", "q", "space"])
    assert motion.mode is Mode.STAND
    assert not motion.velocity.any()
    assert motion.yaw_rate == 0.0


@pytest.mark.parametrize(("key", "task"), [("v", GuideTask.WANDER), ("b", GuideTask.FOLLOW)])
def test_a_task_begins_and_ends_with_its_key(key, task):
    motion = command(["w", key])
    assert (motion.mode, motion.guide.task) == (Mode.WALK, task)
    assert not motion.velocity.any()
    motion = command(["w", key, key])
    assert (motion.mode, motion.guide) == (Mode.STAND, None)


def test_one_task_takes_the_place_of_the_other():
    assert command(["v", "b"]).guide.task is GuideTask.FOLLOW


@pytest.mark.parametrize("key", ["w", "q", "space", "t", "x"])
def test_keys_that_move_end_a_task(key):
    assert command(["v", key]).guide is None


@pytest.mark.parametrize("key", ["i", "r", "c", "g", "h"])
def test_other_keys_leave_a_task_alone(key):
    assert command(["v", key]).guide is not None


def test_a_task_needs_no_hand_at_the_handle():
    state = pressed(["v"])
    assert TELEOP.command(state, 600.0).guide is state.guide
    assert "WANDER" in TELEOP.status(state, 600.0)
    # And the key that comes after so long counts as it is.
    assert TELEOP.press(state, "w", 600.0).velocity[0] == CONFIG.speed_step


def test_a_stick_ends_a_task_at_once():
    state = TELEOP.tilt_sticks(pressed(["v"]), (0.5, 0.0, 0.0), 1.0)
    motion = TELEOP.command(state, 1.0)
    assert motion.guide is None
    assert motion.velocity[0] > 0.0
    assert TELEOP.tilt_sticks(pressed(["v"]), (0.1, 0.0, 0.0), 1.0).guide is not None


def test_gait_key_goes_around():
    assert command([]).gait == "trot"
    assert command(["g"]).gait == "walk"
    assert command(["g"] * len(GAITS)).gait == "trot"


def test_gait_change_keeps_the_velocity():
    assert command(["w", "g"]).velocity[0] == CONFIG.speed_step


@pytest.mark.parametrize(
    ("key", "axis", "sign"),
    [("j", 0, -1), ("l", 0, 1), ("i", 1, 1), ("k", 1, -1), ("u", 2, 1), ("o", 2, -1)],
)
def test_pose_keys_tilt_the_trunk_within_bounds(key, axis, sign):
    expected = np.zeros(3)
    expected[axis] = sign * CONFIG.tilt_step
    np.testing.assert_allclose(command([key]).trunk.rpy, expected, atol=1e-9)
    assert command([key] * 100).trunk.rpy[axis] == pytest.approx(sign * CONFIG.tilt_max)


def test_height_and_level_keys():
    assert command(["r"]).trunk.position[2] == CONFIG.height_step
    assert command(["f"] * 100).trunk.position[2] == -CONFIG.height_max
    level = command(["i", "l", "u", "r", "c"]).trunk
    assert not level.rpy.any()
    assert not level.position.any()


def test_pose_keys_do_not_start_walking_and_do_not_stop_it():
    assert command(["i"]).mode is Mode.STAND
    assert command(["w", "i"]).mode is Mode.WALK


def test_sitting_and_standing_up():
    assert command(["w", "t"]).mode is Mode.SIT
    assert command(["w", "t"]).velocity[0] == 0.0
    assert command(["t", "t"]).mode is Mode.STAND


def test_dead_man_stops_then_stands_and_the_next_key_does_not_walk_off():
    state = pressed(["w", "w"], time=10.0)
    before = TELEOP.command(state, 10.0 + CONFIG.timeout - 0.01)
    stopped = TELEOP.command(state, 10.0 + CONFIG.timeout)
    standing = TELEOP.command(state, 10.0 + CONFIG.timeout + CONFIG.stand_after)
    assert before.velocity[0] > 0.0
    assert (stopped.mode, stopped.velocity[0]) == (Mode.WALK, 0.0)
    assert (standing.mode, standing.velocity[0]) == (Mode.STAND, 0.0)
    back = TELEOP.press(state, "h", 60.0)
    motion = TELEOP.command(back, 60.0)
    assert (motion.mode, motion.velocity[0]) == (Mode.STAND, 0.0)
    again = TELEOP.command(TELEOP.press(back, "w", 60.1), 60.1)
    assert (again.mode, again.velocity[0]) == (Mode.WALK, CONFIG.speed_step)


def test_dead_man_leaves_the_trunk_and_a_sitting_robot_alone():
    state = pressed(["t", "i"])
    late = TELEOP.command(state, 1e4)
    assert late.mode is Mode.SIT
    assert late.trunk.rpy[1] > 0.0


def test_end_sits_down_and_then_ends_whatever_is_pressed():
    state = pressed(["w", "x"], time=5.0)
    motion = TELEOP.command(state, 5.0)
    assert (motion.mode, motion.velocity[0]) == (Mode.SIT, 0.0)
    state = pressed(["w", "g", "t", "space"], time=5.5, state=state)
    assert TELEOP.command(state, 5.5).mode is Mode.SIT
    assert TELEOP.command(state, 5.0 + CONFIG.rest_time) is None


def test_sticks_are_shares_of_the_bounds_outside_the_dead_zone():
    full = TELEOP.tilt_sticks(TeleopState(), (1.0, -1.0, 1.0), 0.0)
    motion = TELEOP.command(full, 0.0)
    np.testing.assert_allclose(motion.velocity, [CONFIG.speed_max, -CONFIG.lateral_max])
    assert motion.yaw_rate == CONFIG.yaw_rate_max
    resting = TELEOP.tilt_sticks(TeleopState(), (0.1, -0.1, 0.05), 3.0)
    assert resting == TeleopState()


def test_a_held_stick_is_a_living_operator_and_letting_go_stops():
    state = TELEOP.tilt_sticks(TeleopState(), (0.5, 0.0, 0.0), 0.0)
    state = TELEOP.tilt_sticks(state, (0.5, 0.0, 0.0), 100.0)
    assert TELEOP.command(state, 100.0).velocity[0] > 0.0
    state = TELEOP.tilt_sticks(state, (0.0, 0.0, 0.0), 100.1)
    motion = TELEOP.command(state, 100.1)
    assert (motion.mode, motion.velocity[0]) == (Mode.STAND, 0.0)


def test_centred_sticks_leave_the_keyboard_alone():
    state = TELEOP.tilt_sticks(pressed(["w"]), (0.0, 0.0, 0.0), 1.0)
    assert TELEOP.command(state, 1.0).velocity[0] == CONFIG.speed_step


@given(
    keys=st.lists(st.sampled_from([*KEYS, "up", "down", "left", "right", "space"]), max_size=80),
    sticks=st.tuples(*[st.floats(-1.5, 1.5)] * 3),
)
def test_no_keys_or_sticks_ask_for_more_than_the_bounds(keys, sticks):
    state = TELEOP.tilt_sticks(pressed(keys), sticks, 0.0)
    motion = TELEOP.command(state, 0.0)
    assert abs(motion.velocity[0]) <= CONFIG.speed_max
    assert abs(motion.velocity[1]) <= CONFIG.lateral_max
    assert abs(motion.yaw_rate) <= CONFIG.yaw_rate_max
    assert (np.abs(motion.trunk.rpy) <= CONFIG.tilt_max + 1e-9).all()
    assert abs(motion.trunk.position[2]) <= CONFIG.height_max
    assert motion.gait in GAITS
    assert motion.mode in (Mode.STAND, Mode.WALK, Mode.SIT)


def test_status_line_is_one_line_and_tells_when_the_dead_man_acts():
    state = pressed(["w"])
    assert "+10" in TELEOP.status(state, 0.0)
    assert "NO KEY" not in TELEOP.status(state, 0.0)
    late = TELEOP.status(state, CONFIG.timeout)
    assert "NO KEY" in late
    assert "+10" not in late
    assert "\n" not in late


def test_help_names_every_key():
    named = HELP.replace("/", " ").upper().split()
    assert {"W", "S", "A", "D", "Q", "E", "G", "T", "I", "K", "J", "L", "U", "O", "R", "F", "C", "X"} <= set(
        named
    )


@pytest.mark.parametrize("name", ["speed_step", "timeout", "dead_zone"])
@pytest.mark.parametrize("value", [0.0, -1.0, math.nan])
def test_impossible_configuration_is_refused(name, value):
    with pytest.raises(ConfigurationError, match=name):
        TeleopConfig(**{name: value})
