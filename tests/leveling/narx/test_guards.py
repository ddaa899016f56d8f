"""What comes in wrong, and what grows too large, does no harm."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.leveling.narx import Narx, NarxConfig, NarxStatus
from tests.leveling.narx.small import INPUT_SCALE, NU, NY, OUTPUT_SCALE, flat, make, run, signals


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
