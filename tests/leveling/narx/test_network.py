import numpy as np
import pytest

from bluefoot_mpc.leveling.narx import Narx, NarxConfig, NarxStatus
from bluefoot_mpc.leveling.narx.perceptron import Perceptron
from tests.leveling.narx.small import INPUT_SCALE, NU, NY, OUTPUT_SCALE, flat, make, run, signals


def output(weights, line, sizes):
    """Scaled output of a network of its own for a delay line as it stood."""
    other = Perceptron(sizes)
    other.weights[:] = weights
    other.inputs[:] = line
    return other.forward().copy()


@pytest.mark.parametrize("feedback", ["output", "target"])
@pytest.mark.parametrize("delays", [1, 3])
def test_delay_lines_hold_the_last_samples_newest_first(delays, feedback):
    network = make(delays=delays, feedback=feedback)
    u, psi = signals(6)
    sizes = (delays * (NU + NY), 6, 5, NY)
    samples = [np.zeros(NY)]  # what is fed back at tick k: known or foretold for time k
    for k in range(6):
        network.train(psi[k])
        if feedback == "target":
            samples[k] = psi[k] / OUTPUT_SCALE
        line = np.zeros(sizes[0])
        for lag in range(min(delays, k + 1)):
            line[lag * NU : (lag + 1) * NU] = u[k - lag] / INPUT_SCALE
            start = delays * NU + lag * NY
            line[start : start + NY] = samples[k - lag]
        wanted = output(flat(network), line, sizes)
        np.testing.assert_allclose(network.predict(u[k]).value, wanted * OUTPUT_SCALE, rtol=1e-12)
        samples.append(wanted)


@pytest.mark.parametrize("feedback", ["output", "target"])
def test_training_uses_the_line_of_the_tick_before(feedback):
    """The step of the weights is the gradient of ½|N(line of k-1) - ψ_k|²: one tick off, and it differs."""
    network = make(delays=2, feedback=feedback, beta=0.0)
    u, psi = signals(8)
    sizes = (2 * (NU + NY), 6, 5, NY)
    for k in range(7):
        network.train(psi[k])
        network.predict(u[k])
    line = network._perceptron.inputs.copy()
    before = flat(network)

    def loss(weights):
        return 0.5 * np.sum((output(weights, line, sizes) - psi[7] / OUTPUT_SCALE) ** 2)

    gradient = np.zeros_like(before)
    for index in range(len(before)):
        step = np.zeros_like(before)
        step[index] = 1e-6
        gradient[index] = (loss(before + step) - loss(before - step)) / 2e-6
    assert network.train(psi[7]) is NarxStatus.OK
    np.testing.assert_allclose(flat(network) - before, -network.rate * gradient, rtol=1e-4, atol=1e-9)


def test_the_target_of_a_pure_delay_is_matched_one_step_late():
    """ψ_{k+1} = f(u_k) of white noise: against the prediction of any other tick nothing could be learnt."""
    rng = np.random.default_rng(4)
    u = rng.uniform(-1.0, 1.0, size=(4001, 1))
    psi = np.zeros((4002, 1))
    psi[1:] = np.sin(2.0 * u)
    network = Narx(NarxConfig(), np.ones(1), np.ones(1))
    errors = []
    for k in range(4001):
        network.train(psi[k])
        errors.append(network.predict(u[k]).value[0] - psi[k + 1, 0])
    assert np.sqrt(np.mean(np.square(errors[-500:]))) < 0.1 * psi.std()


def test_mse_and_power_follow_their_recursion_and_the_rate_the_bold_driver():
    network = make(beta=1e-2, zeta=0.7, rate=0.005)
    u, psi = signals(80)
    mse, power, rate, predicted = 0.0, 0.0, 0.005, None
    for k in range(80):
        network.train(psi[k])
        if predicted is not None:
            old = mse
            mse = 0.01 * np.sum(((predicted - psi[k]) / OUTPUT_SCALE) ** 2) + 0.99 * mse
            power = 0.01 * np.sum((psi[k] / OUTPUT_SCALE) ** 2) + 0.99 * power
            rate = min(max(rate * (1 - 1e-2 if mse > old else 1 + 0.7e-2), 1e-5), 0.03)
        assert network.mse == pytest.approx(mse, rel=1e-12)
        assert network.power == pytest.approx(power, rel=1e-12)
        assert network.rate == pytest.approx(rate, rel=1e-12)
        predicted = network.predict(u[k]).value
    assert rate != 0.005


@pytest.mark.parametrize("feedback", ["output", "target"])
def test_reset_is_the_state_after_init_bit_for_bit(feedback):
    network = make(delays=3, feedback=feedback)
    first = run(network)
    network.predict(np.full(NU, np.nan))
    state = network.mse, network.power, network.rate
    network.reset()
    assert (network.mse, network.power, network.rate) == (0.0, 0.0, 0.01)
    np.testing.assert_array_equal(run(network), first)
    network.reset()
    np.testing.assert_array_equal(flat(network), flat(make(delays=3)))
    run(network)
    assert (network.mse, network.power, network.rate) == state


def test_other_seeds_give_other_weights():
    assert not np.array_equal(flat(make(seed=1)), flat(make(seed=2)))
    np.testing.assert_array_equal(flat(make(seed=1)), flat(make(seed=1)))


def test_forget_empties_the_lines_alone():
    network = make(delays=2)
    run(network)
    before, state = flat(network), (network.mse, network.rate)
    network.forget()
    np.testing.assert_array_equal(flat(network), before)
    assert (network.mse, network.rate) == state
    assert network.train(np.ones(NY)) is NarxStatus.IDLE
    other = make(delays=2)
    other.load_weights(network.weights)
    np.testing.assert_array_equal(run(network, learn=False), run(other, learn=False))


def test_without_learning_the_error_alone_is_followed():
    network = make()
    before = flat(network)
    values = run(network, learn=False)
    np.testing.assert_array_equal(flat(network), before)
    assert network.rate == network.config.rate
    errors = (values[:-1] - signals(50)[1][1:]) / OUTPUT_SCALE
    mse = 0.0
    for error in errors:
        mse = 0.99 * mse + 0.01 * np.sum(error**2)
    assert network.mse == pytest.approx(mse, rel=1e-12)


def test_a_prediction_is_compared_once():
    network = make()
    u, psi = signals(2)
    assert network.train(psi[0]) is NarxStatus.IDLE
    network.predict(u[0])
    assert network.train(psi[1]) is NarxStatus.OK
    before, mse = flat(network), network.mse
    assert network.train(psi[1]) is NarxStatus.IDLE
    np.testing.assert_array_equal(flat(network), before)
    assert network.mse == mse


def test_a_prediction_is_not_written_over():
    network = make()
    u, _ = signals(2)
    first = network.predict(u[0]).value
    kept = first.copy()
    network.predict(u[1])
    np.testing.assert_array_equal(first, kept)


def test_signals_are_not_written_to():
    network = make()
    u, psi = signals(2)
    u.setflags(write=False)
    psi.setflags(write=False)
    network.train(psi[0])
    network.predict(u[0])
    assert network.train(psi[1]) is NarxStatus.OK
