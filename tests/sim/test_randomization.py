import numpy as np
import pytest

from bluefoot_mpc.model.robot import load_robot
from bluefoot_mpc.sim.config import RandomizationConfig, SimConfig
from bluefoot_mpc.sim.randomization import draw, stream
from bluefoot_mpc.sim.robot import SimRobot

STANDARD = SimConfig(randomization=RandomizationConfig(preset="standard"))


def test_none_is_the_nominal_robot():
    nominal = draw(SimConfig(), 5)
    assert nominal.friction == SimConfig().world.friction
    assert (nominal.mass_factor, nominal.voltage, nominal.latency) == (1.0, 12.0, 0.020)
    assert not nominal.com_offset.any()
    assert (nominal.servo_gain == 1.0).all()


def test_standard_fills_its_ranges():
    draws = [draw(STANDARD, seed) for seed in range(200)]
    for name, low, high in (
        ("friction", 0.5, 1.0), ("mass_factor", 0.9, 1.1), ("com_offset", -0.005, 0.005),
        ("servo_gain", 0.8, 1.2), ("voltage", 10.8, 12.4), ("latency", 0.010, 0.040),
    ):  # fmt: skip
        values = np.array([getattr(one, name) for one in draws])
        assert low <= values.min() < low + 0.05 * (high - low), name
        assert high >= values.max() > high - 0.05 * (high - low), name
        assert values.mean() == pytest.approx(0.5 * (low + high), abs=0.08 * (high - low))


def test_values_are_independent_of_one_another():
    first, second = draw(STANDARD, 1), draw(STANDARD, 2)
    assert first.friction != second.friction
    wide = SimConfig(randomization=RandomizationConfig(preset="standard", mass=0.5))
    changed = draw(wide, 1)
    assert changed.mass_factor != first.mass_factor
    assert changed.friction == first.friction
    assert (changed.servo_gain == first.servo_gain).all()


def test_streams_of_different_names_differ():
    assert stream(0, "gyro").random() != stream(0, "accelerometer").random()
    assert stream(0, "gyro").random() == stream(0, "gyro").random()


def test_drawn_values_reach_the_physics():
    model = load_robot()
    robot, nominal = SimRobot(model, STANDARD, 4), SimRobot(model, SimConfig())
    drawn = robot.drawn
    trunk = robot.model.body("trunk").id
    mass = robot.model.body_subtreemass[trunk] / nominal.model.body_subtreemass[trunk]
    assert mass == pytest.approx(drawn["mass_factor"])
    inertia = robot.model.body_inertia[trunk] / nominal.model.body_inertia[trunk]
    assert inertia == pytest.approx(np.full(3, drawn["mass_factor"]))
    offset = robot.model.body_ipos[trunk] - nominal.model.body_ipos[trunk]
    assert offset == pytest.approx(drawn["com_offset"])
    foot = robot.model.geom("FL_foot_ball")
    assert foot.friction[0] == pytest.approx(drawn["friction"])
    assert robot.truth().voltage == pytest.approx(drawn["voltage"], abs=0.1)
    assert robot._latency == round(drawn["latency"] * 1000)
    assert all(isinstance(value, (float, list)) for value in drawn.values())
