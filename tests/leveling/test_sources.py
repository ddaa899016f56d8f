"""Where the disturbance of the coming period comes from."""

import math
from dataclasses import replace

import numpy as np
import pytest

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.leveling.config import LevelingConfig, ScheduleConfig
from bluefoot_mpc.leveling.narx import Narx, NarxConfig, load_weights, save_weights
from bluefoot_mpc.leveling.signals import INPUT_SCALE, OUTPUT_SCALE
from bluefoot_mpc.leveling.sources import Network, Situation, make_source
from bluefoot_mpc.leveling.trunk_dynamics import TrunkDynamics
from bluefoot_mpc.model.dynamics import Dynamics
from tests.leveling.bench import DT, ROBOT

DYNAMICS = Dynamics(ROBOT, rotor_inertia=True)
RNG = np.random.default_rng(2)
TARGET = RNG.normal(0.0, 1.0, 22) * OUTPUT_SCALE
SITUATION = Situation(
    target=TARGET, inputs=RNG.normal(0.0, 1.0, 56) * INPUT_SCALE, q=ROBOT.default_stance(),
    v=RNG.normal(0.0, 0.5, 22), forces=RNG.normal(0.0, 5.0, (4, 3)), learn=True,
    turn=TrunkDynamics.of(DYNAMICS.mass_matrix(ROBOT.default_stance())).from_force,
)  # fmt: skip
UNKNOWN = replace(SITUATION, target=None)
BLIND = replace(SITUATION, inputs=np.full(56, np.nan))


def source(psi, **config):
    return make_source(LevelingConfig(psi=psi, **config), DYNAMICS)


def network(learn_time=0.0, **config) -> Network:
    return source("network", schedule=ScheduleConfig(learn_time=learn_time), **config)


def test_zero_is_zero():
    assert not source("zero").step(SITUATION, DT).any()


def test_persistence_is_the_last_measured_one():
    made = source("persistence")
    np.testing.assert_array_equal(made.step(SITUATION, DT), TARGET)
    assert made.step(UNKNOWN, DT) is None


def test_the_models_is_ground_forces_less_bias():
    q, v, forces = SITUATION.q, SITUATION.v, SITUATION.forces
    expected = np.einsum("lij,li->j", DYNAMICS.foot_jacobians(q), forces) - DYNAMICS.bias(q, v)
    np.testing.assert_allclose(source("model").step(UNKNOWN, DT), expected, atol=1e-10)


def test_the_models_without_contact_is_the_bias_alone():
    flying = replace(SITUATION, forces=np.zeros((4, 3)))
    expected = -DYNAMICS.bias(SITUATION.q, SITUATION.v)
    np.testing.assert_allclose(source("model").step(flying, DT), expected, atol=1e-12)


def test_standing_still_the_model_needs_what_the_servos_hold():
    weight = np.tile([0.0, 0.0, 0.25 * DYNAMICS.mass * 9.81], (4, 1))
    standing = replace(SITUATION, v=np.zeros(22), forces=weight)
    found = source("model").step(standing, DT)
    np.testing.assert_allclose(found[:6], 0.0, atol=0.02)  # nothing turns or lifts the trunk


@pytest.mark.parametrize("psi", ["zero", "persistence", "model"])
def test_sources_without_a_network_have_nothing_to_tell_of_it(psi):
    made = source(psi)
    assert (made.ready, made.fault, made.doubt) == (True, "", "")
    assert math.isnan(made.mse)
    assert math.isnan(made.rate)
    assert made.weights is None


def test_the_network_is_the_network_with_the_stated_scales():
    made, plain = network(), Narx(NarxConfig(), INPUT_SCALE, OUTPUT_SCALE)
    for k in range(5):
        now = replace(SITUATION, inputs=SITUATION.inputs * (1.0 + k))
        plain.train(TARGET)
        np.testing.assert_array_equal(made.step(now, DT), plain.predict(now.inputs).value)
        assert (made.mse, made.rate) == (plain.mse, plain.rate)


def test_the_network_learns_what_comes():
    made = network()
    errors = [np.abs((made.step(SITUATION, DT) - TARGET) / OUTPUT_SCALE).max() for _ in range(300)]
    assert errors[-1] < 0.05 * errors[0]


def test_the_network_does_not_learn_when_it_may_not():
    made = network()
    first = [layer.copy() for layer in made.weights.layers]
    for _ in range(20):
        made.step(replace(SITUATION, learn=False), DT)
    for layer, before in zip(made.weights.layers, first, strict=True):
        np.testing.assert_array_equal(layer, before)
    assert made.mse > 0.0  # it follows its error all the same
    made.step(SITUATION, DT)
    assert not np.array_equal(made.weights.layers[2], first[2])


def test_an_untrained_network_is_ready_after_its_time_of_learning():
    made = network(learn_time=0.2)
    ready = []
    for k in range(30):
        made.step(replace(SITUATION, learn=k % 2 == 0), DT)
        ready.append(made.ready)
    assert ready.index(True) == 18  # the tenth tick of learning
    assert all(ready[18:])


def test_without_a_target_no_time_is_learnt():
    made = network(learn_time=0.04)
    for _ in range(10):
        made.step(UNKNOWN, DT)
    assert not made.ready


def test_an_input_that_is_no_number_gives_no_prediction_and_passes():
    made = network()
    assert made.step(BLIND, DT) is None
    assert np.isfinite(made.step(SITUATION, DT)).all()
    assert made.fault == ""


@pytest.mark.parametrize("value", [np.nan, np.inf, 1e9])
def test_sabotaged_weights_are_a_fault_within_two_ticks(value):
    made = network()
    for _ in range(5):
        made.step(SITUATION, DT)
    made._narx._perceptron.weights[::7] = value
    with np.errstate(all="ignore"):
        for _ in range(2):
            predicted = made.step(SITUATION, DT)
    assert predicted is None
    assert "diverged" in made.fault
    assert made.weights is None
    made.reset()
    assert (made.fault, made.ready) == ("", True)
    assert np.isfinite(made.step(SITUATION, DT)).all()


def test_a_network_that_is_worse_than_nothing_is_doubted_until_it_is_not():
    made = network(narx=NarxConfig(weight_scale=2.0))
    doubts = []
    for _ in range(400):
        made.step(replace(SITUATION, target=0.2 * TARGET), DT)
        doubts.append(made.doubt)
    assert "worse than nothing" in doubts[20]
    assert doubts[-1] == ""


def test_a_network_is_trusted_as_far_as_it_explains_the_disturbance():
    made = network(narx=NarxConfig(weight_scale=2.0))
    assert made.trust == 0.0
    seen = []
    made.step(SITUATION, DT)
    for _ in range(600):
        made.step(replace(SITUATION, target=0.2 * TARGET), DT)
        seen.append(made.trust)
    assert seen[20] == 0.0
    assert seen[-1] > 0.9
    made.reset()
    assert made.trust == 0.0


def test_weights_that_were_saved_are_used_at_once_and_after_reset(tmp_path):
    taught = network()
    for _ in range(200):
        taught.step(SITUATION, DT)
    save_weights(tmp_path / "narx.npz", taught.weights)
    made = network(learn_time=100.0, weights=str(tmp_path / "narx.npz"))
    for _ in range(2):
        assert made.ready
        for layer, saved in zip(made.weights.layers, load_weights(tmp_path / "narx.npz").layers, strict=True):
            np.testing.assert_array_equal(layer, saved)
        for _ in range(3):
            made.step(SITUATION, DT)
        made.reset()


def test_weights_of_another_network_are_refused_with_the_way_out(tmp_path):
    other = Narx(NarxConfig(hidden=(20, 50)), INPUT_SCALE, OUTPUT_SCALE)
    save_weights(tmp_path / "narx.npz", other.weights)
    with pytest.raises(ConfigurationError, match="hidden.*train anew"):
        network(weights=str(tmp_path / "narx.npz"))
