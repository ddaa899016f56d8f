"""Motion as a list of steps, in Python and as text."""

import math

import pytest

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.io.station.steps import Steps, read_steps
from bluefoot_mpc.types import Mode


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
        ("jump 2", "unknown step 'jump'.*Valid: approach, follow, goto, pose, sit, stand, turn, walk, wander"),
        ("walk", "it has the form: walk SECONDS forward=NUMBER"),
        ("walk five", "cannot read the step 'walk five'"),
        ("walk 5 speed=2", "unknown value of 'walk' 'speed'.*forward"),
        ("walk 5 forward=fast", "cannot read"),
        ("walk -2", "seconds"),
        ("walk nan", "seconds"),
        ("walk 2 forward=nan", "forward"),
        ("walk 2 gait=gallop", "gallop"),
        ("# only a remark", "no steps"),
    ],
)
def test_what_cannot_be_read_is_named(text, complaint):
    with pytest.raises(ConfigurationError, match=complaint):
        read_steps(text)
