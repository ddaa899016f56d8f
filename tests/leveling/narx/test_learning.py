"""A known difference equation is learnt on line: y_{k+1} = y_k / (1 + y_k²) + u_k³.

Narendra and Parthasarathy, Identification and control of dynamical systems using neural networks, 1990.
"""

import numpy as np
import pytest

from bluefoot_mpc.leveling.narx import Narx, NarxConfig

UNIT_U, UNIT_Y = 0.02, 30.0
TICKS = 12_000
SETTLE = 50


def plant(u):
    y = np.zeros(len(u) + 1)
    for k, value in enumerate(u):
        y[k + 1] = y[k] / (1.0 + y[k] ** 2) + value**3
    return y


@pytest.fixture(scope="module")
def record():
    u = np.random.default_rng(1).uniform(-1.0, 1.0, TICKS)
    return u, plant(u)


@pytest.fixture(scope="module")
def held_out():
    k = np.arange(1000)
    u = 0.5 * (np.sin(2.0 * np.pi * k / 25.0) + np.sin(2.0 * np.pi * k / 10.0))
    return u, plant(u)


def follow(network, u, y, learn):
    """Errors of one-step predictions, the network being told y one step late."""
    errors = np.zeros(len(u))
    for k in range(len(u)):
        network.train(y[k : k + 1] * UNIT_Y, learn=learn)
        prediction = network.predict(u[k : k + 1] * UNIT_U)
        assert prediction.valid
        errors[k] = prediction.value[0] / UNIT_Y - y[k + 1]
    return errors


def rms(values):
    return float(np.sqrt(np.mean(np.square(values[SETTLE:]))))


def linear_errors(record, held_out, feedback):
    """Errors of the best linear predictor, fitted to the whole record at once, fed back like the network."""
    u, y = record
    fit = np.linalg.lstsq(np.stack([u, y[:-1], np.ones_like(u)], axis=1), y[1:], rcond=None)[0]
    u, y = held_out
    predicted = np.zeros(len(y))
    for k in range(len(u)):
        known = y[k] if feedback == "target" else predicted[k]
        predicted[k + 1] = fit @ (u[k], known, 1.0)
    return predicted[1:] - y[1:]


@pytest.mark.parametrize("seed", [0, 1])
@pytest.mark.parametrize(("feedback", "share"), [("target", 0.5), ("output", 0.85)])
def test_a_nonlinear_difference_equation_is_learnt(record, held_out, feedback, share, seed):
    config = NarxConfig(feedback=feedback, weight_scale=1.5, seed=seed)
    network = Narx(config, np.array([UNIT_U]), np.array([UNIT_Y]))
    before = rms(follow(network, *held_out, learn=False))
    network.reset()
    follow(network, *record, learn=True)
    network.forget()
    error = rms(follow(network, *held_out, learn=False))
    y = held_out[1]
    persistence, zero = rms(y[1:] - y[:-1]), rms(y[1:])
    linear = rms(linear_errors(record, held_out, feedback))
    assert error < share * min(persistence, zero, linear, before)


def test_the_error_falls_while_it_learns(record):
    network = Narx(NarxConfig(feedback="target"), np.array([UNIT_U]), np.array([UNIT_Y]))
    errors = follow(network, *record, learn=True)
    assert rms(errors[-1000:]) < 0.4 * rms(errors[:1000])
    assert network.mse < 0.05 * network.power
    assert network.mse == pytest.approx(np.mean(errors[-300:] ** 2), rel=0.5)


def test_twice_the_unit_and_twice_the_signal_is_the_same(record):
    u, y = (part[:200] for part in record)
    plain, double = (Narx(NarxConfig(delays=2), np.array([scale]), np.array([scale])) for scale in (1.0, 2.0))
    for k in range(200):
        plain.train(y[k : k + 1])
        double.train(2.0 * y[k : k + 1])
        one, two = plain.predict(u[k : k + 1]), double.predict(2.0 * u[k : k + 1])
        np.testing.assert_array_equal(2.0 * one.value, two.value)


def test_many_outputs_learn_a_map_better_than_persistence():
    rng = np.random.default_rng(3)
    turn = 2.0 * np.pi * np.arange(1501)[:, None] / 50.0
    inputs = np.sin(turn + rng.uniform(0.0, 6.0, 56)) + 0.1 * rng.normal(size=(1501, 56))
    mix = rng.normal(size=(22, 56)) / np.sqrt(56)
    targets = np.vstack([np.zeros(22), np.tanh(inputs[:-1] @ mix.T)]) + 0.05 * rng.normal(size=(1501, 22))
    network = Narx(NarxConfig(), np.ones(56), np.ones(22))
    errors = []
    for k in range(1500):
        network.train(targets[k])
        errors.append(network.predict(inputs[k]).value - targets[k + 1])
    late = np.array(errors[1000:])
    steps = targets[1001:] - targets[1000:-1]
    assert np.sqrt(np.mean(late**2)) < 0.8 * np.sqrt(np.mean(steps**2))
