"""Motion as a list of steps, in Python and as text."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.io.station.steps import Steps, read_steps
from bluefoot_mpc.types import GuideTask, Mode


def test_each_step_holds_for_its_time():
    steps = Steps().stand(1.0).walk(5.0, forward=0.06, turn=10.0, gait="walk").pose(2.0, pitch=5.0).sit(2.0)
    assert steps.duration == 10.0
    assert [steps.at(time).mode for time in (0.0, 1.0, 5.99, 6.0, 8.0, 99.0)] == [
        Mode.STAND, Mode.WALK, Mode.WALK, Mode.STAND, Mode.SIT, Mode.SIT,
    ]  # fmt: skip
    walk = steps.at(3.0)
    assert (walk.velocity[0], walk.gait) == (0.06, "walk")
    assert walk.yaw_rate == pytest.approx(math.radians(10.0))
    assert steps.at(7.0).trunk.rpy[1] == pytest.approx(math.radians(5.0))


def test_turning_is_on_the_spot():
    turn = Steps().turn(2.0, left=20.0).at(1.0)
    assert not turn.velocity.any()
    assert turn.yaw_rate == pytest.approx(math.radians(20.0))


def test_nothing_to_do_is_to_stand():
    assert Steps().at(0.0).mode is Mode.STAND


@pytest.mark.parametrize("as_file", [False, True])
def test_text_is_read_from_an_option_or_a_file(tmp_path, as_file):
    text = "walk 5 forward=0.06 gait=walk; turn 3 left=20 # to the left\n\npose 2 height=0.01; sit 2"
    if as_file:
        file = tmp_path / "steps.txt"
        file.write_text(text)
        text = str(file)
    steps = read_steps(text)
    assert steps.ends == [5.0, 8.0, 10.0, 12.0]
    assert steps.at(9.0).trunk.position[2] == 0.01


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        (
            "jump 2",
            "unknown step 'jump'.*Valid: approach, follow, goto, pose, sit, stand, turn, walk, wander",
        ),
        ("walk", "it has the form: walk SECONDS forward=NUMBER"),
        ("walk five", "cannot read the step 'walk five'"),
        ("walk 5 speed=2", "unknown value of 'walk' 'speed'.*forward"),
        ("walk 5 forward=fast", "cannot read"),
        ("walk -2", "seconds"),
        ("walk nan", "seconds"),
        ("walk 2 forward=nan", "forward"),
        ("walk 2 gait=gallop", "gallop"),
        ("# only a remark", "no steps"),
        ("goto 40", "it has the form: goto SECONDS points=FORWARD,LEFT/FORWARD,LEFT speed=NUMBER"),
        ("goto 40 points=", "it has the form"),
        ("goto 40 points=1", "it has the form"),
        ("goto 40 points=1,2,3", "it has the form"),
        ("goto 40 points=1,2/", "it has the form"),
        ("goto 40 points=1,two", "cannot read the step 'goto 40 points=1,two'"),
        ("goto 40 points=1,2/nan,3", "step 'goto 40 .*point 2 is"),
        ("goto 40 points=1,2 speed=0", "speed"),
        ("goto 40 points=1,2 distance=2", "unknown value of 'goto'.*points, speed"),
        ("wander 9 speed=nan", "speed"),
        ("follow 9 distance=-1", "distance"),
        ("approach 9 distance=0.3", "distance = 0.3 must be at least 0.4 m"),
    ],
)
def test_what_cannot_be_read_is_named(text, complaint):
    with pytest.raises(ConfigurationError, match=complaint):
        read_steps(text)


@pytest.mark.parametrize(
    ("text", "task", "speed", "distance"),
    [
        ("wander 20 speed=0.1", GuideTask.WANDER, 0.1, 0.6),
        ("follow 20 distance=0.8", GuideTask.FOLLOW, 0.15, 0.8),
        ("approach 9 speed=.1 distance=.5", GuideTask.APPROACH, 0.1, 0.5),
    ],
)
def test_tasks_are_guides(text, task, speed, distance):
    (command,) = read_steps(text).commands
    assert command.mode is Mode.WALK
    assert not command.velocity.any()
    guide = command.guide
    assert (guide.task, guide.speed, guide.distance, guide.waypoints.size) == (task, speed, distance, 0)


def test_waypoints_are_forward_and_left_of_the_start():
    guide = read_steps("goto 40 points=1,0.5/2,-1e-1 speed=0.08; sit 2").at(3.0).guide
    assert (guide.task, guide.speed) == (GuideTask.GOTO, 0.08)
    assert guide.waypoints.tolist() == [[1.0, 0.5], [2.0, -0.1]]
    assert Steps().goto(60, points=[(1, 0.5), (2, -0.1)]).at(0.0).guide.waypoints.tolist() == [
        [1.0, 0.5],
        [2.0, -0.1],
    ]
    assert Steps().goto(60, points=guide.waypoints).at(0.0).guide.speed == 0.1


@pytest.mark.parametrize(
    "points",
    [
        [],
        np.zeros((0, 2)),
        [1.0, 2.0],
        [(1.0,)],
        [(1, 2, 3)],
        [("a", 2)],
        "1,2",
        None,
        [(math.nan, 0.0)],
        [(0.0, math.inf)],
        [(1001.0, 0.0)],
    ],
)
def test_points_that_are_none_are_refused_in_python(points):
    with pytest.raises(ConfigurationError, match="point"):
        Steps().goto(60, points=points)


@given(
    seconds=st.floats(0.01, 1e6),
    points=st.lists(st.tuples(st.floats(-1000, 1000), st.floats(-1000, 1000)), min_size=1, max_size=30),
    speed=st.floats(1e-3, 10.0),
)
def test_waypoints_go_through_text_unchanged(seconds, points, speed):
    words = "/".join(f"{forward!r},{left!r}" for forward, left in points)
    steps = read_steps(f"goto {seconds!r} points={words} speed={speed!r}")
    guide = steps.commands[0].guide
    assert guide.waypoints.tolist() == [list(point) for point in points]
    assert (guide.speed, steps.duration) == (speed, seconds)


_WORDS = st.sampled_from(
    [
        "goto",
        "wander",
        "follow",
        "walk",
        "points=",
        "1",
        "nan",
        "inf",
        ",",
        "/",
        "=",
        " ",
        ";",
        "#",
        "speed=",
        "distance=",
        "-",
        "1e400",
        "\n",
        "0.5",
    ]
)


@given(st.one_of(st.text(max_size=400), st.lists(_WORDS, max_size=20).map("".join)))
def test_whatever_the_text_it_is_steps_or_a_plain_refusal(text):
    try:
        steps = read_steps(text)
    except ConfigurationError:
        return
    assert steps.duration > 0.0
    guides = [command.guide for command in steps.commands if command.guide is not None]
    assert all(np.isfinite(guide.waypoints).all() for guide in guides)


def test_a_script_longer_than_a_files_name_is_steps():
    assert read_steps("; ".join(["walk 1"] * 100)).duration == 100.0


def test_a_file_that_is_no_text_is_named(tmp_path):
    file = tmp_path / "steps.bin"
    file.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(ConfigurationError, match="cannot read the script"):
        read_steps(str(file))
