"""The levelling stage in the pipeline: what it is given, where it stands, what it tells."""

import math
from dataclasses import replace

import numpy as np
import pytest

from bluefoot_mpc.control.config import ControlConfig
from bluefoot_mpc.control.leveling import LevelStage, LevelWish
from bluefoot_mpc.control.pipeline import Pipeline
from bluefoot_mpc.control.presets import preset
from bluefoot_mpc.leveling import compensator
from bluefoot_mpc.leveling.config import LevelingConfig
from bluefoot_mpc.types import Mode
from tests.control.closed_loop import mode, walk
from tests.io.safety.scripted import make_frame
from tests.leveling.bench import DT, NOW, ROBOT, STANCE, SWINGING, Told, state

WISH = LevelWish(tilt=np.zeros(2), heading=0.2, walking=True, voltage=12.0)
FRAME = make_frame(joint_load=np.full(16, 0.1))


def on(controller="cpg", **leveling) -> ControlConfig:
    config = preset(controller)
    return replace(config, leveling=replace(config.leveling, enabled=True, schedule=NOW, **leveling))


class Watched:
    """A stage whose compensator tells what it was given."""

    def __init__(self, monkeypatch, **leveling):
        self.source = Told(np.zeros(22))
        monkeypatch.setattr(compensator, "make_source", lambda *_: self.source)
        self.stage = LevelStage(ROBOT, on(**leveling).leveling, SWINGING)
        self.given = []
        step = self.stage.compensator.step

        def watched(inputs, dt):
            self.given.append(inputs)
            return step(inputs, dt)

        monkeypatch.setattr(self.stage.compensator, "step", watched)

    def step(self, estimate=None, frame=FRAME, **wish):
        return self.stage.step(STANCE, frame, estimate or state(), replace(WISH, **wish), DT)


@pytest.fixture
def watched(monkeypatch):
    return Watched(monkeypatch)


# What the compensator is given.


@pytest.mark.parametrize(
    ("yaw", "heading", "error"), [(0.5, 0.2, 0.3), (3.1, -3.1, 6.2 - 2.0 * math.pi), (0.5, math.nan, 0.0)]
)
def test_the_heading_error_is_the_short_way_round(watched, yaw, heading, error):
    watched.step(state(rpy=(0.0, 0.0, yaw)), heading=heading)
    assert watched.given[-1].heading_error == pytest.approx(error)


def test_wishes_are_handed_on(watched):
    watched.step(tilt=np.array([0.1, -0.2]), walking=False, voltage=11.0)
    inputs = watched.given[-1]
    np.testing.assert_array_equal(inputs.tilt_reference, [0.1, -0.2])
    np.testing.assert_array_equal(inputs.goals, STANCE)
    assert (inputs.walking, inputs.voltage) == (False, 11.0)


def test_loads_of_servos_that_did_not_answer_are_unknown(watched):
    valid = np.ones(16, dtype=bool)
    valid[3] = False
    watched.step(frame=replace(FRAME, joint_valid=valid))
    np.testing.assert_array_equal(np.isnan(watched.given[-1].joint_load), ~valid)
    assert watched.given[-1].joint_load[0] == 0.1


def test_without_inertial_samples_the_estimate_stands_in(watched):
    watched.step(state(rate=(0.1, 0.2, 0.3)))
    np.testing.assert_array_equal(watched.given[-1].turn_rate, [0.1, 0.2, 0.3])
    assert watched.given[-1].specific_force is None


# Events.


def test_letting_go_and_coming_back_are_told_once(watched):
    told = []
    for k in range(120):
        watched.source.psi = None if k in (5, 6) else np.zeros(22)
        told += [(k, event) for event in watched.step()[1]]
    assert told[0] == (5, "levelling off: nothing predicts the disturbance")
    assert [event for _, event in told[1:]] == ["levelling on again"]
    assert told[1][0] == pytest.approx(6 + 1.0 / DT, abs=1)


def test_another_reason_is_told_too(watched):
    watched.source.psi = None
    watched.step()
    watched.source.fault = "the network has diverged"
    assert watched.step()[1] == ("levelling off: the network has diverged",)
    assert watched.step()[1] == ()
    watched.stage.reset()
    watched.source.fault, watched.source.psi = "", np.zeros(22)
    assert watched.step()[1] == ()


# In the pipeline.


def test_without_levelling_there_is_no_report():
    pipeline = Pipeline(ROBOT, preset("mpc"), DT)
    assert pipeline.step(make_frame(joint_position=STANCE), mode(Mode.STAND)).telemetry.level is None
    assert pipeline.learnt is None


@pytest.mark.parametrize("controller", ["cpg", "mpc"])
def test_with_levelling_there_is_a_report_on_every_tick(controller):
    pipeline = Pipeline(ROBOT, on(controller, psi="zero"), DT)
    for k in range(3):
        frame = make_frame(k * DT, joint_position=STANCE)
        report = pipeline.step(frame, mode(Mode.STAND)).telemetry.level
        assert report.share == 0.0
        assert report.torque.shape == (16,)
    assert pipeline.learnt is None


def test_the_network_of_the_pipeline_can_be_kept():
    assert Pipeline(ROBOT, on(psi="network"), DT).learnt is not None


def test_model_based_control_is_levelled_on_top_of_its_goals():
    assert preset("cpg").leveling.form == "mixed"
    assert preset("mpc").leveling.form == "residual"
    assert not any(preset(name).leveling.enabled for name in ("cpg", "mpc"))


@pytest.mark.parametrize("controller", ["cpg", "mpc"])
def test_levelled_goals_stay_where_the_joints_can_go(monkeypatch, controller):
    pipeline = Pipeline(ROBOT, on(controller, psi="zero"), DT)
    far = np.where(np.arange(16) % 2 == 0, 9.0, -9.0)

    def thrown(stage, goals, *rest):
        leveled, events = step(stage, goals, *rest)
        return replace(leveled, goals=far), events

    step = LevelStage.step
    monkeypatch.setattr(LevelStage, "step", thrown)
    goals = pipeline.step(make_frame(joint_position=STANCE), mode(Mode.STAND)).command.position
    low, high = ROBOT.geometry.physical_lower, ROBOT.geometry.physical_upper
    np.testing.assert_array_equal(goals, np.where(far > 0.0, high, low))


@pytest.fixture
def wishes(monkeypatch):
    """Wishes of every tick of pipelines that are made from now on."""
    found, step = [], LevelStage.step

    def watched(stage, goals, frame, estimate, wish, dt):
        found.append(wish)
        return step(stage, goals, frame, estimate, wish, dt)

    monkeypatch.setattr(LevelStage, "step", watched)
    return found


@pytest.mark.parametrize(
    ("changes", "voltage"),
    [
        ({"voltage": 10.5}, 10.5), ({"voltage": 10.5, "voltage_valid": False}, 12.0),
        ({"voltage": 0.0}, 12.0), ({"voltage": math.nan}, 12.0), ({"voltage": math.inf}, 12.0),
        ({"voltage": -12.0}, 12.0),
    ],
)  # fmt: skip
def test_a_voltage_that_cannot_be_counts_as_nominal(wishes, changes, voltage):
    pipeline = Pipeline(ROBOT, on(psi="zero"), DT)
    pipeline.step(make_frame(joint_position=STANCE, **changes), mode(Mode.STAND))
    assert wishes[-1].voltage == voltage


def test_a_commanded_tilt_and_the_heading_reach_it(wishes):
    pipeline = Pipeline(ROBOT, on(psi="zero"), DT)
    command = walk(0.06, yaw_rate=0.2, rpy=[0.05, -0.04, 0.0])
    for k in range(200):
        pipeline.step(make_frame(k * DT, joint_position=STANCE, joint_time=np.full(16, k * DT)), command)
    np.testing.assert_allclose(wishes[-1].tilt, [0.05, -0.04], atol=1e-3)
    assert wishes[-1].voltage == 12.0
    assert not wishes[0].walking


def test_reset_forgets_what_the_network_has_learnt():
    pipeline = Pipeline(ROBOT, on(psi="network"), DT)
    first = pipeline.learnt
    network = pipeline._level.compensator.source
    network._narx._perceptron.weights[:] += 0.1
    assert not np.array_equal(pipeline.learnt.layers[0], first.layers[0])
    pipeline.reset()
    for layer, before in zip(pipeline.learnt.layers, first.layers, strict=True):
        np.testing.assert_array_equal(layer, before)


def test_levelling_that_ships_is_off():
    assert not LevelingConfig().enabled
    assert ControlConfig().leveling == LevelingConfig()
