import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bluefoot_mpc.leveling.narx.perceptron import Perceptron, random_weights


def make(sizes, seed=0, scale=1.0):
    rng = np.random.default_rng(seed)
    network = Perceptron(sizes)
    network.weights[:] = random_weights(sizes, scale, rng)
    network.inputs[:] = rng.normal(size=sizes[0])
    return network, rng.normal(size=sizes[-1])


def loss(network, target):
    return 0.5 * float(np.sum((network.forward() - target) ** 2))


def differences(network, target, step=1e-6):
    found = np.zeros_like(network.weights)
    for index in range(len(found)):
        kept = network.weights[index]
        network.weights[index] = kept + step
        above = loss(network, target)
        network.weights[index] = kept - step
        below = loss(network, target)
        network.weights[index] = kept
        found[index] = (above - below) / (2.0 * step)
    return found


def test_forward_is_two_layers_of_bipolar_sigmoids_and_a_linear_one():
    network, _ = make((5, 4, 3, 2))
    x = network.inputs
    for index, layer in enumerate(network.layers):
        x = layer[:, :-1] @ x + layer[:, -1]
        if index < 2:
            x = (1.0 - np.exp(-2.0 * x)) / (1.0 + np.exp(-2.0 * x))
    np.testing.assert_allclose(network.forward(), x, rtol=1e-13)


@settings(max_examples=20, deadline=None)
@given(
    st.tuples(*[st.integers(1, 6)] * 4),
    st.integers(0, 1000),
    st.floats(0.1, 3.0),
)
def test_gradient_by_finite_differences(sizes, seed, scale):
    network, target = make(sizes, seed, scale)
    wanted = differences(network, target)
    norm = network.backward(network.forward() - target)
    np.testing.assert_allclose(network.gradient(), wanted, rtol=1e-5, atol=1e-7)
    assert norm == pytest.approx(np.linalg.norm(network.gradient()), rel=1e-12)


def test_gradient_at_the_robots_size():
    network, target = make((78, 50, 50, 22))
    network.backward(network.forward() - target)
    gradient = network.gradient()
    rng = np.random.default_rng(1)
    kept = network.weights.copy()
    for _ in range(20):
        way = rng.normal(size=len(kept))
        way /= np.linalg.norm(way)
        network.weights[:] = kept + 1e-5 * way
        above = loss(network, target)
        network.weights[:] = kept - 1e-5 * way
        below = loss(network, target)
        assert (above - below) / 2e-5 == pytest.approx(gradient @ way, rel=1e-5, abs=1e-6)


def test_descent_is_minus_step_times_the_gradient():
    network, target = make((5, 4, 3, 2))
    before = network.weights.copy()
    network.backward(network.forward() - target)
    gradient = network.gradient()
    network.descend(0.01)
    np.testing.assert_allclose(network.weights, before - 0.01 * gradient, rtol=1e-14, atol=1e-16)


def test_layers_are_views_on_the_weights():
    network, _ = make((5, 4, 3, 2))
    network.layers[1][2, 3] = 7.0
    assert (network.weights == 7.0).sum() == 1
    assert len(network.weights) == 4 * 6 + 3 * 5 + 2 * 4
    assert network.norm() == pytest.approx(np.linalg.norm(network.weights))


def test_no_array_moves_while_it_works():
    network, target = make((5, 4, 3, 2))
    places = [network.weights.ctypes.data, network.output.ctypes.data, network.inputs.ctypes.data]
    for _ in range(3):
        network.backward(network.forward() - target)
        network.descend(0.01)
    assert places == [network.weights.ctypes.data, network.output.ctypes.data, network.inputs.ctypes.data]


def test_first_weights_have_the_stated_spread():
    sizes = (99, 50, 50, 22)
    weights = random_weights(sizes, 2.0, np.random.default_rng(0))
    assert weights[: 50 * 100].std() == pytest.approx(2.0 / 10.0, rel=0.05)
    assert weights[50 * 100 : 50 * 151].std() == pytest.approx(2.0 / np.sqrt(51), rel=0.05)
