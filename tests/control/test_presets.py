import tomllib

import pytest

from bluefoot_mpc.control.config import ControlConfig
from bluefoot_mpc.control.names import CONTROLLERS, DEFAULT_CONTROLLER
from bluefoot_mpc.control.pipeline import Pipeline
from bluefoot_mpc.control.presets import preset
from bluefoot_mpc.exceptions import UnknownNameError
from bluefoot_mpc.model.robot import load_robot
from bluefoot_mpc.settings import build, dump_toml, to_table


@pytest.mark.parametrize("name", CONTROLLERS)
def test_a_preset_survives_its_way_through_a_file(name):
    text = dump_toml(to_table(preset(name)))
    again = build(ControlConfig, tomllib.loads(text), "control")
    assert again == preset(name)
    assert dump_toml(to_table(again)) == text


@pytest.mark.parametrize("name", CONTROLLERS)
def test_a_preset_makes_a_controller(name):
    assert Pipeline(load_robot(), preset(name), 0.02).config == preset(name)


def test_the_papers_laws_plan_nothing_and_the_model_plans():
    paper, model = preset("cpg"), preset("mpc")
    assert not paper.whole_body.enabled
    assert (paper.sway.trot, paper.sway.walk) == ("static", "static")
    assert paper.servo.mixing == 0.0
    assert model.whole_body.enabled
    assert model.sway.walk == "preview"
    assert model.servo.mixing > 0.0


def test_the_default_is_one_of_them():
    assert DEFAULT_CONTROLLER in CONTROLLERS


def test_an_unknown_name_lists_the_known_ones():
    with pytest.raises(UnknownNameError, match=r"controller 'lqr'.*cpg.*mpc"):
        preset("lqr")
