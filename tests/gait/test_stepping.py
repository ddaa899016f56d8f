"""Steps over rough ground: their profile, and that the gait carries them out."""

import numpy as np
import pytest

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.gait.config import GaitConfig
from bluefoot_mpc.gait.gait import Gait, GaitInputs
from bluefoot_mpc.gait.stepping import SteppingConfig, across, height

FEET = np.array([[0.16, 0.16, 0.0], [0.16, -0.16, 0.0], [-0.16, 0.16, 0.0], [-0.16, -0.16, 0.0]])
DT = 0.02


def test_a_step_goes_up_then_across_then_down():
    config = SteppingConfig()
    s = np.linspace(0.0, 1.0, 101)
    z = np.array([height(x, 0.0, 0.05, 0.02, config) for x in s])
    assert z[0] == 0.0
    assert z[-1] == pytest.approx(0.02)
    assert z.max() == pytest.approx(0.05)
    assert np.abs(np.diff(z)).max() < 0.003
    way = np.array([across(x, config) for x in s])
    assert way[0] == way[10] == 0.0
    assert way[-15] == way[-1] == 1.0
    assert np.all(np.diff(way) >= 0.0)


@pytest.mark.parametrize("wrong", [{"up": 0.6, "down": 0.4}, {"depart": 0.9, "arrive": 0.5}, {"up": 2.0}])
def test_profiles_out_of_order_are_refused(wrong):
    with pytest.raises(ConfigurationError):
        SteppingConfig(**wrong)


def walked(gait: Gait, seconds: float, before=None):
    inputs = GaitInputs(velocity=np.array([0.02, 0.0]), gait="walk", rough=True)
    outputs = []
    for _ in range(round(seconds / DT)):
        if before is not None:
            before()
        outputs.append(gait.step(inputs, DT))
    return outputs


def test_a_foot_lands_on_the_place_and_height_that_it_was_told():
    gait = Gait(GaitConfig(), FEET)
    walked(gait, 0.1)
    standing = next(leg for leg in range(4) if not gait.state.feet[leg].turning)
    goal = complex(*FEET[standing, :2]) + 0.06 + 0.01j
    told = {"done": False}

    def tell():
        if not told["done"] and not gait.state.feet[standing].swinging:
            gait.plan_step(standing, goal, 0.02, 0.05)
        told["done"] = told["done"] or gait.state.feet[standing].swinging

    outputs = walked(gait, 3.2, tell)
    heights = [output.foot_position[standing, 2] for output in outputs]
    assert max(heights) == pytest.approx(0.05, abs=2e-3)
    foot = gait.state.feet[standing]
    assert foot.anchor == pytest.approx(goal)
    assert foot.z == 0.02


def test_feet_in_the_air_and_numbers_that_are_none_are_not_told_anything():
    gait = Gait(GaitConfig(), FEET)
    walked(gait, 0.1)
    swinging = next(leg for leg in range(4) if gait.state.feet[leg].swinging)
    standing = next(leg for leg in range(4) if not gait.state.feet[leg].swinging)
    assert not gait.plan_step(swinging, 0j, 0.0, 0.1)
    assert not gait.plan_step(standing, complex(np.nan, 0.0), 0.0, 0.1)
    assert gait.state.feet[standing].goal is None


def test_a_foot_that_meets_the_ground_stands_there():
    gait = Gait(GaitConfig(), FEET)
    walked(gait, 0.3)
    leg = next(leg for leg in range(4) if gait.state.feet[leg].swinging)
    place = gait.state.pose.to_world(gait.state.feet[leg].local)
    gait.touch_down(leg)
    gait.set_height(leg, 0.015)
    outputs = walked(gait, 0.2)
    assert not gait.state.feet[leg].swinging
    assert gait.state.feet[leg].anchor == pytest.approx(place)
    assert outputs[-1].foot_position[leg, 2] == 0.015


def test_when_the_ground_ends_no_foot_jumps():
    gait = Gait(GaitConfig(), FEET)
    walked(gait, 0.3)
    for leg in range(4):
        gait.set_height(leg, 0.03 + 0.001 * leg)
    gait.forget_steps(0.03)
    assert [foot.z for foot in gait.state.feet] == pytest.approx([0.0, 0.001, 0.002, 0.003])
