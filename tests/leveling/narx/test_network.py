import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.leveling.narx import Narx, NarxConfig, NarxStatus
from bluefoot_mpc.leveling.narx.perceptron import Perceptron

NU, NY = 3, 2
INPUT_SCALE, OUTPUT_SCALE = np.array([0.02, 1.0, 10.0]), np.array([5.0, 0.1])
SMALL = {"hidden": (6, 5), "gradient_bound": 0.0}


def make(**values):
    return Narx(NarxConfig(**{**SMALL, **values}), INPUT_SCALE, OUTPUT_SCALE)


def signals(ticks, seed=0):
    rng = np.random.default_rng(seed)
    return rng.normal(size=(ticks, NU)) * INPUT_SCALE, rng.normal(size=(ticks, NY)) * OUTPUT_SCALE


def run(network, ticks=50, seed=0, learn=True):
    u, psi = signals(ticks, seed)
    values = []
    for k in range(ticks):
        network.train(psi[k], learn=learn)
        values.append(network.predict(u[k]).value)
    return np.array(values)


def flat(network):
    return np.concatenate([layer.ravel() for layer in network.weights.layers])


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


def test_observing_follows_the_error_and_learns_nothing():
    network, twin = make(), make()
    before = flat(network)
    run(network, learn=False)
    np.testing.assert_array_equal(flat(network), before)
    assert network.rate == network.config.rate
    assert network.mse > 0.0
    u, psi = signals(50)
    for k in range(50):
        twin.observe(psi[k])
        twin.predict(u[k])
    assert twin.mse == network.mse


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


@pytest.mark.parametrize("feedback", ["output", "target"])
@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_a_bad_target_is_left_out(bad, feedback):
    network, twin = make(feedback=feedback), make(feedback=feedback)
    for each in (network, twin):
        run(each)
    before, mse = flat(network), network.mse
    target = np.ones(NY)
    target[1] = bad
    assert network.train(target) is NarxStatus.BAD_VALUE
    np.testing.assert_array_equal(flat(network), before)
    assert network.mse == mse
    np.testing.assert_array_equal(run(network, seed=1), run(twin, seed=1))


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_bad_inputs_leave_no_trace(bad):
    network, twin = make(delays=2), make(delays=2)
    for each in (network, twin):
        run(each)
    u, psi = signals(1, seed=9)
    inputs = u[0].copy()
    inputs[2] = bad
    mse = network.mse
    prediction = network.predict(inputs)
    assert not prediction.valid
    assert prediction.status is NarxStatus.BAD_VALUE
    np.testing.assert_array_equal(prediction.value, np.zeros(NY))
    # The prediction of the tick before is no longer compared: its target came, and went.
    assert network.train(psi[0]) is NarxStatus.IDLE
    assert network.mse == mse
    # As one who never saw that tick.
    twin._waiting = False
    np.testing.assert_array_equal(run(network, seed=1), run(twin, seed=1))


@settings(max_examples=50, deadline=None)
@given(
    st.lists(
        st.tuples(
            st.lists(st.floats(allow_nan=True, allow_infinity=True), min_size=NU, max_size=NU),
            st.lists(st.floats(allow_nan=True, allow_infinity=True), min_size=NY, max_size=NY),
        ),
        max_size=20,
    )
)
def test_nothing_that_comes_in_makes_it_say_nan(ticks):
    network = make(delays=2, gradient_bound=20.0)
    for u, psi in ticks:
        network.train(np.array(psi))
        prediction = network.predict(np.array(u))
        assert np.isfinite(prediction.value).all()
        assert np.isfinite(flat(network)).all()
        assert np.isfinite([network.mse, network.rate, network.power]).all()


def test_one_outlier_cannot_throw_the_weights():
    moved = {}
    for bound in (0.0, 1.0):
        network = make(gradient_bound=bound)
        run(network)
        before = flat(network)
        network.train(np.full(NY, 1e300))
        moved[bound] = np.linalg.norm(flat(network) - before)
    assert moved[1.0] == pytest.approx(network.rate, rel=1e-9)
    assert moved[0.0] > 10.0 * moved[1.0]


def test_values_are_clamped():
    network, twin = make(value_bound=2.0), make(value_bound=2.0)
    far = network.predict(np.array([1e9, -1e9, 1.0]))
    edge = twin.predict(np.array([2.0, -2.0, 0.1]) * [0.02, 1.0, 10.0])
    np.testing.assert_array_equal(far.value, edge.value)


@pytest.mark.parametrize(
    "values",
    [
        {"rate": 0.3, "rate_max": 0.5},
        {"rate": 0.3, "rate_max": 0.5, "gradient_bound": 20.0, "error_bound": 1.2},
        {"rate": 1e300, "rate_max": 1e301},
        {"weight_bound": 12.0, "error_bound": 1e3},
    ],
)
def test_divergence_is_flagged_and_ends_with_a_reset(values):
    network = Narx(NarxConfig(**{"gradient_bound": 0.0, **values}), np.ones(30), np.ones(10))
    rng = np.random.default_rng(0)
    for _ in range(2000):
        status = network.train(3.0 * rng.normal(size=10))
        prediction = network.predict(rng.normal(size=30))
        if network.diverged:
            break
    assert network.diverged
    assert status is NarxStatus.DIVERGED
    assert prediction.status is NarxStatus.DIVERGED
    assert not prediction.valid
    np.testing.assert_array_equal(prediction.value, np.zeros(10))
    before = flat(network)
    assert np.isfinite(before).all()
    assert network.train(np.ones(10)) is NarxStatus.DIVERGED
    np.testing.assert_array_equal(flat(network), before)
    network.forget()
    assert network.diverged
    network.reset()
    assert not network.diverged
    assert network.predict(np.ones(30)).valid


def test_the_defaults_do_not_diverge_on_the_same_signal():
    network = Narx(NarxConfig(), np.ones(30), np.ones(10))
    rng = np.random.default_rng(0)
    for _ in range(2000):
        network.train(rng.normal(size=10))
        network.predict(rng.normal(size=30))
    assert not network.diverged


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


@pytest.mark.parametrize("bad", [0.0, -1.0, np.nan, np.inf, 1e-200])
def test_bad_scales_are_named(bad):
    with pytest.raises(ConfigurationError, match=r"output_scale\[1\] = .* positive and finite"):
        Narx(NarxConfig(), INPUT_SCALE, np.array([1.0, bad]))
    with pytest.raises(ConfigurationError, match=r"input_scale\[0\]"):
        Narx(NarxConfig(), np.array([bad, 1.0]), OUTPUT_SCALE)
    with pytest.raises(ConfigurationError, match="input_scale must be a vector"):
        Narx(NarxConfig(), np.zeros(0), OUTPUT_SCALE)


def test_first_weights_that_count_as_diverged_are_refused():
    with pytest.raises(
        ConfigurationError, match=r"first weights .* weight_bound = 1000; .* lower weight_scale"
    ):
        make(weight_scale=3000.0)


def test_signals_of_another_size_are_refused():
    network = make()
    with pytest.raises(ConfigurationError, match=r"\(1,\) came where \(3,\)"):
        network.predict(np.ones(1))
    with pytest.raises(ConfigurationError, match=r"\(3,\) came where \(2,\)"):
        network.train(np.ones(3))
